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

"""An effect with its numbers, as a rig lists it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TYPE_CHECKING

from pam_sim.declared import check_mapping, shown
from pam_sim.effects.registry import get_effect
from pam_sim.errors import did_you_mean, InputError

if TYPE_CHECKING:
    from pam_sim.rig import Rig

FORM = "write `[{'name': NAME, 'parameters': {NUMBER: VALUE}}]`"
_KEYS = 'name', 'parameters', 'source'


@dataclass(frozen=True)
class EffectSetting:
    """
    An effect with its numbers, as a model file lists it.

    Parameters
    ----------
    name : str
    parameters : dict
        All parameters of the effect, name -> value, SI.
    source : dict
        Where the numbers come from (bag, date, ci95); kept, not used.

    """

    name: str
    parameters: dict[str, float] = field(default_factory=dict)
    source: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, item: 'EffectSetting | Mapping[str, Any] | str') -> 'EffectSetting':
        """
        Return a checked setting from a name, a mapping (name, parameters) or a setting.

        Raises
        ------
        InputError
            Unknown effect, key or parameter, value out of bounds, or nothing of this kind.

        """
        if isinstance(item, str):
            item = {'name': item}
        if not isinstance(item, EffectSetting):
            if not isinstance(item, Mapping) or not isinstance(item.get('name'), str):
                raise InputError(f'has {shown(item)}; {FORM}', 'effects')
            for key in item:
                if key not in _KEYS:
                    raise InputError(f'has the unknown key `{key}`{did_you_mean(key, _KEYS)}; '
                                     f'allowed: {", ".join(_KEYS)}', f'effect {item["name"]}')
            item = cls(item['name'], item.get('parameters') or {}, item.get('source') or {})
        check_mapping(item.source, f'source of effect {item.name}', "{'bag': PATH}")
        check_mapping(item.parameters, f'parameters of effect {item.name}')
        return cls(item.name, get_effect(item.name).values(item.parameters), dict(item.source))


def settings_of(items: Iterable[EffectSetting | Mapping[str, Any] | str],
                checked: Sequence[EffectSetting] = ()) -> list[EffectSetting]:
    """
    Return the checked settings of effects; those of ``checked`` stay as they are.

    Raises
    ------
    InputError
        As of ``EffectSetting.of``, no list, or an effect is listed twice.

    """
    if isinstance(items, (str, Mapping)) or not isinstance(items, Iterable):
        raise InputError(f'is {shown(items)}; a list is needed: {FORM}', 'effects')
    kept = {id(setting): setting for setting in checked}
    settings = [kept.get(id(item)) or EffectSetting.of(item) for item in items]
    seen = set()
    for setting in settings:
        if setting.name in seen:
            raise InputError(f'effect `{setting.name}` is listed twice', 'effects')
        seen.add(setting.name)
    return settings


def forms_of(settings: Iterable[EffectSetting], name: str) -> list[EffectSetting]:
    """Return the settings of an effect, in its own form or in other formulations of it."""
    return [one for one in settings if name in (one.name, get_effect(one.name).variant_of)]


def equivalent(rig: 'Rig', name: str, quantity: str) -> float:
    """
    Return a number that an effect of a rig is equivalent to, whatever its formulation.

    Parameters
    ----------
    rig : pam_sim.Rig
        With effects and a valve.
    name : str
        The effect; its other formulations count as well.
    quantity : str
        One that the effect reports, as under ``equivalent`` in gap.json.

    Returns
    -------
    float
        0 where none acts with the valve of the rig; the sum where several do.

    """
    acting = [(get_effect(one.name), one.parameters) for one in forms_of(rig.effects, name)]
    return sum((effect.report(values, rig).get(quantity, (0.0, ''))[0]
                for effect, values in acting if rig.valve in effect.valves), 0.0)
