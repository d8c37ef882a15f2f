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

"""A muscle that keeps its pressure while the driver empties it is told, for both valves."""

import numpy as np
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.messages import Pressure
from pam_sim import load_rig
from pam_sim.units import P_ATM_PA
import pytest

MS = 1_000_000
START = 1_700_000_000_000_000_000
LEVEL_ERROR = 2


class Bench:
    """A rig with its driver at 100 or 200 Hz; a stuck valve leaves the pressure where it is."""

    def __init__(self, valve, **muscle):
        rig = load_rig(muscle.get('preset', 'dmsp_5_300_realistic'), valve=valve)
        self.loop, self.plant = DriverLoop(valve, driver_config(rig)), rig.plant(seed=1)
        self.now_ns, self.is_stuck = START, False
        self.random = np.random.default_rng(1)

    def run(self, seconds, gauge_pa):
        """Follow a command for a while; return the statuses."""
        period_ms = round(self.loop.period_s * 1e3)
        told = []
        for _ in range(round(seconds * 1e3 / period_ms)):
            self.loop.on_pressure(Pressure(
                self.now_ns, self.plant.pressure_pa + 100.0 * self.random.standard_normal()))
            self.loop.on_command(Pressure(self.now_ns, P_ATM_PA + gauge_pa))
            signal, status = self.loop.tick(self.now_ns)
            told.append(status)
            if not self.is_stuck:
                for _ in range(period_ms):
                    self.plant.step(signal.efforts)
            self.now_ns += period_ms * MS
        return told


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_a_valve_that_is_stuck_is_told_with_what_to_do(valve):
    bench = Bench(valve)
    assert {one.level for one in bench.run(3.0, 3e5)[20:]} == {0}
    bench.is_stuck = True
    told = bench.run(2.0, 1e5)
    assert told[0].level == 0
    assert told[-1].level == LEVEL_ERROR and 'stays at 30' in told[-1].message
    assert 'shut the supply and open the dump valve' in told[-1].message
    since = next(i for i, one in enumerate(told) if one.level == LEVEL_ERROR)
    assert 1.0 <= since * bench.loop.period_s < 1.2
    # Also while the driver vents for another reason, and until the pressure falls.
    bench.loop.emergency_stop()
    assert all('stays at 30' in one.message for one in bench.run(1.0, 1e5))
    bench.is_stuck = False
    assert 'stays at' not in bench.run(1.0, 1e5)[-1].message


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
@pytest.mark.parametrize('preset', ['dmsp_5_300_realistic', 'dmsp_40_300_hanging_mass'])
def test_a_muscle_that_empties_slowly_is_not(valve, preset):
    bench = Bench(valve, preset=preset)
    bench.run(8.0, 5e5)
    assert all('stays at' not in one.message for one in bench.run(8.0, 0.0))
