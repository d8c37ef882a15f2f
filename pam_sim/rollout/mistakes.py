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
What cannot be compiled of effects, laws and loads, told with its file.

The calls of a step are compiled as one. So numba tells a mistake in one of their functions by the
way through all that calls it. Here each of these functions is compiled alone, once that happened.
"""

from collections.abc import Iterator
import inspect
from pathlib import Path
import re
from typing import Any, NamedTuple

import numpy as np
from pam_sim.compiled import Compiled, interpreted, named_arguments
from pam_sim.effects.registry import all_effects
from pam_sim.errors import did_you_mean, InputError
from pam_sim.load import LOADS
from pam_sim.load.registry import has_force, packed_of
from pam_sim.muscle.registry import laws
from pam_sim.rollout import layout
from pam_sim.rollout.hooks import HOOKS

_PACKAGE = Path(__file__).parents[1]
_COLOURS = re.compile(r'\x1b\[[0-9;]*m')


class _Part(NamedTuple):
    """A function of a plug-in: what it is called, its records, and what it must return."""

    what: str
    function: Any
    records: dict[str, np.dtype[Any]]
    returns: tuple[str, ...]

    @property
    def file(self) -> Path:
        """Return the file it stands in."""
        return Path(interpreted(self.function).__code__.co_filename)


def first_mistake() -> InputError | None:
    """Return what is wrong with the first function that cannot be compiled alone, if any."""
    parts = sorted(_parts(), key=lambda part: part.file.is_relative_to(_PACKAGE))
    return next(filter(None, map(_mistake, parts)), None)


def _parts() -> Iterator[_Part]:
    for effect in all_effects().values():
        records = {'par': effect.packed, 'plant': layout.STATE}
        if effect.states is not None:
            records['state'] = effect.states
        for hook, function in effect.hooks.items():
            yield _Part(f'hook `{hook}`', function, records, HOOKS[hook].returns)
    for law in laws().values():
        for name, formula, returns in (
                ('tension_n', law.COMPILED, 'force_n'),
                ('damper_force_n', law.COMPILED_DAMPER, 'force_n'),
                ('volume_m3', law.COMPILED_VOLUME, 'volume_m3')):
            if formula is not None:
                yield _Part(f'`{name}`', formula, {'par': law.PACKED}, (returns,))
    for load in LOADS.values():
        if has_force(load):
            yield _Part('`load_force_n`', load.load_force_n, {'par': packed_of(load)},
                        ('force_n',))


def _mistake(part: _Part) -> InputError | None:
    """Return what is wrong with a function, None where nothing is."""
    import numba
    from numba import types
    given = tuple(numba.from_dtype(part.records[name]) if name in part.records else numba.float64
                  for name in named_arguments(part.function))
    dispatcher = part.function.dispatcher
    try:
        dispatcher.compile(given)
    except Exception as error:      # whatever numba raises for a mistake in somebody's code
        line, reason = _reason(part, error)
        return InputError(f'{part.what} cannot be compiled: {reason}', f'{part.file}:{line}')
    found = dispatcher.overloads[given].signature.return_type
    values = tuple(found) if isinstance(found, (types.Tuple, types.UniTuple)) else (found,)
    numbers = all(isinstance(value, (types.Number, types.Boolean)) for value in values)
    if not part.returns or (numbers and len(values) == len(part.returns)):
        return None
    told = (f'{len(values)} number{"s" * (len(values) > 1)}' if numbers
            else 'nothing' if str(found) == 'none' else ', '.join(map(str, values)))
    return InputError(f'{part.what} returns {told}; write `return {", ".join(part.returns)}` with '
                      'a number for each', f'{part.file}:{_line_of(part.function)}')


def _reason(part: _Part, error: Exception) -> tuple[int, str]:
    """Return the line of a mistake and numba's reason, without its way there."""
    if isinstance(error, KeyError):     # numba's own look into a record
        name = str(error.args[0])
        known = [own for record in part.records.values() for own in record.names or ()]
        return (_line_of(part.function, rf'\.{re.escape(name)}\b'),
                f'there is no number `{name}`{did_you_mean(name, known)}; allowed: '
                f'{", ".join(known)}')
    rows = [row.strip() for row in _COLOURS.sub('', str(error)).splitlines() if row.strip()]
    rows = [row for row in rows if not row.startswith('Failed in')] or [type(error).__name__]
    reason = rows[0]
    if reason.endswith(':') and len(rows) > 1:
        reason += ' ' + rows[1].removeprefix('>>> ')
    place = getattr(error, 'loc', None)
    if place is not None and Path(place.filename) == part.file:
        return place.line, reason
    return _line_of(part.function), reason


def _line_of(function: Compiled[..., Any], pattern: str = r'def ') -> int:
    """Return the first line of a function with a pattern, that of its name without one."""
    rows, first = inspect.getsourcelines(interpreted(function))
    return first + next((k for k, row in enumerate(rows) if re.search(pattern, row)), 0)
