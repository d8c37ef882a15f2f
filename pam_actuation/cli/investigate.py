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

"""``pam investigate``: record, find the gap, record what tells more, until there is an answer."""

import argparse
import sys
from typing import Any, TYPE_CHECKING

from pam_actuation.cli.common import (
    add_overwrite_option, add_seed_option, effect_names, emit, EXIT_DONE, EXIT_FINDING,
    note_implausible, progress)
from pam_actuation.cli.options import (
    count, EXIT_INTERRUPTED, number, out_path, Parser, source)
from pam_actuation.rigging.domain import HIGHEST_OF_ROS

if TYPE_CHECKING:
    from pam_actuation.bags.load import RecordedRun
    from pam_actuation.investigate.motion import Motion
    from pam_actuation.investigate.recorder import Recorder
    from pam_sim.rig import Rig

HELP = ('Find out what a model misses of a rig: record, compare, record what tells the remaining '
        'names apart, until one answer holds for all recordings. The rig is simulated (--rig), '
        'simulated on live nodes (--rig --live), or real (--hardware).')
EXAMPLE = ('pam investigate --model dmsp_5_300_hanging_mass --rig dmsp_5_300_realistic --out '
           'investigation')
MODEL = 'dmsp_5_300_hanging_mass'
EXPERIMENT = 'pressure_identification'
YES = 'yes'          # nothing shorter: a key pressed by mistake moves nothing


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('run', type=source, nargs='*',
                        help='bags that are there already; they are the first round')
    parser.add_argument('--model', type=source, default=MODEL, metavar='NAME|FILE',
                        help='model that may miss something (default: %(default)s)')
    parser.add_argument('--out', type=out_path, required=True, metavar='DIR',
                        help='folder of the investigation; the same command goes on where it '
                        'stopped')
    parser.add_argument('--rig', type=source, default=None, metavar='NAME|FILE',
                        help='rig that is simulated and recorded: it stands for the truth')
    parser.add_argument('--live', action='store_true',
                        help='record the simulated rig on live nodes (ROS 2)')
    parser.add_argument('--hardware', type=source, default=None, metavar='NAME|FILE',
                        help='record a real rig: a name in config/hardware, or a file; topics is '
                        'a program of your own. Each motion is asked for first')
    parser.add_argument('--yes', action='store_true',
                        help='allow every motion of live nodes without a question, for scripts')
    parser.add_argument('--valve', default=None, metavar='ppr|hsv',
                        help='valve type (default: that of the rig, else of the model)')
    parser.add_argument('--experiment', type=source, default=EXPERIMENT, metavar='NAME|FILE',
                        help='experiment of the first round (default: %(default)s)')
    parser.add_argument('--rounds', type=count(1, 50), default=4, metavar='N',
                        help='most rounds, those of earlier runs included (default: %(default)s)')
    parser.add_argument('--minutes', type=number(0.0, None, 'min'), default=60.0, metavar='N',
                        help='no round begins later than this (default: %(default)g)')
    parser.add_argument('--effects', type=source, default=None, metavar='A,B',
                        help='names to try (default: all)')
    parser.add_argument('--materiality', type=number(0.01, 1000.0), default=1.0, metavar='S',
                        help='as of pam gap (default: %(default)g)')
    parser.add_argument('--namespace', default=None,
                        help='namespace of the muscle in the bags that are there')
    parser.add_argument('--domain-id', type=count(0, HIGHEST_OF_ROS), default=None, metavar='N',
                        help='ROS domain of live nodes (default: a free one for a simulated rig, '
                        'for a real one ROS_DOMAIN_ID, else 0)')
    add_seed_option(parser, 'seed of the simulated sensors in the first round')
    add_overwrite_option(parser, 'the investigation of another question in this folder')


def run(args: argparse.Namespace) -> int:
    """Investigate; exit code 1 where data or a run are wrong, 130 where a motion is declined."""
    if args.live or args.hardware:
        from pam_actuation.rigging.node_template import prepare_template
        prepare_template()
    from pam_actuation.experiments import load_experiment
    from pam_actuation.investigate.decide import DECLINED
    from pam_actuation.investigate.loop import Budget, Investigation
    from pam_actuation.investigate.question import Question
    names = tuple(effect_names(args))
    truth, model = _rigs(args)
    experiment = load_experiment(args.experiment)
    with progress(args, 1.0, '', 'investigate') as bar:
        recorder = _recorder(args, truth, model, bar)
        given = _given(args)
        question = Question(model, experiment, tuple(args.run), args.namespace, names,
                            args.materiality, args.seed)
        outcome = Investigation(
            question, recorder, args.out, Budget(args.rounds, args.minutes), args.overwrite,
            _reporter(args, bar), given).run()
    emit(args, {**outcome.to_dict(), 'out': args.out}, outcome.text(args.out))
    if outcome.ended == DECLINED:
        return EXIT_INTERRUPTED
    return EXIT_FINDING if outcome.wrong else EXIT_DONE


def _rigs(args: argparse.Namespace) -> 'tuple[Rig | None, Rig]':
    """Return (rig that is simulated, None for a real one; model), both with the same valve."""
    from pam_actuation.rigging.layouts import SIMULATED
    from pam_sim import load_rig, preset_names
    from pam_sim.errors import InputError
    if args.rig is None and args.hardware is None:
        raise InputError('give --rig NAME|FILE for a simulated rig, or --hardware NAME|FILE for '
                         'a real one', 'nothing to record')
    if args.rig is not None and args.hardware is not None:
        raise InputError('goes without --hardware: a rig is simulated or real', '--rig')
    if args.hardware == SIMULATED:
        raise InputError('is no real rig; a simulated one is --rig NAME|FILE --live',
                         f'--hardware {SIMULATED}')
    if args.live and args.hardware is not None:
        raise InputError('goes without --hardware, which is live already', '--live')
    if args.domain_id is not None and not args.live and args.hardware is None:
        raise InputError('goes with --live or --hardware', '--domain-id')
    if args.namespace is not None and not args.run:
        raise InputError('goes with bags that are there already', '--namespace')
    truth = None if args.rig is None else load_rig(args.rig, valve=args.valve)
    valve = truth.valve if truth is not None else args.valve
    model = load_rig(args.model, valve=valve if args.model in preset_names() else None)
    if valve is not None and model.valve != valve:
        raise InputError(f'has valve {model.valve}, the rig has {valve}', str(args.model))
    return truth, model


def _given(args: argparse.Namespace) -> 'list[RecordedRun]':
    """
    Return the bags that are there already.

    Raises
    ------
    InputError
        One cannot be read, or means something else than it says.

    """
    from pam_actuation.bags.load import load_run
    runs = [load_run(path, namespace=args.namespace) for path in args.run]
    note_implausible(args, runs, must_be_right=True)
    return runs


def _recorder(args: argparse.Namespace, truth: 'Rig | None', model: 'Rig',
              bar: Any) -> 'Recorder':
    """Return what records, as the options say."""
    if truth is not None and not args.live:
        from pam_actuation.investigate.simulated import SimulatedRecorder
        return SimulatedRecorder(truth)
    from pam_actuation.investigate.live import LiveRecorder
    from pam_sim.errors import InputError
    if not args.yes and not sys.stdin.isatty():
        raise InputError('nobody can be asked here before the muscle moves; give --yes where '
                         'every motion is allowed', 'standard input')
    if args.hardware:
        from pam_actuation.nodes.hardware_check import check_hardware
        from pam_actuation.rigging import layouts
        check_hardware(layouts.rig(
            rig=str(args.model), valve=model.valve, hardware=args.hardware))

    def ask(motion: 'Motion') -> bool:
        bar.clear()
        print(motion.text(), file=sys.stderr, flush=True)
        if args.yes:
            return True
        print('Start? Type yes; anything else ends here: ', end='', file=sys.stderr, flush=True)
        return sys.stdin.readline().strip() == YES

    return LiveRecorder(truth or model, ask, args.hardware or '', args.domain_id)


def _reporter(args: argparse.Namespace, bar: Any) -> Any:
    """Return what tells the progress: on the bar, or a line for each step in a log file."""
    said: list[str] = []

    def report(share: float, step: str) -> None:
        bar.update(share - bar.n)
        bar.set_description_str(step)
        if bar.disable and not args.json and step != 'done' and said[-1:] != [step]:
            print(step, flush=True)
            said.append(step)
    return report
