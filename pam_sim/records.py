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
Rows of numbers with names: parameters, states, inputs and outputs of compiled code.

A record is declared once, as a numpy dtype of float64 fields; units stand in the names.
Compiled functions take plain float64 arrays from Python, look at them through the dtype
once, ``part(par, 0, PARAMETERS)``, and read ``par.supply_pa`` from there on. Python does the
same with ``fields``. An inserted field moves its neighbours in memory and nowhere else.
"""

from collections.abc import Callable, Mapping
import functools
import itertools
import operator
import types
from typing import Any

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError

# A name; a name with the length of an array; a name with a record, or with so many of it.
Declared = str | tuple[str, 'int | np.dtype[Any] | tuple[np.dtype[Any], int]']
_NUMBER = np.dtype(np.float64).itemsize


class Row(np.record):        # type: ignore[misc]  # numpy itself allows it
    """
    A record whose numbers Python reads and writes by name in a third of the time.

    numpy looks names up in Python; here its compiled parts do.
    """

    __getattribute__ = np.void.__getattribute__
    __getitem__ = np.void.__getitem__       # type: ignore[assignment]  # takes the same

    def __getattr__(self, name: str) -> Any:
        """Return a number, or what stands within."""
        try:
            return self[name]
        except (KeyError, ValueError):
            raise AttributeError(name) from None

    def __setattr__(self, name: str, value: Any) -> None:
        """Write a number."""
        self[name] = value


def record(*declared: Declared) -> np.dtype[Any]:
    """
    Return the dtype of a row of float64 numbers with names.

    Parameters
    ----------
    declared : str or (str, int) or (str, numpy.dtype) or (str, (numpy.dtype, int))
        Name of a number, of an array of so many, of a record within the record, or of so
        many records.

    Returns
    -------
    numpy.dtype

    Raises
    ------
    InputError
        A name that records of numpy have for something else, or a name twice.

    """
    parts: list[tuple[Any, ...]] = []
    for one in declared:
        name = one if isinstance(one, str) else one[0]
        if hasattr(np.record, name):        # read as an attribute, it would be numpy's own
            raise InputError(
                f'`{name}` cannot name a number of a record, as numpy uses this name itself; '
                f'allowed are other names, such as `{name}_value`')
        if any(name == part[0] for part in parts):
            raise InputError(f'`{name}` names two numbers; give one of them another name')
        if isinstance(one, str):
            parts.append((one, np.float64))
        elif isinstance(one[1], int):
            parts.append((one[0], np.float64, (one[1],)))
        elif isinstance(one[1], tuple):
            parts.append((one[0], one[1][0], (one[1][1],)))
        else:
            parts.append((one[0], one[1]))
    return np.dtype((Row, parts))


def size_of(dtype: np.dtype[Any]) -> int:
    """Return how many float64 numbers a record takes."""
    return dtype.itemsize // _NUMBER


def place_of(dtype: np.dtype[Any], name: str) -> int:
    """Return how many float64 numbers stand in a record before a field."""
    return _field(dtype, name)[1]


def zeros(dtype: np.dtype[Any]) -> FloatArray:
    """Return a float64 array of the size of a record, filled with zeros."""
    return np.zeros(size_of(dtype))


def fields(array: FloatArray, dtype: np.dtype[Any], place: int = 0) -> Any:
    """
    Look at an array through a record, from ``place`` on; both share their memory.

    ``fields(out, OUTPUT).pressure_pa`` reads and writes a number of ``out``. What an array
    holds beyond the record is left out.
    """
    return array[place:place + size_of(dtype)].view(dtype)[0]


def cells(array: FloatArray, dtype: np.dtype[Any]) -> Any:
    """
    Return a namespace with one 0-d array for each number of a record, sharing its memory.

    ``cells(out, OUTPUT).pressure_pa.item()`` reads and ``[...] =`` writes a number as fast as
    an index does, for loops in Python; made once, beside the array. An array within the record
    is an array, a record within it a namespace, an array of records a tuple of namespaces.
    """
    seen = types.SimpleNamespace()
    for name, (begin, end) in _spans(dtype).items():
        setattr(seen, name, _cell(array[begin:end], dtype[name]))
    return seen


def _cell(array: FloatArray, dtype: np.dtype[Any]) -> Any:
    if dtype.names:
        return cells(array, dtype)
    if not dtype.shape:
        return array.reshape(())
    if not dtype.base.names:
        return array
    return tuple(cells(one, dtype.base) for one in array.reshape(-1, size_of(dtype.base)))


def columns(rows: FloatArray, dtype: np.dtype[Any]) -> Any:
    """
    Return rows of records (N, size) as a structured array (N,), sharing memory.

    ``columns(outputs, OUTPUT)['pressure_pa']`` is a column of ``outputs``.
    """
    return np.ascontiguousarray(rows).view(dtype)[:, 0]


def values_of(dtype: np.dtype[Any], values: Mapping[str, Any]) -> FloatArray:
    """
    Return a float64 array for a record from a mapping that names each of its fields.

    Raises
    ------
    ValueError
        A field is missing, or there is none of a name.

    """
    array = zeros(dtype)
    put(array, dtype, values)
    return array


def put(array: FloatArray, dtype: np.dtype[Any], values: Mapping[str, Any],
        place: int = 0) -> None:
    """
    Write a mapping that names each field of a record into an array, from ``place`` on.

    Raises
    ------
    ValueError
        A field is missing, or there is none of a name.

    """
    # Rigs are packed often: the numbers that begin the record are written at once.
    numbers, count, others, total = _plan(dtype)
    try:
        if len(values) != total:
            raise KeyError
        array[place:place + count] = numbers(values)
        for name, begin, end in others:
            array[place + begin:place + end] = _flat(values[name])
    except KeyError:
        unlike = sorted({*values}.symmetric_difference(dtype.names or ()))
        raise ValueError(f'fields {unlike} are missing or unknown') from None


def put_some(array: FloatArray, dtype: np.dtype[Any], values: Mapping[str, Any],
             place: int = 0) -> None:
    """
    Write the fields a mapping names into an array, from ``place`` on; others stay.

    Raises
    ------
    ValueError
        There is no field of a name.

    """
    spans = _spans(dtype)
    for name, value in values.items():
        try:
            begin, end = spans[name]
        except KeyError:
            raise ValueError(
                f'there is no field `{name}`; allowed: {", ".join(spans)}') from None
        if end == begin + 1:
            array[place + begin] = value
        else:
            array[place + begin:place + end] = _flat(value)


def _flat(value: Any) -> Any:
    """Return an array of a field as a row; a number is left as it is."""
    return value.ravel() if isinstance(value, np.ndarray) else value


@functools.cache
def _spans(dtype: np.dtype[Any]) -> dict[str, tuple[int, int]]:
    """Return how many numbers stand before each field, and how many with it."""
    found = {}
    for name in dtype.names or ():
        inner, begin = _field(dtype, name)
        found[name] = begin, begin + size_of(inner)
    return found


@functools.cache
def _plan(dtype: np.dtype[Any]) -> tuple[
        Callable[[Mapping[str, Any]], Any], int, list[tuple[str, int, int]], int]:
    """Return a reader of the first fields that are numbers, their count, the others, how many."""
    names = dtype.names or ()
    leading = list(itertools.takewhile(lambda name: dtype[name] == np.float64, names))
    others = [(name, *span) for name, span in _spans(dtype).items() if name not in leading]
    reader = operator.itemgetter(*leading) if leading else _nothing
    return reader, len(leading), others, len(names)


def _nothing(values: Mapping[str, Any]) -> tuple[()]:
    return ()


def _field(dtype: np.dtype[Any], name: str) -> tuple[np.dtype[Any], int]:
    """Return the dtype of a field and the numbers before it."""
    assert dtype.fields is not None
    inner, begin = dtype.fields[name][:2]
    return inner, begin // _NUMBER


def part(whole: Any, place: int, dtype: np.dtype[Any]) -> Any:
    """
    Return the record that begins ``place`` numbers behind the begin of an array or record.

    For compiled code, where it is an address and checks nothing: a function with the first
    record of an array reaches what stands behind it. Interpreted code gets the same.
    ``record_parts`` tells the compiler.
    """
    return fields(whole if isinstance(whole, np.ndarray) else _memory_from(whole), dtype, place)


def _memory_from(seen: Any) -> FloatArray:
    """Return the memory from the begin of a record to the end of the array it looks at."""
    row = seen.base
    owner = row
    while owner.base is not None:
        owner = owner.base
    # The address of a record itself is slow to ask for; the only one of a row is where that is.
    alone = row.size == 1 and row.dtype is seen.dtype
    begin = row.ctypes.data if alone else seen.__array_interface__['data'][0]
    before = begin - owner.ctypes.data
    memory: FloatArray = owner.reshape(-1).view(np.float64)[before // _NUMBER:]
    return memory
