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

"""Marks between thousands, as in 1.016,10 and 1,016.10: which they are, where that is certain."""

from collections.abc import Iterable
import re
from typing import NamedTuple

_OTHER = {',': '.', '.': ','}
# No number has these but between thousands.
_SPACES = " \u00a0\u202f'’"
_LIKE_A_NUMBER = re.compile(rf'\s*[+-]?\d[\d.,{_SPACES}]*\s*')
# Beside decimal commas nobody knows whether 1.016 is 1016 or has three decimals.
POINTS = r'[+-]?\d{1,3}(\.\d{3})+'
SENTENCE = 'are there points between thousands? Write numbers without them'


class Marks(NamedTuple):
    """The mark between thousands, and the decimal sign, of the numbers in a column."""

    thousands: str
    decimal: str

    def plain(self, text: str) -> str:
        """Return a number with a decimal point and nothing between thousands."""
        if not _LIKE_A_NUMBER.fullmatch(text):
            return text
        return text.strip().replace(self.thousands, '').replace(self.decimal, '.')


def with_thousands(decimal: str) -> str:
    """Return the expression of a number that has points, or commas, and a decimal sign."""
    return (rf'[+-]?[1-9]\d{{0,2}}({re.escape(_OTHER[decimal])}\d{{3}})+'
            rf'{re.escape(decimal)}\d+')


def are_marked(text: str) -> bool:
    """Return whether a number has marks between thousands: it cannot mean anything else."""
    spaced = rf'[+-]?[1-9]\d{{0,2}}([{_SPACES}]\d{{3}})+([.,]\d+)?'
    return any(re.fullmatch(one, text.strip())
               for one in (*map(with_thousands, _OTHER), spaced))


def marks_of(texts: Iterable[str], decimal: str) -> Marks | None:
    """
    Return the marks in the numbers of a column.

    None where there are none, or where numbers contradict one another, as 1016,10 beside
    1.016,10. A point or a comma counts only in a number that has both.

    Parameters
    ----------
    texts : iterable of str
        The column; texts that are no numbers do not count.
    decimal : str
        Decimal sign of the file, which counts where the mark is neither point nor comma.

    """
    numbers = dict.fromkeys(text.strip() for text in texts if _LIKE_A_NUMBER.fullmatch(text))
    # Those with a decimal sign first: they tell which it is.
    marked = sorted(filter(are_marked, numbers), key=lambda one: not re.search('[.,]', one))
    if not marked:
        return None
    first = marked[0].lstrip('+-')
    mark = next(one for one in first if not one.isdigit())
    last = re.sub(r'[^.,]', '', first)[-1:]
    own = last if last and last != mark else decimal
    whole = '' if mark in _OTHER else '?'
    allowed = re.compile(
        rf'[+-]?((0|[1-9]\d{{0,2}})({re.escape(own)}\d+)?'
        rf'|[1-9]\d{{0,2}}({re.escape(mark)}\d{{3}})+({re.escape(own)}\d+){whole})')
    return Marks(mark, own) if all(map(allowed.fullmatch, numbers)) else None
