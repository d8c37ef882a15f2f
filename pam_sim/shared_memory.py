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

"""Objects whose arrays look into one another, and that can be copied and pickled all the same."""

from collections.abc import Callable
from dataclasses import dataclass
import types
from typing import Any

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, eq=False)
class _Place:
    """Where an array stands in the memory of another."""

    owner: npt.NDArray[Any]
    begin: int                  # bytes
    shape: tuple[int, ...]
    strides: tuple[int, ...]
    dtype: 'np.dtype[Any]'

    def array(self) -> npt.NDArray[Any]:
        """Return the array at this place."""
        return np.ndarray(self.shape, self.dtype, self.owner, self.begin, self.strides)


class SharedMemory:
    """
    Base class of objects whose arrays look into one another, such as those of ``cells``.

    ``copy.deepcopy`` and ``pickle`` make a view an array of its own: what the copy writes into
    it would not arrive in the array it is a part of. Here a view travels as its place in the
    array that owns the memory. A copy steps as its original does, and independently of it.
    """

    def __getstate__(self) -> dict[str, Any]:
        """Return the attributes, views as places."""
        state: dict[str, Any] = _mapped(vars(self), _place)
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Take attributes, places as views."""
        vars(self).update(_mapped(state, _view))


def _place(value: Any) -> Any:
    """Return a view as its place in the array that owns its memory, all else as it is."""
    if type(value) is not np.ndarray or value.base is None:
        return value
    owner: Any = value
    while isinstance(owner, (np.ndarray, np.void)) and owner.base is not None:
        owner = owner.base
    if type(owner) is not np.ndarray or not owner.flags.c_contiguous:
        return value
    begin = value.__array_interface__['data'][0] - owner.__array_interface__['data'][0]
    return _Place(owner, begin, value.shape, value.strides, value.dtype)


def _view(value: Any) -> Any:
    """Return a place as the view it stands for, all else as it is."""
    return value.array() if isinstance(value, _Place) else value


def _mapped(value: Any, change: Callable[[Any], Any]) -> Any:
    """Return a value with what it holds changed; what holds nothing to change stays itself."""
    if isinstance(value, types.SimpleNamespace):
        inner = _mapped(vars(value), change)
        return value if inner is vars(value) else types.SimpleNamespace(**inner)
    if type(value) is dict:
        changed = {key: _mapped(one, change) for key, one in value.items()}
        return value if all(changed[key] is one for key, one in value.items()) else changed
    if type(value) in (tuple, list):
        parts = [_mapped(one, change) for one in value]
        same = all(new is one for new, one in zip(parts, value))
        return value if same else type(value)(parts)
    return change(value)
