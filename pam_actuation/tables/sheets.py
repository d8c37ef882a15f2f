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
"""Several recordings in one file: a sheet or a group each, with the same columns."""

from collections.abc import Sequence

from pam_actuation.tables.table import Table
from pam_sim.errors import InputError


def of_part(tables: Sequence[Table], part: int) -> tuple[list[Table], int]:
    """
    Return the tables of one recording, and the part that is left to be taken of them.

    Parameters
    ----------
    tables : sequence of Table
        Of one file, in its order.
    part : int
        Which recording is meant, from 1; 0: there is but one.

    Returns
    -------
    tuple of (list of Table, int)
        Where several tables have the same columns, one of them beside those with other columns,
        and 0. Else what was given.

    Raises
    ------
    InputError
        There are not so many.

    """
    groups: dict[tuple[str, ...], list[Table]] = {}
    for table in tables:
        groups.setdefault(tuple(table.columns), []).append(table)
    alike = max(groups.values(), key=len, default=[])
    if not part or len(alike) < 2:
        return list(tables), part
    if part > len(alike):
        names = ', '.join(table.source for table in alike)
        raise InputError(f'there are {len(alike)} recordings: {names}', f'--part {part}')
    others = {id(table) for table in alike} - {id(alike[part - 1])}
    return [table for table in tables if id(table) not in others], 0
