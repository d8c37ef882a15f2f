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
One task in a process of its own: what it needs is unpacked once for each process.

A task travels as a function, a key, a reference to bytes, and its own item.
"""

from collections import OrderedDict
from collections.abc import Callable
import hashlib
import importlib
import os
import pickle
import threading
import time
from typing import Any

THREADS = 'PAM_THREADS'         # threads of one process, see ``pam_sim.rollout.batch``
_KEPT = 4                       # unpacked objects a process keeps
_unpacked: 'OrderedDict[str, Any]' = OrderedDict()
_lock = threading.Lock()


def packed(shared: Any) -> tuple[str, bytes]:
    """Return a key and the pickled bytes of what all tasks need."""
    blob = pickle.dumps(shared)
    return hashlib.sha256(blob).hexdigest(), blob


def call(function: Callable[[Any, Any], Any], key: str, blob: bytes, item: Any) -> Any:
    """
    Return ``function(shared, item)``; ``blob`` holds what is shared, ``key`` is its name.

    Raises
    ------
    Exception
        Whatever the function raises.

    """
    with _lock:
        if key not in _unpacked:
            _unpacked[key] = pickle.loads(blob)
            while len(_unpacked) > _KEPT:
                _unpacked.popitem(last=False)
        shared = _unpacked[key]
    return function(shared, item)


def warm_up(*modules: str, threads: int = 1) -> None:
    """Import modules ahead of the first task, and leave the other cores to other workers."""
    os.environ.setdefault(THREADS, str(threads))
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    for name in modules:
        importlib.import_module(name)


def end_with(parent: int) -> None:
    """End this process soon after its parent has ended; a task that is under way is lost."""
    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
