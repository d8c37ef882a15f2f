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
import hashlib
from pathlib import Path

from pam_actuation.control import compiled_entry
from pam_actuation.control.modes import force, joint
from pam_actuation.control.sofc import step as sofc_step_module
from pam_actuation.drivers import hsv_kernel, ppr
from pam_actuation.tuning import loop_parts
from pam_sim.joint import kernel as joint_kernel
from pam_sim.rollout.generate import kernel_hash, load_cached_module


@functools.cache
def compiled_modes():
    """Return the module with ``force_rollout`` and ``joint_rollout``."""
    source = (Path(__file__).parent / 'modes_template.py').read_text(encoding='utf-8')
    key = hashlib.sha256(source.encode())
    key.update(kernel_hash().encode())
    key.update(joint_kernel.joint_step.__module__.encode())      # named after its own hash
    for names in (sofc_step_module.SOURCES, force.SOURCES, joint.SOURCES):
        key.update(str(compiled_entry.source_key(*names)).encode())
    for module in (hsv_kernel, ppr, loop_parts):
        key.update(Path(module.__file__).read_bytes())
    return load_cached_module('pam_modes_loop', source, key.hexdigest()[:12])
