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
stands for anything. A ``code-block`` with a caption is a file of that name. If the caption is
``Terminal N``, the commands keep running beside the rest, in a terminal of their own.
"""

import doctest
import os
from pathlib import Path
import re
import signal
import subprocess
import sys
import time

from sybil import Document, Region
from sybil.parsers.markdown.lexers import FencedCodeBlockLexer
from sybil.parsers.myst.lexers import DirectiveLexer

LONGEST_S = 180.0
_STOPS_WITHIN_S = 20.0
_CHECKER = doctest.OutputChecker()
_FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def environment():
    """Return the variables of a terminal in which the package is installed."""
    return {**os.environ, 'COLUMNS': '99', 'NO_COLOR': '1',
            'PATH': f'{Path(sys.executable).parent}{os.pathsep}{os.environ["PATH"]}'}


class Walk:
    """A reader of one page: an empty folder, terminals, and the count of what was done."""

    def __init__(self, folder):
        self.folder = Path(folder)
        self.commands = 0
        self.env = environment()
        self._beside = []

    def write(self, name, text):
        """Write a file of the page."""
        (self.folder / name).write_text(text, encoding='utf-8')

    def type_in(self, commands):
        """Run each command to its end and compare what it prints."""
        for command, shown in commands:
            self.commands += 1
            done = subprocess.run(
                ['bash', '-c', command], cwd=self.folder, env=self.env, text=True,
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
                timeout=LONGEST_S)
            assert_printed(command, shown, done.stdout)
            # 1 is a finding; a mistake of the user (2) must be shown in the page.
            assert done.returncode in (0, 1) or (done.returncode == 2 and shown), done.stdout

    def keep_running(self, commands):
        """Start commands in a terminal of their own; wait for the first line that is shown."""
        (command, shown), = commands
        self.commands += 1
        log = (self.folder / f'.terminal_{len(self._beside)}').open('w+', encoding='utf-8')
        process = subprocess.Popen(
            ['bash', '-c', f'exec {command}'], cwd=self.folder, env=self.env, stdout=log,
            stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL)
        self._beside.append((process, command, shown, log))
        ready = re.compile(re.escape(shown.splitlines()[0]).replace(r'\.\.\.', '.*'))
        end_s = time.monotonic() + LONGEST_S
        while not ready.search(Path(log.name).read_text(encoding='utf-8')):
            assert process.poll() is None, Path(log.name).read_text(encoding='utf-8')
            assert time.monotonic() < end_s, f'{command} does not say {shown}'
            time.sleep(0.1)

    def stop(self, check=True):
        """Press Ctrl-C in every other terminal, the newest first; compare what was printed."""
        for process, command, shown, log in reversed(self._beside):
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            try:
                process.wait(_STOPS_WITHIN_S)
            except subprocess.TimeoutExpired:
                process.kill()
                raise
            finally:
                log.close()
            if check:
                text = Path(log.name).read_text(encoding='utf-8')
                assert_printed(command, shown, text)
        self._beside.clear()


def assert_printed(command, shown, printed):
    """Fail, with both texts, unless a command printed what the page shows."""
    if shown and not _CHECKER.check_output(shown + '\n', printed.rstrip() + '\n', _FLAGS):
        raise AssertionError(f'$ {command}\nthe page shows:\n{shown}\nit prints:\n{printed}')


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
        if caption.startswith('Terminal '):
            yield Region(lexed.start, lexed.end, commands_in(source), _evaluate_terminal)
        elif caption:
            yield Region(lexed.start, lexed.end, (caption, source), _evaluate_file)


def _evaluate_commands(example):
    example.namespace['walk'].type_in(example.parsed)


def _evaluate_terminal(example):
    example.namespace['walk'].keep_running(example.parsed)


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
    except BaseException:
        reader.stop(check=False)
        raise
    reader.stop()
    return reader.commands
