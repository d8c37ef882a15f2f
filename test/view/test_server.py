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

"""The server, asked as a page asks it: data, emergency stop, bad requests, slow pages, tokens."""

import asyncio
import json
import socket
import time
import urllib.error
import urllib.request

from made_rig import connect, DRIVER, MadeRig, Page, Running
from pam_actuation.cli.main import main
from pam_actuation.view import client as client_module
from pam_actuation.view.access import Access
from pam_actuation.view.recording import load
from pam_actuation.view.requests import parse, Request
from pam_actuation.view.server import ViewServer
from pam_actuation.view.source import BagSource
from pam_sim.errors import InputError
import pytest
from sample_bag import write_bag
from tornado.httpclient import HTTPClientError


@pytest.fixture(scope='module')
def rig():
    """Return a made-up rig."""
    return MadeRig()


@pytest.fixture(scope='module')
def server(rig):
    """Return a server of the rig while its time passes."""
    one = ViewServer(rig, port=0)
    one.start()
    with Running(rig):
        yield one
    one.stop()


async def heard(connection, page, wanted, messages=400):
    """Take messages until one is wanted; return it."""
    for _ in range(messages):
        message = await asyncio.wait_for(connection.read_message(), 10.0)
        assert message is not None, 'the server closed the connection'
        taken = page.take(message)
        if wanted(taken):
            return taken
    raise AssertionError('did not come')


def fetch(url, **headers):
    """Return status, headers and text of an HTTP request."""
    try:
        with urllib.request.urlopen(urllib.request.Request(url, headers=headers)) as answer:
            return answer.status, answer.headers, answer.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.headers, error.read().decode()


def test_a_page_gets_hello_state_layout_and_pictures_that_go_on(server):
    async def look():
        page, connection = Page(), await connect(server)
        hello = await heard(connection, page, lambda one: one.get('type') == 'hello')
        assert hello['live'] and 10 in hello['windows_s']
        state = await heard(connection, page, lambda one: one.get('type') == 'state')
        assert state['drivers'] == [DRIVER] and state['namespaces'] == ['/muscle']
        topics = {one['name']: one for one in state['topics']}
        assert topics['/muscle/pressure']['rate_hz'] == pytest.approx(1000.0, abs=60.0)
        assert topics['/muscle/pressure']['lost'] == 3
        await connection.write_message(json.dumps({'do': 'watch', 'view': '', 'window_s': 2}))
        await heard(connection, page, lambda one: one.get('kind') == 'all')
        before = len(page.columns[page.index('pressure', 'command')])
        for _ in range(3):
            await heard(connection, page, lambda one: one.get('kind') == 'new')
        assert len(page.columns[page.index('pressure', 'command')]) > before > 500
        connection.close()
    asyncio.run(look())


def test_emergency_stop_and_reset_reach_the_driver_and_are_answered(server, rig):
    async def press(action, number, **more):
        page, connection = Page(), await connect(server)
        await connection.write_message(json.dumps({'do': action, 'number': number, **more}))
        answer = await heard(connection, page, lambda one: one.get('type') == 'answer')
        connection.close()
        return answer

    rig.asked.clear()
    answer = asyncio.run(press('emergency_stop', 7))
    assert answer['number'] == 7 and answer['results'] == [
        {'node': DRIVER, 'ok': True, 'message': 'vents'}]
    rig.silent = True
    answer = asyncio.run(press('reset', 8, view='/muscle'))
    rig.silent = False
    assert not answer['results'][0]['ok']
    assert rig.asked == ['emergency_stop', 'reset']


@pytest.mark.parametrize('request_text, why', [
    ('{', 'not JSON'), ('[]', 'not a JSON object'), ('{"do": "format"}', "do is 'format'"),
    ('{"do": "watch", "window_s": 3}', 'window_s is 3'),
    ('{"do": "watch", "view": 3}', 'view is not a text'),
    ('{"do": "play"}', 'experiment is needed'), ('{"do": "play", "view": 1}', 'view is not'),
    ('{"do": "halt", "experiment": "x"}', 'only there'),
    ('{"do": "watch", "end_s": 1e400}', 'end_s is inf'),
    ('{"do": "reset", "number": -1}', 'number is not'), ('{"do": "mark"}', 'text is None'),
    ('{"do": "reset"}', 'view is not a text'),
    ('{"do": "mark", "text": " "}', '1 to 80 characters'),
    ('{"do": "mark", "text": "a\\nb"}', 'on one line')])
def test_other_requests_are_refused_in_one_sentence(request_text, why):
    with pytest.raises(InputError, match=why):
        parse(request_text)


def test_a_stop_is_for_all_drivers_and_a_reset_for_those_of_its_view():
    assert parse('{"do": "emergency_stop", "number": 3, "view": 7}') == Request(
        'emergency_stop', 3)
    assert parse('{"do": "reset", "number": 4, "view": "/right"}') == Request(
        'reset', 4, '/right')


def test_a_wrong_request_is_told_and_the_page_goes_on(server):
    async def ask():
        page, connection = Page(), await connect(server)
        await connection.write_message('nonsense')
        error = await heard(connection, page, lambda one: one.get('type') == 'error')
        assert error['message'] == 'request: is not JSON'
        await connection.write_message('{"do": "watch", "window_s": 10}')
        await heard(connection, page, lambda one: one.get('kind') == 'all')
        connection.close()
    asyncio.run(ask())


def test_one_that_never_reads_is_let_go_and_others_lose_nothing(server, monkeypatch):
    monkeypatch.setattr(client_module, 'PATIENCE_S', 0.5)

    def deaf():
        """Return a connection that asks for pictures and reads nothing."""
        one = socket.socket()
        one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        one.connect(('127.0.0.1', server.port))
        host = f'localhost:{server.port}'
        one.sendall((f'GET /socket HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\n'
                     'Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n'
                     'Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n').encode())
        time.sleep(0.2)
        ask = b'{"do":"watch","window_s":2}'
        frame = bytes([0x81, 0x80 | len(ask), 0, 0, 0, 0]) + ask
        one.setblocking(False)
        try:
            for _ in range(20):             # each asks for a whole picture again
                one.sendall(frame)
                time.sleep(0.06)
        except OSError:
            pass
        return one

    async def look():
        page, connection = Page(), await connect(server)
        await connection.write_message('{"do": "watch", "window_s": 2}')
        await heard(connection, page, lambda one: one.get('kind') == 'all')
        loop = asyncio.get_running_loop()
        starting = loop.run_in_executor(None, deaf)
        kinds = []
        begin = loop.time()
        skipped = False
        while not skipped and loop.time() < begin + 15.0:
            header = await heard(connection, page, lambda one: 'kind' in one)
            kinds.append(header['kind'])
            skipped = any(one.skipped for one in server.clients)
        assert skipped
        while len(server.clients) > 1 and loop.time() < begin + 30.0:
            kinds.append((await heard(connection, page, lambda one: 'kind' in one))['kind'])
        assert len(server.clients) == 1
        assert set(kinds) == {'new'}        # no picture had to be replaced
        (await starting).close()
        connection.close()
    asyncio.run(look())


def test_a_bag_is_shown_at_any_time(tmp_path):
    bag = write_bag(tmp_path / 'bag', 600)
    one = ViewServer(BagSource(load(bag)), port=0)
    one.start()

    async def look():
        page, connection = Page(), await connect(one)
        hello = await heard(connection, page, lambda one: one.get('type') == 'hello')
        assert not hello['live'] and hello['length_s'] == pytest.approx(2.995)
        assert hello['remarks'] == list(one.source.remarks)
        shown = []
        for end_s in (1.0, 2.5, 99.0):
            await connection.write_message(json.dumps(
                {'do': 'watch', 'view': '', 'window_s': 5, 'end_s': end_s}))
            header = await heard(connection, page, lambda one: one.get('kind') == 'all')
            shown.append(header['now_s'] - hello['begin_s'])
            assert len(page.columns[0]) == pytest.approx(120 * shown[-1], abs=3)
        assert shown == pytest.approx([1.0, 2.5, 2.995], abs=1e-5)
        await connection.write_message('{"do": "emergency_stop", "number": 1}')
        answer = await heard(connection, page, lambda one: one.get('type') == 'answer')
        assert answer['results'] == []
        connection.close()
    asyncio.run(look())
    one.stop()


def test_nothing_of_the_page_comes_from_elsewhere(server):
    status, headers, text = fetch(f'http://localhost:{server.port}/')
    assert status == 200 and "default-src 'self'" in headers['Content-Security-Policy']
    assert 'http' not in text.replace('http-equiv', '')
    for name in ('page.js', 'chart.js', 'surface.js', 'page.css', 'icon.svg'):
        status, _, text = fetch(f'http://localhost:{server.port}/{name}')
        assert status == 200 and len(text) > 100
        assert 'https://' not in text and '@import' not in text
    assert fetch(f'http://localhost:{server.port}/../server.py')[0] == 404
    assert fetch(f'http://localhost:{server.port}/client.py')[0] == 404


def test_pages_of_other_sites_are_refused(server):
    assert fetch(f'http://localhost:{server.port}/', Host='evil.example')[0] == 403

    async def foreign():
        await connect(server, Origin='http://evil.example')
    with pytest.raises(HTTPClientError, match='403'):
        asyncio.run(foreign())


@pytest.mark.parametrize('host', ['127.0.0.1', 'localhost', '127.0.0.2', '::1', 'own_name'])
def test_the_address_told_answers(host, monkeypatch):
    look_up = socket.getaddrinfo        # a name in /etc/hosts, as Debian gives the machine
    monkeypatch.setattr(socket, 'getaddrinfo', lambda name, *more, **named: look_up(
        '127.0.1.1' if name == 'own_name' else name, *more, **named))
    try:
        one = ViewServer(MadeRig(10), Access(host), port=0)
        one.start()
    except InputError:
        if host != '::1':
            raise
        pytest.skip('this machine has no IPv6')
    try:
        assert fetch(one.url)[0] == 200
    finally:
        one.stop()


def test_from_other_machines_a_token_is_needed():
    assert Access().token == '' and Access('localhost').token == ''
    access = Access('0.0.0.0')
    assert len(access.token) > 20 and access.token != Access('0.0.0.0').token
    one = ViewServer(MadeRig(10), access, port=0)
    one.start()
    here = f'http://127.0.0.1:{one.port}/'
    assert one.url.endswith(f':{one.port}/?token={access.token}')
    assert fetch(here)[0] == fetch(f'{here}?token=wrong')[0] == fetch(f'{here}page.js')[0] == 403
    cookie = f'pam_view_{one.port}={access.token}'
    assert fetch(here, Cookie=cookie)[0] == 200

    async def without():
        await connect(one)
    with pytest.raises(HTTPClientError, match='403'):
        asyncio.run(without())

    async def with_token():
        (await connect(one, Cookie=cookie)).close()
    asyncio.run(with_token())
    one.stop()


def test_bad_calls_end_with_code_2_and_one_sentence(capsys, tmp_path, monkeypatch):
    taken = socket.create_server(('127.0.0.1', 0))
    bag = str(write_bag(tmp_path / 'bag', 5))
    port = str(taken.getsockname()[1])
    for arguments, said in (
            ([str(tmp_path / 'none')], 'no such file or directory'),
            ([bag, '--port', port], f'port {port}'),
            ([bag, '--host', 'no.such.host.invalid'], 'neither an address nor a known name'),
            ([bag, '--domain-id', '3'], 'for a running rig, not for a bag'),
            ([bag, '--namespace', '/9'], '--namespace')):
        assert main(['view', *arguments]) == 2
        error = capsys.readouterr().err
        assert said in error and error.count('\n') == 1, error
    taken.close()
    monkeypatch.setattr('pam_actuation.cli.viewed.find_spec', lambda name: None)
    assert main(['view', bag]) == 2
    assert 'pip install "pam_actuation[view]"' in capsys.readouterr().err
