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

"""Model files and presets of joints: YAML in, JointRig out."""

import os

from pam_sim.errors import InputError
from pam_sim.joint.parameters import NAME, PARAMETERS, SIDES
from pam_sim.joint.rig import JointRig
from pam_sim.keys import Key, names_of
from pam_sim.located_yaml import load_yaml, Located
from pam_sim.model_file import load_rig
from pam_sim.named_files import file_stem, NamedFiles
from pam_sim.parameters import check_parameters
from pam_sim.rig import Rig


_PRESETS = NamedFiles('joint/presets')
KEYS = (
    Key('name', str, 'What the joint is called in bags and reports.',
        otherwise='name of the file'),
    Key('joint', str, 'Preset to start from; the other keys say what differs.',
        otherwise='none: state `load` and both sides'),
    Key('load', str, 'Says that the file describes a joint.',
        otherwise='required without `joint`', choices=(NAME,)),
    *(Key(side, dict, f'Rig of the {side}: a preset, or a mapping as in the file of a rig.',
          otherwise='required without `joint`') for side in SIDES),
    Key('parameters', dict, 'Numbers of the joint and its limb that differ from the nominal '
        'ones.', otherwise='nominal'),
)


def joint_preset_names() -> list[str]:
    """Return the names of the presets, sorted."""
    return _PRESETS.names()


def load_joint(source: str | os.PathLike[str] | Located | JointRig, valve: str | None = None,
               fidelity: str | None = None) -> JointRig:
    """
    Return a joint from a preset or a model file.

    Parameters
    ----------
    source : str, os.PathLike, Located or JointRig
        Preset name, path of a model file, YAML text, or a mapping already read.
    valve, fidelity : str, optional
        Of both muscles, instead of those of the model.

    Returns
    -------
    JointRig

    Raises
    ------
    InputError
        One sentence with file, line, key, value and what is allowed.

    """
    if isinstance(source, JointRig):
        joint = source
    else:
        data, name = _PRESETS.locate(source, 'joint')
        joint = _from_mapping(data, name or file_stem(source) or '')
    return joint.with_(valve=valve, fidelity=fidelity)


def load_rig_or_joint(source: str | os.PathLike[str] | Rig | JointRig,
                      valve: str | None = None) -> Rig | JointRig:
    """
    Return what a preset or a model file describes: a Rig or a JointRig.

    Parameters
    ----------
    source : str, os.PathLike, Rig or JointRig
        Preset name, path of a model file, or YAML text.
    valve : str, optional
        Instead of that of the model.

    Raises
    ------
    InputError
        As of ``load_rig`` and ``load_joint``.

    """
    if isinstance(source, Rig):
        return load_rig(source, valve=valve)
    if isinstance(source, JointRig) or str(source) in joint_preset_names():
        return load_joint(source, valve)
    if isinstance(source, str) and '\n' in source or os.path.isfile(str(source)):
        data = load_yaml(source)
        if 'joint' in data or data.get('load', str, '') == NAME:
            return load_joint(source, valve)
    return load_rig(source, valve=valve)


def load_rig_or_side(source: str | os.PathLike[str], valve: str | None = None) -> Rig:
    """
    Return a rig by its preset or path, or one side of a joint by ``JOINT/flexor``.

    Parameters
    ----------
    source : str
        For example ``dmsp_5_300_realistic`` or ``knee_dmsp_20_300/extensor``.
    valve : str, optional
        Instead of that of the model.

    Raises
    ------
    InputError
        As of ``load_rig`` and ``load_joint``.

    """
    joint, _, side = str(source).rpartition('/')
    if joint and side in SIDES:
        loaded = load_joint(joint, valve=valve)
        return loaded.flexor if side == 'flexor' else loaded.extensor
    return load_rig(source, valve=valve)


def _from_mapping(data: Located, name: str) -> JointRig:
    data.check_keys(names_of(KEYS))
    name = data.get('name', str, name)
    base = None
    if 'joint' in data:
        base = load_joint(data.require('joint', str, choices=joint_preset_names()))
        data.get('load', str, choices=(NAME,))
    else:
        if 'load' not in data:
            raise data.error(
                f'`load: {NAME}` is missing, or `joint` with one of: '
                + ', '.join(joint_preset_names()))
        data.require('load', str, choices=(NAME,))
    flexor, extensor = (_side(data, side, base) for side in SIDES)
    given = data.get('parameters', dict) if data.get('parameters') is not None else {}
    check_parameters(PARAMETERS, given)
    kept = base.parameters if base else {}
    try:
        return JointRig(name or (base.name if base else 'joint'), flexor, extensor,
                        parameters={**kept, **dict(given)})
    except InputError as error:
        # The parts are sound; they do not fit each other.
        raise data.error(f'{error.where}: {error.problem}', error.where) from error


def _side(data: Located, side: str, base: JointRig | None) -> Rig:
    """Return the rig of a side: a preset or file by name, a mapping as in one, or the base's."""
    if side not in data and base is not None:
        return base.flexor if side == 'flexor' else base.extensor
    value = data.require(side)
    if isinstance(value, Located):
        return load_rig(value)
    if not isinstance(value, str):
        raise data.error(f'`{side}` must be a preset or a mapping as in a model file', side)
    beside = os.path.join(os.path.dirname(data.name), value)        # as the table of a muscle
    try:
        return load_rig(beside if os.path.isfile(beside) else value)
    except InputError as error:
        where = f'{side}: {error.where}: ' if error.where else ''
        raise data.error(f'{where}{error.problem}', side) from error
