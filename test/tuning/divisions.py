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

"""A task that ends its process. Others import this file alone, not that of the tests."""

import os
import signal


def divided(folder, item):
    """Return 10 / item; 3 ends its process the first time, 5 always."""
    mark = folder / str(item)
    if item == 5 or item == 3 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return 10 / item


def own_pid(folder, item):
    """Return the id of the process that does this task."""
    return os.getpid()
