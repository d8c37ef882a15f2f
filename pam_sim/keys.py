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

"""The keys of YAML files: what each holds, its range, its default and its meaning."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from pam_sim.located_yaml import Located


@dataclass(frozen=True)
class Key:
    """
    One key of a YAML file; the reader, its messages and the reference page use it.

    Parameters
    ----------
    name : str
        The key.
    kind : type
        What it holds, as ``Located.require`` takes it: ``float``, ``int``, ``str``, ``bool``,
        ``dict`` or ``list``.
    meaning : str
        One sentence.
    default : object, optional
        What counts where the key is absent.
    otherwise : str
        The default in words, where it is not a plain value.
    required : bool
        Whether the key must be there.
    unit : str
        SI unit of a number.
    lower, upper : float, optional
        Inclusive range of a number, or of each number in a list.
    choices : tuple, optional
        The values allowed.

    """

    name: str
    kind: type
    meaning: str
    default: Any = None
    otherwise: str = ''
    required: bool = False
    unit: str = ''
    lower: float | None = None
    upper: float | None = None
    choices: tuple[str, ...] | None = None

    def read(self, tree: Located) -> Any:
        """
        Return the checked value of this key in a mapping, or the default.

        Raises
        ------
        InputError
            A required key is missing; a value of another kind or out of range.

        """
        if not self.required and self.name not in tree:
            return self.default
        if self.kind is list:          # the range is that of its items
            return tree.require(self.name, list)
        return tree.require(self.name, self.kind, lower=self.lower, upper=self.upper,
                            choices=self.choices, unit=self.unit)


def names_of(keys: Iterable[Key]) -> tuple[str, ...]:
    """Return the names of keys, in their order."""
    return tuple(key.name for key in keys)
