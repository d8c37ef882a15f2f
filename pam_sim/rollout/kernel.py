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
The compiled kernel of the registered effects.

``step(state, par, inp, out)`` may be called from other compiled functions;
arrays are laid out as in :mod:`pam_sim.rollout.layout`.
"""

from pam_sim.rollout.generate import load_kernel

_module = load_kernel()
step = _module.step
look = _module.look
settle = _module.settle
driven_tension = _module.driven_tension
driven_force = _module.driven_force
rest_contraction = _module.rest_contraction
rollout = _module.rollout
