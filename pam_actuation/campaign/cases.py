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
Which recordings a campaign has: those of a folder, or of a list; on which rig and day each was.

A recording of several muscles is a case for each of them.
"""

from collections.abc import Iterator, Sequence
import csv
from dataclasses import dataclass, replace
from datetime import datetime, timedelta, timezone
import os
from pathlib import Path
import re

from pam_actuation.bags.load import namespaces
from pam_actuation.bags.source import Bag, read_bag
from pam_sim.errors import did_you_mean, InputError
from pam_sim.files import StrPath

COLUMNS = ('path', 'rig', 'day', 'namespace', 'model')
BAG_FILES = ('.mcap', '.db3')
ONE_RIG = 'rig'                 # where neither folder nor list names one
# 2026-11-25, 20261125, and with a time behind it: 2026-11-25T0930, 20261125_093000.
DAY = re.compile(
    r'(?<!\d)(\d{4})-?(\d\d)-?(\d\d)(?:[T _-](\d\d)[:-]?(\d\d)(?:[:-]?(\d\d))?)?(?!\d)')
EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)


@dataclass(frozen=True)
class Case:
    """
    One muscle of one recording.

    Parameters
    ----------
    path : str
        The bag, absolute.
    rig : str
        On which rig it was recorded, with the muscle where the bag has several.
    day : str
        ``2026-11-25`` or ``2026-11-25T09:30``; the running number where no date is known.
    time : float
        The same in days, since 1970 or as the running number.
    namespace : str or None
        Of the muscle; None where the bag has one only.
    model : str
        Name or file of its model, '' for that of the campaign.

    """

    path: str
    rig: str
    day: str
    time: float
    namespace: str | None = None
    model: str = ''

    @property
    def name(self) -> str:
        """Return rig and day, which say to a person which case it is."""
        return f'{self.rig} {self.day}'


def find_cases(source: StrPath, without: StrPath | None = None) -> list[Case]:
    """
    Return the cases of a campaign by rig and time.

    Parameters
    ----------
    source : path
        A folder, with all bags below it; or a list: a text file with a path a line, or a CSV
        file with the columns ``path``, and if wanted ``rig``, ``day``, ``namespace``, ``model``.
    without : path, optional
        A folder that is left out, that of the results.

    Returns
    -------
    list of Case
        A recording that cannot be read is a case as well.

    Raises
    ------
    InputError
        Nothing there, no recording in it, or a mistake in the list, with its line.

    """
    root = Path(source)
    if root.is_dir():
        folder = root.resolve()
        listed: list[dict[str, str]] = [
            {'path': str(path)} for path in _bags_below(folder, without)]
        if not listed:
            raise InputError('no bag in this folder or below it', root)
    elif root.is_file():
        folder, listed = root.resolve().parent, _listed(root)
    else:
        raise InputError('no such folder or list of recordings', root)
    cases = [case for row in listed for case in _cases_of(row, folder)]
    return sorted(_dated(cases), key=lambda case: (case.rig, case.time, case.path))


def _bags_below(folder: Path, without: StrPath | None) -> Iterator[Path]:
    """Give the bags below a folder, by name."""
    left_out = os.path.realpath(without) if without is not None else None
    for place, names, files in os.walk(folder):
        here = Path(place)
        names[:] = sorted(name for name in names if not name.startswith('.')
                          and os.path.realpath(here / name) != left_out)
        if 'metadata.yaml' in files and here != folder:
            names[:] = []
            yield here
            continue
        yield from (here / name for name in sorted(files)
                    if name.endswith(BAG_FILES) and not name.startswith('.'))


def _listed(path: Path) -> list[dict[str, str]]:
    """Return the rows of a list."""
    try:
        lines = path.read_text(encoding='utf-8-sig').splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f'cannot be read as a list of recordings: {error}', path) from None
    kept = [(number, line) for number, line in enumerate(lines, 1)
            if line.strip() and not line.lstrip().startswith('#')]
    if not kept:
        raise InputError('lists no recording', path)
    head = [word.strip() for word in next(csv.reader([kept[0][1]]))]
    if 'path' not in head:
        return [{'path': line.strip()} for _, line in kept]
    for name in head:
        if name not in COLUMNS:
            raise InputError(f'has no meaning for the column `{name}`{did_you_mean(name, COLUMNS)}'
                             f'; known are {", ".join(COLUMNS)}', f'{path}:{kept[0][0]}')
    rows = []
    for number, line in kept[1:]:
        values = [word.strip() for word in next(csv.reader([line]))]
        if len(values) != len(head):
            raise InputError(f'has {len(values)} values for {len(head)} columns',
                             f'{path}:{number}')
        row = dict(zip(head, values))
        if row.get('day') and _date(row['day']) is None:
            raise InputError(f'day is {row["day"]!r}; write it as 2026-11-25 or '
                             '2026-11-25T09:30', f'{path}:{number}')
        rows.append(row)
    if not rows:
        raise InputError('lists no recording', path)
    return rows


def _cases_of(row: dict[str, str], folder: Path) -> list[Case]:
    """Return the cases of one recording; those without a date have the time of their stamps."""
    path = folder / row['path']
    inside = os.path.relpath(path.absolute(), folder)
    try:
        bag: Bag | None = read_bag(path, wanted=lambda *of: False)
    except InputError:      # told again, as the result of the case
        bag = None
    day = _date(row.get('day') or '') or _date(inside)
    if day is None:
        stamps = [] if bag is None else [
            int(topic.log_time_ns[0]) for topic in bag.topics.values() if len(topic.log_time_ns)]
        day = EPOCH + timedelta(microseconds=min(stamps, default=0) // 1000)
    rig = row.get('rig') or _rig_of(inside)
    several = [row['namespace']] if row.get('namespace') else _muscles(bag)
    model = row.get('model', '')
    if model and (folder / model).is_file():
        model = str(folder / model)
    time = (day - EPOCH) / timedelta(days=1)
    case = Case(str(path.absolute()), rig, _text(day), time, model=model)
    return [replace(case, namespace=muscle, rig=f'{rig}{muscle}') for muscle in several] or [case]


def _muscles(bag: Bag | None) -> list[str]:
    """Return the namespaces of a bag with several muscles, else none."""
    present = namespaces(bag) if bag is not None else {}
    for needed in ({'pressure', 'contraction'}, {'pressure'}, {'contraction'}):
        found = sorted(name for name, topics in present.items() if needed <= topics)
        if found:
            return found if len(found) > 1 else []
    return []


def _rig_of(inside: str) -> str:
    """Return the rig that the folders above a recording name."""
    folders = [part for part in Path(inside).parent.parts if part not in ('.', '..', os.sep)]
    named = [DAY.sub('', part).strip(' _-') for part in folders]
    return '/'.join(part for part in named if part) or ONE_RIG


def _date(text: str) -> datetime | None:
    """Return the last date in a text, None without one."""
    for found in reversed(list(DAY.finditer(text))):
        year, month, day, hour, minute, second = (int(part or 0) for part in found.groups())
        try:
            return datetime(year, month, day, hour, minute, second, tzinfo=timezone.utc)
        except ValueError:
            continue
    return None


def _text(day: datetime) -> str:
    at_midnight = (day.hour, day.minute) == (0, 0)
    return day.strftime('%Y-%m-%d' if at_midnight else '%Y-%m-%dT%H:%M')


def _dated(cases: Sequence[Case]) -> list[Case]:
    """Give running numbers to the cases of rigs whose recordings all have one time."""
    of_rig: dict[str, list[Case]] = {}
    for case in cases:
        of_rig.setdefault(case.rig, []).append(case)
    dated: list[Case] = []
    for several in of_rig.values():
        if len(several) > 1 and len({case.time for case in several}) == 1:
            several = [replace(case, day=str(number), time=float(number)) for number, case in
                       enumerate(sorted(several, key=lambda case: case.path), 1)]
        dated += several
    return dated
