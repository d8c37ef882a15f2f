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

"""Read the signals of a run for metrics and plots: SI arrays on the experiment's clock."""

from typing import TYPE_CHECKING

import numpy as np
from pam_sim.annotations import FloatArray

if TYPE_CHECKING:
    from pam_sim.run import Run


def stamps_s(run: 'Run', topic: str) -> FloatArray | None:
    """Return the stamps of a topic [s since the experiment's start], or None if missing."""
    series_ = run.topics.get(topic)
    if series_ is None or not len(series_.stamp_ns):
        return None
    return (np.asarray(series_.stamp_ns) - start_ns(run)) * 1e-9


def start_ns(run: 'Run') -> int:
    """Return the first reference stamp, else the first stamp of the valve or any topic."""
    for topic in ('reference', 'joint_reference', 'pressure_command', 'valve_signal'):
        series_ = run.topics.get(topic)
        if series_ is not None and len(series_.stamp_ns):
            return int(series_.stamp_ns[0])
    first = [int(s.stamp_ns[0]) for s in run.topics.values() if len(s.stamp_ns)]
    return min(first) if first else 0


def markers(run: 'Run') -> list[tuple[float, str]]:
    """Return (time [s since the experiment's start], text) of the markers of a recorded run."""
    begin_ns = start_ns(run)
    return [((one.stamp_ns - begin_ns) * 1e-9, one.text) for one in getattr(run, 'markers', ())]


def duration_s(run: 'Run') -> float:
    """Return the time from the first to the last stamp of all topics [s]."""
    spans = [(int(s.stamp_ns[0]), int(s.stamp_ns[-1]))
             for s in run.topics.values() if len(s.stamp_ns)]
    if not spans:
        return 0.0
    return (max(last for _, last in spans) - min(first for first, _ in spans)) * 1e-9


def series(run: 'Run', topic: str,
           field: str | None = None) -> tuple[FloatArray, FloatArray] | None:
    """
    Return (time_s, value) of a topic's field, or None if it is not in the run.

    Parameters
    ----------
    run : pam_sim.run.Run
        The recording.
    topic : str
        Short topic name, for example ``pressure``.
    field : str, optional
        Name among the topic's values; the first one by default.

    """
    time_s = stamps_s(run, topic)
    if time_s is None:
        return None
    values = run.topics[topic].values
    if field is None:
        if not values:
            return None
        field = next(iter(values))
    if field not in values:
        return None
    value = np.asarray(values[field], dtype=float)
    good = np.isfinite(value)
    return (time_s[good], value[good]) if good.any() else None
