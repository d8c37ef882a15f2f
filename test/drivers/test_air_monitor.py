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

"""Air that is gone: noticed in time, never where a valve is only slow, and back without a jolt."""

import math
from pathlib import Path
import sys

import numpy as np
from pam_actuation.drivers.hsv import HsvLaw
from pam_actuation.drivers.hsv_config import HsvConfig
from pam_actuation.drivers.monitors import AirMonitor
from pam_sim.units import P_ATM_PA
import pytest

sys.path.append(str(Path(__file__).resolve().parent.parent / 'control'))

from faulty_rig import FaultyRig, hold, slow_sine  # noqa: E402, I100

LAG_S, DEAD_S, TICK_S = 0.06, 0.03, 0.005


def noticed_at_s(commands, lag_s=LAG_S, dead_s=DEAD_S, gone_s=math.inf, fastest=math.inf):
    """Return the times [s] at which a monitor misses the air, behind such a regulator."""
    monitor, pressure_pa, times = AirMonitor(LAG_S, DEAD_S), P_ATM_PA, []
    noise = 300.0 * np.random.default_rng(1).standard_normal(len(commands))
    late = round(dead_s / TICK_S)
    for k, command_pa in enumerate(commands):
        aim_pa = commands[k - late] if k >= late else P_ATM_PA
        if k * TICK_S >= gone_s:
            aim_pa = P_ATM_PA
        change = (aim_pa - pressure_pa) * (1.0 - math.exp(-TICK_S / lag_s))
        pressure_pa += min(max(change, -fastest * TICK_S), fastest * TICK_S)
        if monitor.missing(command_pa, pressure_pa + noise[k], TICK_S):
            times.append(k * TICK_S)
    return times


def moving_commands(rng, count=2000):
    """Return steps, holds and sines between 0 and 600 kPa gauge, absolute [Pa]."""
    steps = np.repeat(rng.uniform(0.0, 6e5, count // 50), 50)
    time_s = TICK_S * np.arange(count)
    sines = 1e5 * np.sin(2.0 * np.pi * rng.uniform(0.2, 5.0) * time_s)
    return P_ATM_PA + np.clip(steps + sines, 0.0, 6e5)


@pytest.mark.parametrize('slower', [0.6, 1.0, 1.4])
def test_no_command_and_no_slower_regulator_is_taken_for_one_without_air(slower):
    rng = np.random.default_rng(round(10 * slower))
    for fastest in (math.inf, 8e5):
        assert not noticed_at_s(moving_commands(rng), slower * LAG_S, slower * DEAD_S,
                                fastest=fastest)


@pytest.mark.parametrize('gauge_pa', [1.5e5, 4e5, 6e5])
def test_air_that_is_gone_is_noticed_in_time_and_until_it_is_back(gauge_pa):
    found = noticed_at_s(np.full(400, P_ATM_PA + gauge_pa), gone_s=1.0)
    assert 1.0 < found[0] < 1.15
    late = [time_s for time_s in found if time_s > 1.6]       # empty by then
    assert len(late) == 400 - math.floor(1.6 / TICK_S) - 1


def test_one_wrong_reading_or_none_at_all_is_no_missing_air():
    monitor = AirMonitor(LAG_S, DEAD_S)
    for k in range(200):
        reading = (4e5, 1.2e5, math.nan)[(k % 20 == 7) + 2 * (k % 20 == 11)]
        assert not monitor.missing(5e5 - 1e4, reading + 8e4, TICK_S)


@pytest.mark.parametrize('controller', ['pid', 'sofc_ppr'])
def test_a_muscle_whose_air_comes_back_does_not_pass_its_reference(controller):
    rig = FaultyRig('ppr', controller).run(3.0, hold)
    rig.run(0.2, hold, 'no_supply').run(1.5, hold)
    assert min(rig.gauge_pa[750:]) < 5e4          # it was empty
    assert rig.excursion_m(3.0) < 0.5e-3


def test_on_off_valves_vent_and_hold_without_supply():
    law, muscle_pa = HsvLaw(HsvConfig()), P_ATM_PA + 3e5
    for wanted_pa in [muscle_pa] * 50 + [muscle_pa + 1e5] * 50:
        fill, vent = law.step(wanted_pa, muscle_pa, P_ATM_PA)
        assert vent == 0.0          # what is there stays, even if more is wanted
    _, vent = law.step(P_ATM_PA + 1e5, muscle_pa, P_ATM_PA)
    assert vent > 0.5


def test_a_motion_goes_on_within_its_bounds_once_the_supply_of_a_pair_is_back():
    rig = FaultyRig('hsv', 'pid_hsv').run(3.1, slow_sine)
    rig.run(0.8, slow_sine, 'no_supply')
    assert rig.error_m(0.2) > 2e-3          # it could not follow
    rig.run(2.0, slow_sine)
    assert rig.excursion_m(3.1) < 1e-3 and rig.error_m(0.5) < 1e-3
