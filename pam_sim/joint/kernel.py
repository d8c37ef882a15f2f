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

from pathlib import Path

from pam_sim.compiled import source_key
from pam_sim.generated import generated_module
from pam_sim.joint import layout
from pam_sim.rollout import kernel

_FOLDER = Path(__file__).parent


def _load():
    source = (_FOLDER / 'step_template.py').read_text(encoding='utf-8')
    return generated_module(
        'pam_joint_kernel', f'# Of sources {source_key(kernel, layout):x}.\n{source}')


_module = _load()
joint_step = _module.joint_step
joint_look = _module.joint_look
joint_rollout = _module.joint_rollout
