# Copyright 2026 pam_actuation developers
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""The recorded signals: names, fields of a run, units."""

import numpy as np
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.run import Run, Series

SIGNALS = ('pressure', 'contraction', 'force')
FIELD = {'pressure': 'pressure_pa', 'contraction': 'contraction_m', 'force': 'force_n'}
UNIT = {'pressure': 'Pa', 'contraction': 'm', 'force': 'N'}
# For people: factor from SI and unit.
READABLE = {'pressure': (1e-3, 'kPa'), 'contraction': (1e3, 'mm'), 'force': (1.0, 'N')}
VALVE_FIELDS = {'ppr': ('ppr_voltage',), 'hsv': ('fill_duty', 'vent_duty')}


def recorded_valve(run: Run) -> str:
    """Return ``ppr``, ``hsv`` or '' by what the valve signal of the run is named."""
    return next((valve for valve in VALVE_FIELDS if tells_of(run, valve)), '')


def tells_of(run: Run, valve: str) -> bool:
    """Return whether a run holds the signal of a valve."""
    return 'valve_signal' in run and all(
        name in run.topics['valve_signal'].values for name in VALVE_FIELDS[valve])


def ordered(series: Series, field: str) -> tuple[IntArray, FloatArray]:
    """Return (stamp_ns, value) sorted by stamp; the later one of equal stamps counts."""
    stamp = np.asarray(series.stamp_ns, dtype=np.int64)
    value = np.asarray(series.values[field], dtype=float)
    good = np.isfinite(value)
    stamp, value = stamp[good], value[good]
    order = np.argsort(stamp, kind='stable')
    stamp, value = stamp[order], value[order]
    last = np.append(np.diff(stamp) > 0, True)[:stamp.size]
    return stamp[last], value[last]
