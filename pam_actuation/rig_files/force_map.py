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

"""The table of a force map for a rig file: as it is, or made from what others measured."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
import math
import os
from pathlib import Path
import re
from typing import TYPE_CHECKING

from pam_actuation.tables.separated import rows_of_text
from pam_sim.errors import InputError
from pam_sim.files import check_file, whole_file
from pam_sim.muscle.geometry import BRAID_ANGLE_RAD
from pam_sim.muscle.lookup_table import COLUMNS, read_commented_csv, read_table
from pam_sim.muscle.table_remarks import max_strain_in

if TYPE_CHECKING:
    from pam_actuation.rig_files.description import Description

_SIZE = re.compile(r'^muscle of length (\d+(?:\.\d+)?) mm(?:, bore (\d+(?:\.\d+)?) mm)?', re.M)

_OFF = re.compile(r'^force of the table off at the measured points: ([\d.e+-]+) %', re.M)
_ANGLE = re.compile(r'inextensible braid of (\d+(?:\.\d+)?) degrees')

_UNKNOWN = re.compile(r'^not known: (.+)$', re.M)


def size_in_table(path: str) -> dict[str, float]:
    """
    Return length, bore and angle of the muscle as far as the comments of a table say them.

    ``pam characterise`` writes them; a table of another source gives an empty dict.
    """
    source = read_commented_csv(path)[1]
    found, angle = _SIZE.search(source), _ANGLE.search(source)
    sizes = zip(('length_m', 'bore_m'), found.groups() if found else ())
    size = {name: round(1e-3 * float(mm), 12) for name, mm in sizes if mm is not None}
    if angle is not None and abs(float(angle[1]) - math.degrees(BRAID_ANGLE_RAD)) > 0.05:
        size['braid_angle_rad'] = round(math.radians(float(angle[1])), 12)
    return size


def off_in_table(path: str) -> float:
    """
    Return how far a table is off its points, as a fraction of the largest force.

    ``pam characterise`` writes it into the comments; of a table of another source it is 0.
    """
    found = _OFF.search(read_commented_csv(path)[1])
    return 0.01 * float(found[1]) if found else 0.0


def unknown_in_table(path: str) -> list[str]:
    """Return what the comments of a table say is not known, as ``pam characterise`` writes it."""
    return _UNKNOWN.findall(read_commented_csv(path)[1])


def describe_table(described: 'Description', path: str) -> None:
    """
    Take into a description what a table says of itself.

    Its size counts where neither muscle nor length nor bore is stated.
    """
    described.force_map = path
    described.force_map_off = off_in_table(path)
    described.force_map_unknown = unknown_in_table(path)
    described.force_map_strain = max_strain_in(read_table(path))
    if described.muscle is None and not described.dimensions.keys() & {'length_m', 'bore_m'}:
        described.dimensions = {**size_in_table(path), **described.dimensions}


@contextmanager
def force_map_of(path: str, size: Mapping[str, float], out: str, overwrite: bool
                 ) -> Iterator[tuple[str, list[str]]]:
    """
    Give (path of the table the muscle law ``lookup`` reads, what a reader should know of it).

    A table of another form (force over pressure and length, for instance) is characterised. The
    result stands beside the rig file. If the block fails, what stood there before does so again.

    Parameters
    ----------
    path : str
        A table of ``pam characterise``, or one measured by others.
    size : dict of str to float
        Dimensions that are stated; length and bore are needed for a table measured by others.
    out : str
        The rig file.
    overwrite : bool
        Whether a table beside it may be replaced.

    Raises
    ------
    InputError
        The table is of neither form, or the length is missing.

    """
    rows, _ = rows_of_text(path)
    if rows and tuple(rows[0]) == COLUMNS:
        read_table(path)
        yield path, unknown_in_table(path)
        return
    # Slow to import, and most rig files need no table.
    from pam_sim.characterise import characterise_table
    from pam_sim.characterise.dimensions import Dimensions
    from pam_sim.characterise.tables import read_measured_table
    measured = read_measured_table(path, rows_of_text)
    if not {'length_m', 'bore_m'} <= size.keys():
        raise InputError('a table measured by others needs --length-mm and --bore-mm, the size of '
                         'the muscle at rest', path)
    table_path = f'{os.path.splitext(out)[0]}_force_map.csv'
    check_file(table_path, overwrite)
    found = characterise_table(measured, Dimensions(**{
        name: value for name, value in size.items() if name != 'max_strain'}))
    before = Path(table_path).read_bytes() if os.path.exists(table_path) else None
    found.table().write_csv(check_file(table_path, overwrite))
    try:
        yield table_path, found.remarks
    except BaseException:
        if before is None:
            os.remove(table_path)
        else:
            with whole_file(table_path) as temporary:
                Path(temporary).write_bytes(before)
        raise
