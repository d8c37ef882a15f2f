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

"""The text of ``pam info`` for people: gauge kPa, mm, one line per topic."""

from collections.abc import Iterator, Sequence
import datetime
import math
from typing import TYPE_CHECKING

from pam_actuation.bags.facts import recorded, recorded_rig_title
from pam_sim.units import gauge_kpa

if TYPE_CHECKING:
    from pam_actuation.bags.info import BagInfo, TopicInfo

_DISPLAY = {
    # value name: (factor, unit, digits)
    'contraction_m': (1e3, 'mm', 2),
    'velocity_m_per_s': (1e3, 'mm/s', 1),
    'force_n': (1.0, 'N', 1),
    'angle_rad': (math.degrees(1.0), '°', 2),
    'ppr_voltage': (1.0, 'V', 3),
    'fill_duty': (1.0, '', 3),
    'vent_duty': (1.0, '', 3),
}
_TABLE = ('topic', 'messages', 'rate', 'longest gap', 'jitter', 'published', 'lost', 'dropped')


def render_text(info: 'BagInfo') -> str:
    """Return the text of a BagInfo, lines of unlimited width, no trailing newline."""
    lines = [info.path, _headline(info)]
    lines += [f'{key}: {text}' for key, text in _facts(info).items()]
    lines.append(info.ending.sentence)
    lines += ['', *_table([_TABLE, *(_row(topic) for topic in info.topics)])]
    ranges = [line for topic in info.topics for line in _range_lines(topic)]
    if ranges:
        lines += ['', *ranges]
    if info.markers:
        lines += ['', *(f'{one["time_s"]:.2f} s, marker in {one["namespace"] or "/"}: '
                        f'{one["text"]}' for one in info.markers)]
    lines += ['', _verdict(info)]
    lines += [f'- {remark}' for remark in info.remarks]
    lines += [f'Note: {note}' for note in info.notes]
    return '\n'.join(lines)


def _facts(info: 'BagInfo') -> dict[str, str]:
    """Return what the bag says of its run; what it does not say is told as that."""
    return {
        'experiment_name': recorded(info.metadata, 'experiment_name'),
        'rig': recorded_rig_title(info.metadata),
        'valve': recorded(info.metadata, 'valve'), 'seed': recorded(info.metadata, 'seed'),
        'software_version': recorded(info.metadata, 'software_version')}


def _headline(info: 'BagInfo') -> str:
    parts = [
        f'{info.storage}', f'{info.size_bytes / 1e6:.2f} MB', f'{info.duration_s:.2f} s',
        f'{info.message_count} messages']
    if info.start_ns > 10**17:
        began = datetime.datetime.fromtimestamp(info.start_ns * 1e-9, datetime.timezone.utc)
        parts.append(f'began {began:%Y-%m-%d %H:%M:%S} UTC')
    return ', '.join(parts)


def _row(topic: 'TopicInfo') -> tuple[str, ...]:
    return (
        topic.name, str(topic.count), _number(topic.rate_hz, 1.0, ' Hz', 1),
        _number(topic.max_gap_s, 1e3, ' ms', 1), _number(topic.stamp_jitter_s, 1e3, ' ms', 2),
        _number(topic.published), _number(topic.lost), _number(topic.dropped))


def _number(value: float | None, factor: float = 1.0, unit: str = '', digits: int = 0) -> str:
    return '-' if value is None else f'{factor * value:.{digits}f}{unit}'


def _table(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return [
        '  '.join(
            [row[0].ljust(widths[0])]
            + [cell.rjust(width) for cell, width in zip(row[1:], widths[1:])]).rstrip()
        for row in rows]


def _range_lines(topic: 'TopicInfo') -> Iterator[str]:
    for name, (low, high) in topic.ranges.items():
        if name == 'pressure_pa':
            yield (
                f'{topic.name}: {gauge_kpa(low):.1f} to {gauge_kpa(high):.1f} kPa gauge')
        elif name in _DISPLAY:
            factor, unit, digits = _DISPLAY[name]
            what = '' if name in ('contraction_m', 'force_n', 'angle_rad') else f' {name}'
            yield (
                f'{topic.name}{what}: {factor * low:.{digits}f} to '
                f'{factor * high:.{digits}f} {unit}').rstrip()


def _verdict(info: 'BagInfo') -> str:
    if info.complete:
        text = 'Complete: every message that was published is here.'
    elif not info.missing and info.ending.early:
        text = (
            'Stopped early; of what was published until then nothing is known to be missing.')
    elif info.complete is None:
        text = 'Nothing is known to be missing; not every topic could be checked.'
    else:
        absent = f', {info.absent} announced and in no file' if info.absent else ''
        text = (
            f'Incomplete: {info.lost} messages lost, {info.dropped} dropped, '
            f'{info.missed_at_start} sent before the recorder was connected{absent}.')
        if not (info.lost or info.dropped or info.missed_at_start or info.absent):
            text = 'Incomplete: the recording broke off.'
    return text + (' Remarks:' if info.remarks else '')
