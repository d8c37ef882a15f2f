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
Unknown numbers in short records with few moves: rigs made by an independent simulator.

    python benchmarks/few_moves_unknown.py                   # 40 records for `pam identify`
    python benchmarks/few_moves_unknown.py --seed 7 --number 10 --gap 10

The records are those of ``few_moves.py``: one or two steps up and one down. Mass, spring and zero
of the pressure sensor are unknown, and the lag of the regulator is known to 50 %. Four rigs of
five have an effect more. With two of them the regulator does what no effect of the library says:
it swings, or it is slower the more air it moves. There is no load cell.

With --gap N the first N records are given to `pam gap` too. It must name no effect that is not
hidden. Where the regulator does what has no name, no name of the valve is right.
"""

import argparse
from pathlib import Path
import sys

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / 'test' / 'hidden'), str(ROOT), str(ROOT / 'benchmarks')]

import few_moves  # noqa: E402, I100
from pam_actuation.report.gap import gap_of  # noqa: E402
from pam_sim import load_rig  # noqa: E402
from pam_sim.effects.registry import effects  # noqa: E402
from pam_sim.identify import identify  # noqa: E402
from pam_sim.tolerance import UNKNOWN  # noqa: E402
import results_page  # noqa: E402
import truth_effects  # noqa: E402
import unknown_numbers as whole  # noqa: E402

UNKNOWN_NAMES = 'mass_kg', 'spring_n_per_m', 'pressure_zero_pa'
LAG_S, LAG_SD = 0.06, 0.5
MODEL = load_rig(whole.NOMINAL).with_(
    tolerance={**dict.fromkeys(UNKNOWN_NAMES, UNKNOWN), 'T_m': LAG_SD})
KINDS = 'none', 'creep', 'valve_dead_time + flow_limit', 'swings', 'slower when full'
NAMES = {'none': [], 'swings': ['regulator_overshoot'], 'slower when full': []}     # else: its own
TOPICS = 'pressure', 'contraction', 'valve_signal'
SCALES = 0.5, 1.2            # times the usual size


def draw(seed, place):
    """Return (true numbers by name, numbers of the rig, bias of the pressure [Pa], kind)."""
    rng = np.random.default_rng([seed, place])
    kind = KINDS[place % len(KINDS)]
    true = {name: float(rng.uniform(*whole.NUMBERS[name][1:])) for name in UNKNOWN_NAMES}
    numbers = {n: value * (1.0 + sd * float(np.clip(rng.standard_normal(), -2.0, 2.0)))
               for n, (value, sd) in whole.TOLERANCE.items()}
    numbers |= {'mass': true['mass_kg'], 'spring': true['spring_n_per_m'],
                't_m': LAG_S * float(rng.uniform(1.0 - LAG_SD, 1.0 + LAG_SD))}
    if kind == 'swings':
        numbers |= {'resonance_hz': float(rng.uniform(2.0, 5.0)),
                    'resonance_damping': float(rng.uniform(0.3, 0.6))}
    elif kind == 'slower when full':
        numbers['full_slow'] = float(rng.uniform(1.0, 3.0))
    else:
        for name in names_of(kind):
            numbers |= truth_effects.EFFECTS[name].draw(
                rng, float(rng.uniform(*SCALES)), 'ppr').numbers
    return true, numbers, true['pressure_zero_pa'], kind


def names_of(kind):
    """Return the names that are right for a kind of rig."""
    return NAMES.get(kind, kind.split(' + '))


def recorded(seed, place, numbers, bias_pa):
    """Return what a rig records of its few moves, as a Run."""
    rng = np.random.default_rng([seed, place, 1])
    return whole.record(numbers, few_moves.experiment(rng), rng, {'pressure_bias': bias_pa},
                        TOPICS)


def rows_of(run, true, kind, place):
    """Return one row per unknown number: what is said of it, and whether that is true."""
    found = identify(run, MODEL, advise=False)
    rows = []
    for name, value in true.items():
        one = next((f for f in found.found if f.number.name == name), None)
        if one is None:
            rows.append({'case': place, 'kind': kind, 'number': name, 'true': value,
                         'low': '–', 'high': '–', 'status': 'not shown', 'holds': True})
            continue
        i = one.interval
        holds = (i.open_low or i.low <= value) and (i.open_high or value <= i.high)
        rows.append({'case': place, 'kind': kind, 'number': name, 'true': value,
                     'low': i.low, 'high': i.high, 'status': one.status, 'holds': bool(holds)})
    return rows


def named(run, kind, place):
    """Return what `pam gap` names on a record."""
    found = gap_of([run], MODEL, seconds=600.0)
    likely = {*(one['name'] for one in found.effects), *found.ambiguity_set} & set(effects())
    sure = {one['name'] for one in found.effects} - (
        set(found.ambiguity_set) if len(found.ambiguity_set) > 1 else set())
    right = names_of(kind)
    return {'case': place, 'kind': kind, 'verdict': found.verdict,
            'names': ', '.join(sorted(likely)) or '–',
            'wrong': bool(likely) and not likely & set(right),
            'besides': ', '.join(sorted(sure - set(right))) or '–',
            'sensor': any(effects()[name].subsystem == 'sensor' for name in likely)}


def shares(rows):
    """Return in a table how many intervals hold the true value, by kind and by number."""
    lines = ['| | intervals that hold | called determined | determined and wrong |',
             '|---|---|---|---|']
    groups = [('all', rows)]
    groups += [(kind, [r for r in rows if r['kind'] == kind]) for kind in KINDS]
    groups += [(f'`{name}`', [r for r in rows if r['number'] == name]) for name in UNKNOWN_NAMES]
    for title, chosen in groups:
        if chosen:
            held = sum(r['holds'] for r in chosen)
            known = [r for r in chosen if r['status'] == 'determined']
            lines.append(f'| {title} | {held} of {len(chosen)} '
                         f'({100.0 * held / len(chosen):.0f} %) | {len(known)} | '
                         f'{sum(not r["holds"] for r in known)} |')
    return '\n'.join(lines)


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--seed', type=int, default=2026)
    parser.add_argument('--number', type=int, default=40, help='records')
    parser.add_argument('--gap', type=int, default=0, help='records that `pam gap` answers')
    results_page.add_write(parser, 'few_moves')
    return parser


def main():
    """Answer all records and print the tables."""
    args = command_line().parse_args()
    with results_page.printed(args, __file__):
        rows, looks = [], []
        for place in range(args.number):
            true, numbers, bias_pa, kind = draw(args.seed, place)
            run = recorded(args.seed, place, numbers, bias_pa)
            rows += rows_of(run, true, kind, place)
            if place < args.gap:
                looks.append(named(run, kind, place))
                print(looks[-1], file=sys.stderr, flush=True)
            for row in rows[-len(true):]:
                print(row, file=sys.stderr, flush=True)
        print(f'{args.number} records, seed {args.seed}.\n\n{shares(rows)}\n')
        missed = [r for r in rows if not r['holds']]
        if missed:
            print('Missed:\n\n' + whole.table(missed, tuple(missed[0])) + '\n')
        if looks:
            print(f'`pam gap` on the first {len(looks)}:\n\n'
                  + whole.table(looks, tuple(looks[0])))
            print(f'\n- wrong names: {sum(r["wrong"] for r in looks)} of {len(looks)}\n'
                  f'- errors of a sensor named: {sum(r["sensor"] for r in looks)} of '
                  f'{len(looks)}')


if __name__ == '__main__':
    main()
