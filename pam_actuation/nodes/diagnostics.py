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
The health of a node on ``/diagnostics``.

One status per node: its name is the full node name, its message the reason for its level. It is
sent at a steady rate, and at once when level or message change. Such a change is also printed on
the terminal if something is wrong or no longer wrong. The values hold how many messages each
publisher of the node has sent (``published.<topic>``), by which a recording proves that it is
complete.
"""

from collections.abc import Callable
import re
from typing import Any, TYPE_CHECKING

from pam_actuation.messages import (
    HARDWARE_ID, LEVEL_ERROR, LEVEL_OK, LEVEL_STALE, LEVEL_WARN, Status)
from pam_actuation.nodes.endpoints import CountedPublisher
from pam_actuation.nodes.ros_messages import class_of
from pam_actuation.topics.codec import encode
from pam_actuation.topics.table import DIAGNOSTICS

if TYPE_CHECKING:
    from pam_actuation.nodes.managed import ManagedNode

Values = tuple[tuple[str, Any], ...]       # of a status: keys, and what becomes a text
OK, WARN, ERROR, STALE = LEVEL_OK, LEVEL_WARN, LEVEL_ERROR, LEVEL_STALE
WORDS = {OK: 'INFO', WARN: 'WARN', ERROR: 'ERROR', STALE: 'WARN'}     # of the logger of ROS
DIGITS = re.compile('[0-9]+')
SHORTEST_INTERVAL_NS = 20_000_000    # a message that changes with every tick is not a flood


class DiagnosticsReporter:
    """
    Publish the status of one node.

    Parameters
    ----------
    node : ManagedNode
        Gives full name, clock, ``publishers`` and ``diagnostic_values()``.

    """

    def __init__(self, node: 'ManagedNode') -> None:
        self._node = node
        self.publisher = CountedPublisher(node, class_of(DIAGNOSTICS), DIAGNOSTICS)
        self.level = OK
        self.message = 'starting'
        self.values_of: Callable[[], Values] = tuple
        self.remark = ''            # what is wrong besides, such as another node of the same name
        self.silent = True
        self._said = OK, ''
        self._sent: tuple[int, str] | None = None
        self._sent_ns = 0

    def update(self, level: int, message: str,
               values_of: Callable[[], Values] = tuple) -> None:
        """
        Set the state; send it at once when level or message changed.

        ``values_of`` is asked for the values only when a status is sent: they are many texts,
        and most ticks send none.
        """
        self.level, self.message, self.values_of = level, message, values_of
        if (level, message) != self._sent:
            now_ns = self._node.now_ns()
            worse = self._sent is None or level != self._sent[0]
            if worse or now_ns - self._sent_ns >= SHORTEST_INTERVAL_NS:
                self.send()

    def send(self) -> None:
        """Send the state now, unless the node is to keep silent."""
        if self.silent:
            return
        now_ns = self._node.now_ns()
        self._sent, self._sent_ns = (self.level, self.message), now_ns
        level, message = self.level, self.message
        if self.remark:
            level, message = max(level, WARN), f'{message}; {self.remark}'
        self.publisher.publish(encode(DIAGNOSTICS, Status(
            now_ns, level, self._node.get_fully_qualified_name(), message,
            (*self._values(), *self._counts()), HARDWARE_ID)))
        self._say(now_ns, level, message)

    def end(self, level: int, message: str, values: Values) -> None:
        """Send the last status of all, and before it one that was held back."""
        if (self.level, self.message) != self._sent:
            self.send()
        self.level, self.message, self.values_of = level, message, lambda: values
        self.send()

    def _say(self, now_ns: int, level: int, message: str) -> None:
        """Tell the terminal what is wrong, or no longer wrong; not each number that changes."""
        said, self._said = self._said, (level, DIGITS.sub('', message))
        node = self._node
        if node.stopping or node.exit_code is not None or node.input_error is not None:
            return              # the node logs itself why it ends; that is to be its last line
        if self._said != said and (level != OK or said[0] != OK):
            node.console.say(WORDS[level], now_ns, message)

    def _values(self) -> Values:
        """Return the values of the node; of one that failed, () where they fail as well."""
        try:
            return (*self.values_of(), *self._node.diagnostic_values())
        except Exception:
            if self._node.exit_code is None:
                raise
            return ()

    def _counts(self) -> Values:
        """Return the counts of all publishers; the status being sent counts itself."""
        counts = [(f'published.{one.topic}', one.count) for one in self._node.publishers_counted]
        return (*counts, (f'published.{self.publisher.topic}', self.publisher.count + 1))
