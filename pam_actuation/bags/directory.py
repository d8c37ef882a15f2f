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

"""What the directory of a bag says: its metadata.yaml, and the order of its files."""

from collections.abc import Iterable, Mapping
import contextlib
from pathlib import Path
from typing import Any

from pam_actuation.bags import layout
from pam_actuation.bags.unpack import SUFFIX
from pam_actuation.bags.writer import EXPERIMENT_RECORD
from pam_sim.errors import InputError


def directory_facts(path: Path) -> dict[str, Any] | None:
    """Return what metadata.yaml says, None where there is no such file."""
    file = path / layout.METADATA_FILE
    if not file.is_file():
        return None
    try:
        facts = layout.read_metadata(path)
        names = facts['relative_file_paths']
        if isinstance(names, list) and names and all(map(_is_file_name, names)):
            return facts
        problem = 'relative_file_paths is not a list of file names'
    except (KeyError, TypeError):
        problem = f'it has no {layout.METADATA_ROOT} with relative_file_paths'
    except ValueError:
        problem = 'it is not YAML'
    raise InputError(
        f'not the metadata of a rosbag2 bag: {problem}; remove the file to read the data files '
        'without it', file)


def _is_file_name(name: object) -> bool:
    return isinstance(name, str) and 0 < len(name) < 4096 and name.isprintable()


def listed_files(path: Path, facts: Mapping[str, Any]) -> list[Path]:
    """Return the data files that metadata.yaml lists; InputError where one is missing."""
    files = []
    for name in facts['relative_file_paths']:
        # Version 3 and older repeat the directory's name in front of the file's.
        candidates = [path / name, path / Path(name).name]
        found = [candidate for candidate in candidates if candidate.is_file()]
        if not found:
            raise InputError(
                f'the file {name} named in {layout.METADATA_FILE} is missing; copy it here, or '
                f'remove {layout.METADATA_FILE} to read the files that are here', path)
        files.append(found[0])
    return files


def data_files(path: Path, ending: str) -> list[Path]:
    """
    Return the files of one storage in a folder by number, also those that rosbag2 compressed.

    Parameters
    ----------
    path : pathlib.Path
        The folder.
    ending : str
        Of the plain files, such as ``.mcap``.

    """
    names = data_names((file.name for file in path.glob('*') if file.is_file()), ending)
    return sorted((path / name for name in names), key=by_number)


def data_names(names: Iterable[str], endings: str | tuple[str, ...]) -> list[str]:
    """
    Return those of the names of files that are data files of a bag, sorted by name.

    Of a file that is there in both forms this is the plain one: a recorder that is killed while
    it compresses leaves both.

    Parameters
    ----------
    names : iterable of str
        Of files in one folder.
    endings : str or tuple of str
        Of the plain files, such as ``.mcap``.

    """
    found = {name for name in names if name.removesuffix(SUFFIX).endswith(endings)}
    return sorted(name for name in found
                  if not name.endswith(SUFFIX) or name.removesuffix(SUFFIX) not in found)


def plain_ending(path: Path) -> str:
    """Return the ending of a data file, ``.mcap`` also of ``run_0.mcap.zstd``."""
    return Path(path.name.removesuffix(SUFFIX)).suffix


def by_number(path: Path) -> tuple[int, str]:
    """Return a sort key: run_2 before run_10."""
    digits = Path(path.name.removesuffix(SUFFIX)).stem.rsplit('_', 1)[-1]
    return (int(digits) if digits.isdigit() else -1, path.name)


def announced_counts(facts: Mapping[str, Any]) -> list[tuple[str, int]]:
    """Return (topic, number of messages) as metadata.yaml lists them; [] where it does not."""
    with contextlib.suppress(KeyError, TypeError):
        return [(str(row['topic_metadata']['name']), int(row['message_count']))
                for row in facts['topics_with_message_count']]
    return []


def custom_data(facts: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    """Return the record of the experiment that metadata.yaml keeps, by its name."""
    custom = facts.get('custom_data')
    texts = {} if not isinstance(custom, dict) else {
        key: value for key, value in custom.items()
        if isinstance(key, str) and isinstance(value, str)}
    return {EXPERIMENT_RECORD: texts} if texts else {}
