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

"""
The measured part of a page of docs/results, written by the benchmark that measured it.

A page holds what a person wrote, and between two markers what a benchmark printed::

    <!-- begin: benchmarks/tracking.py -->
    …
    <!-- end: benchmarks/tracking.py -->

With ``--write`` the text between them is replaced: the command, the date, the commit, the machine
and the tables. A page with several measurements has several such parts, told apart by a word after
the name of the file. Only the last run is kept.
"""

import argparse
from collections.abc import Callable, Iterator
import contextlib
from importlib.metadata import version
import io
import os
from pathlib import Path
import platform
import shlex
import subprocess
import sys
import time
from typing import TextIO

from pam_sim.errors import InputError
from pam_sim.files import write_text

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / 'docs' / 'results'
NOT_RECORDED = 'Date and commit: not recorded.'


def add_write(parser: argparse.ArgumentParser, page: str) -> None:
    """
    Add the option ``--write``, which writes into a page of docs/results.

    Parameters
    ----------
    parser : argparse.ArgumentParser
        Parser of the benchmark; the name of the page becomes its default ``page``.
    page : str
        Name of the page without its ending.

    """
    parser.add_argument(
        '--write', action='store_true', help=f'write the tables to docs/results/{page}.md')
    parser.set_defaults(page=page)


@contextlib.contextmanager
def printed(args: argparse.Namespace, program: str, part: str = '') -> Iterator[None]:
    """
    Write what the block prints into the page, if ``--write`` was given and the block ends well.

    Parameters
    ----------
    args : argparse.Namespace
        Parsed by a parser that ``add_write`` extended.
    program : str
        ``__file__`` of the benchmark.
    part : str
        Which part of the page, where the benchmark has several.

    Raises
    ------
    SystemExit
        As ``check``, before the work begins.

    """
    if not args.write:
        yield
        return
    path, name = check(args, program, part), name_of(program, part)
    head, copy = heading(program, sys.argv[1:]), io.StringIO()
    with contextlib.redirect_stdout(Both(sys.stdout, copy)):
        yield
    write_text(path, replaced(path, name, f'{head}\n\n{copy.getvalue().strip()}'))


def run(parser: argparse.ArgumentParser, program: str,
        show: Callable[[argparse.Namespace], int | None]) -> int:
    """
    Run a benchmark with one table: read the command line, print, and write where asked.

    Parameters
    ----------
    parser : argparse.ArgumentParser
        Extended by ``add_write``.
    program : str
        ``__file__`` of the benchmark.
    show : callable
        Takes what was parsed and prints the table; returns an exit code or none.

    Returns
    -------
    int
        The exit code.

    Raises
    ------
    SystemExit
        As ``check``, before the work begins.

    """
    args = parser.parse_args()
    with printed(args, program):
        return show(args) or 0


def check(args: argparse.Namespace, program: str, part: str = '') -> Path:
    """
    Look whether ``--write`` can be done; return the path of the page.

    Parameters
    ----------
    args, program, part
        As for ``printed``.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    SystemExit
        The page is missing or has no such part, or JSON was asked for: the sentence is printed
        and the exit code is 2. Without ``--write`` nothing is looked at.

    """
    path = FOLDER / f'{args.page}.md'
    if args.write:
        try:
            if getattr(args, 'json', False):
                raise InputError('goes without --json: a page needs tables', '--write')
            replaced(path, name_of(program, part), '')
        except InputError as error:
            print(error, file=sys.stderr)
            raise SystemExit(2) from None
    return path


class Both(io.TextIOBase):
    """
    A stream that passes on to two others what is written to it.

    Parameters
    ----------
    first, second : TextIO
        The two streams.

    """

    def __init__(self, first: TextIO, second: TextIO) -> None:
        self._streams = first, second

    def write(self, text: str) -> int:
        """Write a text to both; return its length."""
        for stream in self._streams:
            stream.write(text)
        return len(text)

    def flush(self) -> None:
        """Flush both."""
        for stream in self._streams:
            stream.flush()


def name_of(program: str, part: str = '') -> str:
    """Return the name of a part in its markers, such as ``benchmarks/tracking.py``."""
    return f'benchmarks/{Path(program).name} {part}'.strip()


def replaced(path: Path, name: str, content: str) -> str:
    """
    Return the text of a page with another content between the markers of a part.

    Parameters
    ----------
    path : pathlib.Path
        The page.
    name : str
        Name of the part, of ``name_of``.
    content : str
        What comes between the markers.

    Returns
    -------
    str

    Raises
    ------
    InputError
        The page is missing, or does not hold each marker once, the first before the second.

    """
    begin, end = f'<!-- begin: {name} -->\n', f'<!-- end: {name} -->\n'
    if not path.is_file():
        raise InputError('is missing; write the page with its markers first', str(path))
    text = path.read_text(encoding='utf-8')
    if text.count(begin) != 1 or text.count(end) != 1 or text.index(begin) > text.index(end):
        raise InputError(
            f'needs one line {begin.strip()} and, after it, one line {end.strip()}', str(path))
    before, _, rest = text.partition(begin)
    return f'{before}{begin}\n{content}\n\n{end}{rest.partition(end)[2]}'


def heading(program: str, arguments: list[str]) -> str:
    """
    Return the lines that say how, when, at which commit and where a benchmark ran.

    Parameters
    ----------
    program : str
        ``__file__`` of the benchmark.
    arguments : list of str
        Its command line. ``--write`` is left out; of an absolute path the last part is named.

    Returns
    -------
    str

    """
    shown = [Path(one).name if os.path.isabs(one) else one
             for one in arguments if one != '--write']
    command = f'python benchmarks/{Path(program).name} {shlex.join(shown)}'.strip()
    return (f'    {command}\n\nRun on {time.strftime("%Y-%m-%d")} at commit {commit()}. '
            f'{machine()}.')


def commit(root: Path = ROOT) -> str:
    """Return the commit of a checkout in short, and whether its files differ from it."""
    def git(*words: str) -> str:
        done = subprocess.run(
            ['git', *words], cwd=root, text=True, capture_output=True, check=False)
        return done.stdout.strip()

    found = git('rev-parse', '--short', 'HEAD')
    if not found:
        return 'unknown'
    changed = git('status', '--porcelain', '--', '.', ':!docs/results')
    return f'{found} with changes' if changed else found


def machine() -> str:
    """Return processor, cores, versions and the load of the last minute in one line."""
    model = ''
    with contextlib.suppress(OSError):
        for line in Path('/proc/cpuinfo').read_text(encoding='utf-8').splitlines():
            if line.startswith('model name'):
                model = line.partition(':')[2].strip()
                break
    model = model or platform.processor() or platform.machine()
    return (f'Machine: {model}, {os.cpu_count()} cores, Python {platform.python_version()}, '
            f'NumPy {version("numpy")}, numba {version("numba")}. '
            f'Load average before: {os.getloadavg()[0]:.1f}')
