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
Check that a replay is the same twice, and the same on two Python versions.

::

    python benchmarks/replay_versions.py BAG --pythons /path/python3.11 /path/python3.12

Each interpreter replays the bag twice, all parts alone and chained. The two times must give
identical bytes (printed JSON and written arrays); between the versions the arrays may differ
by 1e-12 of each signal's largest value. Exit code 1 where they differ more.
"""

import argparse
import hashlib
import os
from pathlib import Path
import subprocess
import sys
import tempfile

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
ALLOWED = 1e-12
WAYS = ((), ('--chain',))


def replay(python, bag, options, out):
    """Replay a bag in a process of its own; return (printed text, bytes of the arrays)."""
    environment = {**os.environ, 'PYTHONPATH': str(ROOT)}
    done = subprocess.run(
        [python, '-m', 'pam_actuation.cli.main', 'replay', str(bag), '--json', '--out',
         str(out), *options], env=environment, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f'{python}: exit code {done.returncode}\n{done.stderr}')
    return done.stdout, out.read_bytes()


def largest_difference(first, second):
    """Return (share of the signal's largest value, name) of the worst array of two files."""
    worst = (0.0, '')
    with np.load(first) as a, np.load(second) as b:
        if a.files != b.files:
            return np.inf, 'other arrays'
        for name in a.files:
            if a[name].shape != b[name].shape:
                return np.inf, f'{name} has another length'
            if np.issubdtype(a[name].dtype, np.integer):
                share = 0.0 if np.array_equal(a[name], b[name]) else np.inf
            else:
                scale = float(np.nanmax(np.abs(a[name]), initial=0.0)) or 1.0
                share = float(np.nanmax(np.abs(a[name] - b[name]), initial=0.0)) / scale
                if not np.array_equal(np.isnan(a[name]), np.isnan(b[name])):
                    share = np.inf
            worst = max(worst, (share, name))
    return worst


def compare(bag, pythons, folder):
    """Print one line per way of replaying a bag; return whether all is as it should be."""
    good = True
    for options in WAYS:
        files, digests = [], []
        for number, python in enumerate(pythons):
            once, again = folder / f'{number}_once.npz', folder / f'{number}_again.npz'
            outputs = [replay(python, bag, options, out) for out in (once, again)]
            same = outputs[0] == outputs[1]
            good = good and same
            files.append(once)
            digests.append(hashlib.sha256(outputs[0][1]).hexdigest()[:12])
            print(f'{bag} {" ".join(options) or "each alone"}, {python}: twice '
                  + ('identical bytes' if same else 'DIFFERENT bytes') + f', {digests[-1]}')
        for number in range(1, len(files)):
            share, name = largest_difference(files[0], files[number])
            good = good and share <= ALLOWED
            equal = digests[0] == digests[number]
            print(f'{bag} {" ".join(options) or "each alone"}, {pythons[0]} against '
                  f'{pythons[number]}: ' + ('identical bytes' if equal else
                                            f'largest difference {share:.3g} of the signal in '
                                            f'{name or "none"}'))
    return good


def main():
    """Compare; return 0, or 1 where a replay is not repeated."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('bags', nargs='*', help='bags (default: the pinned ones of the tests)')
    parser.add_argument('--pythons', nargs='+', default=[sys.executable], metavar='PYTHON',
                        help='interpreters with the dependencies installed')
    args = parser.parse_args()
    bags = args.bags or sorted((ROOT / 'test' / 'replay' / 'pinned').glob('*.mcap'))
    good = True
    for bag in bags:
        with tempfile.TemporaryDirectory() as folder:
            good = compare(bag, args.pythons, Path(folder)) and good
    return 0 if good else 1


if __name__ == '__main__':
    sys.exit(main())
