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

"""A run as one pandas table: for analysis, and for ``pam export``."""

from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.errors import did_you_mean, InputError
from pam_sim.run import Run

if TYPE_CHECKING:
    import pandas as pd

STAMP, TIME = 'stamp_ns', 'time_s'
LEAST_RATE_HZ, MOST_RATE_HZ = 0.1, 1e5


def data_frame(run: Run, rate_hz: float | None = None,
               topics: Collection[str] | None = None) -> 'pd.DataFrame':
    """
    Return a run as one table.

    Columns are ``stamp_ns``, ``time_s`` since the start, and ``topic.field`` in SI, such as
    ``pressure.pressure_pa`` (absolute). A field that no message has is left out.

    Parameters
    ----------
    run : Run
        The recording.
    rate_hz : float, optional
        Rows at equal distances, as ``Run.on_grid``. By default there is a row for each stamp
        of any topic, and NaN where a topic has no message at that stamp.
    topics : collection of str, optional
        Short names; default: all that have messages.

    Raises
    ------
    InputError
        A topic that the run does not have, a rate out of range, no messages.

    """
    import pandas as pd
    names = _topics(run, topics)
    if rate_hz is not None:
        if not LEAST_RATE_HZ <= rate_hz <= MOST_RATE_HZ:
            raise InputError(
                f'{rate_hz:g} Hz; allowed is {LEAST_RATE_HZ:g} to {MOST_RATE_HZ:g} Hz', 'rate')
        grid = run.on_grid(1.0 / rate_hz, topics=names)
        stamps = grid.start_ns + np.round(grid.time_s * 1e9).astype(np.int64)
        columns = {f'{topic}.{name}': values for topic, fields in grid.values.items()
                   for name, values in fields.items()}
    else:
        stamps = np.unique(np.concatenate([run[name].stamp_ns for name in names]))
        columns = {}
        for topic in names:
            # Of several messages with one stamp the last counts.
            places = np.searchsorted(stamps, run[topic].stamp_ns)
            for name, values in run[topic].values.items():
                column: FloatArray = np.full(len(stamps), np.nan)
                column[places] = values
                columns[f'{topic}.{name}'] = column
    kept = {name: column for name, column in columns.items() if np.isfinite(column).any()}
    return pd.DataFrame({STAMP: stamps, TIME: (stamps - run.start_ns) * 1e-9, **kept})


def _topics(run: Run, topics: Collection[str] | None) -> list[str]:
    present = [name for name in run.topics if name in run]
    for name in topics or ():
        if name not in present:
            raise InputError(
                f'has no messages on {name!r}{did_you_mean(name, present)}; topics with '
                f'messages: {", ".join(present) or "none"}', run.path or 'topics')
    names = list(topics) if topics else present
    if not names:
        raise InputError('has no messages', run.path or 'run')
    return names
