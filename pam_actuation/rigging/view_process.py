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

"""The live page as a process beside a rig: it may die, the rig goes on."""

from collections.abc import Iterator
import contextlib
from functools import partial
import json
import os
import selectors
import signal
import subprocess
import sys
import time
from typing import Final

from pam_actuation.rigging.processes import begin_session, node_environment

START_S: Final = 20.0       # on a busy machine; it has a low priority
END_S: Final = 3.0


@contextlib.contextmanager
def page_beside(domain_id: int, log_dir: str | os.PathLike[str]) -> Iterator[str]:
    """
    Serve the live page of a ROS domain while the block runs.

    To be entered before the process has threads of the middleware.

    Parameters
    ----------
    domain_id : int
        ROS domain of the rig.
    log_dir : path
        Where rclpy writes its log files.

    Yields
    ------
    str
        Address of the page; '' where it did not start, which stops nothing.

    """
    process = subprocess.Popen(
        [sys.executable, '-m', 'pam_actuation.cli.main', 'view', '--json',
         '--domain-id', str(domain_id)],
        env=node_environment(domain_id, log_dir), stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True,
        preexec_fn=partial(begin_session, os.getpid()))
    try:
        yield _address(process)
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        assert process.stdout is not None
        process.stdout.close()


def _address(process: 'subprocess.Popen[bytes]') -> str:
    """Return what the process says of its address, '' if it ends or says nothing in time."""
    assert process.stdout is not None
    deadline, said = time.monotonic() + START_S, b''
    with selectors.DefaultSelector() as selector:
        selector.register(process.stdout, selectors.EVENT_READ)
        while b'\n' not in said:
            left_s = deadline - time.monotonic()
            if left_s <= 0.0 or not selector.select(left_s):
                return ''
            part = os.read(process.stdout.fileno(), 4096)
            if not part:
                return ''
            said += part
    try:
        return str(json.loads(said)['url'])
    except (ValueError, KeyError):
        return ''
