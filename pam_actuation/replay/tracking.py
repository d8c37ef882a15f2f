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

"""How well a reference was tracked: in a recording, and in its repetition."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from pam_actuation.bags.load_joint import MEASURED
from pam_actuation.control.sent_reference import SILENT_S, wanted_at
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.run import Run

# What is tracked: topic and field of the reference, of the measurement; factor and unit to read.
_PAIRS = (('reference', 'contraction_m', 'contraction', 1e3, 'mm', 'm'),
          ('reference', 'force_n', 'force', 1.0, 'N', 'N'),
          ('joint_reference', 'angle_rad', MEASURED, 1e3, 'mrad', 'rad'))


@dataclass(frozen=True)
class Tracking:
    """Tracking error of one quantity, root mean square, SI: as recorded and as repeated."""

    quantity: str
    unit: str
    recorded: float
    replayed: float

    def to_dict(self) -> dict[str, object]:
        """Return plain data for ``--json``."""
        return {'quantity': self.quantity, 'unit': self.unit, 'recorded_rmse': self.recorded,
                'replayed_rmse': self.replayed}

    def line(self) -> str:
        """Return it in words."""
        factor, unit = next((pair[3], pair[4]) for pair in _PAIRS if pair[2] == self.quantity)
        change = '' if not self.recorded else 'the same' if self.replayed == self.recorded else (
            f'{abs(100.0 * (self.replayed / self.recorded - 1.0)):.3g} % '
            f'{"better" if self.replayed < self.recorded else "worse"}')
        return (f'  tracking of {self.quantity}: rms error {self.recorded * factor:.4g} {unit} '
                f'recorded, {self.replayed * factor:.4g} {unit} repeated'
                + (f': {change}' if change else ''))


def tracking(run: Run, stamp_ns: Mapping[str, IntArray], recorded: Mapping[str, FloatArray],
             replayed: Mapping[str, FloatArray]) -> tuple[Tracking, ...]:
    """
    Return the tracking errors of a repeated experiment; none where no reference was recorded.

    Parameters
    ----------
    run : pam_sim.run.Run
        The recording, with its reference.
    stamp_ns, recorded, replayed : dict of str to numpy.ndarray
        By ``topic.field``, as of ``ChainReplay``.

    """
    found = []
    for topic, field, measured, _, _, unit in _PAIRS:
        name = f'{measured}.{field}'
        if topic not in run or name not in recorded:
            continue
        wanted = run[topic]
        values = wanted.values.get(field)
        if values is None or len(values) < 2:
            continue
        at = stamp_ns[name]
        asked = wanted_at(at, wanted.stamp_ns, values, 1e9 * SILENT_S)
        inside = (at >= wanted.stamp_ns[0]) & (at <= wanted.stamp_ns[-1]) & np.isfinite(
            asked + recorded[name] + replayed[name])
        if inside.any():
            found.append(Tracking(measured, unit, *(
                float(np.sqrt(np.mean((asked - one[name])[inside] ** 2)))
                for one in (recorded, replayed))))
    return tuple(found)
