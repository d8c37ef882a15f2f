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
How often `pam gap` names a hidden effect in recordings as people have them.

    python benchmarks/recordings_people_have.py --seed 7 --number 4 --kinds slow,joint
    python benchmarks/recordings_people_have.py --work exam --minutes 40      # again to go on

There are five kinds: a closed loop, in which SOFC or PID track a contraction, a slow log of 50 Hz,
and on/off valves that switch. The others are a joint with two muscles, and three runs of one day
in one question. Each case hides
one effect of everyday size in a rig of the independent simulator under test/hidden, or nothing.
The cases are recorded first, and the key is opened after the answers. With --work DIR each
recording and each answer is kept; an interrupted run goes on where it stopped.

Exit code 1 when a bar is missed, 3 when the minutes were over before all was answered.
"""

import argparse
from pathlib import Path
import shutil
import sys
import tempfile
import time

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / 'test' / 'hidden'), str(ROOT), str(ROOT / 'benchmarks')]

from asking import ask  # noqa: E402, I100
from hidden_effects import read, UNFINISHED, write  # noqa: E402
from pam_actuation.control.config import load_controller  # noqa: E402
from pam_actuation.drivers.for_rig import driver_config  # noqa: E402
from pam_actuation.experiments import load_experiment  # noqa: E402
from pam_actuation.tuning.foreign_plant import ForeignLoop  # noqa: E402
from pam_sim import load_rig  # noqa: E402
from pam_sim.located_yaml import dump_yaml  # noqa: E402
import results_page  # noqa: E402
from scoring_judge import is_false_alarm, is_right, read_answer, wrong_names  # noqa: E402
import truth_everyday as everyday  # noqa: E402
import truth_joint  # noqa: E402
import truth_key  # noqa: E402
import truth_live  # noqa: E402

MODEL = 'dmsp_5_300_hanging_mass'
CONTROLLED = 'dmsp_5_300_realistic'        # what controller and driver were made for
LAWS = {('sofc', 'ppr'): 'sofc_ppr', ('sofc', 'hsv'): 'sofc_hsv', ('pid', 'ppr'): 'pid_plain',
        ('pid', 'hsv'): 'pid_plain_hsv'}
RIGHT_SHARE = 0.9
SEEN = 1.0                                 # sigma, from which on a name is due
TRIES = 2                                  # effects drawn for one that is seen
TITLES = {'closed_loop': 'closed loop', 'slow': 'slow log, 50 Hz',
          'switching': 'switching on/off valves', 'joint': 'joint', 'one_day': 'runs of one day'}


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.strip().split('\n')[0])
    parser.add_argument('--seed', type=int, default=2026, help='of the examination')
    parser.add_argument('--number', type=int, default=20,
                        help='cases with an effect of each kind (default: 20)')
    parser.add_argument('--nulls', type=int, default=3,
                        help='cases with nothing to find of each kind (default: 3)')
    parser.add_argument('--kinds', default=','.join(everyday.KINDS),
                        help='only these (default: %(default)s)')
    parser.add_argument('--work', type=Path, help='keep recordings and answers here')
    parser.add_argument('--again', action='store_true',
                        help='with --work: keep the recordings, answer anew')
    parser.add_argument('--seconds', type=float, default=600.0,
                        help='time budget of `pam gap` for one case (default: %(default)g)')
    parser.add_argument('--minutes', type=float, default=float('inf'), metavar='N',
                        help='with --work: begin no case after N minutes; start again to go on')
    parser.add_argument('--part', default='', metavar='WORD',
                        help='with --write: the part of the page with this word')
    results_page.add_write(parser, 'everyday_recordings')
    return parser


def main():
    """Examine; return the exit code."""
    args = command_line().parse_args()
    results_page.check(args, __file__, args.part)
    args.until = time.time() + 60.0 * args.minutes
    if args.work:
        args.work.mkdir(parents=True, exist_ok=True)
        return examine(args.work, args)
    with tempfile.TemporaryDirectory(prefix='recordings_') as folder:
        return examine(Path(folder), args)


def examine(work, args):
    """Record all cases, seal the key, answer, open the key, print; return the exit code."""
    cases, keys, too_small = [], {}, {}
    for kind in args.kinds.split(','):
        found = everyday.plan(kind, TRIES * args.number, args.nulls, args.seed)
        due, too_small[kind] = args.number, 0
        for case in found:
            if case.effect and due == 0:
                continue
            if time.time() > args.until:
                return UNFINISHED
            key = record(case, work)
            if case.effect and max(key['gap_sigma'].values()) < SEEN:
                too_small[kind] += 1
                continue
            due -= bool(case.effect)
            cases.append(case)
            keys[case.name] = key
    if set(keys) - set(read(work / 'sealed.json') or ()):
        truth_key.seal(keys, work)
    for case in cases:
        if time.time() > args.until:
            return UNFINISHED
        answer(case, work / case.name, args)
    answers = {case.name: read(work / case.name / 'answer.json') for case in cases}
    keys = truth_key.open_keys(work, answers, [case.name for case in cases])
    with results_page.printed(args, __file__, args.part):
        return show(cases, keys, answers, too_small)


def record(case, work):
    """Record one case unless that was done; return its key."""
    kept = work / 'keys' / f'{case.name}.json'
    if not kept.exists():
        shutil.rmtree(work / case.name, ignore_errors=True)
        write(kept, everyday.build(case, work / case.name, closed_loop))
    return read(kept)


def closed_loop(case, numbers, chain, part):
    """Return (instants, valve signals, pressures wanted) of a controller on a hidden rig."""
    rng = np.random.default_rng([*case.seed, 5, ('fit', 'certify').index(part)])
    named = load_rig(CONTROLLED, valve=case.valve)
    reads = {name: (1.0 + chain.effects.get(f'{name}_gain', 0.0),
                    chain.effects.get(f'{name}_bias', 0.0))
             for name in ('pressure', 'contraction', 'force')}

    def readings(pressure, contraction, force):
        gauge = (pressure - truth_live.rig.ATM) * reads['pressure'][0] + reads['pressure'][1]
        return (truth_live.rig.ATM + gauge, *(
            value * reads[name][0] + reads[name][1]
            for name, value in (('contraction', contraction), ('force', force))))

    loop = ForeignLoop(
        lambda: truth_live.LiveRig(numbers, readings, case.valve), named,
        load_experiment(dump_yaml(motion(case, part, rng))), seed=int(rng.integers(2**31)),
        driver=driver_config(named))
    found = loop.run(load_controller(LAWS[case.way, case.valve], named))
    every = 1 if case.valve == 'ppr' else 2            # a pulse per period
    signal = np.asarray(found.signal, dtype=float).reshape(found.time_s.size, -1)
    columns = 1 if case.valve == 'ppr' else 2
    return (found.time_s[::every] + 0.003, signal[::every, :columns], found.command_pa[::every])


def motion(case, part, rng):
    """Return the motion that is tracked as the data of an experiment, 40 s."""
    order = ('sines', 'random', 'steps')
    first = int(np.random.default_rng([*case.seed, 6]).integers(3))
    name = order[(first + (part == 'certify')) % 3]
    low, high = rng.uniform(0.003, 0.005), rng.uniform(0.019, 0.022)
    middle, amplitude = 0.5 * (low + high), 0.5 * (high - low)
    start = [{'rest': {'duration_s': 1.0}}, {'ramp': {'to_m': low, 'duration_s': 2.0}},
             {'hold': {'duration_s': 2.0}}]
    if name == 'sines':
        segments = [{'sine': {'center_m': middle, 'amplitude_m': amplitude, 'frequency_hz': hz,
                              'cycles': cycles}} for hz, cycles in ((0.25, 3), (0.5, 5), (1.0, 8))]
    elif name == 'random':
        start[1:] = [{'ramp': {'to_m': middle, 'duration_s': 2.0}}]
        segments = [{'multisine': {
            'center_m': middle, 'amplitude_m': amplitude, 'min_hz': 0.05, 'max_hz': 1.0,
            'lines': 20, 'duration_s': 35.0, 'seed': int(rng.integers(2**31))}}]
    else:
        segments = [{'ramp' if k % 2 else 'step': {'to_m': float(to), 'duration_s': 2.0}}
                    for k, to in enumerate(rng.uniform(low, high, 17))]
    return {'name': name, 'domain': 'contraction', 'segments': start + segments}


def answer(case, folder, args):
    """Ask `pam gap` about a case unless that was done; keep its results by side or as ''."""
    target = folder / 'answer.json'
    if target.exists() and not args.again:
        return
    begun, used = time.perf_counter(), time.process_time()
    results = {}
    for side in truth_joint.SIDES if case.kind == 'joint' else ('',):
        results[side] = ask(*question(case, folder, side), folder / 'asked' / side, args.seconds)
    write(target, {'results': results, 'wall_s': time.perf_counter() - begun,
                   'processor_s': time.process_time() - used})


def question(case, folder, side):
    """Return (bags, model, further options) of what a person would ask."""
    if case.kind == 'joint':
        return [folder / 'fit'], f'joint_dmsp_5_300/{side}', [
            '--certify', str(folder / 'certify'), '--namespace', f'{everyday.JOINT}/{side}']
    if case.kind == 'one_day':
        return sorted(folder.glob('fit_*')), MODEL, []
    return [folder / 'fit'], MODEL, ['--certify', str(folder / 'certify')]


def judged(case, key, found):
    """Return what an answer is: right, set, wrong, nothing, or, of a null record, quiet, alarm."""
    sides = {side: read_answer(raw) for side, raw in found['results'].items()}
    empty = {**key, 'effects': []}
    of_side = {side: key if side in ('', case.way) else empty for side in sides}
    if not case.effect:
        return 'alarm' if any(is_false_alarm(a) for a in sides.values()) else 'quiet'
    if any(wrong_names(a, of_side[side]) for side, a in sides.items()):
        return 'wrong'
    if all(is_right(a, key) if of_side[side] is key else not is_false_alarm(a)
           for side, a in sides.items()):
        return 'right'
    return 'set' if any(a.verdict == 'ambiguous' for a in sides.values()) else 'nothing'


def show(cases, keys, answers, too_small):
    """Print the table of kinds and every case that was not right; return the exit code."""
    print(f'Every hidden effect moves a signal by {SEEN:g} σ or more after a refit. Effects drawn '
          f'that move less are left out: {sum(too_small.values())}.\n')
    print('| kind | cases | right single name | set | wrong name | nothing named '
          '| false alarm, null records | time: median, longest | processor | met |')
    print('|---|---|---|---|---|---|---|---|---|---|')
    missed, others = False, []
    for kind in dict.fromkeys(case.kind for case in cases):
        count = dict.fromkeys(('right', 'set', 'wrong', 'nothing', 'alarm', 'quiet'), 0)
        wall, used = [], []
        for case in (c for c in cases if c.kind == kind):
            key, found = keys[case.name], answers[case.name]
            wall.append(found['wall_s'])
            used.append(found['processor_s'])
            what = judged(case, key, found)
            count[what] += 1
            if what not in ('right', 'quiet'):
                others.append(f'- {_told(case, key)}: {_said(found)}')
        total = sum(count[k] for k in ('right', 'set', 'wrong', 'nothing'))
        met = (count['right'] >= RIGHT_SHARE * total and not count['wrong']
               and not count['alarm'])
        missed |= not met
        print(f'| {TITLES[kind]} | {total} | {_share(count["right"], total)} | {count["set"]} '
              f'| {count["wrong"]} | {count["nothing"]} '
              f'| {count["alarm"]}/{count["alarm"] + count["quiet"]} '
              f'| {np.median(wall):.1f} s, {max(wall):.1f} s | {np.median(used):.1f} s '
              f'| {"yes" if met else "**no**"} |')
    if others:
        print('\nCases without the answer that is due:\n')
        print('\n'.join(others))
    return int(missed)


def _told(case, key):
    """Return a case in words: its name, rig, effect and size."""
    words = ', '.join(word for word in (case.valve, case.way) if word)
    sigma = max(key['gap_sigma'].values(), default=0.0)
    return f'{case.name} ({words}): ' + (
        f'{case.effect}, {sigma:.1f} σ' if case.effect else 'nothing')


def _said(found):
    """Return an answer in words."""
    return 'answer ' + ', '.join(
        f'{side} {read_answer(raw).label}'.strip() for side, raw in found['results'].items())


def _share(part, whole):
    return f'{100.0 * part / whole:.0f} % ({part}/{whole})' if whole else '-'


if __name__ == '__main__':
    sys.exit(main())
