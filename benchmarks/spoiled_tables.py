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
What `pam import` makes of spoiled text files, and of one of 2 GB.

    python benchmarks/spoiled_tables.py                         # 100 files, then 2 GB
    python benchmarks/spoiled_tables.py --number 500 --gigabytes 0
    python benchmarks/spoiled_tables.py --kinds unseen --number 60 --gigabytes 0

The files come from `test/tables`: three recordings whose SI values are known, written in one of
several forms and spoiled in one of the ways of `spoiled_columns.py` and `spoiled_rows.py`. The
judge compares every value and its time in the bag with the truth. With --kinds unseen the ways
are those of `spoiled_unseen.py`.
"""

import argparse
from collections import Counter
import os
from pathlib import Path
import shutil
import subprocess
import sys
import tempfile
import time

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / 'test' / 'tables'), str(ROOT), str(ROOT / 'benchmarks')]

from pam_actuation.bags.load import load_run  # noqa: E402, I100
import results_page  # noqa: E402
import spoiled_judge  # noqa: E402

ROWS_OF_PIECE = 500_000
STEP_S = 1e-3
EVERY = 100                  # rows of which one is kept
MOST_SHOWN = 160             # characters of a sentence in the table


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--number', type=int, default=100, help='files')
    parser.add_argument('--seed', type=int, default=2026)
    parser.add_argument('--kinds', choices=('known', 'unseen'), default='known')
    parser.add_argument('--gigabytes', type=float, default=2.0, help='0 leaves the long file out')
    results_page.add_write(parser, 'spoiled_tables')
    return parser


def main():
    """Spoil, import, judge."""
    args = command_line().parse_args()
    kinds = spoiled_judge.KINDS
    if args.kinds == 'unseen':
        import spoiled_unseen
        kinds = spoiled_unseen.KINDS
    with results_page.printed(args, __file__, '' if args.kinds == 'known' else args.kinds):
        show(args, kinds)
        if args.gigabytes > 0.0:
            show_long(args.gigabytes)


def show(args, kinds):
    """Print how many files end how, and what was said to the first of each kind."""
    counts, rows, silent = Counter(), {}, []
    with tempfile.TemporaryDirectory() as folder:
        for number, (label, draft) in enumerate(
                spoiled_judge.drafts(args.number, args.seed, kinds)):
            verdict, said = spoiled_judge.judged(draft, Path(folder) / str(number))
            counts[verdict] += 1
            kind = label.partition(',')[0].replace('_', ' ')
            rows.setdefault(kind, []).append((verdict, said))
            if verdict not in spoiled_judge.GOOD:
                silent.append(f'- {label}: {verdict}: {shown(said)}')
    print(f'{args.number} files, {len(rows)} kinds, seed {args.seed}.\n')
    print('| the import ended | files |\n|---|---|')
    for verdict in spoiled_judge.VERDICTS:
        print(f'| {verdict} | {counts[verdict]} |')
    print('\n| kind | ended | said to the first |\n|---|---|---|')
    for kind, ends in rows.items():
        ended = ', '.join(f'{n} {v}' if n > 1 else v for v, n in Counter(
            verdict for verdict, _ in ends).items())
        print(f'| {kind} | {ended} | {shown(ends[0][1])} |')
    if silent:
        print('\n' + '\n'.join(silent))


def shown(text):
    """Return a sentence as a cell of the table."""
    flat = ' '.join(text.removeprefix('pam import: ').split()).replace('|', '¦')
    flat = flat if len(flat) <= MOST_SHOWN else f'{flat[:MOST_SHOWN]}…'
    code = flat.replace('`', "'")
    return f'`{code}`' if code else ''


def write_long(path, size):
    """Write rows of time, pressure, contraction, force and voltage until the size is reached."""
    done = 0
    with open(path, 'w', encoding='utf-8') as stream:
        stream.write('time_s,p_bar,x_mm,F_N,u_V\n')
        while stream.tell() < size:
            for begin in range(done, done + ROWS_OF_PIECE, 50_000):
                time_s = STEP_S * np.arange(begin, begin + 50_000)
                p_bar, x_mm = values_of(time_s)
                stream.write(''.join(
                    f'{t:.3f},{p:.4f},{x:.4f},{40.0 + x:.4f},{p:.4f}\n'
                    for t, p, x in zip(time_s, p_bar, x_mm)))
            done += ROWS_OF_PIECE
    return done


def values_of(time_s):
    """Return pressure [bar gauge] and contraction [mm] at times, as they are written."""
    wave = 1.0 - np.cos(0.37 * time_s)
    return np.round(2.0 * wave, 4), np.round(9.0 * wave, 4)


def imported(folder, *options):
    """Return (exit code, seconds, peak MB, what was said) of an import of its own process."""
    start = time.monotonic()
    program = ('import resource, sys\nfrom pam_actuation.cli.main import main\n'
               'code = main(sys.argv[1:])\n'
               'print("peak", resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)\n'
               'sys.exit(code)\n')
    done = subprocess.run(
        [sys.executable, '-c', program, 'import', 'long.csv', '--out', 'bag', *options],
        cwd=folder, text=True, capture_output=True, check=False, env={
            **os.environ, 'PYTHONPATH': str(ROOT)})
    text = done.stdout + done.stderr
    peak = next(float(line.split()[1]) for line in text.splitlines() if line.startswith('peak '))
    said = ' '.join(line for line in text.splitlines() if line.startswith(('pam ', 'remark')))
    return done.returncode, time.monotonic() - start, peak / 1024.0, said


def show_long(gigabytes):
    """Print time and memory of a long file: refused, thinned, and damaged near its end."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'long.csv'
        rows = write_long(path, gigabytes * 1e9)
        size = path.stat().st_size
        print(f'\nA file of {1e-9 * size:.2f} GB, {1e-6 * rows:.1f} million rows:\n')
        print('| call | exit code | seconds | peak memory [MB] | said |\n|---|---|---|---|---|')
        words = ('--every', str(EVERY))
        for options, is_damaged in (((), False), (words, False), (words, True)):
            if is_damaged:
                with open(path, 'r+b') as stream:
                    stream.seek(int(0.95 * size))
                    stream.write(bytes(4096))
                shutil.rmtree(Path(folder) / 'bag')
            code, seconds, peak, said = imported(folder, *options)
            label = (f'`{" ".join(options)}`' if options else 'as it is') + (
                ', 4096 zero bytes at 95 %' if is_damaged else '')
            print(f'| {label} | {code} | {seconds:.0f} | {peak:.0f} | {shown(said)} |', flush=True)
            if options and not is_damaged:
                right = check_long(Path(folder) / 'bag', rows, EVERY)
        print(f'\nThe thinned bag holds {right}.')


def check_long(bag, rows, every):
    """Return a sentence on how the bag of the long file agrees with what was written."""
    run = load_run(bag)
    pressure, x = run.topics['pressure'], run.topics['contraction']
    time_s = STEP_S * every * np.arange(-(-rows // every))
    p_bar, x_mm = values_of(time_s)
    off_pa = float(np.abs(pressure.values['pressure_pa'] - 101_325.0 - 1e5 * p_bar).max())
    off_m = float(np.abs(x.values['contraction_m'] - 1e-3 * x_mm).max())
    stamps = float(np.abs(np.diff(pressure.stamp_ns) - 1e9 * STEP_S * every).max())
    return (f'{len(pressure.stamp_ns)} of {len(time_s)} rows; values differ by at most '
            f'{off_pa:.2g} Pa and {off_m:.2g} m, steps of time by {stamps:.0f} ns')


if __name__ == '__main__':
    main()
