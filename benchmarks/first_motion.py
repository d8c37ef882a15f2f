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
From the command to the first motion and back to the prompt, two versions in turn.

::

    python benchmarks/first_motion.py /tmp/before . --rounds 7 --write
    python benchmarks/first_motion.py /tmp/before . --demo --write

Each folder holds a checkout with its environment ``.venv``. A round runs the old version, then the
new one, so that both meet the same machine. The muscle moves when its contraction is 0.5 mm above
that at rest. Processor time is that of the command and all its processes. Each version first runs
once without being measured: it compiles then, and stores its byte code. On a busy machine
``--ahead`` gives each measured command real-time priority, so that all else waits.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass
import os
from pathlib import Path
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.experiments import load_experiment
import results_page

EXPERIMENT = 'short_sine'
MOVED_M = 0.5e-3
AT_REST = 20                    # first samples of the contraction
VERSIONS = ('before', 'after')
# Row to the bar it has to meet [s].
RUN_ROWS = {
    'command to first reference': None, 'command to first motion': 3.0,
    'end of the experiment to the prompt': None, 'prompt, less the experiment': 4.0}
CPU = ', processor'


@dataclass
class Timed:
    """One command: began at [s, as ``time.time``], wall time and processor time [s]."""

    began_s: float
    wall_s: float
    cpu_s: float


def go_ahead() -> None:
    """Give this process, and those it starts, real-time priority."""
    os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))


def timed(checkout: Path, words: list[str], folder: str, ahead: bool = False) -> Timed:
    """Run ``pam`` of a checkout in a folder; a failure ends the benchmark."""
    environment = {name: value for name, value in os.environ.items()
                   if name not in ('PYTHONDONTWRITEBYTECODE', 'PYTHONPATH')}
    log = Path(folder) / 'log.txt'
    with open(log, 'wb') as stream:
        began_s, begin = time.time(), time.perf_counter()
        process = subprocess.Popen(
            [checkout / '.venv' / 'bin' / 'pam', *words], cwd=folder, stdout=stream,
            stderr=stream, env=environment, preexec_fn=go_ahead if ahead else None)
        _, status, usage = os.wait4(process.pid, 0)
        wall_s = time.perf_counter() - begin
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in (0, 1):
        sys.exit(f'pam {" ".join(words)} of {checkout}: {log.read_text()}')
    return Timed(began_s, wall_s, usage.ru_utime + usage.ru_stime)


def measured_run(checkout: Path, folder: str, ahead: bool) -> dict[str, float]:
    """Return the rows of one ``pam run`` [s]."""
    bag = os.path.join(folder, 'bag')
    done = timed(checkout, ['run', EXPERIMENT, '--out', bag, '--overwrite'], folder, ahead)
    run = load_run(bag)
    lasts_s = load_experiment(EXPERIMENT).duration_s
    asked_s = run.topics['reference'].stamp_ns[0] * 1e-9 - done.began_s
    moved = run.topics['contraction']
    above_m = moved.values['contraction_m'] - np.median(moved.values['contraction_m'][:AT_REST])
    if not np.any(above_m > MOVED_M):
        sys.exit(f'{EXPERIMENT} of {checkout}: the muscle did not move')
    first = int(np.argmax(above_m > MOVED_M))
    return {
        'command to first reference': asked_s,
        'command to first motion': moved.stamp_ns[first] * 1e-9 - done.began_s,
        'end of the experiment to the prompt': done.wall_s - asked_s - lasts_s,
        'prompt, less the experiment': done.wall_s - lasts_s,
        f'pam run {EXPERIMENT}{CPU}': done.cpu_s}


def measured_verb(checkout: Path, words: list[str], folder: str,
                  ahead: bool) -> dict[str, float]:
    """Return the rows of one short verb [s]."""
    done = timed(checkout, words, folder, ahead)
    name = f'pam {words[0]}'
    return {name: done.wall_s, f'{name}{CPU}': done.cpu_s}


def one_round(demo: bool, checkout: Path, folder: str, ahead: bool) -> dict[str, float]:
    """Return all rows of one version in one round [s]."""
    if demo:
        return measured_verb(
            checkout, ['demo', '--out', tempfile.mkdtemp(dir=folder)], folder, ahead)
    return {**measured_run(checkout, folder, ahead),
            **measured_verb(checkout, ['info', 'bag'], folder, ahead),
            **measured_verb(checkout, ['models'], folder, ahead)}


def bar_of(row: str) -> float | None:
    """Return what a row has to stay below [s], None where nothing is asked."""
    return {**RUN_ROWS, 'pam info': 0.6, 'pam models': 0.6, 'pam demo': 150.0}.get(row)


def show(args: argparse.Namespace) -> None:
    """Print the table as Markdown."""
    checkouts = dict(zip(VERSIONS, (args.old.resolve(), args.new.resolve())))
    found: dict[str, list[dict[str, float]]] = {name: [] for name in VERSIONS}
    loads = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(args.rounds + (not args.demo)):
            for name, checkout in checkouts.items():
                loads.append(os.getloadavg()[0])
                counts = bool(number or args.demo)      # the first round compiles
                rows = one_round(args.demo, checkout, folder, args.ahead and counts)
                print(f'{number} {name} {rows}', file=sys.stderr, flush=True)
                if counts:
                    found[name].append(rows)
    commits = ', '.join(f'{name} {results_page.commit(at)}' for name, at in checkouts.items())
    print(f'{args.rounds} rounds; {commits}. Load average: {min(loads):.1f} to '
          f'{max(loads):.1f}{", which waited" * args.ahead}.\n')
    print('| [s] | before: median | shortest | after: median | shortest | bar |\n'
          '|---|---|---|---|---|---|')
    best: Callable[[list[float]], float] = min
    for row in found['after'][0]:
        cells = [f'{function(values):.2f}' for name in VERSIONS
                 for values in [[one[row] for one in found[name]]]
                 for function in (statistics.median, best)]
        bar = bar_of(row)
        print(f'| {row} | {" | ".join(cells)} | {"" if bar is None else f"{bar:g}"} |')


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('old', type=Path, help='checkout with .venv')
    parser.add_argument('new', type=Path, help='the other one')
    parser.add_argument('--rounds', type=int, default=7, help='of each version')
    parser.add_argument('--ahead', action='store_true',
                        help='real-time priority for the measured commands, as root')
    parser.add_argument('--demo', action='store_true', help='pam demo, and nothing else')
    results_page.add_write(parser, 'first_motion')
    return parser


def main() -> None:
    """Run and compare."""
    args = command_line().parse_args()
    with results_page.printed(args, __file__, 'demo' * args.demo):
        show(args)


if __name__ == '__main__':
    main()
