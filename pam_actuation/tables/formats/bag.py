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

"""Bags of other programs: every topic is a table, every number in its messages a column."""

from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from pam_actuation.tables.formats.fields import describe, items_named, Message
from pam_actuation.tables.table import MOST_ROWS, Table
from pam_actuation.topics.definitions import typestore
from pam_sim.errors import InputError

_MOST_ITEMS = 32                 # of an array in a message
_PREVIEWED = 1000                # messages of a topic
_LARGE_BYTES = 20_000            # a message of an image, which is no signal of a rig


def read(path: str, every: int, wanted: Collection[str] | None,
         progress: Callable[[float], object]) -> list[Table]:
    """
    Return a table for each topic; see ``formats.read_tables``.

    A column is called ``/topic.field``. Where a message names the items of its arrays, as
    ``JointState`` does, each name has a table of its own, with columns such as
    ``/joint_states.position[knee]``. Times are header stamps, or receive times for messages
    without header. Of topics that are not ``wanted`` only the first messages are read. A message
    without numbers, such as a state before the first reading, is a row without values.
    """
    from rosbags.highlevel import AnyReader, AnyReaderError
    place = Path(path)
    try:
        with AnyReader([place], default_typestore=typestore()) as reader:
            total = sum(one.msgcount for one in reader.connections) or 1
            tables: list[Table] = []
            done = 0
            for connection in reader.connections:
                used = wanted is None or any(_is_of(name, connection.topic) for name in wanted)
                read_messages = _messages(reader, connection, every, None if used else _PREVIEWED)
                done += connection.msgcount
                progress(done / total)
                own = _tables(path, connection.topic, connection.msgtype, read_messages)
                if connection.msgcount > MOST_ROWS * every:
                    for table in own:
                        table.remarks.append(
                            f'of {connection.msgcount} messages on {table.topic} the first '
                            f'{MOST_ROWS * every} are read; keep one of several, with --every '
                            f'{-(-connection.msgcount // MOST_ROWS)}')
                tables += own
            return tables
    except (AnyReaderError, KeyError, ValueError, AssertionError, OSError) as error:
        raise InputError(f'is no readable bag: {error}', path) from None


def _is_of(column: str, topic: str) -> bool:
    """Return whether a column can be one of a topic, as ``Table.name_of`` compares names."""
    column, topic = column.strip().lower(), topic.lower()
    return column == topic or column.startswith(f'{topic}.') or column.startswith('#')


def _messages(reader: Any, connection: Any, every: int, most: int | None) -> list[Message]:
    """Return time [ns], names of items and numbers of every message of a topic."""
    found: list[Message] = []
    for count, (_, log_time_ns, raw) in enumerate(reader.messages(connections=[connection])):
        if most is not None and count >= most or len(found) >= MOST_ROWS:
            break
        if count % every:
            continue
        if not found and len(raw) > _LARGE_BYTES:
            break
        message = reader.deserialize(raw, connection.msgtype)
        found.append(Message(_stamp_ns(message) or log_time_ns, items_named(message),
                             dict(_numbers(message, ''))))
    return found


def _tables(path: str, topic: str, msgtype: str, found: list[Message]) -> list[Table]:
    """Return the table of a topic, or one for each name in its messages."""
    found = found if any(one.values for one in found) else []
    if not any(one.names for one in found):
        return [_table(path, topic, msgtype, found)] if found else []
    tables = []
    for name in dict.fromkeys(name for one in found for name in one.names):
        own = [one for one in found if name in one.names]
        table = _table(path, topic, msgtype, [one.of(name) for one in own])
        places = {one.names.index(name) for one in own}
        if len(places) == 1:            # the number of the item says the same as its name
            place = f'[{places.pop()}]'
            table.aliases = {column.replace(f'[{name}]', place): column
                             for column in table.columns if f'[{name}]' in column}
        tables.append(table)
    return tables


def _table(path: str, topic: str, msgtype: str, found: list[Message]) -> Table:
    import pandas as pd
    names = dict.fromkeys(name for one in found for name in one.values)
    columns = {f'{topic}{name}': pd.Series([one.values.get(name, np.nan) for one in found],
                                           dtype=float) for name in names}
    table = Table(path, columns, topic=topic,
                  stamp_ns=np.array([one.stamp_ns for one in found], dtype=np.int64))
    describe(table, msgtype)
    return table


def _stamp_ns(message: Any) -> int:
    stamp = getattr(getattr(message, 'header', None), 'stamp', None)
    return 0 if stamp is None else int(stamp.sec) * 10**9 + int(stamp.nanosec)


def _numbers(message: Any, name: str) -> Iterator[tuple[str, float]]:
    """Return path and value of every number in a message, but those of its header."""
    fields = getattr(message, '__dataclass_fields__', None)
    if fields is not None:
        for field in fields:
            if field not in ('header', 'layout') and not field.startswith('__'):
                yield from _numbers(getattr(message, field), f'{name}.{field}')
    elif isinstance(message, (bool, int, float, np.number)):
        yield name, float(message)
    elif isinstance(message, (np.ndarray, list, tuple)):
        for place, item in enumerate(message[:_MOST_ITEMS]):
            if not isinstance(item, str):
                yield from _numbers(item, f'{name}[{place}]')
