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

"""Real-time scheduling of a node, where the system allows it, and the sentence on it."""

import os
from typing import Any

LIMIT = 'a line such as `USER - rtprio 99` in /etc/security/limits.conf allows it'


def ask_for_realtime(priority: int) -> str:
    """
    Let all threads of this process be scheduled first, round robin (Linux).

    Parameters
    ----------
    priority : int
        1 to 99; 0 changes nothing.

    Returns
    -------
    str
        Why it was not granted, '' if it was.

    """
    if priority == 0:
        return ''
    try:
        parameter = os.sched_param(priority)
        for thread in os.listdir('/proc/self/task'):
            os.sched_setscheduler(int(thread), os.SCHED_RR, parameter)
    except (AttributeError, OSError) as error:
        return getattr(error, 'strerror', None) or str(error)
    return ''


def refused_realtime(priority: int) -> str:
    """
    Return why this process would not get a real-time priority, '' if it would.

    The calling thread has it for a moment; nothing else changes.
    """
    try:
        before = os.sched_getscheduler(0), os.sched_getparam(0)
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(priority))
        os.sched_setscheduler(0, *before)
    except (AttributeError, OSError) as error:
        return getattr(error, 'strerror', None) or str(error)
    return ''


def realtime_sentence(asked: int, rank: int) -> tuple[bool, str]:
    """
    Ask for real-time priority; return whether that is as it should be, and a sentence on it.

    Parameters
    ----------
    asked : int
        Parameter ``realtime_priority``, 0 for none.
    rank : int
        What a node adds to it; 0: it may be late, and there is no sentence without asking.

    """
    if asked:
        refused = ask_for_realtime(asked + rank)
        if refused:
            return False, (f'no real-time priority ({refused}), so that a busy machine makes '
                           f'ticks late; {LIMIT}')
        return True, f'real-time priority {asked + rank}'
    if not rank:
        return True, ''
    refused = refused_realtime(1 + rank)
    how = f'not permitted here ({refused}); {LIMIT}' if refused else 'possible here'
    return True, ('default priority, so that a busy machine makes ticks late; '
                  f'realtime_priority:=1 is {how}')


def run_in_realtime(asked: int, rank: int, logger: Any) -> None:
    """Do as ``realtime_sentence`` and say the sentence, of a refusal as a warning."""
    granted, sentence = realtime_sentence(asked, rank)
    if not granted:
        logger.warning(sentence)
    elif sentence:
        logger.info(sentence)
