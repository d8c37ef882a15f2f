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

"""What a controller does while its driver does not follow: it waits, and comes back calmly."""

import math
import random

from faulty_rig import FaultyRig, hold, slow_sine
from pam_actuation.control.following import CommandFollowing, FOLLOWS, LESS, MORE, UNKNOWN
from pam_actuation.messages import Pressure
from pam_sim.units import P_ATM_PA
import pytest

MS = 1_000_000
CONTROLLERS = {'ppr': ('sofc_ppr', 'pid', 'pid_plain', 'lqi', 'ilc_ppr', 'mpc_ppr'),
               'hsv': ('sofc_hsv', 'pid_hsv', 'pid_plain_hsv', 'lqi_hsv', 'ilc_hsv', 'mpc_hsv')}
EVERY = [(valve, name) for valve, names in CONTROLLERS.items() for name in names]


@pytest.mark.parametrize('valve, controller', EVERY)
def test_a_healed_pressure_sensor_brings_the_muscle_back_without_shooting_over(
        valve, controller):
    """An integral that winds up for 3 s moves the muscle 12 to 20 mm too far."""
    rig = FaultyRig(valve, controller).run(3.0, hold)
    rng = random.Random(controller)
    for fault in rng.sample(('nan', 'silent', 'past', 'future'), 2):
        rig.run(rng.uniform(0.2, 3.0), hold, fault, ('pressure',))
        assert rig.gauge_pa[-1] < 260e3                     # it is, or was being, vented
        rig.run(3.0 + rng.uniform(0.0, 0.1), hold)
    assert rig.excursion_m(3.0) < 1e-3
    assert max(rig.gauge_pa[750:]) < 440e3
    assert rig.error_m(0.5) < 5e-4


@pytest.mark.parametrize('valve', CONTROLLERS)
def test_a_controller_that_was_stopped_or_blind_comes_back_calmly(valve):
    for controller in CONTROLLERS[valve][:2]:
        rig = FaultyRig(valve, controller).run(9.3, slow_sine)
        before = rig.excursion_m(4.0)
        rig.run(1.3, slow_sine, 'stopped')
        rig.run(3.6, slow_sine)
        rig.run(0.5, slow_sine, 'nan', ('contraction',))
        rig.run(4.0, slow_sine)
        assert rig.excursion_m(9.3) < before + 1e-3


@pytest.mark.parametrize('valve, controller, at_s, lasts_s', [
    ('hsv', 'pid_hsv', 6.13, 0.9), ('ppr', 'pid', 6.21, 2.7)])
def test_an_integral_does_not_remember_the_way_back_to_a_moving_reference(
        valve, controller, at_s, lasts_s):
    """One that grows on that error moves the muscle 0.6 and 1.1 mm too far."""
    rig = FaultyRig(valve, controller).run(at_s, slow_sine)
    before = rig.excursion_m(3.0)
    rig.run(lasts_s, slow_sine, 'stopped')
    rig.run(2.0, slow_sine)
    assert rig.excursion_m(at_s) < before + 4e-4


def test_a_driver_that_does_not_tell_is_known_by_the_pressure_it_lost():
    rig = FaultyRig('ppr', 'pid', tells=False).run(4.0, hold)
    before_pa = rig.internals['integral_pa']
    rig.run(3.0, hold, 'nan', ('pressure',))
    assert rig.internals['held_back'] == UNKNOWN
    assert abs(rig.internals['integral_pa'] - before_pa) < 500.0


@pytest.mark.parametrize('valve, controller', EVERY)
def test_a_controller_that_its_driver_does_not_hear_yet_does_not_wind_up(valve, controller):
    """Two processes need up to 3 s to find each other; a PID went to 600 kPa meanwhile."""
    rig = FaultyRig(valve, controller).run(2.5, hold, 'apart').run(4.0, hold)
    assert rig.excursion_m(0.0) < 2e-3
    assert max(rig.gauge_pa) < 450e3


@pytest.mark.parametrize('valve', CONTROLLERS)
def test_both_sensors_frozen_in_motion_are_noticed(valve):
    """The pressure that should have moved the muscle is that of the driver, not the reading."""
    for controller in CONTROLLERS[valve][:2]:
        rig = FaultyRig(valve, controller).run(5.3, slow_sine)
        rig.reasons.clear()
        rig.run(2.0, slow_sine, 'frozen', ('pressure', 'contraction'))
        assert any('stands still' in reason for reason in rig.reasons), controller
        assert rig.gauge_pa[-1] < 50e3


class Told:
    """A judge with a controller at 200 Hz and a driver that tells."""

    def __init__(self):
        self.judge, self.now_ns = CommandFollowing(), 10_000 * MS

    def run(self, ticks, command_pa, followed_pa=None, pressure_pa=P_ATM_PA + 2e5):
        for _ in range(ticks):
            self.now_ns += 5 * MS
            found = self.judge.judge(self.now_ns, pressure_pa)
            self.judge.sent(self.now_ns, command_pa)
            if followed_pa is not None:
                self.judge.on_followed(Pressure(self.now_ns, followed_pa))
        return found


def test_what_a_driver_does_is_judged_by_the_commands_of_just_before():
    told = Told()
    assert told.run(5, P_ATM_PA + 3e5) == FOLLOWS               # never told: trusted
    assert told.run(5, P_ATM_PA + 3e5, P_ATM_PA + 3e5) == FOLLOWS
    assert told.run(3, P_ATM_PA + 3.1e5, P_ATM_PA + 3e5) == FOLLOWS     # on its way
    assert told.run(20, P_ATM_PA + 3.1e5, P_ATM_PA + 3e5) == LESS
    assert told.run(20, P_ATM_PA + 3.1e5, P_ATM_PA) == LESS     # it vents
    assert told.run(20, P_ATM_PA - 1e4, P_ATM_PA) == FOLLOWS    # there is nothing below
    assert told.run(20, P_ATM_PA + 1e5, P_ATM_PA + 4e5) == MORE
    assert told.run(25, P_ATM_PA + 1e5) == UNKNOWN              # it fell silent
    told.judge.forget()
    assert told.run(2, P_ATM_PA + 1e5) == FOLLOWS
    assert told.run(1, P_ATM_PA + 1e5, pressure_pa=math.nan) == UNKNOWN
    told.judge.on_followed(Pressure(told.now_ns, math.nan))     # not a word
    assert not told.judge.told
