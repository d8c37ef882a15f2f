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

A recording of several muscles is a case for each of them, or for each joint.
"""

from collections.abc import Iterator, Sequence
import contextlib
import csv
from dataclasses import dataclass, replace
from datetime import datetime, timedelta, timezone
import os
from pathlib import Path
import re
from typing import NamedTuple

from pam_actuation.bags.directory import data_names
from pam_actuation.bags.load_joint import joints_of
from pam_actuation.bags.rig_topics import namespaces
from pam_actuation.bags.source import Bag, read_bag
from pam_actuation.bags.unpack import SUFFIX
from pam_sim.errors import did_you_mean, InputError
from pam_sim.files import StrPath
from pam_sim.joint.parameters import SIDES

COLUMNS = ('path', 'rig', 'day', 'namespace', 'model')
BAG_FILES = ('.mcap', '.db3')
RESULT = 'case.json'            # in the folder of each case that a campaign keeps
ONE_RIG = 'rig'                 # where neither folder nor list names one
# 2026-11-25, 20261125, and with a time behind it: 2026-11-25T0930, 20261125_093000.
DAY = re.compile(
    r'(?<!\d)(\d{4})-?(\d\d)-?(\d\d)(?:[T _-](\d\d)[:-]?(\d\d)(?:[:-]?(\d\d))?)?(?!\d)')
EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)


@dataclass(frozen=True)
class Case:
    """
    One muscle, or one joint, of one recording.

    Parameters
    ----------
    path : str
        The bag, absolute.
    rig : str
        On which rig it was recorded, with the muscle or joint where the bag has several.
    day : str
        ``2026-11-25`` or ``2026-11-25T09:30``; the running number where no date is known.
    time : float
        The same in days, since 1970 or as the running number.
    namespace : str or None
        Of the muscle or joint; None where the bag has one only.
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


def find_cases(source: StrPath, without: StrPath | None = None,
               joints: bool = False) -> list[Case]:
    """
    Return the cases of a campaign by rig and time.

    Parameters
    ----------
    source : path
        A folder, with all bags below it; or a list: a text file with a path a line, or a CSV
        file with the columns ``path``, and if wanted ``rig``, ``day``, ``namespace``, ``model``.
        A path of a list may be a folder as well: its row stands for all bags below it that have
        the namespace.
        Where several rows give a recording, the one that names it most closely counts: the
        recording itself before its folder, then a namespace before none.
    without : path, optional
        A folder that is left out, that of the results.
    joints : bool
        Whether a joint is one case, rather than each of its muscles.

    Returns
    -------
    list of Case
        A recording that cannot be read is a case as well.

    Raises
    ------
    InputError
        Nothing there, no recording in it, or a mistake in the list, with its line: a recording
        that two rows name alike, for instance.

    """
    root = Path(source)
    if root.is_dir():
        folder, listed = root.resolve(), [(str(root), {'path': '.'})]
    elif root.is_file():
        folder, listed = root.resolve().parent, _listed(root)
    else:
        raise InputError('no such folder or list of recordings', root)
    cases = _each_once([_given(place, row, folder, case) for place, row in listed
                        for case in _cases_of(row, folder, without, joints)])
    return sorted(_dated(cases), key=lambda case: (case.rig, case.time, *_in_order(case)))


class _Given(NamedTuple):
    """A case, where the row stands that gives it, and how closely that row names it."""

    case: Case
    place: str
    closely: tuple[bool, int, int]


def _given(place: str, row: dict[str, str], folder: Path, case: Case) -> _Given:
    """Return a case of a row; the path tells more than the namespace how closely it is named."""
    path = folder / row['path']
    itself = os.path.realpath(path) == os.path.realpath(case.path)
    depth = 0 if itself else len(Path(os.path.abspath(path)).parts)
    names = [part for part in row.get('namespace', '').split('/') if part]
    return _Given(case, place, (itself, depth, len(names)))


def _each_once(given: Sequence[_Given]) -> list[Case]:
    """
    Return each case once: that of the row which names it most closely.

    Raises
    ------
    InputError
        Two rows name a case equally closely.

    """
    found: dict[str, list[_Given]] = {}
    for one in sorted(given, key=lambda one: one.closely, reverse=True):
        kept, case = found.setdefault(os.path.realpath(one.case.path), []), one.case
        # Without a namespace it is the only muscle of its bag.
        same = next((other for other in kept if None in (
            case.namespace, other.case.namespace) or case.namespace == other.case.namespace), None)
        if same is None:
            kept.append(one)
        elif same.closely == one.closely:
            muscle = f'{case.namespace} in ' if case.namespace else ''
            raise InputError(f'names {muscle}{case.path}, which {same.place} names already',
                             one.place)
    return [one.case for kept in found.values() for one in kept]


def _bags_below(folder: Path, without: StrPath | None) -> Iterator[Path]:
    """
    Give the bags below a folder, by name, also behind links that lead out of it; each once.

    What a campaign wrote for a case is no bag.
    """
    left_out = os.path.realpath(without) if without is not None else None
    passed: set[Path] = set()
    for place, names, files in os.walk(folder, followlinks=True):
        here, real = Path(place), Path(place).resolve()
        is_result = RESULT in files and 'metadata.yaml' not in files
        if is_result or real in passed or here.is_symlink() and real.is_relative_to(folder):
            names[:] = []
            continue
        passed.add(real)
        names[:] = sorted(name for name in names if not name.startswith('.')
                          and os.path.realpath(here / name) != left_out)
        bags = _bag_files(files)
        if 'metadata.yaml' in files or _is_split(real.name, bags):
            names[:] = []
            yield here
        else:
            yield from (here / name for name in bags)


def _bag_files(names: Sequence[str]) -> list[str]:
    """Return those of the names of files that are recordings by their ending."""
    return data_names((name for name in names if not name.startswith('.')), BAG_FILES)


def _is_split(name: str, files: Sequence[str]) -> bool:
    """Tell whether these are NAME_0, NAME_1, ... as in a bag whose metadata.yaml is missing."""
    plain = {file.removesuffix(SUFFIX) for file in files}
    return bool(files) and any(
        {f'{name}_{number}{ending}' for number in range(len(files))} == plain
        for ending in BAG_FILES)


def _listed(path: Path) -> list[tuple[str, dict[str, str]]]:
    """Return the rows of a list, each with where it stands."""
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
        return [(f'{path}:{number}', {'path': line.strip()}) for number, line in kept]
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
        if not row['path']:
            raise InputError('path is empty', f'{path}:{number}')
        if row.get('day') and _date(row['day'], strictly=True) is None:
            raise InputError(f'day is {row["day"]!r}; write it as 2026-11-25 or '
                             '2026-11-25T09:30', f'{path}:{number}')
        rows.append((f'{path}:{number}', row))
    if not rows:
        raise InputError('lists no recording', path)
    return rows


def _cases_of(row: dict[str, str], folder: Path, without: StrPath | None,
              joints: bool) -> list[Case]:
    """Return the cases of one row, of a recording or of a folder of recordings."""
    path = folder / row['path']
    wanted = row.get('namespace', '').strip('/')
    if not path.is_dir() or row['path'] != '.' and _is_bag(path):
        bag = _read(path)
        parts = _parts(bag, joints, wanted)
        if wanted and not parts:        # told again, as the result of the case
            parts = [f'/{wanted}']
        return _cases_of_bag(row, folder, path, bag, parts)
    paths = list(_bags_below(path.resolve(), without))
    if not paths:
        raise InputError('no bag in this folder or below it', path)
    cases: list[Case] = []
    for one in paths:
        bag = _read(one)
        parts = _parts(bag, joints, wanted)
        if parts or not wanted:
            cases += _cases_of_bag(row, folder, one, bag, parts)
    if not cases:
        raise InputError(f'no bag in this folder has the namespace /{wanted}', path)
    return cases


def _is_bag(folder: Path) -> bool:
    """Tell whether a folder is one recording; lone files in it are recordings of their own."""
    names = [one.name for one in folder.iterdir()]
    return 'metadata.yaml' in names or _is_split(folder.resolve().name, _bag_files(names))


def _read(path: Path) -> Bag | None:
    """Return which topics a bag has; None where it cannot be read, which its case tells."""
    try:
        return read_bag(path, wanted=lambda *of: False)
    except InputError:
        return None


def _cases_of_bag(row: dict[str, str], folder: Path, path: Path, bag: Bag | None,
                  parts: list[str]) -> list[Case]:
    """Return the cases of one recording; without a date they have the time of its stamps."""
    inside = os.path.relpath(path.absolute(), folder)
    inside = path.resolve().name if inside == '.' else inside
    day = _date(row.get('day') or '') or _date(inside)
    if day is None:
        stamps = [] if bag is None else [
            int(topic.log_time_ns[0]) for topic in bag.topics.values() if len(topic.log_time_ns)]
        day = EPOCH + timedelta(microseconds=min(stamps, default=0) // 1000)
    rig = row.get('rig') or _rig_of(inside)
    model = row.get('model', '')
    if model and (folder / model).is_file():
        model = str(folder / model)
    time = (day - EPOCH) / timedelta(days=1)
    case = Case(str(path.absolute()), rig, _text(day), time, model=model)
    return [replace(case, namespace=part, rig=f'{rig}{part}') for part in parts] or [case]


def _parts(bag: Bag | None, joints: bool, wanted: str) -> list[str]:
    """
    Return the namespaces of the muscles or joints of a bag that are cases by themselves.

    They are those in the namespace ``wanted``; where none is, all if there are several, else none.
    """
    present = namespaces(bag) if bag is not None else {}
    found: list[str] = []
    for needed in ({'pressure', 'contraction'}, {'pressure'}, {'contraction'}):
        found = found or sorted(name for name, topics in present.items() if needed <= topics)
    parts = found
    if joints and bag is not None:
        whole = {f'{joint}/{side}': joint for joint in joints_of(bag) for side in SIDES}
        parts = list(dict.fromkeys(whole.get(name, name) for name in found))
    if wanted:
        return [one for one in parts if f'{one}/'.startswith(f'/{wanted}/')] or [
            one for one in found if one == f'/{wanted}']
    return parts if len(parts) > 1 else []


def _rig_of(inside: str) -> str:
    """Return the rig that the folders above a recording name."""
    folders = [part for part in Path(inside).parent.parts if part not in ('.', '..', os.sep)]
    named = [DAY.sub(lambda found: '' if _date(found[0]) else found[0], part).strip(' _-')
             for part in folders]
    return '/'.join(part for part in named if part) or ONE_RIG


def _date(text: str, strictly: bool = False) -> datetime | None:
    """Return the last date in a text, None without one; what is no time may be a number."""
    for found in reversed(list(DAY.finditer(text))):
        year, month, day, *given = (int(part or 0) for part in found.groups())
        for hour, minute, second in [given] if strictly else [given, [0, 0, 0]]:
            with contextlib.suppress(ValueError):
                return datetime(year, month, day, hour, minute, second, tzinfo=timezone.utc)
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
                       enumerate(sorted(several, key=_in_order), 1)]
        dated += several
    return dated


def _in_order(case: Case) -> tuple[list[str | int], str]:
    """Return what sorts paths as a person does: check_2 before check_10."""
    parts = re.split(r'(\d+)', case.path)
    return [int(part) if k % 2 else part for k, part in enumerate(parts)], case.path
