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

"""What a person is told and asked before a muscle moves."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pam_sim.located_yaml import load_yaml, Located
from pam_sim.units import gauge_kpa

if TYPE_CHECKING:
    from pam_actuation.experiments.experiment import Experiment

LIMIT = 'max_pressure_gauge_pa'


@dataclass(frozen=True)
class Motion:
    """
    One motion of a muscle, before it is allowed.

    Parameters
    ----------
    experiment : Experiment
        What is played.
    limit_gauge_pa : float
        Above this pressure the driver lets no air in [Pa gauge].
    valve : str
        ``ppr`` or ``hsv``.
    is_real : bool
        False: the muscle is simulated by a node.
    why : str
        What it would show.
    remarks : tuple of str
        What the rig cannot do of it, a sentence each.

    """

    experiment: 'Experiment'
    limit_gauge_pa: float
    valve: str
    is_real: bool
    why: str = ''
    remarks: tuple[str, ...] = ()

    def text(self) -> str:
        """Return what is about to move, how long and up to which pressure."""
        one = self.experiment
        muscle = 'the muscle of your rig' if self.is_real else 'a simulated muscle'
        highest = '' if one.domain != 'pressure' else (
            f' The pressure goes up to {gauge_kpa(one.chain.extremes()[1]):.0f} kPa gauge.')
        lines = [
            f'The next experiment moves {muscle} ({self.valve}): "{one.name}", '
            f'{one.duration_s:.1f} s.{highest} The limit of the driver is '
            f'{self.limit_gauge_pa * 1e-3:.0f} kPa gauge. It vents at the end.']
        if self.why:
            lines.append(f'Why: {self.why}')
        lines += [f'Remark: {remark}.' for remark in self.remarks]
        if one.needs:
            lines.append(f'It needs these sensors: {", ".join(one.needs)}.')
        if self.is_real:
            lines.append('Keep clear of the load, and have the dump valve within reach. '
                         'This software is not certified for safety.')
        return '\n'.join(lines)


Ask = Callable[[Motion], bool]      # whether the motion is allowed


def limit_of(file: str, default: float) -> float:
    """
    Return the lowest pressure limit [Pa gauge] that a file of hardware states, or the default.

    Parameters
    ----------
    file : str
        Path of the parameter file of the nodes.
    default : float
        Limit of the driver without one.

    """
    return min(_limits_in(load_yaml(file)), default=default)


def _limits_in(tree: Located) -> Iterator[float]:
    found = tree.get(LIMIT)
    if isinstance(found, (int, float)):
        yield float(found)
    for value in tree.values():
        if isinstance(value, Located):
            yield from _limits_in(value)
