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
Second senders at random moments on live nodes: two drivers, two controllers, two sensors.

    python benchmarks/second_sender.py --times 20 --valve hsv

A second node begins to send while recorder, plant, driver, watchdog, controller and reference run
as processes over DDS. A driver or controller is there before, silent, since DDS takes up to 3 s
until two processes have found each other; before that neither hears the other. Each outcome is a
line of ``--out``; started again with the same file, it goes on where it was. ``--print`` only
prints the table. Run as ``second_sender.py stranger`` it is the second sender of a signal or a
sensor.
"""

from dataclasses import dataclass
import signal
import statistics
import subprocess
import sys
import time

from fault_rig import NAMESPACE, RIG
from fault_table import (
    ALLOWED_PA, ALLOWED_S, CONTROLLER, DRIVER, RESTART_S, run_series, Series, series_parser,
    SETTLE_S, WATCHDOG)
from pam_actuation.messages import Contraction, Pressure, VALVE_NAMES, ValveSignal
from pam_actuation.nodes import qos
from pam_actuation.nodes.endpoints import PolledSubscription
from pam_actuation.nodes.ros_messages import class_of
from pam_actuation.rigging.processes import end_all, NodeProcess
from pam_actuation.topics.codec import Reader, Writer
import rclpy
from rclpy.signals import SignalHandlerOptions

FULL = {'ppr': (6.0,), 'hsv': (1.0, 0.0)}
STRANGER, SECOND, STARTER = 'stranger', 'second_node', 'starter'
SENT = {DRIVER: ('valve_signal', 'followed_pressure', '/diagnostics'),
        CONTROLLER: ('pressure_command', 'controller_state', '/diagnostics')}
RATE_HZ = {'valve_signal': 500.0, 'pressure': 250.0, 'contraction': 250.0}
MEASURED_FROM = {'pressure': 'true/pressure', 'contraction': 'true/contraction'}
START_S = 30.0              # of a second node, on a busy machine
DISCOVERED_S = 5.0          # until every node of a domain has found a new one
LASTS_S = 1.6               # a trial, from the first message of the second sender
LOOK_S = 0.05
VENTED_GAUGE_PA = 60e3      # a second later, at most
MOMENTS_S = 1.0


@dataclass(frozen=True)
class Case:
    """
    One row: what begins to send, on which topic, and who names it.

    ``second`` is an executable that is started beside the rig's own (in turn under the same name
    and another one), '' for the stranger. ``tellers`` all have to name it. ``kills``: the driver
    is killed a moment later. ``safe`` as in the fault table.
    """

    title: str
    topic: str
    second: str = ''
    tellers: tuple = (DRIVER,)
    kills: bool = False
    safe: str = 'signal'


CASES = {
    'drivers': Case('two drivers', 'valve_signal', DRIVER, (DRIVER, SECOND, WATCHDOG)),
    'signal': Case('a second publisher of valve_signal at full opening, then SIGKILL of the '
                   'driver', 'valve_signal', tellers=(WATCHDOG,), kills=True),
    'controllers': Case('two controllers', 'pressure_command', CONTROLLER),
    'pressures': Case('two pressure sensors', 'pressure'),
    'contractions': Case('two contraction sensors', 'contraction', tellers=(CONTROLLER,),
                         safe='command')}


class Second:
    """The second sender of one trial."""

    def __init__(self, rig, case, rng):
        self._rig, self._case = rig, case
        self.same_name = bool(case.second) and rng.random() < 0.5
        name = case.second if self.same_name else SECOND if case.second else STRANGER
        self.full_name = f'{NAMESPACE}/{name}'
        # A node of the same name answers under it, too.
        self.tellers = [DRIVER if one == SECOND and self.same_name else one
                        for one in case.tellers]
        self._process = self._starter = None

    def name_for(self, teller):
        """Return the full name that a node must say: the second one says that of the first."""
        return f'{NAMESPACE}/{self._case.second}' if teller == SECOND else self.full_name

    def begin(self):
        """Let it send; return the time [ns] just before its first message, and its writers."""
        rig, case = self._rig, self._case
        if not case.second:
            onset_ns = time.time_ns()
            rig.stranger.stdin.write(f'{case.topic}\n')
            rig.stranger.stdin.flush()
            return onset_ns
        known = set(rig.witness.writers[case.topic])
        self._starter = rig.witness.new_listener(STARTER, SENT[case.second])
        deadline = time.monotonic() + START_S
        while time.monotonic() < deadline:
            rig.witness.listen(LOOK_S / 5)
            first = next((one.stamp_ns for one, writer in zip(
                rig.witness.heard[case.topic], rig.witness.writers[case.topic])
                if writer not in known), None)
            if first is not None:
                return first
        raise RuntimeError(f'{case.second} did not begin to send: {self._process.last_line()}')

    def prepare(self):
        """Start it, silent until ``begin``, and wait until all nodes have discovered it."""
        rig, case = self._rig, self._case
        if case.second:
            folder = rig.folder / 'second'
            folder.mkdir(exist_ok=True)
            parameters = {
                'valve_type': rig.valve, 'rig': RIG, 'diagnostics_period_s': 0.1,
                'realtime_priority': 1, 'await_subscriber': f'{NAMESPACE}/{STARTER}',
                'await_timeout_s': 10.0 * START_S}
            remap = {} if self.same_name else {'__node': SECOND}
            self._process = NodeProcess(
                case.second, NAMESPACE, parameters, rig.environment, folder, remap)
            rig.witness.wait_for_publishers(case.topic, 2, START_S)
            rig.witness.listen(DISCOVERED_S)

    def end(self):
        """Let it fall silent."""
        if self._process is not None:
            end_all([self._process])
            if self._starter is not None:
                self._starter.destroy_node()
        else:
            self._rig.stranger.stdin.write('none\n')
            self._rig.stranger.stdin.flush()


def play(rig, case, rng):
    """
    Let a second sender begin, end it, and judge what was heard.

    Returns
    -------
    dict
        As ``fault_table.play``, with ``onset_to_named_s``, ``named`` (the name that was said) and
        ``later_gauge_pa``, the pressure a second after the signal that vents.

    """
    witness, bag = rig.witness, rig.bag
    second = Second(rig, case, rng)
    second.prepare()
    witness.forget()
    witness.listen(SETTLE_S + rng.uniform(0.0, MOMENTS_S))
    own = set(witness.writers['valve_signal'])
    onset_ns = second.begin()
    kill_s = rng.uniform(0.0, 0.5) if case.kills else None
    begun = time.monotonic()
    while time.monotonic() - begun < LASTS_S + (kill_s or 0.0):
        witness.listen(LOOK_S)
        if kill_s is not None and time.monotonic() - begun >= kill_s:
            rig.signal(DRIVER, signal.SIGKILL)
            kill_s = None
    strangers = {one for one in witness.writers['valve_signal']
                 if one not in own and not witness.is_named(one, WATCHDOG)}
    safe_ns = (witness.safe_since(onset_ns, strangers) if case.safe == 'signal'
               else witness.atmosphere_since(onset_ns))
    told_ns = [next((
        one.stamp_ns for who, one in witness.said if who == teller
        and one.stamp_ns >= onset_ns and second.name_for(teller) in one.message), None)
        for teller in second.tellers]
    told = None not in told_ns
    pressures = [one for one in witness.heard['true/pressure'] if one.stamp_ns >= onset_ns]
    highest_pa = max(one.pressure_pa for one in pressures) - 101_325.0
    later_pa = pressures[-1].pressure_pa - 101_325.0
    said = [f'{name}: {status.message}' for name, status in witness.said]
    second.end()
    if case.kills:
        rig.processes[DRIVER].wait(5.0)
        rig.start(DRIVER)
    restarted = rig.wait_until_sound(RESTART_S)
    to_safe_s = None if safe_ns is None else (safe_ns - onset_ns) * 1e-9
    named_s = (max(told_ns) - onset_ns) * 1e-9 if told else None
    return {
        'told': told and named_s <= ALLOWED_S,
        'safe_ok': to_safe_s is not None and to_safe_s <= ALLOWED_S and (
            later_pa <= VENTED_GAUGE_PA),
        'onset_to_safe_s': to_safe_s, 'onset_to_named_s': named_s, 'named': second.full_name,
        'later_gauge_pa': later_pa, 'highest_gauge_pa': highest_pa,
        'limit_ok': highest_pa <= ALLOWED_PA, 'restarted': restarted, 'bag': str(bag),
        'onset_ns': onset_ns, 'safe_ns': safe_ns if safe_ns != onset_ns else None, 'said': said}


class SecondSenders(Series):
    """Many second senders on one valve, written down one by one."""

    SETTLES = ()

    def cases(self):
        """Return key to case of the rows."""
        return CASES

    def play(self, rig, case, rng):
        """Let one case happen at a moment; return the outcome."""
        if rig.stranger is None:
            rig.stranger = subprocess.Popen(
                [sys.executable, __file__, STRANGER, rig.valve], env=rig.environment,
                stdin=subprocess.PIPE, text=True, start_new_session=True)
            rig.witness.wait_for_node(STRANGER, START_S)
            rig.witness.listen(DISCOVERED_S)
        return play(rig, case, rng)


def stranger(valve):
    """Send on the topic that the last line of the standard input names, until it ends."""
    import os
    import threading
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node(STRANGER, namespace=NAMESPACE)
    sources = {topic: PolledSubscription(
        node, class_of(true), true, raw=True, read=Reader(true))
        for topic, true in MEASURED_FROM.items()}
    wanted = ['none']

    def read():
        for line in sys.stdin:
            wanted[0] = line.strip()
        os._exit(0)             # whoever asks is gone

    threading.Thread(target=read, daemon=True).start()
    topic, publisher = 'none', None
    while True:
        if wanted[0] != topic:
            if publisher is not None:
                node.destroy_publisher(publisher)
                publisher = None
            topic = wanted[0]
            if topic != 'none':
                publisher = node.create_publisher(class_of(topic), topic, qos.PUBLISHER)
                writer = Writer(topic)
        if publisher is None:
            time.sleep(0.002)
            continue
        now_ns = time.time_ns()
        if topic == 'valve_signal':
            plain = ValveSignal(now_ns, VALVE_NAMES[valve], FULL[valve])
        else:
            sources[topic].take()
            newest = sources[topic].newest
            plain = newest and (Pressure(now_ns, newest.pressure_pa) if topic == 'pressure'
                                else Contraction(now_ns, newest.contraction_m))
        if plain is not None:
            publisher.publish(writer.fill(plain))
        time.sleep(1.0 / RATE_HZ[topic])


def table(outcomes, valve):
    """Return the Markdown table of a valve."""
    lines = ['| what begins | times | vented within, median / worst | named within, median / '
             'worst | named | highest pressure | a second later, at most | sound again |',
             '|---|---|---|---|---|---|---|---|']
    for key, case in CASES.items():
        rows = [one for one in outcomes if one['valve'] == valve and one['case'] == key]
        if not rows:
            continue
        vented = [one['onset_to_safe_s'] for one in rows if one['onset_to_safe_s'] is not None]
        named = [one['onset_to_named_s'] for one in rows if one['onset_to_named_s'] is not None]
        names = ', '.join(sorted({f'`{one["named"]}`' for one in rows if one['told']}))
        tellers = ', '.join('the second driver' if one == SECOND else f'`{one}`'
                            for one in case.tellers)
        lines.append(
            f'| {case.title} | {len(rows)} | {_times(vented)} '
            f'({sum(one["safe_ok"] for one in rows)} of {len(rows)}) | {_times(named)} '
            f'({sum(one["told"] for one in rows)} of {len(rows)}) | {names} by {tellers} '
            f'| {max(one["highest_gauge_pa"] for one in rows) * 1e-3:.0f} kPa '
            f'| {max(one["later_gauge_pa"] for one in rows) * 1e-3:.0f} kPa '
            f'| {sum(one["restarted"] for one in rows)} of {len(rows)} |')
    return '\n'.join(lines)


def _times(times_s):
    if not times_s:
        return '–'
    return f'{statistics.median(times_s) * 1e3:.0f} / {max(times_s) * 1e3:.0f} ms'


def command_line():
    """Return the parser of the command line."""
    return series_parser(CASES, 'second_sender.jsonl', __doc__, 'second_senders', times=20)


def main():
    """Play, print the table; exit code 1 if anything was not as it must be."""
    if sys.argv[1:2] == [STRANGER]:
        return stranger(sys.argv[2])
    return run_series(command_line(), __file__, SecondSenders, table)


if __name__ == '__main__':
    sys.exit(main())
