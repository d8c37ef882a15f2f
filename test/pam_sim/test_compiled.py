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

"""Machine code stored on disk is made anew when any of its sources changes."""

import importlib
import inspect
from pathlib import Path
import pkgutil
import subprocess
import sys

from numba.core.caching import NullCache
import pam_actuation
import pam_sim
from pam_sim.compiled import compiled, source_key, sources
import pytest

FLOW = """
from pam_sim.compiled import compiled

@compiled
def flow(x):
    return {factor} * x
"""
DRIVER = """
from numba import njit
from pam_sim.compiled import compiled, source_key
from stored_flow import flow
import pam_stored.flow as law

LIMIT = 5.0

@compiled
def _step_by_name(x):
    return min(flow(x), LIMIT)

@compiled
def _step_of_module(x):
    return min(law.flow(x), LIMIT)

def _entries(key, other_key):
    @njit(cache=True)
    def by_name(x):
        return _step_by_name(x) if key >= 0 else 0.0

    @njit(cache=True)
    def of_module(x):
        return _step_of_module(x) if other_key >= 0 else 0.0

    return by_name, of_module

by_name, of_module = _entries(source_key(_step_by_name), source_key(_step_of_module))
"""


def stepped(folder):
    """Return what the two entries of the driver make of 1.0 in a process of its own."""
    done = subprocess.run(
        [sys.executable, '-c', 'import stored_driver as driver; '
         'print(driver.by_name(1.0), driver.of_module(1.0))'],
        cwd=folder, capture_output=True, text=True, check=True)
    return [float(word) for word in done.stdout.split()]


def test_a_changed_source_of_a_stored_function_is_noticed(tmp_path, monkeypatch):
    """Whether the driver calls it by its own name or by that of its module."""
    monkeypatch.setenv('PYTHONPATH', str(Path(pam_sim.__file__).parents[1]))
    # Python knows the age of a source to the second, and here one changes twice within it.
    monkeypatch.setenv('PYTHONDONTWRITEBYTECODE', '1')
    (tmp_path / 'pam_stored').mkdir()
    (tmp_path / 'pam_stored' / '__init__.py').touch()
    (tmp_path / 'stored_driver.py').write_text(DRIVER)
    for factor in (2.0, 3.0):
        for flow in ('stored_flow.py', 'pam_stored/flow.py'):
            (tmp_path / flow).write_text(FLOW.format(factor=factor))
        assert stepped(tmp_path) == [factor, factor]
    assert list(tmp_path.glob('__pycache__/stored_driver*.nbi'))     # stored it was


def every_module():
    """Import every module of both packages; return them."""
    found = []
    for package in (pam_sim, pam_actuation):
        for info in pkgutil.walk_packages(package.__path__, f'{package.__name__}.'):
            found.append(pytest.importorskip(info.name) if '.nodes' in info.name
                         else importlib.import_module(info.name))
    return found


def test_every_stored_function_knows_its_sources():
    stored = 0
    for module in every_module():
        for name, function in vars(module).items():
            if isinstance(function, type) or not hasattr(function, 'py_func') \
                    or function.py_func.__module__ != module.__name__ \
                    or isinstance(function.dispatcher._cache, NullCache):
                continue
            stored += 1
            files, _ = sources(function)
            keyed = inspect.getclosurevars(function.py_func).nonlocals
            if len(files) > 1:
                assert 'key' in keyed, f'{module.__name__}.{name} is stored without a key'
            # A compiled function in a closure differs from process to process: never found again.
            assert all(isinstance(value, int) for value in keyed.values()), (
                f'{module.__name__}.{name} closes over more than its key')
    assert stored > 5


def test_the_key_tells_of_files_and_constants():
    from pam_actuation.drivers.hsv_kernel import hsv_step
    files, constants = sources(hsv_step)
    assert {'hsv_kernel.py', 'flow.py'} <= {file.name for file in files}
    assert 'GAS_CONSTANT_AIR = 287.0' in ''.join(constants)
    assert source_key(hsv_step) == source_key(hsv_step)


def test_the_steps_of_rig_and_joint_follow_effects_laws_and_records():
    from pam_sim.joint.kernel import joint_step
    from pam_sim.rollout.kernel import step
    for entry in (step, joint_step):
        files, constants = sources(entry)
        names = {file.name for file in files}
        assert {'creep.py', 'lag.py', 'sarosi.py', 'step.py', 'records.py'} <= names
        assert any(name.startswith('pam_hooks_') for name in names)
        assert {'STATE', 'PARAMETERS', 'PACKED'} <= {one.split(' = ')[0] for one in constants}


def test_an_inner_function_is_called_from_python_as_well():
    @compiled
    def _half(number, of=1.0):
        return 0.5 * number * of

    @compiled
    def _quarter(number):
        return 0.5 * _half(number)

    assert (_quarter(8.0), _half(8.0), _half(of=2.0, number=8.0)) == (2.0, 4.0, 8.0)
    with pytest.raises(TypeError, match="missing a required argument: 'number'"):
        _half()
