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
The model predictive controller in YAML.

::

    controller: mpc
    settings: {change_weight: 0.01}
    model:                        # optional: by default identified on the rig, in simulation
      rate_hz: 200.0
      delay_ticks: 7
      denominator: [-2.7, 2.5, -0.8]
      numerator: [1.1e-10, 4.0e-10, 0.9e-10]
      contraction_m: 0.014
      pressure_pa: 0.0

Its pressures are equivalent ones (``mpc_gains``). A recording also keeps ``gains``,
``observer_gains`` and ``static_inverse``, so that a replay on another machine has the same bits.
"""

from collections.abc import Callable, Mapping

import numpy as np
from pam_actuation.control.lqi_files import KEYS, model_of, take_gains
from pam_actuation.control.mpc import MpcController, SETTINGS
from pam_actuation.control.mpc_gains import (
    gains_of_every_tick, identify_behind_inverse, MODEL)
from pam_sim.annotations import FloatArray
from pam_sim.located_yaml import Located
from pam_sim.parameters import check_parameters
from pam_sim.rig import Rig

__all__ = ['KEYS', 'mpc_from_tree']


def mpc_from_tree(tree: Located, rig: Rig | None, inverse: FloatArray,
                  settings: Mapping[str, object], rig_name: str,
                  where: Callable[[str], str]) -> MpcController:
    """
    Return the MpcController of a ``Located`` mapping.

    Raises
    ------
    InputError
        A number is missing or out of range, neither model nor rig is given, or the rig
        cannot be identified.

    """
    model = model_of(tree, rig, lambda known: identify_behind_inverse(
        known, inverse, check_parameters(SETTINGS, settings, 'setting', where)['rate_hz']))
    controller = MpcController(model, inverse, settings, rig_name, where)
    take_gains(tree, controller, np.ones(controller.gains.size, dtype=bool), MODEL,
               gains_of_every_tick)
    return controller
