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
Whether a surrogate of `pam gap` follows a recording that had no part in it.

    python benchmarks/surrogates.py --seed 31627 --work surrogates --write
    python benchmarks/surrogates.py --kinds ripple,bump --valves ppr --nulls 0

The rigs are those of ``proposed_terms.py``: each hides one effect that no library holds, or none.
No term is searched, so that only known effects are left. A recording is searched, a second is the
proof, and a third of another motion judges. Nothing is fitted to it or chosen by it.
"""

import argparse
import math
from pathlib import Path
import sys
import tempfile

import numpy as np
import proposed_terms as terms
import results_page

from pam_sim import load_rig  # noqa: I100
from pam_sim.gap import find_gap
from pam_sim.gap.data.recording import Recording
import truth_sensors

WORSE = 1.05                 # of the error before, beyond the noise


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--kinds', help='only these')
    parser.add_argument('--valves', default='ppr,hsv')
    parser.add_argument('--nulls', type=int, default=20, help='null records (default: 20)')
    parser.add_argument('--seed', type=int, default=31627)
    parser.add_argument('--work', type=Path, help='keep answers here')
    results_page.add_write(parser, 'surrogates')
    return parser


def main():
    """Look at every record and print the table."""
    args = command_line().parse_args()
    results_page.check(args, __file__)
    args.until = math.inf
    tasks = [(kind, valve) for kind in terms.KINDS for valve in terms.both(kind)
             if valve in args.valves.split(',')
             and (args.kinds is None or kind in args.kinds.split(','))]
    with tempfile.TemporaryDirectory() as folder:
        work = args.work or Path(folder)
        work.mkdir(parents=True, exist_ok=True)
        answers = [terms.kept(work / f'{kind}_{valve}.json', args, look, kind, valve)
                   for kind, valve in tasks]
        nulls = [terms.kept(work / f'null_{k}.json', args, look_at_null, k)
                 for k in range(args.nulls)]
    with results_page.printed(args, __file__):
        show(answers, nulls)


def look(seed, kind, valve):
    """Return what the surrogate of a rig that hides a kind of effect is worth."""
    rng = np.random.default_rng([seed, list(terms.KINDS).index(kind), valve == 'hsv'])
    hidden, of_sensors = terms.KINDS[kind](rng, rng.uniform(0.7, 1.5))
    chain = truth_sensors.drawn_chain(rng)
    chain.effects = of_sensors
    return asked({**terms.off(rng, valve, 0.01, 0.03), **hidden}, valve, chain, rng) | {
        'kind': kind}


def look_at_null(seed, k):
    """Return the same of a rig without any effect, every second with hard sensors."""
    rng = np.random.default_rng([seed, 2000, k])
    valve = ('ppr', 'hsv')[k // 2 % 2]
    chain = truth_sensors.drawn_chain(rng, k % 2 == 1, True)
    return asked(terms.off(rng, valve, 0.01, 0.03), valve, chain, rng)


def asked(numbers, valve, chain, rng):
    """Return the answer on a rig, by which a third recording is then judged."""
    runs = [terms.recorded(numbers, valve, motion, chain, rng) for motion in terms.MOTIONS]
    result = find_gap(runs[0], load_rig(terms.MODEL, valve=valve), runs[1], seconds=3600.0,
                      unnamed=['surrogate'])
    found = result.surrogate
    answer = {'valve': valve, 'verdict': result.verdict, 'named': result.ambiguity_set,
              'names': list(found.names) if found else []}
    if found:
        third = Recording(runs[2], valve)
        before, after = (terms.squared_errors(third, load_rig(text))
                         for text in (result.model_yaml, found.model_yaml))
        answer |= {'proof': found.explained, 'third': terms.removed_of(before, after),
                   'worse': worse(before, after)}
    return answer


def worse(before, after):
    """Return the signals of which the squared errors rose, beyond the noise."""
    return [s for s, square in after.items() if square > WORSE ** 2 * before[s] + 1.0]


def show(answers, nulls):
    """Print the tables."""
    of_unknown = [a for a in answers if a['verdict'] == 'unknown']
    print('| effect | valve | surrogate | removed, proof | removed, third | worse on the third |\n'
          '|---|---|---|---|---|---|')
    for a in of_unknown:
        shares = ' | '.join(f'{100 * a[key]:.0f} %' if a['names'] else '–'
                            for key in ('proof', 'third'))
        names = ', '.join(f'`{one}`' for one in a['names']) or 'none'
        print(f'| {a["kind"]} | {a["valve"]} | {names} | {shares} | '
              f'{", ".join(a.get("worse", ()))} |')
    with_one = [a for a in of_unknown if a['names']]
    print(f'\n- Records: {len(answers)}, of {len(of_unknown)} of which the verdict is `unknown`. '
          f'With a surrogate: {len(with_one)}.')
    if with_one:
        for key, title in (('proof', 'proof'), ('third', 'third recording')):
            shares = [100 * a[key] for a in with_one]
            print(f'- Removed of the squared gap, {title}: median {np.median(shares):.0f} %, '
                  f'least {min(shares):.0f} %.')
        print('- A signal of the third recording is worse: '
              f'{sum(bool(a["worse"]) for a in with_one)} of {len(with_one)}.')
    print(f'- Null records with a surrogate: {sum(bool(n["names"]) for n in nulls)} of '
          f'{len(nulls)}.')


if __name__ == '__main__':
    sys.exit(main())
