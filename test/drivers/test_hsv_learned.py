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
"""The driver of a pair that learns its valves' pulses and is told how the muscle moves."""

import math

import numpy as np
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.hsv import HsvLaw
from pam_actuation.drivers.hsv_learned import learned_opening, sheet_opening
from pam_actuation.drivers.hsv_model import STATE
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.messages import Contraction, Pressure
import pam_sim
from pam_sim.records import cells
from pam_sim.units import P_ATM_PA
import pytest

PULSES = {'hsv.pulse_noise_pa': 600.0, 'hsv.pulse_margin_s': 0.0006}
MOTION = {'hsv.correct_by_contraction': 0.8}
NOISE_PA, NOISE_M = 300.0, 1e-5
MS = 1_000_000


@pytest.fixture(scope='module')
def nominal():
    """Return the rig the driver is told of."""
    return pam_sim.load_rig('dmsp_5_300_realistic', valve='hsv')


def follow(nominal, changes, rig=None, seen=lambda t_s, x_m: x_m, seconds=10.0, age_ms=0):
    """
    Follow two sines; return (law, error of the prediction, tracking error) [Pa, rms].

    Both from the middle on. The command is followed 45 ms later. ``age_ms``: of the contraction.
    """
    plant, law = (rig or nominal).plant(1), HsvLaw(driver_config(nominal, changes).hsv)
    noise = np.random.default_rng(5)
    truth, told, wanted, moved_m = [], [], [], [plant.contraction_m] * 10
    for k in range(round(100 * seconds)):
        t_s = 0.01 * k
        wanted.append(P_ATM_PA + 380e3 + 60e3 * math.sin(5.0 * t_s) + 25e3 * math.sin(2.3 * t_s))
        duty = law.step(wanted[-1], plant.pressure_pa + NOISE_PA * noise.standard_normal(),
                        contraction_m=seen(t_s, moved_m[-1 - age_ms]
                                           + NOISE_M * noise.standard_normal()),
                        contraction_age_s=1e-3 * age_ms)
        told.append(law.predicted_pa)
        for _ in range(10):
            truth.append(plant.pressure_pa)
            plant.step(duty)
            moved_m.append(plant.contraction_m)
    half = len(told) // 2
    at = 10 * np.arange(half, len(told) - 5)
    truth = np.array(truth)
    # The law knows the dead time to some ms only.
    predicted = min(np.std(truth[at + ms] - np.array(told)[half:-5]) for ms in range(26, 36))
    return law, predicted, np.std(truth[at + 45] - np.array(wanted)[half:-5])


def test_the_openings_of_a_pulse_there_and_back():
    """What is learned is added to a pulse, and taken off again; shut and open stay as they are."""
    law = HsvLaw()
    state = cells(law.state, STATE)
    state.fill_gain[...], state.fill_more[...] = 1.25, -0.05
    seen = law.state.view(STATE)[0]
    assert learned_opening(seen, 0.3, True) == pytest.approx(0.26)
    assert sheet_opening(seen, 0.26, True) == pytest.approx(0.3)
    assert learned_opening(seen, 0.3, False) == 0.3
    ends = [learned_opening(seen, opening, True) for opening in (0.0, 0.01, 1.0)]
    assert ends == [0.0, 0.0, 1.0]


def test_a_valve_unlike_its_data_sheet_is_learned(nominal):
    """Conductance up by 30 %, another switching time: predicted as well as at home."""
    effects = [{'name': item.name, 'parameters': {'open_time_s': 1.3e-3, 'close_time_s': 2.2e-3}
                if item.name == 'valve_dead_zone' else item.parameters}
               for item in nominal.effects]
    other = nominal.with_(
        parameters={'C': 1.3 * nominal.parameters['C']}, effects=effects)
    _, before_pa, _ = follow(nominal, MOTION, other)
    law, after_pa, _ = follow(nominal, {**PULSES, **MOTION}, other)
    _, home_pa, _ = follow(nominal, {**PULSES, **MOTION})
    assert after_pa < 0.7 * before_pa
    assert after_pa < 1.35 * home_pa
    state = cells(law.state, STATE)
    # What counts is what a pulse does: 30 % more flow for 0.6 ms longer.
    for gain, more in ((state.fill_gain, state.fill_more), (state.vent_gain, state.vent_more)):
        assert gain.item() * 0.3 + more.item() == pytest.approx(1.3 * 0.36, rel=0.12)


def test_a_measured_contraction_tells_the_volume(nominal):
    """With it the prediction is better by a third at least, and without as it was."""
    _, without_pa, _ = follow(nominal, PULSES)
    _, with_pa, _ = follow(nominal, {**PULSES, **MOTION})
    assert with_pa < 0.66 * without_pa
    _, lost_pa, _ = follow(nominal, {**PULSES, **MOTION}, seen=lambda t_s, x_m: math.nan)
    assert lost_pa == without_pa


@pytest.mark.parametrize('seen', [
    lambda t_s, x_m: 0.02, lambda t_s, x_m: x_m + (0.01 if t_s > 6.0 else 0.0),
    lambda t_s, x_m: 1e6 * (-1.0) ** round(100 * t_s)], ids=['frozen', 'jumped', 'wild'])
def test_a_wrong_contraction_moves_the_pressure_little(nominal, seen):
    """A sensor that stands still, jumps or runs wild: the measured pressure still leads."""
    _, _, right_pa = follow(nominal, {**PULSES, **MOTION})
    _, _, wrong_pa = follow(nominal, {**PULSES, **MOTION}, seen=seen)
    assert wrong_pa < right_pa + 4e3


def test_the_driver_takes_a_contraction_only_where_it_counts(nominal):
    """Topics by configuration; a reading that is old or comes late in order is dropped."""
    usual, told = (DriverLoop('hsv', driver_config(nominal, changes)) for changes in ({}, MOTION))
    assert 'contraction' not in usual.takes() and 'contraction' in told.takes()
    assert 'contraction' not in DriverLoop('ppr').takes()
    used = []
    law = told.law
    step = law.step
    law.step = lambda *given: used.append(given[4]) or step(*given)
    for k, (stamps_ms, x_m) in enumerate((
            ((0,), 0.001), ((9, 3), 0.002), ((), 0.0), ((-200,), 0.003), ((90,), 0.004),
            ((50,), math.nan))):
        now = (k * 10 + 1000) * MS
        told.on_pressure(Pressure(now, 2e5))
        told.on_command(Pressure(now, 2e5), k)
        for stamp_ms in stamps_ms:
            told.on_contraction(Contraction((1000 + stamp_ms) * MS, x_m + 1e-6 * stamp_ms))
        told.act(now)
    assert used[:2] == [0.001, pytest.approx(0.002009)]
    assert all(math.isnan(x_m) for x_m in used[2:])


def test_a_contraction_nearly_a_period_old_tells_as_much_as_a_new_one(nominal):
    """What an old reading says of the rate has moved the volume meanwhile."""
    new, old = (follow(nominal, {**PULSES, **MOTION}, age_ms=age_ms)[1] for age_ms in (0, 9))
    assert old < 1.15 * new
