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
What `pam gap` says of short records with few moves: rigs made by an independent simulator.

    python benchmarks/few_moves.py                    # 42 records without an effect, 42 with
    python benchmarks/few_moves.py --seed 7 --nulls 10 --effects 14 --several 7

A record holds one step of the pressure up and one down, or two up and one down, in 6 to 10 s. So
stretches of its edges are dealt out to the fit, the choice and the proof. Half of the records
without an effect are hard: numbers 2.5 to 3 % off, coloured noise, drift. The others have one
effect of the valve, half as large to twice as large as usual, or with --several two or three of
valve and muscle. Every second record is thinned to 100 Hz. The generator is that of the
examination, ``test/hidden``.

Of every effect that is hidden and reported, the true size is held against its 95 % interval.
"""

import argparse
from collections import Counter
from pathlib import Path
import sys
import tempfile

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / 'test' / 'hidden'), str(ROOT)]

from pam_actuation.bags.load import load_run  # noqa: E402, I100
from pam_sim import load_rig  # noqa: E402
from pam_sim.gap import find_gap  # noqa: E402
from pam_sim.gap.data.recording import Recording  # noqa: E402
from pam_sim.gap.data.split import split_of  # noqa: E402
from pam_sim.run import Run, Series  # noqa: E402
import results_page  # noqa: E402
import truth_cases as cases  # noqa: E402
import truth_effects as effects  # noqa: E402
import truth_rig  # noqa: E402
import truth_run as runs  # noqa: E402
import truth_sensors as sensors  # noqa: E402

VALVE = ('valve_dead_time', 'tube_lag', 'flow_limit', 'vent_asymmetry', 'valve_dead_zone',
         'valve_hysteresis', 'leakage')
SEVERAL = (('valve_dead_time', 'flow_limit'), ('creep', 'valve_dead_time'),
           ('hysteresis', 'vent_asymmetry'), ('creep', 'valve_dead_time', 'flow_limit'),
           ('tube_lag', 'flow_limit'), ('creep', 'hysteresis'), ('hysteresis', 'valve_dead_time'))
SCALES = 0.5, 2.0            # times the usual size
EVERY = 4                    # kept of the messages of a thinned record: 100 Hz or more


def experiment(rng):
    """Return steps of the pressure, one or two up and one down, as an experiment."""
    low, high = rng.uniform(0.0, 80e3), rng.uniform(350e3, 550e3)
    ups = [rng.uniform(0.4, 0.7) * high, high] if rng.random() < 0.5 else [high]
    levels, held_s = [low, *ups, low], [rng.uniform(0.1, 0.5)]
    held_s += [rng.uniform(1.5, 3.0) / len(ups) + 1.0 for _ in ups] + [rng.uniform(2.5, 4.0)]
    return {'name': 'few', 'domain': 'pressure', 'segments': [
        {'step': {'to_pa': truth_rig.ATM + level, 'duration_s': span}}
        for level, span in zip(levels, held_s)]}


def recorded(kind, names, seed):
    """Return the Run of a record and the true sizes of its effects, by name."""
    rig, sizes = cases.draw(cases.Case('few', kind, 'ppr', seed)), {}
    rng = np.random.default_rng([*seed, 5])
    chain = sensors.drawn_chain(rng, kind == 'hard_null', bool(rng.random() < 0.5))
    for name in names:
        hidden = effects.EFFECTS[name]
        low, high = (min(max(end, hidden.scales[0]), hidden.scales[1]) for end in SCALES)
        drawn = hidden.draw(rng, float(np.exp(rng.uniform(np.log(low), np.log(high)))), 'ppr')
        rig.numbers |= drawn.numbers
        chain.effects = {**chain.effects, **rig.sensors, **drawn.sensors}
        sizes[name] = drawn.equivalent
    truth = runs.run_rig(rig.numbers, 'ppr', experiment(rng))
    with tempfile.TemporaryDirectory() as folder:
        runs.record(Path(folder) / 'bag', truth, 'ppr', chain, rng)
        run = load_run(Path(folder) / 'bag')
    return thinned(run) if seed[-1] % 2 else run, sizes


def thinned(run):
    """Return a run with every fourth message of what is measured."""
    topics = {name: one if name == 'valve_signal' else Series(
        one.stamp_ns[::EVERY if one.stamp_ns.size > 300 * duration_s(one) else 1],
        {key: np.asarray(v)[::EVERY if one.stamp_ns.size > 300 * duration_s(one) else 1]
         for key, v in one.values.items()}) for name, one in run.topics.items()}
    return Run(topics, run.metadata, run.namespace, run.path)


def duration_s(series):
    """Return the time between the first and the last message."""
    return 1e-9 * float(series.stamp_ns[-1] - series.stamp_ns[0])


def verdict_of(hidden, result):
    """Return what an answer is worth, in words."""
    named = [e['name'] for e in result.effects] + [p.name for p in result.parameters]
    if not hidden:
        return 'false alarm' if named else result.verdict
    if not named:
        return result.verdict
    said = result.ambiguity_set or tuple(named)
    wrong, missed = set(named) - set(hidden), set(hidden) - set(named)
    if not wrong:
        word = 'right' if len(said) == len(named) else 'right, in a set'
        return word if not missed else 'some of them'
    if not missed:
        return 'right, with another'
    # One that stands for another of its set is no error.
    return 'right, in a set' if missed <= set(said) and len(named) <= len(hidden) and len(
        said) > len(named) else 'wrong'


def held_sizes(result, sizes):
    """Return (how many intervals hold the true size of an effect, how many are given)."""
    found = [e['equivalent'][key]['ci95'][0] <= true <= e['equivalent'][key]['ci95'][1]
             for e in result.effects for key, true in sizes.get(e['name'], {}).items()
             if key in e['equivalent']]
    return sum(found), len(found)


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--seed', type=int, default=2026)
    parser.add_argument('--nulls', type=int, default=42, help='records without an effect')
    parser.add_argument('--effects', type=int, default=42, help='records with one')
    parser.add_argument('--several', type=int, default=0, help='records with two or three')
    results_page.add_write(parser, 'few_moves')
    return parser


def show(args):
    """Print what is said of records with few moves."""
    rig = load_rig('rig: dmsp_5_300_hanging_mass\nvalve: ppr\n')
    asked = [('hard_null' if i % 2 else 'null', (), (args.seed, 3, i))
             for i in range(args.nulls)]
    asked += [('single', (VALVE[i % len(VALVE)],), (args.seed, 4, i)) for i in range(args.effects)]
    asked += [('several', SEVERAL[i % len(SEVERAL)], (args.seed, 6, i))
              for i in range(args.several)]
    counts, wrong, short, held, given = {}, [], 0, 0, 0
    for kind, hidden, seed in asked:
        run, sizes = recorded(kind, hidden, seed)
        short += split_of(Recording(run, 'ppr')).is_short
        result = find_gap(run, rig)
        said, title = verdict_of(hidden, result), ' + '.join(hidden) or kind
        counts.setdefault(title, Counter())[said] += 1
        inside, all_ = held_sizes(result, sizes)
        held, given = held + inside, given + all_
        named = ', '.join(e['name'] for e in result.effects)
        if said in ('wrong', 'false alarm', 'right, with another'):
            wrong.append(f'- {title} {seed[-1]}: {said}: {result.verdict}, {named}; set '
                         f'{", ".join(result.ambiguity_set) or "–"}')
        print(f'{title} {seed[-1]}: {said}, {result.verdict}, {named}, {result.ambiguity_set}, '
              f'sizes {inside} of {all_}', file=sys.stderr, flush=True)
    print(f'{len(asked)} records, seed {args.seed}; {short} of them have few moves.\n')
    kinds = list(dict.fromkeys(one for c in counts.values() for one in c))
    print('| hidden | ' + ' | '.join(kinds) + ' |\n|---|' + '---|' * len(kinds))
    for name, found in counts.items():
        print(f'| `{name}` | ' + ' | '.join(str(found.get(k, 0)) for k in kinds) + ' |')
    if given:
        print(f'\n{held} of {given} intervals hold the true size of an effect '
              f'({100.0 * held / given:.0f} %).')
    print('\n' + '\n'.join(wrong) if wrong else '\nNothing wrong was named.')


if __name__ == '__main__':
    sys.exit(results_page.run(command_line(), __file__, show))
