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

"""The encoder on a joint: noise and quantisation of its angle."""

import math

import numpy as np

ANGLE_NOISE_RAD = 5e-4                      # design value of an encoder on the joint
ANGLE_STEP_RAD = 2.0 * math.pi / 2 ** 14    # of 14 bit a turn


class Encoder:
    """
    Noise and quantisation of an angle with an explicit seed.

    Parameters
    ----------
    seed : int or tuple of int
        Of the random numbers.

    """

    def __init__(self, seed: int | tuple[int, ...] = 0) -> None:
        self._random = np.random.default_rng(seed)

    def read(self, angle_rad: float) -> float:
        """Return one reading [rad] of a true angle."""
        noisy_rad = angle_rad + ANGLE_NOISE_RAD * self._random.standard_normal()
        return round(noisy_rad / ANGLE_STEP_RAD) * ANGLE_STEP_RAD
