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
Physics and models of a rig with a pneumatic artificial muscle; no ROS.

``load_rig`` gives a rig from a preset or a model file; ``Rig.simulate`` runs
it on arrays, ``Rig.plant`` step by step. ``load_joint`` does the same for two muscles
that turn a joint.
"""

from pam_sim.errors import InputError

__all__ = ['InputError', 'Rig', 'load_joint', 'load_rig', 'preset_names']


def __getattr__(name):
    """Import the simulation only when it is asked for: it brings the compiler with it."""
    if name in ('load_rig', 'preset_names'):
        from pam_sim import model_file
        return getattr(model_file, name)
    if name == 'load_joint':
        from pam_sim.joint.model_file import load_joint
        return load_joint
    if name == 'Rig':
        from pam_sim.rig import Rig
        return Rig
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
