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

import json
import os
import sys

from pam_actuation.cli.options import (  # noqa: F401, the codes are for the verbs
    count, EXIT_BAD_INPUT, EXIT_DONE, EXIT_FINDING, HIGHEST_SEED, source)
from tqdm import tqdm


def emit(args, payload, text):
    """
    Print the result of a verb.

    Parameters
    ----------
    args : argparse.Namespace
        With ``json``: print ``payload`` as one JSON document instead of the text.
    payload : dict
        The result for programs, plain data.
    text : str
        The result for people.

    """
    print(json.dumps(payload, indent=2, default=str) if args.json else text)


def progress(args, total, unit='', description=''):
    """
    Return a tqdm bar on stderr; silent with ``--json`` or when stderr is no terminal.

    A log file gets no thousand redrawn lines; set PAM_PROGRESS=1 to force the bar.
    """
    quiet = args.json or not (sys.stderr.isatty() or os.environ.get('PAM_PROGRESS'))
    return tqdm(
        total=total, unit=unit, desc=description, disable=quiet, file=sys.stderr,
        bar_format='{desc}: {percentage:3.0f}%|{bar:30}| {elapsed}<{remaining}')


def add_rig_options(parser):
    """Add the options that choose the rig, as used by several verbs."""
    parser.add_argument(
        '--rig', type=source, default='dmsp_5_300_realistic', metavar='NAME|FILE',
        help='rig preset or model YAML (default: %(default)s)')
    parser.add_argument(
        '--valve', metavar='ppr|hsv', default=None,
        help='valve type; default: the one of the rig')


def add_controller_options(
        parser, default='sofc_ppr or sofc_hsv, after the valve; sofc_force_… for an experiment '
        'in force'):
    """Add the options that choose the controller, as used by several verbs."""
    parser.add_argument(
        '--controller', type=source, default=None, metavar='NAME|FILE',
        help=f'controller preset or YAML (default: {default})')
    parser.add_argument(
        '--rules', type=source, default=None, metavar='FILE', help='rule file to start from')
    parser.add_argument(
        '--freeze', action='store_true', help='keep the rules frozen: no learning')


def add_experiment_options(parser):
    """Add what ``run`` and ``simulate`` both need: experiment, rig, controller, seed."""
    parser.add_argument('experiment', type=source, help='experiment name or YAML file')
    add_rig_options(parser)
    add_controller_options(parser)
    add_seed_option(parser, 'seed of the sensor noise')
    parser.add_argument('--overwrite', action='store_true', help='replace an existing bag')


def load_setup(args):
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
    from pam_sim import load_rig
    experiment = load_experiment(args.experiment)
    rig = load_rig(args.rig, valve=args.valve)
    if not experiment.tracked:
        return experiment, rig, None
    experiment.check_reachable(rig)
    controller = load_controller(
        args.controller or preset_for(experiment, rig), rig, rules_file=args.rules)
    check_tracked(experiment, controller)
    return experiment, rig, controller


def default_controller(args, valve):
    """Return the controller the options name, or the preset that fits the valve."""
    return args.controller or f'sofc_{valve}'


def add_seed_option(parser, text):
    """Add the option of the seed, said to be that of ``text``."""
    parser.add_argument(
        '--seed', type=count(0, HIGHEST_SEED), default=0, metavar='N', help=text)


def add_recover_option(parser):
    """Add the option that reads what a broken-off recording still holds."""
    parser.add_argument(
        '--recover', action='store_true',
        help='of a recording that broke off, read the messages that are whole')
