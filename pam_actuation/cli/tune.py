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

"""``pam tune``: improve a controller offline, on a model, from what was recorded."""

import argparse
import math
import os
from typing import TYPE_CHECKING

from pam_actuation.cli.common import (
    add_controller_options, add_overwrite_option, add_seed_option, add_topic_option,
    check_outputs, default_controller, emit, EXIT_DONE, EXIT_FINDING, frozen_remarks,
    note_implausible, progress, say_remarks)
from pam_actuation.cli.options import count, number, out_path, Parser, source

if TYPE_CHECKING:
    from pam_actuation.bags.load import RecordedRun
    from pam_actuation.control.compiled_controller import CompiledController
    from pam_actuation.control.modes.joint import JointController
    from pam_actuation.experiments.experiment import Experiment
    from pam_sim.joint.rig import JointRig
    from pam_sim.rig import Rig

HELP = ('Tune the controller of a muscle or joint offline on a model; checks the model and the '
        'result against the bags; writes controller YAML, initial rules and report.')
EXAMPLE = 'pam tune runs/first --randomise 4 --out tuned.yaml'
EXPERIMENTS = ('tuning_quarter_hz', 'tuning_half_hz', 'tuning_one_hz')
CHECK = 'tuning_check'
# Of a joint, by its size; see ``control/modes/files.joint_size``.
OF_A_JOINT: dict[str, tuple[tuple[str, ...], str]] = {
    'joint': (('joint_tuning',), 'joint_tuning_check'),
    'knee': (('knee_tuning',), 'knee_tuning_check')}


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('bag', type=source, nargs='*',
                        help='bags that say rig, controller and experiment')
    parser.add_argument(
        '--namespace', default=None, help='namespace of the muscle or joint in the bags')
    add_topic_option(parser)
    parser.add_argument('--model', '--rig', dest='rig', type=source, default=None,
                        metavar='NAME|FILE',
                        help='model to tune on (default: the rig of the first bag)')
    parser.add_argument('--valve', metavar='ppr|hsv', default=None, help='valve type')
    parser.add_argument(
        '--experiment', type=source, action='append', default=None, metavar='NAME|FILE',
        help='experiment to tune for, may be repeated (default: those of the bags; without '
        f'bags {", ".join(EXPERIMENTS)}; of a joint joint_tuning or knee_tuning, by its size)')
    parser.add_argument(
        '--check', type=source, action='append', default=None, metavar='NAME|FILE',
        help=f'experiment of the held-out check, may be repeated (default: {CHECK}, of a joint '
        'joint_tuning_check or knee_tuning_check, and those of the search, with other noise)')
    add_controller_options(
        parser, 'that of the first bag, else sofc_ppr or sofc_hsv, after the valve; of a joint '
        'sofc_joint_… or sofc_knee_…; it tracks contraction, or the angle of a joint')
    parser.add_argument('--rollouts', type=count(10), default=3000, metavar='N',
                        help='budget of simulated runs of the search (default: %(default)s)')
    parser.add_argument('--randomise', type=count(0, 1000), default=0, metavar='N',
                        help='tune on so many random rigs beside the model (default: 0)')
    parser.add_argument('--preview', type=number(0.0, 10.0), default=None, metavar='SECONDS',
                        help='how far ahead the controller is told the reference; 0 for motions '
                        'nobody announces (default: the least that simulated bags say, without '
                        'one no limit)')
    parser.add_argument('--patience', type=count(0), default=30, metavar='N',
                        help='stop after so many generations without progress, 0 = never '
                        '(default: %(default)s)')
    parser.add_argument('--population', type=count(5, 10000, {0: 'after the budget'}), default=0,
                        metavar='N', help='points of a generation, 5 or more; on a cluster as '
                        'many as it has workers or more (default: 0, which is 24, fewer with a '
                        'small budget)')
    parser.add_argument('--jobs', type=count(1, 1024, {-1: 'one a core'}), default=-1,
                        metavar='N',
                        help='threads; -1 = one a core (default)')
    parser.add_argument('--cluster', type=source, default=None, metavar='ADDRESS',
                        help='run on a Dask scheduler (tcp://HOST:PORT) or a Ray cluster '
                        '(ray://HOST:PORT) instead')
    add_seed_option(parser, 'seed of search, sensor noise and random rigs')
    parser.add_argument('--out', type=out_path, default='tuned.yaml', metavar='FILE.yaml',
                        help='controller to write; its rules and the report go beside it '
                        '(default: %(default)s)')
    add_overwrite_option(parser)


def run(args: argparse.Namespace) -> int | None:
    """Tune; exit code 1 where the held-out check did not improve or the model is wrong."""
    from pam_actuation.bags.facts import mistakes_of
    from pam_actuation.bags.load_joint import load_recording
    from pam_actuation.bags.oddities import recording_remarks
    from pam_actuation.experiments.limits import unknown_remarks
    from pam_actuation.replay.model import check_kind
    from pam_actuation.report.tuning_page import tuning_report
    from pam_actuation.tuning.own_range import with_own_range
    from pam_actuation.tuning.random_rigs import random_rigs
    from pam_actuation.tuning.recording import check_recordings
    from pam_actuation.tuning.tune import HELD_OUT_SEED, tune
    from pam_sim.files import whole_files
    from pam_sim.joint import load_rig_or_joint
    written = _targets(args)
    runs = [load_recording(bag, args.namespace, topics=args.renamed) for bag in args.bag]
    note_implausible(args, runs, must_be_right=True)
    with mistakes_of(next(iter(args.bag), '')):
        rig = load_rig_or_joint(_rig_source(args, runs), args.valve)
        check_kind(runs, rig)
        controller = _controller(args, runs, rig)
    experiments, check = _experiments(args, runs, rig)
    preview_s, told = _preview(args, runs)
    controller, ranges = with_own_range(controller, rig, [*experiments, *check])
    said = [*unknown_remarks(rig), *ranges, *told, *frozen_remarks(args, controller)]
    say_remarks(args, said)
    rigs = [rig, *random_rigs(rig, args.randomise, args.seed)]
    others = [rig, *random_rigs(rig, args.randomise, args.seed + HELD_OUT_SEED)]
    with progress(args, args.rollouts, ' rollouts', 'tuning') as bar:
        result = tune(
            rigs, controller, experiments, budget=args.rollouts, seed=args.seed, jobs=args.jobs,
            progress=lambda done: bar.update(max(done - bar.n, 0)), held_out=check,
            held_out_rigs=others, patience=args.patience, cluster=args.cluster,
            population=args.population or None,
            learn_rules=not args.freeze, preview_s=preview_s)
    recordings = check_recordings(runs, rig, result.controller)
    if result.controller.rules is None:
        del written['rules']
    with whole_files(os.path.dirname(os.path.abspath(args.out))) as folder:
        files = {what: folder / os.path.basename(path) for what, path in written.items()}
        result.save(files['controller'], files.get('rules'))
        tuning_report(files['report'], result, recordings, rig, experiments, runs)
    emit(args, {**{key: os.fspath(path) for key, path in written.items()}, **result.to_dict(),
                'recordings': [one.to_dict() for one in recordings],
                'remarks': [*said, *recording_remarks(runs)]},
         '\n'.join([result.text(), *(f'  {text}' for one in recordings for text in one.lines()),
                    *(f'{key}: {path}' for key, path in written.items())]))
    wrong = any(one.model is not None and one.model.verdict == 'wrong' for one in recordings)
    return EXIT_DONE if result.improved and not wrong else EXIT_FINDING


def _controller(args: argparse.Namespace, runs: 'list[RecordedRun]',
                rig: 'Rig | JointRig') -> 'CompiledController | JointController':
    """Return the controller to tune: the one given, that of the first bag, or the preset."""
    from pam_actuation.control.config import load_controller
    from pam_actuation.control.modes.force import ForceController
    from pam_actuation.control.modes.tracked import CONTRACTION, JOINT, tracked_by
    from pam_sim.errors import InputError
    from pam_sim.joint import JointRig
    if not isinstance(rig, JointRig) and rig.is_driven:
        raise InputError(
            f'the load `{rig.load}` of {rig.name} has its contraction prescribed, and a '
            'controller of a force cannot be tuned; the presets sofc_force_ppr and '
            'sofc_force_hsv suit muscles of any size', 'controller')
    controller = load_controller(
        args.controller or _first(runs, 'controller') or _preset(args, rig),
        rig, rules_file=args.rules, accept_other_rig=args.accept_other_rig)
    wanted = JOINT if isinstance(rig, JointRig) else CONTRACTION
    if isinstance(controller, ForceController) or tracked_by(controller) != wanted:
        raise InputError(f'has `mode: {tracked_by(controller).mode}`; only what tracks '
                         f'{wanted.topic} can be tuned on {rig.name}', 'controller')
    if wanted == JOINT and controller.kind != 'sofc':
        raise InputError(f'is a {controller.kind} controller; of a joint only sofc controllers '
                         'can be tuned', 'controller')
    controller.freeze_learning = args.freeze
    return controller


def _targets(args: argparse.Namespace) -> dict[str, str]:
    """Return what will be written to which file; raise InputError where that cannot be."""
    from pam_sim.files import check_file
    check_file(args.out, args.overwrite, parents=False)
    stem = os.path.splitext(args.out)[0]
    targets = {'controller': args.out, 'report': f'{stem}.html', 'rules': f'{stem}_rules.json'}
    check_outputs(args, *targets.values())
    return targets


def _first(runs: 'list[RecordedRun]', key: str) -> str | None:
    """Return the first metadata entry of that name among the runs, None without any."""
    return next((run.metadata[key] for run in runs if run.metadata.get(key)), None)


def _rig_source(args: argparse.Namespace, runs: 'list[RecordedRun]') -> str:
    """Return name, file or text of the model to tune on."""
    from pam_sim.errors import InputError
    source: str | None = args.rig or _first(runs, 'rig')
    if not source:
        raise InputError(
            'no model to tune on: give a bag that was recorded here, or --model', '--model')
    return source


def _preset(args: argparse.Namespace, rig: 'Rig | JointRig') -> str:
    """Return the name of the controller where neither option nor bag names one."""
    from pam_actuation.control.modes.files import joint_preset_for
    from pam_sim.joint import JointRig
    if isinstance(rig, JointRig):
        return joint_preset_for(rig, rig.valve)
    return str(default_controller(args, rig.valve))


def _experiments(args: argparse.Namespace, runs: 'list[RecordedRun]', rig: 'Rig | JointRig'
                 ) -> 'tuple[list[Experiment], list[Experiment]]':
    """Return the experiments of the search and those of the held-out check."""
    from pam_actuation.experiments import load_experiment
    from pam_sim.joint import JointRig
    domain = 'contraction'
    presets: tuple[str, ...] = EXPERIMENTS
    checked = CHECK
    if isinstance(rig, JointRig):
        domain, (presets, checked) = 'joint_angle', _of_joint(rig)
    if args.experiment:
        search = [load_experiment(one) for one in args.experiment]
    else:
        texts = dict.fromkeys(run.metadata.get('experiment') or '' for run in runs)
        recorded = [load_experiment(text) for text in texts if text]
        search = [one for one in recorded if one.domain == domain] or [
            load_experiment(one) for one in presets]
    if args.check:
        return search, [load_experiment(one) for one in args.check]
    return search, [load_experiment(checked), *search]


def _of_joint(joint: 'JointRig') -> tuple[tuple[str, ...], str]:
    """Return the presets for a joint of this size; those of the other where it cannot do them."""
    from pam_actuation.control.modes.files import joint_size
    from pam_actuation.experiments import load_experiment
    from pam_sim.errors import InputError
    size = joint_size(joint)
    for one in (size, *(other for other in OF_A_JOINT if other != size)):
        presets, checked = OF_A_JOINT[one]
        try:
            for name in (*presets, checked):
                load_experiment(name).check_reachable(joint)
        except InputError:
            continue
        return presets, checked
    return OF_A_JOINT[size]


def _preview(args: argparse.Namespace, runs: 'list[RecordedRun]') -> tuple[float, list[str]]:
    """Return how far ahead [s] the controller is told the reference, and a remark on it."""
    if args.preview is not None:
        return float(args.preview), []
    told = []
    for run in runs:
        try:
            told.append((float(run.metadata.get('preview_s') or math.inf), str(run.path)))
        except ValueError:      # of another program
            continue
    least_s, bag = min(told, default=(math.inf, ''))
    if not 0.0 <= least_s < math.inf:
        return math.inf, []
    return least_s, [f'the controller is told the reference {least_s:g} s ahead, as in {bag}; '
                     '--preview gives another time']
