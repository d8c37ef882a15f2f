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

"""The pages on files that verbs write for programs, made from their JSON Schemas."""

import json

from generate.command_line import plain
from pam_actuation.investigate.schema import investigation_schema
from pam_sim.gap.report.schema import report_schema
from pam_sim.identify.schema import identify_schema


def pages():
    """Return the path below docs/ and the text of each page and of the schemas themselves."""
    return {
        **_page('gap', report_schema(), 'pam_sim.gap.report.schema.report_schema()',
                'Tests hold reports of every verdict against it.'),
        **_page('identify', identify_schema(), 'pam_sim.identify.schema.identify_schema()',
                'Tests hold results against it.'),
        **_page('investigation', investigation_schema(),
                'pam_actuation.investigate.schema.investigation_schema()',
                'What it shares with gap.json has the same form.')}


def _page(name, schema, function, remark):
    """Return the page on one file and its schema."""
    parts = [
        f'# {name}.json', plain(schema['description']),
        f'The schema is in the package: `{function}` returns it. {remark} '
        f'{{download}}`{name}.schema.json <{name}.schema.json>` is the file.',
        _table(schema)]
    for definition_name, definition in schema['$defs'].items():
        parts += [f'## {definition_name}', plain(definition['description'])]
        if 'properties' in definition:
            parts.append(_table(definition))
    return {f'reference/{name}_json.md': '\n\n'.join(parts) + '\n',
            f'reference/{name}.schema.json': json.dumps(schema, indent=2) + '\n'}


def _table(schema):
    rows = [f'| `{name}` | {_holds(held)} | {_meaning(held)} |'
            for name, held in schema['properties'].items()]
    return '\n'.join(['| key | holds | meaning |', '|---|---|---|', *rows])


def _meaning(held):
    return plain(held.get('description', ''))


def _holds(held):
    if '$ref' in held:
        name = held['$ref'].rpartition('/')[2]
        return f'[{name}](#{name})'
    if 'oneOf' in held:
        return ' or '.join(_holds(one) for one in held['oneOf'])
    if 'enum' in held:
        return ', '.join(f'`{value}`' for value in held['enum'])
    if 'const' in held:
        return f'`{held["const"]}`'
    if held['type'] == 'array':
        return f'list of {_holds(held["items"])}'
    if isinstance(held.get('additionalProperties'), dict):
        return f'name → {_holds(held["additionalProperties"])}'
    types = held['type'] if isinstance(held['type'], list) else [held['type']]
    return ' or '.join(types)
