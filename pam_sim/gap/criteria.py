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
The decision thresholds of the gap workflow, all of them.

A *decision threshold* is a number with which recordings, fits or names are compared, and whose
outcome changes what is refused, tried, kept, named or called certain. It stands here. Other
numbers stay near their code. These are *numerics* (grids, steps, tolerances, iterations, windows,
draws) and *effort* (how many effects are fitted). They are also *assumptions* about the
measurement, such as priors of latency and skew, the widths of intervals, and the wording of
sentences.

What follows from others is a property of the criteria, or uses one of the ``common`` ones. How
near each comes to a decision, and what changes when it is halved or doubled, is measured by
``benchmarks/criteria_ablation.py``.

A workflow is given its criteria as an argument. ``replace(CRITERIA, seen_gap=0.1)`` makes others,
such as an ablation needs.
"""

from dataclasses import dataclass, field, fields
from typing import Any

GROUPS = ('common', 'health', 'detection', 'screening', 'comparison', 'ranking', 'elimination',
          'plausibility', 'materiality', 'planning')


def _criterion(value: Any, unit: str, group: str, meaning: str, source: str) -> Any:
    return field(default=value, metadata={
        'unit': unit, 'group': group, 'meaning': meaning, 'source': source})


@dataclass(frozen=True)
class Criterion:
    """One decision threshold: its name, value, unit, group, meaning and source."""

    name: str
    value: float
    unit: str
    group: str
    meaning: str
    source: str


@dataclass(frozen=True)
class Criteria:
    """Values of all decision thresholds; :func:`table` tells what each means."""

    certain_sd: float = _criterion(
        3.0, 'deviations', 'common',
        'What differs by so much, differs for certain: an effect from none.',
        'One-sided 0.1 % of a normal distribution.')
    likely_sd: float = _criterion(
        2.0, 'deviations', 'common',
        'What differs by so much, probably differs: a formulation from a simpler one.',
        'One-sided 2.5 % of a normal distribution.')
    hint_sd: float = _criterion(
        1.0, 'deviations', 'common',
        'What differs by so much is worth a look: a test on all data, a number tried as wrong.',
        'One deviation.')
    greater_part: float = _criterion(
        0.5, '-', 'common',
        'Half: of a share, a rest or a fall, from which on one thing outweighs the other.',
        'Half.')
    close_share: float = _criterion(
        0.05, 'of the gap', 'common',
        'Shares this near count as equal, and less as none: of a gap, the time, the moves.',
        'Simulated records.')
    min_duration_s: float = _criterion(
        5.0, 's', 'health',
        'Time that all signals must cover.',
        'Twice the blocks of one part; design choice.')
    min_rate_hz: float = _criterion(
        9.0, 'Hz', 'health',
        'Rate below which a topic is refused.',
        'Logs of 10 Hz still show a muscle; rates scatter a little.')
    min_pulse_rate_hz: float = _criterion(
        90.0, 'Hz', 'health',
        'The same for the signal of on/off valves.',
        'A pulse every 10 ms, and one that is missing is air that is missing.')
    max_hole_s: float = _criterion(
        0.05, 's', 'health',
        'Time without a message from which on it is a dropout.',
        'Design choice.')
    min_pressure_move_pa: float = _criterion(
        5000.0, 'Pa', 'health',
        'Range of the pressure below which the rig is at rest.',
        'Design choice.')
    min_contraction_move_m: float = _criterion(
        0.0005, 'm', 'health',
        'Range of the contraction below which the rig is at rest.',
        'Design choice.')
    rest_stroke_share: float = _criterion(
        0.005, 'of the stroke', 'health',
        'Contraction up to which a load may rest on its stop.',
        'A few deviations of a contraction sensor; 0.25 mm of a stroke of 50 mm.')
    least_rest_s: float = _criterion(
        0.1, 's', 'health',
        'Time without a break in which the load cell reads far less than the load weighs, from '
        'which on the load rests on a stop.',
        'A load that falls passes the last 0.5 % of the stroke in some 10 ms.')
    least_line_share: float = _criterion(
        0.25, 'of the contraction', 'health',
        'Range of contraction of a moving load, from which on a line through its force reaches '
        'to zero contraction.',
        'Own measurements of a lab: the line is within 5 % of the weight.')
    seen_gap: float = _criterion(
        0.05, 'floors squared', 'detection',
        'Gap from which on a subsystem needs an explanation.',
        'Error of the noise floor on simulated records without a gap.')
    least_gap: float = _criterion(
        0.01, 'floors squared', 'detection',
        'Gap an effect must promise to be tried where none is seen.',
        'Simulated records; scaled with the materiality.')
    max_prior_sd: float = _criterion(
        3.5, 'prior deviations', 'detection',
        'How far a number may move before it is wrong, not inexact.',
        'Two-sided 0.05 % of a normal prior.')
    floor_error: float = _criterion(
        1.2, '-', 'detection',
        'Factor by which a noise floor may be too low.',
        'Spread of floors over simulated records.')
    promising_share: float = _criterion(
        0.15, 'of the best promise', 'screening',
        'Promise from which on a further name is fitted.',
        'Simulated records.')
    contending_share: float = _criterion(
        0.35, 'of the gap', 'screening',
        'How far behind the best a name still has other formulations tried.',
        'Simulated records.')
    refinable_rest: float = _criterion(
        3.0, 'of the least rest', 'screening',
        'Rest up to which a refinement may still win.',
        'What refinements gained on simulated records.')
    promised_share: float = _criterion(
        0.8, 'of the gap', 'screening',
        'What a pair must promise to be fitted.',
        'What is in no library promises less.')
    active_gap: float = _criterion(
        0.3, 'floors squared', 'comparison',
        'Gap of a block from which on it judges.',
        'Prototype; see docs/explanation/gap_method.md.')
    min_blocks: int = _criterion(
        4, 'blocks', 'comparison',
        'Blocks below which there is no test.',
        'Fewer say nothing by ranks.')
    few_blocks: int = _criterion(
        12, 'blocks', 'comparison',
        'Active blocks below which quiet ones judge, too.',
        'Simulated records.')
    first_gain: float = _criterion(
        0.25, 'of the gap', 'ranking',
        'Least that a first effect explains.',
        'Simulated records.')
    later_gain: float = _criterion(
        0.7, 'of the rest', 'ranking',
        'Least that a further effect explains of what is left.',
        'Simulated records.')
    ahead_t: float = _criterion(
        2.5, 'normal deviations', 'ranking',
        'By how much a name leaves one that explains as much behind.',
        'One-sided 0.6 %.')
    behind_t: float = _criterion(
        1.5, 'normal deviations', 'ranking',
        'The same for one that explains clearly less.',
        'One-sided 7 %.')
    rough_tolerance: float = _criterion(
        0.05, 'of the number', 'ranking',
        'Tolerance from which on a number of load or valve stands before a sensor error.',
        'More than twice the tolerance of a number from a data sheet; design choice.')
    same_form_share: float = _criterion(
        0.002, 'of what the best adds', 'ranking',
        'Shares this near are equal: no formulation is that true.',
        'Formulations of one name on simulated records.')
    done_share: float = _criterion(
        0.0035, 'of the gap', 'elimination',
        'Rest that formulations may leave.',
        'Formulations of one name on simulated records.')
    formulation_share: float = _criterion(
        0.02, 'of the gap', 'elimination',
        'Rest they may leave for another effect of their family.',
        'Two kinds of friction on simulated records.')
    equal_edges: float = _criterion(
        0.02, 'of the later edge', 'elimination',
        'As near, both edges are one delay.',
        'Simulated records with switching valves.')
    named_share: float = _criterion(
        0.9, 'of the gap', 'plausibility',
        'Least to explain for a name, and for a simpler one to stand for its limit.',
        'No formulation is the muscle itself; simulated records.')
    partial_share: float = _criterion(
        0.3, 'of the gap', 'plausibility',
        'Rest on the certify data from which on what is named is a part only.',
        'The interface of gap.json.')
    visible_sd: float = _criterion(
        0.3, 'sensor deviations', 'materiality',
        'Less cannot be told from none.',
        'Prototype: names from 0.3 of a sample on.')
    found_again_sd: float = _criterion(
        0.1, 'sensor deviations', 'materiality',
        'The same where the certify data confirm the effect.',
        'Simulated records.')
    inseparable_factor: float = _criterion(
        10.0, 'visible sizes', 'planning',
        'Rivals that need more are called inseparable.',
        'Design choice.')
    alike_cosine: float = _criterion(
        0.9, '-', 'planning',
        'Cosine of two signatures from which on they look alike.',
        'Prototype.')

    @property
    def near_floor(self) -> float:
        """Return the rest, in floors squared, that may be the error of the floor: half of it."""
        return self.greater_part ** 2

    @property
    def second_speed(self) -> float:
        """Return how many times as quick strokes are a second speed: others are half of them."""
        return 1.0 / self.greater_part

    @property
    def certain_size(self) -> float:
        """Return by how many deviations a size differs from none: its likely least does so."""
        return self.certain_sd + self.likely_sd

    @property
    def clear_rest(self) -> float:
        """Return the rest, in floors squared, that is as clear as a certain size."""
        return self.certain_size ** 2

    @property
    def named_clearly_share(self) -> float:
        """Return the least share for a name where more is expected: half the rest left."""
        return 1.0 - self.greater_part * (1.0 - self.named_share)


CRITERIA = Criteria()


def table(criteria: Criteria = CRITERIA) -> list[Criterion]:
    """Return every decision threshold with its meaning, group by group."""
    found = [Criterion(f.name, getattr(criteria, f.name), **f.metadata) for f in fields(criteria)]
    return sorted(found, key=lambda c: GROUPS.index(c.group))
