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
The compiled entry points of the rig: from float64 arrays to records and back.

``step(state, par, inp, out)`` may be called from other compiled functions; arrays are laid
out as in :mod:`pam_sim.rollout.layout`. There are two sets of the same entry points. The one that
also knows terms without a name, ``with_terms``, is compiled where a rig has one.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.compiled import allocating_entry_point, compiled, entry_point, source_key
from pam_sim.errors import InputError
from pam_sim.records import part, size_of
from pam_sim.rollout import forces, layout, physical, step as steps
from pam_sim.rollout.dispatch import hooks
from pam_sim.rollout.layout import (
    EFFECTS, INPUT, NOMINAL, OUTPUT, PARAMETERS, STATE, TERMS)

_INPUT_SIZE, _OUTPUT_SIZE = size_of(INPUT), size_of(OUTPUT)


@compiled
def _step_beyond(state: np.record, par: np.record, given: np.record, seen: np.record) -> None:
    """Advance a rig with effects: one piece of machine code, called."""
    steps.step_body(EFFECTS, state, par, given, seen)


@compiled
def _step_terms(state: np.record, par: np.record, given: np.record, seen: np.record) -> None:
    """Advance a rig with terms that have no name."""
    steps.step_body(TERMS, state, par, given, seen)


class Entries(NamedTuple):
    """The entry points; what each does stands where it is made."""

    step: Callable[..., Any]
    look: Callable[..., Any]
    settle: Callable[..., Any]
    rest_contraction: Callable[..., Any]
    driven_tension: Callable[..., Any]
    driven_force: Callable[..., Any]
    rollout: Callable[..., Any]


def _entries(key: int, beyond: int) -> Entries:
    """Return the entry points as units of compiled code, stored under ``key``."""
    @entry_point
    def step(state: FloatArray, par: FloatArray, inp: FloatArray, out: FloatArray) -> None:
        """Advance ``state`` by one step and fill ``out`` (see pam_sim.rollout.layout)."""
        if key < 0:         # never; makes the key part of what is stored
            return
        of_rig, numbers = part(state, 0, STATE), part(par, 0, PARAMETERS)
        given, seen = part(inp, 0, INPUT), part(out, 0, OUTPUT)
        if beyond == TERMS:         # known to the compiler, which leaves out the rest
            _step_terms(of_rig, numbers, given, seen)
        elif numbers.beyond_nominal > NOMINAL:
            _step_beyond(of_rig, numbers, given, seen)
        else:
            steps.step_body(NOMINAL, of_rig, numbers, given, seen)

    @entry_point
    def look(state: FloatArray, par: FloatArray, inp: FloatArray, out: FloatArray) -> None:
        """Fill ``out`` from ``state`` without a step."""
        if key >= 0:
            steps.look_body(beyond, part(state, 0, STATE), part(par, 0, PARAMETERS),
                            part(inp, 0, INPUT), part(out, 0, OUTPUT))

    @entry_point
    def settle(state: FloatArray, par: FloatArray) -> None:
        """Make the dependent states agree with pressure and contraction before the first step."""
        if key >= 0:
            steps.settle_body(beyond, part(state, 0, STATE), part(par, 0, PARAMETERS))

    @entry_point
    def rest_contraction(p: float, state: FloatArray, par: FloatArray) -> float:
        """Return the contraction [m] at which a free load rests at a pressure [Pa]."""
        if key < 0:
            return 0.0
        return steps.rest_body(p, beyond, part(state, 0, STATE), part(par, 0, PARAMETERS))

    @entry_point
    def driven_tension(state: FloatArray, par: FloatArray) -> float:
        """Return the static tension [N] of the present state: force map and what changes it."""
        if key < 0:
            return 0.0
        of_rig = part(state, 0, STATE)
        return forces.map_tension(of_rig.pressure_pa, of_rig.contraction_m, beyond, of_rig,
                                  part(par, 0, PARAMETERS))

    @entry_point
    def driven_force(tension: float, velocity: float, state: FloatArray,
                     par: FloatArray) -> tuple[float, float]:
        """Return (force without dry friction, its level) [N] of the present state."""
        if key < 0:
            return 0.0, 0.0
        of_rig, numbers = part(state, 0, STATE), part(par, 0, PARAMETERS)
        p, x = of_rig.pressure_pa, of_rig.contraction_m
        return (forces.muscle_force(tension, p, x, velocity, 0.0, 0.0, beyond, of_rig, numbers),
                hooks.muscle_friction(0.0, p, x, velocity, beyond, of_rig, numbers))

    @allocating_entry_point
    def rollout(state: FloatArray, par: FloatArray, inputs: FloatArray,
                outputs: FloatArray) -> int:
        """
        Step through ``inputs``, N rows of ``INPUT``; ``outputs`` has N + 1 of ``OUTPUT``.

        Row 0 is the start. Both contiguous. The number of the first row that is not physical is
        returned, -1 where all are.
        """
        if key < 0:
            return 0
        of_rig, numbers = part(state, 0, STATE), part(par, 0, PARAMETERS)
        flat_in, flat_out = inputs.reshape(inputs.size), outputs.reshape(outputs.size)
        steps.look_body(
            beyond, of_rig, numbers, part(flat_in, 0, INPUT), part(flat_out, 0, OUTPUT))
        unphysical = physical.first_unphysical(-1, 0, flat_out, 0)
        if beyond == TERMS or numbers.beyond_nominal > NOMINAL:
            for i in range(inputs.shape[0]):
                step_given = part(flat_in, i * _INPUT_SIZE, INPUT)
                step_seen = part(flat_out, (i + 1) * _OUTPUT_SIZE, OUTPUT)
                if beyond == TERMS:
                    _step_terms(of_rig, numbers, step_given, step_seen)
                else:
                    _step_beyond(of_rig, numbers, step_given, step_seen)
                unphysical = physical.first_unphysical(
                    unphysical, i + 1, flat_out, (i + 1) * _OUTPUT_SIZE)
        else:
            for i in range(inputs.shape[0]):
                steps.step_body(NOMINAL, of_rig, numbers, part(flat_in, i * _INPUT_SIZE, INPUT),
                                part(flat_out, (i + 1) * _OUTPUT_SIZE, OUTPUT))
                unphysical = physical.first_unphysical(
                    unphysical, i + 1, flat_out, (i + 1) * _OUTPUT_SIZE)
        return unphysical

    return Entries(
        step, look, settle, rest_contraction, driven_tension, driven_force, rollout)


_KEY = source_key(steps, layout, physical)
named = (step, look, settle, rest_contraction, driven_tension, driven_force, rollout) = _entries(
    _KEY, EFFECTS)
with_terms = _entries(_KEY, TERMS)


def refuse_terms(par: FloatArray) -> None:
    """
    Check a packed rig for code that calls ``step`` itself, as compiled rollouts do.

    Raises
    ------
    InputError
        The rig has a term without a name.

    """
    if entries_for(par) is not named:
        raise InputError(
            'the rig has a term without a name, which only the search for a form simulates; '
            'use the effect file that `pam gap` writes of it')


def entries_for(par: FloatArray) -> Entries:
    """Return the entry points that know all that acts in a rig packed into ``par``."""
    return with_terms if part(par, 0, PARAMETERS).beyond_nominal == TERMS else named
