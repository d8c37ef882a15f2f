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

"""Records: what Python and compiled code see of the same numbers."""

from numba import njit
import numpy as np
from pam_sim.errors import InputError
from pam_sim.records import cells, columns, fields, record, size_of, values_of, zeros
import pytest

INNER = record('active', 'gain')
OUTER = record('time_s', ('sent', 3), ('effect', INNER), 'force_n')
# The same names with one more in front: every place moves.
LONGER = record('added', *((name, OUTER[name]) if OUTER[name].names else
                           (name, OUTER[name].shape[0]) if OUTER[name].shape else name
                           for name in OUTER.names))


def _used(dtype):
    @njit
    def use(array):
        row = array.view(dtype)[0]
        row.sent[1] += row.time_s
        if row.effect.active > 0.0:
            row.force_n = row.effect.gain * row.sent[1]
        return row.force_n

    return use


@pytest.mark.parametrize('dtype', [OUTER, LONGER])
def test_names_find_their_numbers_wherever_they_stand(dtype):
    """Compiled code, ``fields`` and ``cells`` read and write the same number by its name."""
    array = zeros(dtype)
    row, cell = fields(array, dtype), cells(array, dtype)
    row.time_s, row.effect.active, row.effect.gain = 2.0, 1.0, 5.0
    assert _used(dtype)(array) == 10.0
    assert row.sent[1] == cell.sent[1] == 2.0
    assert row.force_n == cell.force_n.item() == 10.0
    cell.effect.gain[...] = 7.0
    assert row.effect.gain == 7.0 and np.count_nonzero(array) == 5


def test_what_stands_behind_a_record_is_left_out():
    """An array may be longer than its record."""
    array = np.arange(size_of(OUTER) + 4.0)
    assert fields(array, OUTER).force_n == size_of(OUTER) - 1


def test_columns_share_memory():
    """A column of many records is no copy."""
    rows = np.zeros((4, size_of(INNER)))
    columns(rows, INNER)['gain'][:] = 3.0
    assert rows.sum() == 12.0


@pytest.mark.parametrize('values', [{'active': 1.0}, {'active': 1.0, 'gain': 2.0, 'gian': 3.0}])
def test_every_field_is_named_once(values):
    """A missing or unknown name is refused and said."""
    with pytest.raises(ValueError, match='gain|gian'):
        values_of(INNER, values)


def test_a_name_that_numpy_has_taken_is_refused():
    with pytest.raises(InputError, match='`fill` cannot name a number .* numpy uses'):
        record('supply_pa', 'fill')
