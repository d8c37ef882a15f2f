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

"""Unknown numbers of a model, found before the look for what it misses."""

from typing import TYPE_CHECKING

from pam_actuation.report.page import paragraph, Section, table
from pam_sim.units import behind_number

if TYPE_CHECKING:
    from pam_sim.gap.result import GapResult


def numbers_section(result: 'GapResult') -> list[Section]:
    """Return the section of the unknown numbers; none where no number was unknown."""
    first = result.numbers_first
    if not first:
        return []
    body = paragraph('The model has unknown numbers. These are found first, so that a wrong '
                     'load or valve is not taken for an effect or an error of a sensor.')
    body += table(['number', 'status', 'value', '95 % interval'], [
        [n['name'], n['status'], f'{n["value"]:.5g}{behind_number(n["unit"])}',
         ' … '.join('open' if end is None else f'{end:.5g}' for end in n['ci95'])]
        for n in first['numbers']])
    for formula in first['together']:
        body += paragraph(f'Known together: {formula}.')
    for remark in first['remarks']:
        body += paragraph(f'{remark}.', 'note')
    if first['next_experiment']:
        body += paragraph(f'What would determine the rest: {first["next_experiment"]}.')
    return [Section('numbers', 'Unknown numbers first', body)]
