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

"""Data that are searched twice prove nothing: tell whether recordings are one."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from pam_sim.errors import InputError
from pam_sim.gap.criteria import CRITERIA, Criteria
from pam_sim.gap.data.signals import FIELD
from pam_sim.run import Run

PROOF = 'the proof needs another run, or leave --certify out to split this one'
ONCE = 'what one of them keeps for choice and proof, the other fits; give it once'


def check_apart(runs: Sequence[Run], certify: Run | None, criteria: Criteria = CRITERIA) -> None:
    """
    Raise InputError if two of the recordings, searched or for the validation, are the same one.

    Whatever the files are called: the messages are compared, by stamp and value. A subsystem or
    filtered copy is the same recording too.

    Parameters
    ----------
    runs : sequence of pam_sim.run.Run
        Those that are searched.
    certify : pam_sim.run.Run or None
        The one for the validation.
    criteria : Criteria
        Decision thresholds.

    """
    pairs = [(*pair, ONCE, pair[1].path or 'recording') for pair in combinations(runs, 2)]
    if certify is not None:
        pairs += [(run, certify, PROOF, f'--certify {certify.path}'.strip()) for run in runs]
    for run, other, needs, where in pairs:
        share = shared_part(run, other)
        if share > criteria.greater_part:
            raise InputError(
                f'is the same recording as {run.path or "one that is searched"} '
                f'({100 * share:.0f} % of its messages have the same stamp and value); {needs}',
                where)


def shared_part(run: Run, other: Run) -> float:
    """Return the least share, over the signals of both, of messages that are in both."""
    shares = []
    for topic, field in FIELD.items():
        if topic in run and topic in other:
            one, two = run.topics[topic], other.topics[topic]
            if field not in one.values or field not in two.values:
                continue
            _, i, k = np.intersect1d(one.stamp_ns, two.stamp_ns, return_indices=True)
            same = np.count_nonzero(one.values[field][i] == two.values[field][k])
            shares.append(same / min(len(one.stamp_ns), len(two.stamp_ns)))
    return min(shares, default=0.0)
