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
Ctrl-C at random moments of every verb and node, each the same in every run.

::

    python test/fuzz/interruptions.py --rounds 40
    python test/fuzz/interruptions.py --rounds 6 --live

The time that a verb or node works is divided into rounds, the first ones short, since imports and
starts are the delicate part. In each round each of them is interrupted once. A verb must end with
exit code 130 and one line on standard error, or as usual if it was done already. A node must end
with exit code 0, whatever came first. No process may stay. The program prints how often each
outcome came and exits with 1 otherwise.
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

from pam_actuation.priority import keep_niceness

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
# As the script that pip or colcon writes. The line tells that main() is about to start. Before it
# does, nothing of ours can answer: there a signal ends the process without a word.
SCRIPT = ('import sys, signal; signal.signal(signal.SIGINT, signal.SIG_DFL); '
          'from {} import {} as main; print(flush=True); sys.exit(main())')
# How long they work on a quiet machine [s]; a node does the same for ever after its first seconds.
# A signal that comes later tells nothing.
WORKS_S = {'simulate': 2.2, 'replay': 1.3, 'tune': 1.8, 'gap': 1.1, 'report': 0.9, 'info': 0.6,
           'models': 0.8, 'valves': 4.0, 'rules': 0.9, 'nodes': 1.0, 'up': 6.0,
           'characterise': 2.5, 'run': 10.0, 'demo': 10.0}
NODE_WORKS_S = 4.0
# A node that compiles, a session that ends all its nodes in order, at a low priority.
ENDED_AFTER_S = 40.0
RIGHT = 'interrupted', 'done', 'too early'
MARK = 'PAM_INTERRUPTED_BY_TEST'


@dataclass(frozen=True)
class Case:
    """One interruption: what is started, when the signals come, and who gets them."""

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


def cases(number, of, live, seed=0):
    """
    Return the Cases of one round.

    Parameters
    ----------
    number, of : int
        Which round, from 0, of how many.
    live : bool
        Nodes and verbs that start nodes; else the other verbs.
    seed : int
        Another one gives other moments.

    """
    found = []
    kinds = [(words, False) for words in (LIVE_VERBS if live else VERBS)]
    if live:
        kinds += [((name, '-p', 'backend:=dummy') if name == 'hardware_sensors' else (name,), True)
                  for name in NODES]
    for place, (words, is_node) in enumerate(kinds):
        dice = random.Random(f'{seed} {live} {place} {number} of {of}')
        works_s = NODE_WORKS_S if is_node else WORKS_S[words[0]]
        first_s = max(0.05, works_s * ((number + dice.random()) / of) ** 2)
        more = tuple(dice.uniform(0.005, 0.3) for _ in range(dice.choice((0, 0, 1, 3, 8))))
        found.append(Case(words, is_node, (first_s, *more), dice.random() < 0.5))
    return found


def interrupt(one, folder, environment):
    """Run a Case; return ``interrupted``, ``done`` or ``too early``, or what was wrong."""
    mark = uuid.uuid4().hex
    process = subprocess.Popen(
        one.command(), cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, start_new_session=True, preexec_fn=keep_niceness,
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
    if code == -signal.SIGINT and not lines:
        return 'too early'
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


def run(rounds, of, live=False, jobs=2, seed=0):
    """
    Run the cases of some rounds, ``jobs`` at a time.

    Returns
    -------
    outcomes : Counter
        How often a verb or node was ``interrupted`` or ``done``, or the signal ``too early``.
    bad : list of str
        The others: what was started, when, and what was wrong.

    """
    environment = {**os.environ, 'OPENBLAS_NUM_THREADS': '1', 'NUMBA_NUM_THREADS': '1'}

    def one(chosen):
        # A domain each: a recorder counts what the others of its domain did not send it.
        with tempfile.TemporaryDirectory() as folder, _domain(live) as domain:
            return chosen, interrupt(
                chosen, folder, {**environment, **domain, 'ROS_LOG_DIR': folder})

    with ThreadPoolExecutor(jobs) as pool:
        results = list(pool.map(
            one, [case for number in rounds for case in cases(number, of, live, seed)]))
    outcomes = Counter(what for _, what in results if what in RIGHT)
    return outcomes, [f'{chosen}\n    {what}' for chosen, what in results if what not in RIGHT]


def main():
    """Run the cases asked for and tell the outcomes."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('--rounds', type=int, default=10)
    parser.add_argument('--seed', type=int, default=0, help='another one gives other moments')
    parser.add_argument('--live', action='store_true', help='nodes, and verbs that start nodes')
    parser.add_argument('--jobs', type=int, default=2)
    args = parser.parse_args()
    outcomes, bad = run(range(args.rounds), args.rounds, args.live, args.jobs, args.seed)
    print(', '.join(f'{what}: {count}' for what, count in outcomes.items()))
    print('\n'.join(bad))
    return 1 if bad else 0


if __name__ == '__main__':
    sys.path[:0] = [str(ROOT)]
    sys.exit(main())
