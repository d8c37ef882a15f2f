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
One open page, as the server sees it.

A page that reads slowly gets fewer pictures; it never makes anything wait. Only so much is on its
way to it. What comes meanwhile is left out, and replaced by a whole picture later.
"""

import asyncio
import json
import socket
import time
from typing import Any, Final, TYPE_CHECKING

from pam_actuation.view.requests import parse, Request
from pam_sim.errors import InputError
from tornado.websocket import WebSocketClosedError, WebSocketHandler

if TYPE_CHECKING:
    from pam_actuation.view.server import ViewServer

PATIENCE_S: Final = 10.0        # with a page that reads nothing
MOST_ANSWERS: Final = 50        # waiting for one page
MOST_BYTES: Final = 32_768      # on their way while more is sent
SOCKET_BYTES: Final = 131_072   # kept for a page by the system


class ViewClient(WebSocketHandler):
    """The connection of one page."""

    server: 'ViewServer'

    def initialize(self, server: 'ViewServer') -> None:
        """Take the server it belongs to."""
        self.server = server
        self.request_now = Request('watch')
        self.stream_key: tuple[str, float] | None = None
        self.layout_sent: tuple[object, int] | None = None
        self.skipped = 0                        # pictures
        self.is_behind = True
        self._answers = 0
        self._on_its_way = 0                    # bytes
        self._progress_s = 0.0                  # steady time of the last that arrived

    def prepare(self) -> None:
        """Refuse whoever may not see the page."""
        self.server.check_access(self)

    def open(self, *_: str, **__: str) -> None:     # noqa: A003, named by tornado
        """Say hello."""
        self.set_nodelay(True)
        stream = getattr(self.ws_connection, 'stream', None)
        if stream is not None:
            stream.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SOCKET_BYTES)
        self.server.joined(self)

    def on_message(self, message: str | bytes) -> None:
        """Do what the page asks for; say what was wrong with a request."""
        try:
            request = parse(message)
        except InputError as error:
            self.tell({'type': 'error', 'message': str(error)})
            return
        self.server.asked(self, request)

    def on_close(self) -> None:
        """Forget the page."""
        self.server.left(self)

    @property
    def is_busy(self) -> bool:
        """Tell whether much is still on its way; closes a page that reads nothing."""
        if self._on_its_way <= MOST_BYTES:
            return False
        if time.monotonic() - self._progress_s > PATIENCE_S:
            self.close(1008, 'this page reads nothing')
        return True

    def offer(self, picture: bytes) -> None:
        """Send a picture if the page has room for it, else note that it lacks one."""
        if self.is_busy:
            self.skipped += 1
            self.is_behind = True
            return
        self._send(picture, True)

    def offer_text(self, text: str) -> None:
        """Send a text if the page has room for it; another will follow."""
        if not self.is_busy:
            self._send(text, False)

    def tell(self, content: dict[str, Any] | bytes) -> None:
        """Send a text, or a picture that was asked for, which must arrive."""
        if self.is_busy:
            self._answers += 1
            if self._answers > MOST_ANSWERS:
                self.close(1008, 'this page reads nothing')
                return
        else:
            self._answers = 0
        if isinstance(content, bytes):
            self._send(content, True)
        else:
            self._send(json.dumps(content), False)

    def _send(self, message: str | bytes, binary: bool) -> None:
        try:
            sent = asyncio.ensure_future(self.write_message(message, binary))
        except WebSocketClosedError:
            return
        size = len(message)
        if not self._on_its_way:
            self._progress_s = time.monotonic()
        self._on_its_way += size

        def arrived(done: 'asyncio.Future[None]') -> None:
            self._on_its_way -= size
            self._progress_s = time.monotonic()
            if not done.cancelled():
                done.exception()        # a page that went away meanwhile

        sent.add_done_callback(arrived)
