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

"""
What 0 V, the signal that vents a regulator, leaves in the muscle.

A regulator of -1 to 6 V gives a pressure at 0 V. Each fault, the emergency stop and a loss of
power would then fill the muscle in place of venting it.
"""

from typing import TYPE_CHECKING

from pam_actuation.drivers.ppr import PprConfig
from pam_sim.errors import InputError

if TYPE_CHECKING:
    from pam_sim.joint.rig import JointRig
    from pam_sim.rig import Rig

MOST_LEFT_PA = 10e3         # as much as a data sheet states for a regulator, and its zero error
WORTH_A_REMARK_PA = 500.0
_MOST = f'at most {MOST_LEFT_PA * 1e-3:g} kPa are allowed'


def check_vents(config: PprConfig, where: str) -> None:
    """
    Refuse a regulator that 0 V does not vent.

    Raises
    ------
    InputError
        With ``where``, the values and their allowed range.

    """
    left_pa = config.left_gauge_pa
    if not _too_much(left_pa):
        return
    room_v, at_v = MOST_LEFT_PA / config.gain_pa_per_v, config.atmospheric_v
    if config.lowest_v > 0.0:
        raise InputError(
            f'ppr.lowest_v of {config.lowest_v:g} V is above ppr.atmospheric_v of {at_v:g} V and '
            f'leaves {left_pa * 1e-3:.0f} kPa gauge in a vented muscle; {_MOST}, which is a '
            f'ppr.lowest_v of {at_v + room_v:.4g} V', where)
    raise InputError(
        f'0 V, the signal that vents, leaves {left_pa * 1e-3:.0f} kPa gauge in the muscle, since '
        f'ppr.atmospheric_v is {at_v:g} V; {_MOST}, which is a ppr.atmospheric_v of '
        f'{-room_v:.4g} V', where)


def check_rig_vents(rig: 'Rig | JointRig') -> None:
    """
    Refuse a rig of which 0 V does not vent a muscle, before any node starts.

    Raises
    ------
    InputError
        As ``check_vents``.

    """
    for place, regulator in _regulators(rig):
        check_vents(regulator, f'rig {rig.name}{place and "/" + place.rstrip("/")}')


def left_remarks(rig: 'Rig | JointRig') -> list[str]:
    """Return a sentence on what 0 V leaves in a muscle of a rig, none where it vents all."""
    left_pa = max((one.left_gauge_pa for _, one in _regulators(rig)), default=0.0)
    if left_pa < WORTH_A_REMARK_PA:
        return []
    text = ('0 V, the signal that vents and all that a loss of power leaves, keeps '
            f'{left_pa * 1e-3:.1f} kPa gauge in the muscle (ppr_lowest_v, ppr_zero_pa).')
    return [f'{text} The valve driver refuses this rig: {_MOST}.' if _too_much(left_pa)
            else f'{text} A dump valve empties it.']


def _regulators(rig: 'Rig | JointRig') -> list[tuple[str, PprConfig]]:
    return [(place, PprConfig.of_rig(muscle.parameters)) for place, muscle in rig.muscles.items()
            if muscle.valve == 'ppr']


def _too_much(left_pa: float) -> bool:
    return round(left_pa) > MOST_LEFT_PA
