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
Run a rig in lockstep over DDS: its speed, and whether two runs are the same to the byte.

    python benchmarks/lockstep.py
    python benchmarks/lockstep.py --simulated-seconds 60 --runs 1 --silent

Plant (1 ms physics), valve driver, controller (200 Hz) and reference as processes of their
own; the plant's clock goes on as fast as the others answer. Prints simulated seconds per
second, from the diagnostics of the plant, and per topic the number of messages
and whether all runs have the same bytes. With ``--silent`` nobody listens to the
topics, so that only the rig itself takes processor time. Exit code 1 if runs differ.
"""

import argparse
import hashlib
import json
import sys
import tempfile
import time

from pam_actuation.messages import START_NS
from pam_actuation.nodes import qos
from pam_actuation.nodes.endpoints import PolledSubscription
from pam_actuation.nodes.ros_messages import class_of
from pam_actuation.rigging.client import NAME, RigClient
from pam_actuation.rigging.domain import DomainLock
from pam_actuation.rigging.processes import end_all, node_environment, NodeProcess
from pam_actuation.topics.table import OF_A_RUN
import results_page
from std_srvs.srv import SetBool

CONTROLLER = 'sofc_controller'
NODES = ('plant_simulator', 'valve_driver', CONTROLLER, 'reference_generator')
NAMESPACE = '/muscle'
START_TIMEOUT_S = 120.0
STALLED_S = 10.0
# The last message of a slow topic is followed by another one within this time.
AFTER_NS = 150_000_000
# A sender keeps what the listener has not got yet: a busy machine delivers seconds late.
KEPT = 20_000


def parameters_of(valve, experiment, rig):
    """Return the parameters of each node."""
    common = {'use_sim_time': True, 'lockstep': list(NODES), 'realtime_priority': 1,
              'autostart': False}
    own = {
        'plant_simulator': {
            'clock_rate': 0.0, 'publish_rate_hz': 200.0, 'rig': rig, 'valve_type': valve},
        'valve_driver': {'valve_type': valve, 'rig': rig},
        CONTROLLER: {'valve_type': valve, 'rig': rig},
        'reference_generator': {'experiment': experiment, 'valve_type': valve}}
    kept = {f'qos_overrides.{NAMESPACE}/{topic}.publisher.depth': KEPT for topic in OF_A_RUN}
    return {name: {**common, **kept, **own[name]} for name in NODES}


class Listener:
    """A digest of the bytes of each topic, up to a number of ticks of simulated time."""

    def __init__(self, node, silent):
        self.sources = {} if silent else {
            topic: PolledSubscription(
                node, class_of(topic), f'{NAMESPACE}/{topic}', qos.reliable(KEPT), raw=True)
            for topic in OF_A_RUN}
        self.messages = {topic: [] for topic in self.sources}

    def take(self):
        """Fetch what has arrived."""
        for topic, source in self.sources.items():
            self.messages[topic] += [bytes(data) for data, _ in source.take(100_000)]

    @property
    def count(self):
        """Return the number of all messages so far."""
        return sum(map(len, self.messages.values()))

    def has_all(self, topics, until_ns):
        """Tell whether all up to a time [ns] has come: what is later comes after it."""
        return all(messages and stamp_of(messages[-1]) > until_ns
                   for topic, messages in self.messages.items() if topic in topics)

    def digests(self, until_ns):
        """Return topic to (number of messages, digest) of those stamped up to a time [ns]."""
        found = {}
        for topic, messages in self.messages.items():
            kept = [data for data in messages if stamp_of(data) <= until_ns]
            if kept:
                found[topic] = (len(kept), hashlib.sha256(b''.join(kept)).hexdigest()[:16])
        return found


def stamp_of(data):
    """Return the header stamp [ns] of a serialized message: it comes first."""
    return (int.from_bytes(data[4:8], 'little') * 1_000_000_000
            + int.from_bytes(data[8:12], 'little'))


def run_once(arguments):
    """
    Run the rig for some simulated seconds.

    Parameters
    ----------
    arguments : argparse.Namespace
        ``valve``, ``experiment``, ``rig``, ``simulated_seconds``, ``silent``.

    Returns
    -------
    rate : float
        Simulated seconds per second.
    digests : dict
        Topic to (number of messages, digest of their bytes).

    """
    lock = DomainLock()
    client = None
    with tempfile.TemporaryDirectory() as folder:
        environment = node_environment(lock.domain_id, folder)
        wanted = parameters_of(arguments.valve, arguments.experiment, arguments.rig)
        if not arguments.silent:        # or the first messages may go by before all is heard
            for parameters in wanted.values():
                parameters['await_subscriber'] = f'/{NAME}'
        nodes = {name: NodeProcess(name, NAMESPACE, parameters, environment, folder)
                 for name, parameters in wanted.items()}
        try:
            client = RigClient(lock.domain_id)
            listener = Listener(client.node, arguments.silent)
            names = {nodes[name].full_name: nodes[name] for name in NODES}
            for transition in ('configure', 'activate'):
                refused = client.change_states(
                    names, transition, START_TIMEOUT_S, lambda name: names[name].running)
                if refused:
                    raise SystemExit(f'{refused[0]}: {names[refused[0]].last_line()}')
            until_ns = START_NS + round(arguments.simulated_seconds * 1e9)
            rate = follow(client, listener, until_ns)
        finally:
            end_all(nodes.values())
            if client is not None:
                client.close()
            lock.release()
    return rate, listener.digests(until_ns)


def follow(client, listener, until_ns):
    """Wait until all up to a time has been simulated and heard; return simulated s per second."""
    plant = f'{NAMESPACE}/plant_simulator'
    before, moved_s, paused = None, time.monotonic(), False
    pause = client.node.create_client(SetBool, f'{plant}/pause')
    while True:
        client.spin(0.02)
        listener.take()
        values = client.statuses.get(plant, (0, '', {}))[2]
        steps = int(values.get('physics.steps', 0))
        if (steps, listener.count) != before:
            before, moved_s = (steps, listener.count), time.monotonic()
        if START_NS + steps * 1_000_000 > until_ns + AFTER_NS:
            if not paused:      # the listener has time to get what it lacks
                paused, rate = True, float(values['clock.rate'])
                pause.call_async(SetBool.Request(data=True))
            if listener.has_all(sent(client), until_ns):
                return rate
        if time.monotonic() - moved_s > STALLED_S:
            raise SystemExit(f'the rig stands still after {steps * 1e-3:.3f} simulated seconds')


def sent(client):
    """Return the topics that the nodes say they have sent something on."""
    prefix = f'published.{NAMESPACE}/'
    return {key.removeprefix(prefix) for _, _, values in client.statuses.values()
            for key, count in values.items() if key.startswith(prefix) and int(count) > 0}


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--simulated-seconds', type=float, default=20.0)
    parser.add_argument('--runs', type=int, default=2)
    parser.add_argument('--valve', choices=('ppr', 'hsv'), default='ppr')
    parser.add_argument('--rig', default='dmsp_5_300_realistic')
    parser.add_argument('--experiment', default='sine_half_hz')
    parser.add_argument('--silent', action='store_true', help='listen to no topic')
    parser.add_argument('--json', action='store_true')
    results_page.add_write(parser, 'loop_timing')
    return parser


def main(args=None):
    """Run the benchmark; return its exit code."""
    arguments = command_line().parse_args(args)
    with results_page.printed(arguments, __file__, arguments.valve):
        return show(arguments)


def show(arguments):
    """Run, print speed and digests; return the exit code."""
    runs = [run_once(arguments) for _ in range(arguments.runs)]
    same = all(digests == runs[0][1] for _, digests in runs)
    if arguments.json:
        print(json.dumps({'rates': [rate for rate, _ in runs], 'same': same,
                          'topics': [digests for _, digests in runs]}))
        return 0 if same else 1
    print('| run | simulated seconds per second | messages | topics as in the first run |')
    print('|---|---|---|---|')
    for number, (rate, digests) in enumerate(runs, 1):
        count = sum(messages for messages, _ in digests.values())
        equal = sum(runs[0][1].get(topic) == one for topic, one in digests.items())
        print(f'| {number} | {rate:.2f} | {count} | {equal} of {len(digests)} |')
        for topic, (messages, digest) in digests.items():
            print(f'run {number}: {topic:22s} {messages:6d} messages  {digest}', file=sys.stderr)
    if not arguments.silent:
        print('\nAll runs are the same to the byte.' if same else '\nThe runs differ.')
    return 0 if same else 1


if __name__ == '__main__':
    sys.exit(main())
