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

"""A proof on data that were searched proves nothing: tell whether recordings are one."""

from collections.abc import Iterable

import numpy as np
from pam_sim.errors import InputError
from pam_sim.gap.criteria import CRITERIA, Criteria
from pam_sim.gap.data.signals import FIELD
from pam_sim.run import Run


def check_apart(runs: Iterable[Run], certify: Run, criteria: Criteria = CRITERIA) -> None:
    """
    Raise InputError if the recording for the validation is one of those that are searched.

    Whatever the files are called: the messages are compared, by stamp and value. A subsystem or
    filtered copy is the same recording too.

    Parameters
    ----------
    runs : list of pam_sim.run.Run
        Those that are searched.
    certify : pam_sim.run.Run
        The one for the validation.
    criteria : Criteria
        Decision thresholds.

    """
    for run in runs:
        share = shared_part(run, certify)
        if share > criteria.greater_part:
            raise InputError(
                f'is the same recording as {run.path or "one that is searched"} '
                f'({100 * share:.0f} % of its messages have the same stamp and value); the proof '
                'needs another run, or leave --certify out to split this one',
                f'--certify {certify.path}'.strip())


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
