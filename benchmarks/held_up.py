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
Does a listener that is stopped hold up who sends to it? Through shared memory, and by UDP.

    python benchmarks/held_up.py --times 1000

A plain rclpy node sends at 1 kHz, three others listen; one of these is stopped (SIGSTOP) at a
random moment for 60 ms, again and again. Counted is how often a call of ``publish`` took longer
than half of that. This is done with the default of ROS 2 on this machine (shared memory), and
with the profile by which the nodes of this package receive. Exit code 1 if a call was held up by
UDP.
"""

import argparse
from functools import partial
import json
import os
import random
import signal
import subprocess
import sys
import time

from pam_actuation.rigging.domain import DomainLock
from pam_actuation.rigging.processes import end_with_parent
from pam_actuation.transport import prepare_middleware, RANGE, unprepared
from tqdm import tqdm

LISTENERS = 3
PERIOD_S = 1e-3
STOPPED_S, BETWEEN_S = 0.06, 0.03
HELD_UP_S = STOPPED_S / 2.0
SETTLE_S = 2.0


def participant(role):
    """Be one node until SIGTERM; the talker prints the calls that took long."""
    import rclpy
    from rclpy.signals import SignalHandlerOptions
    from sensor_msgs.msg import JointState
    stopped = []
    signal.signal(signal.SIGTERM, lambda *_: stopped.append(True))
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node(role, start_parameter_services=False, enable_rosout=False)
    if role == 'listener':
        heard = []
        node.create_subscription(JointState, '/held_up', lambda _: heard.append(True), 10)
        executor = rclpy.executors.SingleThreadedExecutor()
        executor.add_node(node)
        while not stopped:
            executor.spin_once(timeout_sec=0.1)
        print(json.dumps(len(heard)))
        return
    publisher = node.create_publisher(JointState, '/held_up', 10)
    message = JointState(name=['ppr_voltage'], effort=[0.0])
    calls, took_s = 0, []
    while not stopped:
        begin_s = time.monotonic()
        publisher.publish(message)
        end_s = time.monotonic()
        calls += 1
        if end_s - begin_s > HELD_UP_S:
            took_s.append((begin_s, end_s - begin_s))
        time.sleep(max(0.0, PERIOD_S - (end_s - begin_s)))
    print(json.dumps({'calls': calls, 'took_s': took_s}))


def trials(times, environment, seed, title):
    """
    Stop a listener again and again.

    Returns
    -------
    dict
        ``held_up``: trials with a call that took long while the listener stood still;
        ``longest_s``, ``calls``, ``heard``: per listener.

    """
    chance = random.Random(seed)
    processes = [subprocess.Popen(
        [sys.executable, __file__, '--participant', role], env=environment, text=True,
        stdout=subprocess.PIPE, start_new_session=True,
        preexec_fn=partial(end_with_parent, os.getpid()))
        for role in ('talker', *['listener'] * LISTENERS)]
    stopped = []
    try:
        time.sleep(SETTLE_S)
        for _ in tqdm(range(times), desc=title):
            time.sleep(BETWEEN_S * (1.0 + chance.random()))
            victim = processes[1]
            begin_s = time.monotonic()
            victim.send_signal(signal.SIGSTOP)
            time.sleep(STOPPED_S)
            victim.send_signal(signal.SIGCONT)
            stopped.append((begin_s, time.monotonic()))
    finally:
        for process in processes:
            process.terminate()
        said = [process.communicate(timeout=20.0)[0] for process in processes]
    found = json.loads(said[0])
    during = [call for call in found['took_s']
              if any(begin_s - 0.01 < call[0] < end_s for begin_s, end_s in stopped)]
    return {'held_up': len(during), 'calls': found['calls'],
            'longest_s': max((took_s for _, took_s in during), default=0.0),
            'heard': [json.loads(text) for text in said[1:]]}


def main():
    """Compare; return 1 if a call was held up by UDP."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--times', type=int, default=1000)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--participant', choices=('talker', 'listener'), help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.participant:
        return participant(args.participant)
    lock = DomainLock()
    try:
        shared = {**unprepared(os.environ), 'ROS_DOMAIN_ID': str(lock.domain_id),
                  RANGE: 'LOCALHOST'}
        udp = dict(shared)
        prepare_middleware(udp)
        found = {title: trials(args.times, environment, args.seed, title)
                 for title, environment in (('shared memory', shared), ('UDP', udp))}
    finally:
        lock.release()
    print('| messages travel by | listener stopped | call of publish held up | longest call '
          '| calls | heard by the others |\n|---|---|---|---|---|---|')
    for title, one in found.items():
        print(f'| {title} | {args.times} | {one["held_up"]} | {one["longest_s"] * 1e3:.0f} ms '
              f'| {one["calls"]} | {", ".join(map(str, one["heard"][1:]))} |')
    return int(found['UDP']['held_up'] > 0)


if __name__ == '__main__':
    sys.exit(main())
