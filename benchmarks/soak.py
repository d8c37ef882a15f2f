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
Run a rig for an hour and compare its last minutes with its first ones.

    python benchmarks/soak.py --seconds 3600 --valve hsv

All nodes and the recorder live, at the rates of `pam run`. Every 10 s the memory of each
process (`VmRSS`, `RssAnon` of /proc) is noted; the stamps of what each loop sends come from the
bag. The first twelfth of the run after the warm-up is compared with the last one. Printed are the
mean memory, the period of each loop, and how many messages it sent per period. The period is the
slope of the stamps over the number of periods: a message that was not sent does not count as a
longer period. Exit code 1 if a process grew by more than 1 %, or the period of a loop changed by
more than 0.001 %. The same if the experiment did not end with every message recorded. A run that
fails leaves the page as it is.
"""

import argparse
from pathlib import Path
import sys
import tempfile

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.rigging import session
from pam_actuation.rigging.plan import make_plan
from pam_actuation.rigging.transitions import termination_as_interrupt
from recording_load import experiment_text
import results_page
from tqdm import tqdm

ALLOWED_GROWTH = 0.01
ALLOWED_DRIFT = 1e-5
EVERY_S = 10.0
SHORTEST_S = 120.0
NEAR = 0.2                  # of a period
PARTS, WARM_UP_PARTS = 12, 2
# The driver behind a regulator has no period of its own: it answers commands.
LOOPS = {'ppr': ('pressure', 'controller_state', 'reference')}
LOOPS['hsv'] = (*LOOPS['ppr'], 'valve_signal')
SIZES = ('VmRSS', 'RssAnon')


def memory_kb(pid):
    """Return the sizes of a process [kB] by name."""
    lines = Path(f'/proc/{pid}/status').read_text().splitlines()
    status = dict(line.split(':', 1) for line in lines)
    return {name: int(status[name].split()[0]) for name in SIZES}


class Samples:
    """
    What the processes of a rig need, noted every ``EVERY_S``.

    Parameters
    ----------
    rig : RigSession
        Its nodes are looked at.
    seconds : float
        Length of the experiment [s].

    """

    def __init__(self, rig, seconds):
        self._rig = rig
        self._next_s = EVERY_S
        self.rows = {}              # node to a list of kB by name
        self._bar = tqdm(total=round(seconds), unit='s', disable=None)

    def note(self, done_s, total_s):
        """Note one sample if it is time to."""
        self._bar.update(int(done_s) - self._bar.n)
        if done_s < self._next_s:
            return
        self._next_s += EVERY_S
        for name, process in self._rig.processes.items():
            if not process.running:
                continue            # the session tells
            self.rows.setdefault(name, []).append(memory_kb(process.pid))


def spans(samples):
    """Return the part of a sequence that follows the warm-up, and its last part."""
    size = max(len(samples) // PARTS, 1)
    return samples[WARM_UP_PARTS * size:(WARM_UP_PARTS + 1) * size], samples[-size:]


def mean_kb(rows, name):
    """Return a mean size [kB]."""
    return sum(row[name] for row in rows) / len(rows)


def period_of(stamps_ns):
    """
    Return the period of a loop [ns] and how many messages it sent per period.

    Parameters
    ----------
    stamps_ns : ndarray of int64, shape (N,)
        Of what it sent, ascending. Only those less than ``NEAR`` of a period from the grid of
        the others count for the period: not those that came late, or between.

    """
    since_ns = (stamps_ns - stamps_ns[0]).astype(float)
    period_ns = np.median(np.diff(since_ns))
    # The grid is found on a little of it first: over a long time a small error adds up.
    for share in (0.002, 0.02, 0.2, 1.0, 1.0):
        some_ns = since_ns[:max(round(share * len(since_ns)), 100)]
        phases = some_ns / period_ns
        offset = np.median((phases - np.rint(phases)))
        counted = np.rint(phases - offset)
        near = np.abs(phases - offset - counted) < NEAR
        period_ns, _ = np.polyfit(counted[near], some_ns[near], 1)
    return period_ns, (len(since_ns) - 1) * period_ns / since_ns[-1]


def judge(samples, bag, loops):
    """Print the tables; return whether the bars are met."""
    print('| process | memory after the warm-up | at the end | growth | of it not shared |')
    print('|---|---|---|---|---|')
    good = True
    for name, rows in samples.rows.items():
        early, late = spans(rows)
        growth = {size: mean_kb(late, size) / mean_kb(early, size) - 1.0 for size in SIZES}
        good &= growth['VmRSS'] <= ALLOWED_GROWTH
        print(f'| {name} | {mean_kb(early, "VmRSS") / 1024.0:.1f} MiB '
              f'| {mean_kb(late, "VmRSS") / 1024.0:.1f} MiB | {growth["VmRSS"]:+.2%} '
              f'| {growth["RssAnon"]:+.2%} |')
    print('\n| loop, by its topic | period after the warm-up | at the end | change '
          '| messages per period, then | at the end |')
    print('|---|---|---|---|---|---|')
    topics = load_run(bag).topics
    for topic in loops:
        early, late = map(period_of, spans(topics[topic].stamp_ns))
        drift = late[0] / early[0] - 1.0
        good &= abs(drift) <= ALLOWED_DRIFT
        print(f'| {topic} | {early[0] * 1e-6:.6f} ms | {late[0] * 1e-6:.6f} ms | {drift:+.5%} '
              f'| {early[1]:.5f} | {late[1]:.5f} |')
    return good


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--seconds', type=float, default=3600.0)
    parser.add_argument('--valve', choices=('ppr', 'hsv'), default='ppr')
    results_page.add_write(parser, 'loop_timing')
    return parser


def main():
    """Run and judge."""
    parser = command_line()
    args = parser.parse_args()
    if args.seconds < SHORTEST_S:
        parser.error(f'--seconds {args.seconds:g} is too short, give at least {SHORTEST_S:g}')
    with results_page.printed(args, __file__):
        return run(args)


def run(args):
    """Run the rig, print the tables; return the exit code."""
    with tempfile.TemporaryDirectory() as folder:
        plan = make_plan(experiment_text(args.seconds), 'dmsp_5_300_realistic',
                         f'sofc_{args.valve}', args.valve, bag := str(Path(folder) / 'bag'))
        result = session.Result(bag)
        try:
            with termination_as_interrupt(), session.RigSession(plan) as rig:
                samples = Samples(rig, args.seconds)
                session.run_guarded(rig, result, samples.note)
        finally:
            plan.remove()
        if result.failure:
            raise SystemExit(result.failure)    # and the page keeps its former tables
        print(f'{result.duration_s:.0f} s, {sum(result.recorded.values())} messages recorded of '
              f'{sum(result.published.values())}\n')
        print(''.join(f'{problem}\n' for problem in result.findings))
        good = not result.findings and result.complete
        good &= judge(samples, bag, LOOPS[args.valve])
    return 0 if good else 1


if __name__ == '__main__':
    sys.exit(main())
