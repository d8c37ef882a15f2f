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

"""A page per verb of ``pam``, made from its parser."""

import argparse
import re

from pam_actuation.cli.main import build_parser

# A bar within a cell of a table.
BAR = '\\|'
_INDEX = """# Command line

One page for each verb of `pam`, made from its parser. `pam VERB --help` says the same.

Exit codes: 0 answered or done, 1 something is wrong with the data or the run, 2 bad input,
130 interrupted. With `--json` a verb prints its result as JSON. An error is then JSON too:
`{"error": "one sentence", "exit_code": 2}`.

"""


def verbs():
    """Return the parser of every verb by name, and its line in the overview."""
    parser = build_parser()
    action, = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    helps = {choice.dest: choice.help for choice in action._choices_actions}
    return {name: (sub, helps[name]) for name, sub in action.choices.items()}


def pages():
    """Return the path below docs/ and the text of each page."""
    found = verbs()
    made = {f'reference/cli/{name}.md': page(name, *rest) for name, rest in found.items()}
    rows = ''.join(f'| [`pam {name}`]({name}.md) | {plain(line)} |\n'
                   for name, (_, line) in found.items())
    tree = '\n```{toctree}\n:hidden:\n\n' + ''.join(f'{n}\n' for n in found) + '```\n'
    made['reference/cli/index.md'] = _INDEX + f'| verb | does |\n|---|---|\n{rows}' + tree
    return made


def page(name, parser, line):
    """Return the page of one verb."""
    usage = parser.format_usage().partition(': ')[2].strip()
    usage = re.sub(r'\n +', '\n    ', usage)
    parts = [f'# pam {name}', plain(parser.description or line),
             f'```text\n{usage}\n```']
    if parser.epilog:
        parts.append(f'```console\n$ {parser.epilog.removeprefix("Example: ").strip()}\n```')
    for group in parser._action_groups:
        actions = [a for a in group._group_actions if a.help != argparse.SUPPRESS]
        if not actions:
            continue
        heading = {'positional arguments': 'Arguments', 'options': 'Options'}.get(
            group.title, group.title)
        parts.append(f'## {heading}')
        if group.description:
            parts.append(plain(group.description))
        parts.append('| name | what it does | default |\n|:---|:---|:---|\n' + '\n'.join(
            _row(action, parser) for action in actions))
    return '\n\n'.join(part for part in parts if part) + '\n'


def _row(action, parser):
    metavar = parser._get_formatter()._format_args(
        action, action.metavar or (action.dest if not action.option_strings else
                                   action.dest.upper())) if action.nargs != 0 else ''
    names = ', '.join(f'`{name}`' for name in action.option_strings)
    shown = f'{names} `{metavar}`' if names and metavar else names or f'`{metavar}`'
    text = parser._get_formatter()._expand_help(action) if action.help else ''
    if action.choices is not None:
        text += f' (one of {", ".join(str(choice) for choice in action.choices)})'
    default = action.default
    hidden = (default in (None, False, argparse.SUPPRESS, '', [], ()) or action.nargs == 0
              or 'default:' in text)
    shown_default = '' if hidden else f'`{default}`'
    return f'| {shown.replace("|", BAR)} | {plain(text)} | {shown_default} |'


def plain(text):
    """Return a text of the parser as Markdown in which nothing else is markup."""
    parts = re.split(r'(?<![\w-])(--[a-z][a-z-]*)', ' '.join(text.split()))
    # Options are code: typography would make one dash of their two hyphens.
    return ''.join(f'`{part}`' if k % 2 else re.sub(r'([\\|*_<>\[\]`])', r'\\\1', part)
                   for k, part in enumerate(parts))
