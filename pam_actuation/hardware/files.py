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

"""Parameter files of real hardware: found, and checked to be one before a node reads them."""

from collections.abc import Iterator
import re

from pam_actuation.resources import find_config
from pam_sim.located_yaml import load_yaml, Located

PARAMETERS, BACK_END = 'ros__parameters', 'backend'
WILDCARDS = {'**': '(/[^/]+)*', '*': '/[^/]+'}
_DEPTH = 8                  # namespaces above the parameters
# A key that only another kind of file has, what that is, and where it is given.
_OTHERS = (
    ('segments', 'an experiment', '--experiment'), ('controller', 'a controller', '--controller'),
    ('rig', 'a model of a rig', '--model'), ('muscle', 'a model of a rig', '--model'),
    ('joint', 'a model of a joint', '--model'))


def hardware_file(name: str) -> str:
    """
    Return the path of a parameter file of hardware, as a text.

    Parameters
    ----------
    name : str
        A name in config/hardware, or the path of a file.

    Raises
    ------
    InputError
        No such file, or one of another kind.

    """
    path = find_config('hardware', name)
    tree = load_yaml(path)
    if not holds_parameters(tree):
        kind = next((f'is {what}, not hardware; give it with {option}'
                     for key, what, option in _OTHERS if key in tree),
                    'is no file of hardware')
        raise tree.error(
            f'{kind}. A file of hardware holds parameters below `{PARAMETERS}` of a node, such '
            'as those in config/hardware')
    return str(path)


def holds_parameters(tree: Located, depth: int = _DEPTH) -> bool:
    """Return whether every branch of a tree leads to parameters of a node, by its name."""
    nameless = depth == _DEPTH and PARAMETERS in tree
    return bool(tree) and not nameless and depth > 0 and all(
        isinstance(value, Located) and (key == PARAMETERS or holds_parameters(value, depth - 1))
        for key, value in tree.items())


def entries(tree: Located, above: tuple[str, ...] = ()) -> Iterator[
        tuple[tuple[str, ...], Located, str]]:
    """Return the words of the name of each node, the mapping that holds it, and its key there."""
    for key, value in tree.items():
        if key == PARAMETERS:           # of the node above, which may be a namespace as well
            continue
        words = (*above, *filter(None, key.split('/')))
        if PARAMETERS in value:
            yield words, tree, key
        yield from entries(value, words)


def matches(words: tuple[str, ...], full_name: str) -> bool:
    """Tell whether a name with wildcards, as ROS reads them, is that of a node."""
    pattern = ''.join(WILDCARDS.get(word) or f'/{re.escape(word)}' for word in words)
    return re.fullmatch(pattern, full_name) is not None
