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

"""The static inverse of a controller file: its own table, or that of the mode or the rig."""

from typing import TYPE_CHECKING

from pam_actuation.control.static_inverse import static_inverse, tabulate_static_inverse
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.joint.rig import JointRig
from pam_sim.keys import Key, names_of
from pam_sim.located_yaml import Located

if TYPE_CHECKING:
    from pam_actuation.control.modes.force import ForceMode
    from pam_actuation.control.modes.joint import JointMode
    from pam_sim.rig import Rig

INVERSE = Key('static_inverse', dict, 'Pressure over contraction at rest, as a recording '
              'keeps it.', otherwise='from the rig')
INVERSE_KEYS = (
    Key('lower_m', float, 'Contraction of the first pressure.', required=True, unit='m',
        lower=-0.1, upper=0.3),
    Key('step_m', float, 'Contraction between two pressures.', required=True, unit='m',
        lower=1e-6, upper=0.1),
    Key('pressure_pa', list, 'Absolute pressures, two or more.', required=True, unit='Pa',
        lower=0.0, upper=1e7),
)


def inverse_of(tree: Located, rig: 'JointRig | Rig | None',
               mode: 'ForceMode | JointMode | None') -> FloatArray:
    """
    Return the table of the file, else that of the mode or the rig.

    Raises
    ------
    InputError
        A wrong table, or neither table nor rig.

    """
    if 'static_inverse' in tree:
        table = tree.require('static_inverse', dict)
        table.check_keys(names_of(INVERSE_KEYS))
        lower_m, step_m = INVERSE_KEYS[0].read(table), INVERSE_KEYS[1].read(table)
        pressures = INVERSE_KEYS[2]
        nodes = table.require(pressures.name, list)
        if len(nodes) < 2:
            raise table.error('`pressure_pa` needs at least two values', 'pressure_pa')
        values = [nodes.require(i, float, lower=pressures.lower, upper=pressures.upper,
                                unit=pressures.unit) for i in range(len(nodes))]
        return static_inverse(lower_m, step_m, values)
    if mode is not None:
        return mode.blank_inverse()
    if rig is None:
        raise InputError(
            'without a rig the controller text must bring its `static_inverse`', tree.where())
    if isinstance(rig, JointRig):
        raise InputError(f'{rig.name} is a joint: it has no `static_inverse`', tree.where())
    return tabulate_static_inverse(rig)
