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

"""What gives way to live nodes does so in every session that it begins."""

from pathlib import Path
import subprocess
import sys

from pam_actuation.priority import give_way, keep_niceness, NICENESS
import pytest

SHARE = Path('/proc/self/autogroup')
SHOWN = 'import os, pathlib; print(os.nice(0), pathlib.Path("/proc/self/autogroup").read_text())'
# A process of low priority that starts another one in a session of its own.
STARTS = """
import os, subprocess, sys
from pam_actuation.rigging.processes import begin_session
subprocess.run([sys.executable, '-c', sys.argv[1]], start_new_session=True,
               preexec_fn=lambda: begin_session(os.getppid()))
"""


def said(*words, **options):
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=True,
                          **options)
    return done.stdout.split()


@pytest.mark.skipif(not SHARE.exists(), reason='this system does not share cores by session')
def test_a_node_has_the_low_priority_of_the_process_that_started_it():
    niceness, _, word, of_session = said('-c', STARTS, SHOWN, preexec_fn=give_way)
    assert int(niceness) >= NICENESS and [word, of_session] == ['nice', niceness]


@pytest.mark.skipif(not SHARE.exists(), reason='this system does not share cores by session')
def test_a_session_is_as_nice_as_its_first_process():
    niceness, _, _, of_session = said(
        '-c', SHOWN, start_new_session=True, preexec_fn=keep_niceness)
    assert of_session == niceness
