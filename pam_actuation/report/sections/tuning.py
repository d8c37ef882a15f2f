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

"""What offline tuning changed."""

from typing import Any, TYPE_CHECKING

from pam_actuation.report import figures
from pam_actuation.report.page import paragraph, plot, Section, table

if TYPE_CHECKING:
    from pam_actuation.tuning.tune import TuneResult

_UNITS = {'mm': 'mm', 'deg': '°'}      # as names end with them, and as they are shown


def tuning_section(result: 'TuneResult | dict[str, Any]') -> Section:
    """
    Return the section of a tuning result.

    Parameters
    ----------
    result : object or dict
        With ``to_dict()`` or as a dict. Used where present: ``changed`` (name to
        {before, after}), ``history`` (pairs of rollouts done and best cost [mm]), and
        any other plain number, shown in a table.

    """
    data = result if isinstance(result, dict) else result.to_dict()
    body = paragraph(
        'Settings of the controller were searched on the model, against simulated runs of '
        'the experiments; runs that were not searched, with other random numbers, then checked '
        'the result.')
    plain = [[_words(name), _shown(value)] for name, value in data.items()
             if isinstance(value, (int, float, bool, str)) and value != '']
    if plain:
        body += table([], plain, 'facts')
    changed = data.get('changed') or {}
    if changed:
        body += table(['setting', 'before', 'after'], [
            [name, _shown(c['before']), _shown(c['after'])] for name, c in changed.items()])
    runs = data.get('held_out_runs') or []
    if len(runs) > 1:
        body += table([f'held-out {_words(name)}' for name in runs[0]], [
            [_shown(value) for value in one.values()] for one in runs])
    unit = 'deg' if any(name.endswith('_deg') for name in data) else 'mm'
    history = data.get('history') or getattr(result, 'history', None) or []
    if len(history) > 1:
        done, cost = zip(*history)
        line = figures.line(done, cost, 'best cost', 'after', held=True)
        body += plot(figures.stack(
            [(f'best cost [{_UNITS[unit]}]', [line])], 'simulated runs', row_px=220))
    return Section('tuning', 'Offline tuning', body)


def _words(name: str) -> str:
    words = str(name).replace('_', ' ')
    what, _, unit = words.rpartition(' ')
    return f'{what} [{_UNITS[unit]}]' if unit in _UNITS else words


def _shown(value: bool | float | str) -> int | str:
    if isinstance(value, bool):
        return 'yes' if value else 'no'
    return f'{value:.5g}' if isinstance(value, float) else value
