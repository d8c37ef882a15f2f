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

"""What verbs that run nodes share to show them live in the browser meanwhile."""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
import sys
import tempfile

from pam_actuation.cli.options import Parser


def add_view_option(parser: Parser) -> None:
    """Add the option that shows the nodes live."""
    parser.add_argument('--view', action='store_true',
                        help='show it live in the browser meanwhile; prints the address')


def need_tornado() -> None:
    """Raise InputError where the library that serves the page is missing."""
    if find_spec('tornado') is None:
        from pam_sim.errors import InputError
        raise InputError('the live page needs tornado, which is not installed: install the extra '
                         'view, pip install "pam_actuation[view]"')


@contextmanager
def viewed(args: argparse.Namespace, environment: bool = False) -> Iterator[int | None]:
    """
    Serve the live page while the block runs nodes, if ``--view`` asks for it.

    Parameters
    ----------
    args : argparse.Namespace
        With ``view`` and ``domain_id``.
    environment : bool
        Without ``domain_id`` the nodes are in the domain of the environment, not in a free one.

    Yields
    ------
    int or None
        Domain for the nodes, None as given.

    Raises
    ------
    InputError
        The library that serves the page is missing.

    """
    if not args.view:
        yield args.domain_id
        return
    need_tornado()
    from pam_actuation.rigging.domain import DomainLock, own_domain
    from pam_actuation.rigging.view_process import page_beside
    wanted = args.domain_id
    if wanted is None and environment:
        wanted = own_domain()
    lock = DomainLock(wanted)
    try:
        with tempfile.TemporaryDirectory(prefix='pam_view_') as folder, \
                page_beside(lock.domain_id, folder) as url:
            print(f'page: {url}' if url else 'remark: the live page did not start; the rig does',
                  file=sys.stderr, flush=True)
            yield lock.domain_id
    finally:
        lock.release()
