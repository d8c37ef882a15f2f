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
Hold a force law near a measured shape against muscles held at few lengths, each length left out.

Run ``python benchmarks/held_lengths.py FOLDER [--write]`` with a clone of
github.com/Agile-and-Adaptive-Robotics/Muscle_Sensory. It states no licence and is not part of this
project. Ten fluidic muscles of 10 and 20 mm were held at three or four lengths, and filled and
emptied in pulses. Columns of its files are force [N], pressure [kPa gauge] and time [s]. Lengths
are those of its files ``10mm_Optimization_BPAParameters.txt`` and ``20mm_…``.

Each length is left out in turn and foretold from the others. Straight lines between lengths and a
free fit of the law ``sarosi`` are held against ``pam_sim.muscle.fit_shape``, which ``pam
characterise`` and ``pam rig new`` use. Errors are rms over the points that pull, in percent of the
largest force.
"""

import argparse
from dataclasses import replace
from functools import partial
from pathlib import Path
import sys
from typing import NamedTuple

from isometric_records import print_bounds
import numpy as np
from pam_sim.characterise.held import held_table
from pam_sim.characterise.tables import map_of
from pam_sim.errors import InputError
from pam_sim.muscle.fit import fit_law, judge
from pam_sim.muscle.fit_shape import left_out_percent, near_shape
from pam_sim.run import Run, Series
from pam_sim.units import P_ATM_PA
import results_page

DATA = 'BPA_Static_Characterization_Test/DataCollection/AllData_raw_csv'
TESTS = 'Test9', 'Test10'
ENDINGS = '.csv', 'Data.csv'
BAR_PERCENT = 5.0


class Muscle(NamedTuple):
    """A muscle: bore, length in its file names, length at rest, {kink in them: held length}."""

    bore_mm: int
    cut_cm: int
    length_mm: float
    held_mm: dict[int, float]


MUSCLES = (
    Muscle(10, 13, 120.0, {0: 120.0, 4: 116.0, 8: 112.0, 12: 108.0}),
    Muscle(10, 23, 220.0, {0: 220.0, 14: 205.0, 30: 189.0}),
    Muscle(10, 27, 257.0, {0: 257.0, 7: 250.0, 15: 242.0, 31: 226.0}),
    Muscle(10, 29, 281.0, {0: 281.0, 17: 264.0, 28: 253.0, 41: 240.0}),
    Muscle(10, 30, 281.0, {0: 281.0, 12: 269.0, 22: 259.0, 33: 248.0}),
    Muscle(20, 10, 98.0, {0: 98.0, 13: 85.0, 20: 78.0}),
    Muscle(20, 12, 120.0, {0: 120.0, 10: 110.0, 20: 100.0}),
    Muscle(20, 23, 225.0, {0: 225.0, 9: 219.0, 19: 209.0}),
    Muscle(20, 30, 274.0, {0: 274.0, 14: 261.0, 23: 252.0, 34: 241.0}),
    Muscle(20, 40, 398.0, {0: 398.0, 35: 362.0, 46: 351.0, 69: 328.0}),
)


def recording(path):
    """Return the Run of a file."""
    rows = np.loadtxt(path, delimiter=',')[:, :3]
    force, kpa, time_s = rows[np.isfinite(rows).all(axis=1)].T
    # Times are written to 1 ms; where two rows share one, the first counts.
    _, first = np.unique(time_s, return_index=True)
    stamp_ns = np.round(1e9 * time_s[first]).astype(np.int64)
    return Run({'pressure': Series(stamp_ns, {'pressure_pa': 1e3 * kpa[first] + P_ATM_PA}),
                'force': Series(stamp_ns, {'force_n': force[first]})}, {}, '/muscle', path.name)


def points_of(folder, muscle):
    """
    Return the ForceMap of a muscle.

    Raises
    ------
    InputError
        A file is missing.

    """
    runs, held_m = [], []
    for kink_mm, held_mm in muscle.held_mm.items():
        kink = f'Kinked{kink_mm}mm' if kink_mm else 'Unkinked'
        for test in TESTS:
            stem = f'{muscle.bore_mm}mm_{muscle.cut_cm}cm_{kink}_{test}'
            paths = [path for ending in ENDINGS
                     if (path := Path(folder) / DATA / f'{stem}{ending}').is_file()]
            if not paths:
                raise InputError('is missing; see the first lines of this program',
                                 str(Path(folder) / DATA / f'{stem}.csv'))
            runs.append(recording(paths[0]))
            held_m.append(1e-3 * (muscle.length_mm - held_mm))
    table, _ = held_table(runs, held_m)
    return map_of(table, 1e-3 * muscle.length_mm)


def straight(points, pressure, strain):
    """Return the force on straight lines between points and between lengths."""
    lengths = np.unique(points.strain)
    at_length = []
    for one in lengths:
        mine = np.flatnonzero(points.strain == one)
        mine = mine[np.argsort(points.pressure_gauge_pa[mine])]
        at_length.append(np.interp(pressure, points.pressure_gauge_pa[mine], points.force_n[mine]))
    at_length = np.array(at_length)
    return np.array([np.interp(e, lengths, column) for e, column in zip(strain, at_length.T)])


def of_lines(others, there):
    """Return the error [N] of straight lines."""
    return float(np.sqrt(np.mean((straight(
        others, there.pressure_gauge_pa, there.strain) - there.force_n) ** 2)))


def of_free_fit(others, there):
    """Return the error [N] of a free fit."""
    return judge(fit_law('sarosi', others).law, there).rmse_n


def shown(errors):
    """Return errors in a cell, from the full length on."""
    return ', '.join('refused' if np.isnan(one) else f'{one:.1f}' for one in errors)


def summary(name, errors):
    """Return a row: median, worst and how many are within the bar, by place of the length."""
    cells = []
    for chosen in ([e[0] for e in errors], [x for e in errors for x in e[1:-1]],
                   [e[-1] for e in errors]):
        known = [one for one in chosen if np.isfinite(one)]
        within = sum(one <= BAR_PERCENT for one in known)
        cells.append(f'{np.median(known):.1f}, {max(known):.0f}, {within} of {len(chosen)}')
    return f'| {name} | ' + ' | '.join(cells) + ' |'


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('folder', nargs='?', default='.')
    results_page.add_write(parser, 'held_lengths')
    return parser


def show(args):
    """Print the tables; exit code 2 without the records."""
    try:
        maps = {f'{m.bore_mm} mm, cut at {m.cut_cm} cm': points_of(args.folder, m)
                for m in MUSCLES}
    except InputError as mistake:
        print(f'held_lengths: {mistake}', file=sys.stderr)
        return 2
    methods = {'straight lines between lengths': partial(left_out_percent, off_n=of_lines),
               '`sarosi`, free fit': partial(left_out_percent, off_n=of_free_fit),
               'near the shape of a DMSP-10-250': left_out_percent}
    found = {name: [method(points) for points in maps.values()]
             for name, method in methods.items()}
    print('| muscle | contractions held, % | largest force, N | all lengths known, rms % | '
          + ' | '.join(methods) + ' |\n' + '|---' * (4 + len(methods)) + '|')
    for k, (name, points) in enumerate(maps.items()):
        held = ', '.join(f'{100.0 * one:.1f}' for one in np.unique(points.strain))
        print(f'| {name} | {held} | {points.force_n.max():.0f} '
              f'| {near_shape(points).rmse_percent:.1f} | '
              + ' | '.join(shown(rows[k]) for rows in found.values()) + ' |')
    print('\n| median, worst, within 5 % | full length | between others | shortest |\n'
          '|---|---|---|---|')
    for name, errors in found.items():
        print(summary(name, errors))
    print_bounds([(replace(points, name=name), '') for name, points in maps.items()])
    return 0


if __name__ == '__main__':
    sys.exit(results_page.run(command_line(), __file__, show))
