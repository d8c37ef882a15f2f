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

"""Nodes as processes of the operating system, started and ended by their parent only."""

from collections.abc import Iterable, Mapping, Sequence
import ctypes
from functools import partial
import os
from pathlib import Path
import signal
import subprocess
import sys
import time
from typing import Any, TYPE_CHECKING

from pam_actuation.priority import keep_niceness
from pam_actuation.transport import prepare_middleware

if TYPE_CHECKING:
    from pam_actuation.rigging.node_template import ForkedNode, NodeTemplate

PACKAGE_ROOT = Path(__file__).resolve().parents[2]
LIBC = ctypes.CDLL(None) if sys.platform == 'linux' else None
PR_SET_PDEATHSIG, PR_SET_NAME = 1, 15
LAUNCHED_BY = 'PAM_LAUNCHED_BY'         # variable: the process of the launch that started a node
TICKS_PER_S = os.sysconf('SC_CLK_TCK')


def node_environment(domain_id: int, log_dir: str | os.PathLike[str]) -> dict[str, str]:
    """
    Return the environment of the nodes: one domain, this machine only by UDP, one thread each.

    Parameters
    ----------
    domain_id : int
        ROS domain.
    log_dir : path
        Where rclpy writes its log files.

    """
    environment = dict(os.environ)
    search = [str(PACKAGE_ROOT), *filter(None, [environment.get('PYTHONPATH')])]
    environment.update(
        ROS_DOMAIN_ID=str(domain_id), ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST',
        ROS_LOG_DIR=str(log_dir), PYTHONPATH=os.pathsep.join(search),
        OPENBLAS_NUM_THREADS='1', OMP_NUM_THREADS='1', NUMBA_NUM_THREADS='1')
    prepare_middleware(environment)
    return environment


def parameter_arguments(parameters: Mapping[str, Any]) -> list[str]:
    """Return the ROS arguments ``-p name:=value`` of a dict of parameters."""
    arguments = []
    for name, value in parameters.items():
        if isinstance(value, bool):
            text = 'true' if value else 'false'
        elif isinstance(value, str):
            text = "'" + value.replace("'", "''") + "'"
        elif isinstance(value, (list, tuple)):
            text = '[' + ', '.join(str(item) for item in value) + ']'
        else:
            text = repr(value)
        arguments += ['-p', f'{name}:={text}']
    return arguments


class NodeProcess:
    """
    One node of the rig as a child process.

    It gets no Ctrl-C from the terminal (its parent decides the order of the end), and a
    SIGTERM if the parent dies, so that it vents in either case.

    Parameters
    ----------
    name : str
        Executable and node name.
    namespace : str
        Namespace of the rig, such as ``/muscle``.
    parameters : dict
        ROS parameters.
    environment : dict
        From ``node_environment``.
    log_dir : path
        Folder for what the node prints.
    remap : dict
        Topic of the node to the name it has instead.
    parameter_file : str
        ROS parameter file with further parameters; '' for none.
    users_file : str
        One whose parameters count where ``parameters`` and ``parameter_file`` say nothing.
    label : str
        What sentences call it, such as ``flexor/valve_driver``; '': its name.
    program : sequence of str
        Command line of a node of somebody else in its place; what ROS takes is added to it.
    template : NodeTemplate, optional
        From it the node is forked; without it, or if it is lost, it starts by itself.

    """

    killed_after_s: float | None = None         # by ``end_all``, in vain asked to end

    def __init__(self, name: str, namespace: str, parameters: Mapping[str, Any],
                 environment: Mapping[str, str], log_dir: str | os.PathLike[str],
                 remap: Mapping[str, str] | None = None, parameter_file: str = '',
                 users_file: str = '', label: str = '', program: Sequence[str] = (),
                 template: 'NodeTemplate | None' = None) -> None:
        self.name = name
        self.label = label or name
        self.full_name = f'{namespace.rstrip("/")}/{name}'
        self.log_file = Path(log_dir) / f'{name}.log'
        arguments = [
            '--ros-args', '-r', f'__ns:={namespace or "/"}',
            *(['--params-file', users_file] if users_file else []),
            *parameter_arguments(parameters)]
        if parameter_file:
            arguments += ['--params-file', parameter_file]
        if environment.get('ROS_SECURITY_ENABLE') == 'true':
            arguments += ['--enclave', self.full_name]
        for topic, other in dict(remap or {}).items():
            arguments += ['-r', f'{topic}:={other}']
        self._process = self._start(arguments, environment, program, template)
        self.pid = self._process.pid

    def _start(self, arguments: list[str], environment: Mapping[str, str],
               program: Sequence[str], template: 'NodeTemplate | None'
               ) -> 'subprocess.Popen[bytes] | ForkedNode':
        with open(self.log_file, 'wb') as log:
            forked = None if template is None or program else template.start(
                [self.name, *arguments], environment, self.log_file)
            return forked or subprocess.Popen(
                [*(program or (sys.executable, '-m', f'pam_actuation.nodes.{self.name}')),
                 *arguments],
                env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                start_new_session=True, preexec_fn=partial(begin_session, os.getpid()))

    @property
    def exit_code(self) -> int | None:
        """Return the exit code, negative for a signal, None while the process runs."""
        return self._process.poll()

    @property
    def running(self) -> bool:
        """Tell whether the process runs."""
        return self.exit_code is None

    def how_it_ended(self) -> str:
        """Return a phrase on how the process ended, with the last line it printed."""
        code = self.exit_code
        if code is None:
            return f'{self.label} runs'
        if code == -signal.SIGKILL and self.killed_after_s is not None:
            return (f'{self.label} did not end within {self.killed_after_s:g} s of SIGTERM and '
                    'was killed')
        if code < 0:
            return f'{self.label} was ended by {signal.Signals(-code).name}'
        last = self.last_line()
        return f'{self.label} ended with exit code {code}' + (f' ({last})' if last else '')

    def last_line(self) -> str:
        """Return the last line the node printed, without the time."""
        lines = self.printed().strip().splitlines()
        return lines[-1].rsplit(']: ', 1)[-1] if lines else ''

    def printed(self) -> str:
        """Return all that the node printed."""
        try:
            return self.log_file.read_text(errors='replace')
        except OSError:
            return ''

    def cpu_s(self) -> float | None:
        """Return the processor time used so far [s]; None once the process is gone."""
        try:
            fields = Path(f'/proc/{self.pid}/stat').read_text().rsplit(')', 1)[1].split()
        except OSError:
            return None
        return (int(fields[11]) + int(fields[12])) / TICKS_PER_S

    def send_signal(self, number: int) -> None:
        """Send a signal, if the process still runs."""
        if self.running:
            self._process.send_signal(number)

    def wait(self, timeout_s: float) -> bool:
        """Wait for the end; return whether it came in time."""
        try:
            self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            return False
        return True


def end_all(processes: Iterable[NodeProcess], timeout_s: float = 5.0) -> None:
    """
    End processes: SIGTERM to all, and SIGKILL to those that have not ended in time.

    All have the same time, however many there are.
    """
    processes = list(processes)
    deadline = time.monotonic() + timeout_s
    for process in processes:
        process.send_signal(signal.SIGTERM)
    late = [one for one in processes if not one.wait(max(deadline - time.monotonic(), 0.0))]
    for process in late:
        process.killed_after_s = timeout_s
        process.send_signal(signal.SIGKILL)
    for process in late:
        process.wait(timeout_s)


def begin_session(parent_pid: int) -> None:
    """Keep the priority of the parent in a new session, and end with it (a ``preexec_fn``)."""
    keep_niceness()
    end_with_parent(parent_pid)


def end_with_parent(parent_pid: int, ancestor_pid: int = 0) -> None:
    """
    Ask Linux for a SIGTERM to this process when its parent dies.

    A parent that died before is not told of any more: the process ends at once. So it does where
    ``ancestor_pid`` is given and no process above this one any more.
    """
    if LIBC is not None:
        LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
        if os.getppid() != parent_pid or ancestor_pid and not _descends_from(ancestor_pid):
            os._exit(1)


def _descends_from(pid: int) -> bool:
    """Tell whether a process is the parent of this one, or the parent of that, and so on."""
    above = os.getppid()
    while above not in (0, pid):
        try:
            stat = Path(f'/proc/{above}/stat').read_text()
        except OSError:         # it has just ended
            return False
        above = int(stat.rsplit(')', 1)[1].split()[1])
    return above == pid


def name_process(*words: str) -> None:
    """
    Give this process the name and the command line that ``top``, ``ps`` and ``pgrep -f`` show.

    Linux shows the memory that held the words it was started with; they are written over. What
    is too long for that place is cut off.
    """
    if LIBC is None:
        return
    LIBC.prctl(PR_SET_NAME, words[0].encode()[:15], 0, 0, 0)
    numbers = Path('/proc/self/stat').read_text().rsplit(')', 1)[1].split()
    start, end = (int(number) for number in numbers[45:47])      # fields 48 and 49
    if end > start > 0:
        text = '\0'.join(words).encode()[:end - start - 1]
        ctypes.memmove(start, text.ljust(end - start, b'\0'), end - start)
