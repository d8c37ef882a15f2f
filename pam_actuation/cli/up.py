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

"""``pam up``: bring a whole rig up in order and keep it up, without ``ros2 launch``."""

import argparse
from dataclasses import replace
import sys
from typing import TYPE_CHECKING

from pam_actuation.cli.common import (
    add_other_rig_option, add_overwrite_option, emit, EXIT_DONE, EXIT_FINDING, say_remarks,
    tell_remarks)
from pam_actuation.cli.lasting import lasting_output
from pam_actuation.cli.options import count, HIGHEST_SEED, number, out_path, Parser, source
from pam_actuation.cli.viewed import add_view_option, viewed
from pam_actuation.rigging.domain import HIGHEST_OF_ROS
from pam_sim.errors import InputError
from pam_sim.files import check_file
from pam_sim.valve import VALVES

if TYPE_CHECKING:
    from pam_actuation.rigging.node_spec import NodeSpec
    from pam_sim.joint.rig import JointRig
    from pam_sim.rig import Rig

HELP = 'Bring up the nodes of a muscle, a joint or both knees, in order; vent first at the end.'
EXAMPLE = 'pam up knee --valve hsv --experiment joint_sine'


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('what', choices=('rig', 'knee', 'exo'),
                        help='one muscle, a joint with two, two joints')
    parser.add_argument('--valve', choices=VALVES, default=None,
                        help='valve type (default: that of the rig or joint)')
    parser.add_argument('--model', '--rig', dest='model', type=source, default=None,
                        metavar='NAME|FILE',
                        help='rig or joint: preset, or path of a model file (default: '
                             'dmsp_5_300_realistic, joint_dmsp_5_300_realistic)')
    parser.add_argument('--controller', type=source, default=None, metavar='NAME',
                        help='controller preset or file, or none: one of your own commands the '
                             'pressure (default: that of valve and experiment)')
    add_other_rig_option(parser)
    parser.add_argument('--experiment', type=source, default=None, metavar='NAME',
                        help='what is played (default: references come from elsewhere)')
    parser.add_argument('--hardware', type=source, default='sim', metavar='NAME',
                        help='sim; topics: sensors and valve are a program of your own; another '
                             'name in config/hardware, or a file')
    parser.add_argument('--params-file', type=source, default=None, metavar='FILE',
                        help='ROS parameter file for all nodes, by name or wildcard: what the '
                             'options leave open, such as max_pressure_gauge_pa')
    parser.add_argument('--angle', choices=('sensors', 'topic'), default='sensors',
                        help='who publishes the angle of a real joint: hardware_sensors, or a '
                             'program of your own (default: %(default)s)')
    parser.add_argument('--record', type=out_path, default=None, metavar='DIR',
                        help='folder of a bag; of exo, of a bag for each knee')
    parser.add_argument('--namespace', default=None, help='default: /muscle, /knee, none')
    parser.add_argument('--name', type=source, default=None, metavar='NAME',
                        help='of the muscle or joint in its messages (default: muscle; of a joint '
                             'by the namespace, left_knee in /left/knee)')
    parser.add_argument('--seed', type=count(0, HIGHEST_SEED - 3), default=None, metavar='N',
                        help='seed of the simulated sensors (default: by the namespace)')
    parser.add_argument('--domain-id', type=count(0, HIGHEST_OF_ROS), default=None, metavar='N',
                        help='ROS domain (default: ROS_DOMAIN_ID, else 0; this machine only)')
    parser.add_argument('--realtime-priority', type=count(0, 96), default=0,
                        metavar='N', help='of all nodes, 1 to 96 (default: none)')
    parser.add_argument('--seconds', type=number(0.0, None, 's'), default=None, metavar='S',
                        help='end after this time (default: on Ctrl-C, or when a node ends)')
    add_view_option(parser)
    parser.add_argument('--policy', type=out_path, metavar='FILE', default=None,
                        help='start nothing; write the access policy of these nodes (SROS2)')
    add_overwrite_option(
        parser, 'the bag that is there, once the new one is whole; of --policy the file')


@lasting_output()
def run(args: argparse.Namespace) -> int:
    """
    Bring up, watch, take down.

    Exit code 1 if a node found a fault, ended, or did not end in order.

    Once all are active Ctrl-C is the ordinary end, exit code 0; before, it is an interruption.
    """
    if args.policy is None:
        from pam_actuation.rigging.node_template import prepare_template
        prepare_template()
    from pam_actuation.bags.place import check_bag_target
    from pam_actuation.drivers.vented import check_rig_vents
    from pam_actuation.interrupts import undisturbed
    from pam_actuation.nodes.hardware_check import check_hardware, check_users_file
    from pam_actuation.rigging.plan import RECORDER
    from pam_actuation.rigging.supervisor import Supervisor
    from pam_actuation.rigging.transitions import SessionFailed, termination_as_interrupt
    if args.policy is not None:
        check_file(args.policy, args.overwrite, ours='Made from the code, as docs/')
    model = _model(args)
    check_rig_vents(model)
    args.valve = args.valve or model.valve
    nodes = _nodes(args)
    check_hardware(nodes)
    if args.params_file is not None:
        say_remarks(args, check_users_file(args.params_file, nodes))
    if args.policy is None:
        for node in nodes:
            if node.name == RECORDER:
                check_bag_target(node.parameters['output'], args.overwrite)
    _check_controller(args)
    _tell_remarks(args)
    if args.policy is not None:
        return _write_policy(args, nodes)
    failure, problems, faults, is_up = '', [], [], False
    with termination_as_interrupt(), viewed(args, environment=True) as domain_id, Supervisor(
            nodes, domain_id, args.realtime_priority) as supervisor:
        try:
            supervisor.start()
            is_up = True
            if not args.json:
                print(f'{len(supervisor.processes)} nodes are active, Ctrl-C vents and ends:\n  '
                      + '\n  '.join(supervisor.processes) + _played(args), flush=True)
            supervisor.watch(args.seconds, tell=lambda text: print(text, file=sys.stderr))
        except SessionFailed as error:
            failure = str(error)
        except KeyboardInterrupt:
            pass
        with undisturbed():
            waiting = supervisor.not_begun() if is_up and not failure else []
            problems = waiting + supervisor.finish(failure)
            faults = list(dict.fromkeys(supervisor.faults))
            codes = {name: process.exit_code for name, process in supervisor.processes.items()}
    if not is_up and not failure:
        raise KeyboardInterrupt('; '.join(['stopped while the nodes started', *problems]))
    findings = list(dict.fromkeys(filter(None, [failure, *faults, *problems])))
    text = '\n'.join(f'finding: {one}' for one in findings) or 'vented, all nodes ended in order'
    emit(args, {'failure': failure, 'faults': faults, 'problems': problems,
                'exit_codes': codes}, text)
    return EXIT_FINDING if findings else EXIT_DONE


def _model(args: argparse.Namespace) -> 'JointRig | Rig':
    """Return rig or joint that is asked for."""
    from pam_sim import load_rig
    from pam_sim.joint import load_joint
    if args.what == 'rig':
        return load_rig(args.model or 'dmsp_5_300_realistic', valve=args.valve)
    return load_joint(args.model or 'joint_dmsp_5_300_realistic', valve=args.valve)


def _check_controller(args: argparse.Namespace) -> None:
    """Raise InputError for a controller that its node would refuse, before any node starts."""
    from pam_actuation.control.config import load_controller
    from pam_actuation.rigging.layouts import NO_CONTROLLER
    if args.controller in (None, NO_CONTROLLER):
        return
    load_controller(args.controller, _model(args), accept_other_rig=args.accept_other_rig)


def _tell_remarks(args: argparse.Namespace) -> None:
    """Say what a person should read before the experiment is played."""
    if not args.experiment:
        return
    from pam_actuation.experiments import load_experiment
    from pam_sim import load_rig
    rig = None
    if args.what == 'rig':
        rig = load_rig(args.model or 'dmsp_5_300_realistic', valve=args.valve)
    tell_remarks(args, load_experiment(args.experiment), args.valve, rig, model=args.model)


def _played(args: argparse.Namespace) -> str:
    """Return the line on how long an experiment lasts, and what comes after it."""
    if not args.experiment:
        return ''
    from pam_actuation.experiments import load_experiment
    experiment = load_experiment(args.experiment)
    return (f'\nexperiment "{experiment.name}": {experiment.duration_s:g} s, '
            'then its last value is held')


def _write_policy(args: argparse.Namespace, nodes: 'list[NodeSpec]') -> int:
    from pam_actuation.nodes.policy import policy
    from pam_sim.files import write_text
    path = str(write_text(args.policy, policy(nodes)))
    emit(args, {'policy': path, 'nodes': len(nodes)}, f'policy of {len(nodes)} nodes: {path}')
    return EXIT_DONE


def _nodes(args: argparse.Namespace) -> 'list[NodeSpec]':
    """Return the nodes that are asked for."""
    from pam_actuation.namespaces import namespace_of, namespace_part
    from pam_actuation.rigging import layouts
    options = {'valve': args.valve, 'controller': args.controller or '',
               'experiment': args.experiment or '', 'accept_other_rig': args.accept_other_rig,
               'record': args.record or '', 'overwrite': args.overwrite}
    if args.namespace is not None:
        options['namespace'] = namespace_of(args.namespace, '--namespace')
    if args.model:
        options['rig' if args.what == 'rig' else 'joint'] = args.model
    options['hardware'] = args.hardware
    if args.name is not None:
        if args.what == 'exo':
            raise InputError('is for one muscle or joint; those of exo are left_knee and '
                             'right_knee', '--name')
        options['name'] = namespace_part(args.name, '--name')
    if args.seed is not None:
        if args.hardware != layouts.SIMULATED:
            raise InputError('is of simulated sensors only', '--seed')
        options['seed'] = args.seed
    of_joint = args.what != 'rig' and args.hardware != layouts.SIMULATED
    if args.angle == layouts.BY_TOPIC and not of_joint:
        raise InputError('is for a joint on hardware only', '--angle')
    if args.what == 'rig':
        nodes = layouts.rig(**options)
    else:
        nodes = getattr(layouts, args.what)(**options, angle=args.angle)
    return [replace(node, users_file=args.params_file or '') for node in nodes]
