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
What controllers without rules have in common: the arrays of a compiled step function.

A law that learns nothing is a vector of settings, an array of what it knows of the
muscle, a state, and ``step(parameters, knowledge, state, inputs, outputs)``.
"""

import math

import numpy as np
from pam_actuation.control import inputs as place


class FixedLawController:
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

    rules = None
    rules_replaced = 0

    def __init__(self, step, settings, knowledge, state_size, rig_name=''):
        self.settings = settings
        self.rig_name = rig_name
        self.freeze_learning = False
        self.parameters = np.array(list(settings.values()), dtype=float)
        self._step = step
        self._state = np.zeros(state_size)
        self._inputs = np.zeros(place.INPUT_COUNT)
        self._outputs = np.zeros(len(self.state_names))
        self._arguments = (
            self.parameters, knowledge, self._state, self._inputs, self._outputs)
        self.step(0.0, 0.0, 0.0, 0.0, 0.0)      # compile now, not in the first real tick
        self.pause()

    @property
    def rate_hz(self):
        """Rate [Hz] at which ``step`` is to be called."""
        return self.settings['rate_hz']

    @property
    def lead_s(self):
        """Preview [s]: how far ahead the lead reference is to be taken."""
        return self.settings['lead_s']

    def step(self, x_m, ref_m, ref_vel_m_per_s, ref_lead_m, ref_lead_vel_m_per_s, learn=True,
             elapsed_s=math.nan, pressure_pa=math.nan, force_n=math.nan):
        """Run one tick as ``SelfOrganizingFuzzyController.step``; ``learn`` is ignored."""
        self._inputs[:] = (
            x_m, ref_m, ref_vel_m_per_s, ref_lead_m, ref_lead_vel_m_per_s, 0.0, elapsed_s,
            pressure_pa, force_n)
        return self._step(*self._arguments)

    def compiled_arguments(self):
        """Return the arrays the compiled step takes, for compiled closed loops."""
        return self._arguments

    def state_values(self):
        """Return the values of ``state_names`` of the last tick as a tuple of floats."""
        return tuple(self._outputs.tolist())

    def learning_reason(self):
        """Return why nothing is learned."""
        return 'this controller has no rules'

    def pause(self):
        """Forget the motion: the next tick starts bumplessly."""
        self._state[:] = 0.0
        self._outputs[:] = 0.0

    def reset(self):
        """Forget the motion."""
        self.pause()

    def to_yaml(self):
        """Return YAML text from which ``load_controller`` builds an identical controller."""
        from pam_actuation.control.config import controller_to_yaml
        return controller_to_yaml(self)
