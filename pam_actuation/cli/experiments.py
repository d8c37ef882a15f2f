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

"""``pam experiments``: those that can be named, and one that follows a column of a table."""

import argparse
import shlex
import shutil
from typing import Any, TYPE_CHECKING

from pam_actuation.cli.common import emit, EXIT_DONE
from pam_actuation.cli.options import Parser, source
from pam_actuation.cli.overview import wrapped
from pam_actuation.cli.samples import add_samples_options, make, refuse_without_samples

if TYPE_CHECKING:
    from pam_actuation.experiments.experiment import Experiment

HELP = """List the experiments with length and what they track, the rigs and the controllers.

With --samples a column of a table, such as a gait that was measured, becomes an experiment."""
EXAMPLE = 'pam experiments staircase'
# What a person reads for each domain; those in brackets run without a controller.
TRACKS = {
    'contraction': 'contraction', 'force': 'force', 'joint_angle': 'joint angle',
    'pressure': '- (pressure)', 'ppr_voltage': '- (ppr voltage)', 'hsv_duty': '- (hsv duty)'}
# What pam simulate needs for experiments that are not for one muscle with a load.
NEEDS = {'joint_angle': ' --rig joint_dmsp_5_300_realistic',
         'force': ' --rig dmsp_5_300_isometric_realistic --controller sofc_force_ppr'}


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('name', type=source, nargs='?', default=None, metavar='NAME|FILE',
                        help='show this experiment in full')
    add_samples_options(parser)


def run(args: argparse.Namespace) -> int | None:
    """Print one line per experiment, or one experiment in full."""
    if args.samples is not None:
        out, made = make(args)
        name, told = made.experiment.name, made.told
        following = f'pam simulate {shlex.quote(str(out))}{NEEDS.get(made.experiment.domain, "")}'
        emit(args, {'experiment': out, **_summary(name, made.experiment), 'remarks': told},
             '\n'.join([f'{name}: {told[0]}', *(f'  {text}' for text in told[1:]),
                        f'experiment: {out}',
                        f'next: {following}']))
        return EXIT_DONE
    refuse_without_samples(args)
    from pam_actuation.experiments import load_experiment
    from pam_actuation.resources import list_config
    from pam_sim.joint.model_file import joint_preset_names
    from pam_sim.model_file import preset_names
    if args.name is not None:
        one = load_experiment(args.name)
        data = {'schema': 1, 'experiment': {**_summary(args.name, one), **one.to_dict()}}
        emit(args, data, f'# {one.duration_s:g} s, {_followed(one)}\n{one.to_yaml().rstrip()}')
        return EXIT_DONE
    found = {name: load_experiment(name) for name in list_config('experiments')}
    rigs, joints = preset_names(), joint_preset_names()
    controllers = list_config('controllers')
    wide = max(shutil.get_terminal_size((119, 24)).columns, 99)
    lines = [f'{"experiment":24}{"length":>8}  {"tracks":17}what it is for']
    lines += [shorten(f'{name:24}{f"{one.duration_s:.1f} s":>8}  {TRACKS[one.domain]:17}'
                      f'{one.description}', wide) for name, one in found.items()]
    for title, names in (('rigs (--rig, in full: pam models)', rigs),
                         ('joints (pam up knee --model)', joints),
                         ('controllers (--controller)', controllers)):
        lines += ['', title, wrapped(names)]
    lines += ['', 'next: pam experiments NAME, or pam simulate NAME']
    emit(args, {
        'schema': 1, 'experiments': [_summary(name, one) for name, one in found.items()],
        'rigs': rigs, 'joints': joints, 'controllers': controllers}, '\n'.join(lines))
    return EXIT_DONE


def shorten(line: str, wide: int) -> str:
    """Return a line that fits, cut between two words where it is too long."""
    return line if len(line) <= wide else f'{line[:wide - 2].rpartition(" ")[0]} …'


def _followed(one: 'Experiment') -> str:
    """Return in words what a controller tracks, or what is commanded without one."""
    if one.asks_for_motion:
        return f'a controller tracks the {TRACKS[one.domain]}'
    return f'the {TRACKS[one.domain].strip("- ()")} is commanded, without a controller'


def _summary(name: str, one: 'Experiment') -> dict[str, Any]:
    """Return what a program may want to know of an experiment, as plain data."""
    return {'name': name, 'description': one.description, 'domain': one.domain,
            'tracks': one.domain if one.asks_for_motion else None,
            'duration_s': one.duration_s, 'needs': list(one.needs)}
