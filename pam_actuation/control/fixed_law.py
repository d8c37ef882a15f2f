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
What controllers without rules have in common.

A law that learns nothing is a vector of settings, an array of what it knows of the
muscle, a state, and ``step(parameters, knowledge, state, inputs, outputs)``.
"""

import numpy as np
from pam_actuation.control.compiled_controller import CompiledController


class FixedLawController(CompiledController):
    """
    A compiled law in the interface of all controllers.

    Subclasses have ``kind`` and ``state_names`` and give the rest here.

    Parameters
    ----------
    step : callable
        Compiled: ``step(parameters, knowledge, state, inputs, outputs)`` -> command [Pa].
    settings : dict
        Checked settings in the order the step function expects; has ``rate_hz`` and ``lead_s``.
    knowledge : numpy.ndarray
        What the law knows of the muscle.
    state_size : int
        Length of the state.
    rig_name : str
        Identity of the rig, for the record.

    """

    def __init__(self, step, settings, knowledge, state_size, rig_name=''):
        super().__init__(settings, state_size, rig_name)
        self.parameters = np.array(list(settings.values()), dtype=float)
        self._step = step
        self._arguments = (
            self.parameters, knowledge, self._state, self._inputs, self._outputs)
        self.step(0.0, 0.0, 0.0, 0.0, 0.0)      # compile now, not in the first real tick
        self.pause()

    def learning_reason(self):
        """Return why nothing is learned."""
        return 'this controller has no rules'

    def reset(self):
        """Forget the motion."""
        self.pause()
