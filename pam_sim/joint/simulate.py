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

"""Check the inputs of a joint simulation, run the rollout and check what came out."""

from typing import Any, TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.joint import kernel, layout
from pam_sim.joint.parameters import SIDES
from pam_sim.joint.response import JointResponse
from pam_sim.records import columns, size_of
from pam_sim.rollout import layout as muscle
from pam_sim.rollout import simulate as one_muscle

if TYPE_CHECKING:
    from pam_sim.joint.rig import JointRig

MAX_TORQUE_N_M = 1e4


def simulate_joint(joint: 'JointRig', flexor_signal: ArrayLike, extensor_signal: ArrayLike,
                   external_torque_n_m: ArrayLike | None, dt_s: float,
                   initial: dict[str, Any]) -> JointResponse:
    """Return the JointResponse; arguments and errors as of ``JointRig.simulate``."""
    inputs = input_array(joint, flexor_signal, extensor_signal, external_torque_n_m)
    plant = joint.plant(dt_s=dt_s, **initial)
    rows = [np.empty((len(inputs) + 1, size))
            for size in map(size_of, (layout.OUTPUT, muscle.OUTPUT, muscle.OUTPUT))]
    unphysical = kernel.joint_rollout(inputs, *plant.arrays, *rows)
    motion, *sides = rows
    for rig, outputs, row in zip((joint.flexor, joint.extensor), sides, unphysical):
        one_muscle.check_outputs(rig, outputs, row)
    if not np.isfinite(motion.sum()):
        row = int(np.argmax(~np.isfinite(motion).all(axis=1)))
        raise InputError(
            f'the motion is not finite from step {row} on; use a smaller `dt_s`, or less extreme '
            'numbers', f'joint {joint.name}')
    return JointResponse(*rows)


def input_array(joint: 'JointRig', flexor_signal: ArrayLike, extensor_signal: ArrayLike,
                external_torque_n_m: ArrayLike | None = None) -> FloatArray:
    """
    Return the inputs of a rollout, N rows of ``INPUT``; arguments as of ``JointRig.simulate``.

    Raises
    ------
    InputError
        Wrong shape or number not finite.

    """
    sides = []
    for rig, signal, name in ((joint.flexor, flexor_signal, 'flexor_signal'),
                              (joint.extensor, extensor_signal, 'extensor_signal')):
        try:
            sides.append(one_muscle.input_array(rig, signal, contraction_m=0.0)[0])
        except InputError as error:
            # The muscle's own message names the valve signal; here there are two of them.
            signal_name = '' if error.where == 'valve_signal' else f'{error.where} '
            raise InputError(signal_name + error.problem, name) from error
    if len(sides[0]) != len(sides[1]):
        raise InputError(f'has {len(sides[1])} samples, `flexor_signal` {len(sides[0])}',
                         'extensor_signal')
    inputs = np.zeros((len(sides[0]), size_of(layout.INPUT)))
    given = columns(inputs, layout.INPUT)
    for side, one in zip(SIDES, sides):
        for field in ('signal_0', 'signal_1'):
            given[f'{side}_{field}'] = columns(one, muscle.INPUT)[field]
    if external_torque_n_m is not None:
        torque = one_muscle.array_of(external_torque_n_m, 'external_torque_n_m')
        if torque.ndim != 0 and torque.shape != (len(inputs),):
            raise InputError(f'has shape {torque.shape}; one number or {len(inputs)} expected',
                             'external_torque_n_m')
        wrong = ~(np.abs(np.atleast_1d(torque)) <= MAX_TORQUE_N_M)
        if wrong.any():
            row = int(np.argmax(wrong))
            raise InputError(
                f'is {np.atleast_1d(torque)[row]:g} at sample {row}; allowed '
                f'{-MAX_TORQUE_N_M:g} to {MAX_TORQUE_N_M:g} N m', 'external_torque_n_m')
        given['torque_n_m'] = torque
    return inputs
