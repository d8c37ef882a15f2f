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

"""What all verbs share: exit codes, output for people or programs, progress."""

import argparse
import json
import math
import os
import sys
from types import SimpleNamespace
from typing import Any, TYPE_CHECKING

from pam_actuation.cli.options import (  # noqa: F401, the codes are for the verbs
    count, EXIT_BAD_INPUT as EXIT_BAD_INPUT, EXIT_DONE as EXIT_DONE,
    EXIT_FINDING as EXIT_FINDING, HIGHEST_SEED, pair, Pairs, Parser, source)

if TYPE_CHECKING:
    from collections.abc import Iterable

    from pam_actuation.bags.load import RecordedRun
    from pam_actuation.experiments.experiment import Experiment
    from pam_sim.rig import Rig
    from tqdm import tqdm


def emit(args: argparse.Namespace, payload: dict[str, Any], text: str) -> None:
    """
    Print the result of a verb.

    Parameters
    ----------
    args : argparse.Namespace
        With ``json``: print ``payload`` as one JSON document instead of the text.
    payload : dict
        The result for programs, plain data. A number that is not finite is null in JSON.
    text : str
        The result for people.

    """
    implausible = getattr(args, 'implausible', [])
    if implausible:
        payload = {**payload, 'implausible': implausible}
        new = [sentence for sentence in implausible if sentence.rstrip('.') not in text]
        text = '\n'.join([text, *(f'warning: {sentence}' for sentence in new)])
    print(json.dumps(_finite(payload), indent=2, default=str, allow_nan=False)
          if args.json else text)


def _finite(data: Any) -> Any:
    """Return plain data with None for every number that JSON has not."""
    if isinstance(data, dict):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, (list, tuple)):
        return [_finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


def read_line(question: str) -> str:
    """Return the line with which a person at a terminal answers; InputError after Ctrl-D."""
    try:
        return input(question)
    except EOFError:
        from pam_sim.errors import InputError
        raise InputError('the answers ended before the questions; nothing was written') from None


def effect_names(args: argparse.Namespace) -> list[str]:
    """
    Return the effects that ``--effects`` lists, none without the option.

    Raises
    ------
    InputError
        A name that no effect of the library has.

    """
    from pam_sim.effects.registry import effects
    from pam_sim.plugins import pick
    names: list[str] = args.effects.split(',') if args.effects else []
    for name in names:
        pick(effects(), name, 'effect', '--effects')
    return names


def note_implausible(args: argparse.Namespace, runs: 'list[RecordedRun]',
                     must_be_right: bool = False) -> None:
    """
    Note lost messages and values that cannot be right: ``emit`` says it, the verb ends with 1.

    Parameters
    ----------
    args : argparse.Namespace
        Of the verb.
    runs : list of RecordedRun
        What ``load_run`` returned.
    must_be_right : bool
        Refuse values that mean something else than they say, a wrong unit for instance.

    Raises
    ------
    InputError
        As above, with the first such sentence.

    """
    from pam_sim.errors import InputError
    for run in runs:
        if must_be_right and run.unusable:
            raise InputError(run.unusable[0].rstrip('.'), run.path)
        several = f'{run.path}: ' if len(runs) > 1 else ''
        found = [f'{several}{sentence}' for sentence in (*run.left_out, *run.implausible)]
        args.implausible = [*getattr(args, 'implausible', []), *found]


def progress(args: argparse.Namespace, total: float, unit: str = '',
             description: str = '') -> 'tqdm':
    """
    Return a tqdm bar on stderr; silent with ``--json`` or when stderr is no terminal.

    A log file gets no thousand redrawn lines; set PAM_PROGRESS=1 to force the bar.
    """
    from tqdm import tqdm
    quiet = args.json or not (sys.stderr.isatty() or os.environ.get('PAM_PROGRESS'))
    return tqdm(
        total=total, unit=unit, desc=description, disable=quiet, file=sys.stderr,
        bar_format='{desc}: {percentage:3.0f}%|{bar:30}| {elapsed}<{remaining}')


def add_rig_options(parser: Parser) -> None:
    """Add the options that choose the rig, as used by several verbs."""
    parser.add_argument(
        '--rig', type=source, default='dmsp_5_300_realistic', metavar='NAME|FILE',
        help='rig preset or model YAML (default: %(default)s)')
    parser.add_argument(
        '--valve', metavar='ppr|hsv', default=None,
        help='valve type; default: the one of the rig')


def add_controller_options(
        parser: Parser,
        default: str = 'sofc_ppr or sofc_hsv, after the valve; sofc_force_… for an experiment '
                       'in force; of a joint sofc_joint_… or sofc_knee_…, by its size') -> None:
    """Add the options that choose the controller, as used by several verbs."""
    parser.add_argument(
        '--controller', type=source, default=None, metavar='NAME|FILE',
        help=f'controller preset or YAML (default: {default})')
    parser.add_argument(
        '--rules', type=source, default=None, metavar='FILE', help='rule file to start from')
    parser.add_argument(
        '--freeze', action='store_true', help='keep what is learned frozen: no learning')
    add_other_rig_option(parser)


def add_other_rig_option(parser: Parser) -> None:
    """Add the option that lets a controller run on a rig it was not made for."""
    parser.add_argument(
        '--accept-other-rig', action='store_true',
        help='take a controller that was made for another rig; the bag says so')


def add_experiment_options(parser: Parser) -> None:
    """Add what ``run`` and ``simulate`` both need: experiment, rig, controller, seed."""
    parser.add_argument('experiment', type=source, help='experiment name or YAML file')
    add_rig_options(parser)
    add_controller_options(parser)
    add_seed_option(parser, 'seed of the sensor noise')
    add_overwrite_option(parser, 'the bag that is there, once the new one is whole')


def load_setup(args: argparse.Namespace) -> 'tuple[Experiment, Any, Any]':
    """
    Return (experiment, rig, controller) that the options name.

    The controller is None where the experiment is in pressure or a valve signal.

    Raises
    ------
    InputError
        In any of the three.

    """
    # Here and not above: --help must not wait for the simulator to load.
    from pam_actuation.control.config import load_controller
    from pam_actuation.control.modes.files import preset_for
    from pam_actuation.experiments import load_experiment
    from pam_actuation.experiments.limits import check_tracked
    from pam_sim.joint import load_rig_or_joint
    experiment = load_experiment(args.experiment)
    rig = load_rig_or_joint(args.rig, args.valve)
    experiment.check_reachable(rig)
    if not experiment.asks_for_motion:
        if args.controller or args.rules:       # of no use here, but not to be wrong either
            load_controller(default_controller(args, rig.valve), rig, rules_file=args.rules,
                            accept_other_rig=True)
        return experiment, rig, None
    controller = load_controller(
        args.controller or preset_for(experiment, rig), rig, rules_file=args.rules,
        accept_other_rig=args.accept_other_rig)
    check_tracked(experiment, controller)
    return experiment, rig, controller


def tell_remarks(args: SimpleNamespace | argparse.Namespace, experiment: 'Experiment', valve: str,
                 rig: 'Rig | None' = None,
                 controller: Any = None, model: str | None = None) -> list[str]:
    """Return what a person should read before an experiment runs; say it on stderr."""
    from pam_actuation.drivers.vented import left_remarks
    from pam_actuation.experiments.limits import unknown_remarks
    from pam_sim.idle import idle_remarks
    remarks = [*_of_no_use(args, experiment, controller),
               *experiment.remarks(valve, rig, controller), *unknown_remarks(rig)]
    if rig is not None:
        remarks += left_remarks(rig)
    if model is not None and rig is not None:
        remarks += idle_remarks(model, rig)
    say_remarks(args, remarks)
    return remarks


def _of_no_use(args: SimpleNamespace | argparse.Namespace, experiment: 'Experiment',
               controller: Any) -> list[str]:
    """Return a sentence where options of the controller change nothing."""
    given = [f'--{name}' for name in ('controller', 'rules', 'freeze') if getattr(args, name, '')]
    if given and not experiment.asks_for_motion:
        from pam_actuation.rigging.layouts import NO_CONTROLLER
        if getattr(args, 'controller', '') == NO_CONTROLLER:        # it asks for what happens
            return []
        return [f'experiment "{experiment.name}" runs without a controller, so '
                f'{" and ".join(given)} {"change" if len(given) > 1 else "changes"} nothing']
    return [] if controller is None else frozen_remarks(args, controller)


def frozen_remarks(args: SimpleNamespace | argparse.Namespace, controller: Any) -> list[str]:
    """Return a sentence where ``--freeze`` is given for a controller that does not learn."""
    if not getattr(args, 'freeze', False) or controller.learns:
        return []
    return [f'a {controller.kind} controller does not learn, so --freeze changes nothing']


def say_remarks(args: SimpleNamespace | argparse.Namespace, remarks: 'Iterable[str]') -> None:
    """Say what a person should read on stderr, unless programs read along."""
    if not args.json:
        for text in remarks:
            print(f'remark: {text}', file=sys.stderr, flush=True)


def default_controller(args: argparse.Namespace, valve: str) -> Any:
    """Return the controller the options name, or the preset that fits the valve."""
    return args.controller or f'sofc_{valve}'


def add_seed_option(parser: Parser, text: str) -> None:
    """Add the option of the seed, said to be that of ``text``."""
    parser.add_argument(
        '--seed', type=count(0, HIGHEST_SEED), default=0, metavar='N',
        help=f'{text} (default: %(default)s)')


def add_overwrite_option(parser: 'argparse._ActionsContainer',
                         what: str = 'files that are there already') -> None:
    """Add the option without which no verb replaces ``what``."""
    parser.add_argument('--overwrite', action='store_true', help=f'replace {what}')


def check_outputs(args: argparse.Namespace, *paths: str | None) -> None:
    """
    Look whether the files that the options name can be written, before the work starts.

    Parameters
    ----------
    args : argparse.Namespace
        With ``overwrite``.
    paths : str or None
        None: not asked for.

    Raises
    ------
    InputError
        As ``pam_sim.files.check_file``; two results in one file.

    """
    from pam_sim.errors import InputError
    from pam_sim.files import check_file
    wanted = [os.path.abspath(check_file(path, args.overwrite))
              for path in paths if path is not None]
    for path in wanted:
        if wanted.count(path) > 1:
            raise InputError('two results cannot go into one file', path)


def add_recover_option(parser: Parser) -> None:
    """Add the option that reads what a broken-off recording still holds."""
    parser.add_argument(
        '--recover', action='store_true',
        help='of a recording that broke off, read the messages that are whole')


def add_topic_option(parser: Parser) -> None:
    """Add the option that names topics which go by other names in a bag of others."""
    parser.add_argument(
        '--topic', dest='renamed', type=pair, action=Pairs, default=None, metavar='NAME=TOPIC',
        help='which topic of the bag is one of ours, such as pressure=/daq/p1 (may be repeated); '
             'bags of remapped rigs say it themselves')
