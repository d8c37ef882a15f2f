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

"""A reset after a stop starts no motion: what was asked for before is dropped."""

from faulty_joint import FaultyJoint
import numpy as np
from pam_actuation.control import tick as codes
from pam_actuation.control.config import load_controller
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.loops.bus import Bus, every
from pam_actuation.loops.wiring import attach, attach_plant, controller_tick, driver_tick
from pam_actuation.messages import (
    AngleReference, AngleTrajectory, Pressure, Reference, ReferenceTrajectory, START_NS)
from pam_actuation.plant_loop import PlantLoop
from pam_sim import load_rig
from pam_sim.joint.parameters import SIDES
from pam_sim.units import P_ATM_PA
import pytest

SECOND = 1_000_000_000
MINUTE = 0, 60 * SECOND
DROPPED = codes.REASONS[codes.REFERENCE_DROPPED]


class OneMuscle:
    """Controller, driver and a hanging mass; ``streams`` is sent 50 times a second."""

    def __init__(self, valve):
        rig = load_rig('dmsp_5_300_realistic', valve=valve)
        law = load_controller(f'sofc_{valve}', rig)
        self.control, self.driver = ControllerLoop(law, rig), DriverLoop(
            valve, driver_config(rig, law.driver))
        self.plant, self.streams, self.ticking = PlantLoop(rig), False, True
        self.now_ns, self.gauge_pa, self.reasons = START_NS, [], []
        self._bus = bus = Bus()
        measure, drive = attach_plant(bus, self.plant), driver_tick(bus, self.driver)
        attach(bus, self.control)
        attach(bus, self.driver)
        bus.add(measure, every(200.0))
        bus.add(self._stream, every(50.0))
        bus.add(controller_tick(bus, self.control), every(200.0))
        bus.add(self._note, every(200.0))
        bus.add(lambda now_ns: drive(now_ns) if self.ticking else None,
                every(self.driver.rate_hz))

    def _stream(self, now_ns):
        if self.streams:
            self._bus.send('reference', Reference(now_ns, 0.01, 0.0), now_ns)

    def _note(self, now_ns):
        self.gauge_pa.append(self.plant.plant.pressure_pa - P_ATM_PA)
        self.reasons.append(self.control.reason)

    def move(self):
        """Ask once for a movement of a minute."""
        self.control.take(
            'reference_trajectory', ReferenceTrajectory(self.now_ns, MINUTE, (0.008, 0.012)))

    def run(self, duration_s):
        self.now_ns += round(duration_s * 1e9)
        self._bus.run_until(self.now_ns)
        return self

    def highest_pa(self, duration_s):
        """Go on; return the highest pressure meanwhile."""
        before = len(self.gauge_pa)
        self.run(duration_s)
        return max(self.gauge_pa[before:])


def _stop(rig):
    rig.driver.emergency_stop()
    return lambda: rig.driver.reset()


def _kill(rig):
    rig.ticking = False

    def again():
        rig.ticking = True
    return again


def _two_senders(rig):
    rig.driver.set_sender_fault(('second_driver', 'two nodes send'))
    return lambda: rig.driver.set_sender_fault(None)


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
@pytest.mark.parametrize('interrupt', [_stop, _kill, _two_senders])
@pytest.mark.parametrize('lasts_s', [0.5, 3.0])
def test_a_movement_sent_once_does_not_go_on_after_its_driver_was_interrupted(
        valve, interrupt, lasts_s):
    rig = OneMuscle(valve).run(0.1)
    rig.move()
    assert rig.highest_pa(1.5) > 100e3 and rig.reasons[-1] == 'ok'
    end = interrupt(rig)
    rig.run(lasts_s)
    end()
    rig.run(1.0)
    assert rig.highest_pa(3.0) < 1e3
    assert rig.reasons[-1] == DROPPED
    rig.move()
    assert rig.highest_pa(1.5) > 100e3 and rig.reasons[-1] == 'ok'


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_a_movement_sent_during_a_stop_is_dropped_too(valve):
    rig = OneMuscle(valve).run(0.1)
    rig.move()
    rig.run(1.0)
    end = _stop(rig)
    rig.run(2.0)
    rig.move()
    rig.run(1.0)
    end()
    assert rig.highest_pa(3.0) < 1e3 and rig.reasons[-1] == DROPPED


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
@pytest.mark.parametrize('interrupt', [_stop, _kill])
def test_a_sender_that_goes_on_is_followed_again(valve, interrupt):
    rig = OneMuscle(valve)
    rig.streams = True
    rig.run(1.5)
    end = interrupt(rig)
    rig.run(2.0)
    end()
    rig.run(1.5)
    assert rig.gauge_pa[-1] > 100e3
    assert set(rig.reasons[50:]) == {'ok'}


def test_of_a_sender_that_died_before_the_reset_nothing_is_followed():
    rig = OneMuscle('ppr')
    rig.streams = True
    rig.run(1.5)
    end = _stop(rig)
    rig.run(1.0)
    rig.streams = False
    rig.run(0.5)
    end()
    assert rig.highest_pa(3.0) < 1e3


def moved_once(valve):
    """Return a joint in the midst of a movement that was sent once, and how to send another."""
    rig = FaultyJoint(valve)
    rig.ask = lambda now_ns: ('co_contraction', Pressure(now_ns, P_ATM_PA + 300e3))
    rig.run(0.1)

    def move():
        rig.control.take('joint_trajectory', AngleTrajectory(
            rig.now_ns, MINUTE, (0.2, 0.5), (np.nan, np.nan)))

    move()
    rig.run(1.5)
    assert rig.angle_rad[-1] == pytest.approx(0.2, abs=0.05)
    return rig, move


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
@pytest.mark.parametrize('stopped', [SIDES, SIDES[:1]])
def test_a_movement_of_a_joint_does_not_go_on_after_a_stop_and_its_reset(valve, stopped):
    rig, move = moved_once(valve)
    for side in stopped:
        rig.drivers[side].emergency_stop()
    rig.run(3.0)
    for side in stopped:
        assert rig.drivers[side].reset()[0]
        rig.run(0.1)
    rig.run(3.0)
    # The muscle at fault was asked for a little, to see whether its driver follows.
    assert max(rig.gauge_pa[-1]) < 1e3 and rig.reasons[-1] == DROPPED
    assert max(max(pair) for pair in rig.gauge_pa[-600:]) < 60e3
    move()
    rig.run(2.0)
    assert rig.reasons[-1] == 'ok' and rig.angle_rad[-1] == pytest.approx(0.2, abs=0.05)


def test_a_joint_whose_sender_goes_on_is_moved_again():
    rig = FaultyJoint('ppr', lambda time_s: 0.2).run(1.5)
    rig.ask = lambda now_ns: ('joint_reference', AngleReference(now_ns, 0.2, 0.0))
    rig.drivers['flexor'].emergency_stop()
    rig.run(3.0)
    rig.drivers['flexor'].reset()
    rig.run(3.0)
    assert DROPPED not in rig.reasons
    assert rig.angle_rad[-1] == pytest.approx(0.2, abs=0.05)
