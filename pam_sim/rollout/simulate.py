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

"""Check the inputs of a simulation, run the rollout and check what came out."""

from typing import Any, TYPE_CHECKING
import warnings

import numpy as np
from numpy.typing import ArrayLike
from pam_sim.annotations import FloatArray
from pam_sim.declared import number_of, shown
from pam_sim.effects.registry import own_files
from pam_sim.errors import InputError
from pam_sim.load import LOADS
from pam_sim.muscle.law import ExtrapolationWarning
from pam_sim.muscle.muscle import LawChoice
from pam_sim.plugins import file_of_user
from pam_sim.records import columns, fields, size_of
from pam_sim.response import Response
from pam_sim.rollout import kernel
from pam_sim.rollout.layout import INPUT, OUTPUT, STATE
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_sim.rig import Rig

MAX_FORCE_N = 1e5
# Of the length at rest: a sensor may read a little below zero.
STRAIN_RANGE = (-0.05, 0.5)
_TRIED = 600                # steps of a trial: up, and down again


def simulate_rig(rig: 'Rig', valve_signal: ArrayLike,
                 external_force_n: ArrayLike | None, contraction_m: ArrayLike | None, dt_s: float,
                 initial: dict[str, Any]) -> Response:
    """Return the Response; arguments and errors as of ``Rig.simulate``."""
    state, par, inputs = prepare(
        rig, valve_signal, external_force_n, contraction_m, dt_s, initial)
    outputs = np.empty((len(inputs) + 1, size_of(OUTPUT)))
    check_outputs(rig, outputs, kernel.entries_for(par).rollout(state, par, inputs, outputs))
    return Response(outputs)


def prepare(rig: 'Rig', valve_signal: ArrayLike,
            external_force_n: ArrayLike | None, contraction_m: ArrayLike | None, dt_s: float,
            initial: dict[str, Any]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (state, par, inputs) of a rollout; arguments and errors as of ``Rig.simulate``."""
    inputs, start = input_array(rig, valve_signal, external_force_n, contraction_m)
    if start is not None:
        first_m = initial.get('initial_contraction_m')
        if first_m is not None and number_of(first_m, 'initial_contraction_m') != start:
            raise InputError(f'is {first_m:g}, and `contraction_m` begins at {start:g} m; leave '
                             'it out', 'initial_contraction_m')
        initial = {**initial, 'initial_contraction_m': start}
    state, par = rig.pack(dt_s=dt_s, **initial)
    if start is None and not LOADS[rig.load].MOVES_FREELY:
        columns(inputs, INPUT)['contraction_m'] = fields(state, STATE).contraction_m
    return state, par, inputs


def check_outputs(rig: 'Rig', outputs: FloatArray, unphysical: int) -> None:
    """
    Refuse a rollout that left the numbers; flag one that left the table of its force law.

    ``unphysical`` is the row from which on outputs are not physical, -1 where all are.

    Raises
    ------
    InputError
        A number is not finite or an absolute pressure not positive, with the step at which it
        began.

    """
    if unphysical >= 0:
        raise InputError(
            f'the simulation leaves what is physical at step {unphysical}: ' + (
                told_by_own_file(rig) or 'these numbers cannot be stepped so coarsely; use a '
                'smaller `dt_s`, or less extreme numbers'), f'rig {rig.name}')
    law = rig.muscle.law.law
    if not law.EXTRAPOLATES:
        seen = columns(outputs, OUTPUT)
        beyond = law.outside(
            seen['true_pressure_pa'] - P_ATM_PA, seen['true_contraction_m'] / rig.muscle.length_m)
        if beyond.any():
            warnings.warn(
                f'{100.0 * beyond.mean():.3g} % of the simulation lies '
                f'{law.outside_table_text()}', ExtrapolationWarning, stacklevel=4)


def told_by_own_file(rig: 'Rig', rolled: bool = True) -> str:
    """
    Return which file of the user keeps a rig from being stepped, empty if none does.

    A short motion is tried without each of its effects, without all of them, and with another
    force law.

    Parameters
    ----------
    rig : Rig
        One that could not be stepped.
    rolled : bool
        Whether its rollout is compiled; else it is tried step by step, as a plant is.

    """
    own = {name: file for name, file in own_files().items() if rig.effect(name) is not None}
    of_law = file_of_user(type(rig.muscle.law.law).COMPILED)
    if not (own or of_law) or _can_be_stepped(rig, rolled):
        return ''
    tried = [tuple(own), *((name,) for name in own)] if own else []
    for names in reversed(tried):
        rest = [setting for setting in rig.effects if setting.name not in names]
        if _can_be_stepped(rig.with_(effects=rest), rolled):
            told = ' and '.join(f'effect `{name}` of {own[name]}' for name in names)
            return (f'the rig can be stepped without {told}; look at the numbers and functions '
                    'there')
    if of_law and _can_be_stepped(rig.with_(law=LawChoice(), volume='bore'), rolled):
        return (f'the rig can be stepped with another force law than `{rig.muscle.law.name}` of '
                f'{of_law}; look at its force, also beyond the range of its set')
    return ''


def _can_be_stepped(rig: 'Rig', rolled: bool) -> bool:
    """Return whether a pressure that rises and falls, or a motion there and back, is physical."""
    half = _TRIED // 2
    on_off = [(0.5 * rig.signal_range[1], 0.0), (0.0, 0.5)]     # fills, then vents
    signal = [row[:len(rig.signal_names)] for row in on_off for _ in range(half)]
    there_m = np.linspace(0.0, 0.2 * rig.muscle.stroke_m, half)
    path_m = [*there_m, *there_m[::-1]] if LOADS[rig.load].NEEDS_CONTRACTION else None
    try:
        state, par, inputs = prepare(rig, signal, None, path_m, 1e-3, {})
    except InputError:
        return False
    entries = kernel.entries_for(par)
    if rolled:
        outputs = np.empty((len(inputs) + 1, size_of(OUTPUT)))
        return bool(entries.rollout(state, par, inputs, outputs) < 0)
    seen = np.zeros(size_of(OUTPUT))
    for given in inputs:
        entries.step(state, par, given, seen)
        if not np.isfinite(seen).all():
            return False
    return True


def input_array(rig: 'Rig', valve_signal: ArrayLike,
                external_force_n: ArrayLike | None = None,
                contraction_m: ArrayLike | None = None) -> tuple[FloatArray, float | None]:
    """
    Return (inputs, N rows of ``layout.INPUT``; contraction at the start or None).

    Raises
    ------
    InputError
        Wrong shape, number not finite or out of range, or the contraction of a driven load
        missing.

    """
    signal = array_of(valve_signal, 'valve_signal')
    wanted = len(rig.signal_names)
    if signal.ndim == 1 and wanted == 1:
        signal = signal[:, np.newaxis]
    if signal.ndim != 2 or signal.shape[1] != wanted or len(signal) == 0:
        shape = '(N,)' if wanted == 1 else '(N, 2)'
        raise InputError(f'has shape {np.shape(valve_signal)}; valve `{rig.valve}` takes {shape}, '
                         'N at least 1', 'valve_signal')
    count = len(signal)
    for column, name in enumerate(rig.signal_names):
        _check_range(signal[:, column], *rig.signal_range, name)
    inputs = np.zeros((count, size_of(INPUT)))
    inputs[:, :wanted] = signal
    if external_force_n is not None:
        force = _sized(external_force_n, (count,), 'external_force_n')
        _check_range(force, -MAX_FORCE_N, MAX_FORCE_N, 'N', 'external_force_n')
        columns(inputs, INPUT)['external_force_n'] = force
    start = None
    if contraction_m is not None:
        low, high = contraction_range_m(rig)
        path = _sized(contraction_m, (count, count + 1), 'contraction_m')
        if path.ndim == 0:
            path = np.full(count + 1, float(path))
        _check_range(path, low, high, 'm', 'contraction_m')
        start = float(path[0])
        held_m = columns(inputs, INPUT)['contraction_m']
        held_m[:len(path) - 1] = path[1:]
        held_m[len(path) - 1:] = path[-1]
    elif LOADS[rig.load].NEEDS_CONTRACTION:
        raise InputError('is missing; a driven load needs it', 'contraction_m')
    return inputs, start


def contraction_range_m(rig: 'Rig') -> tuple[float, float]:
    """Return lowest and highest prescribed contraction; refuse a load that moves freely."""
    if LOADS[rig.load].MOVES_FREELY:
        raise InputError(f'load `{rig.load}` moves freely; use a driven rig', 'contraction_m')
    low, high = STRAIN_RANGE
    return low * rig.muscle.length_m, high * rig.muscle.length_m


def _check_range(values: FloatArray, lower: float, upper: float, unit: str, name: str) -> None:
    """Refuse a number that is not finite or out of range, by name and place."""
    values = np.atleast_1d(values)
    slack = 1e-9 * (upper - lower)
    # Of the smallest and largest: not a number fails both comparisons.
    if values.min() >= lower - slack and values.max() <= upper + slack:
        return
    row = int(np.argmax(~((values >= lower - slack) & (values <= upper + slack))))
    raise InputError(f'is {values[row]:g} at sample {row}; allowed {lower:g} to {upper:g} {unit}',
                     name)


def array_of(values: ArrayLike, name: str) -> FloatArray:
    """Return an array of floats; refuse what is none."""
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f'is no array of numbers: {shown(values)}', name) from None


def _sized(values: ArrayLike, lengths: tuple[int, ...], name: str) -> FloatArray:
    array = array_of(values, name)
    if array.ndim == 0 or (array.ndim == 1 and len(array) in lengths):
        return array
    raise InputError(f'has shape {array.shape}; one number or {lengths[-1]} expected', name)
