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
The command line of a node: ``--help``, and nothing else besides the arguments of ROS.

Answered before anything is imported that takes time or needs ROS, and without joining the graph.
The help is the node's page of ``docs/reference/nodes``, which is made from the code.
"""

from collections.abc import Sequence
import os
import re
import shutil
import sys
import textwrap

from pam_actuation.namespaces import namespace_of
from pam_actuation.resources import node_page
from pam_sim.errors import InputError

HELP = ('-h', '--help')
NARROWEST = 60
WIDEST = 99
EXIT_DONE, EXIT_BAD_INPUT = 0, 2
# Of a page: what only readers of Markdown need.
_LEFT_OUT = ('Made from the code',)


def answer(name: str, arguments: Sequence[str]) -> int | None:
    """
    Answer a request for help, refuse what is not known.

    Parameters
    ----------
    name : str
        Executable and node name.
    arguments : list of str
        What follows the name of the program.

    Returns
    -------
    int or None
        Exit code with which the process is to end; None: the node is to start.

    """
    try:
        if any(one in HELP for one in arguments):
            _show(help_text(name))
            return EXIT_DONE
        in_order(arguments)
    except InputError as error:
        print(f'{name}: {error}', file=sys.stderr)
        return EXIT_BAD_INPUT
    return None


def in_order(arguments: Sequence[str]) -> list[str]:
    """
    Return the arguments with the namespace as ROS takes it.

    Raises
    ------
    InputError
        The namespace is none, or an argument stands outside of ``--ros-args ... --``, where
        nobody would read it.

    """
    of_ros, ordered = False, []
    for before, one in zip(['', *arguments], arguments):
        if one == '--ros-args':
            of_ros = True
        elif one == '--':
            of_ros = False
        elif not of_ros:
            raise InputError(
                'is not known, allowed are --help and what stands behind --ros-args, such as '
                '--ros-args -r __ns:=/leg -p NAME:=VALUE', f'argument {one}')
        node, sign, namespace = one.partition('__ns:=')
        if sign and before in ('-r', '--remap'):
            one = f'{node}{sign}{namespace_of(namespace) or "/"}'
        ordered.append(one)
    return ordered


def help_text(name: str, width: int | None = None) -> str:
    """
    Return the page of a node as text for a terminal.

    Raises
    ------
    InputError
        The page is not installed.

    """
    if width is None:
        width = shutil.get_terminal_size().columns
    width = min(max(width, NARROWEST), WIDEST)
    usage = f'usage: {name} [-h] [--ros-args [-r FROM:=TO] [-p PARAMETER:=VALUE] ...]'
    blocks = node_page(name).read_text(encoding='utf-8').strip().split('\n\n')[1:]
    texts = [_as_text(block, width) for block in blocks if not block.startswith(_LEFT_OUT)]
    return '\n\n'.join([usage, *texts]) + '\n'


def _as_text(block: str, width: int) -> str:
    """Return one block of a page, separated by empty lines there, as text."""
    if block.startswith('## '):
        return f'{block.removeprefix("## ")}:'
    if block.startswith('|'):
        rows = [[_plain(cell.strip()) for cell in re.split(r'(?<!\\)\|', line)[1:-1]]
                for line in block.splitlines()]
        head, rows = rows[0], rows[2:]
        return _parameters(head, rows, width) if 'meaning' in head else _columns(rows)
    if block.startswith('    '):
        return block
    return textwrap.fill(_plain(block), width)


def _plain(text: str) -> str:
    """Return text without the marks of Markdown."""
    text = re.sub(r'\[([^\]]+)\]\([^)]*\)', r'\1', text)
    return re.sub(r'\\(.)', r'\1', text).replace('`', '')


def _columns(rows: Sequence[Sequence[str]]) -> str:
    widths = [max(map(len, column)) for column in zip(*rows)]
    return '\n'.join('  ' + '  '.join(
        cell.ljust(size) for cell, size in zip(row, widths)).rstrip() for row in rows)


def _parameters(head: Sequence[str], rows: Sequence[Sequence[str]], width: int) -> str:
    """Return the lines of parameters: name, default, unit, allowed; below them the meaning."""
    lines = []
    for name, *cells in rows:
        told = dict(zip(head[1:], cells))
        default, unit, allowed, meaning = (
            told[key] for key in ('default', 'unit', 'allowed', 'meaning'))
        facts = [f'default {default or repr("")}{unit and f" {unit}"}', f'allowed: {allowed}']
        facts += ['may change while it runs'] if told.get('live') == 'yes' else []
        lines += textwrap.wrap(f'{name}  ({", ".join(facts)})', width,
                               initial_indent='  ', subsequent_indent='      ')
        lines += textwrap.wrap(meaning, width, initial_indent='      ',
                               subsequent_indent='      ')
    return '\n'.join(lines)


def _show(text: str) -> None:
    try:
        print(text, end='', flush=True)
    except BrokenPipeError:     # as by `valve_driver --help | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
