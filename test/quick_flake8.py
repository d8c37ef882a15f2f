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

"""
flake8 as on its command line, but each file is cut into tokens and nodes once for all plug-ins.

It finds what flake8 finds, as test_style.py compares, in four fifths of the time.
"""

import ast
import gc
import sys
import tokenize

from flake8.main import cli
from flake8.processor import FileProcessor

tokens_of_lines, nodes_below = tokenize.generate_tokens, ast.walk
last_tokens, last_nodes = ([], []), (None, [])


def generate_tokens(readline):
    """Return the tokens of a file; kept until another file is read."""
    global last_tokens
    if isinstance(getattr(readline, '__self__', None), FileProcessor):
        return tokens_of_lines(readline)    # flake8 checks each line when it is handed out
    lines = []
    try:
        while line := readline():
            lines.append(line)
    except StopIteration:
        pass
    if last_tokens[0] != lines:
        further = iter(lines)
        last_tokens = lines, list(tokens_of_lines(lambda: next(further, '')))
    return iter(last_tokens[1])


def walk(node):
    """Return a node and all below it; those of a whole file are kept until the next one."""
    global last_nodes
    if not isinstance(node, ast.Module):
        return nodes_below(node)
    if last_nodes[0] is not node:
        last_nodes = node, list(nodes_below(node))
    return iter(last_nodes[1])


if __name__ == '__main__':
    tokenize.generate_tokens, ast.walk = generate_tokens, walk
    gc.set_threshold(100_000, 20, 50)
    sys.exit(cli.main())
