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
Kill recorders at random moments and check what their bags still hold.

    python benchmarks/kill_recorder.py --kills 160 --nodes 40

Processes that record numbered messages get SIGKILL after a random time; then the bag
is repaired as ``pam info --recover`` does. Every message must be there, byte for
byte and without a gap, up to less than a second before the kill. ``--kills`` are processes
with the recorder's own classes fed at the rates of a rig, ``--nodes`` real nodes
that listen to a real publisher (needs ROS 2).
"""

import argparse
import contextlib
import json
import multiprocessing
import os
from pathlib import Path
import random
import signal
import subprocess
import sys
import tempfile
import time

from mcap.reader import make_reader
from pam_actuation.bags.recorder import RecorderCore
from pam_actuation.bags.recover import recover_bag
from pam_actuation.bags.source import read_bag
from pam_actuation.bags.writer import BagWriter
from pam_actuation.messages import ControllerState, Pressure
from pam_actuation.topics.codec import encode
from pam_actuation.topics.table import RECORDED
import results_page
from rosbags.rosbag2 import Reader

FEED_PERIOD_S = 0.01
RATES_HZ = {'pressure': 1000, 'pressure_command': 500, 'controller_state': 500}
NAMES = tuple(f'internal_{k}' for k in range(20))
ALLOWED_S = 1.0
START_S = 20.0
LARGEST_PAUSE_S = 0.05
NODE_RATES_HZ = {'pressure': 500, 'controller_state': 200}


def numbered(topic, number):
    """Return message ``number`` of a topic: any change of it would be seen."""
    value = 1e5 + (number * 2654435761 % 2**32) / 7.0
    if topic == 'controller_state':
        return encode(topic, ControllerState(
            number, NAMES, tuple(value + k for k in range(len(NAMES)))))
    return encode(topic, Pressure(number, value))


class Diary:
    """What was sent until when, one line per feeding period; survives a kill."""

    def __init__(self, path):
        self._handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND)

    def note(self, sent):
        """Write down the numbers of messages sent, by topic."""
        os.write(self._handle, (json.dumps([time.time_ns(), sent]) + '\n').encode())

    @staticmethod
    def sent_ns(path, topic, number):
        """Return when message ``number`` of a topic had been sent, None if it was not."""
        for line in path.read_text().splitlines():
            with contextlib.suppress(ValueError):      # the last line may be torn
                time_ns, sent = json.loads(line)
                if sent[topic] > number:
                    return time_ns
        return None


def record(directory, split_bytes, begun):
    """Record numbered messages until killed (the child); tell ``begun`` the time of the first."""
    core = RecorderCore(BagWriter(
        directory, {'experiment_name': 'kill'}, max_file_bytes=split_bytes))
    sent = dict.fromkeys(RATES_HZ, 0)
    for topic in RATES_HZ:
        core.add_topic(f'/muscle/{topic}', RECORDED[topic].type_name)
    diary = Diary(f'{directory}.diary')
    begin = time.monotonic()
    begun.send(time.time_ns())
    while True:
        elapsed_s = time.monotonic() - begin
        for topic, rate_hz in RATES_HZ.items():
            while sent[topic] < elapsed_s * rate_hz:
                now_ns = time.time_ns()
                number = sent[topic]
                core.receive(
                    f'/muscle/{topic}', numbered(topic, number), now_ns, now_ns, number + 1)
                sent[topic] += 1
        diary.note(sent)
        time.sleep(FEED_PERIOD_S)


def kill_processes(folder, count, rng, parallel=4, shortest_s=0.0, longest_s=4.0,
                   split_bytes=0):
    """
    Kill ``count`` recording processes, ``parallel`` at a time; yield what is left of each.

    Yields
    ------
    dict
        ``bag``, ``diary`` of what was sent, ``killed_ns``, the time of the kill, and
        ``started_ns``, that of the first message (None if it was killed before).

    """
    # Children of a small server: a process with threads does not fork safely.
    context = multiprocessing.get_context('forkserver')
    context.set_forkserver_preload(['pam_actuation.bags.recorder', 'pam_actuation.bags.writer'])
    for first in range(0, count, parallel):
        running = []
        for k in range(first, min(first + parallel, count)):
            bag = folder / f'kill_{k}'
            heard, begun = context.Pipe(duplex=False)
            process = context.Process(
                target=record, args=(bag, split_bytes, begun), daemon=True)
            process.start()
            running.append((rng.uniform(shortest_s, longest_s), bag, process, heard, k))
        for life_s, bag, process, heard, k in sorted(running, key=lambda item: item[0]):
            # Every tenth may be killed before its first message.
            started_ns = _told(heard, START_S if k % 10 else 0.0)
            age_s = (time.time_ns() - started_ns) * 1e-9 if started_ns else 0.0
            time.sleep(max(life_s - age_s, 0.0))
            killed_ns = time.time_ns()
            os.kill(process.pid, signal.SIGKILL)
            process.join()
            yield {'bag': bag, 'killed_ns': killed_ns,
                   'diary': Path(f'{bag}.diary'),
                   'started_ns': started_ns or _told(heard, 0.0)}


def _told(heard, wait_s):
    """Return the time a child told, None if it has not."""
    try:
        return heard.recv() if heard.poll(wait_s) else None
    except EOFError:
        return None


def kill_nodes(folder, count, rng, longest_s=4.0):
    """
    Kill ``count`` recorder nodes that hear a publisher; yield as ``kill_processes``.

    Each has a publisher of its own: one that was connected to killed recorders before keeps
    them for 20 s and may need seconds for the next one, which is no matter of recording.
    """
    from pam_actuation.rigging.domain import DomainLock
    from pam_actuation.rigging.processes import end_all, node_environment, NodeProcess
    domain = DomainLock()
    environment = node_environment(domain.domain_id, folder)
    try:
        for k in range(count):
            bag, diary = folder / f'node_{k}', folder / f'node_{k}.diary'
            publisher = subprocess.Popen(
                [sys.executable, __file__, '--publish', str(diary)], env=environment,
                stdin=subprocess.PIPE, text=True, start_new_session=True)
            node = NodeProcess(
                'experiment_recorder', '/muscle',
                {'output': str(bag), 'await_topics': list(NODE_RATES_HZ)}, environment, folder)
            try:
                _wait_for_log(node, publisher)
                publisher.stdin.write('go\n')
                publisher.stdin.flush()
                _wait_for_diary(diary, publisher)
                started_ns = time.time_ns()
                time.sleep(rng.uniform(0.05, longest_s))
                killed_ns = time.time_ns()
                node.send_signal(signal.SIGKILL)
                node.wait(10.0)
            finally:
                end_all([node])
                publisher.terminate()
                publisher.wait(10.0)
            yield {'bag': bag, 'killed_ns': killed_ns, 'diary': diary, 'started_ns': started_ns}
    finally:
        domain.release()


def _wait_for_log(node, publisher):
    """Wait until the node says that it is ready."""
    deadline = time.monotonic() + 60.0
    while 'ready' not in node.log_file.read_text():
        if not node.running or publisher.poll() is not None or time.monotonic() > deadline:
            raise RuntimeError(f'recorder or publisher did not start: {node.how_it_ended()}')
        time.sleep(0.02)


def _wait_for_diary(diary, publisher):
    """Wait until the first messages were sent."""
    deadline = time.monotonic() + 60.0
    while not diary.exists():
        if publisher.poll() is not None or time.monotonic() > deadline:
            raise RuntimeError('the publisher was not connected to the recorder')
        time.sleep(0.005)


def publish(path):
    """Publish numbered messages to the recorder until stopped (a process of its own)."""
    from pam_actuation.nodes.endpoints import CountedPublisher, wait_until_matched
    from pam_actuation.nodes.ros_messages import class_of
    import rclpy
    from rclpy.signals import SignalHandlerOptions
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)      # SIGTERM ends it at once
    node = rclpy.create_node('numbers', namespace='/muscle')
    publishers = {topic: CountedPublisher(node, class_of(topic), topic)
                  for topic in NODE_RATES_HZ}
    wait_until_matched(
        list(publishers.values()), '/muscle/experiment_recorder', 60.0, lambda: not rclpy.ok())
    sys.stdin.readline()                    # the recorder is ready
    sent = dict.fromkeys(NODE_RATES_HZ, 0)
    diary = Diary(path)
    began = time.monotonic()
    while rclpy.ok():
        elapsed_s = time.monotonic() - began
        late_s = elapsed_s - sent['pressure'] / NODE_RATES_HZ['pressure']
        if late_s > LARGEST_PAUSE_S:        # a sensor does not make up for a pause either
            began += late_s - LARGEST_PAUSE_S
            elapsed_s = time.monotonic() - began
        for topic, rate_hz in NODE_RATES_HZ.items():
            while sent[topic] < elapsed_s * rate_hz:
                publishers[topic].publish(numbered(topic, sent[topic]))
                sent[topic] += 1
        diary.note(sent)
        time.sleep(FEED_PERIOD_S)


def examine(case, rates=None):
    """
    Repair the bag of a killed recorder and check it against what was sent.

    Returns
    -------
    dict
        ``problems`` (sentences, empty for a good bag), ``messages`` and ``missing_s``, the
        time between the first message that is not in the bag and the kill.

    """
    bag, problems = case['bag'], []
    if case['started_ns'] is None:
        if list(bag.glob('*.mcap')):
            recover_bag(bag)
        return {'problems': [], 'messages': 0, 'missing_s': 0.0, 'files': 0}
    recovery = recover_bag(bag)
    if recover_bag(bag).changed:
        problems.append('the repaired bag is not whole')
    content = read_bag(bag)
    missing_s = 0.0
    for topic in rates or RATES_HZ:
        data = content.topics.get(f'/muscle/{topic}')
        payloads = list(data.payloads) if data else []
        expected = [numbered(topic, number) for number in range(len(payloads))]
        if payloads != expected:
            problems.append(f'{topic}: a message is altered or missing inside')
        sent_ns = Diary.sent_ns(case['diary'], topic, len(payloads))
        if sent_ns is not None:
            missing_s = max(missing_s, (case['killed_ns'] - sent_ns) * 1e-9)
    if missing_s > ALLOWED_S:
        problems.append(f'{missing_s:.2f} s before the kill are missing')
    with Reader(bag) as reader:
        if reader.message_count != recovery.messages:
            problems.append('rosbags counts other messages')
    for file in bag.glob('*.mcap'):
        with open(file, 'rb') as stream:
            make_reader(stream).get_summary()
    return {'problems': problems, 'messages': recovery.messages, 'missing_s': missing_s,
            'files': len(recovery.files)}


def summary(results):
    """Return the figures of many examined bags."""
    missing = sorted(result['missing_s'] for result in results)
    return {
        'kills': len(results), 'before_first_chunk': sum(
            not result['messages'] for result in results),
        'messages': sum(result['messages'] for result in results),
        'bad_bags': sum(bool(result['problems']) for result in results),
        'missing_median_s': round(missing[len(missing) // 2], 3) if missing else None,
        'missing_worst_s': round(missing[-1], 3) if missing else None,
        'problems': [problem for result in results for problem in result['problems']]}


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--kills', type=int, default=160)
    parser.add_argument('--nodes', type=int, default=40)
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--parallel', type=int, default=4)
    parser.add_argument('--publish', default='', help=argparse.SUPPRESS)
    results_page.add_write(parser, 'recording')
    return parser


def show(found):
    """Print the figures as a table."""
    print('| SIGKILL of | kills | before the first chunk | messages | bags not as they must be '
          '| missing before the kill, median / worst |\n|---|---|---|---|---|---|')
    for name, one in found.items():
        print(f'| {name} | {one["kills"]} | {one["before_first_chunk"]} | {one["messages"]} '
              f'| {one["bad_bags"]} | {one["missing_median_s"]} / {one["missing_worst_s"]} s |')


def main():
    """Kill, repair, count; exit code 1 if any bag is not as it must be."""
    args = command_line().parse_args()
    if args.publish:
        return publish(args.publish)
    with results_page.printed(args, __file__):
        return run(args)


def run(args):
    """Kill, repair, print the table; return the exit code."""
    rng = random.Random(args.seed)
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        cases = list(kill_processes(folder, args.kills, rng, args.parallel))
        found['processes'] = summary([examine(case) for case in cases])
        cases = list(kill_nodes(folder, args.nodes, rng)) if args.nodes else []
        found['nodes'] = summary([examine(case, NODE_RATES_HZ) for case in cases])
    print(json.dumps(found, indent=2), file=sys.stderr)
    show(found)
    return 1 if any(part['bad_bags'] for part in found.values()) else 0


if __name__ == '__main__':
    sys.exit(main())
