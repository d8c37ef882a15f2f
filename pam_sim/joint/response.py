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

"""What a simulation of a joint returns."""

from typing import TYPE_CHECKING

from pam_sim.annotations import FloatArray
from pam_sim.joint.layout import OUTPUT
from pam_sim.joint.parameters import SIDES
from pam_sim.records import columns
from pam_sim.response import brief_span, Response

if TYPE_CHECKING:
    import pandas as pd

OWN = OUTPUT.names or ()


class JointResponse:
    """
    Signals of a simulated joint, each an ndarray of shape (N + 1,), row 0 the start.

    Attributes
    ----------
    time_s : ndarray
        Seconds since the start.
    angle_rad, velocity_rad_per_s, acceleration_rad_per_s2 : ndarray
        True motion of the joint, flexion positive.
    torque_n_m : ndarray
        Torque of both tendons together, flexion positive.
    flexor, extensor : pam_sim.response.Response
        Pressure, contraction, tension and the rest of each muscle.

    """

    def __init__(self, outputs: FloatArray, flexor: FloatArray, extensor: FloatArray) -> None:
        self.outputs = outputs
        self.flexor = Response(flexor)
        self.extensor = Response(extensor)
        seen = columns(outputs, OUTPUT)
        self.time_s = seen['time_s']
        self.angle_rad = seen['angle_rad']
        self.velocity_rad_per_s = seen['velocity_rad_per_s']
        self.acceleration_rad_per_s2 = seen['acceleration_rad_per_s2']
        self.torque_n_m = seen['torque_n_m']

    def __len__(self) -> int:
        """Return the number of samples, N + 1."""
        return len(self.outputs)

    def __repr__(self) -> str:
        """Return length and names in one line."""
        return (f'JointResponse({len(self)} samples, {brief_span(self.time_s)}: {", ".join(OWN)}; '
                'flexor, extensor)')

    def as_dict(self) -> dict[str, FloatArray]:
        """Return name -> ndarray; names of a muscle begin with ``flexor/`` or ``extensor/``."""
        signals = {name: getattr(self, name) for name in OWN}
        for side in SIDES:
            signals.update({f'{side}/{name}': values
                            for name, values in getattr(self, side).as_dict().items()})
        return signals

    def to_dataframe(self) -> 'pd.DataFrame':
        """Return all signals as one pandas table, named as in ``as_dict``, a row per sample."""
        import pandas as pd     # takes a second to load
        return pd.DataFrame(self.as_dict())
