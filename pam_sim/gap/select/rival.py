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

"""A fitted hypothesis among rivals, and what is named of them."""

from dataclasses import dataclass, field

from pam_sim.annotations import FloatArray
from pam_sim.effects.registry import effects
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.select.candidates import is_limit_at

_END = 0.02                  # numerics: of a shape to the end of its range, in its logarithm


@dataclass
class Rival:
    """
    One hypothesis with its share of the gap and, against the best, its t, by subsystem.

    ``cross_fit`` is the same fitted to the part of the data that judges.
    """

    name: str
    found: Fit
    share: dict[str, float] = field(default_factory=dict)
    t: dict[str, float] = field(default_factory=dict)
    polished: bool = False
    cross_fit: Fit | None = None

    def cross_errors(self, subsystem: str) -> FloatArray:
        """Return the errors of the cross fit in a subsystem; there must be one."""
        assert self.cross_fit is not None
        return self.cross_fit.errors[subsystem]

    @property
    def at_edge(self) -> bool:
        """
        Return whether a shape of the effect went to the end of its range.

        There an effect turns into another one, its limit, and its name means nothing.
        """
        for place, c in enumerate(self.found.hypothesis.effects):
            if c.name == self.name:
                return is_limit_at(c, self.found.values()[place]) or any(
                    f.shape and abs(x - f.coordinate(getattr(f, end))) < _END
                    for f, x in zip(c.free, self.found.theta_of(place)) for end in f.ends)
        return False

    @property
    def is_exact(self) -> bool:
        """Return whether it has one form: a parameter of the model, a bias or gain of a sensor."""
        return self.name not in effects() or (
            effects()[self.name].fitting.sensor_change in ('bias', 'gain'))


@dataclass
class NamedEffect:
    """
    An effect or a number that was added to the model.

    ``names`` explain as much, itself first; ``formulations`` are all fits under its name.
    """

    name: str
    subsystem: str
    rivals: list[Rival]
    names: tuple[str, ...]
    formulations: list[Rival] = field(default_factory=list)
