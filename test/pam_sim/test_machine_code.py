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

"""What is linked only is not translated, and stored code loads without what compiles."""

import os
from pathlib import Path
import pickle
import subprocess
import sys

import numba
from numba.core.caching import FunctionCache
import numpy as np
import pam_sim
from pam_sim import machine_code
from pam_sim.compiled import allocating_entry_point, compiled
from pam_sim.machine_code import LinkedLibrary, StoredCode, tried
import pytest

STORED = """
import sys
import numpy as np
from pam_sim.compiled import allocating_entry_point, compiled

@compiled
def checked(number):
    if number < 0.0:
        raise ValueError('below zero')
    return np.sqrt(number)

@allocating_entry_point
def summed(row, number):
    return np.dot(row, row) + checked(number) + 0.0 * np.random.random()

if __name__ == '__main__':
    print('scipy.linalg' in sys.modules)
    for number in (4.0, -1.0):
        try:
            print(summed(np.ones(2), number))
        except ValueError as error:
            print(error)
    print('numba.cpython.cmathimpl' in sys.modules,
          sum(summed.dispatcher.stats.cache_hits.values()))
"""
USED = """
import sys
from pam_actuation.experiments import offline
from pam_sim import load_rig
rig = load_rig('dmsp_5_300_hanging_mass')
print('numba' in sys.modules)
rig.simulate([0.0, 0.0])
print('numba' in sys.modules)
"""


@pytest.mark.skipif(not tried(numba.__version__), reason='an untried numba')
def test_stored_code_runs_without_the_part_of_numba_that_compiles(tmp_path):
    """With linear algebra, random numbers, arrays and exceptions, all from libraries in C."""
    (tmp_path / 'stored.py').write_text(STORED, encoding='utf-8')
    environment = {**os.environ, 'PYTHONPATH': str(Path(pam_sim.__file__).parents[1])}
    said = [subprocess.run(
        [sys.executable, 'stored.py'], cwd=tmp_path, capture_output=True, text=True, check=True,
        env=environment).stdout.splitlines() for _ in range(2)]
    assert said[0] == ['False', '4.0', 'below zero', 'True 0']
    assert said[1] == ['False', '4.0', 'below zero', 'False 1']


def test_an_inner_function_is_in_no_machine_code_of_its_own():
    @compiled
    def _twice(number):
        return 2.0 * number

    @allocating_entry_point
    def _filled(number):
        return np.full(3, _twice(number))

    assert _filled(1.5).tolist() == [3.0, 3.0, 3.0]
    inner, = _twice.dispatcher.overloads.values()
    assert type(inner.library) is LinkedLibrary
    assert inner.library.get_pointer_to_function(inner.fndesc.mangled_name) == 0
    outer, = _filled.dispatcher.overloads.values()
    assert outer.library.get_pointer_to_function(outer.fndesc.mangled_name) > 0
    assert type(_filled.dispatcher._cache) is StoredCode


def test_numba_is_imported_with_the_first_use():
    done = subprocess.run(
        [sys.executable, '-c', USED], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ['False', 'True']


def test_a_compiled_function_goes_to_another_process_by_its_name():
    from pam_sim.gap.propose.response import follow
    assert pickle.loads(pickle.dumps(follow)) is follow


def test_a_version_that_nobody_tried_is_left_to_itself(monkeypatch):
    known = [version for version in ('0.57.1', '0.58.1', '0.68.1', '0.69.0rc1', '1.0', '?')
             if tried(version)]
    assert known == ['0.58.1', '0.68.1']
    monkeypatch.setattr(machine_code.numba, '__version__', '1.0')

    @machine_code.stored
    @numba.njit
    def _same(number):
        return number

    assert type(_same._cache) is FunctionCache
    assert _same(2.0) == 2.0
