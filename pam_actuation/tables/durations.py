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
"""Times as durations: ``0.01 sec`` of a MATLAB timetable, ``0 days 00:00:00.01`` of pandas."""

import re

import numpy as np
from pam_actuation.tables.dates import Dates
from pam_actuation.tables.table import Table
from pam_sim.errors import InputError

_DURATION = re.compile(r'\s*[+-]?[\d.,]+\s*(days?\s.*|[a-zµμ]+)\s*', re.IGNORECASE)


def durations_of(table: Table, name: str) -> Dates | None:
    """
    Return the times in a column of durations, None for a column that begins with another value.

    Raises
    ------
    InputError
        A value that is no duration, with its line.

    """
    import pandas as pd
    values = table.columns[name]
    if pd.api.types.is_numeric_dtype(values) or not len(values) or not _DURATION.fullmatch(
            str(values.iloc[0])):
        return None
    texts = values.astype(str).str.strip().str.replace(table.decimal, '.', regex=False)
    found = pd.to_timedelta(texts, errors='coerce')
    wrong = np.flatnonzero(found.isna().to_numpy())
    if len(wrong):
        raise InputError(f'column "{name}" holds {str(values.iloc[wrong[0]])!r}, which is no '
                         'duration as in 0.01 sec', table.place(int(wrong[0])))
    return Dates(found.dt.as_unit('ns').astype('int64').to_numpy(), 'durations', True)
