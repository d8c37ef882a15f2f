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

"""The words in the name of a column, and the unit that it ends in."""

import re

from pam_actuation.tables.units import FACTORS, unit_of_text

_BRACKETS = re.compile(r'(?!(?<=\w)\[\d+\])[\[(]([^\])]*)[\])]\s*$')     # `data[1]` has no unit


def unit_in(name: str) -> str:
    """Return the unit in the name of a column, as ``p_bar`` or ``p [bar gauge]``; '' if none."""
    found = _BRACKETS.search(name)
    if found:
        return found[1].strip()
    parts = re.split(r'[_\s.,/]+', name.strip())
    for count in (2, 1):                    # bar_gauge, then bar
        text = '_'.join(parts[-count:])
        if len(parts) > count and text not in ('1', '-') and any(
                unit_of_text(text, one) for one in FACTORS):
            return text
    return ''


def words_of(name: str) -> str:
    """Return the words of a column's name in lower case, without its unit."""
    unit = unit_in(name)
    text = _BRACKETS.sub('', name)
    if unit and text == name:
        parts = re.split(r'[_\s.,/]+', name.strip())
        text = ' '.join(parts[:-len(unit.split('_'))])
    text = re.sub(r'([a-z])([A-Z])', r'\1 \2', text)
    return ' '.join(re.split(r'[_\s./-]+', text.lower().strip())).strip()
