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

"""A driver whose pressure limit is below that of the controller: it is found, told and kept to."""

import math

from faulty_joint import FaultyJoint
from faulty_rig import FaultyRig
from pam_actuation.control.driver_limit import BEYOND_PA, DriverLimit, STANDS_NS
from pam_actuation.control.modes.joint_statics import pair_of
from pam_actuation.control.tick import LIMIT
from pam_actuation.drivers.limits import SafetyLimits
from pam_actuation.messages import NamedEfforts
from pam_sim.units import P_ATM_PA
import pytest

MS_NS = 1_000_000
LIMIT_GAUGE_PA = 300e3
OF_DRIVER = {'max_pressure_gauge_pa': LIMIT_GAUGE_PA}


def told(limit, pressures_pa, cut=True, begin_ns=0):
    """Tell a limit what a driver follows, every 5 ms; return the limits after each."""
    found = []
    for k, pressure_pa in enumerate(pressures_pa):
        limit.look(begin_ns + k * 5 * MS_NS, pressure_pa, cut)
        found.append(limit.limit_pa)
    return found


def test_a_pressure_that_stands_still_below_the_commands_is_the_limit():
    found = told(DriverLimit(), [4e5] * 100)
    ticks = STANDS_NS // (5 * MS_NS)
    assert all(map(math.isnan, found[:ticks])) and found[ticks + 1:] == [4e5] * (99 - ticks)


@pytest.mark.parametrize('pressures_pa', [
    [P_ATM_PA] * 200,                                   # it vents
    [P_ATM_PA + 2500.0 * k for k in range(200)],        # it rises slowly
    [5e5 + 300.0 * math.sin(k) for k in range(200)],    # its supply is weak
    [math.nan] * 200])                                  # it tells nothing
def test_a_driver_that_vents_or_rises_has_no_limit(pressures_pa):
    assert all(map(math.isnan, told(DriverLimit(), pressures_pa)))


def test_the_end_of_a_limit_is_seen_at_a_command_just_above():
    limit = DriverLimit()
    assert told(limit, [4e5] * 100)[-1] == 4e5
    assert told(limit, [3e5, 4e5], False, 500 * MS_NS) == [4e5] * 2
    assert math.isnan(told(limit, [4e5 + BEYOND_PA], False, 510 * MS_NS)[-1])


@pytest.mark.parametrize('difference_pa', [-4e5, -1.5e5, 0.0, 5e4, 1e5, 4e5])
def test_a_pair_gives_up_its_co_contraction_before_its_difference(difference_pa):
    low, high, limit = P_ATM_PA, P_ATM_PA + 6e5, P_ATM_PA + 3e5
    flexor_pa, extensor_pa = pair_of(
        P_ATM_PA + 3e5 + difference_pa, P_ATM_PA + 3e5, low, high, limit)
    assert low - 1e-6 <= min(flexor_pa, extensor_pa)
    assert max(flexor_pa, extensor_pa) == pytest.approx(limit)
    assert flexor_pa - extensor_pa == pytest.approx(
        min(max(2.0 * difference_pa, -3e5), 3e5), abs=1e-3)


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_a_joint_gets_as_near_as_the_limit_of_its_drivers_lets_it(valve):
    """It may not stand at 0.02 rad with 300 kPa in both muscles and say that all is well."""
    joint = FaultyJoint(valve, lambda time_s: min(0.1 * time_s, 0.2), of_driver=OF_DRIVER)
    joint.run(6.0)
    assert abs(joint.angle_rad[-1] - 0.2) < 0.01
    assert max(joint.commands_pa[-1]) <= P_ATM_PA + LIMIT_GAUGE_PA + BEYOND_PA
    assert joint.reasons[-1].startswith('ok; flexor/valve_driver limits its command to 300 kPa')
    assert 'set max_pressure_gauge_pa of the controller to 300000' in joint.reasons[-1]
    joint.wanted = lambda time_s: -0.1
    joint.run(3.0)
    assert abs(joint.angle_rad[-1] + 0.1) < 0.01


def test_a_torque_is_given_within_the_limit_of_the_drivers():
    joint = FaultyJoint('ppr', of_driver=OF_DRIVER)
    joint.ask = lambda now_ns: ('joint_effort', NamedEfforts(now_ns, ('muscle',), (0.1,)))
    joint.run(3.0)
    values = dict(zip(joint.state.names, joint.state.values))
    flexor_pa, extensor_pa = joint.commands_pa[-1]
    assert flexor_pa <= P_ATM_PA + LIMIT_GAUGE_PA + BEYOND_PA
    assert abs(values['measured_torque_n_m'] - 0.1) < 0.02
    assert extensor_pa < P_ATM_PA + 250e3


@pytest.mark.parametrize('valve, controller', [
    ('ppr', 'sofc_ppr'), ('ppr', 'pid'), ('ppr', 'mpc_ppr'), ('ppr', 'lqi'),
    ('hsv', 'sofc_hsv'), ('hsv', 'lqi_hsv')])
def test_a_single_muscle_saturates_at_the_limit_of_its_driver(valve, controller):
    rig = FaultyRig(valve, controller, of_driver={'max_pressure_gauge_pa': 350e3})
    rig.run(3.0, lambda time_s: (0.008, 0.0))
    assert rig.internals[LIMIT] == pytest.approx(P_ATM_PA + 350e3 + BEYOND_PA)
    assert rig.internals['command_pa'] <= rig.internals[LIMIT]
    assert min(rig.gauge_pa[-100:]) > 340e3
    assert any('valve_driver limits its command to 350 kPa' in one for one in rig.reasons)
    rig.run(2.0, lambda time_s: (0.004, 0.0))       # it has not wound up
    assert rig.error_m(0.5) < 1e-3


def test_a_limit_that_is_gone_is_forgotten():
    joint = FaultyJoint('ppr', lambda time_s: min(0.1 * time_s, 0.3), of_driver=OF_DRIVER)
    joint.run(4.0)
    assert 'limits its command' in joint.reasons[-1]
    for driver in joint.drivers.values():
        driver.safety.limits = SafetyLimits()
    joint.run(4.0)
    assert joint.reasons[-1] == 'ok' and abs(joint.angle_rad[-1] - 0.3) < 0.005
