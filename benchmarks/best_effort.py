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
What a best-effort subscription loses on this machine, and a reliable one does not.

    python benchmarks/best_effort.py --write

One process publishes pressures at 1 kHz, reliable, as the nodes do. Another subscribes to them
twice, reliable and best effort, with the history of a node, and takes what arrived every 10 ms. It
is stopped for some time (SIGSTOP), as a preempted or swapped process is, and goes on. The
numbers of the messages tell which are missing.
"""

import argparse
import json
import signal
import subprocess
import sys
import tempfile
import time

from pam_actuation.nodes.endpoints import CountedPublisher, PolledSubscription
from pam_actuation.nodes.qos import profile
from pam_actuation.rigging.client import local_context
from pam_actuation.rigging.domain import DomainLock
from pam_actuation.rigging.processes import node_environment
from pam_actuation.topics.quality import Quality, USUAL
from rclpy.node import Node
import results_page
from sensor_msgs.msg import FluidPressure

RATE_HZ = 1000.0
DEPTH = USUAL.consumer.depth
KINDS = ('reliable', 'best_effort')
STOPS_S = (0.0, 0.3, 0.9, 1.5, 3.0)
SETTLE_S = 2.0              # after a stop, for what is sent again


def listen(domain_id: int, seconds: float) -> int:
    """Count what arrives, in a process of its own; print the numbers of the messages."""
    node = Node('listener', context=local_context(domain_id))
    heard = {kind: PolledSubscription(
        node, FluidPressure, 'pressure', profile(Quality(DEPTH, kind))) for kind in KINDS}
    numbers = {kind: set() for kind in KINDS}
    print('ready', flush=True)
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s:
        time.sleep(0.01)
        for kind, subscription in heard.items():
            numbers[kind].update(
                round(message.fluid_pressure) for message, _ in subscription.take())
    print(json.dumps({kind: sorted(found) for kind, found in numbers.items()}), flush=True)
    return 0


def lost(stop_s: float, seconds: float) -> dict[str, tuple[int, int]]:
    """Return (messages lost, messages that count) of each kind of subscription."""
    lock = DomainLock()
    total_s = seconds + stop_s + SETTLE_S + 4.0
    listener = subprocess.Popen(
        [sys.executable, __file__, '--listen', str(lock.domain_id), str(total_s)],
        stdout=subprocess.PIPE, text=True,
        env=node_environment(lock.domain_id, tempfile.gettempdir()))
    assert listener.stdout.readline() == 'ready\n'
    node = Node('sensor', context=local_context(lock.domain_id))
    publisher = CountedPublisher(node, FluidPressure, 'pressure')
    while publisher.rclpy_publisher.get_subscription_count() < len(KINDS):
        time.sleep(0.01)
    time.sleep(0.5)
    message, begin_s, k = FluidPressure(), time.monotonic(), 0
    stop_at_s, go_at_s = 0.5 * seconds, 0.5 * seconds + stop_s
    state = 'before'
    while k < RATE_HZ * (seconds + stop_s):
        now_s = time.monotonic() - begin_s
        if state == 'before' and stop_s and now_s >= stop_at_s:
            listener.send_signal(signal.SIGSTOP)
            state = 'stopped'
        elif state == 'stopped' and now_s >= go_at_s:
            listener.send_signal(signal.SIGCONT)
            state = 'after'
        if k > now_s * RATE_HZ:
            time.sleep(0.0002)
            continue
        message.fluid_pressure = float(k)
        publisher.publish(message)
        k += 1
    out, _ = listener.communicate(timeout=60.0)
    node.destroy_node()
    lock.release()
    numbers = json.loads(out)
    return {kind: (k - len(found), k) for kind, found in numbers.items()}


def show(args: argparse.Namespace) -> None:
    """Print the table."""
    print('| listener stopped for | sent | lost, reliable | lost, best effort |\n'
          '|---|---|---|---|')
    for stop_s in STOPS_S:
        missing = lost(stop_s, args.seconds)
        stopped = f'{stop_s:g} s' if stop_s else 'not stopped'
        print(f'| {stopped} | {missing["reliable"][1]} | {missing["reliable"][0]} | '
              f'{missing["best_effort"][0]} |', flush=True)


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('--seconds', type=float, default=6.0, help='of each run, beside the stop')
    results_page.add_write(parser, 'best_effort')
    return parser


def main() -> int:
    """Listen, or run the benchmark."""
    if sys.argv[1:2] == ['--listen']:
        return listen(int(sys.argv[2]), float(sys.argv[3]))
    return results_page.run(command_line(), __file__, show)


if __name__ == '__main__':
    sys.exit(main())
