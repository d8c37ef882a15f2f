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
Text that a microcontroller sent and a terminal kept: stamps before, and labels before numbers.

``10:00:00.125 -> 101.2,30.5`` is what the Arduino IDE writes with time stamps. Its plotter shows
lines such as ``Pressure:101.2 Length:30.5``. Both become rows with separators, line by line.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
import io
import re
from typing import Any

from pam_actuation.tables.formats.layout_of_text import encoding_of, LINE_END, TextLayout

_STAMPED = re.compile(
    r'\[?((?:\d{4}-\d{1,2}-\d{1,2}[T ])?\d{1,2}:\d{2}:\d{2}(?:[.,]\d+)?)(?:\]\s*|\s*->\s*)(.*)')
_LABELLED = re.compile(
    r'\s*"?([^\W\d][^:="\t,;|{}]*?)"?\s*[:=]\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|nan)'
    r'(?:\s?([a-zA-Z%°][\w%°/]*)(?=$|[\s,;|}]))?(?:[\s,;|]+|$)')
_LOOKED_AT = 200                     # lines
_FEWEST = 3


@dataclass(frozen=True)
class SerialLog:
    """
    How the lines of a log are laid out.

    Parameters
    ----------
    encoding : str
        Of the text.
    is_stamped : bool
        Whether a time of day stands before each line.
    separator : str
        That is put behind the stamp, and between numbers that had labels.
    labels, units : tuple of str
        Of the numbers of a line; empty where they have none.

    """

    encoding: str
    is_stamped: bool
    separator: str
    labels: tuple[str, ...] = ()
    units: tuple[str, ...] = ()

    def opened(self, original: Callable[[], Any]) -> Callable[[], Any]:
        """Return what opens the text as rows with separators, as a stream of bytes."""
        def open_rows() -> Any:
            with original() as stream:
                return io.BytesIO(self.rows(stream.read()))
        return open_rows

    def rows(self, content: bytes) -> bytes:
        """Return a text as rows with separators; a line that is laid out otherwise stays."""
        text = content.decode(self.encoding, errors='surrogateescape')
        parts = re.split(f'({LINE_END.pattern})', text)
        parts[::2] = [self._row(line) for line in parts[::2]]
        return ''.join(parts).encode(self.encoding, errors='surrogateescape')

    def _row(self, line: str) -> str:
        stamp, rest = _parted(line) if self.is_stamped else ('', line)
        if self.labels:
            named = _labelled(rest)
            if [(name, unit) for name, _, unit in named] != list(zip(self.labels, self.units)):
                return line
            rest = self.separator.join(number for _, number, _ in named)
        if not stamp:
            return rest
        is_head = rest[:1].isalpha() and not self.labels
        return f'{"time" if is_head else stamp}{self.separator}{rest}'

    def named(self, layout: TextLayout) -> TextLayout:
        """Return the layout of the rows with the labels as names."""
        names = (('time',) if self.is_stamped else ()) + self.labels
        if not self.labels or len(names) != len(layout.names):
            return layout
        units = (('',) if self.is_stamped else ()) + self.units
        return replace(layout, names=names, units=units, called={})


def serial_log(head: bytes, path: str) -> SerialLog | None:
    """
    Return how a text is laid out that a terminal kept; None for any other text.

    Parameters
    ----------
    head : bytes
        Its beginning.
    path : str
        The file, for messages.

    Raises
    ------
    InputError
        It is no text.

    """
    encoding = encoding_of(head, path)
    lines = [line for line in LINE_END.split(
        head.decode(encoding, errors='ignore'))[:_LOOKED_AT] if line.strip()]
    stamped = [rest for stamp, rest in map(_parted, lines) if stamp]
    is_stamped = len(stamped) >= _FEWEST and 2 * len(stamped) > len(lines)
    contents = stamped if is_stamped else lines
    named = Counter(tuple(name for name, _, _ in _labelled(line)) for line in contents)
    labels, count = named.most_common(1)[0] if named else ((), 0)
    if labels and count >= _FEWEST and 2 * count > len(contents) and (
            len(set(labels)) == len(labels)):
        first = next(one for one in map(_labelled, contents)
                     if tuple(name for name, _, _ in one) == labels)
        return SerialLog(encoding, is_stamped, '\t', labels, tuple(unit for _, _, unit in first))
    if not is_stamped:
        return None
    separator = next((one for one in ';\t,|' if 2 * sum(one in line for line in stamped)
                      > len(stamped)), ' ')
    return SerialLog(encoding, True, separator)


def _parted(line: str) -> tuple[str, str]:
    """Return the stamp before a line and the rest; '' and the line without one."""
    found = _STAMPED.fullmatch(line.strip())
    return (found[1], found[2]) if found else ('', line)


def _labelled(line: str) -> list[tuple[str, str, str]]:
    """Return label, number and unit of all numbers of a line; none where it holds more."""
    text = line.strip().removeprefix('{').removesuffix('}').strip()
    found, place = [], 0
    while place < len(text):
        one = _LABELLED.match(text, place)
        if one is None or one.end() == place:
            return []
        found.append((one[1].strip(), one[2], one[3] or ''))
        place = one.end()
    return found
