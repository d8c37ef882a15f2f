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

"""The sources as trees. Walk through one at a time: looks for garbage among all take longest."""

import ast


def parsed(path):
    """Return the module in a file."""
    return ast.parse(path.read_text(encoding='utf-8'))


def statements_in(node):
    """Return the statements directly within a node; expressions, most of a module, hold none."""
    return [one for name in ('body', 'orelse', 'finalbody', 'handlers', 'cases')
            for one in getattr(node, name, ())]


def statements(node):
    """Return all statements within a node."""
    for one in statements_in(node):
        yield one
        yield from statements(one)


def imports(module):
    """Return the statements of a module that import something."""
    return [one for one in statements(module) if isinstance(one, (ast.Import, ast.ImportFrom))]
