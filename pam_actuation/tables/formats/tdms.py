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
"""TDMS files of LabVIEW, read with npTDMS."""

from collections.abc import Callable, Collection
import logging
from typing import Any

import numpy as np
from pam_actuation.tables.formats import needs
from pam_actuation.tables.formats.arrays import SHORTEST
from pam_actuation.tables.table import Table
from pam_sim.errors import InputError

TIME = 'time_s'                     # column made of the increment of waveforms
_UNIT_KEYS = ('unit_string', 'NI_UnitDescription', 'Unit', 'unit')


def read(path: str, every: int, wanted: Collection[str] | None,
         progress: Callable[[float], object]) -> list[Table]:
    """
    Return one table for each group, and for each length and rate of its channels.

    Channels of a waveform have an increment instead of a column of the time: the table gets a
    column ``time_s``. See ``formats.read_tables``.
    """
    nptdms = needs('nptdms', 'npTDMS', 'a TDMS file')
    nptdms.log.log_manager.set_level(logging.CRITICAL)      # what is wrong is said below
    found: dict[tuple[str, int, float, float], list[Any]] = {}
    try:
        file = nptdms.TdmsFile.read(path)
        for group in file.groups():
            for channel in group.channels():
                step_s = float(channel.properties.get('wf_increment', 0.0) or 0.0)
                start_s = float(channel.properties.get('wf_start_offset', 0.0) or 0.0)
                if len(channel) >= SHORTEST:
                    found.setdefault((group.name, len(channel), step_s, start_s), []).append(
                        channel)
        tables = [_table(path, channels, every, step_s, start_s)
                  for (_, _, step_s, start_s), channels in found.items()]
    except (ValueError, EOFError, OSError, KeyError, TypeError, NotImplementedError) as error:
        raise InputError(f'is no readable TDMS file: {error}', path) from None
    return sorted((table for table in tables if table.columns), key=len, reverse=True)


def _table(path: str, channels: list[Any], every: int, step_s: float, start_s: float) -> Table:
    """Return the numbers and dates of channels of one length as a table."""
    import pandas as pd
    columns, units = {}, {}
    for channel in channels:
        values = np.asarray(channel[:])
        if values.dtype.kind in 'bifuM':
            columns[channel.name] = pd.Series(values[::every])
            units[channel.name] = next((str(channel.properties[key]) for key in _UNIT_KEYS
                                        if channel.properties.get(key)), '')
    is_timed = any(values.dtype.kind == 'M' for values in columns.values())
    if columns and step_s > 0.0 and not is_timed and TIME not in columns:
        rows = np.arange(0, len(channels[0]), every)
        columns = {TIME: pd.Series(start_s + step_s * rows), **columns}
    return Table(path, columns, {name: unit for name, unit in units.items() if unit})
