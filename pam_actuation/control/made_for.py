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
What a controller was made for, as its file states it, and whether another rig will do.

::

    made_for: {muscle_length_m: 0.3, muscle_bore_m: 0.005, valve: ppr, load: hanging_mass,
               mass_kg: 5.0}

What matters is compared: size of the muscle, valve, kind and size of the load. Effects, sensors
and names do not matter: a model that the gap workflow improved is still the same rig.
"""

from collections.abc import Collection
from typing import Any, TYPE_CHECKING

from pam_actuation.control.sofc.persistence import identity_parts
from pam_sim.errors import InputError
from pam_sim.joint.rig import JointRig
from pam_sim.keys import Key, names_of
from pam_sim.load import LOADS
from pam_sim.load.registry import VARIABLE
from pam_sim.plugins import pick
from pam_sim.valve import VALVES

if TYPE_CHECKING:
    from pam_sim.located_yaml import Located
    from pam_sim.rig import Rig

_ANY = 'any'
SIZE_TOLERANCE = 0.05         # of length and bore: a muscle is cut and measured to that
LOAD_FACTOR = 2.0             # of mass or inertia
_KINDS = (*(name for name, load in LOADS.items() if load.MOVES_FREELY), 'prescribed', 'joint')
KEYS = (
    Key('muscle_length_m', float, 'Length of the muscle at rest.', unit='m', lower=1e-2,
        upper=20.0, otherwise=_ANY),
    Key('muscle_bore_m', float, 'Bore of the muscle at rest.', unit='m', lower=1e-4, upper=0.2,
        otherwise=_ANY),
    Key('mass_kg', float, 'Hanging mass.', unit='kg', lower=1e-6, upper=1e6, otherwise=_ANY),
    Key('inertia_kg_m2', float, 'Inertia of the limb about the joint axis.', unit='kg m^2',
        lower=1e-9, upper=1e6, otherwise=_ANY),
    Key('valve', str, 'Type of the valve.', choices=VALVES, otherwise=_ANY),
    Key('load', str, 'Kind of the load.', choices=_KINDS, otherwise=_ANY),
)
_TEXTS = ('valve', 'load')
_OF_THE_LOAD = ('mass_kg', 'inertia_kg_m2')
_WORDS = {
    'muscle_length_m': ('a muscle of', 1e3, 'mm length'),
    'muscle_bore_m': ('a muscle of', 1e3, 'mm bore'),
    'mass_kg': ('a load of', 1.0, 'kg'), 'inertia_kg_m2': ('a limb of', 1.0, 'kg m^2')}


def other_valve(preset: str, valve: str, known: Collection[str]) -> str:
    """
    Return a sentence where a preset is made for the other valve and has a twin for this one.

    Parameters
    ----------
    preset : str
        Its name; what is none of ``known`` tells nothing.
    valve : str
        Of the rig.
    known : collection of str
        Names of all presets: ``pid`` beside ``pid_hsv``, ``sofc_ppr`` beside ``sofc_hsv``.

    """
    base = preset.removesuffix('_hsv').removesuffix('_ppr')
    twins = {'ppr': [base, f'{base}_ppr'], 'hsv': [f'{base}_hsv']}
    right = next((name for name in twins[valve] if name in known), '')
    wrong = next(other for other in VALVES if other != valve)
    if preset not in known or preset not in twins[wrong] or not right:
        return ''
    return (f'the controller preset `{preset}` is made for valve {wrong}, this rig has {valve}; '
            f'`{right}` is the one made for it')


def check_valve(controller: Any, valve: str) -> None:
    """
    Refuse a controller that was loaded for the other valve, unless the other rig was accepted.

    Parameters
    ----------
    controller : Controller
        One without facts fits any rig.
    valve : str
        Of the rig that it shall run on: ``ppr`` or ``hsv``.

    Raises
    ------
    InputError
        The sentence says how to load one that fits.

    """
    made_for = (getattr(controller, 'made_for', None) or {}).get('valve', valve)
    if made_for != valve and not controller.other_rig:
        raise InputError(
            f'the controller was loaded for valve {made_for}, the rig has {valve}; load one with '
            '`load_controller(NAME, rig)` and that rig', 'controller')


def facts_of(rig: 'JointRig | Rig') -> dict[str, Any]:
    """Return what a controller of a rig or joint is made for, as plain data; {} if unknown."""
    one = rig.flexor if isinstance(rig, JointRig) else rig
    if not hasattr(one, 'muscle'):      # all a controller needs is a static inverse
        return {}
    facts = {'muscle_length_m': float(one.muscle.length_m),
             'muscle_bore_m': float(one.muscle.bore_m), 'valve': one.valve}
    if isinstance(rig, JointRig):
        return {**facts, 'load': 'joint',
                'inertia_kg_m2': float(rig.parameters['inertia_kg_m2'])}
    if LOADS[rig.load].MOVES_FREELY:
        return {**facts, 'load': rig.load, 'mass_kg': float(rig.parameters['mass_kg'])}
    return {**facts, 'load': 'prescribed'}


def read_facts(tree: 'Located') -> dict[str, Any] | None:
    """
    Return the facts a controller file states, None where it states none.

    A file without ``made_for`` may name a rig that ships; then its facts are known too.
    """
    if 'made_for' in tree:
        table = tree.require('made_for', dict)
        table.check_keys(names_of(KEYS))
        if 'load' in table:
            pick(dict.fromkeys(_KINDS), table.require('load', str), 'load', table.where('load'),
                 VARIABLE)
        by_name = {key.name: key for key in KEYS}
        return {name: by_name[name].read(table) for name in table}
    name, valve, _ = identity_parts(tree.get('rig', str, default=''))
    return _shipped(name, valve)


def _shipped(name: str, valve: str) -> dict[str, Any] | None:
    """Return the facts of a rig or joint that ships, else what the identity says, else None."""
    from pam_sim.joint import load_joint
    from pam_sim.joint.model_file import joint_preset_names
    from pam_sim.model_file import load_rig, preset_names
    for names, load in ((preset_names, load_rig), (joint_preset_names, load_joint)):
        if valve and name in names():
            # The name may be that of a file made from it, with another load.
            return {key: value for key, value in facts_of(load(name, valve=valve)).items()
                    if key not in _OF_THE_LOAD}
    return {'valve': valve} if valve else None


def differences(facts: dict[str, Any], rig: 'JointRig | Rig') -> list[str]:
    """Return in words what a rig has otherwise than a controller's facts; empty if it fits."""
    here = facts_of(rig)
    found = []
    for key, (before, factor, unit) in _WORDS.items():
        if key not in facts or key not in here:
            continue
        mine, other = facts[key], here[key]
        low, high = sorted((mine, other))
        limit = 1.0 + SIZE_TOLERANCE if key.startswith('muscle') else LOAD_FACTOR
        if high > limit * low:
            found.append(f'{before} {factor * mine:.4g} {unit} (here {factor * other:.4g})')
    for key in _TEXTS:
        if key in facts and key in here and facts[key] != here[key]:
            found.append(f'{key} {facts[key]} (here {here[key]})')
    return found


def _other_name(tree: 'Located', rig: 'JointRig | Rig') -> list[str]:
    """Return in words that a file without facts names another rig; empty if it does not."""
    name = identity_parts(tree.require('rig', str))[0]
    return [] if name == rig.name else [f'`{name}`, of unknown size (here {rig.name})']


def check_made_for(tree: 'Located', rig: 'JointRig | Rig',
                   accept: bool) -> tuple[dict[str, Any], str]:
    """
    Return (facts, sentence): what a controller file was made for, and how this rig differs.

    What the file does not state is that of the rig, unless that is another one.

    Parameters
    ----------
    tree : Located
        The controller file.
    rig : Rig or JointRig
        What the controller is to run on.
    accept : bool
        Whether another rig is accepted; the sentence then tells that it is one.

    Raises
    ------
    InputError
        The rig differs in what matters, and is not accepted.

    """
    facts = read_facts(tree)
    found = differences(facts, rig) if facts else []
    if facts and not found and 'made_for' not in tree and 'muscle_length_m' not in facts:
        found = _other_name(tree, rig)
    if not found:
        return {**facts_of(rig), **(facts or {})}, ''
    sentence = f'made for another rig: {", ".join(found)}'
    if not accept:
        raise InputError(
            f'the controller was {sentence}; name its rig (with --rig or --model), tune one for '
            f'this rig, or run it all the same with --accept-other-rig (of a node: '
            f'accept_other_rig:=true)',
            tree.where('made_for' if 'made_for' in tree else 'rig' if 'rig' in tree else None))
    return facts or {}, sentence
