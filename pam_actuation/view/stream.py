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
What is sent to the browser: a picture of a window of time, then only what changed in it.

Time is divided into columns of the screen, counted from time 0. A message gives for each line the
columns with values and their extremes. One stream serves every page that shows the same, so its
work is done once, whatever the number of pages.

A message is little-endian: the length of a JSON text as uint32, the text, filled up with spaces
to a multiple of 4 bytes. Then come, for each line, column numbers less ``base`` as int32, first
and second extreme as float32. The text has ``kind`` (``all`` or ``new``), ``layout``,
``width_s``, ``count``, ``base``, ``now`` (in columns, less ``base``) and ``sizes``.
"""

from collections.abc import Sequence
import json
import struct
from typing import Any, Final, TYPE_CHECKING

import numpy as np
from pam_actuation.view.history import columns
from pam_actuation.view.plots import PLOTS
from pam_sim.annotations import FloatArray, IntArray

if TYPE_CHECKING:
    from pam_actuation.view.store import Line, Store

COLUMNS: Final = 600                    # across the page
WINDOWS_S: Final = (2, 5, 10, 30, 60)   # that can be chosen; 60 s are kept
Part = tuple[IntArray, FloatArray, FloatArray]


def encode(header: dict[str, Any], base: int, parts: Sequence[Part]) -> bytes:
    """Return one message of the form above."""
    text = json.dumps({**header, 'base': base, 'sizes': [len(part[0]) for part in parts]})
    raw = text.encode()
    raw += b' ' * (-len(raw) % 4)
    pieces = [struct.pack('<I', len(raw)), raw]
    for numbers, first, second in parts:
        pieces += [(numbers - base).astype('<i4').tobytes(), first.astype('<f4').tobytes(),
                   second.astype('<f4').tobytes()]
    return b''.join(pieces)


def decode(message: bytes) -> tuple[dict[str, Any], list[Part]]:
    """Return header and parts of a message, with column numbers from time 0."""
    length, = struct.unpack_from('<I', message)
    header = json.loads(message[4:4 + length])
    place, parts = 4 + length, []
    for size in header['sizes']:
        numbers = np.frombuffer(message, '<i4', size, place).astype(np.int64) + header['base']
        first = np.frombuffer(message, '<f4', size, place + 4 * size)
        second = np.frombuffer(message, '<f4', size, place + 8 * size)
        parts.append((numbers, first, second))
        place += 12 * size
    return header, parts


class Stream:
    """
    The pictures of one namespace in one length of window.

    Parameters
    ----------
    store : Store
    view : str
        Namespace; those below it are shown too.
    window_s : float
        Time across the page [s].

    """

    def __init__(self, store: 'Store', view: str, window_s: float) -> None:
        self.view, self.window_s = view, window_s
        self._store = store
        self._width_ns = round(window_s * 1e9 / COLUMNS)
        self._lines: list[Line] = []
        self._sent: list[tuple[int, int]] = []      # per line: epoch, end of its history
        self.layout_number = 0

    def layout(self) -> dict[str, Any]:
        """Return which lines are in which plots, numbered as in the messages, for the page."""
        several = len({line.namespace for line in self._lines}) > 1
        plots: list[dict[str, Any]] = []
        for plot in PLOTS:
            namespaces = dict.fromkeys(
                line.namespace for line in self._lines if line.signal.plot == plot.key)
            for namespace in namespaces:
                below = namespace.removeprefix(self.view).strip('/') or namespace
                plots.append({
                    'key': plot.key, 'namespace': namespace, 'unit': plot.unit,
                    'title': f'{plot.title} ({below})' if several else plot.title,
                    'lines': [{'index': index, 'label': line.signal.label}
                              for index, line in enumerate(self._lines)
                              if (line.signal.plot, line.namespace) == (plot.key, namespace)]})
        return {'type': 'layout', 'layout': self.layout_number, 'view': self.view,
                'window_s': self.window_s, 'plots': plots}

    def refresh(self) -> bool:
        """Look for lines that came since; return whether there are other lines now."""
        lines = self._store.lines(self.view)
        if lines == self._lines:
            return False
        self._lines = lines
        self._sent = [(0, 0)] * len(lines)
        self.layout_number += 1
        return True

    def picture(self, end_ns: int | None = None) -> bytes:
        """Return the whole window that ends at a time [ns], by default with all that is there."""
        store = self._store
        with store.lock:
            now_ns = store.now_ns() if end_ns is None else end_ns
            parts = []
            for line in self._lines:
                times_ns = store.history(line).times_ns
                begin, stop = 0, len(times_ns)
                if now_ns is not None:
                    begin = int(np.searchsorted(times_ns, now_ns - self._width_ns * COLUMNS))
                if end_ns is not None:
                    stop = int(np.searchsorted(times_ns, end_ns, side='right'))
                # One row more: a line comes in from the left edge.
                parts.append(self._part(line, max(begin - 1, 0), stop))
        return self._message('all', now_ns, parts)

    def changes(self) -> bytes:
        """Return the columns that changed since the last call."""
        store, parts = self._store, []
        with store.lock:
            now_ns = store.now_ns()
            for index, line in enumerate(self._lines):
                history = store.history(line)
                epoch, end = self._sent[index]
                begin = history.first_new(end if epoch == history.epoch else 0)
                times_ns = history.times_ns
                if begin < len(times_ns):
                    # The column of the first new row may have begun with older ones.
                    column_ns = int(times_ns[begin]) // self._width_ns * self._width_ns
                    oldest = int(times_ns[-1]) - self._width_ns * COLUMNS
                    begin = int(np.searchsorted(times_ns, max(column_ns, oldest)))
                parts.append(self._part(line, begin, len(times_ns)))
                self._sent[index] = history.epoch, history.end
        return self._message('new', now_ns, parts)

    def _part(self, line: 'Line', begin: int, stop: int) -> Part:
        """Return the columns of rows ``begin`` to ``stop`` in the unit of the page."""
        history, signal = self._store.history(line), line.signal
        numbers, first, second = columns(
            history.times_ns[begin:stop], history.values(signal.value)[begin:stop],
            self._width_ns)
        return (numbers, signal.factor * (first + signal.offset),
                signal.factor * (second + signal.offset))

    def _message(self, kind: str, now_ns: int | None, parts: Sequence[Part]) -> bytes:
        base = 0 if now_ns is None else now_ns // self._width_ns
        now = 0.0 if now_ns is None else now_ns % self._width_ns / self._width_ns
        return encode({'kind': kind, 'layout': self.layout_number, 'count': COLUMNS,
                       'width_s': self._width_ns * 1e-9, 'now': round(now, 3),
                       'now_s': None if now_ns is None else now_ns * 1e-9}, base, parts)
