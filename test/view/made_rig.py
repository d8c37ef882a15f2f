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

"""A rig that is made up: signals at 1 kHz, a driver that answers, and what a page sees of it."""

import json
import math
import threading

import numpy as np
from pam_actuation import messages
from pam_actuation.view.store import Store
from pam_actuation.view.stream import decode
from tornado.httpclient import HTTPRequest
from tornado.websocket import websocket_connect

START_NS, STEP_NS = 1_790_000_000_000_000_000, 1_000_000
DRIVER, PLAYER = '/muscle/valve_driver', '/muscle/reference_generator'


def feed(store, begin, count, namespace='/muscle', start_ns=START_NS):
    """Put rows ``begin`` to ``begin + count`` of a sine of 0.5 Hz into a store."""
    number = np.arange(begin, begin + count)
    times_ns = start_ns + number * STEP_NS
    contraction_m = 0.010 + 0.008 * np.sin(math.pi * 1e-3 * number)
    store.add(namespace, 'reference', times_ns[::10], {'contraction_m': contraction_m[::10]}, 0)
    store.add(namespace, 'contraction', times_ns, {
        'contraction_m': contraction_m - 0.001, 'velocity_m_per_s': 0.0 * contraction_m}, 0)
    store.add(namespace, 'pressure_command', times_ns, {'pressure_pa': 401_325.0 + number}, 0)
    store.add(namespace, 'pressure', times_ns, {'pressure_pa': 301_325.0 + 0.0 * number}, 3)
    store.add(namespace, 'valve_signal', times_ns, {'ppr_voltage': 3.0 + 1e-4 * number}, 0)
    store.add(namespace, 'force', times_ns, {'force_n': 49.0 + 0.0 * number}, 0)
    store.add_statuses([messages.Status(
        int(times_ns[-1]), 0, f'{namespace}/valve_driver', 'following the pressure command',
        (('loop.period_mean_ms', '5.0'), ('loop.missed', '0')))])


def feed_rules(store, begin, count, namespace='/muscle', gain=2.0, start_ns=START_NS):
    """Put ticks of a controller into a store: feedback is ``gain`` [MPa/m] times the error."""
    number = np.arange(begin, begin + count)
    error_m = 0.002 * np.sin(0.01 * number)
    store.add(namespace, 'controller_state', start_ns + number * STEP_NS, {
        'error_m': error_m, 'change_of_error_m_per_s': 0.02 * np.cos(0.01 * number),
        'feedback_rules_pa': gain * 1e6 * error_m, 'feedforward_rules_pa': 0.0 * error_m}, 0)


class MadeRig:
    """A source of pages; ``stopped`` tells what its driver was asked for."""

    live, title, remarks = True, 'made rig', ()

    def __init__(self, rows=4000):
        self.store = Store()
        self.asked = []
        self.silent = False
        self.more_drivers = []
        self._rows = rows
        feed(self.store, 0, rows)

    def drivers(self):
        return [DRIVER, *self.more_drivers]

    def players(self):
        return [PLAYER]

    def experiments(self):
        return ['short_sine', 'staircase']

    def act(self, request, answer):
        self.asked.append(request.do)
        ok = not self.silent
        if request.do == 'mark':
            self.store.add_markers('/muscle', [
                messages.Marker(self.store.now_ns(), request.text)])
            answer([{'node': '/muscle', 'ok': True, 'message': 'recorded'}])
            return
        if request.do in ('play', 'halt'):
            answer([{'node': PLAYER, 'ok': ok, 'message': f'plays {request.experiment}'}])
            return
        answer([{'node': DRIVER, 'ok': ok, 'message': 'vents' if ok else 'no answer'}])

    def go_on(self, rows=20):
        """Let time pass."""
        feed(self.store, self._rows, rows)
        self._rows += rows


class Running:
    """Let time pass for a rig in a thread, 20 ms at a time; a context manager."""

    def __init__(self, rig):
        self._rig, self._end = rig, threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._end.set()
        self._thread.join()

    def _run(self):
        while not self._end.wait(0.02):
            self._rig.go_on()


class Page:
    """What the script of the page does with the messages, in Python."""

    def __init__(self):
        self.layout, self.columns = None, []

    def take(self, message):
        """Take one message as it came; return its content or header."""
        if isinstance(message, str):
            content = json.loads(message)
            if content['type'] == 'layout':
                self.layout = content
                count = sum(len(plot['lines']) for plot in content['plots'])
                self.columns = [{} for _ in range(count)]
            return content
        header, parts = decode(message)
        if self.layout is not None and header['layout'] == self.layout['layout']:
            for known, (numbers, first, second) in zip(self.columns, parts):
                if header['kind'] == 'all':
                    known.clear()
                known.update(zip(numbers.tolist(), zip(first.tolist(), second.tolist())))
        return header

    def index(self, plot, label):
        """Return the number of a line."""
        found = next(one for one in self.layout['plots'] if one['key'] == plot)
        return next(line['index'] for line in found['lines'] if line['label'] == label)


async def connect(server, **headers):
    """Return an open connection as a page has it."""
    origin = {'Origin': f'http://localhost:{server.port}', **headers}
    return await websocket_connect(HTTPRequest(
        f'ws://localhost:{server.port}/socket', headers=origin))
