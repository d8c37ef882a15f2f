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

"""Find the muscle laws: every module of ``laws``, and of ``PAM_MUSCLE_LAWS_PATH``."""

from functools import lru_cache
import math
from pathlib import Path
import re
from typing import Any

import numpy as np
from pam_sim.errors import InputError
from pam_sim.muscle.law import MuscleLaw
from pam_sim.muscle.rules import at, check_rules, formula_at, grid, MAX_STRAIN, MIN_STRAIN
from pam_sim.plugins import check_name, formula, pick, plugin_files, plugin_module, told_with_place

VARIABLE = 'PAM_MUSCLE_LAWS_PATH'       # folders with laws of others
_OWN_FOLDER = Path(__file__).parent / 'laws'
_POINT = 'gauge_pa', 'strain', 'par'
_ALIKE = 1e-9               # of the largest force: what two ways to calculate differ by
_LEAST_PA = 1e3             # of the highest pressure of a range; less is one in kPa or bar
_SIZE_IN_NAME = re.compile(r'dmsp_(\d+)(?:_|$)')


def law_files() -> list[Path]:
    """Return the source files of all laws, sorted by name."""
    return plugin_files(_OWN_FOLDER, VARIABLE)


@lru_cache(maxsize=None)
def laws() -> dict[str, type[MuscleLaw]]:
    """
    Return all laws: name -> subclass of MuscleLaw, sorted by name.

    Raises
    ------
    InputError
        A file without ``LAW`` or ``tension_n``, a name that is taken, a formula that is not
        compiled or has other arguments, a set named after a size without its bore, one whose
        range is not in Pa and shares of the length, or one with which the law breaks a rule it
        claims.

    """
    found: dict[str, type[MuscleLaw]] = {}
    places: dict[str, Path] = {}
    for path in law_files():
        module = plugin_module(path, _OWN_FOLDER, 'pam_sim.muscle.laws', 'pam_muscle_law')
        law = getattr(module, 'LAW', None)
        if not (isinstance(law, type) and issubclass(law, MuscleLaw)):
            raise InputError('defines no LAW, a subclass of MuscleLaw', str(path))
        check_name('law', law.NAME, path, places)
        compiled = formula(module, 'tension_n', _POINT, path, law.PACKED)
        if compiled is None:
            raise InputError(f'defines no `tension_n`; write `def tension_n({", ".join(_POINT)})` '
                             'with `@compiled` above it', str(path))
        law.COMPILED = compiled
        law.COMPILED_DAMPER = formula(
            module, 'damper_force_n', ('velocity_m_per_s', *_POINT), path, law.PACKED)
        law.COMPILED_VOLUME = formula(module, 'volume_m3', _POINT, path, law.PACKED, 'volume_m3')
        _check_bores(law, path)
        if path.parent != _OWN_FOLDER:
            _check_sets(law, path)
        places[law.NAME] = path
        found[law.NAME] = law
    return found


def _check_bores(law: type[MuscleLaw], path: Path) -> None:
    """Refuse a set that is named after a size of muscle and states another bore, or none."""
    for name, one in law.SETS.items():
        size = _SIZE_IN_NAME.match(name)
        if size and not math.isclose(one.bore_m, 1e-3 * int(size[1])):
            raise InputError(
                f'the set `{name}` is named after a muscle of {size[1]} mm and has bore_m = '
                f'{one.bore_m:g}; write bore_m={1e-3 * int(size[1]):g} or give it another name',
                str(path))


def _check_sets(law: type[MuscleLaw], path: Path) -> None:
    """Refuse a law that breaks with one of its sets; the tests do this with our own."""
    if law.__init__ is MuscleLaw.__init__:      # a law of another making may need a table
        for name in law.SETS:
            with told_with_place(path, f'law `{law.NAME}` (set `{name}`) cannot be used'):
                _check_validity(law, name, path)
                one = law(None, name, str(path))
                check_rules(one, str(path))
                _check_array(one, path)


def _check_validity(law: type[MuscleLaw], name: str, path: Path) -> None:
    """Refuse a set whose range cannot be one in Pa and in shares of the length at rest."""
    low_pa, high_pa = law.SETS[name].validity.pressure_gauge_pa
    low, high = law.SETS[name].validity.strain
    told = f'law `{law.NAME}` (set `{name}`) is valid'
    if not (low_pa < high_pa and high_pa >= _LEAST_PA):
        raise InputError(
            f'{told} from {low_pa:g} to {high_pa:g} Pa; write gauge pressures in Pa that rise to '
            f'{_LEAST_PA:g} or more, such as (0.0, 600e3)', str(path))
    if not MIN_STRAIN <= low < high <= MAX_STRAIN:
        raise InputError(
            f'{told} for contractions from {low:g} to {high:g}; write shares of the length at '
            f'rest that rise within {MIN_STRAIN:g} to {MAX_STRAIN:g}, such as (0.0, 0.25)',
            str(path))


def _check_array(law: MuscleLaw, path: Path) -> None:
    """Refuse a law whose class calculates arrays in a way of its own that gives something else."""
    if type(law)._tension_n is MuscleLaw._tension_n:
        return
    pressure, strain = grid(law)
    force = formula_at(law, pressure, strain)
    own = np.broadcast_to(law._tension_n(pressure[:, np.newaxis], strain), force.shape)
    for i, k in np.argwhere(~(np.abs(own - force) <= _ALIKE * np.abs(force).max())):
        raise InputError(
            f'law `{law.NAME}` (set `{law.muscle}`) has two formulas: '
            f'{at(pressure[i], strain[k])} `tension_n` gives {force[i, k]:g} N and `_tension_n` '
            f'of the class {own[i, k]:g} N; leave out `_tension_n`', str(path))


def get_law(name: str, where: str = '') -> type[MuscleLaw]:
    """
    Return a law's class by name.

    Raises
    ------
    InputError
        Unknown name; the message lists the names there are.

    """
    return pick(laws(), name, 'muscle law', where, VARIABLE)


def make_law(name: str, values: Any = None, muscle: str | None = None,
             where: str = '') -> MuscleLaw:
    """
    Return a law by name, with a named parameter set and values that differ from it.

    ``values`` is a mapping of parameters; for the law ``lookup`` a ``LookupTable``.

    Raises
    ------
    InputError
        Unknown law, set or parameter, or a value out of bounds.

    """
    return get_law(name, where)(values, muscle, where)
