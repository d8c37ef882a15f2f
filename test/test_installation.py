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

"""The package built and started as a user would: colcon in its layouts, pip wheel, no ROS."""

import importlib
import os
from pathlib import Path
import pkgutil
import shutil
import signal
import subprocess
import sys
import time
import zipfile

import pam_actuation
import pam_sim
import pytest

ROOT = Path(__file__).resolve().parent.parent
NODES = (
    'valve_driver', 'plant_simulator', 'sofc_controller', 'pid_controller',
    'reference_generator', 'experiment_recorder')
# They need devices, a joint instead of a muscle, or a driver; their own tests start them.
FOR_OTHER_RIGS = ('hardware_sensors', 'joint_simulator', 'joint_controller',
                  'joint_trajectory_server', 'valve_watchdog')
PASSIVE = 'configured, not active'
SOURCES = (
    'package.xml', 'setup.py', 'setup.cfg', 'pyproject.toml', 'README.md', 'LICENSE', 'resource',
    'pam_actuation', 'pam_sim', 'config', 'launch', 'msg_docs', 'docs/reference/nodes',
    'docs/reference/files')

# Raises on any import of ROS, as on a machine without it.
# Within a second, at the first use.
SOON_COMPILED = {'walk_many_messages', 'sample_into', 'residual_sum'}

NO_ROS = """
import sys
class NoRos:
    def find_spec(self, name, path=None, target=None):
        top = name.partition('.')[0]
        if top in ('rclpy', 'launch', 'launch_ros', 'ament_index_python') or top.endswith('_msgs'):
            raise ModuleNotFoundError(f'blocked: {name}')
sys.meta_path.insert(0, NoRos())
"""


def copy_sources(target):
    """Copy what a clone would hold, without caches and builds."""
    target.mkdir(parents=True)
    for name in SOURCES:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, target / name,
                            ignore=shutil.ignore_patterns('__pycache__', '*.egg-info'))
        elif source.exists():
            shutil.copy2(source, target / name)
    return target


def copy_compiled(target):
    """Hand on byte code and machine code: both are taken for files of the same age and size."""
    for name in ('pam_actuation', 'pam_sim'):
        for source in (ROOT / name).rglob('*.py'):
            shutil.copystat(source, target / source.relative_to(ROOT))
        for stored in (ROOT / name).rglob('__pycache__/*'):
            copy = target / stored.relative_to(ROOT)
            copy.parent.mkdir(exist_ok=True)
            shutil.copy2(stored, copy)


def run(command, **keywords):
    """Run a command; fail the test with its output if it fails."""
    done = subprocess.run(command, capture_output=True, text=True, **keywords)
    assert done.returncode == 0, f'{command}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}'
    return done.stdout


def colcon_build(workspace, *options):
    """Build the copied sources in a workspace with this Python's colcon."""
    copy_sources(workspace / 'src' / 'pam_actuation')
    # Byte code is written by whoever imports a file: most of them are not run from here.
    run([sys.executable, '-m', 'colcon', 'build', *options], cwd=workspace,
        env={**os.environ, 'PYTHONDONTWRITEBYTECODE': '1'})
    return workspace / 'install'


def environment_of(setup_script, **more):
    """Return the variables that sourcing a colcon setup script gives."""
    lines = run(['bash', '-c', f'. "{setup_script}" >/dev/null && env -0'],
                env={**os.environ, **more}).split('\0')
    return dict(line.split('=', 1) for line in lines if '=' in line)


@pytest.fixture(scope='module')
def isolated_install(tmp_path_factory):
    """Return the install folder of a plain ``colcon build``."""
    return colcon_build(tmp_path_factory.mktemp('isolated'))


@pytest.mark.slow
def test_colcon_puts_executables_where_ros2_run_looks(isolated_install):
    prefix = isolated_install / 'pam_actuation'
    names = {path.name for path in (prefix / 'lib' / 'pam_actuation').iterdir()}
    assert names == {*NODES, *FOR_OTHER_RIGS, 'pam'}
    assert (prefix / 'share/ament_index/resource_index/packages/pam_actuation').is_file()
    # Marks a package that colcon took for a ROS package, not for plain Python.
    assert (prefix / 'share/pam_actuation/hook/ament_prefix_path.sh').is_file()


@pytest.mark.slow
def test_installed_executables_answer_at_once(isolated_install, tmp_path):
    folder = isolated_install / 'pam_actuation' / 'lib' / 'pam_actuation'
    environment = environment_of(isolated_install / 'setup.bash')
    for name in (*NODES, *FOR_OTHER_RIGS):
        shown = run([folder / name, '--help'], cwd=tmp_path, env=environment, timeout=20)
        assert shown.startswith(f'usage: {name} ') and 'Parameters of every node:' in shown


@pytest.mark.slow
@pytest.mark.parametrize('option', ['--merge-install', '--symlink-install'])
def test_other_layouts_of_colcon_find_their_files(tmp_path, option):
    install = colcon_build(tmp_path / 'ws', option)
    prefix = install if option == '--merge-install' else install / 'pam_actuation'
    executable = prefix / 'lib' / 'pam_actuation' / 'pam'
    assert executable.is_file()
    code = 'from pam_actuation import resources; print(resources.find_config(' \
        '"experiments", "sine_quarter_hz")); print(resources.__file__)'
    config, module = run(
        [sys.executable, '-c', code], cwd=tmp_path,
        env=environment_of(install / 'setup.bash')).splitlines()
    assert Path(config).is_file()
    assert Path(config).resolve().is_relative_to(tmp_path.resolve())
    assert Path(module).resolve().is_relative_to(tmp_path.resolve())


@pytest.mark.slow
@pytest.mark.ros
@pytest.mark.shared
def test_every_executable_starts_and_ends_from_the_colcon_install(isolated_install, tmp_path):
    folder = isolated_install / 'pam_actuation' / 'lib' / 'pam_actuation'
    environment = environment_of(isolated_install / 'setup.bash', ROS_LOG_DIR=str(tmp_path))
    packages, = isolated_install.glob('pam_actuation/lib/python3*/site-packages')
    copy_compiled(packages)
    started = {}
    try:
        for name in NODES:
            started[name] = subprocess.Popen(
                [folder / name, '--ros-args', '-r', '__ns:=/muscle'], cwd=tmp_path,
                env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        wait_until_active({f'/muscle/{name}' for name in NODES}, started)
    finally:
        for process in started.values():
            process.send_signal(signal.SIGINT)
        output = {name: end(process) for name, process in started.items()}
    for name, process in started.items():
        assert process.returncode == 0, f'{name}: {output[name][-2000:]}'


def end(process):
    """Wait for a process, kill it if it does not end; return what it printed."""
    try:
        return process.communicate(timeout=20)[0]
    except subprocess.TimeoutExpired:
        process.kill()
        return process.communicate()[0]


def wait_until_active(wanted, started, timeout_s=180.0):
    """Wait until every node has said on /diagnostics that it works; fail if one ends before."""
    from diagnostic_msgs.msg import DiagnosticArray
    import rclpy
    said = {}
    context = rclpy.Context()
    rclpy.init(context=context)
    watcher = rclpy.create_node('installation_test', context=context)
    executor = rclpy.executors.SingleThreadedExecutor(context=context)
    executor.add_node(watcher)
    watcher.create_subscription(
        DiagnosticArray, '/diagnostics',
        lambda array: said.update((status.name, status.message) for status in array.status), 100)
    deadline = time.monotonic() + timeout_s
    try:
        while {name for name in wanted if said.get(name, PASSIVE) != PASSIVE} != wanted:
            for name, process in started.items():
                assert process.poll() is None, f'{name}: {process.stdout.read()[-2000:]}'
            assert time.monotonic() < deadline, f'not all active within {timeout_s} s: {said}'
            executor.spin_once(timeout_sec=0.2)
    finally:
        executor.shutdown()
        watcher.destroy_node()
        rclpy.shutdown(context=context)


@pytest.mark.slow
def test_a_wheel_holds_packages_shared_files_and_executables(tmp_path):
    sources = copy_sources(tmp_path / 'src')
    run([sys.executable, '-m', 'pip', 'wheel', '--quiet', '--no-deps', '--no-build-isolation',
         '--disable-pip-version-check', '--wheel-dir', str(tmp_path), str(sources)])
    [wheel] = tmp_path.glob('pam_actuation-*.whl')
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        [scripts] = [
            archive.read(n).decode() for n in names if n.endswith('entry_points.txt')]
    for name in (*NODES, 'pam'):
        assert f'\n{name} = pam_actuation.' in scripts
    data = f'{wheel.name.rsplit("-", 3)[0]}.data/data/share/pam_actuation'
    for name in ('package.xml', 'config/experiments/sine_quarter_hz.yaml',
                 'config/controllers/sofc_ppr.yaml', 'launch/rig.launch.py', 'msg_docs/README.md',
                 'docs/reference/nodes/valve_driver.md'):
        assert f'{data}/{name}' in names
    for preset in (ROOT / 'pam_sim' / 'presets').glob('*.yaml'):
        assert f'pam_sim/presets/{preset.name}' in names
    assert not [n for n in names if n.startswith(('test/', 'benchmarks/'))]


def test_offline_verbs_need_no_ros(tmp_path):
    verbs = 'simulate', 'replay', 'tune', 'gap', 'report', 'info'
    code = NO_ROS + f'from pam_actuation.cli.main import main\nfor verb in {verbs}:\n' \
        '    main([verb, "--help"])'
    shown = run(
        [sys.executable, '-c', code], cwd=tmp_path, env={**os.environ, 'PYTHONPATH': str(ROOT)})
    assert all(f'usage: pam {verb} ' in shown for verb in verbs)


def test_live_verbs_without_ros_say_what_to_install(tmp_path):
    code = NO_ROS + 'import sys; from pam_actuation.cli.main import main; ' \
        'sys.exit(main(["run", "sine_quarter_hz", "--out", "never"]))'
    done = subprocess.run(
        [sys.executable, '-c', code], cwd=tmp_path, capture_output=True, text=True,
        env={**os.environ, 'PYTHONPATH': str(ROOT)})
    assert done.returncode == 2, done.stderr
    assert '[ros]' in done.stderr and 'Traceback' not in done.stderr
    assert not (tmp_path / 'never').exists()


def stored_functions():
    """Return {name: file that lists its machine code} of all that is stored on disk."""
    found = {}
    for package in (pam_actuation, pam_sim):
        for info in pkgutil.walk_packages(package.__path__, f'{package.__name__}.'):
            if '.nodes' in info.name:
                continue
            for name, value in vars(importlib.import_module(info.name)).items():
                cache = getattr(getattr(value, 'dispatcher', None), '_cache', None)
                file = getattr(cache, '_cache_file', None)
                if file is not None and value.py_func.__module__ == info.name:
                    found[name] = Path(file._index_path)
    return found


@pytest.mark.slow
def test_everything_can_be_compiled_ahead():
    from pam_actuation.warm_up import warm_up
    warm_up(jobs=1)
    stored = stored_functions()
    assert {'step', 'rollout', 'joint_step', 'lqi_rollout'} < set(stored)
    assert {name for name, index in stored.items() if not index.is_file()} <= SOON_COMPILED
