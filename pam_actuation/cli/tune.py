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

"""``pam tune``: improve the controller offline, on the model, from what was recorded."""

import os

from pam_actuation.cli.common import (
    add_controller_options, default_controller, emit, EXIT_DONE, EXIT_FINDING, progress)

HELP = 'Tune the controller offline against the model of a bag; writes a controller YAML.'
EXAMPLE = 'pam tune runs/first --out tuned.yaml --rollouts 400'


def add_arguments(parser):
    """Declare the options of the verb."""
    parser.add_argument('bag', nargs='*', help='bags that say rig, controller and experiment')
    parser.add_argument('--rig', default=None, metavar='NAME|FILE',
                        help='rig to tune on (default: the one of the bag)')
    parser.add_argument('--valve', metavar='ppr|hsv', default=None, help='valve type')
    parser.add_argument('--experiment', default=None, help='experiment (default: of the bag)')
    add_controller_options(parser)
    parser.add_argument('--rollouts', type=int, default=400, help='budget of simulated runs')
    parser.add_argument('--jobs', type=int, default=1, help='worker processes')
    parser.add_argument('--seed', type=int, default=0, help='seed of search and sensor noise')
    parser.add_argument('--out', default='tuned.yaml', metavar='FILE',
                        help='controller YAML to write (default: %(default)s)')


def run(args):
    """Tune; exit code 1 where the held-out check did not improve."""
    from pam_actuation.bags.load import load_run
    from pam_actuation.control.config import load_controller
    from pam_actuation.experiments import load_experiment
    from pam_actuation.tuning.tune import tune
    from pam_sim import load_rig
    from pam_sim.errors import InputError
    if args.rollouts < 10:
        raise InputError(f'is {args.rollouts}; allowed is 10 or more', '--rollouts')
    metadata = load_run(args.bag[0]).metadata if args.bag else {}
    rig_source = args.rig or metadata.get('rig')
    experiment_source = args.experiment or metadata.get('experiment')
    if not rig_source or not experiment_source:
        raise InputError(
            'no rig or experiment to tune on: give a bag that was recorded here, '
            'or both --rig and --experiment')
    rig = load_rig(rig_source, valve=args.valve)
    controller_source = args.controller or metadata.get('controller') \
        or default_controller(args, rig.valve)
    controller = load_controller(controller_source, rig, rules_file=args.rules)
    experiment = load_experiment(experiment_source)
    with progress(args, args.rollouts, ' rollouts', 'tuning') as bar:
        result = tune(rig, controller, experiment, budget=args.rollouts, seed=args.seed,
                      jobs=args.jobs, progress=lambda done: bar.update(max(done - bar.n, 0)))
    result.save(args.out)
    emit(args, {'controller': os.fspath(args.out), **result.to_dict()},
         f'{result.text()}\ncontroller: {args.out}')
    return EXIT_DONE if result.improved else EXIT_FINDING
