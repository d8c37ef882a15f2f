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

"""Names of reported quantities in words: the keys of gap.json are for programs."""

import re

# The ending that says the unit; the value stands with its unit beside the words. In
# ``at_50mm_per_s_n`` that is ``n`` alone.
_UNIT = '(?:m3|m2|m|n|pa|kg|s|j|w|v)'
_ENDING = re.compile(f'(?<!_per)_{_UNIT}(?:_{_UNIT})*(?:_per_{_UNIT}(?:_{_UNIT})*)?$')
CONDITIONS = {'400kpa': '400 kPa', '500kpa': '500 kPa', '10mm': '10 mm',
              '20mm_per_s': '20 mm/s', '50mm_per_s': '50 mm/s'}


def place_in_words(subsystem: str) -> str:
    """Return a subsystem with its article: ``the valve``, but ``a sensor`` of several."""
    return 'a sensor' if subsystem == 'sensor' else f'the {subsystem}'


def in_words(name: str) -> str:
    """
    Return the name of a reported quantity in words.

    Parameters
    ----------
    name : str
        A key of ``equivalent`` in gap.json, such as ``loop_half_width_at_400kpa_n``.

    Returns
    -------
    str
        Such as ``loop half width at 400 kPa``.

    """
    plain = name
    if not name.endswith(tuple(CONDITIONS)):
        plain = _ENDING.sub('', name)
    head, at, condition = plain.partition('_at_')
    words = head.replace('_', ' ')
    if not at:
        return words
    for key, text in CONDITIONS.items():
        condition = condition.replace(key, text)
    return f'{words} at {condition.replace("_", " and ")}'
