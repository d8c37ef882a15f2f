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

"""Check the inputs of a joint simulation and run the rollout."""

import numpy as np
from pam_sim.errors import InputError
from pam_sim.joint import kernel, layout
from pam_sim.joint.response import JointResponse
from pam_sim.rollout import layout as muscle
from pam_sim.rollout import simulate as one_muscle


def simulate_joint(joint, flexor_signal, extensor_signal, external_torque_n_m, dt_s, initial):
    """Return the JointResponse; arguments and errors as of ``JointRig.simulate``."""
    inputs = input_array(joint, flexor_signal, extensor_signal, external_torque_n_m)
    plant = joint.plant(dt_s=dt_s, **initial)
    rows = [np.empty((len(inputs) + 1, size))
            for size in (layout.OUT_SIZE, muscle.OUT_SIZE, muscle.OUT_SIZE)]
    kernel.joint_rollout(inputs, *plant.arrays, *rows)
    return JointResponse(*rows)


def input_array(joint, flexor_signal, extensor_signal, external_torque_n_m=None):
    """
    Return the inputs (N, IN_SIZE) of a rollout; arguments as of ``JointRig.simulate``.

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
            raise InputError(error.problem, name) from error
    if len(sides[0]) != len(sides[1]):
        raise InputError(f'has {len(sides[1])} samples, `flexor_signal` {len(sides[0])}',
                         'extensor_signal')
    inputs = np.zeros((len(sides[0]), layout.IN_SIZE))
    both = slice(muscle.INP_SIGNAL_0, muscle.INP_SIGNAL_1 + 1)
    inputs[:, layout.IN_FLEXOR_0:layout.IN_FLEXOR_1 + 1] = sides[0][:, both]
    inputs[:, layout.IN_EXTENSOR_0:layout.IN_EXTENSOR_1 + 1] = sides[1][:, both]
    if external_torque_n_m is not None:
        torque = np.asarray(external_torque_n_m, dtype=float)
        if torque.ndim != 0 and torque.shape != (len(inputs),):
            raise InputError(f'has shape {torque.shape}; one number or {len(inputs)} expected',
                             'external_torque_n_m')
        if not np.isfinite(torque).all():
            raise InputError('a number is not finite', 'external_torque_n_m')
        inputs[:, layout.IN_TORQUE] = torque
    return inputs
