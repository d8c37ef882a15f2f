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
Does a rig that runs for an hour still do so as in its first minutes?

    python benchmarks/soak.py --seconds 3600 --valve hsv

All nodes and the recorder live, at the rates of `pam run`. Every 10 s the memory of each
process (`VmRSS`, `RssAnon` of /proc) and the ticks of its loop are noted. Printed: memory from
the end of the warm-up to the end of the run, each the mean of a twelfth of the run, and the
period of the loops in the same two spans. Exit code 1 if a process grew by more than 1 %, the
period of a loop changed by more than 0.01 %, or the experiment did not come to its end with
every message recorded.
"""

import argparse
from pathlib import Path
import sys
import tempfile

from diagnostic_msgs.msg import DiagnosticArray
from pam_actuation.nodes import qos
from pam_actuation.nodes.conversions import stamp_ns
from pam_actuation.rigging import session
from pam_actuation.rigging.plan import make_plan
from pam_actuation.rigging.transitions import termination_as_interrupt
from recording_load import experiment_text
from tqdm import tqdm

ALLOWED_GROWTH = 0.01
ALLOWED_DRIFT = 1e-4
EVERY_S = 10.0
PARTS = 12                  # of the run: the first two are warm-up
SIZES = ('VmRSS', 'RssAnon')


def memory_kb(pid):
    """Return the sizes of a process [kB] by name."""
    lines = Path(f'/proc/{pid}/status').read_text().splitlines()
    status = dict(line.split(':', 1) for line in lines)
    return {name: int(status[name].split()[0]) for name in SIZES}


class Samples:
    """
    What the processes of a rig need and do, noted every ``EVERY_S``.

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
        self._ticks = {}            # full node name to (stamp [s], ticks)
        self._listening = False
        self.rows = {}              # node to a list of (stamp [s], kB by name, ticks)
        self._bar = tqdm(total=round(seconds), unit='s', disable=None)

    def _hear(self, message):
        for status in message.status:
            for item in status.values:
                if item.key == 'loop.ticks':
                    self._ticks[status.name] = 1e-9 * stamp_ns(message), int(item.value)

    def note(self, done_s, total_s):
        """Note one sample if it is time to."""
        if not self._listening:
            self._rig.client.node.create_subscription(
                DiagnosticArray, '/diagnostics', self._hear, qos.reliable(1000))
            self._listening = True
        self._bar.update(int(done_s) - self._bar.n)
        if done_s < self._next_s:
            return
        self._next_s += EVERY_S
        for name, process in self._rig.processes.items():
            stamp_s, ticks = self._ticks.get(process.full_name, (0.0, 0))
            self.rows.setdefault(name, []).append((stamp_s, memory_kb(process.pid), ticks))

    def spans(self, name):
        """Return the samples of a node just after the warm-up, and those at the end."""
        rows = self.rows[name]
        size = max(len(rows) // PARTS, 2)
        return rows[2 * size:3 * size], rows[-size:]


def mean_kb(rows, name):
    """Return a mean size [kB]."""
    return sum(row[1][name] for row in rows) / len(rows)


def period_ms(rows):
    """Return the mean period of a loop over a span [ms], None without a loop."""
    (begin_s, _, first), (end_s, _, last) = rows[0], rows[-1]
    return 1e3 * (end_s - begin_s) / (last - first) if last > first else None


def judge(samples):
    """Print the table; return whether the bars are met."""
    print('| process | memory after the warm-up | at the end | growth | of it not shared '
          '| period after the warm-up | at the end | change |')
    print('|---|---|---|---|---|---|---|---|')
    good = True
    for name in samples.rows:
        early, late = samples.spans(name)
        growth = {size: mean_kb(late, size) / mean_kb(early, size) - 1.0 for size in SIZES}
        good &= growth['VmRSS'] <= ALLOWED_GROWTH
        before, after = period_ms(early), period_ms(late)
        loop = '– | – | –'
        if before and after:
            drift = after / before - 1.0
            good &= abs(drift) <= ALLOWED_DRIFT
            loop = f'{before:.5f} ms | {after:.5f} ms | {drift:+.4%}'
        print(f'| {name} | {mean_kb(early, "VmRSS") / 1024.0:.1f} MiB '
              f'| {mean_kb(late, "VmRSS") / 1024.0:.1f} MiB | {growth["VmRSS"]:+.2%} '
              f'| {growth["RssAnon"]:+.2%} | {loop} |')
    return good


def main():
    """Run and judge."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--seconds', type=float, default=3600.0)
    parser.add_argument('--valve', choices=('ppr', 'hsv'), default='ppr')
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        plan = make_plan(experiment_text(args.seconds), 'dmsp_5_300_realistic',
                         f'sofc_{args.valve}', args.valve, str(Path(folder) / 'bag'))
        result = session.Result(str(Path(folder) / 'bag'))
        try:
            with termination_as_interrupt(), session.RigSession(plan) as rig:
                samples = Samples(rig, args.seconds)
                session.run_guarded(rig, result, samples.note)
        finally:
            plan.remove()
    good = judge(samples) and not result.failure and not result.findings and result.complete
    print(f'\n{result.duration_s:.0f} s, {sum(result.recorded.values())} messages recorded of '
          f'{sum(result.published.values())}')
    for problem in filter(None, (result.failure, *result.findings)):
        print(problem)
    return 0 if good else 1


if __name__ == '__main__':
    sys.exit(main())
