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

"""Excite many frequencies at once."""

from dataclasses import dataclass

import numpy as np
from pam_actuation.experiments.primitives.base import key, Primitive


@dataclass
class Multisine(Primitive):
    """
    Sum of sines with equal amplitudes and random phases; ``amplitude`` bounds the peak within 5 %.

    The peak is sought at ten points of a period of the quickest sine. Between two of them it may
    be larger by 1 / cos(pi / 10).
    """

    QUANTITIES = ('center', 'amplitude')
    start: float
    center: float = key('centre of the motion')
    amplitude: float = key('bound of the sum of all sines, to within 5 %')
    min_hz: float = key('lowest frequency')
    max_hz: float = key('highest frequency')
    lines: int = key('number of sines')
    duration_s: float = key('how long it lasts')
    seed: int = key('of the random numbers', default=1)

    def problem(self) -> str:
        """Refuse a band of frequencies in the wrong order."""
        return '' if self.min_hz < self.max_hz else 'min_hz must be below max_hz'

    def __post_init__(self) -> None:
        """Choose log-spaced frequencies and phases from the seed, scaled to the peak bound."""
        if self.problem():
            return
        rng = np.random.default_rng(int(self.seed))
        self._w = 2.0 * np.pi * np.geomspace(self.min_hz, self.max_hz, int(self.lines))
        self._phase = rng.uniform(0.0, 2.0 * np.pi, int(self.lines))
        t = np.arange(0.0, self.duration_s, 0.1 / self.max_hz)
        wave = np.zeros_like(t)
        for w, phase in zip(self._w, self._phase):
            wave += np.sin(w * t + phase)
        self._scale = self.amplitude / max(float(np.max(np.abs(wave))), 1e-9)

    def at(self, t_s: float) -> tuple[float, float]:
        """Return value and rate, faded in and out over a second so that it starts at rest."""
        wave = self._scale * float(np.sin(self._w * t_s + self._phase).sum())
        rate = self._scale * float((self._w * np.cos(self._w * t_s + self._phase)).sum())
        edge = min(t_s, self.duration_s - t_s, 1.0)
        fade = max(edge, 0.0)
        slope = 0.0 if fade in (0.0, 1.0) else (1.0 if t_s < self.duration_s / 2 else -1.0)
        return self.center + fade * wave, fade * rate + slope * wave


PRIMITIVE = Multisine
