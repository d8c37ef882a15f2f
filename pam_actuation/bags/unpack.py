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

"""What rosbag2 compressed with zstd, whole files or message by message, as it was before."""

from collections.abc import Iterator
import contextlib
from pathlib import Path
import tempfile

from pam_actuation.bags.payloads import Payloads
from pam_sim.errors import InputError
import zstandard

# No other file or message of a bag begins with these bytes: CDR begins with a zero.
ZSTD_MAGIC = b'\x28\xb5\x2f\xfd'
SUFFIX = '.zstd'


@contextlib.contextmanager
def unpacked_file(file: Path) -> Iterator[Path]:
    """
    Give the path of a data file as its storage wrote it: itself, or a temporary copy.

    Raises
    ------
    InputError
        The file is compressed and damaged.

    """
    with open(file, 'rb') as packed:
        if packed.read(len(ZSTD_MAGIC)) != ZSTD_MAGIC:
            yield file
            return
        with tempfile.TemporaryDirectory() as folder:
            plain = Path(folder) / file.name.removesuffix(SUFFIX)
            packed.seek(0)
            try:
                with open(plain, 'wb') as stream:
                    zstandard.ZstdDecompressor().copy_stream(packed, stream)
            except zstandard.ZstdError as error:
                raise InputError(f'the compressed file is damaged ({error}); give another bag',
                                 file) from None
            yield plain


def unpacked_messages(messages: Payloads) -> Payloads:
    """Return messages as they were published; those that cannot be unpacked are empty."""
    if not any(rows[0, :4].tobytes() == ZSTD_MAGIC for _, rows in messages.tables()):
        return messages
    return Payloads([_unpacked(raw) for raw in messages])


def _unpacked(raw: bytes) -> bytes:
    try:
        return zstandard.ZstdDecompressor().decompressobj().decompress(raw)
    except zstandard.ZstdError:
        return b''
