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

"""Lifecycle transitions of node processes, with a sentence on whoever does not make it."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
import signal
import threading
import time
from types import FrameType
from typing import TYPE_CHECKING

from pam_actuation.rigging.processes import NodeProcess

if TYPE_CHECKING:
    from pam_actuation.rigging.client import RigClient

TRANSITION_TIMEOUT_S = 15.0
REASON_S = 1.0                # a node answers, and writes why a moment later
STOP_TIMEOUT_S = 5.0          # to deactivate: the driver, which vents, comes after others
CLOSE_TIMEOUT_S = 60.0        # the recorder writes what is queued
COMPILES = ('; the first start on a machine compiles: run `python3 -m pam_actuation.warm_up` '
            'once, then try again')


class SessionFailed(Exception):
    """The nodes could not be brought up or did not stay up; the text says why."""


def change(client: 'RigClient', processes: Iterable[NodeProcess], transition: str,
           timeout_s: float = TRANSITION_TIMEOUT_S) -> None:
    """
    Ask nodes for a transition at the same time.

    Parameters
    ----------
    client : RigClient
        Whose services are asked.
    processes : iterable of NodeProcess
        Of the nodes.
    transition : str
        A key of ``client.TRANSITIONS``.
    timeout_s : float
        Longest wait [s].

    Raises
    ------
    SessionFailed
        A node ended, refused, or was too slow.

    """
    by_name = {process.full_name: process for process in processes}
    begin_s = time.monotonic()
    refused = client.change_states(
        by_name, transition, timeout_s, lambda full_name: by_name[full_name].running)
    is_late = time.monotonic() - begin_s >= timeout_s
    # A node that ended explains more than one that only did not answer.
    for full_name in sorted(refused, key=lambda name: by_name[name].running):
        process = by_name[full_name]
        if not process.running:
            raise SessionFailed(process.how_it_ended())
        last = process.last_line() if is_late else _reason(process, transition)
        raise SessionFailed(
            f'{process.label} did not {transition}'
            + (f' within {timeout_s:g} s' if is_late else '') + (f': {last}' if last else '')
            + (COMPILES if is_late and transition == 'configure' else ''))


def _reason(process: NodeProcess, transition: str) -> str:
    """Return the last line of a node that refused, once it has written why."""
    deadline_s = time.monotonic() + REASON_S
    while (f'cannot {transition}' not in process.printed() and process.running
           and time.monotonic() < deadline_s):
        time.sleep(0.02)
    return process.last_line()


@contextmanager
def termination_as_interrupt() -> Iterator[None]:
    """Turn SIGTERM into KeyboardInterrupt while the nodes run, so that they end in order."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, _interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _interrupt(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt
