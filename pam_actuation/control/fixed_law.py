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

A law that learns nothing is a record of settings, an array of what it knows of the
muscle, a state, and ``step(parameters, *knowledge, state, inputs, outputs)``.
"""

from collections.abc import Callable

import numpy as np
from pam_actuation.control.compiled_controller import CompiledController
from pam_actuation.control.settings import LIMITS
from pam_sim.annotations import FloatArray
from pam_sim.compiled import direct
from pam_sim.records import cells, values_of


class FixedLawController(CompiledController):
    """
    A compiled law in the interface of all controllers.

    Subclasses have ``kind`` and ``state_names`` and give the rest here.

    Parameters
    ----------
    step : callable
        Compiled: ``step(parameters, *knowledge, state, inputs, outputs)`` -> command [Pa].
    settings : dict
        Checked settings, one for each field of ``parameters``.
    knowledge : numpy.ndarray
        What the law knows of the muscle.
    parameters, state : numpy.dtype
        Records of the step function.
    rig_name : str
        Identity of the rig, for the record.
    *more : numpy.ndarray
        What else it knows, behind the first.

    """

    learns = False

    def __init__(self, step: Callable[..., float], settings: dict[str, float],
                 knowledge: FloatArray, parameters: 'np.dtype[np.record]',
                 state: 'np.dtype[np.record]', rig_name: str = '', *more: FloatArray) -> None:
        super().__init__(settings, state, rig_name)
        self.parameters = values_of(parameters, settings)
        self._limits = tuple(vars(cells(self.parameters, parameters))[name] for name in LIMITS)
        self._step = step
        self._arguments = (
            self.parameters, knowledge, *more, self._state, self._inputs, self._outputs)
        self.step(0.0, 0.0, 0.0, 0.0, 0.0)      # compile now, not in the first real tick
        self._step = direct(step)
        self.pause()

    def learning_reason(self) -> str:
        """Return why nothing is learned."""
        return 'this controller has no rules'

    def reset(self) -> None:
        """Forget the motion."""
        self.pause()
