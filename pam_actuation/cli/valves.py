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

"""``pam valves compare``: the regulator and the on/off pair, measured on the same rig."""

import argparse

from pam_actuation.cli.common import (
    add_overwrite_option, add_seed_option, check_outputs, emit, EXIT_DONE, progress)
from pam_actuation.cli.options import number, out_path, Parser, source

HELP = 'Compare the valve types on one rig: accuracy, response, air, ripple, power, power loss.'
EXAMPLE = 'pam valves compare --rig dmsp_5_300_realistic --html valves.html'


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('what', choices=('compare',), help='what to do with the valves')
    parser.add_argument(
        '--rig', type=source, default='dmsp_5_300_realistic', metavar='NAME|FILE',
        help='rig preset or model YAML; its valve is replaced (default: %(default)s)')
    add_seed_option(parser, 'seed of the sensor noise')
    parser.add_argument(
        '--hold', type=number(2.0, 3600.0, 's'), default=60.0, metavar='SECONDS',
        help='length of the holds (default: %(default)g)')
    parser.add_argument('--html', type=out_path, metavar='FILE', default=None,
                        help='write an HTML page too')
    parser.add_argument(
        '--power', action='append', default=[], metavar='NAME=VALUE',
        help='a power number: ppr_power_w, hsv_peak_power_w, hsv_peak_time_s, hsv_hold_power_w')
    add_overwrite_option(parser)


def run(args: argparse.Namespace) -> int | None:
    """Measure, print both tables, write the page asked for."""
    from pam_actuation.valves.compare import compare, STAGES
    from pam_actuation.valves.energy import power_arguments
    from pam_actuation.report.valves import as_page, as_text
    from pam_actuation.valves.table42 import statements
    from pam_sim import load_rig
    from pam_sim.files import write_text
    check_outputs(args, args.html)
    rig, power = load_rig(args.rig), power_arguments(args.power)
    with progress(args, STAGES, description='valves') as bar:
        result = compare(rig, args.seed, power, args.hold, progress=bar.update)
    shown = as_text(result)
    if args.html is not None:
        shown += f'\n\npage: {write_text(args.html, as_page(result))}'
    emit(args, {**result, 'statements': statements(result)}, shown)
    return EXIT_DONE
