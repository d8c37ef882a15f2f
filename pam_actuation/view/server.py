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

"""The web server behind the page; it runs in a thread of its own."""

import asyncio
import contextlib
import json
import logging
from pathlib import Path
import threading
from typing import Any, Final

from pam_actuation.view.access import Access
from pam_actuation.view.client import ViewClient
from pam_actuation.view.requests import LONGEST, Request, WATCH
from pam_actuation.view.source import Source
from pam_actuation.view.stream import Stream, WINDOWS_S
from pam_actuation.view.surfaces import surfaces
from pam_sim.errors import InputError
from tornado.httpserver import HTTPServer
from tornado.ioloop import PeriodicCallback
from tornado.netutil import bind_sockets
from tornado.web import Application, HTTPError, RequestHandler, StaticFileHandler

PAGE: Final = Path(__file__).with_name('page')
FIRST_PORT, PORTS = 8750, 20
FRAME_S, STATE_S, RULES_S = 0.05, 0.25, 1.0
CLOSE_S: Final = 0.3            # for pages that do not say goodbye
MOST_CLIENTS: Final = 40
COOKIE = 'pam_view'
HEADERS = {
    # Nothing from elsewhere, and no frame of another page about the emergency stop.
    'Content-Security-Policy': "default-src 'self'; img-src 'self' data:; "
                               "frame-ancestors 'none'",
    'X-Content-Type-Options': 'nosniff', 'Referrer-Policy': 'no-referrer',
    'Cache-Control': 'no-cache'}


class ViewServer:
    """
    Serve one source to any number of pages.

    Parameters
    ----------
    source : Source
    access : Access, optional
        Default: this machine only.
    port : int, optional
        Default: the first free one from 8750 on; 0: any.

    Attributes
    ----------
    url : str
        What to open in a browser, once started.

    """

    def __init__(self, source: Source, access: Access | None = None,
                 port: int | None = None) -> None:
        self.source = source
        self.access = access or Access()
        self._port = port
        self.port, self.url = 0, ''
        self.frames = 0                 # calculated
        self.clients: set[ViewClient] = set()
        self._streams: dict[tuple[str, float], Stream] = {}
        self._loop: asyncio.AbstractEventLoop | None = None
        self._thread: threading.Thread | None = None
        self._end: asyncio.Event | None = None

    def start(self) -> None:
        """
        Listen, and answer in a thread from now on.

        Raises
        ------
        InputError
            The address or the port cannot be used.

        """
        sockets = self._bound()
        self.port = sockets[0].getsockname()[1]
        self.url = self.access.url(self.port)
        ready = threading.Event()
        self._thread = threading.Thread(
            target=lambda: asyncio.run(self._serve(sockets, ready)), daemon=True, name='view')
        self._thread.start()
        ready.wait()

    def stop(self) -> None:
        """Close all pages and the port."""
        if self._loop is not None and self._thread is not None and self._end is not None:
            self._loop.call_soon_threadsafe(self._end.set)
            self._thread.join(5.0)

    def _bound(self) -> list[Any]:
        tried = [self._port] if self._port is not None else range(FIRST_PORT, FIRST_PORT + PORTS)
        problem: OSError | None = None
        for port in tried:
            try:
                return bind_sockets(port, self.access.host)
            except OSError as error:
                problem = error
        where = (f'port {self._port}' if self._port is not None
                 else f'ports {FIRST_PORT} to {FIRST_PORT + PORTS - 1}')
        reason = problem.strerror if problem is not None and problem.strerror else problem
        raise InputError(f'{self.access.host}, {where}: {reason}; give another --port or --host')

    async def _serve(self, sockets: list[Any], ready: threading.Event) -> None:
        logging.getLogger('tornado.access').setLevel(logging.ERROR)
        self._loop, self._end = asyncio.get_running_loop(), asyncio.Event()
        page = type('Page', (_Page,), {'server': self})
        server = HTTPServer(Application([
            (r'/socket', ViewClient, {'server': self}),
            (r'/(|page\.css|page\.js|chart\.js|surface\.js|icon\.svg)', page,
             {'path': str(PAGE), 'default_filename': 'index.html'}),
        ], default_handler_class=_Nothing, default_handler_args={'server': self},
            websocket_max_message_size=LONGEST, websocket_ping_interval=5.0,
            websocket_ping_timeout=5.0, compress_response=True),
            max_body_size=LONGEST, idle_connection_timeout=60.0)
        server.add_sockets(sockets)
        beats = [PeriodicCallback(self._send_state, STATE_S * 1e3)]
        if self.source.live:
            beats.append(PeriodicCallback(self._send_frames, FRAME_S * 1e3))
            beats.append(PeriodicCallback(self._send_rules, RULES_S * 1e3))
        for beat in beats:
            beat.start()
        ready.set()
        await self._end.wait()
        for beat in beats:
            beat.stop()
        server.stop()
        for client in list(self.clients):
            client.close(1001, 'the server ends')
        with contextlib.suppress(asyncio.TimeoutError):
            await asyncio.wait_for(server.close_all_connections(), CLOSE_S)

    def check_access(self, handler: RequestHandler) -> None:
        """Raise HTTPError for a request that may not be answered."""
        if not self.access.allows_host(handler.request.host):
            raise HTTPError(403, reason='This server answers to localhost only')
        given = handler.get_query_argument('token', None) or handler.get_cookie(self._cookie)
        if not self.access.is_right(given):
            raise HTTPError(403, reason='Open the address that pam view printed, with its token')

    @property
    def _cookie(self) -> str:
        return f'{COOKIE}_{self.port}'      # cookies do not know ports

    def keep_token(self, handler: RequestHandler) -> None:
        """Let the browser remember the token, so that it need not stand in every address."""
        given = handler.get_query_argument('token', None)
        if given and self.access.token:
            handler.set_cookie(self._cookie, given, httponly=True, samesite='Strict')

    def joined(self, client: ViewClient) -> None:
        """Greet a new page."""
        if len(self.clients) >= MOST_CLIENTS:
            client.close(1013, f'{MOST_CLIENTS} pages are open already')
            return
        self.clients.add(client)
        begin_ns, end_ns = self.source.store.span_ns()
        client.tell({'type': 'hello', 'live': self.source.live, 'title': self.source.title,
                     'windows_s': WINDOWS_S,
                     'experiments': self.source.experiments(),
                     'remarks': self.source.remarks,
                     'length_s': (end_ns - begin_ns) * 1e-9,
                     'begin_s': begin_ns * 1e-9})
        client.tell(self._state(client))

    def left(self, client: ViewClient) -> None:
        """Forget a page, and the stream that nobody else reads."""
        self.clients.discard(client)
        self._drop_unused()

    def asked(self, client: ViewClient, request: Request) -> None:
        """Do what a page asks for."""
        if request.do != WATCH:
            self._act(client, request)
            return
        client.request_now = request
        key = (request.view, request.window_s)
        if key not in self._streams:
            self._streams[key] = Stream(self.source.store, *key)
        client.stream_key, client.is_behind = key, True
        self._drop_unused()
        if not self.source.live:
            self._show(client, self._streams[key])

    def _drop_unused(self) -> None:
        used = {client.stream_key for client in self.clients}
        self._streams = {key: one for key, one in self._streams.items() if key in used}

    def _act(self, client: ViewClient, request: Request) -> None:
        def answer(results: list[dict[str, Any]]) -> None:
            assert self._loop is not None
            self._loop.call_soon_threadsafe(client.tell, {
                'type': 'answer', 'number': request.number, 'do': request.do,
                'results': results})

        self.source.act(request, answer)

    def _show(self, client: ViewClient, stream: Stream) -> None:
        """Send the part of a bag that a page asked for."""
        begin_ns, end_ns = self.source.store.span_ns()
        request = client.request_now
        at_ns = end_ns if request.end_s is None else begin_ns + round(request.end_s * 1e9)
        at_ns = min(max(at_ns, begin_ns), end_ns)
        stream.refresh()
        self._send_layout(client, stream)
        client.tell(stream.picture(at_ns))
        client.tell(self._rules(stream.view, at_ns))
        client.tell(self._state(client, at_ns))

    def _send_layout(self, client: ViewClient, stream: Stream) -> None:
        if client.layout_sent != (stream, stream.layout_number):
            client.layout_sent = stream, stream.layout_number
            client.tell(stream.layout())

    def _send_frames(self) -> None:
        """Send every page what changed, or a whole picture to one that missed something."""
        for key, stream in self._streams.items():
            readers = [one for one in self.clients if one.stream_key == key]
            if not readers:
                continue
            stream.refresh()
            changes = stream.changes()
            whole: list[bytes] = []
            self.frames += 1
            for client in readers:
                if client.is_behind and not client.is_busy:
                    self._send_layout(client, stream)
                    whole = whole or [stream.picture()]
                    client.is_behind = False
                    client.offer(whole[0])
                elif client.layout_sent != (stream, stream.layout_number):
                    client.is_behind = True
                else:
                    client.offer(changes)

    def _send_rules(self) -> None:
        """Send every page the rules of what it shows."""
        now_ns = self.source.store.now_ns()
        for view in {key[0] for key in self._streams}:
            text = json.dumps(self._rules(view, now_ns))
            for client in self.clients:
                if client.stream_key is not None and client.stream_key[0] == view:
                    client.offer_text(text)

    def _rules(self, view: str, at_ns: int | None) -> dict[str, Any]:
        return {'type': 'rules', 'surfaces': surfaces(self.source.store, view, at_ns)}

    def _send_state(self) -> None:
        if not self.clients or not self.source.live:
            return
        text = json.dumps(self._state(None))
        for client in list(self.clients):
            client.offer_text(text)

    def _state(self, client: ViewClient | None, at_ns: int | None = None) -> dict[str, Any]:
        store = self.source.store
        now_ns = store.now_ns() if at_ns is None else at_ns
        return {'type': 'state', 'now_s': None if now_ns is None else now_ns * 1e-9,
                'namespaces': store.namespaces(), 'drivers': self.source.drivers(),
                'players': self.source.players(),
                'pages': len(self.clients), **store.state(now_ns)}


class _Page(StaticFileHandler):
    """The files of the page."""

    server: ViewServer

    def prepare(self) -> None:
        self.server.check_access(self)
        self.server.keep_token(self)
        if self.get_query_argument('token', None):
            self.redirect('/')

    def set_extra_headers(self, path: str) -> None:
        for name, value in HEADERS.items():
            self.set_header(name, value)


class _Nothing(RequestHandler):
    """What is not there."""

    def initialize(self, server: ViewServer) -> None:
        self._server = server

    def prepare(self) -> None:
        self._server.check_access(self)
        raise HTTPError(404)
