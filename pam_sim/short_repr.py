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

"""Short ``repr`` texts for objects that hold arrays: what there is, not every number."""

from collections.abc import Collection, Mapping
from dataclasses import fields
from typing import Any, TypeVar

import numpy as np

LONGEST = 60        # characters of one value
SHOWN = 8           # names of a mapping, items of a short sequence

T = TypeVar('T')


def short_repr(cls: type[T]) -> type[T]:
    """
    Give a dataclass a ``repr`` that stays short however much its fields hold.

    ``Trace(stamp_ns=int64[2000], measured={contraction: float64[2000]})``. Decorates the
    class above ``@dataclass``.
    """
    def __repr__(self: Any) -> str:
        inside = ', '.join(
            f'{one.name}={brief(getattr(self, one.name))}' for one in fields(self) if one.repr)
        return f'{type(self).__name__}({inside})'
    setattr(cls, '__repr__', __repr__)
    return cls


def brief(value: object, depth: int = 1) -> str:
    """Return a value in at most a line: arrays by type and shape, mappings by their names."""
    if isinstance(value, np.ndarray) and value.ndim:
        return f'{value.dtype}[{", ".join(map(str, value.shape))}]'
    if isinstance(value, (float, np.floating)):
        return f'{value:.6g}'
    if isinstance(value, dict):
        return _mapping(value, depth)
    if isinstance(value, (list, tuple, set, frozenset)):
        return _sequence(value, depth)
    text = repr(value)
    if len(text) <= LONGEST:
        return text
    if isinstance(value, (str, bytes)):
        return f'{text[:LONGEST // 2]}… ({len(value)} long)'
    return f'<{type(value).__name__}>'


def _mapping(value: Mapping[Any, object], depth: int) -> str:
    names = list(value)
    if not names:
        return '{}'
    if depth <= 0:
        return f'<{len(names)} entries>'
    parts = [f'{name}: {brief(value[name], depth - 1)}' for name in names[:SHOWN]]
    rest = [f'and {len(names) - SHOWN} more'] if len(names) > SHOWN else []
    return '{' + ', '.join(parts + rest) + '}'


def _sequence(value: Collection[object], depth: int) -> str:
    left, right = '[]' if isinstance(value, list) else '()'
    if len(value) <= SHOWN and depth > 0:
        text = f'{left}{", ".join(brief(item, depth - 1) for item in value)}{right}'
        if len(text) <= LONGEST:
            return text
    return f'<{type(value).__name__} of {len(value)}>'
