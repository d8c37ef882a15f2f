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

"""The topics as Markdown: their list, and a page of each that has none written by hand."""

from pathlib import Path

from pam_actuation.models.markdown import row
from pam_actuation.topics import cdr
from pam_actuation.topics.contents import NamedNumbers, Numbers, Trajectory, Value
from pam_actuation.topics.quality import Service
from pam_actuation.topics.table import JOINT, RECORDED, RECORDER, RIG, ROOT, Topic
from pam_sim.units import allowed_range, unit_of

INDEX = 'README.md'
MADE = 'Made from the code by `pam nodes --topics msg_docs`'
HEAD = '| topic | message type | content | published by | values of a run |'
NAMESPACE = '/muscle'


def pages(folder: Path) -> dict[str, str]:
    """Return file name to text of what the folder of topic pages is to hold anew."""
    made = {INDEX: index((folder / INDEX).read_text(encoding='utf-8'))}
    for topic in RECORDED.values():
        file = folder / f'{topic.name}.md'
        if not file.exists() or MADE in file.read_text(encoding='utf-8'):
            made[file.name] = page(topic)
    return made


def index(text: str) -> str:
    """Return the text of the list of topics with its table made anew."""
    before, _, rest = text.partition('| topic |')
    behind = rest.split('\n\n', 1)[1]
    rows = [HEAD, '|---|---|---|---|---|', *map(_index_row, RECORDED.values())]
    return before + '\n'.join(rows) + '\n\n' + behind


def _index_row(topic: Topic) -> str:
    return row((f'[`{topic.name}`]({topic.name}.md)', f'`{topic.type_name}`', topic.meaning,
                _words(topic.published_by), _values(topic)))


def _words(nodes: tuple[str, ...]) -> str:
    return ', '.join(f'`{node}`' if '_' in node else node for node in nodes) or 'others'


def _values(topic: Topic) -> str:
    """Return the values that a loaded run has, in words."""
    content = topic.content
    if isinstance(content, Numbers):
        return ', '.join(f'`{value.name}`' for value in (*content.values, *content.instead))
    if isinstance(content, NamedNumbers):
        return 'each number by its name'
    return 'one object per message' if isinstance(content, Trajectory) else ''


def service_text(service: Service) -> str:
    """Return the paragraph on a quality of service."""
    publisher, recorder = service.publisher, service.recorder
    return f"""\
{publisher.reliability.capitalize()}, {publisher.durability.replace('_', ' ')}. \
Publishers and subscribers keep the last {publisher.depth} messages, the recorder \
{recorder.depth}; any depth matches.
Deadline, lifespan and liveliness are not set, so a publisher or subscriber with default
settings always matches. The nodes check time-outs themselves. The parameters
`qos_overrides.<topic>.<publisher|subscription>.*` override history, depth and
reliability at start.
"""


def page(topic: Topic) -> str:
    """Return the page of a topic, all of it from its row in the table."""
    full = topic.full_name(NAMESPACE)
    place = {ROOT: 'one for all', JOINT: 'one namespace per joint',
             RIG: 'in that of a joint, or of a muscle alone'}.get(
        topic.place, 'one namespace per muscle')
    consumers = (*topic.consumed_by, *([RECORDER] if topic.name in RECORDED else []))
    rate = '100 Hz or more' if topic.steady else 'any'
    return '\n'.join((
        f'# `{topic.name}`: {topic.meaning}', '', f'{MADE}; do not edit.', '',
        '| | |', '|---|---|',
        row(('topic', f'`{full}` (relative name `{topic.name}`, {place})')),
        row(('message type', f'`{topic.type_name}`')),
        row(('published by', _words(topic.published_by))),
        row(('consumed by', _words(consumers))), row(('rate', rate)), '',
        '## Fields', '', row(('field', 'unit', 'plausible', 'value of a run')),
        '|---|---|---|---|',
        row(('`header.stamp`', 's + ns', 'the time of the clock in use', 'its time')),
        *_fields(topic), '', '## Rules', '', *_rules(topic), '', '## Quality of service', '',
        service_text(topic.service), '## Example', '', '```',
        f'ros2 topic pub --rate 100 {full} {topic.type_name} \\',
        f'  "{_example(topic)}"', '```', ''))


def _paths(topic: Topic) -> list[tuple[str, str]]:
    """Return (path in the ROS message, value) of the numbers."""
    content = topic.content
    if isinstance(content, Numbers):
        return [(_path(content, value), value.name) for value in content.values]
    if isinstance(content, NamedNumbers):
        return [(f'{content.field}[i]', 'that of `name[i]`')]
    if isinstance(content, Trajectory):
        return [('points[i].positions[0]', content.positions),
                ('points[i].velocities[0]', content.velocities)]
    return []


def _path(content: Numbers, value: Value) -> str:
    return value.field if content.type_name in cdr.STAMPED_NUMBERS else f'{value.field}[0]'


def _fields(topic: Topic) -> list[str]:
    return [
        row((f'`{path}`', unit_of(name).replace('1', '–'),
             allowed_range(*topic.limits[name], name=name) if name in topic.limits else 'any',
             f'`{name}`' if ' ' not in name else name)) for path, name in _paths(topic)]


def _rules(topic: Topic) -> list[str]:
    held = ('The value is held until the next message' if topic.held
            else 'Between messages the value is interpolated')
    missing = {'told': 'reported by every verb that reads a bag',
               'kept': 'ignored; the last value is held',
               'allowed': 'allowed'}[topic.missing]
    return [f'- {held} (`run.on_grid`).',
            f'- A number that is missing or not finite is {missing}.']


def _example(topic: Topic) -> str:
    """Return a message as ``ros2 topic pub`` takes it."""
    content, numbers = topic.content, 'name: [muscle]'
    if isinstance(content, Numbers) and content.type_name in cdr.STAMPED_NUMBERS:
        numbers = ', '.join(_nested(value.field, topic) for value in content.values)
    elif isinstance(content, Numbers):
        numbers += ''.join(f', {value.field}: [0.0]' for value in content.values)
    elif isinstance(content, NamedNumbers):
        numbers = f'name: [value], {content.field}: [0.0]'
    elif isinstance(content, Trajectory):
        numbers = 'joint_names: [muscle], points: [{positions: [0.0], velocities: [0.0]}]'
    return f'{{header: {{stamp: now}}, {numbers}}}'


def _nested(field: str, topic: Topic) -> str:
    *outer, last = field.split('.')
    name = next(value for path, value in _paths(topic) if path == field)
    text = f'{last}: {float(topic.limits[name][0] if name in topic.limits else 0.0)}'
    for part in reversed(outer):
        text = f'{part}: {{{text}}}'
    return text
