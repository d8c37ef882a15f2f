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

"""A client of the Foxglove protocol gets what a rig publishes, with its definition."""

import asyncio
import json
import signal
import struct
import subprocess
import sys
import threading
import time

import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')
pytest.importorskip('foxglove', reason='the extra foxglove is not installed')

from pam_actuation import messages                                          # noqa: E402, I100
from pam_actuation.cli.main import main                                     # noqa: E402
from pam_actuation.nodes import qos                                         # noqa: E402
from pam_actuation.nodes.foxglove_server import FoxgloveServer              # noqa: E402
from pam_actuation.nodes.ros_messages import class_of                       # noqa: E402
from pam_actuation.rigging.client import local_context                      # noqa: E402
from pam_actuation.rigging.domain import DomainLock                         # noqa: E402
from pam_actuation.topics.codec import decode, encode                       # noqa: E402
from pam_actuation.topics.definitions import schema_text                    # noqa: E402
from pam_actuation.view.layouts import foxglove_layout                      # noqa: E402
from pam_sim.errors import InputError                                       # noqa: E402
import rclpy                                                                # noqa: E402
from rclpy.node import Node                                                 # noqa: E402
from tornado.websocket import websocket_connect                             # noqa: E402

pytestmark = pytest.mark.ros
PROTOCOL = 'foxglove.sdk.v1'
LONGEST_S = 20.0
MESSAGE_DATA = 1
HEAD = struct.Struct('<BIQ')        # kind, subscription, receive time


def test_a_layout_is_written_for_a_namespace(tmp_path):
    process = subprocess.Popen(
        [sys.executable, '-m', 'pam_actuation.cli.main', 'view', '--foxglove', '--port', '0',
         '--namespace', 'left_knee/flexor', '--layout', 'own.json', '--json'],
        cwd=tmp_path, stdout=subprocess.PIPE, text=True)
    assert json.loads(process.stdout.readline())['url'].startswith('ws://127.0.0.1:')
    process.send_signal(signal.SIGINT)
    assert process.wait(LONGEST_S) == 0
    process.stdout.close()
    own = (tmp_path / 'own.json').read_text()
    assert 'left_knee/flexor/pressure.fluid_pressure' in own and '"/muscle' not in own
    assert json.loads(own.replace('"/left_knee/flexor', '"/muscle')) == json.loads(
        foxglove_layout())


@pytest.mark.parametrize('words, place', [
    (['some.mcap'], '--foxglove'), (['--host', '0.0.0.0'], '--host'), (['--open'], '--open')])
def test_what_does_not_go_with_it_is_told(words, place, capsys):
    assert main(['view', '--foxglove', *words]) == 2
    assert f'pam view: {place}: ' in capsys.readouterr().err


async def received(url, topic):
    """Return (channel, receive time, bytes) of the first message of a topic."""
    socket = await websocket_connect(url, subprotocols=[PROTOCOL])
    channel = None
    while True:
        data = await socket.read_message()
        if isinstance(data, bytes):
            kind, subscription, received_ns = HEAD.unpack_from(data)
            if kind == MESSAGE_DATA and subscription == 7:
                socket.close()
                return channel, received_ns, data[HEAD.size:]
            continue
        told = json.loads(data)
        for one in told.get('channels', ()) if told['op'] == 'advertise' else ():
            channel = one if one['topic'] == topic else channel
        # The library may advertise a channel a moment before it knows it, and refuses it then.
        if channel and told['op'] in ('advertise', 'status'):
            await socket.write_message(json.dumps({
                'op': 'subscribe', 'subscriptions': [{'id': 7, 'channelId': channel['id']}]}))


def test_a_client_reads_what_the_rig_sends():
    lock = DomainLock()
    context = local_context(lock.domain_id)
    node = Node('plant_simulator', namespace='/muscle', context=context)
    pressure = node.create_publisher(class_of('pressure'), 'pressure', qos.PUBLISHER)
    server = FoxgloveServer(lock.domain_id, port=0)
    found = []
    client = threading.Thread(target=lambda: found.append(asyncio.run(
        asyncio.wait_for(received(server.url, '/muscle/pressure'), LONGEST_S))))
    client.start()
    begin_ns = time.time_ns()
    try:
        while client.is_alive():
            pressure.publish(encode('pressure', messages.Pressure(time.time_ns(), 3.21e5)))
            server.run_once()
        channel, received_ns, raw = found[0]
        with pytest.raises(InputError, match=f'port {server.url.rpartition(":")[2]}'):
            FoxgloveServer(lock.domain_id, port=int(server.url.rpartition(':')[2]))
    finally:
        client.join()
        server.close()
        node.destroy_node()
        rclpy.try_shutdown(context=context)
        lock.release()
    assert (channel['encoding'], channel['schemaName']) == (
        'cdr', 'sensor_msgs/msg/FluidPressure')
    assert channel['schemaEncoding'] == 'ros2msg'
    assert channel['schema'] == schema_text('sensor_msgs/msg/FluidPressure')
    assert begin_ns < received_ns < time.time_ns()
    assert decode('pressure', raw).pressure_pa == 3.21e5
