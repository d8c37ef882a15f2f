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

"""What the sensors add to the signals of the rig."""

from typing import Any, TYPE_CHECKING

import numpy as np
from pam_sim.declared import check_whole
from pam_sim.parameters import check_parameters, Parameter

if TYPE_CHECKING:
    from pam_sim.rig import Rig

SENSOR_PARAMETERS = (
    Parameter('pressure_noise_pa', 'Pa', 0.0, 0.0, 1e5, description='White noise, 1 sigma.'),
    Parameter('contraction_noise_m', 'm', 0.0, 0.0, 0.01, description='White noise, 1 sigma.'),
    Parameter('force_noise_n', 'N', 0.0, 0.0, 100.0, description='White noise, 1 sigma.'),
    Parameter('pressure_step_pa', 'Pa', 0.0, 0.0, 1e5, description='Quantisation; 0 for none.'),
    Parameter('contraction_step_m', 'm', 0.0, 0.0, 0.01, description='Quantisation; 0 for none.'),
    Parameter('force_step_n', 'N', 0.0, 0.0, 100.0, description='Quantisation; 0 for none.'),
    Parameter('stamp_jitter_s', 's', 0.0, 0.0, 0.01, description='Jitter of the stamp, 1 sigma.'),
)
_DRAWN = 64         # readings whose noise is drawn at once


class SensorChain:
    """
    Noise, quantisation and stamp jitter with an explicit seed.

    Parameters
    ----------
    settings : mapping of str to float
        Values of :data:`SENSOR_PARAMETERS`; a ``Rig`` may be given instead.
        Everything zero (the nominal rig) adds nothing.
    seed : int
        Seed of the random numbers.

    Raises
    ------
    InputError
        Unknown or out-of-bound setting, or a seed that is no whole number from 0 on.

    """

    def __init__(self, settings: 'Rig | dict[str, float] | None' = None, seed: int = 0) -> None:
        given: Any = getattr(settings, 'sensors', settings)
        self.settings = check_parameters(
            SENSOR_PARAMETERS, given or {}, 'sensor setting', 'sensors')
        check_whole(seed, 0, 'seed')
        self.seed = int(seed)
        value = self.settings
        self._sigma = np.array([value['pressure_noise_pa'], value['contraction_noise_m'],
                                value['force_noise_n'], value['stamp_jitter_s']])
        self._step = (value['pressure_step_pa'], value['contraction_step_m'],
                      value['force_step_n'])
        self._random = np.random.default_rng(self.seed)
        self._adds_noise = bool(np.any(self._sigma))
        self._quantises = any(self._step)
        self._drawn: list[list[float]] = []     # noise of the next readings, the first one last

    def read(self, time_s: float, pressure_pa: float, contraction_m: float,
             force_n: float) -> tuple[float, float, float, int]:
        """
        Return one reading.

        Parameters
        ----------
        time_s : float
            Time of the sample, s; the noise is a sequence, not a function of it.
        pressure_pa, contraction_m, force_n : float
            Signals at that time, Pa absolute, m, N.

        Returns
        -------
        tuple
            (pressure [Pa absolute], contraction [m], force [N], stamp jitter [ns] as int).

        """
        jitter_ns = 0
        if self._adds_noise:
            if not self._drawn:
                # So many at once are the same numbers as one by one, in a fraction of the time.
                self._drawn = (self._random.standard_normal((_DRAWN, 4))
                               * self._sigma).tolist()[::-1]
            noise_pa, noise_m, noise_n, jitter_s = self._drawn.pop()
            pressure_pa += noise_pa
            contraction_m += noise_m
            force_n += noise_n
            jitter_ns = round(jitter_s * 1e9)
        if self._quantises:
            pressure_pa, contraction_m, force_n = (
                round(value / step) * step if step > 0.0 else value
                for value, step in zip((pressure_pa, contraction_m, force_n), self._step))
        return pressure_pa, contraction_m, force_n, jitter_ns
