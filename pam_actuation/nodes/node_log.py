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
The log of a node: to ROS as ever, and to the terminal without ever waiting for it.

The log of ROS writes to the terminal itself and waits for one that is held (Ctrl-S), with the
lock of the interpreter: every thread of the node waits as well. So the executables let it write
to ``/rosout`` and the log file alone, and a ``Console`` writes to the terminal.
"""

from collections.abc import Sequence
from functools import cached_property
import time
from typing import Any

from pam_actuation.nodes.console import Console
from rclpy.lifecycle import LifecycleNode
from rclpy.logging import LoggingSeverity

OFF = '--disable-stdout-logs'
SAID_BY_USER = (OFF, '--enable-stdout-logs')


def with_own_terminal(args: Sequence[str]) -> tuple[list[str], bool]:
    """
    Return the arguments for ROS, and whether a ``Console`` writes the log to the terminal.

    It does not where the user says what the log of ROS is to do there.
    """
    if any(one in SAID_BY_USER for one in args):
        return list(args), False
    return [*args[:1], '--ros-args', OFF, '--', *args[1:]], True


class NodeLog:
    """
    What ``get_logger`` of a node gives: the logger of rclpy, whose lines a console writes.

    Parameters
    ----------
    logger : rclpy logger
        Of the node.
    console : Console
        Of the node.

    """

    def __init__(self, logger: Any, console: Console) -> None:
        self._logger, self._console = logger, console

    def __getattr__(self, name: str) -> Any:
        """Return what else a logger of rclpy has."""
        return getattr(self._logger, name)

    def _say(self, severity: LoggingSeverity, text: str) -> None:
        if self._logger.is_enabled_for(severity):
            self._console.say(severity.name, time.time_ns(), text)

    # One line each: rclpy remembers of each place in a program with which severity it logs.

    def debug(self, text: str) -> Any:
        """Log with severity DEBUG."""
        self._say(LoggingSeverity.DEBUG, text)
        return self._logger.debug(text)

    def info(self, text: str) -> Any:
        """Log with severity INFO."""
        self._say(LoggingSeverity.INFO, text)
        return self._logger.info(text)

    def warning(self, text: str) -> Any:
        """Log with severity WARN."""
        self._say(LoggingSeverity.WARN, text)
        return self._logger.warning(text)

    warn = warning

    def error(self, text: str) -> Any:
        """Log with severity ERROR."""
        self._say(LoggingSeverity.ERROR, text)
        return self._logger.error(text)

    def fatal(self, text: str) -> Any:
        """Log with severity FATAL."""
        self._say(LoggingSeverity.FATAL, text)
        return self._logger.fatal(text)


class LoggedNode(LifecycleNode):
    """
    A node with a console.

    ``log_on_console`` is set by an executable whose log of ROS leaves the terminal out.
    """

    log_on_console = False

    @cached_property
    def console(self) -> Console:
        """Return what writes to the terminal without waiting for it."""
        return Console(self.get_fully_qualified_name())

    def get_logger(self) -> Any:
        """Return the logger of the node."""
        logger = super().get_logger()       # type: ignore[no-untyped-call]  # as all of rclpy
        return NodeLog(logger, self.console) if self.log_on_console else logger
