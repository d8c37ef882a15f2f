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

"""Test that what a node tells on its terminal cannot hold it up."""

import os
import subprocess
import sys

LINES = 3000                # of 100 characters: more than a pipe holds
SPEAKER = f"""
import time
from pam_actuation.nodes.console import Console

console = Console('/left/valve_driver')
for number in range({LINES}):
    console.say('WARN', 12_000_000_034, f'{{number}} ' + 'x' * 100)
    time.sleep(1e-4)
print('went on', flush=True)
"""


def test_a_terminal_that_is_held_holds_nobody():
    reading, writing = os.pipe()
    process = subprocess.Popen(
        [sys.executable, '-c', SPEAKER], stdout=subprocess.PIPE, stderr=writing, text=True)
    os.close(writing)
    try:
        # Nobody reads yet what it says; the logger of rclpy would wait here for ever.
        assert process.stdout.readline() == 'went on\n'
        with os.fdopen(reading, encoding='utf-8') as terminal:
            first = terminal.readline()
        assert process.wait(20.0) == 0
    finally:
        process.kill()
        process.stdout.close()
    assert first == f'[WARN] [12.000000034] [left.valve_driver]: 0 {"x" * 100}\n'


def test_last_words_are_written_before_the_end():
    said = subprocess.run(
        [sys.executable, '-c', 'from pam_actuation.nodes.console import Console\n'
         'console = Console("/driver")\nconsole.say("ERROR", 5, "vented")'],
        capture_output=True, text=True, check=True).stderr
    assert said == '[ERROR] [0.000000005] [driver]: vented\n'
