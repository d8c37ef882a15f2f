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
What `pam gap` proposes where no library holds the effect: rigs of an independent simulator.

    python benchmarks/proposed_terms.py --write                  # kinds, then nulls
    python benchmarks/proposed_terms.py --work terms --minutes 30    # a piece; again to go on
    python benchmarks/proposed_terms.py --kinds ripple,bump --valves ppr
    python benchmarks/proposed_terms.py --nulls 60 --kinds none

Each rig hides one effect that no library holds. Of each there are three recordings: one to learn
from, one for the proof, and a third of another motion. Nothing is fitted to the third, chosen by
it or proved on it. The table states the share of the squared gap after calibration that the
final model removes, on the proof and on the third recording.

Null records are rigs without an effect, half of them hard: coloured noise, drift, skew.

Every record is looked at as if its verdict had been `unknown`. This tests the search for a term
also where the library would name something. With --whole, `pam gap` decides.
"""

import argparse
import json
from pathlib import Path
import sys
import tempfile
import time

import numpy as np
import results_page

ROOT = Path(__file__).resolve().parent.parent
# The simulator lives beside its tests; runs from the source tree as it stands.
sys.path[:0] = [str(ROOT / 'test' / 'hidden'), str(ROOT)]

from pam_sim import load_rig  # noqa: E402, I100
from pam_sim.effects.registry import effects  # noqa: E402
from pam_sim.gap import find_gap  # noqa: E402
from pam_sim.gap.criteria import CRITERIA  # noqa: E402
from pam_sim.gap.data.noise import noise_of  # noqa: E402
from pam_sim.gap.data.recording import Recording  # noqa: E402
from pam_sim.gap.data.split import SETTLE_S  # noqa: E402
from pam_sim.gap.fit.estimator import Estimator  # noqa: E402
from pam_sim.gap.propose.proposal import propose  # noqa: E402
from pam_sim.gap.result import GapResult  # noqa: E402
from pam_sim.gap.subsystems.problems import subsystem_problems  # noqa: E402
from pam_sim.gap.subsystems.simulation import free_run  # noqa: E402
from pam_sim.gap.verify.model import model_of  # noqa: E402
from pam_sim.gap.verify.validation import Validation  # noqa: E402
from pam_sim.located_yaml import dump_yaml  # noqa: E402
from pam_sim.run import Run, Series  # noqa: E402
import truth_commands as commands  # noqa: E402
import truth_effects  # noqa: E402
import truth_run  # noqa: E402
import truth_sensors  # noqa: E402
import yaml  # noqa: E402

SEED = 77
MODEL = 'dmsp_5_300_hanging_mass'
FIELD = {'pressure': 'pressure_pa', 'contraction': 'contraction_m', 'force': 'force_n'}
MOTIONS = ('minimum', 'multisine', 'triangle')       # to learn, for the proof, third
START_NS = 10**18
UNFINISHED = 3               # exit code


def of_rig(table, kind):
    """Return a function that draws the numbers of a kind of the examination."""
    return lambda rng, s: (table[kind](rng, s), {})


KNOWN = {**{kind: of_rig(truth_effects.FAR, kind) for kind in truth_effects.FAR},
         **{kind: of_rig(truth_effects.NEAR, kind) for kind in truth_effects.NEAR},
         'fill_curve': lambda rng, s: ({'fill_curve': 0.3 * s}, {}),
         'drag_p': lambda rng, s: ({'drag_p': 30.0 * s}, {}),
         'cell_cross': lambda rng, s: ({}, {'force_of_pressure': 2.0 * s})}
# Written last; nothing was chosen by how well it does on these.
LAST = {'bump': lambda rng, s: ({'bump': 3.0 * s, 'bump_at': rng.uniform(6e-3, 14e-3)}, {}),
        'full_slow': lambda rng, s: ({'full_slow': 0.25 * s}, {}),
        'ageing': lambda rng, s: ({'ageing': 0.06 * s}, {}),
        'encoder_wave': lambda rng, s: ({}, {
            'contraction_wave': 0.1e-3 * s, 'contraction_wave_period': rng.uniform(2e-3, 5e-3)})}
KINDS = {**KNOWN, **LAST}
VALVES = {**{kind: ('ppr',) for kind in truth_effects.ONLY_PPR}, 'fill_curve': ('hsv',)}


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('--kinds', help='only these; `none` for none')
    parser.add_argument('--valves', default='ppr,hsv')
    parser.add_argument('--once', action='store_true', help='one valve of each kind')
    parser.add_argument('--nulls', type=int, default=60, help='null records (default: 60)')
    parser.add_argument('--whole', action='store_true', help='the whole of `pam gap` first; by '
                        'default each verdict is held to be `unknown`')
    parser.add_argument('--seed', type=int, default=SEED)
    parser.add_argument('--work', type=Path, help='keep answers here')
    parser.add_argument('--minutes', type=float, default=float('inf'), metavar='N',
                        help='with --work: begin no record after N minutes; start again to go on')
    parser.add_argument('--part', default='', metavar='WORD',
                        help='with --write: the part of the page with this word')
    results_page.add_write(parser, 'proposed_terms')
    return parser


def main():
    """Look at every record; return the exit code."""
    args = command_line().parse_args()
    results_page.check(args, __file__, args.part)
    args.until = time.time() + 60.0 * args.minutes
    wanted = [k for k in KINDS if args.kinds is None or k in args.kinds.split(',')]
    tasks = list(dict.fromkeys(
        (kind, valve) for turn in range(1 if args.once else 2) for k, kind in enumerate(KINDS)
        for valve in both(kind)[(k + turn) % 2:][:1] or both(kind)[:1 - turn]
        if kind in wanted and valve in args.valves.split(',')))
    with tempfile.TemporaryDirectory() as folder:
        work = args.work or Path(folder)
        work.mkdir(parents=True, exist_ok=True)
        answers = [kept(work / f'{kind}_{valve}.json', args, look, kind, valve, args.whole)
                   for kind, valve in tasks]
        nulls = [kept(work / f'null_{k}.json', args, look_at_null, k) for k in range(args.nulls)]
    if any(a is None for a in (*answers, *nulls)):
        print('out of minutes; start again to go on')
        return UNFINISHED
    with results_page.printed(args, __file__, args.part):
        show(args, answers, nulls)
    return 0


def both(kind):
    """Return the types of valve with which a kind acts."""
    return VALVES.get(kind, ('ppr', 'hsv'))


def kept(path, args, function, *arguments):
    """Return an answer, from its file if it is there; None after the end of the time."""
    if not path.exists():
        if time.time() > args.until:
            return None
        path.write_text(json.dumps(function(args.seed, *arguments)), encoding='utf-8')
        print(path.stem, path.read_text(encoding='utf-8'), file=sys.stderr, flush=True)
    return json.loads(path.read_text(encoding='utf-8'))


def look(seed, kind, valve, whole):
    """Return what `pam gap` says of a rig that hides a kind of effect."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind), valve == 'hsv'])
    hidden, of_sensors = KINDS[kind](rng, rng.uniform(0.7, 1.5))
    numbers = {**off(rng, valve, 0.01, 0.03), **hidden}
    chain = truth_sensors.drawn_chain(rng)
    chain.effects = of_sensors
    runs = [recorded(numbers, valve, motion, chain, rng) for motion in MOTIONS]
    began, used = time.perf_counter(), time.process_time()
    if whole:
        result = find_gap(runs[0], load_rig(MODEL, valve=valve), runs[1], seconds=3600.0)
    else:
        result = as_unknown(runs[0], runs[1], valve)
    found = result.proposal
    left = result.unexplained_fraction if result.verdict != 'no_gap' else 1.0
    third = Recording(runs[2], valve)
    before, after = base_model(result), load_rig(result.model_yaml)
    if found:
        left *= 1.0 - found.explained
        after = tried(found)
    return {'kind': kind, 'valve': valve, 'verdict': result.verdict,
            'names': result.ambiguity_set, 'proposed': found.equation if found else '',
            'file': found.name if found else '', 'removed': 1.0 - left,
            'third': removed(third, before, after) if found or result.ambiguity_set else 0.0,
            'sigma': max(s.rmse_refit / s.noise_floor for s in result.signals.values()),
            'worse': worse(result), 'wall_s': time.perf_counter() - began,
            'processor_s': time.process_time() - used}


def look_at_null(seed, k):
    """Return what is proposed for a rig without any effect."""
    rng = np.random.default_rng([seed, 1000, k])
    valve, hard = ('ppr', 'ppr', 'hsv')[k % 3], k % 3 == 1 or k % 6 == 5
    numbers = off(rng, valve, *((0.025, 0.03) if hard else (0.01, 0.03)))
    chain = truth_sensors.drawn_chain(rng, hard, hard or k % 5 != 0)
    learned, proof = (recorded(numbers, valve, motion, chain, rng) for motion in MOTIONS[:2])
    result = as_unknown(learned, proof, valve)
    return {'valve': valve, 'hard': bool(hard),
            'proposed': result.proposal.equation if result.proposal else ''}


def as_unknown(learned, proof, valve):
    """Return the result of a look for a term, the verdict held to be `unknown`."""
    rig, recording, held_out = load_rig(MODEL, valve=valve), *(
        Recording(run, valve) for run in (learned, proof))
    estimator = Estimator(rig, subsystem_problems(rig, [recording], 0, 0, CRITERIA))
    base = estimator.base
    calibrated = Validation(held_out, True, estimator, base, base)
    result = GapResult('unknown', '', signals=calibrated.signals(), unexplained_fraction=1.0,
                       model_yaml=model_of(estimator, base).to_yaml())
    propose(result, calibrated)
    return result


def off(rng, valve, least, most):
    """Return the numbers of a rig, each a little off its nominal value."""
    names = truth_effects.PARAMETERS_OF[valve]
    return {truth_effects.PARAMETERS[p][0]: truth_effects.PARAMETERS[p][1] * (
        1.0 + rng.choice((-1.0, 1.0)) * rng.uniform(least, most)) for p in names}


def recorded(numbers, valve, motion, chain, rng):
    """Return a Run of the hidden rig."""
    truth = truth_run.run_rig(numbers, valve, commands.protocol(motion, int(rng.integers(2**31))))
    signals = truth_sensors.measured(truth.rows, chain, rng, reservoir=False)
    topics = {topic: Series(stamps(t + 1e-3), {FIELD[topic]: v})
              for topic, (t, v) in signals.items()}
    sent = truth.sent_s + 1e-3 + chain.skew_s.get('valve_signal', 0.0) + (
        truth_sensors.stamp_errors(truth.sent_s.size, chain, rng))
    order = np.argsort(sent, kind='stable')
    topics['valve_signal'] = Series(stamps(sent[order]), dict(zip(
        truth_run.SIGNALS[valve], truth.sent[order].T)))
    return Run(topics, {}, '/bench', 'hidden')


def stamps(seconds):
    """Return header stamps [ns]."""
    return START_NS + np.rint(np.asarray(seconds) * 1e9).astype(np.int64)


def tried(found):
    """Return the model with a proposal, its stand-in in the place of its file."""
    data = yaml.safe_load(found.model_yaml)
    data['effects'] = [*data['effects'][:-1], found.trial]
    return load_rig(dump_yaml(data))


def base_model(result):
    """Return the calibrated model without what was named or proposed."""
    return load_rig(result.model_yaml).with_(effects=[])


def removed(recording, before, after):
    """Return the share of the squared gap that a model removes against another in a free run."""
    return removed_of(*(squared_errors(recording, rig) for rig in (before, after)))


def removed_of(before, after):
    """Return the same from the squared errors of both."""
    first, second = (sum(max(square - 1.0, 0.0) for square in squares.values())
                     for squares in (before, after))
    return 1.0 - second / max(first, 1e-12)


def squared_errors(recording, rig):
    """Return the mean squared error of a free run by signal, in deviations of its sensor."""
    run, found = free_run(rig, recording), {}
    for s in recording.signals:
        noise = noise_of(recording.time_s[s], recording.measured[s]).sd
        error = (run[s] - recording.measured[s])[recording.time_s[s] > SETTLE_S]
        found[s] = float(np.mean(error ** 2)) / noise ** 2
    return found


def worse(result):
    """Return the signals of the proof of which the proposal leaves more than the model without."""
    found = result.proposal
    return [] if found is None else [s for s, (before, after) in found.proof.items()
                                     if after > 1.05 * before]


def show(args, answers, nulls):
    """Print the tables."""
    if answers:
        print('| effect | valve | gap, floors | verdict | proposed | removed, proof | '
              'removed, third |')
        print('|---|---|---|---|---|---|---|')
        for a in sorted(answers, key=lambda a: list(KINDS).index(a['kind'])):
            last = ' (last)' if a['kind'] in LAST else ''
            print(f'| {a["kind"]}{last} | {a["valve"]} | {a["sigma"]:.3g} | {a["verdict"]} '
                  f'{", ".join(a["names"])} | {code(a["proposed"])} | '
                  f'{100 * a["removed"]:.0f} % | {100 * a["third"]:.0f} % |')
        print()
        for title, chosen in (('all', answers),
                              ('the last four', [a for a in answers if a['kind'] in LAST]),
                              ('with a proposal', [a for a in answers if a['proposed']])):
            if chosen:
                shares = [[100 * a[key] for a in chosen] for key in ('removed', 'third')]
                print(f'- Removed, {title} ({len(chosen)} records): median '
                      f'{np.median(shares[0]):.0f} %, 10th percentile '
                      f'{np.percentile(shares[0], 10):.0f} %; third recording '
                      f'{np.median(shares[1]):.0f} % and {np.percentile(shares[1], 10):.0f} %.')
        library = sum(a['file'] in effects() for a in answers)
        print(f'- Kinds: {len({a["kind"] for a in answers})}. Proposals: '
              f'{sum(bool(a["proposed"]) for a in answers)}; with a signal of the proof worse: '
              f'{sum(bool(a["worse"]) for a in answers)}; under a name of the library: {library}.')
        print(f'- Processor time of a look: median '
              f'{np.median([a["processor_s"] for a in answers]):.0f} s, largest '
              f'{max(a["processor_s"] for a in answers):.0f} s.')
    if nulls:
        print(f'- Null records with a proposal: {sum(bool(n["proposed"]) for n in nulls)} of '
              f'{len(nulls)}, {sum(n["hard"] for n in nulls)} of them hard.')


def code(text):
    """Return text as code in a cell of a table."""
    return f'`{text}`'.replace('|', '\\|') if text else ''


if __name__ == '__main__':
    sys.exit(main())
