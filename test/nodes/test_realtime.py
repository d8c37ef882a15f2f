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
"""Whether a node gets real-time priority is said at the start, in one sentence."""

import os

from pam_actuation.nodes import realtime
import pytest


class Log:
    """Keeps what is said."""

    def __init__(self):
        self.lines = []

    def info(self, text):
        self.lines.append(('info', text))

    def warning(self, text):
        self.lines.append(('warning', text))


@pytest.fixture
def scheduled(monkeypatch):
    """Return what was asked of the system, which grants it."""
    asked = []
    monkeypatch.setattr(os, 'sched_setscheduler',
                        lambda thread, policy, parameter: asked.append(
                            (thread, policy, parameter.sched_priority)))
    return asked


@pytest.fixture
def refused(monkeypatch):
    def refuse(thread, policy, parameter):
        raise PermissionError(1, 'Operation not permitted')
    monkeypatch.setattr(os, 'sched_setscheduler', refuse)


def said(asked, rank):
    log = Log()
    realtime.run_in_realtime(asked, rank, log)
    return log.lines


def test_what_was_granted_is_told_with_its_number(scheduled):
    assert said(1, 3) == [('info', 'real-time priority 4')]
    assert {(policy, priority) for _, policy, priority in scheduled} == {(os.SCHED_RR, 4)}


def test_what_was_refused_is_a_warning_that_says_what_to_do(refused):
    ((level, sentence),) = said(1, 3)
    assert level == 'warning' and sentence.startswith(
        'no real-time priority (Operation not permitted)')
    assert '/etc/security/limits.conf' in sentence


def test_without_asking_a_node_with_a_rank_says_whether_it_is_possible(scheduled):
    ((level, sentence),) = said(0, 1)
    assert level == 'info' and sentence.endswith('realtime_priority:=1 is possible here')
    assert len(scheduled) == 2 and scheduled[-1][2] == os.sched_getparam(0).sched_priority
    assert scheduled[-1][1] == os.sched_getscheduler(0)


def test_without_asking_where_it_is_not_permitted(refused):
    ((level, sentence),) = said(0, 1)
    assert level == 'info' and 'is not permitted here (Operation not permitted)' in sentence


def test_a_node_that_may_be_late_says_nothing(scheduled):
    assert said(0, 0) == [] and scheduled == []


def test_the_question_changes_nothing_for_good():
    before = os.sched_getscheduler(0), os.sched_getparam(0).sched_priority
    realtime.refused_realtime(2)
    assert (os.sched_getscheduler(0), os.sched_getparam(0).sched_priority) == before
