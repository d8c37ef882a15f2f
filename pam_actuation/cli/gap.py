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

"""``pam gap``: what a model misses in recordings, added to it and proved."""

import argparse
import json
import os
import shlex
import sys
import time
from typing import Any, TYPE_CHECKING

from pam_actuation.cli.common import (
    add_overwrite_option, add_topic_option, effect_names, emit, EXIT_DONE, EXIT_FINDING,
    note_implausible, progress)
from pam_actuation.cli.options import number, out_path, Parser, refuse_unused, source

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from pam_actuation.report.joint_gap import Question
    from pam_sim.gap.result import GapResult
    from pam_sim.run import Run

HELP = 'Find what a model misses in recorded runs, name it, add it and prove that the gap shrank.'
EXAMPLE = 'pam gap runs/first --model dmsp_5_300_hanging_mass --certify runs/second --out gap'
SECONDS = 120.0
SAID_EVERY_S = 10.0             # between two lines on the progress in a log file
MODEL = 'dmsp_5_300_hanging_mass'
ANSWERED = 'effects', 'parameter', 'no_gap'       # with them the model can be tuned on
TUNED = 'tuned.yaml'
# Options that a question of the other kind needs: here they would change nothing.
UNUSED = {
    '--explain': ('plan', 'valve', 'no_force', 'certify', 'effects', 'seconds', 'materiality',
                  'out', 'overwrite'),
    '--plan': ('namespace', 'renamed', 'certify', 'seconds'),
    'a recording': ('valve', 'no_force')}


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('run', type=source, nargs='*', help='recorded bags')
    parser.add_argument('--model', type=source, default=None, metavar='NAME|FILE',
                        help='model YAML or preset of a rig or a joint to hold against the '
                        'recording (default: the rig that the first bag holds; without a bag '
                        f'{MODEL})')
    parser.add_argument('--out', type=out_path, default=None, metavar='DIR',
                        help='folder for the results; those of the same bags and model are '
                        'made again')
    parser.add_argument('--explain', type=source, default=None, metavar='EFFECT',
                        help='say what an effect is, from which size on it shows and what looks '
                        'like it; in the bag, or without one in a simulated identification')
    parser.add_argument('--plan', action='store_true',
                        help='before measuring: say which effects this model and the experiments '
                        'named in place of bags could distinguish, from which size on, and make '
                        'the best protocol of 60 s')
    parser.add_argument('--valve', default=None, metavar='ppr|hsv',
                        help='plan for a model preset with this valve')
    parser.add_argument('--no-force', action='store_true',
                        help='plan for a rig without a load cell')
    parser.add_argument('--certify', type=source, default=None, metavar='RUN',
                        help='bag for the proof (default: every fifth block of the first bag)')
    parser.add_argument('--namespace', default=None,
                        help='namespace of the muscle or the joint in the bags')
    add_topic_option(parser)
    parser.add_argument('--effects', type=source, default=None, metavar='A,B',
                        help='names to try (default: all)')
    parser.add_argument('--seconds', type=number(1.0, None, 's'), default=SECONDS, metavar='N',
                        help='time budget of unknown numbers and search; the validation comes on '
                        'top (default: %(default)g)')
    parser.add_argument('--materiality', type=number(0.01, 1000.0), default=1.0, metavar='S',
                        help='an effect is named when it moves a signal by more than S standard '
                        'deviations of its sensor (default: %(default)g)')
    add_overwrite_option(parser)


def run(args: argparse.Namespace) -> int | None:
    """Find the gap; exit code 1 only where the data cannot be used or cannot be right."""
    from pam_actuation.bags.facts import mistakes_of
    from pam_actuation.report.joint_gap import questions
    from pam_actuation.report.model_held import recorded_model
    from pam_sim.errors import InputError
    kind = '--explain' if args.explain is not None else '--plan' if args.plan else 'a recording'
    refuse_unused(args, add_arguments, UNUSED[kind], kind)
    if args.explain is not None and len(args.run) > 1:
        raise InputError(f'takes one bag, {len(args.run)} were given', '--explain')
    if args.explain is not None:
        return _explain(args)
    if args.plan:
        return _plan(args)
    if not args.run or args.out is None:
        raise InputError('needs at least one recorded bag and --out DIR')
    found: dict[str, GapResult] = {}
    lines: list[str] = []
    effect_names(args)      # a mistake in them is told before the bag is read
    model = args.model or recorded_model(args.run[0])
    with mistakes_of(args.run[0]):
        asked = questions(model, args.run[0], args.namespace, args.renamed)
    for question in asked:
        out = os.path.join(args.out, question.side) if question.side else args.out
        found[question.side], runs = _ask(args, question, out, model)
        result = found[question.side]
        lines += [f'{question.side}:'] if question.side else []
        lines += [result.text(), f'results: {out}',
                  *_next_lines(result, out, runs, _joint_model(question, model))]
    alone = found.get('')
    emit(args, alone.to_dict() if alone is not None else {
        'schema': 1, **{side: result.to_dict() for side, result in found.items()}},
        '\n'.join(lines))
    refused = any(result.verdict == 'refused' for result in found.values())
    return EXIT_FINDING if refused else EXIT_DONE


def _joint_model(question: 'Question', model: str) -> str:
    """Return preset or file of the joint of which the muscle is asked about, '' of no joint."""
    if question.joint is None:
        return ''
    return question.joint.name if '\n' in model else model


def _ask(args: argparse.Namespace, question: 'Question', out: str, model: str
         ) -> 'tuple[GapResult, Sequence[Run]]':
    """Return the result for one muscle, written into its folder, and its recordings."""
    from pam_actuation.report.gap import FILES, write_gap
    from pam_actuation.report.origin import is_of, origin
    from pam_sim.files import check_folder
    names = effect_names(args) or None
    page = os.path.join(out, 'report.html')
    of = origin(args.run, page, 'gap', args.model or '', args.certify)
    check_folder(out, FILES, args.overwrite or is_of(page, of))
    runs = [question.load(path) for path in args.run]
    certify = question.load(args.certify) if args.certify else None
    note_implausible(args, [*runs, *([certify] if certify else [])])
    name = question.side or 'gap'
    with progress(args, 1.0, '', name) as bar:
        return write_gap(
            runs, question.model, out, certify, of, _joint_model(question, model),
            joint=question.joint, effects=names, seconds=args.seconds,
            materiality=args.materiality, progress=_reporter(args, bar, name)), runs


def _reporter(args: argparse.Namespace, bar: Any, name: str) -> 'Callable[[float], None]':
    """Return what tells the progress: on the bar, or as a few lines on stderr in a log file."""
    began = said = time.perf_counter()

    def report(done: float) -> None:
        nonlocal said
        bar.update(done - bar.n)
        now = time.perf_counter()
        if bar.disable and not args.json and now - said >= SAID_EVERY_S:
            said = now
            print(f'{name}: {100.0 * done:.0f} % after {now - began:.0f} s',
                  file=sys.stderr, flush=True)
    return report


def _next_lines(result: 'GapResult', out: str, runs: 'Sequence[Run]' = (),
                joint_model: str = '') -> list[str]:
    """Return how to use a model without a name, what to measure next and how, if anything."""
    from pathlib import Path
    from pam_actuation.report.gap import next_command, with_term
    from pam_actuation.report.next_run import simulated, tuned_on
    from pam_sim.gap.propose.surrogate import FILE as SURROGATE_FILE
    lines, played = [], simulated(result.model_yaml)
    if result.proposal:
        lines += [f'the model with the term: {with_term(out, played)}']
    if result.surrogate:
        model = shlex.quote(str(Path(out) / SURROGATE_FILE))
        lines += [f'the surrogate: pam simulate {played} --rig {model} --out runs/surrogate']
    if result.next_experiment:
        lines += [f'what to measure next: {result.next_experiment["why"]}',
                  'next: ' + next_command(Path(out) / 'next_experiment.yaml', runs,
                                          Path(out) / 'model.yaml', joint_model)]
    elif result.verdict in ANSWERED and not result.not_judged and (
            command := tuned_on(result.model_yaml, Path(out) / 'model.yaml', TUNED)):
        lines.append(f'next: {command}')
    return lines


def _plan(args: argparse.Namespace) -> int:
    """Judge protocols before anything is measured; write plan.json and experiment.yaml."""
    from pathlib import Path

    from pam_actuation.experiments import load_experiment
    from pam_actuation.experiments.protocols import plan
    from pam_actuation.report.next_run import on_hardware
    from pam_sim import load_rig
    from pam_sim.files import check_folder, whole_files, write_text
    from pam_sim.located_yaml import dump_yaml
    args.model = args.model or MODEL
    rig = load_rig(args.model, valve=args.valve)
    names = effect_names(args) or None
    if args.out is not None:
        check_folder(args.out, ('plan.json', 'experiment.yaml'), args.overwrite)
    experiments = [load_experiment(one) for one in args.run]
    with progress(args, 1.0, '', 'plan') as bar:
        found = plan(rig, experiments, not args.no_force, args.materiality, names,
                     progress=lambda done: bar.update(done - bar.n))
    text = found.text()
    if args.out is not None:
        with whole_files(args.out) as folder:
            write_text(folder / 'plan.json', json.dumps(found.to_dict(), indent=2) + '\n')
            write_text(folder / 'experiment.yaml', dump_yaml(found.best.experiment))
        played, model = (shlex.quote(str(one)) for one in (
            Path(args.out) / 'experiment.yaml', args.model))
        text += (f'\nrun it with: {on_hardware(played, model, "first", valve=rig.valve)}'
                 f'\nsimulated: pam run {played} --rig {model} --valve {rig.valve}')
    emit(args, found.to_dict(), text)
    return EXIT_DONE


def _explain(args: argparse.Namespace) -> int:
    """Say what an effect is, from which size on it shows, and what looks like it."""
    from pam_actuation.bags.facts import mistakes_of, recorded_muscle
    from pam_actuation.bags.load import load_run
    from pam_actuation.experiments.separating import identification_run
    from pam_actuation.models.text import in_full
    from pam_actuation.report.gap import model_for
    from pam_actuation.report.model_held import recorded_model
    from pam_sim import load_rig
    from pam_sim.catalogue import catalogue, find
    from pam_sim.gap.plan.look_alikes import look_alikes
    from pam_sim.rig_text import rig_title
    from pam_sim.units import behind_number
    entry = find(catalogue(), args.explain)
    if args.run:
        run = load_run(args.run[0], args.namespace, topics=args.renamed)
        note_implausible(args, [run], must_be_right=True)
        own = None if args.model else recorded_muscle(run.metadata, run.namespace)
        with mistakes_of(args.run[0]):
            rig = own or model_for(run, args.model or recorded_model(args.run[0]))
    else:
        rig = load_rig(args.model or MODEL)
        run = identification_run(rig)
    found = look_alikes(run, rig, args.explain)
    least = found['least']
    lines = [in_full(entry), f'model: {rig_title(rig)}, valve {rig.valve}']
    if not least:
        lines.append(f'no smallest size: {found["why"]}')
    else:
        unit = behind_number(least['unit'])
        lines.append(f'shows from {least["quantity"]} = {least["value"]:.3g}{unit} on '
                     '(one noise floor, rms, after calibration)')
    lines.append('looks like: ' + (', '.join(
        f'{name} ({cosine:.2f})' for name, cosine in found['alike']) or 'no other effect here'))
    emit(args, {'schema': 1, 'effect': args.explain, 'model': rig_title(rig), **found},
         '\n'.join(lines))
    return EXIT_DONE
