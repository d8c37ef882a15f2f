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

"""A data frame as a file for a spreadsheet, MATLAB or Julia."""

import importlib
from pathlib import Path
from typing import TYPE_CHECKING

from pam_actuation.tables.formats import ENDINGS
from pam_sim.errors import InputError
from pam_sim.files import shown, StrPath, whole_file

if TYPE_CHECKING:
    import pandas as pd

# Of the text files only those whose ending says the separator.
WRITTEN = tuple(ending for ending, kind in ENDINGS.items()
                if ending in ('.csv', '.tsv') or kind not in ('delimited', 'bag', 'tdms'))


def write_table(frame: 'pd.DataFrame', path: StrPath) -> Path:
    """
    Write a data frame as the file whose ending the path has, whole or not at all.

    Raises
    ------
    InputError
        An ending that is not among ``WRITTEN``, a library that is missing, no right to write.

    """
    ending = check_ending(path)
    with whole_file(path, suffix=ending) as temporary:
        importlib.import_module(f'pam_actuation.tables.formats.{ENDINGS[ending]}').write(
            frame, temporary)
    return Path(path)


def check_ending(path: StrPath) -> str:
    """Return the ending of a path in lower case; InputError for one that cannot be written."""
    ending = Path(path).suffix.lower()
    if ending not in WRITTEN:
        raise InputError(f'the ending {ending!r} is unknown; allowed: {", ".join(WRITTEN)}',
                         shown(path))
    return ending
