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

"""The compiled closed loops of ``modes_template``, made anew whenever a part of them changes."""

import functools
from types import ModuleType

from pam_actuation.control.modes import force, joint
from pam_actuation.control.sofc.step import sofc_step
from pam_actuation.tuning.loop_module import load_loops
from pam_sim.joint import kernel as joint_kernel


@functools.cache
def compiled_modes() -> ModuleType:
    """Return the module with ``force_rollout`` and ``joint_rollout``."""
    return load_loops(
        'pam_modes_loop', 'modes_template.py',
        (sofc_step, force, joint),
        also=joint_kernel.joint_step.__module__)        # named after its own hash
