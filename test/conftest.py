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

"""What every test needs: a ROS graph of its own that never leaves this machine."""

import contextlib
import fcntl
import gc
import importlib.util
import os
from pathlib import Path
import tempfile
import time

import pytest
from stall_watch import EXIT_CROWDED, NAMES_A_LIVE_TEST, STALL_S, StallWatch, TIMED

# Set before anything imports rclpy; children inherit it. Ids above 101 collide
# with the ports that Linux hands out. Values given from outside are respected.
os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

HAS_ROS = importlib.util.find_spec('rclpy') is not None


def pytest_collection_modifyitems(items):
    """
    Put the long files first; skip the tests marked ``ros`` where ROS 2 is not installed.

    The cores are handed files in this order: a long one that comes last keeps one core busy
    while the others have nothing to do.
    """
    long = {item.path for item in items if item.get_closest_marker('slow')}
    items.sort(key=lambda item: item.path not in long)
    live = {item.path for item in items
            if item.get_closest_marker('ros') or item.get_closest_marker('timed')}
    unnamed = [str(path) for path in sorted(live)
               if not NAMES_A_LIVE_TEST.search(path.read_text(encoding='utf-8'))]
    if unnamed:
        raise pytest.UsageError(f'run_all.py looks for `mark.ros` or `mark.timed` in the text '
                                f'of a file with live tests: {", ".join(unnamed)}')
    if HAS_ROS:
        return
    for item in items:
        if item.get_closest_marker('ros'):
            item.add_marker(pytest.mark.skip(reason='rclpy is not installed'))


@contextlib.contextmanager
def first_alone():
    """Let one process do something before all others: it leaves the byte code of its imports."""
    with open(__file__) as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            fcntl.flock(file, fcntl.LOCK_SH)
            fcntl.flock(file, fcntl.LOCK_UN)        # nobody waits for those who waited
        yield


@pytest.hookimpl(hookwrapper=True)
def pytest_collection(session):
    """
    Collect without a look for garbage: it takes a third of the time, and all of this stays.

    The tests then look for it more rarely: imports and compiled code stay as well.
    """
    gc.disable()
    is_worker = hasattr(session.config, 'workerinput')
    with first_alone() if is_worker else contextlib.nullcontext():
        yield
    gc.freeze()
    gc.set_threshold(20_000, 20, 50)
    gc.enable()


class StallPlugin:
    """Tell of failures on a machine that stood still; only live tests are run then."""

    def __init__(self):
        self._folder = tempfile.TemporaryDirectory()
        self._watch = StallWatch(Path(self._folder.name) / 'stalls.txt')
        self._begin_s = {}
        self.failed = []

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_setup(self, item):
        # What a whole module shares may have been spoiled by an earlier moment of the module.
        self._begin_s.setdefault(item.path, time.monotonic())

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_makereport(self, item, call):
        report = (yield).get_result()
        if not report.failed:
            return
        worst_s = self._watch.worst_s(self._begin_s[item.path])
        if worst_s > STALL_S:
            text = f'the machine stood still for up to {worst_s * 1e3:.0f} ms'
            report.sections.append(('stalls', text + ' since this file began'))
            self.failed.append(f'{item.nodeid}: {text}')

    def pytest_terminal_summary(self, terminalreporter):
        if self.failed:
            terminalreporter.section('failed on a machine that stood still')
            for line in self.failed:
                terminalreporter.line(line)

    def pytest_sessionfinish(self):
        self._watch.end()
        self._folder.cleanup()


class CrowdPlugin:
    """Tell a run in which only live tests failed that share the machine with the others."""

    def __init__(self):
        self.others = 0

    def pytest_runtest_logreport(self, report):
        self.others += report.failed and 'shared' not in report.keywords

    def pytest_collectreport(self, report):
        self.others += report.failed

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session, exitstatus):
        if exitstatus == pytest.ExitCode.TESTS_FAILED and not self.others:
            session.exitstatus = EXIT_CROWDED


def pytest_configure(config):
    """Watch the machine where live tests run one after the other, or beside all others."""
    if not HAS_ROS or hasattr(config, 'workerinput'):
        return
    if config.getoption('markexpr') in ('ros', TIMED):
        config.pluginmanager.register(StallPlugin())
    elif config.getoption('markexpr') == f'not ({TIMED})':
        config.pluginmanager.register(CrowdPlugin())


def pytest_unconfigure():
    """Let the interpreter end without a look for garbage in all that was imported and tested."""
    gc.freeze()
