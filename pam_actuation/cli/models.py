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

"""``pam models``: the laws, valves, loads, effects, sensors and rigs the simulator knows."""

import argparse
import os
from typing import Any

from pam_actuation.cli.common import (
    add_overwrite_option, check_outputs, emit, EXIT_DONE)
from pam_actuation.cli.options import out_path, Parser, source

HELP = 'List muscle laws, valves, loads and effects with equations, parameters and sources.'
EXAMPLE = 'pam models hysteresis'


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('name', type=source, nargs='?', default=None,
                        help='show this entry in full')
    parser.add_argument('--html', type=out_path, metavar='FILE', default=None,
                        help='write all entries, or the one that is named, as one HTML page')
    parser.add_argument('--markdown', type=out_path, metavar='FILE', default=None,
                        help='write all entries, or the one that is named, as a Markdown page; '
                             'a page made this way before is made again')
    add_overwrite_option(parser)


def run(args: argparse.Namespace) -> int | None:
    """List the catalogue, or one entry in full; write the pages asked for."""
    from pam_actuation.models.text import in_full, overview
    from pam_sim.catalogue import catalogue, find
    from pam_sim.errors import InputError
    from pam_sim.files import check_file
    if args.markdown is not None:
        check_file(args.markdown, args.overwrite, ours='by `pam models --markdown')
    check_outputs(args, args.html)
    if None not in (args.html, args.markdown) and (
            os.path.realpath(args.html) == os.path.realpath(args.markdown)):
        raise InputError('two pages cannot go into one file', args.html)
    entries = catalogue()
    if args.name is not None:
        entries = find(entries, args.name)
    shown = overview(entries) if args.name is None else in_full(entries)
    written = _pages(args, entries)
    payload = {'schema': 1, 'models': entries, 'written': written}
    emit(args, payload, '\n'.join(f'page: {path}' for path in written) if written else shown)
    return EXIT_DONE


def _pages(args: argparse.Namespace, entries: list[dict[str, Any]]) -> list[str]:
    """Write the pages asked for; return their paths."""
    written = []
    if args.html is not None:
        from pam_actuation.models import page
        from pam_sim.files import write_text
        written.append(str(write_text(args.html, page.page(entries))))
    if args.markdown is not None:
        from pam_actuation.models import markdown
        from pam_sim.files import write_text
        written.append(str(write_text(args.markdown, markdown.page(entries))))
    return written
