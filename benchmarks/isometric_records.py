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
Hold every muscle law against isometric records of a 10 mm hose, and print a Markdown table.

Run ``python benchmarks/isometric_records.py FOLDER [--write]``. The records are not part of this
project. They are of a 10 mm fluidic muscle, 25 cm cut (l0 23.3 cm, 19.3 cm at 620 kPa). It is
held at 0, 25, 50 and 75 % of the largest contraction, inflated and deflated in pulses. They come
from github.com/Agile-and-Adaptive-Robotics/Muscle_Sensory, files ``contraction_00.csv`` to
``contraction_75.csv``. Columns are force [N], pressure [kPa gauge], time [s] and phase (1
inflating, 2 deflating). Within a pulse the pressure in the line leads the force, so only plateaus
count. Each length is also left out of the fit in turn, and judged.
"""

import argparse
from pathlib import Path
import sys

import numpy as np
from pam_sim.characterise.beyond import beyond, LEAST_LENGTHS
from pam_sim.errors import InputError
from pam_sim.muscle.fit import CASES, fit_law, judge
from pam_sim.muscle.fit_shape import left_out_percent
from pam_sim.muscle.force_maps import ForceMap, read_force_map, some_points
from pam_sim.muscle.registry import laws, make_law
import results_page

LENGTH_M, SHORTEST_M = 0.233, 0.193
STILL_KPA = 1.5             # spread of the pressure over a plateau window
WINDOW, SHORTEST_RUN = 200, 20
SLACK_N = 3.0               # below: not told apart from the drift of the load cell's zero


def plateaus(path):
    """Return (pressure [Pa], force [N], phase), one row per plateau of a record."""
    force, kpa, _, phase = np.loadtxt(path, delimiter=',').T[:4]
    windows = np.lib.stride_tricks.sliding_window_view(kpa, WINDOW)
    still = np.flatnonzero(windows.std(axis=1) < STILL_KPA)
    rows = []
    for run in np.split(still, np.flatnonzero(np.diff(still) > 1) + 1):
        if len(run) > SHORTEST_RUN:
            part = slice(run[0], run[-1] + WINDOW)
            rows.append((1e3 * kpa[part].mean(), force[part].mean(), phase[run[0]]))
    return np.array(rows)


def read_records(folder):
    """
    Return (ForceMap of all plateaus, phases).

    Raises
    ------
    InputError
        The folder does not hold the four records.

    """
    parts, strains = [], []
    for percent in (0, 25, 50, 75):
        path = Path(folder) / f'contraction_{percent:02d}.csv'
        if not path.is_file():
            raise InputError('is missing; see the first lines of this program', str(path))
        parts.append(plateaus(path))
        strains.append(np.full(len(parts[-1]),
                               percent / 100.0 * (1.0 - SHORTEST_M / LENGTH_M)))
    pressure, force, phase = np.concatenate(parts).T
    return ForceMap('isometric 10 mm', LENGTH_M, pressure, np.concatenate(strains), force,
                    force < SLACK_N), phase


def table(points):
    """Return ({label: Fit} of the laws fitted to the plateaus, best first; {label: refusal})."""
    fits, refused = {}, {}
    for label, (law, muscle, fixed) in CASES.items():
        try:
            fits[label] = fit_law(law, points, muscle, fixed)
        except InputError as refusal:
            refused[label] = str(refusal)
    return dict(sorted(fits.items(), key=lambda item: item[1].rmse_n)), refused


def unfitted(points):
    """Return {law, set: Fit} of the sets for 10 mm muscles as they stand."""
    return {f'{name}, {chosen}': judge(make_law(name, muscle=chosen), points)
            for name, law in laws().items() for chosen in law.SETS if 'dmsp_10' in chosen}


def left_out(points):
    """
    Return {label: ((rms, worst), …)} [% of the largest force], one pair for each length.

    Each law is fitted to the other lengths. A pair is None where the best fit is refused.
    """
    largest, found = float(points.force_n.max()), {}
    for label, (law, muscle, fixed) in CASES.items():
        found[label] = []
        for strain in np.unique(points.strain):
            left = points.strain == strain
            try:
                fit = judge(fit_law(law, some_points(points, ~left), muscle, fixed).law,
                            some_points(points, left))
            except InputError:
                found[label].append(None)
                continue
            found[label].append((100.0 * fit.rmse_n / largest, 100.0 * fit.max_error_n / largest))
    return found


def print_bounds(records):
    """
    Print the bounds of `pam characterise` for the force at longer lengths, and how many hold.

    Parameters
    ----------
    records : list of (ForceMap, str)
        Records, and the shape that is not used because it is that of the muscle.

    """
    print('\n| record | fitted from | judged at | bounds, N | measured, N |\n'
          '|---|---|---|---|---|')
    held = []
    for points, own in records:
        strains = np.unique(points.strain)
        for count in range(1, len(strains) - LEAST_LENGTHS + 1):
            kept = some_points(points, points.strain >= strains[count] - 1e-9)
            for strain in strains[:count]:
                there = beyond(kept, float(strain), own)
                if there is None:
                    continue
                at = np.flatnonzero(points.strain == strain)
                at = at[np.argmax(points.pressure_gauge_pa[at])]
                held.append(there.low_n <= points.force_n[at] <= there.high_n)
                print(f'| {points.name} | {100.0 * strains[count]:.1f} % '
                      f'| {100.0 * strain:.1f} % | {there.low_n:.0f} to {there.high_n:.0f} '
                      f'| {points.force_n[at]:.0f} |')
    print(f'\n{sum(held)} of {len(held)} bounds hold the measured force.')


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('folder', nargs='?', default='.')
    results_page.add_write(parser, 'real_records')
    return parser


def show(args):
    """Print the tables; exit code 2 without records."""
    try:
        points, phase = read_records(args.folder)
    except InputError as mistake:
        print(f'isometric_records: {mistake}', file=sys.stderr)
        return 2
    print(f'{len(phase)} plateaus, {int((phase == 1).sum())} inflating, '
          f'{int(points.censored.sum())} without force, up to {points.force_n.max():.0f} N')
    fitted, refused = table(points)
    for title, fits in (('fitted', fitted), ('as it stands', unfitted(points))):
        print(f'\n| law, {title} | RMSE, N | % of the largest force | worst, N | false force, N |')
        print('|---|---|---|---|---|')
        for label, fit in fits.items():
            print(f'| {label} | {fit.rmse_n:.1f} | {fit.rmse_percent:.2f} '
                  f'| {fit.max_error_n:.1f} | {fit.false_force_n:.1f} |')
    for label, refusal in refused.items():
        print(f'\n{label}: the best fit is refused: {refusal}')
    lengths = [f'{100.0 * one / points.strain.max() * 0.75:.0f} %' for one in np.unique(
        points.strain)]
    print('\n| law, rms (worst) at the length that was not fitted, % of the largest force | '
          + ' | '.join(f'{one} left out' for one in lengths) + ' |')
    print('|---|' + '---|' * len(lengths))
    for label, pairs in left_out(points).items():
        cells = ('refused' if one is None else f'{one[0]:.1f} ({one[1]:.1f})' for one in pairs)
        print(f'| {label} | ' + ' | '.join(cells) + ' |')
    print('| near the shape of a DMSP-10-250, rms | '
          + ' | '.join(f'{one:.1f}' for one in left_out_percent(points)) + ' |')
    print_bounds([(points, ''), (read_force_map('dmsp_10_250'), 'dmsp_10_250_map'),
                  (read_force_map('dmsp_20_300'), 'dmsp_20_300_map')])
    return 0


if __name__ == '__main__':
    sys.exit(results_page.run(command_line(), __file__, show))
