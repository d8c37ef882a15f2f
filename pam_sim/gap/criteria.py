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

A workflow is given its criteria as an argument. ``replace(CRITERIA, seen_gap=0.1)`` makes others,
such as an ablation needs.
"""

from dataclasses import dataclass, field, fields
from typing import Any

GROUPS = ('health', 'detection', 'screening', 'comparison', 'ranking', 'elimination',
          'plausibility', 'materiality', 'refutation', 'planning')


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

    min_duration_s: float = _criterion(
        5.0, 's', 'health',
        'Time that all signals must cover.',
        'Twice the blocks of one part; design choice.')
    min_rate_hz: float = _criterion(
        90.0, 'Hz', 'health',
        'Rate below which a topic is refused.',
        'The wire asks for 100 Hz; live rates scatter a little.')
    max_hole_s: float = _criterion(
        0.05, 's', 'health',
        'Time without a message from which on it is a dropout.',
        'Design choice.')
    max_dropout_share: float = _criterion(
        0.05, '-', 'health',
        'Share of the time in dropouts that is accepted.',
        'Design choice.')
    max_saturation_share: float = _criterion(
        0.5, '-', 'health',
        'Share of valve messages at their limit that is accepted.',
        'Design choice.')
    noted_saturation_share: float = _criterion(
        0.1, '-', 'health',
        'Share of valve messages at their limit that is remarked on.',
        'Design choice.')
    min_pressure_move_pa: float = _criterion(
        5000.0, 'Pa', 'health',
        'Range of the pressure below which the rig is at rest.',
        'Design choice.')
    min_contraction_move_m: float = _criterion(
        0.0005, 'm', 'health',
        'Range of the contraction below which the rig is at rest.',
        'Design choice.')
    max_overlap_share: float = _criterion(
        0.5, '-', 'health',
        'Share of equal messages from which on two recordings are one.',
        'Design choice.')
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
    unnamed_factor: float = _criterion(
        2.0, 'materiality', 'detection',
        'Gap without a name that is worth a verdict.',
        'Simulated records.')
    least_unnamed_sd: float = _criterion(
        1.5, 'sensor deviations', 'detection',
        'The same, however small the materiality.',
        'Simulated records.')
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
    tried_as_wrong_sd: float = _criterion(
        1.0, 'prior deviations', 'screening',
        'How far a number is off when it is tried as wrong.',
        'One deviation.')
    promised_share: float = _criterion(
        0.8, 'of the gap', 'screening',
        'What a pair must promise to be fitted.',
        'What is in no library promises less.')
    active_gap: float = _criterion(
        0.3, 'floors squared', 'comparison',
        'Gap of a block from which on it judges.',
        'Prototype; see docs/gap.md.')
    active_share: float = _criterion(
        0.05, 'of the mean gap', 'comparison',
        'The same, relative to the mean over blocks.',
        'Prototype.')
    active_difference: float = _criterion(
        0.5, 'of the mean difference', 'comparison',
        'Difference of two rivals from which on a block judges.',
        'Simulated records with two recordings.')
    min_blocks: int = _criterion(
        4, 'blocks', 'comparison',
        'Blocks below which there is no test.',
        'Fewer say nothing by ranks.')
    few_blocks: int = _criterion(
        12, 'blocks', 'comparison',
        'Active blocks below which quiet ones judge, too.',
        'Simulated records.')
    certain_t: float = _criterion(
        3.0, 'normal deviations', 'comparison',
        'By how much an effect must be better than none.',
        'One-sided 0.1 %.')
    half_sure_t: float = _criterion(
        1.0, 'normal deviations', 'comparison',
        'From where on all of the data are asked.',
        'One deviation.')
    first_gain: float = _criterion(
        0.25, 'of the gap', 'ranking',
        'Least that a first effect explains.',
        'Simulated records.')
    later_gain: float = _criterion(
        0.7, 'of the rest', 'ranking',
        'Least that a further effect explains of what is left.',
        'Simulated records.')
    rival_share: float = _criterion(
        0.5, 'of the best share', 'ranking',
        'Less is no rival; a relative that leaves less is likelier.',
        'Half.')
    better_t: float = _criterion(
        2.0, 'normal deviations', 'ranking',
        'By how much a formulation beats the simpler one it contains.',
        'One-sided 2.5 %.')
    ahead_t: float = _criterion(
        2.5, 'normal deviations', 'ranking',
        'By how much a name leaves one that explains as much behind.',
        'One-sided 0.6 %.')
    behind_t: float = _criterion(
        1.5, 'normal deviations', 'ranking',
        'The same for one that explains clearly less.',
        'One-sided 7 %.')
    same_form_share: float = _criterion(
        0.002, 'of what the best adds', 'ranking',
        'Shares this near are equal: no formulation is that true.',
        'Formulations of one name on simulated records.')
    close_share: float = _criterion(
        0.05, 'of the gap', 'ranking',
        'Shares this near count as equal for a common cause.',
        'Simulated records.')
    unpolished_rest: float = _criterion(
        0.5, 'of the rest', 'ranking',
        'How much better a first fit may still be than it seems.',
        'What polishing gained on simulated records.')
    done_share: float = _criterion(
        0.0035, 'of the gap', 'elimination',
        'Rest that formulations may leave.',
        'Formulations of one name on simulated records.')
    formulation_share: float = _criterion(
        0.02, 'of the gap', 'elimination',
        'Rest they may leave for another effect of their family.',
        'Two kinds of friction on simulated records.')
    certain_size: float = _criterion(
        5.0, 'deviations', 'elimination',
        'By how much a size must differ from none.',
        'Noise floors that were too careful on simulated records.')
    equal_edges: float = _criterion(
        0.02, 'of the later edge', 'elimination',
        'As near, both edges are one delay.',
        'Simulated records with switching valves.')
    named_share: float = _criterion(
        0.9, 'of the gap', 'plausibility',
        'Least to explain for a name, and for a simpler one to stand for its limit.',
        'No formulation is the muscle itself; simulated records.')
    named_clearly_share: float = _criterion(
        0.95, 'of the gap', 'plausibility',
        'The same where several formulations leave a clear rest.',
        'Simulated records with effects of no library.')
    clear_rest: float = _criterion(
        25.0, 'floors squared', 'plausibility',
        'Rest that is clear.',
        'Five floors.')
    near_floor: float = _criterion(
        0.25, 'floors squared', 'plausibility',
        'Rest so small that it may be the error of the floor.',
        'Half a floor.')
    implausible_sd: float = _criterion(
        3.0, 'prior deviations', 'plausibility',
        'A fit that needs a number so far off explains nothing.',
        'Two-sided 0.3 %.')
    plausible_sd: float = _criterion(
        2.0, 'prior deviations', 'plausibility',
        'Within which a number is not wrong.',
        'Two-sided 5 %.')
    unbent_share: float = _criterion(
        0.98, 'of the gap', 'plausibility',
        'What plausible numbers must explain to be preferred.',
        'Simulated records.')
    visible_sd: float = _criterion(
        0.3, 'sensor deviations', 'materiality',
        'Less cannot be told from none.',
        'Prototype: names from 0.3 of a sample on.')
    found_again_sd: float = _criterion(
        0.1, 'sensor deviations', 'materiality',
        'The same where the certify data confirm the effect.',
        'Simulated records.')
    refuted_fall: float = _criterion(
        0.5, 'of the squared difference', 'refutation',
        'Fall by which another name refutes it.',
        'Half of that of a true effect.')
    inseparable_factor: float = _criterion(
        10.0, 'visible sizes', 'planning',
        'Rivals that need more are called inseparable.',
        'Design choice.')
    alike_cosine: float = _criterion(
        0.9, '-', 'planning',
        'Cosine of two signatures from which on they look alike.',
        'Prototype.')
    simpler_condition_share: float = _criterion(
        0.1, '-', 'planning',
        'A simpler condition as near as this is named instead.',
        'Design choice.')


CRITERIA = Criteria()


def table(criteria: Criteria = CRITERIA) -> list[Criterion]:
    """Return every decision threshold with its meaning, group by group."""
    found = [Criterion(f.name, getattr(criteria, f.name), **f.metadata) for f in fields(criteria)]
    return sorted(found, key=lambda c: GROUPS.index(c.group))
