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
import unicodedata

from pam_actuation.tables.languages import in_english
from pam_actuation.tables.units import ends_a_name, FACTORS, unit_of_text

_BRACKETS = re.compile(r'(?!(?<=\w)\[\d+\])[\[(]([^\])]*)[\])]\s*$')     # `data[1]` has no unit

_NO_ENDS = ('1', '-', 'kp', 'Kp', 'KP')      # `force_kp` is the gain of a controller


def unit_in(name: str) -> str:
    """Return the unit in the name of a column, as ``p_bar`` or ``p [bar gauge]``; '' if none."""
    name = _narrow(name)
    found = _BRACKETS.search(name)
    if found:
        return found[1].strip()
    parts = re.split(r'[_\s.,/]+', name.strip())
    for count in (2, 1):                    # bar_gauge, then bar
        text = '_'.join(parts[-count:])
        if len(parts) > count and text not in _NO_ENDS and (ends_a_name(text) or any(
                unit_of_text(text, one) for one in FACTORS)):
            return text
    return ''


def path_and_name(column: str) -> tuple[str, str]:
    """Return what stands before the last stroke, and after it; one in a unit is none."""
    place = _BRACKETS.sub('', column).rfind('/')
    return column[:max(place, 0)], column[place + 1:]


def words_of(name: str) -> str:
    """Return the words of a column's name in English and lower case, without its unit."""
    name = _narrow(name)
    unit = unit_in(name)
    text = _BRACKETS.sub('', name)
    if unit and text == name:
        parts = re.split(r'[_\s.,/]+', name.strip())
        text = ' '.join(parts[:-len(unit.split('_'))])
    text = re.sub(r'([a-z])([A-Z])', r'\1 \2', text)
    text = re.sub(r"\b[dDlL]['’]", '', text)                  # as in `pression d'alimentation`
    words = re.split(r'[_\s./-]+', text.lower().strip())
    return ' '.join(in_english(word) for word in words).strip()


def _narrow(name: str) -> str:
    """Return a name with the narrow forms of brackets and letters, as `（kPa）` has wide ones."""
    return ''.join(unicodedata.normalize('NFKC', one) if unicodedata.east_asian_width(one) == 'F'
                   else one for one in name)
