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

"""A rig outlives whoever reads what ``pam up`` and ``pam run`` print."""

import contextlib
import errno
import os
import sys

from pam_actuation.cli.lasting import lasting_output
from pam_actuation.cli.main import main
from pam_actuation.rigging import session
import pytest


@contextlib.contextmanager
def nobody():
    """Let nobody read what is printed, unbuffered as in containers."""
    before = sys.stdout, sys.stderr
    try:
        for name in ('stdout', 'stderr'):
            read_end, write_end = os.pipe()
            os.close(read_end)
            setattr(sys, name, open(write_end, 'w', buffering=1))
        yield
        for stream in (sys.stdout, sys.stderr):
            stream.close()
    finally:
        sys.stdout, sys.stderr = before


@pytest.mark.parametrize('faults, code', [([], 0), (['/muscle/valve_driver: vented'], 1)])
def test_a_rig_runs_on_where_nobody_reads(monkeypatch, faults, code):
    pytest.importorskip('rclpy')
    from pam_actuation.rigging import node_template, supervisor
    watched = []

    class Rig(contextlib.ExitStack):
        processes = {}

        def __init__(self, *_):
            super().__init__()
            self.faults = faults

        def start(self):
            pass

        def watch(self, seconds, tell):
            tell('/muscle/valve_driver is well again')
            watched.append(seconds)

        def not_begun(self):
            return []

        def finish(self, failure):
            assert failure == ''
            return []

    monkeypatch.setattr(node_template, 'prepare_template', lambda: None)
    monkeypatch.setattr(supervisor, 'Supervisor', Rig)
    with nobody():
        ended = main(['up', 'rig', '--seconds', '12'])
    assert ended == code and watched == [12.0]


def test_a_run_goes_on_where_nobody_reads(monkeypatch, tmp_path):
    pytest.importorskip('rclpy')
    from pam_actuation.rigging import node_template
    monkeypatch.setattr(node_template, 'prepare_template', lambda: None)
    done = []

    def run(*_, tell, progress, **__):
        tell('compiling')
        progress(1.0, 2.0)
        done.append(True)
        return session.Result('', failure='a node ended')

    monkeypatch.setattr(session, 'run_experiment', run)
    monkeypatch.setenv('PAM_PROGRESS', '1')
    with nobody():
        ended = main(['run', 'short_sine', '--out', str(tmp_path / 'bag')])
    assert ended == 1 and done


def test_another_error_of_the_output_is_told():
    class Full:

        def write(self, text):
            raise OSError(errno.ENOSPC, 'No space left on device')

        def flush(self):
            pass

    before = sys.stdout
    with pytest.raises(OSError, match='No space'):
        with contextlib.redirect_stdout(Full()), lasting_output():
            print('something')
    assert sys.stdout is before
