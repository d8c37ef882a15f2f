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

"""
Ctrl-C at random moments of random verbs and nodes, each the same in every run.

::

    python test/fuzz/interruptions.py --count 400 --longest 6
    python test/fuzz/interruptions.py --count 60 --longest 20 --live

A verb must end with exit code 130 and one line on standard error, or as usual if it was done
already; a node with exit code 0, whatever came first. No process may stay. The program prints how
often each outcome came and exits with 1 otherwise.
"""

import argparse
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
import os
from pathlib import Path
import random
import signal
import subprocess
import sys
import tempfile
import time
import uuid

ROOT = Path(__file__).resolve().parents[2]
BAG = str(ROOT / 'test' / 'replay' / 'pinned' / 'sofc_ppr.mcap')
RIG = 'dmsp_5_300_hanging_mass'
VERBS = (
    ('simulate', 'sine_quarter_hz', '--rig', RIG, '--out', 'simulated'), ('replay', BAG),
    ('tune', BAG, '--rollouts', '200', '--out', 'tuned.yaml'),
    ('characterise', '--simulate', RIG, '--out', 'surfaces'),
    ('gap', BAG, '--model', RIG, '--out', 'gap'), ('report', BAG, '--out', 'report.html'),
    ('info', BAG), ('models',), ('valves', 'compare', '--rig', RIG), ('rules', BAG))
LIVE_VERBS = (
    ('run', 'short_sine', '--out', 'run'), ('run', 'short_sine', '--out', 'run', '--json'),
    ('up', 'rig', '--experiment', 'short_sine', '--record', 'up'), ('up', 'knee'),
    ('demo', '--quick', '--out', 'demo'), ('nodes',))
NODES = ('valve_driver', 'valve_watchdog', 'plant_simulator', 'sofc_controller', 'pid_controller',
         'joint_simulator', 'joint_controller', 'reference_generator', 'hardware_sensors',
         'experiment_recorder')
# As the script that pip or colcon writes; the line tells that the interpreter itself is up.
SCRIPT = 'print(flush=True); import sys; from {} import {} as main; sys.exit(main())'
# How long they work on a quiet machine [s]; a node does the same for ever after its first seconds.
# A signal that comes later tells nothing.
WORKS_S = {'simulate': 2.2, 'replay': 1.3, 'tune': 1.8, 'gap': 1.1, 'report': 0.9, 'info': 0.6,
           'models': 0.8, 'valves': 4.0, 'rules': 0.9, 'nodes': 1.0, 'up': 6.0}
NODE_WORKS_S = 4.0
# A node that compiles, a session that ends all its nodes in order, at a low priority.
ENDED_AFTER_S = 40.0
MARK = 'PAM_INTERRUPTED_BY_TEST'


@dataclass(frozen=True)
class Case:
    """One interruption: what is started, when the signals come, and who gets them."""

    number: int
    words: tuple
    is_node: bool
    waits_s: tuple      # before the first signal and between further ones
    to_group: bool      # as a terminal does; else to the process alone

    def command(self):
        """Return the command line."""
        if not self.is_node:
            script = SCRIPT.format('pam_actuation.cli.main', 'main')
            return [sys.executable, '-c', script, *self.words]
        script = SCRIPT.format('pam_actuation.nodes.executables', self.words[0])
        return [sys.executable, '-c', script, '--ros-args', *self.words[1:]]


def case(number, longest_s, live):
    """Return a Case by its number."""
    dice = random.Random(number)
    is_node = live and dice.random() < 0.5
    if is_node:
        name = dice.choice(NODES)
        words = (name, '-p', 'backend:=dummy') if name == 'hardware_sensors' else (name,)
    else:
        words = dice.choice(LIVE_VERBS if live else VERBS)
    works_s = NODE_WORKS_S if is_node else WORKS_S.get(words[0], longest_s)
    first_s = dice.uniform(0.05, min(longest_s, works_s))
    more = tuple(dice.uniform(0.005, 0.3) for _ in range(dice.choice((0, 0, 1, 3, 8))))
    return Case(number, words, is_node, (first_s, *more), dice.random() < 0.5)


def interrupt(one, folder, environment):
    """Run a Case; return ``interrupted`` or ``done``, or a sentence on what was wrong."""
    mark = uuid.uuid4().hex
    process = subprocess.Popen(
        one.command(), cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, start_new_session=True,
        env={**environment, MARK: mark, 'PYTHONPATH': str(ROOT)})
    sent = 0
    try:
        process.stdout.readline()
        for wait_s in one.waits_s:
            with suppress(subprocess.TimeoutExpired):
                process.wait(wait_s)
            if process.returncode is not None:
                break
            (os.killpg if one.to_group else os.kill)(process.pid, signal.SIGINT)
            sent += 1
        _, errors = process.communicate(timeout=ENDED_AFTER_S)
    except subprocess.TimeoutExpired:
        process.kill()
        return f'did not end within {ENDED_AFTER_S:g} s: {process.communicate()[1][-300:]}'
    if 'Traceback' in errors or 'Exception ignored' in errors:
        return f'traceback: {errors[:1500]}'
    left = _left(mark)
    if left:
        return f'left processes behind: {left}'
    code, lines = process.returncode, errors.splitlines()
    if one.is_node:
        told = [line for line in lines if not line.startswith('[')]
        return 'interrupted' if code == 0 and len(told) <= 1 else f'exit code {code}: {errors}'
    if sent == 0 or code in (0, 1):
        return 'done' if code in (0, 1) else f'exit code {code}: {errors}'
    if code != 130 or len(lines) != 1 or 'stopped' not in errors:
        return f'exit code {code}: {errors}'
    return 'interrupted'


def _left(mark, timeout_s=5.0):
    """Return the processes with a mark in their environment that do not end in time."""
    deadline = time.monotonic() + timeout_s
    while True:
        left = []
        for entry in Path('/proc').iterdir():
            try:
                if entry.name.isdigit() and mark.encode() in (entry / 'environ').read_bytes():
                    left.append((entry / 'cmdline').read_text().replace('\0', ' ')[:100])
            except OSError:
                continue        # it ended, or is not ours
        if not left or time.monotonic() > deadline:
            return left
        time.sleep(0.05)


@contextmanager
def _domain(live):
    """Give the environment of a ROS domain that nobody else uses; {} where no node runs."""
    if not live:
        yield {}
        return
    from pam_actuation.rigging.domain import DomainLock
    lock = DomainLock()
    try:
        yield {'ROS_DOMAIN_ID': str(lock.domain_id), 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}
    finally:
        lock.release()


def run(count, longest_s=1.3, live=False, jobs=2, start=0):
    """
    Run ``count`` cases, ``jobs`` at a time.

    Returns
    -------
    outcomes : Counter
        How often a verb or node was ``interrupted`` or ``done``.
    bad : list of str
        The others: what was started, when, and what was wrong.

    """
    environment = {**os.environ, 'OPENBLAS_NUM_THREADS': '1', 'NUMBA_NUM_THREADS': '1'}

    def one(number):
        chosen = case(number, longest_s, live)
        # A domain each: a recorder counts what the others of its domain did not send it.
        with tempfile.TemporaryDirectory() as folder, _domain(live) as domain:
            return chosen, interrupt(
                chosen, folder, {**environment, **domain, 'ROS_LOG_DIR': folder})

    with ThreadPoolExecutor(jobs) as pool:
        results = list(pool.map(one, range(start, start + count)))
    outcomes = Counter(what for _, what in results if what in ('interrupted', 'done'))
    return outcomes, [f'{chosen}\n    {what}' for chosen, what in results
                      if what not in ('interrupted', 'done')]


def main():
    """Run the cases asked for and tell the outcomes."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('--count', type=int, default=100)
    parser.add_argument('--start', type=int, default=0, help='number of the first case')
    parser.add_argument('--longest', type=float, default=1.3, help='latest first signal [s]')
    parser.add_argument('--live', action='store_true', help='nodes, and verbs that start nodes')
    parser.add_argument('--jobs', type=int, default=2)
    args = parser.parse_args()
    outcomes, bad = run(args.count, args.longest, args.live, args.jobs, args.start)
    print(', '.join(f'{what}: {count}' for what, count in outcomes.items()))
    print('\n'.join(bad))
    return 1 if bad else 0


if __name__ == '__main__':
    sys.path[:0] = [str(ROOT)]
    sys.exit(main())
