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
"""A sample of interruptions: one line and exit code 130, and nothing that stays behind."""

from interruptions import cases, run
import pytest

# More of them: python test/fuzz/interruptions.py --help
VERB_ROUNDS, NODE_ROUNDS = 4, 2


def test_verbs_end_with_one_line_whenever_they_are_interrupted():
    outcomes, bad = run(range(2), VERB_ROUNDS)
    assert bad == []
    assert outcomes['interrupted'] > 13


@pytest.mark.slow
def test_verbs_at_work_end_with_one_line_as_well():
    outcomes, bad = run(range(2, VERB_ROUNDS), VERB_ROUNDS)
    assert bad == []
    assert outcomes['interrupted'] > 10


@pytest.mark.ros
@pytest.mark.shared
def test_nodes_and_those_who_start_them_end_in_order_whenever_they_are_interrupted():
    outcomes, bad = run(range(1), NODE_ROUNDS, live=True)
    assert bad == []
    assert outcomes['interrupted'] > 10


@pytest.mark.slow
@pytest.mark.ros
@pytest.mark.shared
def test_nodes_at_work_and_those_who_started_them_end_in_order_as_well():
    outcomes, bad = run(range(1, NODE_ROUNDS), NODE_ROUNDS, live=True, jobs=3)
    assert bad == []
    assert outcomes['interrupted'] > 10


def test_the_same_seed_gives_the_same_interruptions_and_all_of_them_differ():
    one = [case for k in range(3) for case in cases(k, 3, True)]
    assert one == [case for k in range(3) for case in cases(k, 3, True)] and len(set(one)) == 48
    assert [case.words for case in cases(0, 3, True, 1)] == [case.words for case in one[:16]]
    assert {case.waits_s[0] for case in cases(0, 3, True, 1)}.isdisjoint(
        case.waits_s[0] for case in one if case.waits_s[0] > 0.05)
