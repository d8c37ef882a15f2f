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
Rigs that differ from a given one as real ones do: what a tuned controller has to stand.

================  ==========================================  ==================
what              drawn                                       valve
================  ==========================================  ==================
dry friction      factor 0.5 to 2, logarithmic                both
valve speed       T_m, or C, times 0.7 to 1.3                 PPR, or HSV
dead time         times 2/3 to 1.5; 20 to 45 ms where the     both
                  rig has none
supply            0 to 10 % less gauge pressure               HSV (a PPR's model
                                                              has no supply)
load              mass times 0.8 to 1.1                       both
limb of a joint   mass and inertia times 0.8 to 1.1           both
force map         gain times 0.85 to 1.15                     both
================  ==========================================  ==================

Both muscles of a joint are drawn each by itself.

The ranges are design values. Each is drawn evenly, independently of the others. A number that
would leave the range of its parameter becomes the end of that range.
"""

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.declared import check_kind, check_whole
from pam_sim.effects.registry import get_effect
from pam_sim.effects.setting import EffectSetting, equivalent, forms_of
from pam_sim.joint.parameters import PARAMETERS
from pam_sim.joint.rig import JointRig
from pam_sim.parameters import Parameter
from pam_sim.rig import Rig
from pam_sim.units import P_ATM_PA

FRICTION_FACTOR = (0.5, 2.0)
VALVE_FACTOR = (0.7, 1.3)
DEAD_TIME_S = (0.020, 0.045)        # of a rig with NOMINAL_DEAD_TIME_S
NOMINAL_DEAD_TIME_S = 0.030
SUPPLY_FACTOR = (0.9, 1.0)          # of the gauge pressure
MASS_KG = (4.0, 5.5)                # of a rig with NOMINAL_KG
NOMINAL_KG = 5.0
FORCE_MAP_FACTOR = (0.85, 1.15)
LIMB_FACTOR = (0.8, 1.1)
_DRAWS = 6                          # numbers for one muscle

AnyRig = TypeVar('AnyRig', Rig, JointRig, 'Rig | JointRig')


def random_rigs(rig: AnyRig, count: int, seed: int = 0) -> list[AnyRig]:
    """
    Return rigs drawn about a given one.

    Parameters
    ----------
    rig : Rig or JointRig
        The nominal one; its valve, effects and sensors stay. Names stay as well, so that
        rules learned on one rig may run on the others.
    count : int
        How many; the first ones do not depend on it.
    seed : int
        Same seed, same rigs.

    Returns
    -------
    list of Rig or of JointRig

    Raises
    ------
    InputError
        No rig, or a count or seed that is no whole number from 0 on.

    """
    check_kind(rig, (Rig, JointRig), 'rig', 'load_rig(NAME)')
    check_whole(count, 0, 'count')
    check_whole(seed, 0, 'seed')
    random = np.random.default_rng(seed)
    if isinstance(rig, JointRig):
        return [_drawn_joint(rig, random.uniform(size=2 * _DRAWS + 1)) for _ in range(count)]
    return [_drawn(rig, random.uniform(size=_DRAWS)) for _ in range(count)]


def _drawn_joint(joint: JointRig, part: FloatArray) -> JointRig:
    """Return the joint at a point of the unit cube."""
    limb = _between(LIMB_FACTOR, part[-1])
    return joint.with_(
        parameters=_inside(PARAMETERS, {name: joint.parameters[name] * limb
                                        for name in ('limb_mass_kg', 'inertia_kg_m2')}),
        flexor=_drawn(joint.flexor, part[:_DRAWS]),
        extensor=_drawn(joint.extensor, part[_DRAWS:2 * _DRAWS]))


def _drawn(rig: Rig, part: FloatArray) -> Rig:
    """Return the rig at a point of the unit cube."""
    friction = FRICTION_FACTOR[0] * (FRICTION_FACTOR[1] / FRICTION_FACTOR[0]) ** part[0]
    valve = _between(VALVE_FACTOR, part[1])
    values = rig.parameters
    changed = {'force_map_gain': values['force_map_gain'] * _between(FORCE_MAP_FACTOR, part[5])}
    if rig.valve == 'ppr':
        changed['T_m'] = values['T_m'] * valve
    else:
        changed['C'] = values['C'] * valve
        gauge_pa = values['supply_pa'] - P_ATM_PA
        changed['supply_pa'] = P_ATM_PA + gauge_pa * _between(SUPPLY_FACTOR, part[3])
    if 'mass_kg' in values:
        changed['mass_kg'] = _between(MASS_KG, part[4]) * (values['mass_kg'] / NOMINAL_KG)
    delay_s = _between(DEAD_TIME_S, part[2])
    stated = forms_of(rig.effects, 'valve_dead_time')
    has_one = equivalent(rig, 'valve_dead_time', 'delay_s') > 0.0
    delays = stated if has_one else [EffectSetting.of('valve_dead_time')]
    return rig.with_(parameters=_inside(rig.parameter_list, changed), effects=[
        *(_resized(one, lambda value: value * friction)
          if get_effect(one.name).family == 'friction' else one
          for one in rig.effects if one not in stated),
        *(_resized(one, lambda value: delay_s * (value / NOMINAL_DEAD_TIME_S))
          for one in delays)])


def _between(ends: tuple[float, float], part: float) -> float:
    return float(ends[0] + (ends[1] - ends[0]) * part)


def _within(parameter: Parameter, value: float) -> float:
    return min(max(value, parameter.lower), parameter.upper)


def _inside(parameters: tuple[Parameter, ...], drawn: dict[str, float]) -> dict[str, float]:
    """Return drawn numbers, each within its range."""
    return {p.name: _within(p, drawn[p.name]) for p in parameters if p.name in drawn}


def _resized(setting: EffectSetting, change: Callable[[float], float]) -> dict[str, Any]:
    """Return an effect with its amplitudes changed, within their ranges."""
    effect = get_effect(setting.name)
    return {'name': setting.name, 'parameters': {
        p.name: _within(p, change(setting.parameters[p.name])) if p.name in effect.amplitude
        else setting.parameters[p.name] for p in effect.parameters}}
