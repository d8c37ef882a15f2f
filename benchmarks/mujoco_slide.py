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
A mass on a slide joint, moved by MuJoCo's own pneumatic actuator ``cylinder``.

The nearest thing to the nominal rig that MuJoCo has: pressure as a first order lag of the
command, force proportional to it, damping, weight, end stops. No contacts.
"""

import time

import mujoco
from mujoco import rollout
import numpy as np

MODEL = """
<mujoco>
  <option timestep="0.001" gravity="0 0 -9.80665" integrator="Euler">
    <flag contact="disable"/>
  </option>
  <worldbody>
    <body>
      <joint name="rail" type="slide" axis="0 0 1" range="0 0.075" limited="true" damping="25"/>
      <geom type="sphere" size="0.05" mass="5"/>
    </body>
  </worldbody>
  <actuator>
    <cylinder joint="rail" timeconst="0.06" area="2.0e-4"/>
  </actuator>
</mujoco>
"""


def seconds_per_step(steps, repeats):
    """
    Return the shortest time of one step [s] per way to run the loop.

    Parameters
    ----------
    steps, repeats : int
        Steps of one run, and how many runs.

    """
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    control = 350e3 + 150e3 * np.sin(np.arange(steps) * 1e-3 * np.pi)
    start = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, start, mujoco.mjtState.mjSTATE_FULLPHYSICS)

    def native():
        rollout.rollout(model, data, start[np.newaxis], control[np.newaxis, :, np.newaxis])

    def interpreted():
        for value in control:
            data.ctrl[0] = value
            mujoco.mj_step(model, data)

    found = {}
    for label, loop in ((f'MuJoCo {mujoco.__version__}, loop in C (mujoco.rollout)', native),
                        (f'MuJoCo {mujoco.__version__}, loop in Python (mj_step)', interpreted)):
        best = np.inf
        for _ in range(repeats):
            mujoco.mj_resetData(model, data)
            began = time.perf_counter()
            loop()
            best = min(best, time.perf_counter() - began)
        found[label] = best / steps
    return found
