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


"""What a model file states that does nothing on its rig, such as an effect of another valve."""

from collections.abc import Iterator, Mapping
import os
from typing import Any, TYPE_CHECKING

from pam_sim.effects.effect import Effect, Numbers
from pam_sim.effects.registry import get_effect
from pam_sim.files import StrPath
from pam_sim.joint.model_file import joint_preset_names
from pam_sim.located_yaml import load_yaml
from pam_sim.model_file import preset_names
from pam_sim.parameters import Parameter
from pam_sim.units import gauge_kpa, P_ATM_PA
from pam_sim.valve import hsv, ppr

if TYPE_CHECKING:
    from pam_sim.joint.rig import JointRig
    from pam_sim.rig import Rig

_DT_S, _SUBSTEP_S = 1e-3, 1e-4


def idle_remarks(source: 'StrPath | Rig | JointRig', rig: 'Rig | JointRig') -> list[str]:
    """
    Return one sentence on all that a file states and that does nothing, none where all acts.

    A file that serves both types of valve states such things on purpose. Presets do, and are
    not looked at.

    Parameters
    ----------
    source : path
        The file, or the name of a preset.
    rig : Rig or JointRig
        What was loaded from it, perhaps with another valve.

    """
    if not isinstance(source, (str, os.PathLike)) or (
            str(source) in (*preset_names(), *joint_preset_names())):
        return []
    data = load_yaml(source)
    found = dict.fromkeys(one for place, muscle in rig.muscles.items() for one in _idle(
        data.get(place.rstrip('/')) if place else data, muscle))
    valve = next(iter(rig.muscles.values())).valve
    return [f'with valve {valve} some of what {source} states does nothing: '
            + '; '.join(found)] if found else []


def _idle(data: Any, rig: 'Rig') -> Iterator[str]:
    """Give what a mapping states for a muscle and what does nothing there, each in words."""
    if not isinstance(data, Mapping):       # the name of a preset
        return
    numbers = Numbers(_DT_S, _SUBSTEP_S, rig.valve, rig.fidelity,
                      {**rig.parameters, 'p_atm': P_ATM_PA}, muscle=rig.muscle)
    for item in data.get('effects') or ():
        why = _why_idle(get_effect(item['name']), item.get('parameters') or {}, rig, numbers)
        if why:
            yield f'effect {item["name"]} {why}'
        else:
            yield from _idle_compressor(item, rig)
    other = 'hsv' if rig.valve == 'ppr' else 'ppr'
    stated = data.get('parameters') or {}
    idle = [one.name for one in (hsv if other == 'hsv' else ppr).PARAMETERS
            if one.name in stated and not _is_read(one, rig, numbers)]
    if idle:
        yield f'{", ".join(idle)} {"are numbers" if len(idle) > 1 else "is a number"} of {other}'
    if rig.valve == 'ppr' and data.get('fidelity') == 'switching':
        yield 'fidelity switching is of hsv'


def _why_idle(effect: Effect, stated: Mapping[str, float], rig: 'Rig', numbers: Numbers) -> str:
    """Return why an effect does nothing, '' where it acts or is stated to be switched off."""
    if rig.valve not in effect.valves:
        return f'acts with {" or ".join(effect.valves)}'
    if effect.subsystem == 'load' and rig.is_driven:
        return 'acts on a load that moves freely'
    lacking = [one.name for one in effect.free_parameters(rig.valve) if one.name not in stated]
    if effect.is_active(effect.values(stated), numbers) or not lacking:
        return ''
    return f'states no {" and no ".join(lacking)}'


def _idle_compressor(item: Mapping[str, Any], rig: 'Rig') -> Iterator[str]:
    """Give the compressor of a reservoir that begins to run below the atmosphere, in words."""
    effect = get_effect(item['name'])
    if not effect.fitting.reservoir:
        return
    values = effect.values(item.get('parameters') or {})
    volume, band, flow = effect.fitting.reservoir
    band_kpa, supply_kpa = 1e-3 * values[band], gauge_kpa(rig.parameters['supply_pa'])
    if values[volume] > 0.0 and values[flow] > 0.0 and band_kpa >= supply_kpa:
        yield (f'the compressor of effect {effect.name}, which never starts: `{band}` is '
               f'{band_kpa:g} kPa, and the supply {supply_kpa:g} kPa gauge')


def _is_read(parameter: Parameter, rig: 'Rig', numbers: Numbers) -> bool:
    """Return whether an effect of the rig depends on a number of the other valve."""
    other = numbers._replace(parameters={
        **numbers.parameters, parameter.name: 1.01 * rig.parameters[parameter.name] + 1e-9})
    acting = [(one.parameters, effect) for one in rig.effects
              for effect in [get_effect(one.name)] if effect.is_active(one.parameters, numbers)]
    if parameter.name == 'V_dead' and any('pressure_rate' in e.hooks for _, e in acting):
        return True         # the step gives this hook the volume
    return any(repr(part(values, numbers)) != repr(part(values, other))
               for values, effect in acting for part in (effect.pack, effect.initial))
