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

"""What the fields of a message mean: by the type of the message, its names and its topic."""

from dataclasses import dataclass
import re
from typing import Any

from pam_actuation.tables.signals import of_words
from pam_actuation.tables.table import Table
from pam_actuation.tables.words import words_of

# Fields in which messages name the items of their arrays (sensor_msgs, trajectory_msgs, ...).
_NAMES = ('name', 'names', 'joint_names')
# Units that the definitions of standard messages state: type and field to unit. A pressure is
# absolute by its definition; many senders put gauge values there.
_UNITS = (
    ('sensor_msgs/msg/FluidPressure', 'fluid_pressure', 'Pa'),
    ('sensor_msgs/msg/JointState', 'position', 'm'),
    ('sensor_msgs/msg/JointState', 'effort', 'N'),
    ('sensor_msgs/msg/Range', 'range', 'm'),
    ('geometry_msgs/msg/Wrench', 'force', 'N'),
    ('geometry_msgs/msg/WrenchStamped', 'force', 'N'))
_VALVES = re.compile(r'valves?|duty|duties|pwm|solenoids?')
_AXES = ('x', 'y', 'z')
_MUSCLES = re.compile(r'pam|muscle|mckibben')
# What a field of an item is called that is a muscle by its name.
_OF_A_MUSCLE = {'position': 'position', 'effort': 'force'}
_FULL_PERCENT = 20.0, 100.0             # largest duty of a recording, in per cent


@dataclass(frozen=True)
class Message:
    """
    The numbers of one message.

    Parameters
    ----------
    stamp_ns : int
        Its time.
    names : tuple of str
        What it calls the items of its arrays, () if it does not.
    values : dict of str to float
        Path of a field, such as ``.position[0]``, to its number.

    """

    stamp_ns: int
    names: tuple[str, ...]
    values: dict[str, float]

    def of(self, name: str) -> 'Message':
        """Return what the message says of one name; numbers of arrays are called by it."""
        place = f'[{self.names.index(name)}]'
        return Message(self.stamp_ns, (name,), {
            path.replace(place, f'[{name}]'): value for path, value in self.values.items()
            if '[' not in path or place in path})


def items_named(message: Any) -> tuple[str, ...]:
    """Return what a message calls the items of its arrays; () where it names none."""
    for field in _NAMES:
        names = getattr(message, field, None)
        if isinstance(names, (list, tuple)) and names and all(
                isinstance(one, str) for one in names) and len({*names}) == len(names):
            return tuple(names)
    return ()


def describe(table: Table, msgtype: str) -> None:
    """
    Say for the columns of a topic what they may be called and which units they have.

    A column is known by the last word of its path, or by its topic where it is the only number
    that changes in the messages.

    Parameters
    ----------
    table : Table
        Of one topic; ``called``, ``units`` and ``by_type`` are written.
    msgtype : str
        Type of the messages, such as ``sensor_msgs/msg/FluidPressure``.

    """
    changing = [name for name, values in table.columns.items() if values.nunique() > 1]
    place, _, topic = table.topic.rpartition('/')
    duties = _duty_unit(table, topic, changing)
    for column in table.columns:
        path = column.removeprefix(table.topic).lstrip('.')
        leaf, _, item = re.sub(r'\[\d+\]$', '', path).rpartition('.')[2].partition('[')
        table.called[column] = ''
        if column not in changing:
            continue
        unit = _unit(msgtype, path)
        if unit:
            table.units[column] = unit
            table.by_type.add(column)
        if duties:
            # Which of the two fills is asked for.
            table.called[column], table.units[column] = f'{place}/fill duty', duties
        elif item:
            is_muscle = _MUSCLES.search(item.lower())
            own = _OF_A_MUSCLE.get(leaf, '') if is_muscle else ''
            table.called[column] = f'{place}/{item}/{own}' if own else ''
        elif leaf not in _AXES and of_words(words_of(leaf), place) is not None:
            table.called[column] = f'{place}/{leaf}'
        elif len(changing) == 1:
            table.called[column] = f'{place}/{topic}'


def _unit(msgtype: str, path: str) -> str:
    """Return the unit that the definition of a message states; '' without."""
    return next((unit for of_type, field, unit in _UNITS
                 if msgtype == of_type and field in re.split(r'[.\[]', path)), '')


def _duty_unit(table: Table, topic: str, changing: list[str]) -> str:
    """Return the unit of two numbers that can be the duties of a pair of valves, else ''."""
    if len(changing) != 2 or not any(
            _VALVES.fullmatch(word) for word in re.split(r'[_\W\d]+', topic.lower())):
        return ''
    low = min(float(table.columns[name].min()) for name in changing)
    high = max(float(table.columns[name].max()) for name in changing)
    if low < 0.0:
        return ''
    return '1' if high <= 1.0 else '%' if _FULL_PERCENT[0] < high <= _FULL_PERCENT[1] else ''
