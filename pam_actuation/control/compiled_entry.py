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
Key for compiled code on disk that depends on several source files.

numba stores the compiled form of a function next to its own file and looks only
at that file's age. A step function is built from several modules, so its entry
point takes the number returned here as a constant: a changed source, another
number, compiled anew.
"""

import hashlib
from pathlib import Path

_FOLDER = Path(__file__).parent


def source_key(*names):
    """Return a number made of the text of files, given relative to this folder."""
    digest = hashlib.sha256()
    for name in names:
        digest.update(name.encode())
        digest.update((_FOLDER / name).read_bytes())
    return int(digest.hexdigest()[:12], 16)
