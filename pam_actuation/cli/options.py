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
Types of command line options: numbers with range and unit, whole numbers, paths, names.

Each is given to ``add_argument(type=…)``. A value that is not allowed ends the program with
one sentence and exit code 2, before anything is loaded.
"""

import argparse
from collections.abc import Callable, Sequence
import json
import math
import os
import re
import sys
from typing import Any, NoReturn

from pam_sim.errors import did_you_mean, InputError
from pam_sim.files import shown

EXIT_DONE = 0
EXIT_FINDING = 1        # something is wrong with the data or the run
EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130
LONGEST_NAME_BYTES = 255      # of one file or folder, on every file system in use
HIGHEST_SEED = 2**32 - 1
_NEGATIVE_RANGE = re.compile(r'-\.?\d[^:]*:')
_DECIMAL_COMMA = re.compile(r'[+-]?\d*,\d+')


class Parser(argparse.ArgumentParser):
    """A parser that reports a mistake in one line, without repeating the usage."""

    as_json = False

    def parse_known_args(  # type: ignore[override]  # one of the overloads, as pam calls it
            self, args: Sequence[str] | None = None,
            namespace: argparse.Namespace | None = None) -> tuple[argparse.Namespace, list[str]]:
        """Parse as always; note first whether mistakes are to be reported as JSON."""
        words = sys.argv[1:] if args is None else list(args)
        self.as_json = any(len(word) > 2 and '--json'.startswith(word) for word in words)
        found, unknown = super().parse_known_args(_with_ranges(words), namespace)
        if unknown and self._subparsers is None:        # of a verb: its options are known here
            known = [word for action in self._actions for word in action.option_strings]
            hint = did_you_mean(unknown[0].partition('=')[0], known, '')
            self.error(f'unrecognized arguments: {" ".join(unknown)}{hint}')
        return found, unknown

    def error(self, message: str) -> NoReturn:
        """Report the mistake and exit with code 2."""
        said = ' '.join(message.removeprefix('argument ').split())
        complain(said, EXIT_BAD_INPUT, self.prog, self.as_json)
        self.exit(EXIT_BAD_INPUT)

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        """Refuse what is not among the choices, with the nearest one of them."""
        if action.choices is not None and value not in action.choices:
            names = [str(one) for one in action.choices]
            what = 'not a verb of pam' if action.dest == 'verb' else 'not allowed'
            shown = f'{names[0]} to {names[-1]}' if len(names) > 30 else ', '.join(names)
            raise argparse.ArgumentError(
                None if action.dest == 'verb' else action,
                f'{str(value)!r} is {what}{did_you_mean(value, names)}; allowed: {shown}')


def _with_ranges(words: Sequence[str]) -> list[str]:
    """Return words in which a range such as -15:15 is told from an option."""
    found: list[str] = []
    for word in words:
        if _NEGATIVE_RANGE.match(word) and found and re.fullmatch('--[a-z-]+', found[-1]):
            found[-1] += f'={word}'
        else:
            found.append(word)
    return found


def complain(sentence: str, code: int, program: str, as_json: bool = False) -> int:
    """
    Say why a verb did not do its work; return the exit code.

    One line on stderr, ``program: sentence``. For programs, beside it, one JSON document on
    stdout, where they look for the result: ``{"error": sentence, "exit_code": code}``.
    """
    if as_json:
        print(json.dumps({'error': sentence, 'exit_code': code}, indent=2))
    print(f'{program}: {sentence}', file=sys.stderr)
    return code


def allowed_text(lowest: float | None = None, highest: float | None = None, unit: str = '') -> str:
    """Return a range in words: ``0 to 5 s``, ``0 s or more``, ``at most 5 s``, ``any number``."""
    end = f' {unit}' if unit else ''
    if lowest is None and highest is None:
        return f'any number, in {unit}' if unit else 'any number'
    if highest is None:
        return f'{lowest:.10g}{end} or more'
    if lowest is None:
        return f'at most {highest:.10g}{end}'
    return f'{lowest:.10g} to {highest:.10g}{end}'


def number(lowest: float | None = None, highest: float | None = None,
           unit: str = '') -> Callable[..., Any]:
    """
    Return the type of an option that is a finite number.

    Parameters
    ----------
    lowest, highest : float, optional
        Bounds, themselves allowed.
    unit : str
        What the user writes the number in, for the message.

    """
    allowed = allowed_text(lowest, highest, unit)

    def read(text: str) -> float | None:
        try:
            value = float(text)
        except ValueError:
            raise _refused(text, 'is not a number', allowed) from None
        if not math.isfinite(value):
            raise _refused(text, 'is not a finite number', allowed)
        _check_range(value, text, lowest, highest, allowed)
        return value
    return read


def count(lowest: int = 0, highest: int | None = None,
          also: dict[int, str] | None = None) -> Callable[..., Any]:
    """
    Return the type of an option that is a whole number.

    Parameters
    ----------
    lowest, highest : int, optional
        Bounds, themselves allowed.
    also : dict, optional
        Single values outside the bounds and what they mean, such as ``{-1: 'one a core'}``.

    """
    also = also or {}
    allowed = ', or '.join([allowed_text(lowest, highest),
                            *(f'{value} for {meaning}' for value, meaning in also.items())])

    def read(text: str) -> int | None:
        try:
            value = int(text)
        except ValueError:
            raise _refused(text, 'is not a whole number', allowed) from None
        if value not in also:
            _check_range(value, text, lowest, highest, allowed)
        return value
    return read


def out_path(text: str) -> str:
    """Return the path of a file or folder to write; refuse what can be none."""
    _check_text(text, 'give a file or folder')
    for name in text.split(os.sep):
        length = len(os.fsencode(name))
        if length > LONGEST_NAME_BYTES:
            raise argparse.ArgumentTypeError(
                f'the name {name[:20]}… is {length} bytes long; allowed is '
                f'{LONGEST_NAME_BYTES} at most')
    return text


def source(text: str) -> str:
    """Return the name or path of something to read; refuse what can be neither."""
    _check_text(text, 'give a name or a file')
    return text


def pair(text: str) -> tuple[str, str]:
    """Return the two sides of ``NAME=TOPIC``; refuse what is not of this form."""
    name, equals, other = (part.strip() for part in text.partition('='))
    if not (name and equals and other):
        raise argparse.ArgumentTypeError(
            f'{shown(text)!r} is not NAME=TOPIC, such as pressure=/daq/p1')
    return name, other


def refuse_unused(args: argparse.Namespace, declare: Callable[[Parser], None],
                  unused: Sequence[str], asked: str) -> None:
    """
    Refuse an option that the answer to what is ``asked`` would not regard.

    Parameters
    ----------
    args : argparse.Namespace
        The options as given.
    declare : callable
        Declares the options of the verb.
    unused : sequence of str
        Attributes of ``args`` that make no difference.
    asked : str
        For the sentence: ``does not go with ...``.

    Raises
    ------
    InputError
        One of them is given.

    """
    declared = Parser()
    declare(declared)
    for action in declared._actions:
        if action.dest in unused and getattr(args, action.dest) != action.default:
            name = (action.option_strings or [action.dest])[0]
            raise InputError(f'does not go with {asked}', name)


class Pairs(argparse.Action):
    """Gather what ``pair`` returns into one dict; a name given twice is a mistake."""

    def __call__(self, parser: argparse.ArgumentParser, namespace: argparse.Namespace,
                 values: Any, option_string: str | None = None) -> None:
        """Take one more pair."""
        name, other = values
        found = getattr(namespace, self.dest) or {}
        if name in found:
            raise argparse.ArgumentError(self, f'{name} is given twice')
        setattr(namespace, self.dest, {**found, name: other})


def _check_text(text: str, wanted: str) -> None:
    if not text.strip():
        raise argparse.ArgumentTypeError(f'is empty; {wanted}')
    if '\0' in text:
        raise argparse.ArgumentTypeError(f'holds a zero byte; {wanted}')


def _check_range(value: float, text: str, lowest: float | None, highest: float | None,
                 allowed: str) -> None:
    if lowest is not None and value < lowest or highest is not None and value > highest:
        raise argparse.ArgumentTypeError(f'is {shown(text)}; allowed is {allowed}')


def _refused(text: str, why: str, allowed: str) -> argparse.ArgumentTypeError:
    """Return the error of a text that is no number of the kind wanted."""
    if _DECIMAL_COMMA.fullmatch(text.strip()):
        why += ': write a decimal point, not a comma'
    return argparse.ArgumentTypeError(f'{shown(text)!r} {why}; allowed is {allowed}')
