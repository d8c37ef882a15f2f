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
Measure whether the loops of a live rig keep their periods, and how late a command is.

    python benchmarks/loop_timing.py --seconds 600

Plant at 1 kHz, controller at 500 Hz, all nodes and the recorder live. A bare echo runs beside
them with the real-time priority of the plant: one rclpy node with a timer, another one with a
callback. It sends the message of the valve signal with the defaults of rclpy, 97 times per second.
That loads the cores little and is in no step with the loops.
It prints for each loop the ticks that did not run, and how irregular the others were. It prints
the age of a valve signal when the plant applies it, beside that of a message in the callback of
the echo. A bare loop of 1 kHz without ROS, that does nothing and goes before all others, shows
what the machine itself allows. Exit code 1 if more than 0.1 % of the ticks of plant or controller
did not run. The same if the 99th percentile of the plant is more than twice that of the echo.
"""

import argparse
from functools import partial
import json
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import time

from pam_actuation.nodes.loops import LoopSet
from pam_actuation.nodes.realtime import ask_for_realtime
from pam_actuation.nodes.timing import Latency, LoopTiming
from pam_actuation.rigging import session
from pam_actuation.rigging.plan import make_plan, PLANT
from pam_actuation.rigging.processes import end_with_parent, node_environment
from pam_actuation.transport import unprepared
from recording_load import CONTROLLER_HZ, experiment_text, fast_controller, PLANT_HZ
import results_page

ALLOWED_MISSED = 0.001
ALLOWED_RATIO = 2.0
ECHO_HZ = 97.0
ECHO_PRIORITY = 3           # of the plant: 1 asked for, and its rank of 2
BARE_PRIORITY = 20
BARE_S = 1e-3
LOOPS = (PLANT, 'sofc_controller')
BARE = 'bare loop'


def echo(role):
    """Be one node of the bare echo until SIGTERM; the listener prints what it found."""
    from pam_actuation.nodes.ros_messages import set_stamp
    import rclpy
    from rclpy.signals import SignalHandlerOptions
    from sensor_msgs.msg import JointState
    stopped = []
    signal.signal(signal.SIGTERM, lambda *_: stopped.append(True))
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node(
        f'echo_{role}', start_parameter_services=False, enable_rosout=False)
    latency = Latency()
    if role == 'talker':
        publisher = node.create_publisher(JointState, '/echo', 10)
        message = JointState(name=['ppr_voltage'], effort=[0.0])

        def talk():
            set_stamp(message.header.stamp, time.time_ns())
            publisher.publish(message)

        node.create_timer(1.0 / ECHO_HZ, talk)
    else:
        def hear(message):
            stamp = message.header.stamp
            latency.add(time.time_ns() - 1_000_000_000 * stamp.sec - stamp.nanosec)

        node.create_subscription(JointState, '/echo', hear, 10)
    refused = ask_for_realtime(ECHO_PRIORITY)
    executor = rclpy.executors.SingleThreadedExecutor()
    executor.add_node(node)
    while not stopped:
        executor.spin_once(timeout_sec=0.1)
    print(json.dumps({'count': latency.count, 'refused': refused,
                      **dict(latency.values('echo'))}))


def bare_loop():
    """Be a loop of the nodes' own kind without a node until SIGTERM; print its timing."""
    stopped = []
    signal.signal(signal.SIGTERM, lambda *_: stopped.append(True))
    refused = ask_for_realtime(BARE_PRIORITY)
    timing, loops = LoopTiming(BARE_S), LoopSet()

    def tick():
        timing.begin(time.monotonic_ns())
        timing.end(time.monotonic_ns())

    loops.add(BARE_S, tick)
    while not stopped:
        loops.run_once()
    print(json.dumps({'refused': refused, **dict(timing.values())}))


class Beside:
    """Both nodes of the echo and the bare loop as processes."""

    def __init__(self, environment):
        plain = unprepared(environment)
        self._processes = [
            subprocess.Popen([sys.executable, __file__, '--echo', role], env=plain,
                             stdout=subprocess.PIPE, text=True, start_new_session=True,
                             preexec_fn=partial(end_with_parent, os.getpid()))
            for role in ('listener', 'talker', BARE)]

    def end(self):
        """End all and return what the listener and the bare loop found."""
        for process in reversed(self._processes):
            process.terminate()
        said = [process.communicate(timeout=20.0)[0] for process in self._processes]
        return json.loads(said[0]), json.loads(said[2])


def measure(seconds, folder):
    """
    Run the rig and the echo for some seconds.

    Returns
    -------
    dict
        ``nodes``: the last status of each loop by node; ``echo``; ``failure``.

    """
    controller = Path(folder) / 'controller.yaml'
    controller.write_text(fast_controller(CONTROLLER_HZ))
    plan = make_plan(experiment_text(seconds), 'dmsp_5_300_realistic', str(controller), 'ppr',
                     str(Path(folder) / 'bag'))
    plan.parameters[PLANT]['publish_rate_hz'] = PLANT_HZ
    result, last = session.Result(''), {}
    try:
        with session.RigSession(plan) as rig:
            beside = Beside(node_environment(rig.domain_id, plan.folder))

            def note(done_s, total_s):
                for name in LOOPS:
                    status = rig.group.started.statuses.get(f'{rig.namespace}/{name}')
                    if status is not None and 'loop.ticks' in status[2]:
                        last[name] = status[2]

            session.run_guarded(rig, result, note)
            found, last_of_all = beside.end()
    finally:
        plan.remove()
    if not last:
        raise SystemExit(result.failure or 'the nodes did not report')
    return {'nodes': last, BARE: last_of_all, 'echo': found, 'failure': result.failure,
            'cpu_share': result.cpu_share}


def judge(found):
    """Print the tables; return whether the bars are met."""
    print('| loop | wanted | ticks | did not run | later than 1.5 periods | longest jitter '
          '| longest tick |')
    print('|---|---|---|---|---|---|---|')
    good = not found['failure']
    for name, values in (*found['nodes'].items(), (BARE, found[BARE])):
        ticks, missed = int(values['loop.ticks']), int(values['loop.missed'])
        share = missed / (ticks + missed)
        good &= share <= ALLOWED_MISSED or name == BARE
        print(f'| {name} | {float(values["loop.period_wanted_ms"]):g} ms | {ticks} '
              f'| {missed} ({share:.3%}) | {int(values["loop.overruns"]) / ticks:.3%} '
              f'| {values["loop.jitter_max_ms"]} ms | {values["loop.busy_max_ms"]} ms |')
    plant, beside = found['nodes'][PLANT], found['echo']
    ratio = float(plant['input.latency.p99_ms']) / float(beside['echo.p99_ms'])
    good &= ratio <= ALLOWED_RATIO
    print('\n| age of a message | median | 99th percentile | longest |\n|---|---|---|---|')
    for title, values, key in (('valve signal, when the plant applies it', plant, 'input.latency'),
                               ('bare echo, in the callback', beside, 'echo')):
        print(f'| {title} | {values[key + ".p50_ms"]} ms | {values[key + ".p99_ms"]} ms '
              f'| {values[key + ".max_ms"]} ms |')
    print(f'\nratio of the 99th percentiles {ratio:.2f}; processor (share of one core): '
          + ', '.join(f'{name} {share:.2f}' for name, share in found['cpu_share'].items()))
    for problem in filter(None, (found['failure'], beside['refused'], found[BARE]['refused'])):
        print(problem)
    return good


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--seconds', type=float, default=60.0)
    parser.add_argument('--echo', choices=('talker', 'listener', BARE), help=argparse.SUPPRESS)
    results_page.add_write(parser, 'loop_timing')
    return parser


def main():
    """Measure and judge."""
    args = command_line().parse_args()
    if args.echo:
        return bare_loop() if args.echo == BARE else echo(args.echo)
    with results_page.printed(args, __file__):
        with tempfile.TemporaryDirectory() as folder:
            found = measure(args.seconds, folder)
        return 0 if judge(found) else 1


if __name__ == '__main__':
    sys.exit(main())
