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

"""Who waits for the compiler is told so, and only then."""

import subprocess
import sys

import pytest

# Two functions, the inner one compiled while the outer one is.
PROGRAM = """
import sys
from pam_sim import compile_notice
compile_notice.tell_when_compiling(lambda: print('compiling'), float(sys.argv[1]))
from pam_sim.compiled import compiled
@compiled
def inner(x):
    return x + 1.0
@compiled
def outer(x):
    return 2.0 * inner(x)
print(outer(1.0), outer(2.0))
assert not compile_notice._asked
"""


@pytest.mark.parametrize('after_s, said', [(0, 'compiling\n'), (100, '')])
def test_it_is_told_once_and_after_a_while(after_s, said):
    done = subprocess.run([sys.executable, '-c', PROGRAM, str(after_s)], capture_output=True,
                          text=True, check=True)
    assert done.stdout == f'{said}4.0 6.0\n' and done.stderr == ''


def test_a_program_that_compiles_nothing_hears_nothing(tmp_path):
    done = subprocess.run(
        [sys.executable, '-m', 'pam_actuation.cli.main', 'models', 'leakage'],
        capture_output=True, text=True, check=True)
    assert 'ISO 6358' in done.stdout and done.stderr == ''
