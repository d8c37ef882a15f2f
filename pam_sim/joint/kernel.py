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

"""The compiled step of the joint, made anew whenever the muscle's kernel is another one."""

import hashlib
from pathlib import Path

from pam_sim.rollout.generate import kernel_hash, load_cached_module

_FOLDER = Path(__file__).parent


def _load():
    source = (_FOLDER / 'step_template.py').read_text(encoding='utf-8')
    key = hashlib.sha256(source.encode())
    key.update((_FOLDER / 'layout.py').read_bytes())
    key.update(kernel_hash().encode())
    return load_cached_module('pam_joint_kernel', source, key.hexdigest()[:12])


_module = _load()
joint_step = _module.joint_step
joint_look = _module.joint_look
joint_rollout = _module.joint_rollout
