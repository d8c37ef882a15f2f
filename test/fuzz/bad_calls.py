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
Wrong calls of the command line of every kind, each the same in every run.

::

    python test/fuzz/bad_calls.py --count 300 [--seed N]

Every call has to end with exit code 2 and one line that names the place, without a traceback,
and must neither write nor delete anything in a folder full of valuable things. The program
prints a table per verb and exits with 1 otherwise.
"""

import argparse
from collections import Counter
import contextlib
from dataclasses import dataclass, field
import io
import os
from pathlib import Path
import random
import signal
import subprocess
import sys
import tempfile
import time
import traceback

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(Path(__file__).resolve().parent)]   # the tree as it stands

from bad_call_kinds import COMBINATIONS, VALUES, VERBS  # noqa: E402
from bad_call_place import changes, clear, look, prepare  # noqa: E402
from pam_actuation.cli.main import main as pam  # noqa: E402
from pam_sim.generated import cache_folder  # noqa: E402

LONGEST_LINE = 2500     # of which names to choose from take most
PROCESSES = 24          # of the calls are made again as real processes
PROCESS_TIMEOUT_S = 120.0
CALL_TIMEOUT_S = 120.0   # long enough to compile, on a busy machine


@dataclass(frozen=True)
class Call:
    """One wrong call: words on the command line, what is wrong, words that name the place."""

    arguments: tuple
    wrong: str
    places: tuple = ()

    @property
    def verb(self):
        """Return the verb, '-' without one."""
        first = self.arguments[0] if self.arguments else '-'
        return first if first in VERBS else '-'


@dataclass
class Outcome:
    """What a run of calls came to: per verb calls, kinds of mistakes; sentences on bad ones."""

    calls: Counter = field(default_factory=Counter)
    kinds: dict = field(default_factory=dict)
    bad: list = field(default_factory=list)

    def table(self):
        """Return a table per verb as text."""
        rows = [('verb', 'calls', 'kinds of mistakes', 'exit code 2, one line, nothing touched')]
        for verb in sorted(self.calls):
            bad = sum(call.verb == verb for call, _ in self.bad)
            rows.append((verb, str(self.calls[verb]), str(len(self.kinds[verb])),
                         str(self.calls[verb] - bad)))
        widths = [max(len(row[k]) for row in rows) for k in range(4)]
        return '\n'.join('  '.join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip()
                         for row in rows)


def make(number, seed=0):
    """Return the wrong Call of a number."""
    rng = random.Random(f'{seed} {number}')
    if rng.random() < 0.1:
        arguments = rng.choice(COMBINATIONS)
        return Call(arguments, 'combination')
    verb = sorted(VERBS)[number % len(VERBS)]
    slots = rng.choice(VERBS[verb])
    wrong = rng.choice([slot for slot in slots if slot.kind in VALUES])
    value = rng.choice(VALUES[wrong.kind])
    words = [word for slot in slots
             for word in slot.arguments(value if slot is wrong else slot.good)]
    places = [wrong.flag.lstrip('-')] if wrong.flag else []
    places += filter(None, (value[:20].strip(), Path(value[:200]).name[:20]))
    if value in ('', ' ') or '\0' in value or '\n' in value or '~' in value:
        places.append('')       # nothing to name
    json = ['--json'] if rng.random() < 0.1 else []
    return Call((verb, *words, *json), wrong.kind, tuple(places))


@contextlib.contextmanager
def time_limit(seconds):
    """Raise LookupError in a block that takes longer, also where it waits for a pipe."""
    def ring(number, frame):
        raise LookupError(f'took more than {seconds:g} s')

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def in_this_process(arguments):
    """Return (exit code, what was said on stderr, traceback or '') of one call."""
    said, shown, raised = io.StringIO(), io.StringIO(), ''
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(shown):
        try:
            with time_limit(CALL_TIMEOUT_S):
                code = pam(list(arguments))
        except SystemExit as ended:
            code = ended.code
        except BaseException:
            code, raised = None, traceback.format_exc()
    return code, said.getvalue(), raised or (
        shown.getvalue() if 'Traceback' in shown.getvalue() else '')


def in_a_process(arguments):
    """Return the same of a process of its own."""
    environment = dict(os.environ, PYTHONPATH=str(ROOT), ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST')
    done = subprocess.run(
        [sys.executable, '-m', 'pam_actuation.cli.main', *arguments], env=environment,
        capture_output=True, text=True, timeout=PROCESS_TIMEOUT_S, check=False,
        stdin=subprocess.DEVNULL)
    return done.returncode, done.stderr, done.stdout if 'Traceback' in done.stdout else ''


def judge(call, code, said, raised):
    """Return what is wrong with the answer to a wrong call, '' if nothing is."""
    line = said.strip()
    if raised or 'Traceback' in said:
        return f'traceback: {(raised or said).strip()[-400:]}'
    if code != 2:
        return f'exit code {code}: {line[-300:]}'
    if not line or '\n' in line or len(line) > LONGEST_LINE:
        return f'not one line: {line[:300]!r}'
    if call.places and not any(place in line for place in call.places):
        return f'does not name the place ({call.places}): {line}'
    return ''


def run(count, seed=0, processes=PROCESSES, progress=None):
    """
    Make ``count`` wrong calls, then some of them again as real processes.

    Returns
    -------
    Outcome

    """
    outcome, before = Outcome(), os.getcwd()
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as elsewhere:
        root = Path(folder).resolve()
        here = prepare(root)
        environment = dict(os.environ)
        # What programs keep for themselves is no result of a call.
        os.environ.setdefault('PAM_CACHE_DIR', str(cache_folder()))
        os.environ.update(HOME=str(root / 'home'), XDG_CACHE_HOME=elsewhere, ROS_HOME=elsewhere,
                          ROS_LOG_DIR=elsewhere)
        os.chdir(here)
        try:
            there = look(root)
            calls = [make(number, seed) for number in range(count)]
            again = calls[::max(count // processes, 1)][:processes] if processes else []
            again = [one for one in again if '\0' not in ''.join(one.arguments)]
            for k, call in enumerate([*calls, *again]):
                how = in_this_process if k < count else in_a_process
                found = judge(call, *how(call.arguments))
                touched = changes(there, look(root))
                if touched:
                    found = f'{found}; touched {touched}'
                    clear(root, there)
                    there = look(root)
                if found:
                    outcome.bad.append((call, found))
                outcome.calls[call.verb] += 1
                outcome.kinds.setdefault(call.verb, set()).add(call.wrong)
                if progress:
                    progress(k, call)
        finally:
            os.chdir(before)
            os.environ.clear()
            os.environ.update(environment)
    return outcome


def main():
    """Run the program; return 1 where an answer should not be."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('--count', type=int, default=300)
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--processes', type=int, default=PROCESSES,
                        help='calls made again as real processes')
    parser.add_argument('--verbose', action='store_true', help='print every call')
    args = parser.parse_args()
    started = time.perf_counter()

    def tell(k, call):
        if args.verbose:
            print(k, ' '.join(map(ascii, call.arguments))[:200], file=sys.stderr)

    outcome = run(args.count, args.seed, args.processes, tell)
    for call, found in outcome.bad:
        print(f'pam {" ".join(map(ascii, call.arguments))[:300]}\n    {found}')
    print(outcome.table())
    print(f'{sum(outcome.calls.values())} calls in {time.perf_counter() - started:.0f} s, '
          f'{len(outcome.bad)} answered wrongly')
    return 1 if outcome.bad else 0


if __name__ == '__main__':
    sys.exit(main())
