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
YAML text to nodes, with the scalars of YAML 1.2: ``2e-10`` is a number, ``on`` is a text.

libyaml reads a text in a fifth of the time that Python takes. A few characters, such as tabs, it
takes where Python refuses them: a text that has any of these is read in Python. So is, once more,
what libyaml refuses: Python tells the mistake in its own words.
"""

import re

import yaml

MAX_DEPTH = 50
MAX_DIGITS = 300          # of a whole number; such a number still fits a float


class Loader(yaml.SafeLoader):
    """Safe loader with the YAML 1.2 core scalars only."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}
    depth = 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """Compose a node as the base class does, unless it is nested too deeply."""
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise yaml.composer.ComposerError(
                problem=f'nested deeper than {MAX_DEPTH} levels',
                problem_mark=self.peek_event().start_mark)
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node


def _construct_int(loader: Loader, node: yaml.ScalarNode) -> int:
    text = loader.construct_scalar(node)
    if len(text) > MAX_DIGITS:
        raise yaml.constructor.ConstructorError(
            problem=f'a whole number of {len(text)} digits is too large',
            problem_mark=node.start_mark)
    return int(text)       # YAML 1.2: a leading zero is not octal


Loader.add_constructor('tag:yaml.org,2002:int', _construct_int)
for _tag, _pattern, _first in (
    ('bool', r'^(?:true|True|TRUE|false|False|FALSE)$', 'tTfF'),
    ('null', r'^(?:~|null|Null|NULL|)$', ['~', 'n', 'N', '']),
    ('int', r'^[-+]?[0-9]+$', '-+0123456789'),
    ('float', r'^(?:[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?'
              r'|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$', '-+.0123456789'),
):
    Loader.add_implicit_resolver(
        f'tag:yaml.org,2002:{_tag}', re.compile(_pattern), list(_first))


def _is_simple(text: str) -> bool:
    """Return whether libyaml takes no other texts of these characters than Python does."""
    return not set(text) & set('?!') and text.replace('\n', '').isprintable()


def _quick_loader(text: str) -> Loader:
    """Return a loader that gets its events from libyaml, if it reads this text as Python does."""
    loader = Loader(text)
    if yaml.__with_libyaml__ and _is_simple(text):
        parser = yaml.CSafeLoader(text)
        for name in ('check_event', 'peek_event', 'get_event'):
            setattr(loader, name, getattr(parser, name))
    return loader


def composed(text: str) -> tuple[Loader, yaml.Node | None]:
    """
    Return a loader and the node of the document of a text, or None where it is empty.

    Raises
    ------
    yaml.YAMLError
        Not YAML, or nested too deeply.

    """
    try:
        loader = _quick_loader(text)
        return loader, loader.get_single_node()
    except yaml.YAMLError:
        loader = Loader(text)
        return loader, loader.get_single_node()
