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
What stands over a column, taken apart: the name in English words, and the unit.

``p_bar``, ``p [bar]``, ``p (bar)``, ``p/bar``, ``p, bar`` and ``p in bar`` say the same.
"""

import re
from typing import NamedTuple
import unicodedata

from pam_actuation.tables.languages import in_english
from pam_actuation.tables.parts import measured_by, quantities_of
from pam_actuation.tables.units import ends_a_name, PRESSURE, unit_of_text

_BRACKETS = re.compile(r'(?!(?<=\w)\[\d+\])[\[(]([^\])]*)[\])]\s*$')     # `data[1]` has no unit
# The last word or the last two, without brackets, and all that stands before them.
_ENDINGS = [re.compile(rf'(.*[^_\s.,/][_\s.,/]+)([^_\s.,/]+{more})')
            for more in (r'[_\s.,/]+[^_\s.,/]+', '')]
_IN = re.compile(r'([_\s.,/]+)(in|en|em)([_\s.,/]*)$', re.IGNORECASE)
_IN_BRACKETS = re.compile(r'(in|en|em)\s+', re.IGNORECASE)
_OF = re.compile(r'(?<=%)\s*(of|von|de|du|der|van|di)\s[^\])]*', re.IGNORECASE)       # `% of L0`
_NO_ENDS = ('1', '-', 'kp', 'Kp', 'KP')      # `force_kp` is the gain of a controller
_INDICES = ('in', 'm', 's')                  # of a pressure `p_m` they are no unit


class Heading(NamedTuple):
    """
    What stands over a column.

    Parameters
    ----------
    name : str
        Without the unit.
    unit : str
        As it is written, such as ``bar gauge``; '' without one.
    inlet : str
        Another name that may be meant: ``p_in`` of ``p_in_bar``, which is `p` in bar or the
        pressure at the inlet; '' where there is no doubt.

    """

    name: str
    unit: str
    inlet: str = ''


def heading(column: str) -> Heading:
    """Return name and unit of what stands over a column."""
    text = _OF.sub('', _narrow(column)).strip()
    found = _BRACKETS.search(text)
    if found is None:
        name, unit = _without_brackets(text)
    else:
        name, unit = text[:found.start()], found[1].strip()
        bare = _IN_BRACKETS.sub('', unit, count=1)
        unit = bare if quantities_of(bare) else unit                # `Kraft (in N)`
        inner = heading(name)
        whole = f'{inner.unit}_{unit}'
        if inner.unit and unit_of_text(whole, PRESSURE):            # `p_bar (abs)`
            return inner._replace(unit=whole)
        if inner.unit and not quantities_of(unit):                  # `p_bar (muscle)`
            return Heading(f'{inner.name} {unit}', inner.unit)
    word = _IN.search(name) if unit else None
    own = name[:word.start()] if word else ''
    name = name.rstrip(' \t_.,/') or name
    if word is None or not own:
        return Heading(name, unit)
    is_apart = bool(re.search(r'[\s,]', word[1]))                   # a word, and no index
    if word[2].lower() != 'in' or is_apart and found is None:
        return Heading(own, unit)
    if is_apart or found is None and not re.search(r'\s', word[3]):
        return Heading(own, unit, f'{own} in')
    return Heading(name, unit)


def unit_in(column: str) -> str:
    """Return the unit in the name of a column, as ``p_bar`` or ``p [bar gauge]``; '' if none."""
    return heading(column).unit


def words_of(column: str) -> str:
    """Return the words of a column's name in English and lower case, without its unit."""
    return words_in(heading(column).name)


def words_in(name: str) -> str:
    """Return the words of a name that has no unit, in English and lower case."""
    text = re.sub(r'([a-z])([A-Z])', r'\1 \2', name)
    text = re.sub(r"\b[dDlL]['’]", '', text)                  # as in `pression d'alimentation`
    words = re.split(r'[_\s.,/-]+', text.lower().strip())
    return ' '.join(in_english(word) for word in words).strip()


def _without_brackets(text: str) -> tuple[str, str]:
    """Return name and unit of a text such as ``p_bar_gauge``."""
    for pattern in _ENDINGS:                # bar_gauge, then bar
        found = pattern.fullmatch(text)
        unit = '_'.join(re.split(r'[_\s.,/]+', found[2])) if found else ''
        if found and unit not in _NO_ENDS and (ends_a_name(unit) or quantities_of(unit)):
            is_index = unit in _INDICES and not found[1].endswith('/')        # no `mm/s`
            meant = measured_by(words_in(found[1])) if is_index else set()
            if not meant or meant & quantities_of(unit):
                return found[1], unit
    return text, ''


def _narrow(name: str) -> str:
    """Return a name with the narrow forms of brackets and letters, as `（kPa）` has wide ones."""
    return ''.join(unicodedata.normalize('NFKC', one) if unicodedata.east_asian_width(one) == 'F'
                   else one for one in name)
