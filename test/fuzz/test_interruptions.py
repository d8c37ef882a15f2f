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

from interruptions import case, run
import pytest


def test_verbs_end_with_one_line_whenever_they_are_interrupted():
    outcomes, bad = run(32, longest_s=1.0)
    assert bad == []
    assert outcomes['interrupted'] > 20


@pytest.mark.ros
@pytest.mark.shared
def test_nodes_and_those_who_start_them_end_in_order_whenever_they_are_interrupted():
    outcomes, bad = run(14, longest_s=1.3, live=True)
    assert bad == []
    assert outcomes['interrupted'] > 8


@pytest.mark.slow
def test_many_verbs_at_work():
    outcomes, bad = run(72, longest_s=5.0, start=1000)
    assert bad == []
    assert outcomes['interrupted'] > 50


@pytest.mark.slow
@pytest.mark.ros
@pytest.mark.shared
def test_many_nodes_at_work():
    outcomes, bad = run(40, longest_s=10.0, live=True, jobs=3, start=1000)
    assert bad == []
    assert outcomes['interrupted'] > 25


def test_the_same_number_is_the_same_interruption():
    assert [case(k, 1.0, True) for k in range(9)] == [case(k, 1.0, True) for k in range(9)]
