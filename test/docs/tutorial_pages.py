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
Runs the tutorials as a reader would: their files are written, their commands are typed.

In a page, a ``console`` block holds commands, each after ``$``, and what they print; ``...``
stands for anything. A ``code-block`` with a caption is a file of that name. Three captions
are kept for terminals:

``Terminal N``
    The command keeps running beside the rest. The page goes on when the first line that it
    shows is printed.
``Terminal N, after Ctrl-C``
    Ctrl-C ends the command of that terminal; the block shows what it prints then.
``Terminal N, at its end``
    The page waits until that command ends without help; the block shows what it prints then.

Terminals that still run when the page is over get Ctrl-C.
"""

from pathlib import Path
import re

from sybil import Document, Region
from sybil.parsers.markdown.lexers import FencedCodeBlockLexer
from sybil.parsers.myst.lexers import DirectiveLexer
from terminals import assert_printed, environment, Terminal

__all__ = ['assert_printed', 'commands_in', 'environment', 'walk', 'Walk']

_AFTER = 'after Ctrl-C'
_AT_END = 'at its end'


class Walk:
    """A reader of one page: an empty folder, terminals, and the count of what was done."""

    def __init__(self, folder):
        self.folder = Path(folder)
        self.commands = 0
        self._beside = {}

    def write(self, name, text):
        """Write a file of the page."""
        (self.folder / name).write_text(text, encoding='utf-8')

    def type_in(self, commands):
        """Run each command to its end and compare what it prints."""
        for command, shown in commands:
            self._open(command, shown).wait()

    def keep_running(self, name, commands):
        """Start a command in a terminal of its own; wait for the first line that is shown."""
        assert len(commands) == 1 and commands[0][1], (
            f'`{name}` needs one command after `$ ` and at least one line that it prints')
        assert name not in self._beside, f'`{name}` still runs {self._beside[name].command}'
        self._beside[name] = self._open(*commands[0])
        self._beside[name].wait_for_first_line()

    def end(self, name, moment, shown_then):
        """End the command of a terminal, or wait for its end, as the caption says."""
        assert moment in (_AFTER, _AT_END), (
            f'caption `{name}, {moment}`: allowed after the comma: `{_AFTER}`, `{_AT_END}`')
        assert name in self._beside, f'`{name}, {moment}`: no command runs in `{name}`'
        terminal = self._beside.pop(name)
        if moment == _AFTER:
            terminal.interrupt(shown_then)
        else:
            terminal.shown = f'{terminal.shown}\n{shown_then}'.rstrip()
            terminal.wait()

    def finish(self):
        """Press Ctrl-C in every other terminal, the newest first; compare what was printed."""
        while self._beside:
            self._beside.popitem()[1].interrupt()

    def abandon(self):
        """End every other terminal after a failure, the newest first; compare nothing."""
        while self._beside:
            self._beside.popitem()[1].kill()

    def _open(self, command, shown):
        self.commands += 1
        return Terminal(command, shown, self.folder, self.folder / f'.printed_{self.commands}')


def commands_in(source):
    """Return (command, shown output) of a console block; a final backslash continues a line."""
    found = []
    for part in re.split(r'^\$ ', source, flags=re.M)[1:]:
        lines = part.rstrip().split('\n')
        count = 1
        while lines[count - 1].endswith('\\'):
            count += 1
        found.append(('\n'.join(lines[:count]), '\n'.join(lines[count:])))
    return found


def _commands(document):
    for lexed in FencedCodeBlockLexer('console')(document):
        source = lexed.lexemes['source']
        yield Region(lexed.start, lexed.end, commands_in(source), _evaluate_commands)


def _captioned(document):
    for lexed in DirectiveLexer('code-block')(document):
        caption = lexed.lexemes['options'].get('caption', '')
        source = str(lexed.lexemes['source'])
        name, comma, moment = caption.partition(', ')
        if not caption.startswith('Terminal '):
            parsed, evaluate = (caption, source), _evaluate_file
        elif comma:
            parsed, evaluate = (name, moment, source.strip()), _evaluate_end
        else:
            parsed, evaluate = (name, commands_in(source)), _evaluate_terminal
        if caption:
            yield Region(lexed.start, lexed.end, parsed, evaluate)


def _evaluate_commands(example):
    example.namespace['walk'].type_in(example.parsed)


def _evaluate_terminal(example):
    example.namespace['walk'].keep_running(*example.parsed)


def _evaluate_end(example):
    example.namespace['walk'].end(*example.parsed)


def _evaluate_file(example):
    example.namespace['walk'].write(*example.parsed)


def walk(page, folder):
    """Follow a page in an empty folder; return how many commands were run."""
    document = Document.parse(str(page), _commands, _captioned)
    reader = Walk(folder)
    document.namespace['walk'] = reader
    try:
        for example in document.examples():
            example.evaluate()
        reader.finish()
    finally:
        reader.abandon()
    return reader.commands
