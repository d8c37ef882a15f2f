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
Find the loads: every module of this folder, and of ``PAM_LOADS_PATH``.

A load that moves freely has the number ``mass_kg``, its inertia as the muscle feels it, and a
compiled ``load_force_n``. The force of the hanging mass stands in the step itself.
"""

from collections.abc import Mapping
from pathlib import Path
from types import ModuleType

import numpy as np
from pam_sim.annotations import Number
from pam_sim.compiled import interpreted
from pam_sim.errors import InputError
from pam_sim.plugins import (
    check_name, check_stated, formula, plugin_files, plugin_module, told_with_place)
from pam_sim.records import fields, record, values_of

HANGING_MASS = 'hanging_mass'
VARIABLE = 'PAM_LOADS_PATH'         # folders with loads of others
_OWN_FOLDER = Path(__file__).parent
_TEXT, _TRUTH = (str, "a text, '...'"), (bool, 'True or False')
_STATED: dict[str, tuple[type, str]] = {
    'NAME': _TEXT, 'SENTENCE': _TEXT, 'EQUATION': _TEXT, 'SOURCE': _TEXT,
    'MOVES_FREELY': _TRUTH, 'NEEDS_CONTRACTION': _TRUTH,
    'PARAMETERS': (tuple, 'a tuple, (Parameter(...),)')}
_ARGUMENTS = 'contraction_m', 'velocity_m_per_s', 'par'
_POINTS = 257               # of the stroke, where the stiffness is looked for
_SLOW_M_PER_S = 1e-3


def find_loads() -> dict[str, ModuleType]:
    """
    Return all loads: name -> module; those that move freely first, then held ones.

    Raises
    ------
    InputError
        A file that does not state what a load states, or a name that is taken.

    """
    found: dict[str, ModuleType] = {}
    for path in plugin_files(_OWN_FOLDER, VARIABLE, ('registry',)):
        module = plugin_module(path, _OWN_FOLDER, 'pam_sim.load', 'pam_load')
        missing = [name for name in _STATED if not hasattr(module, name)]
        if missing:
            raise InputError(f'defines no {missing[0]}; a load states {", ".join(_STATED)}',
                             str(path))
        check_stated(module, _STATED, path)
        check_name('load', module.NAME, path, {
            name: Path(str(other.__file__)) for name, other in found.items()})
        with told_with_place(path, 'cannot be used'):
            _check_force(module, path)
        found[module.NAME] = module
    return dict(sorted(found.items(), key=lambda item: (
        not item[1].MOVES_FREELY, item[1].NEEDS_CONTRACTION, item[0])))


def _check_force(module: ModuleType, path: Path) -> None:
    """Refuse a load whose force cannot be calculated."""
    if module.NAME == HANGING_MASS:
        return
    if module.MOVES_FREELY and not any(
            p.name == 'mass_kg' and p.lower > 0.0 for p in module.PARAMETERS):
        raise InputError('moves freely: state the parameter `mass_kg`, above 0, its inertia as '
                         'the muscle feels it', str(path))
    function = formula(module, 'load_force_n', _ARGUMENTS, path, packed_of(module))
    if not module.MOVES_FREELY:
        if function is not None:
            raise InputError('has a `load_force_n`, which a load that is held does not feel; '
                             'state MOVES_FREELY = True', str(path))
        return
    if function is None:
        raise InputError(
            f'moves freely: write `def load_force_n({", ".join(_ARGUMENTS)})` with `@compiled` '
            'above it, and read the numbers by name, `par.mass_kg`', str(path))


def packed_of(load: ModuleType) -> np.dtype[np.void]:
    """Return the record ``par`` of a load's force: its parameters by their names."""
    return record(*(parameter.name for parameter in load.PARAMETERS))


def has_force(load: ModuleType) -> bool:
    """Return whether a load has a force of its own file."""
    return hasattr(load, 'load_force_n')


def load_force_n(load: ModuleType, values: Mapping[str, float], contraction_m: Number,
                 velocity_m_per_s: Number) -> Number:
    """
    Return the force [N] of a load against contraction, inertia and external force excepted.

    Parameters
    ----------
    load : module
        One with a force of its own.
    values : mapping
        Numbers of the rig, SI.
    contraction_m, velocity_m_per_s : float or ndarray
        Motion of the end of the muscle; arrays broadcast.

    Raises
    ------
    InputError
        The force cannot be calculated, or is not finite where the motion is.

    """
    packed = packed_of(load)
    par = fields(values_of(packed, {name: values[name] for name in packed.names or ()}), packed)
    formula = interpreted(load.load_force_n)
    force = np.vectorize(lambda x, v: formula(x, v, par), otypes=[float])
    with told_with_place(str(load.__file__), '`load_force_n` fails'), np.errstate(all='ignore'):
        found: Number = force(contraction_m, velocity_m_per_s)[()]
    moved = np.isfinite(contraction_m) & np.isfinite(velocity_m_per_s)
    wrong = moved & ~np.isfinite(found)
    if np.any(wrong):
        x_m = np.broadcast_to(contraction_m, np.shape(found))[wrong][0]
        raise InputError(f'`load_force_n` gives no finite force at contraction {x_m:g} m; it must '
                         'from 0 to the stroke of the muscle', str(load.__file__))
    return found


def steepest(load: ModuleType, values: Mapping[str, float],
             stroke_m: float) -> tuple[float, float]:
    """Return the largest stiffness [N/m] and damping [N s/m] of a load's own force."""
    x_m = np.linspace(0.0, stroke_m, _POINTS)
    still = load_force_n(load, values, x_m, 0.0 * x_m)
    moving = load_force_n(load, values, x_m, 0.0 * x_m + _SLOW_M_PER_S)
    return (float(np.abs(np.diff(still)).max()) * (_POINTS - 1) / stroke_m,
            float(np.abs(moving - still).max()) / _SLOW_M_PER_S)
