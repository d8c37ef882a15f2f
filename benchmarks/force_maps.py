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
Hold every muscle law against the measured maps of a DMSP-10-250 and a DMSP-20-300.

Run ``python benchmarks/force_maps.py``; it prints the tables of docs/reference/muscle_laws.md.
"""

from pam_sim.muscle.fit import fit_table, judge
from pam_sim.muscle.force_maps import read_force_map
from pam_sim.muscle.registry import make_law

# Sets that mean the size of the map, as published or chosen, without any fit.
UNFITTED = {
    'dmsp_10_250': (('sarosi', 'dmsp_10'), ('chou_hannaford', 'dmsp_10'),
                    ('tondu_lopez', 'dmsp_10_constant_k'), ('situm_herceg', 'dmsp_10'),
                    ('inoue_pair', 'dmsp_10')),
    'dmsp_20_300': (('sarosi', 'dmsp_20_200n'), ('sarosi', 'dmsp_20_400n'),
                    ('chou_hannaford', 'dmsp_20'), ('tondu_lopez', 'dmsp_20_constant_k'),
                    ('situm_herceg', 'dmsp_20'), ('inoue_pair', 'dmsp_20')),
}


def row(label, fit):
    """Return one line of a Markdown table."""
    return (f'| {label} | {fit.rmse_n:.1f} | {fit.rmse_percent:.2f} | {fit.max_error_n:.1f} | '
            f'{fit.false_force_n:.1f} |')


def main():
    """Print a fitted and an unfitted table per map."""
    for name, fits in fit_table().items():
        points = read_force_map(name)
        tables = {'fitted': [row(label, fit) for label, fit in fits.items()],
                  'as they stand': [row(f'{law}, {muscle}',
                                        judge(make_law(law, None, muscle), points))
                                    for law, muscle in UNFITTED[name]]}
        for title, rows in tables.items():
            print(f'\n{name}, {title}: {int((~points.censored).sum())} measured points, '
                  f'{int(points.censored.sum())} censored, largest {points.force_n.max():g} N\n')
            print('| law | RMSE, N | RMSE, % of largest | worst, N | false force, N |')
            print('|---|---|---|---|---|')
            print('\n'.join(rows))
        for label, fit in fits.items():
            print(label, {key: float(f'{value:.4g}') for key, value in fit.law.values.items()})


if __name__ == '__main__':
    main()
