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

"""A pressure sensor that is dead but noisy behind on/off valves, and sound ones on odd rigs."""

import math
import random

from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.messages import Pressure
from pam_sim import load_rig
from pam_sim.units import P_ATM_PA
import pytest

MS = 1_000_000
START = 1_700_000_000_000_000_000
SAFE = (0.0, 1.0)
RIG = """
rig: {preset}
valve: hsv
parameters: {{vent_intake: 1.0}}
effects:
  - name: valve_dead_time
    parameters: {{delay_s: {delay_s}}}
  - name: valve_dead_zone
    parameters: {{open_time_s: {open_s}, close_time_s: 2.0e-3}}
  - name: leakage
    parameters: {{conductance_m3_per_s_pa: {leak}}}
"""


class Bench:
    """The realistic rig, its driver, and a sensor whose readings may be spoiled."""

    def __init__(self, volume=1.0, conductance=1.0, period_ms=4, late_ms=0, noise_pa=100.0,
                 preset='dmsp_5_300_hanging_mass', seed=1, **effects):
        """Start at rest. Volume and conductance of the rig are so many times those told."""
        told = load_rig('dmsp_5_300_realistic', valve='hsv')
        if volume != 1.0 or effects:
            told = load_rig(RIG.format(preset=preset, delay_s=0.03, open_s=1.7e-3, leak=0.0))
        rig = load_rig(RIG.format(**{
            'preset': preset, 'delay_s': 0.03, 'open_s': 1.7e-3, 'leak': 0.0, **effects}))
        usual = driver_config(told, {}).as_parameters()
        changes = {f'hsv.{name}': usual[f'hsv.{name}'] / volume for name in (
            'volume_m3', 'volume_slope_m3_per_pa', 'volume_at_600kpa_m3',
            'volume_slope_m3_per_m')}
        name = 'hsv.conductance_m3_per_s_pa'
        self.loop = DriverLoop('hsv', driver_config(
            told, {**changes, name: usual[name] / conductance}))
        self.plant = rig.plant(seed)
        self.period_ms, self.late_ms, self.noise_pa = period_ms, late_ms, noise_pa
        self.draw = random.Random(seed)
        self.ms, self.efforts = 0, SAFE
        self.kpa, self.statuses = [], []
        self.command_kpa = lambda time_s: 200.0
        self.reads = lambda sound_pa: sound_pa
        self._under_way = []

    def run(self, seconds):
        """Go on; return the last status."""
        for self.ms in range(self.ms + 1, self.ms + 1 + round(1e3 * seconds)):
            self.plant.step(self.efforts)
            now = START + self.ms * MS
            self.kpa.append(1e-3 * (self.plant.pressure_pa - P_ATM_PA))
            if self.ms % self.period_ms == 0:
                reading_pa = self.reads(self.plant.pressure_pa)
                self._under_way.append((self.ms + self.late_ms, Pressure(
                    now, reading_pa + self.draw.gauss(0.0, self.noise_pa))))
            while self._under_way and self._under_way[0][0] <= self.ms:
                self.loop.on_pressure(self._under_way.pop(0)[1])
            if self.ms % 5 == 0:
                self.loop.on_command(Pressure(
                    now, P_ATM_PA + 1e3 * self.command_kpa(1e-3 * self.ms)))
            if self.ms % 10 == 0:
                signal, status = self.loop.tick(now)
                self.efforts = signal.efforts
                self.statuses.append(status)
        return self.statuses[-1]

    def faults(self):
        """Return what the driver said at the error level."""
        return {status.message for status in self.statuses if status.level >= 2}


@pytest.mark.parametrize('stuck_kpa, command_kpa, noise_pa', [
    (0.0, 200.0, 20.0), (0.0, 200.0, 300.0), (0.0, 400.0, 20.0), (150.0, 200.0, 300.0),
    (175.0, 200.0, 20.0), (120.0, 200.0, 1000.0)])
def test_a_dead_sensor_with_noise_vents_before_the_limit(stuck_kpa, command_kpa, noise_pa):
    """It filled to the supply, 700 kPa, and said that it follows the command."""
    bench = Bench()
    bench.command_kpa = lambda time_s: command_kpa
    assert bench.run(3.0).level == 0
    bench.reads, bench.noise_pa = lambda sound_pa: P_ATM_PA + 1e3 * stuck_kpa, noise_pa
    bench.run(1.2)
    assert bench.efforts == SAFE and max(bench.kpa) < 600.0 and bench.kpa[-1] < 100.0
    values = dict(bench.statuses[-1].values)
    assert bench.statuses[-1].level == 2 and values['fault'] == 'pressure_unmoved'
    assert 'pressure sensor dead, no air supply' in bench.statuses[-1].message
    bench.run(10.0)
    assert max(bench.kpa) < 600.0


def test_a_sensor_that_was_never_alive_is_tried_five_times():
    """Each slow rise ends early; then it latches."""
    bench = Bench()
    bench.reads, bench.noise_pa = lambda sound_pa: P_ATM_PA, 20.0
    bench.run(30.0)
    assert max(bench.kpa) < 300.0 and bench.efforts == SAFE
    assert dict(bench.statuses[-1].values)['fault'] == 'pressure_relapses'
    bench.reads = lambda sound_pa: sound_pa
    assert bench.run(1.0).level == 2
    assert bench.loop.reset()[0]
    assert bench.run(3.0).level == 0 and bench.kpa[-1] == pytest.approx(200.0, abs=5.0)


def test_a_sensor_that_comes_back_is_followed_after_five_seconds():
    bench = Bench()
    bench.run(3.0)
    bench.reads = lambda sound_pa: P_ATM_PA
    assert bench.run(0.5).level == 2
    bench.reads = lambda sound_pa: sound_pa
    assert bench.run(4.5).level == 2
    assert bench.run(3.0).level == 0 and bench.kpa[-1] == pytest.approx(200.0, abs=5.0)


def _steps(time_s):
    return (50.0, 400.0, 120.0, 550.0, 20.0, 300.0)[int(time_s / 1.5) % 6]


def _sine(time_s):
    return 280.0 + 250.0 * math.sin(6.0 * time_s)


@pytest.mark.parametrize('command', [_steps, _sine])
@pytest.mark.parametrize('rig', [
    {'volume': 4.0, 'conductance': 0.5}, {'volume': 0.5, 'conductance': 2.0},
    {'volume': 4.0, 'conductance': 0.5, 'period_ms': 20, 'noise_pa': 1000.0},
    {'period_ms': 20, 'late_ms': 50, 'noise_pa': 1000.0},
    {'volume': 2.0, 'late_ms': 20, 'delay_s': 0.05}, {'open_s': 2.6e-3},
    {'volume': 2.0, 'open_s': 2.6e-3, 'noise_pa': 1000.0}, {'leak': 5e-13},
    {'preset': 'dmsp_5_300_isometric', 'volume': 4.0, 'leak': 3e-13}])
def test_a_sound_sensor_on_an_odd_rig_is_no_fault(rig, command):
    """Volume, conductance, leak, dead zone and sensor are unlike what the driver is told."""
    bench = Bench(**rig)
    bench.command_kpa = command
    bench.run(9.0)
    assert bench.faults() == set() and max(bench.kpa) > 100.0


def test_valves_that_swallow_short_pulses_are_tried_with_long_ones():
    """The command is reached all the same: a reading that answers to them is sound."""
    bench = Bench(open_s=3.2e-3)
    assert bench.run(4.0).level == 0
    assert bench.faults() == set() and bench.kpa[-1] > 150.0


def test_a_command_of_the_atmosphere_opens_the_vent_whatever_is_measured():
    """A controller vents by it. With a dead sensor both valves stayed shut, at 600 kPa."""
    bench = Bench()
    bench.run(2.0)
    bench.command_kpa = lambda time_s: 0.0
    bench.reads = lambda sound_pa: P_ATM_PA
    bench.run(0.15)
    assert bench.efforts == SAFE and dict(bench.statuses[-1].values)['state'] == 'ok'
    bench.run(1.5)
    assert bench.efforts == SAFE and bench.kpa[-1] < 5.0
    bench.command_kpa, bench.reads = lambda time_s: 150.0, lambda sound_pa: sound_pa
    bench.run(2.0)
    assert bench.faults() == set() and bench.kpa[-1] == pytest.approx(150.0, abs=3.0)


def test_a_sensor_that_reads_too_little_leaves_nothing_behind():
    bench = Bench()
    bench.reads = lambda sound_pa: sound_pa - 15e3
    bench.command_kpa = lambda time_s: 200.0 if time_s < 3.0 else 0.0
    bench.run(6.0)
    assert bench.kpa[-1] < 2.0
