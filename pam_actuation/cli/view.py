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

"""``pam view``: a rig that runs, or a bag, as a page in the browser."""

import argparse
import json
import os
import threading
from typing import TYPE_CHECKING

from pam_actuation.cli.common import add_overwrite_option, add_recover_option, EXIT_DONE
from pam_actuation.cli.options import count, out_path, Parser, source
from pam_actuation.cli.viewed import need_tornado
from pam_actuation.rigging.domain import HIGHEST_OF_ROS
from pam_sim.errors import InputError

if TYPE_CHECKING:
    from pam_actuation.nodes.view_listener import ViewListener
    from pam_actuation.view.server import ViewServer
    from pam_actuation.view.source import Source

HELP = ('Show a running rig live in the browser: plots, state of every node, emergency stop. '
        'With a bag: the same page with a time slider.')
EXAMPLE = 'pam view runs/first'
NICENESS = 10           # whatever the rig does goes before


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('bag', nargs='?', type=source, default=None,
                        help='recording to show (default: the rig that runs)')
    parser.add_argument('--namespace', default=None,
                        help='show this namespace only (default: all)')
    parser.add_argument('--domain-id', type=count(0, HIGHEST_OF_ROS), default=None, metavar='N',
                        help='ROS domain (default: ROS_DOMAIN_ID, else 0; if pam runs nodes in '
                             'another domain of this machine only, that one)')
    parser.add_argument('--host', type=source, default=None, metavar='ADDRESS',
                        help='address to listen on, 0.0.0.0 for all; who comes then needs the '
                             'token that is printed (default: this machine only)')
    parser.add_argument('--port', type=count(0, 65535), default=None, metavar='N',
                        help='port, 0 for any (default: the first free one from 8750 on)')
    parser.add_argument('--foxglove', action='store_true',
                        help='serve the topics of the running rig to Foxglove instead of a page, '
                             'to this machine only (default port: 8765)')
    parser.add_argument('--layout', type=out_path, default=None, metavar='FILE',
                        help='with --foxglove: write a layout for Foxglove, of --namespace '
                             '(default there: /muscle)')
    parser.add_argument('--open', action='store_true', help='open the page in a browser here')
    add_overwrite_option(parser, 'the layout that is there')
    add_recover_option(parser)


def run(args: argparse.Namespace) -> int:
    """Serve the page until Ctrl-C, which is the ordinary end."""
    if args.foxglove:
        return _serve_foxglove(args)
    if args.layout is not None:
        raise InputError('goes with --foxglove', '--layout')
    need_tornado()
    from pam_actuation.namespaces import namespace_of
    from pam_actuation.view.access import Access
    from pam_actuation.view.server import ViewServer
    access = Access(args.host)
    namespace = '' if args.namespace is None else namespace_of(args.namespace, '--namespace')
    if args.bag is not None:
        if args.domain_id is not None:
            raise InputError('is for a running rig, not for a bag', '--domain-id')
        from pam_actuation.view.recording import load
        from pam_actuation.view.source import BagSource
        recording = load(args.bag, args.recover, namespace)
        return _serve(args, ViewServer(BagSource(recording), access, args.port), None)
    try:
        from pam_actuation.nodes.view_listener import ViewListener
    except ImportError as error:
        from pam_actuation.ros_missing import ros_missing
        raise InputError(ros_missing(error.name or 'rclpy')) from None
    os.nice(max(NICENESS - os.nice(0), 0))
    listener = ViewListener(_domain(args), namespace)
    try:
        return _serve(args, ViewServer(listener, access, args.port), listener)
    finally:
        listener.close()


def _serve_foxglove(args: argparse.Namespace) -> int:
    """Serve the topics to Foxglove until Ctrl-C."""
    from pam_actuation.namespaces import MUSCLE, namespace_of
    from pam_actuation.view.layouts import foxglove_layout
    from pam_sim.files import check_file, write_text
    if args.bag is not None:
        raise InputError('is for a running rig; Foxglove opens the .mcap file of a bag itself',
                         '--foxglove')
    for name in ('host', 'open'):
        if getattr(args, name):
            raise InputError('does not go with --foxglove, whose server has no password and '
                             'listens to this machine only', f'--{name}')
    try:
        from pam_actuation.nodes.foxglove_server import FoxgloveServer, PORT
    except ImportError as error:
        from pam_actuation.ros_missing import ros_missing
        raise InputError(ros_missing(error.name or 'rclpy')) from None
    namespace = '' if args.namespace is None else namespace_of(args.namespace, '--namespace')
    if args.layout is not None:
        check_file(args.layout, args.overwrite)
    os.nice(max(NICENESS - os.nice(0), 0))
    server = FoxgloveServer(_domain(args), namespace, PORT if args.port is None else args.port)
    try:
        if args.layout is not None:
            write_text(args.layout, foxglove_layout(namespace or MUSCLE))
        print(json.dumps({'url': server.url, 'live': True}) if args.json else
              f'Foxglove: Open connection, {server.url}\n'
              'Ctrl-C ends it; the rig goes on without it', flush=True)
        while True:
            server.run_once()
    except KeyboardInterrupt:
        return EXIT_DONE
    finally:
        server.close()


def _domain(args: argparse.Namespace) -> int | None:
    """Return the domain to look at, None for that of the environment."""
    from pam_actuation.rigging.domain import domains_in_use
    if args.domain_id is not None or 'ROS_DOMAIN_ID' in os.environ:
        return args.domain_id
    others = domains_in_use()
    return others[0] if len(others) == 1 else None


def _serve(args: argparse.Namespace, server: 'ViewServer', listener: 'ViewListener | None') -> int:
    server.start()
    try:
        _say(args, server.source, server.url)
        while True:
            if listener is None:
                threading.Event().wait(3600.0)
            else:
                listener.run_once()
    except KeyboardInterrupt:
        return EXIT_DONE
    finally:
        server.stop()


def _say(args: argparse.Namespace, shown: 'Source', url: str) -> None:
    if args.json:
        told: dict[str, object] = {'url': url, 'live': shown.live}
        if not shown.live:
            told['remarks'] = shown.remarks
        print(json.dumps(told), flush=True)
    else:
        end = 'Ctrl-C ends it; the rig goes on without it' if shown.live else 'Ctrl-C ends it'
        remarks = [f'remark: {text}' for text in shown.remarks]
        print('\n'.join([f'page: {url}', *remarks, end]), flush=True)
    if args.open:
        import webbrowser
        webbrowser.open(url)
