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

"""A rig as text: the model file that gives an equal rig, and its title for people."""

from dataclasses import replace
from typing import Any, TYPE_CHECKING

from pam_sim.located_yaml import dump_yaml
from pam_sim.muscle.coefficients import PREFIX
from pam_sim.muscle.muscle import get_muscle
from pam_sim.named_files import NamedFiles
from pam_sim.rig_parameters import rig_parameters
from pam_sim.sensors import SENSOR_PARAMETERS
from pam_sim.tolerance import plain_tolerance

if TYPE_CHECKING:
    from pam_sim.joint.rig import JointRig
    from pam_sim.rig import Rig

_MUSCLE = 'dmsp_5_300'         # whose presets exist for the loads that ship
_PRESETS = NamedFiles('presets')


def _base(rig: 'Rig') -> dict[str, Any]:
    """Return the lines that choose muscle, law and load."""
    nominal, preset = get_muscle(_MUSCLE), f'{_MUSCLE}_{rig.load}'
    if preset not in _PRESETS.names():
        return {'muscle': rig.muscle.plain(), 'load': rig.load}
    data: dict[str, Any] = {'rig': preset}
    if rig.muscle.law != nominal.law:
        data['law'] = rig.muscle.law.plain()
    if rig.muscle.volume != nominal.volume:
        data['volume'] = rig.muscle.volume
    if rig.muscle == replace(nominal, law=rig.muscle.law, volume=rig.muscle.volume):
        return data
    return {'muscle': rig.muscle.plain(), 'load': rig.load}


def rig_title(rig: 'Rig | JointRig') -> str:
    """Return the name of a rig for people, with the preset or muscle it is made from."""
    muscle = rig.muscles.get('')
    if muscle is None:
        return rig.name
    base = f'{muscle.muscle.name}_{muscle.load}'
    made_of = [] if rig.name == base else [base]
    if muscle.effects:
        made_of.append(
            f'{len(muscle.effects)} effects' if len(muscle.effects) > 1 else '1 effect')
    return f'{rig.name} ({", ".join(made_of)})' if made_of else rig.name


def rig_to_yaml(rig: 'Rig') -> str:
    """Return the text of a model file that gives an equal rig."""
    known = rig_parameters(rig.load)
    data = {'name': rig.name, **_base(rig), 'valve': rig.valve, 'fidelity': rig.fidelity}
    base = _PRESETS.read(data['rig']) if 'rig' in data else {}
    nominal = {p.name: p.default for p in known} | dict(base.get('parameters') or {})
    changed = {p.name: rig.parameters[p.name] for p in known
               if rig.parameters[p.name] != nominal[p.name]}
    tolerance = {p.name: plain_tolerance(rig.tolerance[p.name]) for p in known
                 if rig.tolerance[p.name] != p.tolerance}
    tolerance.update({name: plain_tolerance(value) for name, value in rig.tolerance.items()
                      if name.startswith(PREFIX)})
    sensors = {p.name: rig.sensors[p.name] for p in SENSOR_PARAMETERS
               if rig.sensors[p.name] != p.default}
    effects = []
    for item in rig.effects:
        entry = {'name': item.name, 'parameters': dict(item.parameters)}
        if item.source:
            entry['source'] = item.source
        effects.append(entry)
    for key, value in (('parameters', changed), ('tolerance', tolerance), ('effects', effects),
                       ('sensors', sensors)):
        if value:
            data[key] = value
    return dump_yaml(data)
