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
once, ``par.view(PARAMETERS)[0]``, and read ``par.supply_pa`` from there on. Python does the
same with ``fields``. An inserted field moves its neighbours in memory and nowhere else.
"""

import types

import numpy as np


def record(*declared):
    """
    Return the dtype of a row of float64 numbers with names.

    Parameters
    ----------
    declared : str or (str, int) or (str, numpy.dtype)
        Name of a number, of an array of so many, or of a record within the record.

    Returns
    -------
    numpy.dtype

    """
    parts = []
    for one in declared:
        name, what = (one, None) if isinstance(one, str) else one
        if what is None:
            parts.append((name, np.float64))
        elif isinstance(what, np.dtype):
            parts.append((name, what))
        else:
            parts.append((name, np.float64, (what,)))
    return np.dtype((np.record, parts))


def size_of(dtype):
    """Return how many float64 numbers a record takes."""
    return dtype.itemsize // np.dtype(np.float64).itemsize


def zeros(dtype):
    """Return a float64 array of the size of a record, filled with zeros."""
    return np.zeros(size_of(dtype))


def fields(array, dtype):
    """
    Look at an array through a record; both share their memory.

    ``fields(out, OUTPUT).pressure_pa`` reads and writes a number of ``out``. What an array
    holds beyond the record is left out.
    """
    return array[:size_of(dtype)].view(dtype)[0]


def cells(array, dtype):
    """
    Return a namespace with one 0-d array for each number of a record, sharing its memory.

    ``cells(out, OUTPUT).pressure_pa.item()`` reads and ``[...] =`` writes a number as fast as
    an index does, for loops in Python; made once, beside the array. An array within the record
    is an array, a record within it a namespace.
    """
    seen = types.SimpleNamespace()
    for name in dtype.names:
        inner, offset = dtype.fields[name][:2]
        begin = offset // np.dtype(np.float64).itemsize
        part = array[begin:begin + size_of(inner)]
        if inner.names:
            part = cells(part, inner)
        elif not inner.shape:
            part = part.reshape(())
        setattr(seen, name, part)
    return seen


def columns(rows, dtype):
    """
    Return rows of records (N, size) as a structured array (N,), sharing memory.

    ``columns(outputs, OUTPUT)['pressure_pa']`` is a column of ``outputs``.
    """
    return np.ascontiguousarray(rows).view(dtype)[:, 0]


def values_of(dtype, values):
    """
    Return a float64 array for a record from a mapping that names each of its fields.

    Raises
    ------
    ValueError
        A field is missing, or there is none of a name.

    """
    if set(values) != set(dtype.names):
        raise ValueError(
            f'fields {sorted(set(values) ^ set(dtype.names))} are missing or unknown')
    array = zeros(dtype)
    seen = array.view(dtype)[0]
    for name, value in values.items():
        seen[name] = value
    return array
