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

"""``pam nodes``: parameters, topics and services of every node, from the nodes themselves."""

import argparse
from pathlib import Path

from pam_actuation.cli.common import add_overwrite_option, emit, EXIT_DONE
from pam_actuation.cli.options import out_path, Parser, refuse_unused, source

HELP = 'List the nodes with parameters, topics and services; write their pages.'
EXAMPLE = 'pam nodes valve_driver'
# Options that would change nothing beside another one.
UNUSED = {'--topics': ('name', 'markdown', 'overwrite'), '--markdown': ('name',)}


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('name', type=source, nargs='?', default=None,
                        help='show the page of this node')
    parser.add_argument('--markdown', type=out_path, metavar='DIR', default=None,
                        help='write a Markdown page per node into this folder; pages made this '
                             'way before are made again')
    parser.add_argument('--topics', type=out_path, metavar='DIR', default=None,
                        help='write the list of topics anew into this folder of their pages, '
                             'and a page of each topic that has none written by hand; needs no '
                             'ROS')
    add_overwrite_option(parser)


def run(args: argparse.Namespace) -> int:
    """Print the names, or one page; write the pages asked for."""
    from pam_sim.errors import did_you_mean, InputError
    from pam_sim.files import check_folder, whole_files, write_text
    asked = '--topics' if args.topics is not None else '--markdown'
    if getattr(args, asked.strip('-')) is not None:
        refuse_unused(args, add_arguments, UNUSED[asked], asked)
    if args.topics is not None:
        written = _write_topics(Path(args.topics))
        emit(args, {'schema': 1, 'nodes': {}, 'written': written},
             '\n'.join(f'page: {path}' for path in written))
        return EXIT_DONE
    if args.markdown is not None:
        check_folder(args.markdown)
    try:
        from pam_actuation.nodes.interfaces import VARIANTS
        from pam_actuation.nodes.pages import pages
    except ImportError as error:
        from pam_actuation.ros_missing import ros_missing
        raise InputError(ros_missing(error.name or 'rclpy')) from None
    if args.name is not None and args.name not in VARIANTS:
        raise InputError(f'no node {args.name!r}{did_you_mean(args.name, VARIANTS)}; known are '
                         f'{", ".join(VARIANTS)}', 'name')
    texts = {Path(file).stem: text for file, text in pages().items()}
    if args.markdown is not None:
        files = {f'{name}.md': text for name, text in texts.items()}
        folder = check_folder(
            args.markdown, files, args.overwrite, ours='by `pam nodes --markdown')
        with whole_files(folder) as temporary:
            for name, text in files.items():
                write_text(temporary / name, text)
        written = [str(folder / name) for name in files]
        shown = '\n'.join(f'page: {path}' for path in written)
    else:
        written = []
        shown = texts[args.name] if args.name else '\n'.join(
            f'{name}: {text.splitlines()[2]}' for name, text in texts.items())
    emit(args, {'schema': 1, 'nodes': texts, 'written': written}, shown)
    return EXIT_DONE


def _write_topics(folder: Path) -> list[str]:
    """Write list and pages of the topics; return their paths."""
    from pam_actuation.models.topics import INDEX, pages
    from pam_sim.errors import InputError
    from pam_sim.files import whole_files, write_text
    if not (folder / INDEX).is_file():
        raise InputError(
            f'has no {INDEX}; give the folder of the pages of the topics', str(folder))
    files = pages(folder)
    with whole_files(folder) as temporary:
        for name, text in files.items():
            write_text(temporary / name, text)
    return [str(folder / name) for name in files]
