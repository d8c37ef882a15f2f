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

"""The compiled entry points of the joint."""

from collections.abc import Callable
from typing import Any

from pam_sim.annotations import FloatArray
from pam_sim.compiled import allocating_entry_point, entry_point, source_key
from pam_sim.joint import step as steps
from pam_sim.joint.step import Arrays
from pam_sim.rollout import physical


def _entries(key: int) -> tuple[Callable[..., Any], ...]:
    """Return the entry points as units of compiled code, stored under ``key``."""
    @entry_point
    def joint_step(joint: Arrays, flexor: Arrays, extensor: Arrays) -> None:
        """
        Advance the joint by one step and fill the three output rows.

        Parameters
        ----------
        joint : tuple of float64 arrays
            inp, state, par, out of :mod:`pam_sim.joint.layout`.
        flexor, extensor : tuple of float64 arrays
            state, par, inp, out of :mod:`pam_sim.rollout.layout`.

        """
        if key >= 0:        # always; makes the key part of what is stored
            steps.joint_step_body(joint, flexor, extensor)

    @entry_point
    def joint_look(joint: Arrays, flexor: Arrays, extensor: Arrays) -> None:
        """Take the forces from the muscles and fill the output rows without a step."""
        if key >= 0:
            steps.joint_look_body(joint, flexor, extensor)

    return joint_step, joint_look


joint_step, joint_look = _entries(source_key(steps))


def _rollout_entry(key: int) -> Callable[..., Any]:
    """
    Return the rollout, stored under ``key``.

    It calls the two above as names of this module. What a function closes over is part of the key
    under which numba stores it, and a compiled function differs from process to process.
    """
    @allocating_entry_point
    def joint_rollout(inputs: FloatArray, joint: Arrays, flexor: Arrays, extensor: Arrays,
                      joint_rows: FloatArray, flexor_rows: FloatArray,
                      extensor_rows: FloatArray) -> tuple[int, int]:
        """
        Step through ``inputs``, N rows of ``INPUT``; the rows have N + 1 lines, 0 the start.

        Of flexor and extensor the first line that is not physical is returned, -1 where all are.
        """
        if key < 0:
            return 0, 0
        flexor_unphysical = extensor_unphysical = -1
        inp, _, _, out = joint
        _, _, _, flexor_out = flexor
        _, _, _, extensor_out = extensor
        for i in range(inputs.shape[0] + 1):
            inp[:] = inputs[max(i - 1, 0)]
            if i > 0:
                joint_step(joint, flexor, extensor)
            else:
                joint_look(joint, flexor, extensor)
            joint_rows[i] = out
            flexor_rows[i] = flexor_out
            extensor_rows[i] = extensor_out
            flexor_unphysical = physical.first_unphysical(flexor_unphysical, i, flexor_out, 0)
            extensor_unphysical = physical.first_unphysical(
                extensor_unphysical, i, extensor_out, 0)
        return flexor_unphysical, extensor_unphysical

    return joint_rollout


joint_rollout = _rollout_entry(source_key(steps, physical))
