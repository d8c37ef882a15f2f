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

"""Files that are there whole or not at all."""

import os
import tempfile

from pam_sim.errors import InputError


def write_atomically(path, text):
    """
    Write text to a file: temporary file beside it, flushed to disk, renamed over.

    Raises
    ------
    InputError
        The folder is missing or the file cannot be written.

    """
    path = os.path.abspath(os.fspath(path))
    temporary = None
    try:
        handle, temporary = tempfile.mkstemp(prefix='.unfinished-', dir=os.path.dirname(path))
        with os.fdopen(handle, 'w', encoding='utf-8') as stream:
            stream.write(text)
            stream.flush()
            os.fsync(stream.fileno())
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
        temporary = None
    except OSError as error:
        raise InputError(f'cannot be written: {error.strerror}', path) from None
    finally:
        if temporary is not None and os.path.exists(temporary):
            os.unlink(temporary)
