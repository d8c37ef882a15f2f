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

"""The numbers a rig has besides those of its effects."""

from pam_sim.errors import InputError
from pam_sim.load import LOADS
from pam_sim.muscle.muscle import MUSCLE_PARAMETERS
from pam_sim.parameters import Parameter
from pam_sim.sensors.zeros import ZEROS
from pam_sim.valve import hsv, ppr

_OF_ALL_LOADS = {p.name for group in (
    MUSCLE_PARAMETERS, ppr.PARAMETERS, hsv.PARAMETERS, ZEROS) for p in group}
for _load in LOADS.values():
    for _parameter in _load.PARAMETERS:
        if _parameter.name in _OF_ALL_LOADS:
            raise InputError(f'`{_parameter.name}` is a number of muscle, valve or sensor; give '
                             'that of the load another name', str(_load.__file__))


def rig_parameters(load: str) -> tuple[Parameter, ...]:
    """Return the Parameters a rig with this load has, in the order of model files."""
    return (*MUSCLE_PARAMETERS, *LOADS[load].PARAMETERS, *ppr.PARAMETERS, *hsv.PARAMETERS, *ZEROS)
