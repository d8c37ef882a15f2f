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

"""Read one sqlite3 file of a bag, through the ``rosbags`` package."""

from pathlib import Path

from pam_actuation.bags.mcap_scan import Channel, McapContent, Wanted
from pam_actuation.bags.message_batch import MessageColumns
from pam_sim.errors import InputError
from pam_sim.files import StrPath

_LONGEST_REASON = 300


def scan_database(file: Path, wanted: Wanted | None, path: StrPath) -> McapContent:
    """
    Return what a file holds, in the form of ``mcap_scan.scan``.

    Parameters
    ----------
    file : pathlib.Path
        The database.
    wanted : callable, optional
        As of ``mcap_scan.scan``.
    path : path
        What a message names.

    Raises
    ------
    InputError
        Not a database of rosbag2, or damaged.

    """
    from rosbags.rosbag2 import Reader
    from rosbags.rosbag2.errors import ReaderError
    content = McapContent()
    found: dict[int, tuple[list[bytes], list[int]]] = {}
    try:
        with Reader(file) as reader:
            channels = content.channels
            for one in reader.connections:
                encoding = getattr(one.ext, 'serialization_format', 'cdr')
                kept = wanted is None or wanted(one.topic, one.msgtype, encoding)
                channels[one.id] = Channel(
                    one.topic, one.msgtype, encoding, '', '', {}, MessageColumns(kept))
                if kept:
                    found[one.id] = [], []
                else:
                    channels[one.id].messages.payloads.skip(one.msgcount)
            # Without a connection the library would read them all.
            kept_ones = [one for one in reader.connections if one.id in found]
            for one, time_ns, raw in reader.messages(kept_ones) if found else ():
                found[one.id][0].append(raw)
                found[one.id][1].append(time_ns)
            for key, columns in found.items():
                channels[key].messages.append_raw(*columns)
    except (ReaderError, FileNotFoundError) as error:
        raise InputError(f'not a readable rosbag2 bag: {_short(error)}', path) from None
    # The database library has its own family of exceptions, all meaning a broken file.
    except Exception as error:
        raise InputError(
            f'not a readable rosbag2 bag ({type(error).__name__}: {_short(error)})',
            path) from None
    return content


def _short(error: object) -> str:
    """Return the text of a library's error as part of one sentence."""
    text = ' '.join(str(error).split())
    return text if len(text) < _LONGEST_REASON else f'{text[:_LONGEST_REASON]} …'
