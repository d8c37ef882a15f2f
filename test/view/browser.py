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

"""A headless Chromium, steered over its debugging protocol; no driver program is needed."""

import asyncio
import base64
import json
import os
from pathlib import Path
import shutil
import subprocess
import time
import urllib.request

from tornado.websocket import websocket_connect

NAMES = ('chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable', 'chrome')
FLAGS = (
    '--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
    '--disable-background-networking', '--disable-component-update', '--disable-sync',
    '--disable-dev-shm-usage', '--remote-debugging-port=0', 'about:blank')
START_S, ANSWER_S = 20.0, 15.0


def find_chromium():
    """Return the path of a Chromium, None where there is none."""
    given = os.environ.get('PAM_CHROMIUM')
    return given or next(filter(None, map(shutil.which, NAMES)), None)


class Browser:
    """One page of a headless Chromium; a context manager."""

    def __init__(self, folder, before=(), answer_s=ANSWER_S):
        self._folder, self._answer_s = Path(folder), answer_s
        self._loop = asyncio.new_event_loop()
        self._number = 0
        self._process = subprocess.Popen(
            [*before, find_chromium(), *FLAGS[:-1], f'--user-data-dir={folder}', FLAGS[-1]],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
        self.pid = self._process.pid
        try:
            self._socket = self._wait(
                websocket_connect, self._address(), max_message_size=64 << 20)
            self.do('Page.enable')
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _address(self):
        """Return the address of the first page."""
        file, deadline = self._folder / 'DevToolsActivePort', time.monotonic() + START_S
        while time.monotonic() < deadline:
            lines = file.read_text().split() if file.exists() else []
            if lines:
                with urllib.request.urlopen(f'http://127.0.0.1:{lines[0]}/json/list') as answer:
                    for target in json.load(answer):
                        if target['type'] == 'page':
                            return target['webSocketDebuggerUrl']
            time.sleep(0.05)
        raise AssertionError(f'Chromium did not start within {START_S:g} s')

    def _wait(self, call, *arguments, **named):
        """Return what an asynchronous call returns."""
        async def limited():
            return await asyncio.wait_for(call(*arguments, **named), self._answer_s)
        return self._loop.run_until_complete(limited())

    async def _write(self, text):
        await self._socket.write_message(text)

    def do(self, method, **parameters):
        """Return the result of one request of the protocol."""
        self._number += 1
        self._wait(self._write, json.dumps(
            {'id': self._number, 'method': method, 'params': parameters}))
        while True:
            said = json.loads(self._wait(self._socket.read_message))
            if said.get('id') == self._number:
                assert 'error' not in said, said['error']
                return said['result']

    def go_to(self, url):
        """Go to an address and wait until the page is loaded."""
        self.do('Page.navigate', url=url)
        self.wait_for('location.protocol !== "about:" && document.readyState === "complete"',
                      self._answer_s)

    def run(self, script):
        """Return the value of a JavaScript expression."""
        found = self.do('Runtime.evaluate', expression=script, returnByValue=True,
                        awaitPromise=True)
        assert 'exceptionDetails' not in found, found['exceptionDetails']
        return found['result'].get('value')

    def wait_for(self, script, timeout_s=10.0):
        """Wait until an expression is true; return its value."""
        deadline = time.monotonic() + timeout_s
        while not (value := self.run(script)):
            assert time.monotonic() < deadline, f'{script} did not come within {timeout_s:g} s'
            time.sleep(0.05)
        return value

    def text(self, selector):
        """Return the text that an element shows."""
        return self.run(f'document.querySelector({json.dumps(selector)})?.innerText ?? ""')

    def press(self, selector):
        """Press an element with the mouse, where it is."""
        x, y = self.run(
            f'(() => {{ const box = document.querySelector({json.dumps(selector)})'
            '.getBoundingClientRect(); '
            'return [box.x + box.width / 2, box.y + box.height / 2]; })()')
        for kind in ('mousePressed', 'mouseReleased'):
            self.do('Input.dispatchMouseEvent', type=kind, x=x, y=y, button='left', clickCount=1)

    def size(self, width, height, phone=False):
        """Set the size of the page."""
        self.do('Emulation.setDeviceMetricsOverride', width=width, height=height,
                deviceScaleFactor=2 if phone else 1, mobile=phone)

    def dark(self, dark):
        """Say what the system prefers."""
        self.do('Emulation.setEmulatedMedia', features=[
            {'name': 'prefers-color-scheme', 'value': 'dark' if dark else 'light'}])

    def picture(self, path):
        """Write what the page shows as a PNG file."""
        Path(path).write_bytes(base64.b64decode(self.do('Page.captureScreenshot')['data']))

    def close(self):
        """End the browser."""
        self._process.terminate()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._loop.close()
