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

"""What the nodes of a run would each compile, or read from the cache, done once for all."""

from pam_sim.files import StrPath


def compile_ahead(rig_file: StrPath, controller_file: StrPath | None = None) -> None:
    """
    Run every compiled function of a run once, so that its machine code is in cache and memory.

    Parameters
    ----------
    rig_file : path
        Model file of a muscle or a joint.
    controller_file : path, optional
        File of the controller, of whatever rig.

    Raises
    ------
    InputError
        A file that cannot be read.

    """
    from pam_actuation.drivers.loop import DriverLoop
    from pam_sim.joint import load_rig_or_joint
    from pam_sim.joint.rig import JointRig
    rig = load_rig_or_joint(rig_file)
    if isinstance(rig, JointRig):
        flexor, extensor = ((0.0,) * len(one.signal_names) for one in rig.muscles.values())
        rig.plant().step(flexor, extensor)
    else:
        rig.plant().step((0.0,) * len(rig.signal_names))
    DriverLoop(rig.valve)
    if controller_file is not None:
        from pam_actuation.control.config import load_controller
        law = load_controller(controller_file, rig, accept_other_rig=True)
        law.step(0.0, 0.0, 0.0, 0.0, 0.0)
