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

"""Model files and presets: YAML in, Rig out."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from pam_sim.effects.registry import all_effects, get_effect
from pam_sim.effects.setting import EffectSetting
from pam_sim.errors import did_you_mean, InputError
from pam_sim.files import shown, StrPath
from pam_sim.keys import Key, names_of
from pam_sim.load import LOADS
from pam_sim.load.registry import VARIABLE as LOADS_VARIABLE
from pam_sim.located_yaml import Located, LocatedList
from pam_sim.muscle.coefficients import ALL, coefficients, PREFIX, stated_names
from pam_sim.muscle.muscle import (
    get_muscle, LawChoice, muscle_names, read_law, read_muscle, with_volume_of)
from pam_sim.named_files import file_stem, NamedFiles
from pam_sim.parameters import check_parameters, Parameter
from pam_sim.plugins import pick
from pam_sim.rig import Rig
from pam_sim.rig_parameters import rig_parameters
from pam_sim.sensors import SENSOR_PARAMETERS
from pam_sim.tolerance import read_tolerance, refuse_texts, Tolerance
from pam_sim.valve import hsv, VALVES
from pam_sim.volume import VOLUMES

KEYS = (
    Key('name', str, 'What the rig is called in bags and reports.', otherwise='name of the file'),
    Key('rig', str, 'Preset to start from; the other keys say what differs. `muscle` and `load` '
        'are then given by it.', otherwise='none: state `muscle` and `load`'),
    Key('muscle', str, 'A muscle by name, or a mapping with the keys of a muscle below.',
        otherwise='required without `rig`'),
    Key('law', str, 'Force law of the muscle: a name, or a mapping with the keys of a law below.',
        otherwise='that of the muscle'),
    Key('volume', str, 'Inner volume of the muscle: a cylinder of the bore, or that of the force '
        'law.', otherwise='that of the muscle', choices=tuple(VOLUMES)),
    Key('load', str, 'What the muscle pulls.', otherwise='required without `rig`',
        choices=tuple(LOADS)),
    Key('valve', str, 'Proportional regulator or pair of on/off valves.',
        otherwise='that of `rig`, else ppr', choices=VALVES),
    Key('fidelity', str, 'Whether the on/off valves follow the mean of their pulses, or each '
        'pulse.', otherwise='that of `rig`, else averaged', choices=hsv.FIDELITIES),
    Key('parameters', dict, 'Numbers of muscle, load and valves that differ from the nominal '
        'ones.', otherwise='nominal'),
    Key('tolerance', dict, 'How well a number of `parameters` is known: its relative standard '
        'deviation, 0 for exactly; `{sd: ...}`, the same in the unit of the number; or '
        '`unknown`, anywhere in its range. `pam gap` adjusts a number within it. `law.NAME` is a '
        'coefficient of the force law, `law` stands for all on which its force depends.',
        otherwise='that of the parameter', lower=0.0, upper=1.0),
    Key('effects', list, 'Effects added to the nominal physics, each a mapping.',
        otherwise='those of `rig`'),
    Key('sensors', dict, 'Noise, resolution and stamp jitter of the sensors.',
        otherwise='those of `rig`, else ideal'),
)
EFFECT_KEYS = (
    Key('name', str, 'Which effect; `pam models` lists them.', required=True),
    Key('parameters', dict, 'Its numbers that differ from the nominal ones.',
        otherwise='nominal'),
    Key('source', dict, 'Where the numbers come from; `pam gap` writes intervals here.',
        otherwise='none'),
)
_PRESETS, _JOINTS = NamedFiles('presets'), NamedFiles('joint/presets')
_ONE_MUSCLE = ('is a joint with two muscles, and one muscle is needed here, such as '
               'dmsp_5_300_driven; in Python `pam_sim.load_joint` reads a joint')
_EFFECTS_FORM = 'write `effects: [{name: NAME, parameters: {NUMBER: VALUE}}]`'


def preset_names() -> list[str]:
    """Return the names of the presets, sorted."""
    return _PRESETS.names()


def load_rig(
        source: StrPath | Located | Rig, valve: str | None = None,
        fidelity: str | None = None) -> Rig:
    """
    Return a rig from a preset or a model file.

    Parameters
    ----------
    source : str, os.PathLike, Located or Rig
        Preset name, path of a model file, YAML text, or a mapping already read.
    valve, fidelity : str, optional
        Instead of those of the model: ``ppr`` or ``hsv``; ``averaged`` or ``switching``.

    Returns
    -------
    Rig

    A rig whose file states no ``name`` is called after the file.

    Raises
    ------
    InputError
        One sentence with file, line, key, value and what is allowed.

    """
    if isinstance(source, Rig):
        rig = source
    else:
        if isinstance(source, str) and source in _JOINTS.names():
            raise InputError(_ONE_MUSCLE, source)
        data, name = _PRESETS.locate(source, 'rig')
        rig = _from_mapping(data, name or file_stem(source), (name,) if name else ())
    for value, choices, what in ((valve, VALVES, 'valve'), (fidelity, hsv.FIDELITIES, 'fidelity')):
        if value is not None and value not in choices:
            raise InputError(f'{what} `{value}` is not known{did_you_mean(value, choices)}; '
                             f'allowed: {", ".join(choices)}')
    return rig.with_(valve=valve, fidelity=fidelity)


def _from_mapping(data: Located, name: str | None, seen: tuple[str, ...]) -> Rig:
    if data.get('load') == 'antagonistic_joint' or 'joint' in data:
        raise data.error(_ONE_MUSCLE, 'load' if 'load' in data else 'joint')
    data.check_keys(names_of(KEYS))
    name = data.get('name', str, name)
    if 'rig' in data:
        base_name = data.require('rig', str, choices=preset_names())
        if base_name in seen:
            raise data.error(f'`{base_name}` is made from itself', 'rig')
        base = _from_mapping(_PRESETS.read(base_name), base_name, (*seen, base_name))
        for key in ('muscle', 'load'):
            if key in data:
                raise data.error(f'`{key}` is given by `rig: {base_name}`', key)
    else:
        _check_made_of(data)
        if isinstance(data.get('muscle'), Located):
            muscle = read_muscle(data['muscle'])
        else:
            muscle = get_muscle(data.require('muscle', str, choices=muscle_names()))
        load = data.require('load', str)
        pick(LOADS, load, 'load', data.where('load'), LOADS_VARIABLE)
        base = Rig(name or 'rig', load, muscle=muscle)
    muscle = base.muscle
    if 'law' in data:
        muscle = muscle.with_law(read_law(data, muscle.law, muscle.bore_m))
    muscle = with_volume_of(muscle, data)
    known = rig_parameters(base.load)
    given = data.get('parameters', dict) if data.get('parameters') is not None else {}
    if isinstance(given, Located):
        refuse_texts(given, known)
    check_parameters(known, given)
    tolerance = dict(base.tolerance)
    stated = data.get('tolerance', dict) if data.get('tolerance') is not None else Located({})
    if muscle.law.name != base.muscle.law.name:
        tolerance = {key: value for key, value in tolerance.items() if not key.startswith(PREFIX)}
    tolerance.update(_tolerances(stated, (*known, *coefficients(muscle.law)), muscle.law))
    sensors = data.get('sensors', dict) if data.get('sensors') is not None else {}
    check_parameters(SENSOR_PARAMETERS, sensors, 'sensor setting')
    return Rig(
        name or base.name, base.load,
        data.get('valve', str, base.valve, choices=VALVES),
        data.get('fidelity', str, base.fidelity, choices=hsv.FIDELITIES),
        {**base.parameters, **dict(given)}, _effects(data, base),
        {**base.sensors, **dict(sensors)}, tolerance, muscle)


def _tolerances(stated: Located, known: Sequence[Parameter], law: LawChoice
                ) -> dict[str, Tolerance]:
    """Return the tolerances that a file states; ``law`` stands for all its coefficients."""
    by_name = {parameter.name: parameter for parameter in known}
    stated.check_keys([*by_name, ALL], 'parameter')
    found: dict[str, Tolerance] = {}
    if ALL in stated:
        for name in stated_names(law, ALL, stated.where(ALL)):
            found[name] = read_tolerance(stated, by_name[name], ALL)
    return found | {name: read_tolerance(stated, by_name[name])
                    for name in by_name if name in stated}


def _check_made_of(data: Located) -> None:
    """Raise InputError unless a model without ``rig`` says muscle and load."""
    missing = [key for key in ('muscle', 'load') if key not in data]
    if len(missing) == 2:
        raise data.error(f'`rig` is missing; allowed: {", ".join(preset_names())}')
    choices: dict[str, Callable[[], Iterable[str]]] = {
        'muscle': muscle_names, 'load': lambda: LOADS}
    for key in missing:
        other = 'muscle' if key == 'load' else 'load'
        raise data.error(f'`{key}` is missing beside `{other}`; allowed: '
                         f'{", ".join(choices[key]())}', other)


def _effects(data: Located, base: Rig) -> list[EffectSetting]:
    """Return the base's effects with those of the file added; the file wins on equal names."""
    settings = {item.name: item for item in base.effects}
    given = data.get('effects')
    if given is not None and not isinstance(given, LocatedList):
        raise data.error(f'`effects` must be a list; {_EFFECTS_FORM}', 'effects')
    listed: LocatedList = given or LocatedList()
    stated: set[str] = set()
    for index, item in enumerate(listed):
        if not isinstance(item, Located):
            raise InputError(f'an effect is a mapping; {_EFFECTS_FORM}', listed.where(index))
        if len(item) == 1 and next(iter(item)) in all_effects():
            raise item.error(f'an effect states its name under `name`; {_EFFECTS_FORM}')
        item.check_keys(names_of(EFFECT_KEYS))
        name = item.require('name', str)
        beside = Path(data.name).parent / f'{name}.py'
        if name not in all_effects() and beside.is_file():
            raise item.error(
                f'effect `{name}` is in {shown(beside)}, a folder that is not searched; name it: '
                f'export PAM_EFFECTS_PATH={shown(beside.parent)}', 'name')
        effect = get_effect(name, item.where('name'))
        if name in stated:
            raise item.error(f'effect `{name}` is listed twice', 'name')
        stated.add(name)
        values = item.get('parameters', dict) if item.get('parameters') is not None else {}
        origin = item.get('source')
        origin = origin.plain() if isinstance(origin, Located) else (
            {} if origin is None else {'note': origin})
        settings[name] = EffectSetting(name, effect.values(values), origin)
    return list(settings.values())
