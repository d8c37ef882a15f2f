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

"""Test simulated time: the plant as the clock, its rate, pause and steps; and lockstep."""

import argparse
import importlib
from pathlib import Path
import signal
import time

import pytest

pytest.importorskip('rclpy')

from lifecycle_msgs.msg import Transition                                   # noqa: E402, I100
from lifecycle_msgs.srv import ChangeState                                  # noqa: E402
from live_rig import LiveRig, wait_for                                      # noqa: E402
from pam_actuation.messages import Pressure, START_NS                       # noqa: E402
from pam_actuation.nodes.lockstep import EachTick, OneTickOld               # noqa: E402
from pam_actuation.nodes.lockstep import participants_of, Stamped           # noqa: E402
from pam_actuation.nodes.lockstep import TickInputs                         # noqa: E402
from pam_sim.errors import InputError                                       # noqa: E402
from std_srvs.srv import SetBool, Trigger                                   # noqa: E402

FOLDER = Path(__file__).resolve().parents[2] / 'benchmarks'
MS = 1_000_000
STEP_NS = 5 * MS


class Messages:
    """Stands for a subscription: what was put in has arrived."""

    topic = '/muscle/force'

    def __init__(self):
        self.received = 0
        self.newest = None

    def put(self, stamp_ns):
        self.newest = Pressure(stamp_ns, 2e5)
        self.received += 1

    def collect(self):
        pass

    def wait(self, timeout_s):
        time.sleep(timeout_s)


def test_one_message_per_tick_is_counted_and_its_stamp_does_not_matter():
    messages = Messages()
    messages.put(0)                     # before the lockstep
    awaited = EachTick(messages)
    for tick in (1, 2, 3):
        assert not awaited.arrived(tick * STEP_NS)
        assert not awaited.arrived(tick * STEP_NS)
        messages.put(tick * STEP_NS + 40_000 * (-1) ** tick)
        assert awaited.arrived(tick * STEP_NS)


def test_a_stamped_message_belongs_to_its_tick():
    first, second = Messages(), Messages()
    awaited = Stamped(first, second)
    first.put(STEP_NS)
    assert awaited.arrived(STEP_NS) and not awaited.arrived(2 * STEP_NS)
    second.put(2 * STEP_NS)
    assert awaited.arrived(2 * STEP_NS)


def test_what_is_used_one_tick_later_is_asked_for_one_tick_later():
    each, rare = Messages(), Messages()
    awaited, repeated = OneTickOld(each), OneTickOld(rare, period_ns=20 * MS)
    begin = 1000 * MS
    for tick in range(12):
        now = begin + tick * STEP_NS
        if tick:
            assert not awaited.arrived(now)
            each.put(now - STEP_NS)
            if (tick - 1) % 4 == 0:     # sent in tick 0, 4, 8
                assert not repeated.arrived(now)
                rare.put(now - STEP_NS)
        assert awaited.arrived(now) and repeated.arrived(now)


def test_a_silent_sender_is_left_out_and_may_come_back(monkeypatch):
    monkeypatch.setattr('pam_actuation.nodes.lockstep.LONGEST_WAIT_S', 0.02)
    said, messages = [], Messages()
    inputs = TickInputs(lambda: [Stamped(messages)], True, said.append, patience_s=0.05)
    inputs.begin()
    deadline = time.monotonic() + 5.0
    while not inputs.arrived(STEP_NS):
        assert time.monotonic() < deadline
    assert said == ['/muscle/force is silent and left out of the lockstep']
    assert inputs.arrived(2 * STEP_NS)              # nobody waits for it any more
    messages.put(2 * STEP_NS)
    assert not inputs.arrived(3 * STEP_NS)          # until it follows again
    assert said[1] == '/muscle/force takes part in the lockstep again'
    messages.put(3 * STEP_NS)
    assert inputs.arrived(3 * STEP_NS)


def test_without_lockstep_nothing_is_waited_for():
    inputs = TickInputs(lambda: [Stamped(Messages())], False, print)
    inputs.begin()
    assert not inputs and inputs.arrived(STEP_NS)


def test_only_nodes_of_the_rig_take_part():
    assert participants_of(['', 'valve_driver']) == ('valve_driver',)
    with pytest.raises(InputError, match='experiment_recorder.*plant_simulator'):
        participants_of(['experiment_recorder'])


@pytest.fixture
def benchmark(monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    return importlib.import_module('lockstep')


@pytest.mark.ros
def test_two_runs_in_lockstep_are_the_same_to_the_byte(benchmark):
    arguments = argparse.Namespace(
        valve='ppr', experiment='disturbance', rig='dmsp_5_300_realistic',
        simulated_seconds=2.0, silent=False)
    (_, first), (_, second) = benchmark.run_once(arguments), benchmark.run_once(arguments)
    assert first == second
    for topic in ('reference', 'pressure_command', 'valve_signal', 'controller_state'):
        assert first[topic][0] == 400, topic
    assert 398 <= first['pressure'][0] <= 401        # stamps have jitter
    assert len({digest for _, digest in first.values()}) == len(first) >= 10


@pytest.fixture(scope='module')
def rig(tmp_path_factory):
    """Return a rig that follows the plant's clock, half as fast as real time."""
    live = LiveRig(tmp_path_factory.mktemp('clock'))
    live.start('plant_simulator', use_sim_time=True, clock_rate=0.5, publish_rate_hz=200.0)
    for name in ('valve_driver', 'sofc_controller'):
        live.start(name, use_sim_time=True)
    live.start('reference_generator', use_sim_time=True, experiment='sine_half_hz')
    live.listen()
    wait_for(lambda: last_signal(live) > 1.0, 60.0, 'pressure')
    yield live
    live.close()


def last_signal(live):
    heard = live.heard['valve_signal']
    return heard[-1].plain.efforts[0] if heard else 0.0


def standing_still(heard):
    """Wait until nothing more is heard, what was on its way included; return how much was."""
    deadline = time.monotonic() + 10.0
    count = -1
    while len(heard) != count:
        assert time.monotonic() < deadline, 'messages go on coming'
        count = len(heard)
        time.sleep(0.4)
    return count


@pytest.mark.ros
def test_all_follow_the_clock_of_the_plant_at_its_rate(rig):
    count = len(rig.heard['controller_state'])
    wait_for(lambda: len(rig.heard['controller_state']) > count + 100, 10.0, 'control')
    stamps = [heard.plain.stamp_ns for heard in rig.heard['controller_state'][count:]]
    # 200 Hz of simulated time, on its grid, whatever real time did.
    assert all(START_NS < stamp < START_NS + 600e9 for stamp in stamps)
    steps = [b - a for a, b in zip(stamps, stamps[1:])]
    assert min(steps) == STEP_NS
    assert all(step % STEP_NS == 0 for step in steps)
    wait_for(lambda: 0.0 < float(rig.health['plant_simulator'][-1].values['clock.rate']) < 0.52,
             5.0, 'the rate')
    wait_for(lambda: rig.health['valve_driver'][-1].level <= 1, 5.0, 'an untroubled driver')


@pytest.mark.ros
def test_the_time_stands_still_in_a_pause_and_goes_on_in_steps(rig):
    assert not rig.call(Trigger, 'plant_simulator/step').success
    assert rig.call(SetBool, 'plant_simulator/pause', SetBool.Request(data=True)).success
    count = standing_still(rig.heard['force'])
    wait_for(lambda: rig.health['valve_driver'][-1].level == 1 and 'nothing came on /clock for'
             in rig.health['valve_driver'][-1].message, 6.0, 'the time that stands still')
    for number in (1, 2, 3):
        answer = rig.call(Trigger, 'plant_simulator/step')
        assert answer.success and '5 ms' in answer.message
        wait_for(lambda: len(rig.heard['force']) == count + number, 2.0, 'the step')
    assert rig.call(SetBool, 'plant_simulator/pause', SetBool.Request(data=False)).success
    wait_for(lambda: len(rig.heard['force']) > count + 100, 10.0, 'the time')
    # A pause is no pause in simulated time: nobody was late, nothing vented.
    wait_for(lambda: rig.health['valve_driver'][-1].level == 0, 3.0, 'the driver')


@pytest.mark.ros
def test_a_driver_on_simulated_time_vents_on_its_way_out(rig):
    wait_for(lambda: last_signal(rig) > 1.0, 10.0, 'pressure')
    driver = rig.processes['valve_driver']
    driver.send_signal(signal.SIGTERM)
    assert driver.wait(5.0) and driver.exit_code == 0
    wait_for(lambda: last_signal(rig) == 0.0, 2.0, 'the safe signal')


@pytest.mark.ros
def test_the_plant_makes_the_time_anew_after_a_cleanup_and_others_follow(rig):
    for transition in (
            Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP,
            Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
        request = ChangeState.Request(transition=Transition(id=transition))
        assert rig.call(ChangeState, 'plant_simulator/change_state', request, 20.0).success
    begin = len(rig.heard['force'])
    wait_for(lambda: len(rig.heard['force']) > begin + 20, 10.0, 'the time')
    assert rig.heard['force'][-1].plain.stamp_ns < rig.heard['force'][begin - 1].plain.stamp_ns
    states = rig.heard['controller_state']
    before_ns = max(heard.plain.stamp_ns for heard in states)
    count = len(states)
    wait_for(lambda: len(states) > count + 20, 10.0, 'control on the new time')
    assert states[-1].plain.stamp_ns < before_ns
