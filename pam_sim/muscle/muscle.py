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
A muscle: dimensions, force law and where its numbers come from.

Muscles by name are YAML files in ``pam_sim/muscle/sizes``; a model file may name one or
state its own, from one of them or anew.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
import math
import os
from pathlib import Path
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_sim.annotations import Number
from pam_sim.declared import shown
from pam_sim.errors import did_you_mean, InputError
from pam_sim.keys import Key, names_of
from pam_sim.located_yaml import Located
from pam_sim.muscle import geometry
from pam_sim.muscle.lookup_table import LookupTable, read_table
from pam_sim.muscle.registry import get_law, make_law
from pam_sim.named_files import NamedFiles
from pam_sim.parameters import Parameter
from pam_sim.volume import VOLUMES

if TYPE_CHECKING:
    from pam_sim.muscle.law import MuscleLaw

_SIZES = NamedFiles('muscle/sizes')
DIMENSIONS = (
    Parameter('length_m', 'm', 0.300, 0.02, 9.0, 0.0, 'Length at rest, L0.', 'chapter'),
    Parameter('bore_m', 'm', 0.005, 0.001, 0.1, 0.0, 'Inner diameter at rest.', 'chapter'),
    Parameter('braid_angle_rad', 'rad', math.radians(28.6), 0.1, 0.9, 0.0,
              'Angle between thread and axis at rest.', 'Martens and Boblan 2017'),
    Parameter('max_strain', '-', 0.25, 0.05, 0.5, 0.0,
              'Mechanical end of contraction.', 'chapter, 25 %'),
)
# Numbers of the muscle a model file may change under `parameters`.
MUSCLE_PARAMETERS = (
    Parameter('force_map_gain', '-', 1.0, 0.2, 5.0, 0.02,
              'Factor on the force law.', 'force map of the muscle'),
    Parameter('damping_n_s_per_m', 'N s/m', 25.0, 0.0, 1e4, 0.02,
              'Viscous damping of the muscle; the nominal one is of a 5 mm muscle.',
              'design value'),
)
KEYS = (
    Key('like', str, 'Muscle to start from; the other keys say what differs.',
        otherwise='none: state `length_m`, `bore_m` and `law`'),
    Key('rests_on', str, 'Where the numbers come from, for reports.',
        otherwise='stated by the model'),
    Key('law', str, 'Force law: a name, or a mapping with the keys of a law.',
        otherwise='required without `like`'),
    Key('volume', str, 'Inner volume: a cylinder of the bore, or that of the force law.',
        otherwise='that of `like`, else bore', choices=tuple(VOLUMES)),
)
LAW_KEYS = (
    Key('name', str, 'Which law; `pam models` lists them.', otherwise='that of the muscle'),
    Key('set', str, 'Named numbers of the law to start from.',
        otherwise='that of the nearest bore'),
    Key('parameters', dict, 'Coefficients that differ from the set.',
        otherwise='those of the set'),
    Key('table', dict, 'Law `lookup` only: path of a CSV file from `pam characterise`, or a '
        'mapping with the keys of a table. A path is sought beside the model file too.',
        otherwise='none'),
)
TABLE_KEYS = (
    Key('pressure_gauge_pa', list, 'Gauge pressures of the grid, Pa, rising.', required=True),
    Key('load_n', list, 'Loads of the grid, N, rising.', required=True),
    Key('strain', list, 'Contraction over length, a row for each pressure.', required=True),
    Key('air_mass_kg', list, 'Mass of air, kg, a row for each pressure.', required=True),
    Key('source', str, 'Where the points come from.', ''),
)
_BORE = 'bore'
_DIMENSION_NAMES = tuple(parameter.name for parameter in DIMENSIONS)


@dataclass(frozen=True)
class LawChoice:
    """
    Which force law a muscle has, with which numbers.

    Parameters
    ----------
    name : str
        Of the registry.
    set : str, optional
        Named numbers of the law; its first ones by default, in a muscle those of its bore.
    parameters : dict
        Values that differ from the set.
    table : LookupTable, optional
        For law ``lookup``: its own points instead of a set.

    """

    name: str = 'sarosi'
    set: str | None = None  # noqa: A003
    parameters: Mapping[str, float] = field(default_factory=dict)
    table: LookupTable | None = None

    @cached_property
    def law(self) -> 'MuscleLaw':
        """Return the law itself; made once."""
        if self.table is not None:
            return make_law(self.name, self.table)
        return make_law(self.name, self.parameters or None, self.set)

    def __getstate__(self) -> dict[str, Any]:
        """Return the choice without the law: another process reads the file of a law itself."""
        return {name: value for name, value in vars(self).items() if name != 'law'}

    def plain(self) -> dict[str, Any]:
        """Return the choice as plain data for a model file."""
        data: dict[str, Any] = {'name': self.name}
        if self.table is not None:
            data['table'] = {key: getattr(self.table, key) if key == 'source'
                             else getattr(self.table, key).tolist()
                             for key in names_of(TABLE_KEYS)}
            return data
        data['set'] = self.law.muscle
        if self.parameters:
            data['parameters'] = dict(self.parameters)
        return data


@dataclass(frozen=True)
class Muscle:
    """
    A muscle as the rig needs it.

    Parameters
    ----------
    name : str
    length_m, bore_m, braid_angle_rad, max_strain : float
        See :data:`DIMENSIONS`.
    law : LawChoice
    rests_on : str
        Where the numbers come from and how far to trust them.
    volume : str
        Which of ``pam_sim.volume.VOLUMES``: ``bore``, or ``law`` for that of the force law.

    """

    name: str
    length_m: float = geometry.LENGTH_M
    bore_m: float = geometry.BORE_M
    braid_angle_rad: float = geometry.BRAID_ANGLE_RAD
    max_strain: float = geometry.MAX_STRAIN
    law: LawChoice = field(default_factory=lambda: LawChoice(set='dmsp_5'))
    rests_on: str = ''
    volume: str = _BORE

    @property
    def stroke_m(self) -> float:
        """Largest contraction, m."""
        return self.max_strain * self.length_m

    @cached_property
    def shape(self) -> tuple[float, float, float]:
        """Arguments of :func:`pam_sim.muscle.geometry.volume_of` after the contraction."""
        thread, turns = geometry.braid(self.length_m, self.bore_m, self.braid_angle_rad)
        return self.length_m, thread * thread, 1.0 / (4.0 * math.pi * turns * turns)

    @cached_property
    def stiffness_n_per_m(self) -> float:
        """Largest fall of the tension with contraction up to 600 kPa, N/m: how short to step."""
        strain = np.linspace(0.0, self.max_strain, 51)
        force = self.law.law.force_n(np.array([[200e3], [400e3], [600e3]]), strain, 'allow')
        return max(0.0, float(np.max(-np.diff(force)) / (strain[1] * self.length_m)))

    def volume_m3(self, contraction_m: Number, gauge_pa: Number | float = 0.0) -> Number:
        """
        Return the inner volume [m^3]; scalars or arrays.

        Parameters
        ----------
        contraction_m : float or ndarray
            Contraction, m.
        gauge_pa : float or ndarray
            Gauge pressure, Pa; a cylinder of the bore does not depend on it.

        Raises
        ------
        InputError
            The volume is that of the law, and the law has none.

        """
        return VOLUMES[self.volume].volume_m3(self, contraction_m, gauge_pa)

    @cached_property
    def least_volume_m3(self) -> float:
        """
        Least d(p V)/dp [m^3] up to the stroke: what a change of pressure fills.

        Raises
        ------
        InputError
            The law has no volume, is of another length, or its air does not rise with pressure.

        """
        return VOLUMES[self.volume].least_volume_m3(self)

    def with_law(self, law: LawChoice | str) -> 'Muscle':
        """Return the muscle with another law, a LawChoice or a name; its set fits the bore."""
        return replace(self, law=checked_law(
            LawChoice(law) if isinstance(law, str) else law, bore_m=self.bore_m))

    def with_volume(self, volume: str, where: str = '') -> 'Muscle':
        """
        Return the muscle with another volume, one of ``pam_sim.volume.VOLUMES``.

        Raises
        ------
        InputError
            Unknown name, or as of ``least_volume_m3``.

        """
        if volume not in tuple(VOLUMES):
            raise InputError(f'volume `{volume}` is not known{did_you_mean(volume, VOLUMES)}; '
                             f'allowed: {", ".join(VOLUMES)}', where)
        chosen = replace(self, volume=volume)
        try:
            _ = chosen.least_volume_m3          # checked here, and found once
        except InputError as error:
            raise InputError(error.problem, where or error.where) from error
        return chosen

    def plain(self) -> dict[str, Any] | str:
        """Return the muscle as plain data for a model file: its name if that says all."""
        if self.name in muscle_names() and self == get_muscle(self.name):
            return self.name
        data = {parameter.name: getattr(self, parameter.name) for parameter in DIMENSIONS}
        if self.rests_on:
            data['rests_on'] = self.rests_on
        data['law'] = self.law.plain()
        if self.volume != _BORE:
            data['volume'] = self.volume
        return data


def muscle_names() -> list[str]:
    """Return the names of the muscles there are, sorted."""
    return _SIZES.names()


@lru_cache(maxsize=None)
def get_muscle(name: str) -> Muscle:
    """
    Return a muscle by name.

    Raises
    ------
    InputError
        Unknown name; the message lists the names there are.

    """
    if name not in muscle_names():
        raise InputError(
            f'muscle `{name}` is not known{did_you_mean(name, muscle_names())}; allowed: '
            f'{", ".join(muscle_names())}')
    return read_muscle(_SIZES.read(name), name)


def muscle_of(given: Muscle | str) -> Muscle:
    """
    Return a muscle, also by its name.

    Raises
    ------
    InputError
        Unknown name, or neither a muscle nor a name.

    """
    if isinstance(given, str):
        return get_muscle(given)
    if not isinstance(given, Muscle):
        raise InputError(f'is {shown(given)}; give a Muscle, or a name of '
                         f'{", ".join(muscle_names())}', 'muscle')
    return given


def read_muscle(data: Located, name: str = 'muscle') -> Muscle:
    """
    Return the muscle a mapping describes.

    Parameters
    ----------
    data : Located
        Dimensions, ``law``, ``rests_on``; with ``like`` only what differs from that muscle.
    name : str
        What to call it.

    Raises
    ------
    InputError
        Unknown key or law, or a number out of bounds, with file and line.

    """
    data.check_keys((*names_of(KEYS), *_DIMENSION_NAMES))
    base = Muscle(name)
    if 'like' in data:
        base = get_muscle(data.require('like', str, choices=muscle_names()))
    elif 'bore_m' not in data or 'length_m' not in data or 'law' not in data:
        raise data.error('a muscle states `length_m`, `bore_m` and `law`, or the muscle it is '
                         f'`like`: {", ".join(muscle_names())}')
    numbers = {one.name: data.require(one.name, float, one.lower, one.upper, unit=one.unit)
               for one in DIMENSIONS if one.name in data}
    rests_on = data.get('rests_on', str, base.rests_on if not numbers else 'stated by the model')
    law = read_law(data, base.law, numbers.get('bore_m', base.bore_m)
                   ) if 'law' in data else base.law
    made = replace(base, name=name, **numbers, law=law, rests_on=' '.join(rests_on.split()))
    return with_volume_of(made, data)


def with_volume_of(muscle: Muscle, data: Located) -> Muscle:
    """
    Return the muscle with the volume that a mapping states, or with its own.

    Raises
    ------
    InputError
        As of ``Muscle.with_volume``, with file and line.

    """
    if 'volume' not in data:
        return muscle
    return muscle.with_volume(
        data.require('volume', str, choices=tuple(VOLUMES)), data.where('volume'))


def read_law(data: Located, base: LawChoice | None = None, bore_m: float | None = None
             ) -> LawChoice:
    """
    Return the LawChoice under the key ``law`` of a mapping: a name, or a mapping.

    Parameters
    ----------
    data : Located
        Has the key ``law``: a name, or ``name``, ``set``, ``parameters``, ``table``.
    base : LawChoice, optional
        Used where only its numbers change.
    bore_m : float, optional
        Of the muscle: the set is the one whose bore is nearest, where none is named.

    Raises
    ------
    InputError
        Unknown law, set, parameter or table, or no set of a bore that fits, with file and line.

    """
    stated, where = data['law'], data.where('law')
    given = table = None
    if isinstance(stated, Located):
        stated.check_keys(names_of(LAW_KEYS))
        name = stated.get('name', str, None if base is None else base.name)
        chosen = stated.get('set', str, base.set if base and name == base.name else None)
        given = stated.get('parameters', dict)
        table = _read_law_table(stated) if 'table' in stated else None
    else:
        name, chosen = data.require('law', str), None
    return checked_law(LawChoice(name, chosen, given or {}, table), where, bore_m)


def checked_law(choice: LawChoice, where: str = '', bore_m: float | None = None) -> LawChoice:
    """
    Return a LawChoice with its set and plain parameters, once the law could be made.

    Without a set it gets the one that fits a bore.

    Raises
    ------
    InputError
        Unknown law, set or parameter, or no LawChoice.

    """
    if not isinstance(choice, LawChoice):
        raise InputError(f'is {shown(choice)}; give a LawChoice or the name of a law',
                         where or 'law')
    if choice.table is not None:
        law = make_law(choice.name, choice.table, where=where)
    else:
        chosen = choice.set if choice.set is not None or bore_m is None else (
            get_law(choice.name, where).set_for(bore_m, where))
        law = make_law(choice.name, choice.parameters or None, chosen, where)
    return LawChoice(choice.name, law.muscle, dict(choice.parameters or {}), choice.table)


def _read_law_table(stated: Located) -> LookupTable:
    given = stated['table']
    if isinstance(given, str):
        # The name of a text without a file has no folder: the current one counts.
        path = Path(stated.name).parent / given
        if not os.path.exists(path):
            raise stated.error(f'`table` is {given}, and {path.absolute()} is not there; a path '
                               'counts from the folder of the model file', 'table')
        return read_table(path)
    if not isinstance(given, Located):
        raise stated.error('`table` is the path of a CSV file or a mapping of '
                           + ', '.join(names_of(TABLE_KEYS)), 'table')
    given.check_keys(names_of(TABLE_KEYS))
    pressure, load, strain, air_mass_kg, source = (key.read(given) for key in TABLE_KEYS)
    return LookupTable(pressure, load, strain, air_mass_kg, source)
