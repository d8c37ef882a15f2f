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

"""The last results of something slow, by what they were made from."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
import threading
from typing import Generic, TypeVar

Made = TypeVar('Made')


class Recent(Generic[Made]):
    """
    The last results, which several threads may ask for at once.

    Parameters
    ----------
    most : int
        How many are kept.

    """

    def __init__(self, most: int) -> None:
        self._most, self._lock = most, threading.Lock()
        self._kept: OrderedDict[Hashable, tuple[Made, object]] = OrderedDict()

    def get(self, key: Hashable, make: Callable[[], Made], held: object = None) -> Made:
        """
        Return what is kept under a key, or what ``make`` returns, kept from now on.

        ``held`` is kept with it: an object whose id is a part of the key must not be replaced
        by another one of the same id meanwhile. Threads that ask for the same at once both make
        it.
        """
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key][0]
        made = make()
        with self._lock:
            self._kept[key] = made, held
            while len(self._kept) > self._most:
                self._kept.popitem(last=False)
        return made

    def clear(self) -> None:
        """Keep nothing of what was made so far."""
        with self._lock:
            self._kept.clear()
