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

"""One formulation of an effect with the parameters that are fitted."""

from collections.abc import Mapping
from dataclasses import dataclass
import itertools
from typing import Any

from pam_sim.effects.fitting import FreeParameter
from pam_sim.effects.registry import get_effect

NEAR = 0.05                  # of an end of a range that is not 0, as near counts as at it
Setting = dict[str, Any]       # an effect as an entry of a model file


@dataclass(frozen=True)
class Candidate:
    """
    One formulation with what is fitted of it.

    Parameters
    ----------
    effect : str
        Name in the registry.
    free : tuple of FreeParameter
    held : tuple of (str, float)
        Parameters set to a value that is not their nominal one.

    """

    effect: str
    free: tuple[FreeParameter, ...]
    held: tuple[tuple[str, float], ...] = ()

    @property
    def name(self) -> str:
        """Name under which a result states this formulation."""
        return get_effect(self.effect).variant_of or self.effect

    @property
    def is_refinement(self) -> bool:
        """Return whether it contains another formulation of its name and adds little."""
        return get_effect(self.effect).fitting.refinement

    @property
    def amplitudes(self) -> list[FreeParameter]:
        """Return the free parameters whose response is about proportional to their value."""
        return [f for f in self.free if not f.shape]

    def at_end(self, values: Mapping[str, float]) -> FreeParameter | None:
        """Return the first amplitude that is at an end of its range other than 0, or none."""
        return next((f for f in self.amplitudes if is_at_end(values[f.name], f.lower, f.upper)),
                    None)

    def starts(self) -> list[dict[str, float]]:
        """Return the parameter dicts that the screening tries."""
        grids = [f.starts or (f.typical,) for f in self.free]
        return [dict(zip((f.name for f in self.free), values))
                for values in itertools.product(*grids)]

    def typical_start(self) -> tuple[float, ...]:
        """Return the normalised coordinates of everything that is fitted at its typical size."""
        return tuple(f.coordinate(f.typical) for f in self.free)

    def setting(self, values: Mapping[str, float]) -> Setting:
        """Return the effect as an entry of a model file."""
        return {'name': self.effect, 'parameters': {**dict(self.held), **values}}


def is_at_end(value: float, *ends: float) -> bool:
    """Return whether a value is at an end of its range that is not 0."""
    return any(end and abs(value - end) <= NEAR * abs(end) for end in ends)
