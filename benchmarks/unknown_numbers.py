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
How often the intervals of `pam identify` hold the true numbers: rigs of an independent simulator.

    python benchmarks/unknown_numbers.py                     # 60 cases
    python benchmarks/unknown_numbers.py --number 20 --undetermined 10 --minutes 15

The hidden rig is the one of `test/hidden`: its air, friction, memory and creep have other
formulations than the library. In each case one or two numbers differ from the rig file by up to
half of the value. They are mass, spring, gain of the regulator, zero of pressure or contraction.
Every second case hides an effect as well. The other numbers of the hidden rig are off within their
tolerance.

With --undetermined N as many cases follow that cannot determine a number. Examples are a load that
never lifts, a valve without command and a load cell that was not recorded. There the answer
must say so and name an experiment; the experiment is run on the hidden rig and answered as well.

With --gap N the first N cases are given to `pam gap`, with the same numbers unknown. It must name
neither an effect that is not hidden nor an error of a sensor.

With --beside the tables are those of a second seed, and stand beside the ones of the first.
"""

import argparse
import os
from pathlib import Path
import sys
import time

os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')       # as `pam` does

import numpy as np  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / 'test' / 'hidden'), str(ROOT), str(ROOT / 'benchmarks')]

from pam_actuation.report.gap import gap_of  # noqa: E402, I100
from pam_sim import load_rig  # noqa: E402
from pam_sim.effects.registry import effects  # noqa: E402
from pam_sim.gap.data.signals import FIELD, UNIT  # noqa: E402
from pam_sim.gap.fit.profile import NORMAL_95  # noqa: E402
from pam_sim.gap.verify.uncertainty import NUMERICS  # noqa: E402
from pam_sim.identify import identify  # noqa: E402
from pam_sim.run import Run, Series  # noqa: E402
from pam_sim.tolerance import UNKNOWN  # noqa: E402
import results_page  # noqa: E402
import truth_commands  # noqa: E402
import truth_effects  # noqa: E402
import truth_rig  # noqa: E402
import truth_run  # noqa: E402
import truth_sensors  # noqa: E402

NOMINAL = 'dmsp_5_300_hanging_mass'
# Name here -> name of the hidden rig (or of the change of a sensor), low and high true value.
NUMBERS = {'mass_kg': ('mass', 3.0, 7.0), 'spring_n_per_m': ('spring', 100.0, 800.0),
           'K_m': ('k_m', 80e3, 125e3), 'pressure_zero_pa': ('pressure_bias', -15e3, 15e3),
           'contraction_zero_m': ('contraction_bias', -2e-3, 2e-3)}
UNITS = {'mass_kg': 'kg', 'spring_n_per_m': 'N/m', 'K_m': 'Pa/V', 'pressure_zero_pa': 'Pa',
         'contraction_zero_m': 'm'}
SENSORS = ('pressure_zero_pa', 'contraction_zero_m')
HIDDEN = ('', 'hysteresis', '', 'creep', '', 'valve_dead_time', '', 'coulomb_friction', '',
          'viscous_damping')
TOLERANCE = {'damping': (25.0, 0.02), 't_m': (0.06, 0.02), 'gain_map': (1.0, 0.02)}
# The same of numbers that may be unknown, drawn where they are not.
KNOWN = {'mass': (5.0, 0.02), 'k_m': (100e3, 0.02)}
WITHOUT = (                 # what cannot be determined: unknown number, topics, protocol
    ('mass_kg', ('pressure', 'contraction', 'valve_signal'), 'low'),
    ('K_m', ('pressure', 'contraction', 'force'), 'steps'),
    ('mass_kg', ('pressure', 'valve_signal'), 'steps'),
    ('force_zero_n', ('pressure', 'contraction', 'valve_signal'), 'steps'),
    ('T_m', ('pressure', 'contraction'), 'steps'))
LOW = {'domain': 'pressure', 'segments': [
    {'step': {'to_pa': truth_rig.ATM + p, 'duration_s': 1.0}} for p in (30e3, 60e3, 90e3, 50e3)]}
SET_BY_NUMERICS = 1.3        # times the least half width, up to which nothing else sets it
TRUE_OF = {'T_m': 't_m', 'mass_kg': 'mass', 'K_m': 'k_m'}


def draw(seed, place):
    """Return (true values by name, numbers of the rig, changes of the sensors, effect)."""
    rng = np.random.default_rng([seed, place])
    names = rng.choice(list(NUMBERS), size=1 + place % 2, replace=False)
    true = {str(n): float(rng.uniform(*NUMBERS[n][1:])) for n in names}
    numbers, sensors = off_within(rng, TOLERANCE), {}
    for name, value in true.items():
        (sensors if name in SENSORS else numbers)[NUMBERS[name][0]] = value
    effect = HIDDEN[place % len(HIDDEN)]
    if effect:
        numbers |= truth_effects.EFFECTS[effect].draw(
            rng, float(rng.uniform(0.4, 1.2)), 'ppr').numbers
    return true, off_within(rng, KNOWN) | numbers, sensors, effect


def off_within(rng, nominal):
    """Return numbers off their value by a normal deviate of at most two deviations."""
    return {n: value * (1.0 + sd * float(np.clip(rng.standard_normal(), -2.0, 2.0)))
            for n, (value, sd) in nominal.items()}


def record(numbers, experiment, rng, sensors=None, topics=('pressure', 'contraction', 'force',
                                                           'valve_signal')):
    """Return what the sensors of the hidden rig record of an experiment, as a Run."""
    truth = truth_run.run_rig(numbers, 'ppr', experiment)
    chain = truth_sensors.drawn_chain(rng)
    chain.effects = sensors or {}
    found = truth_sensors.measured(truth.rows, chain, rng, reservoir=False)
    series = {t: Series(np.rint(1e9 * (s + 1.0)).astype(np.int64), {FIELD[t]: v},
                        {FIELD[t]: UNIT[t]}) for t, (s, v) in found.items() if t in topics}
    if 'valve_signal' in topics:
        series['valve_signal'] = Series(np.rint(1e9 * (truth.sent_s + 1.0)).astype(np.int64),
                                        {'ppr_voltage': truth.sent[:, 0]}, {'ppr_voltage': 'V'})
    return Run(series, {}, '/muscle', 'hidden rig')


def case_run(seed, place, numbers, sensors):
    """Return the recording of a case; every second pair of cases has a load cell."""
    rng = np.random.default_rng([seed, place, 1])
    topics = ('pressure', 'contraction', 'valve_signal', *(('force',) if place % 4 < 2 else ()))
    return record(numbers, truth_commands.protocol('steps', int(rng.integers(2**31))), rng,
                  sensors, topics)


def covered(seed, place):
    """Return one row per unknown number of a case: what it is, and whether its interval holds."""
    true, numbers, sensors, effect = draw(seed, place)
    run = case_run(seed, place, numbers, sensors)
    began = time.process_time()
    found = identify(run, load_rig(NOMINAL), list(true), advise=False)
    spent = time.process_time() - began
    rows = []
    for one in found.found:
        i, value = one.interval, true[one.number.name]
        holds = (i.open_low or i.low <= value) and (i.open_high or value <= i.high)
        rows.append({'case': place, 'number': one.number.name, 'effect': effect or 'none',
                     'force': 'force' in run, 'true': value, 'value': one.value,
                     'low': i.low, 'high': i.high, 'status': one.status, 'holds': bool(holds),
                     'seconds': spent})
    return rows


def named(seed, place):
    """Return what `pam gap` names in a case with unknown numbers."""
    true, numbers, sensors, effect = draw(seed, place)
    run = case_run(seed, place, numbers, sensors)
    rig = load_rig(NOMINAL).with_(tolerance=dict.fromkeys(true, UNKNOWN))
    began = time.process_time()
    found = gap_of([run], rig, seconds=600.0)
    likely = {*(one['name'] for one in found.effects), *found.ambiguity_set} & set(effects())
    return {'case': place, 'unknown': ', '.join(true), 'effect': effect or 'none',
            'verdict': found.verdict, 'names': ', '.join(sorted(likely)) or '–',
            'wrong': bool(likely) and effect not in likely,
            'sensor': any(effects()[name].subsystem == 'sensor' for name in likely),
            'seconds': time.process_time() - began}


def left_open(seed, place):
    """Return what was said of a number that a recording cannot determine, and what followed."""
    name, topics, protocol = WITHOUT[place % len(WITHOUT)]
    rng = np.random.default_rng([seed, place, 2])
    numbers = {n: value * (1.0 + sd * float(rng.uniform(-1.0, 1.0)))
               for n, (value, sd) in TOLERANCE.items()}
    numbers |= {'mass': float(rng.uniform(4.0, 6.5)), 'k_m': float(rng.uniform(85e3, 110e3))}
    experiment = LOW if protocol == 'low' else truth_commands.protocol(
        protocol, int(rng.integers(2**31)))
    run = record(numbers, experiment, rng, None, topics)
    # What is not sought is right in the rig file, within its tolerance.
    parameters = {k: numbers[t] for k, t in TRUE_OF.items() if k != name}
    rig = load_rig(NOMINAL).with_(parameters=parameters)
    found = identify(run, rig, [name])
    open_ = name not in {n.number.name for n in found.found} or name in found.open_names
    row = {'case': place, 'number': name, 'topics': '+'.join(topics), 'said': open_,
           'advised': found.next_experiment is not None, 'then': None}
    if found.next_experiment is not None:
        advice = found.next_experiment
        more = dict(numbers)
        more['mass'] += advice['added_kg']
        topics = ('pressure', 'contraction', 'valve_signal',
                  *(('force',) if advice['needs_force'] or name == 'force_zero_n' else ()))
        again = identify([run, record(more, advice['experiment'], rng, None, topics)], rig, [name],
                         [0.0, advice['added_kg']], advise=False)
        row['then'] = name in {n.number.name for n in again.found} and not again.open_names
    return row


def table(rows, columns):
    """Return rows as a table in Markdown."""
    lines = ['| ' + ' | '.join(columns) + ' |', '|' + '---|' * len(columns)]
    for row in rows:
        lines.append('| ' + ' | '.join(
            f'{v:.5g}' if isinstance(v := row[c], float) else
            {True: 'yes', False: 'NO', None: '–'}.get(v, str(v)) if v is None or isinstance(
                v, bool) else str(v) for c in columns) + ' |')
    return '\n'.join(lines)


def shares(rows):
    """Return the coverage in words: all, with and without an effect, and how many determined."""
    lines = []
    for title, chosen in (('all', rows), ('no effect', [r for r in rows if r['effect'] == 'none']),
                          ('an effect', [r for r in rows if r['effect'] != 'none'])):
        if chosen:
            held = sum(r['holds'] for r in chosen)
            known = sum(r['status'] == 'determined' for r in chosen)
            lines.append(f'- {title}: {held} of {len(chosen)} intervals hold the true value '
                         f'({100.0 * held / len(chosen):.0f} %), {known} are determined')
    lines += ['', *scatter(rows), '', '| number | unit | no effect | an effect |',
              '|---|---|---|---|']
    for name in NUMBERS:
        halves = [[0.5 * (r['high'] - r['low']) for r in rows if r['number'] == name and (
            r['effect'] == 'none') is plain] for plain in (True, False)]
        lines.append(f'| {name} | {UNITS[name]} | ' + ' | '.join(
            f'{np.median(half):.3g} ({len(half)})' if half else '–' for half in halves) + ' |')
    lines.append('\nMedian half width of the intervals; in brackets how many there are.')
    seconds = list({r['case']: r['seconds'] for r in rows}.values())
    lines.append(f'\nA case takes {np.median(seconds):.1f} s of processor (median), at most '
                 f'{max(seconds):.1f} s.')
    return '\n'.join(lines)


def scatter(rows):
    """Return a table of errors over the deviation that the interval stands for."""
    def least(row):
        return row['number'] not in SENSORS and (
            row['high'] - row['low'] < 2.0 * SET_BY_NUMERICS * NUMERICS * abs(row['value']))

    lines = ['| intervals | | deviation of the errors | within 68 % | within 95 % |',
             '|---|---|---|---|---|']
    for title, chosen in (('as wide as numerics make them', [r for r in rows if least(r)]),
                          ('wider', [r for r in rows if not least(r)])):
        if chosen:
            z = np.array([
                NORMAL_95 * (r['value'] - r['true']) / max(
                    r['high'] - r['value'] if r['true'] > r['value'] else r['value'] - r['low'],
                    1e-300) for r in chosen])
            lines.append(f'| {title} | {z.size} | {np.sqrt(np.mean(z ** 2)):.2f} | '
                         f'{100.0 * np.mean(np.abs(z) < 1.0):.0f} % | '
                         f'{100.0 * np.mean(np.abs(z) < NORMAL_95):.0f} % |')
    return lines


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--number', type=int, default=60, help='cases (default: 60)')
    parser.add_argument('--first', type=int, default=0, metavar='N',
                        help='case that is the first of --number (default: 0)')
    parser.add_argument('--undetermined', type=int, default=40, metavar='N',
                        help='cases that determine nothing (default: 40)')
    parser.add_argument('--gap', type=int, default=0, metavar='N',
                        help='cases that `pam gap` answers (default: 0; a minute each)')
    parser.add_argument('--seed', type=int, default=2026)
    parser.add_argument('--minutes', type=float, default=float('inf'), metavar='N',
                        help='begin no case after N minutes; the tables say how many there were')
    parser.add_argument('--beside', action='store_true',
                        help='the tables of a second seed, written beside those of the first')
    results_page.add_write(parser, 'unknown_numbers')
    return parser


def main():
    """Answer all cases and print the tables."""
    args = command_line().parse_args()
    until = time.time() + 60.0 * args.minutes
    for count, part, show in ((args.number, '', show_covered),
                              (args.undetermined, 'undetermined', show_open),
                              (args.gap, 'gap', show_named)):
        if count:
            part = f'{part} beside'.strip() if args.beside else part
            with results_page.printed(args, __file__, part):
                show(args, until)


def show_covered(args, until):
    """Print whether the intervals hold the true numbers."""
    rows = []
    for place in range(args.first, args.first + args.number):
        if time.time() > until:
            break
        rows += covered(args.seed, place)
        print(f'case {place}: ' + ', '.join(
            f'{r["number"]} {"holds" if r["holds"] else "MISSES"}' for r in rows
            if r['case'] == place), file=sys.stderr, flush=True)
    print(table(rows, ('case', 'number', 'effect', 'force', 'true', 'value', 'low', 'high',
                       'status', 'holds', 'seconds')))
    print(f'\n{shares(rows)}\n')


def show_open(args, until):
    """Print what is said of numbers that a recording does not determine."""
    rows = []
    for place in range(args.undetermined):
        if time.time() > until:
            break
        rows.append(left_open(args.seed, place))
        print(f'undetermined {place}: {rows[-1]}', file=sys.stderr, flush=True)
    print(table(rows, ('case', 'number', 'topics', 'said', 'advised', 'then')) + '\n')
    for word in ('said', 'advised', 'then'):
        print(f'- {word}: {sum(bool(r[word]) for r in rows)} of {len(rows)}')


def show_named(args, until):
    """Print what `pam gap` names where numbers are unknown."""
    rows = []
    for place in range(args.gap):
        if time.time() > until:
            break
        rows.append(named(args.seed, place))
        print(f'gap {place}: {rows[-1]}', file=sys.stderr, flush=True)
    said = [{**r, 'wrong': 'YES' if r['wrong'] else 'no', 'sensor': 'YES' if r['sensor'] else 'no'}
            for r in rows]
    print(table(said, ('case', 'unknown', 'effect', 'verdict', 'names', 'wrong', 'sensor',
                       'seconds')) + '\n')
    print(f'- wrong names: {sum(r["wrong"] for r in rows)} of {len(rows)}')
    print(f'- errors of a sensor named: {sum(r["sensor"] for r in rows)} of {len(rows)}')


if __name__ == '__main__':
    main()
