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
Namespaces and full names of nodes, however the user writes them, in the one form ROS takes.

``muscle``, ``/muscle`` and ``/muscle/`` all mean ``/muscle``. Needs no ROS.
"""

from collections.abc import Iterable
import re

from pam_sim.errors import InputError

LONGEST = 150       # ROS allows 255 characters for the name of a service below it
# As the parser of ROS arguments has it: no two _ in a row.
_PART = re.compile(r'(?!.*__)[A-Za-z_][A-Za-z0-9_]*')

MUSCLE, JOINT = '/muscle', '/knee'      # where nothing else is said


def namespace_of(text: str, where: str = 'namespace') -> str:
    """
    Return a namespace as ROS writes it: a slash before each part, '' for the root.

    Raises
    ------
    InputError
        ROS would refuse it.

    """
    parts = [part for part in text.split('/') if part]
    if not all(map(_PART.fullmatch, parts)):
        raise InputError(
            f'{text!r} is not allowed, it must be names of letters, digits and single _ joined '
            'by /, none of which begins with a digit', where)
    namespace = ''.join(f'/{part}' for part in parts)
    if len(namespace) > LONGEST:
        raise InputError(f'has {len(namespace)} characters, allowed are {LONGEST}', where)
    return namespace


def name_in(namespace: str) -> str:
    """Return the name of a joint by its namespace, so of one alone: left_knee in /left/knee."""
    return namespace.strip('/').replace('/', '_') or JOINT.strip('/')


def namespace_part(text: str, where: str = 'name') -> str:
    """
    Return a name that may be a part of a namespace.

    Raises
    ------
    InputError
        It may not.

    """
    if not _PART.fullmatch(text):
        raise InputError(f'{text!r} is not allowed, it must be letters, digits and single _, and '
                         'begin with a letter or _', where)
    return text


def lies_in(namespace: str, other: str) -> bool:
    """Return whether a namespace is another one or lies below it; all lie in the root, ''."""
    return f'{namespace}/'.startswith(f'{other}/')


def outermost(namespaces: Iterable[str]) -> list[str]:
    """Return the namespaces that lie below no other of them, in order: of joints, not muscles."""
    given = list(namespaces)
    return [one for one in given
            if not any(other != one and lies_in(one, other) for other in given)]


def launch_namespace(text: str) -> str:
    """Return a namespace as launch takes it; without a slash before it, it stays relative."""
    namespace = namespace_of(text)
    return namespace if text.startswith('/') else namespace.removeprefix('/')


def node_name_of(text: str, namespace: str = '', where: str = 'name') -> str:
    """
    Return the full name of a node; a name without a slash is one in ``namespace``.

    Raises
    ------
    InputError
        ROS would refuse it.

    """
    name = namespace_of(text if '/' in text else f'{namespace}/{text}', where)
    if not name:
        raise InputError(f'{text!r} is no name of a node', where)
    return name
