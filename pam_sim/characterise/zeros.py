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

"""Zeros of the sensors that the rig of a recording states: they belong to no muscle."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pam_sim.rig import Rig
from pam_sim.run import Run, Series

# Number of the rig, topic, field, factor to the unit in which it is told.
_READINGS = (
    ('pressure_zero_pa', 'pressure', 'pressure_pa', 1e-3, 'kPa'),
    ('contraction_zero_m', 'contraction', 'contraction_m', 1e3, 'mm'),
    ('force_zero_n', 'force', 'force_n', 1.0, 'N'),
)


def without_zeros(runs: Sequence[Run], rigs: Sequence[Rig | None]) -> tuple[list[Run], list[str]]:
    """
    Return (runs without the zeros that their rigs state, what was taken off in sentences).

    Parameters
    ----------
    runs : list of pam_sim.run.Run
        They stay as they are; those returned share what did not change.
    rigs : list of pam_sim.rig.Rig or None
        That of each run. A zero that it states as unknown is told, and not taken off.

    """
    corrected: list[Run] = []
    told: dict[str, list[str]] = {}
    for run, rig in zip(runs, rigs):
        changed: dict[str, Series] = {}
        for name, topic, key, factor, unit in _READINGS:
            if rig is None or topic not in run:
                continue
            zero = rig.parameters[name]
            if name in rig.unknown:
                said = f'the rig does not know its `{name}`, so the readings count as they are.'
                told.setdefault(said, []).append(run.path)
            elif zero != 0.0:
                series = run[topic]
                values = np.asarray(series[key], dtype=float) - zero
                changed[topic] = replace(series, values={**series.values, key: values})
                said = (f'the rig states `{name}`, {factor * zero:.4g} {unit}, which was taken '
                        'off the readings.')
                told.setdefault(said, []).append(run.path)
        corrected.append(replace(run, topics={**run.topics, **changed}) if changed else run)
    return corrected, [
        f'{"All recordings" if len(paths) == len(runs) > 1 else ", ".join(paths)}: {said}'
        for said, paths in told.items()]
