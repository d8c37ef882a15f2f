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
Everything the simulator knows, as plain data: laws, muscles, valves, loads, effects, rigs.

Read from the registries when asked, so that what is added there is listed here.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
import sys
from types import ModuleType
from typing import Any

from pam_sim.effects.effect import Effect
from pam_sim.effects.registry import effects
from pam_sim.joint import joint_preset_names, load_joint, parameters as joint
from pam_sim.load import LOADS
from pam_sim.model_file import load_rig, preset_names
from pam_sim.muscle.law import MuscleLaw
from pam_sim.muscle.muscle import DIMENSIONS, get_muscle, muscle_names, MUSCLE_PARAMETERS
from pam_sim.muscle.registry import laws
from pam_sim.muscle.rules import RULES
from pam_sim.parameters import Parameter
from pam_sim.plugins import pick
from pam_sim.rig import Rig
from pam_sim.sensors import SENSOR_PARAMETERS
from pam_sim.valve import hsv, ppr
from pam_sim.volume import VOLUMES

KINDS = {
    'law': 'Muscle laws', 'muscle': 'Muscles', 'volume': 'Volumes', 'valve': 'Valves',
    'load': 'Loads', 'effect': 'Effects', 'sensors': 'Sensors', 'rig': 'Rigs'}


def catalogue() -> list[dict[str, Any]]:
    """
    Return every entry, grouped by kind in the order of :data:`KINDS`.

    Returns
    -------
    list of dict
        Each with ``kind``, ``name``, ``sentence``, ``equation``, ``source`` (str),
        ``parameters`` (list of dict: name, unit, nominal, lower, upper, description,
        source) and what its kind adds: laws ``chapter``, ``claims``, ``sets``; effects
        ``subsystem``, ``family``, ``valves``, ``variant_of``, ``relative_of``, ``reported``,
        ``fitted`` (what ``pam gap`` fits: name, typical, lower, upper), ``limits`` (simpler
        look-alikes), ``same_as``, ``same_without_force`` and ``same_without_command``
        (parameters of the model); valves ``signals``; rigs ``yaml``. A muscle's nominal numbers
        are its own. Plain data.

    Raises
    ------
    InputError
        A plug-in file that declares nothing, or a name twice.

    """
    return [
        *(_law(law) for law in laws().values()),
        *(_muscle(name) for name in muscle_names()),
        *(_module('volume', module) for module in VOLUMES.values()),
        *(_module('valve', module, signals=list(module.SIGNAL_NAMES)) for module in (ppr, hsv)),
        *(_module('load', module) for module in (*LOADS.values(), joint)),
        *(_effect(effect) for effect in _by_subsystem(effects())),
        _sensors(),
        *(_rig(name) for name in preset_names()),
        *(_joint_rig(name) for name in joint_preset_names()),
    ]


def find(entries: Collection[dict[str, Any]], name: str) -> list[dict[str, Any]]:
    """
    Return the entries of a name.

    Raises
    ------
    InputError
        There is none; the message lists the names there are.

    """
    pick({entry['name']: entry for entry in entries}, name, 'model')
    return [entry for entry in entries if entry['name'] == name]


def _entry(
        kind: str, name: str, sentence: str, equation: str, source: str,
        parameters: Iterable[Parameter], **more: Any) -> dict[str, Any]:
    return {'kind': kind, 'name': name, 'sentence': sentence, 'equation': equation,
            'source': source, 'parameters': [_parameter(item) for item in parameters], **more}


def _parameter(item: Parameter) -> dict[str, Any]:
    return {'name': item.name, 'unit': item.unit, 'nominal': item.default, 'lower': item.lower,
            'upper': item.upper, 'description': item.description, 'source': item.source}


def _law(law: type[MuscleLaw]) -> dict[str, Any]:
    sets = [{'name': name, 'values': dict(numbers.values), 'rests_on': numbers.rests_on,
             'pressure_gauge_pa': list(numbers.validity.pressure_gauge_pa),
             'strain': list(numbers.validity.strain)} for name, numbers in law.SETS.items()]
    return _entry(
        'law', law.NAME, _first_sentence(sys.modules[law.__module__]), law.FORMULA, law.SOURCE,
        law.PARAMETERS, chapter=law.EQUATION, sets=sets,
        claims={str(number): RULES[number] for number in law.CLAIMS})


def _muscle(name: str) -> dict[str, Any]:
    muscle = get_muscle(name)
    law = f'law {muscle.law.name}, set {muscle.law.law.muscle}'
    own = [replace(item, default=getattr(muscle, item.name), source='') for item in DIMENSIONS]
    return _entry(
        'muscle', name, f'{1e3 * muscle.bore_m:g} mm bore, {1e3 * muscle.length_m:g} mm long; '
        f'{law}.', 'F = force_map_gain F_law(p_g, x / L0) - damping_n_s_per_m v, '
        'V = L (Lf^2 - L^2) / (4 pi n^2), L = L0 - x', ' '.join(muscle.rests_on.split()),
        (*own, *MUSCLE_PARAMETERS))


def _module(kind: str, module: ModuleType, **more: Any) -> dict[str, Any]:
    return _entry(
        kind, module.NAME, getattr(module, 'SENTENCE', '') or _first_sentence(module),
        getattr(module, 'EQUATION', ''), getattr(module, 'SOURCE', ''), module.PARAMETERS, **more)


def _effect(effect: Effect) -> dict[str, Any]:
    nominal = effect.values()
    found: dict[str, tuple[float, str]] = {}
    for valve in effect.valves:
        found |= effect.report(nominal, Rig('nominal', 'hanging_mass', valve=valve))
    reported = [{'name': name, 'unit': unit, 'nominal': value}
                for name, (value, unit) in found.items()]
    fitted = {free.name: free for valve in effect.valves
              for free in effect.free_parameters(valve)}
    return _entry(
        'effect', effect.name, effect.sentence, effect.equation, effect.source,
        effect.parameters, subsystem=effect.subsystem, family=effect.family,
        valves=list(effect.valves), variant_of=effect.variant_of,
        relative_of=list(effect.relative_of), reported=reported,
        fitted=[{'name': free.name, 'typical': free.typical, 'lower': free.lower,
                 'upper': free.upper} for free in fitted.values()],
        limits=list(effect.fitting.limits), same_as=effect.fitting.same_as,
        same_without_force=effect.fitting.same_without_force,
        same_without_command=effect.fitting.same_without_command)


def _by_subsystem(found: Mapping[str, Effect]) -> list[Effect]:
    return sorted(found.values(), key=lambda item: (
        ('valve', 'muscle', 'load', 'sensor').index(item.subsystem), item.family, item.name))


def _sensors() -> dict[str, Any]:
    return _entry(
        'sensors', 'sensors', 'Noise, quantisation and stamp jitter of the readings.',
        'reading = round((signal + noise) / step) step, stamp = time + jitter',
        'White noise with an explicit seed; design choice.', SENSOR_PARAMETERS)


def _rig(name: str) -> dict[str, Any]:
    rig = load_rig(name)
    effect_names = ', '.join(setting.name for setting in rig.effects)
    return _entry(
        'rig', name, f'Muscle {rig.muscle.name}, load {rig.load}, valve {rig.valve}, '
        + (f'with {effect_names}.' if effect_names else 'no effect added.'),
        '', '', rig.parameter_list, yaml=rig.to_yaml())


def _joint_rig(name: str) -> dict[str, Any]:
    rig = load_joint(name)
    return _entry(
        'rig', name, f'Load {rig.load}, flexor {rig.flexor.muscle.name}, extensor '
        f'{rig.extensor.muscle.name}.', '', '', joint.PARAMETERS, yaml=rig.to_yaml())


def _first_sentence(module: ModuleType) -> str:
    """Return the first sentence of a module's docstring on one line."""
    paragraph = (module.__doc__ or '').strip().split('\n\n')[0]
    return ' '.join(paragraph.split())
