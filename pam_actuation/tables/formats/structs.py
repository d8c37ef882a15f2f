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
Structs, lists of structs and cell arrays of MATLAB to tables.

Recorders write a list of signals, each a struct with its name and its values: dSPACE does so
in ``Y``, a scope of Simulink in ``signals``. Scripts write a list of recordings instead.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from pam_actuation.tables.formats.arrays import columns_of, MOST, SHORTEST, tables_of, Title
from pam_actuation.tables.table import Table

OBJECTS = ('it holds objects of MATLAB, such as a table, which only MATLAB reads; write them '
           'there with writetable, or as arrays with table2array')
_DEEPEST = 6
_MOST_RECORDINGS = 1000
_NAMES = ('name', 'label', 'title', 'blockname')        # fields that say what a signal is
_VALUES = ('data', 'values', 'value', 'samples')        # fields that hold its values
_UNITS = ('unit', 'units')


class Struct:
    """
    A struct of a file that SciPy does not read, with its fields as attributes.

    Parameters
    ----------
    fields : dict of str to object
        Values by name.

    """

    def __init__(self, fields: Mapping[str, Any]) -> None:
        """Keep the fields."""
        self._fieldnames = list(fields)
        self.__dict__.update(fields)


class Walk:
    """
    Arrays within the structs and cell arrays of a MAT file.

    Parameters
    ----------
    content : dict of str to object
        What ``scipy.io.loadmat`` returns with ``struct_as_record=False``, without its header.

    """

    def __init__(self, content: Mapping[str, Any]) -> None:
        """Walk through all of it."""
        self.remarks: list[str] = []
        self._titles: dict[str, Title] = {}
        self._recordings: list[tuple[str, str, Any]] = []       # path, name of one, its content
        self._alone = list(self._arrays(content, '', 0))

    def tables(self, path: str, every: int) -> list[Table]:
        """Return the tables of a file, those of each recording beside arrays of its length."""
        alone = tables_of(path, self._alone, every, self._unique())
        found: list[Table] = []
        for name, one, value in self._recordings:
            within = Walk({name: value})
            own = {column for column, _ in columns_of(within._alone)}
            lengths = {len(column) for _, column in columns_of(within._alone)}
            beside = [(column, values) for column, values in columns_of(self._alone)
                      if len(values) in lengths]
            tables = tables_of(f'{path}, {one}', [*beside, *within._alone], every,
                               {**self._unique(), **within._unique()})
            for table in tables:
                for column in table.columns:
                    table.called.setdefault(column, column.removeprefix(f'{name}.'))
            found += [table for table in tables if own & {*table.columns, *table.aliases}]
        of_recordings = {len(table) for table in found}
        return found + [table for table in alone if len(table) not in of_recordings]

    def _arrays(self, content: Mapping[str, Any], prefix: str, depth: int
                ) -> Iterator[tuple[str, Any]]:
        """Yield name and values of every array, those within structs by ``struct.field``."""
        for name, value in content.items():
            fields = _fields_of(value)
            if fields is not None and depth < _DEEPEST:
                self._note_title(f'{prefix}{name}.', fields)
                yield from self._arrays(fields, f'{prefix}{name}.', depth + 1)
            elif isinstance(value, np.ndarray) and value.dtype == object:
                if depth < _DEEPEST:
                    yield from self._listed(f'{prefix}{name}', value, depth)
            elif isinstance(value, np.ndarray):
                yield f'{prefix}{name}', value

    def _listed(self, path: str, value: Any, depth: int) -> Iterator[tuple[str, Any]]:
        """Yield the arrays of a list of signals; keep a list of recordings for later."""
        elements = {f'{path}{_place(one, number)}': one
                    for number, one in enumerate(value.ravel(order='F'), 1)}
        widths = {name: _width(one) for name, one in elements.items()}
        elements = {name: one for name, one in elements.items() if widths[name]}
        if not elements:
            return
        fields = [_fields_of(one) for one in elements.values()]
        titles = [_title_of(one) for one in fields if one is not None]
        is_titled = len(titles) == len(elements) and all(titles)
        if is_titled or max(widths.values()) == 1:
            if len(elements) > MOST:
                self.remarks.append(f'`{path}` holds {len(elements)} arrays, more than the '
                                    f'{MOST} signals of a recording; it was left out')
                return
            yield from self._arrays(elements, '', depth + 1)
        elif len(elements) > _MOST_RECORDINGS:
            self.remarks.append(f'`{path}` holds {len(elements)} recordings, more than '
                                f'{_MOST_RECORDINGS}; it was left out')
        else:
            self._recordings += [(path, name, one) for name, one in elements.items()]

    def _note_title(self, prefix: str, fields: Mapping[str, Any]) -> None:
        """Keep what a struct says of the signal that it holds, if it does."""
        title = _title_of(fields)
        if title is not None:
            self._titles[f'{prefix}{_values_of(fields)}'] = title

    def _unique(self) -> dict[str, Title]:
        """Return the titles that no other array has as its title or its name."""
        taken = Counter([*(one.name for one in self._titles.values()),
                         *(name for name, _ in self._alone)])
        return {path: one for path, one in self._titles.items() if taken[one.name] == 1}


def _fields_of(value: Any) -> dict[str, Any] | None:
    """Return the fields of a struct, None for anything else."""
    names = getattr(value, '_fieldnames', None)
    return None if names is None else {name: getattr(value, name) for name in names}


def _place(element: Any, number: int) -> str:
    """Return the index of an element as MATLAB writes it: ``(2)`` of structs, ``{2}`` of cells."""
    return f'({number})' if _fields_of(element) is not None else f'{{{number}}}'


def _width(element: Any) -> int:
    """Return how many columns an element of a list gives."""
    arrays = Walk({'one': element})._alone if not isinstance(element, str) else []
    return sum(len(column) >= SHORTEST for _, column in columns_of(arrays))


def _values_of(fields: Mapping[str, Any]) -> str:
    """Return the one field of a struct that holds the values of a signal, '' where none does."""
    found = [name for name, value in fields.items() if name.lower() in _VALUES
             and isinstance(value, np.ndarray) and value.dtype.kind in 'bifu']
    return found[0] if len(found) == 1 else ''


def _title_of(fields: Mapping[str, Any]) -> Title | None:
    """Return what a struct of one signal says of it, None where it says nothing."""
    if not _values_of(fields):
        return None
    texts = {name.lower(): value.strip() for name, value in fields.items()
             if isinstance(value, str)}
    own = next((texts[name] for name in _NAMES if texts.get(name)), '')
    unit = next((texts[name] for name in _UNITS if texts.get(name) not in (None, '', '-')), '')
    return Title(own, unit) if own else None
