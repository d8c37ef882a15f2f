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

"""One Markdown page per node: what it is, parameters, topics, services, an example."""

from collections.abc import Collection, Iterable, Mapping, Sequence

from pam_actuation.models.markdown import escaped, row
from pam_actuation.nodes.interfaces import Inspector, NEEDED, NodeInterface, VARIANTS
from pam_actuation.nodes.parameters import allowed, COMMON_PARAMETERS
from pam_actuation.rigging import layouts
from pam_actuation.rigging.node_spec import NodeSpec
from pam_actuation.rigging.processes import parameter_arguments
from pam_sim.parameters import Parameter

_EXPLAINED = 'states, timing and what is common to all nodes: [Nodes](../nodes.md)'
_MADE = 'Made from the code by `pam nodes --markdown docs/reference/nodes`; do not edit.'
# Where the nodes of the examples come from, which the tests start.
_EXAMPLES = (
    *layouts.rig(experiment='sine_quarter_hz'), *layouts.knee(),
    NodeSpec('joint_trajectory_server', '/knee', {'muscle': 'knee'}),
    *layouts.rig(hardware='dummy', experiment='sine_quarter_hz', record='runs/first'))


def pages() -> dict[str, str]:
    """Return file name to text of the page of every node."""
    with Inspector() as inspector:
        return {f'{name}.md': page(*inspector.whole_interface(name)) for name in VARIANTS}


def page(interface: NodeInterface, notes: Mapping[str, str]) -> str:
    """Return the page of one node from ``Inspector.whole_interface``."""
    first, _, rest = interface.description.partition('\n')
    parts = [
        f'# {interface.name}', first + (rest and f'\n{rest}').replace('``', '`'),
        f'{_MADE} More: {_EXPLAINED}.', '## Example', _example(interface, notes),
        '## Topics and services', _endpoints(interface, notes),
        '`/diagnostics` is published by every node; with `use_sim_time` it takes `/clock`.',
        '## Parameters', _parameters(interface.parameters, interface.live),
        '## Parameters of every node', _parameters(COMMON_PARAMETERS)]
    if interface.settings:
        parts += ['## Settings in its controller files',
                  'Below `settings:`, each where it differs from the default.',
                  _settings(interface.settings)]
    return '\n\n'.join(part.rstrip() for part in parts) + '\n'


def _example(interface: NodeInterface, notes: Mapping[str, str]) -> str:
    node = next((one for one in _EXAMPLES if one.name == interface.name), None)
    namespace = node.namespace if node else '/muscle'
    given = {key: value for key, value in (node.parameters if node else {}).items()
             if value != '' and key != 'await_subscriber'}      # there is no recorder here
    given.update(NEEDED.get(interface.name, {}))
    arguments = ' '.join(parameter_arguments(given))
    lines = [f'    ros2 run pam_actuation {interface.name} --ros-args -r __ns:={namespace} '
             f'{arguments}'.rstrip()]
    full = f'{namespace}/{interface.name}'
    lines += [f'    ros2 lifecycle set {full} deactivate',
              f'    ros2 param describe {full} {interface.parameters[0].name}'
              if interface.parameters else f'    ros2 param list {full}']
    for name, type_name in interface.serves.items():
        if name in notes:
            continue
        data = ' "{data: true}"' if type_name.endswith('SetBool') else ''
        lines.append(f'    ros2 service call {full}/{name.removeprefix("~/")} {type_name}{data}')
    return '\n'.join(lines)


def _endpoints(interface: NodeInterface, notes: Mapping[str, str]) -> str:
    lines = [row(('', 'name', 'type', 'only with')), '|---|---|---|---|']
    for word, items in (('sends', interface.publishes), ('takes', interface.subscribes),
                        ('serves', interface.serves)):
        lines += [row((word, f'`{name}`', f'`{type_name}`',
                       f'`{notes[name]}`' if name in notes else ''))
                  for name, type_name in items.items()]
    return '\n'.join(lines)


def _parameters(parameters: Sequence[Parameter], live: Collection[str] = ()) -> str:
    if not parameters:
        return 'None of its own.'
    lines = [row(('parameter', 'default', 'unit', 'allowed', 'live', 'meaning')),
             '|---|---|---|---|---|---|']
    for one in parameters:
        default = f'`{one.default!r}`' if one.default != '' else ''
        lines.append(row((f'`{one.name}`', default, one.unit, escaped(allowed(one)),
                          'yes' if one.name in live else 'no', escaped(one.description))))
    return '\n'.join(lines)


def _settings(settings: Iterable[Parameter]) -> str:
    lines = [row(('setting', 'default', 'unit', 'allowed', 'meaning')), '|---|---|---|---|---|']
    lines += [row((f'`{one.name}`', f'`{one.default:g}`', escaped(one.unit.strip('-')),
                   one.allowed if one.choices else f'{one.lower:g} to {one.upper:g}',
                   escaped(one.description))) for one in settings]
    return '\n'.join(lines)
