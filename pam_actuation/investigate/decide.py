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

"""What follows a round: the end with an answer, or one more experiment."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pam_actuation.experiments.experiment import load_experiment
from pam_actuation.investigate.rounds import ANSWERS, Round
from pam_sim.located_yaml import dump_yaml

if TYPE_CHECKING:
    from pam_actuation.experiments.experiment import Experiment

ANSWERED, NOT_NAMED, PARTLY_NAMED, NOT_SEPARABLE, REFUSED = (
    'answered', 'not_named', 'partly_named', 'not_separable', 'refused')
ROUNDS, MINUTES, DECLINED, FAILED, IMPOSSIBLE = (
    'rounds', 'minutes', 'declined', 'failed', 'impossible')
# How an investigation may end, and what that means.
ENDINGS = {
    ANSWERED: 'One answer holds for all recordings.',
    NOT_NAMED: 'No name in the library explains the gap, and no experiment is left that would.',
    PARTLY_NAMED: 'What is named explains only a part of the gap, and no experiment is left that '
                  'would explain more.',
    NOT_SEPARABLE: 'No experiment is left that would tell the names apart.',
    REFUSED: 'The recordings cannot be used.',
    ROUNDS: 'The rounds allowed are used up.',
    MINUTES: 'The time allowed is used up.',
    DECLINED: 'The next motion was not allowed; nothing moved.',
    FAILED: 'A recording did not come to its end; the muscle was vented.',
    IMPOSSIBLE: 'The rig cannot do the next experiment.'}
FIRST = 'The first experiment shows every effect a little.'
WIDE = ('The recordings so far give no full answer. This experiment shows every effect a little.')


@dataclass(frozen=True)
class Decision:
    """
    What follows.

    Parameters
    ----------
    ended : str
        A key of ``ENDINGS``; '' where it goes on.
    experiment : Experiment or None
        What is played next.
    why : str
        What it would show.

    """

    ended: str = ''
    experiment: 'Experiment | None' = None
    why: str = ''


def decide(rounds: Sequence[Round], wide: 'Experiment') -> Decision:
    """
    Return what follows the rounds so far.

    Parameters
    ----------
    rounds : sequence of Round
        In order.
    wide : Experiment
        Shows every effect a little. It comes first, or after recordings that left a gap without
        a name.

    """
    if not rounds:
        return Decision(experiment=wide, why=FIRST)
    last = rounds[-1]
    if last.verdict == 'refused':
        return Decision(REFUSED)
    if last.verdict in ANSWERS:
        return Decision(ANSWERED)
    following = last.gap['next_experiment']
    if following:
        return Decision(experiment=load_experiment(dump_yaml(following['experiment'])),
                        why=following['why'])
    if wide.name not in [name for one in rounds for name in one.experiments]:
        return Decision(experiment=wide, why=WIDE)
    return Decision({'ambiguous': NOT_SEPARABLE, 'partial': PARTLY_NAMED}.get(
        last.verdict, NOT_NAMED))
