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

"""The PPR law: static inverse, clip, slew limit, compiled form."""

import math
import re

import numpy as np
from pam_actuation.drivers.ppr import OUTPUT, ppr_step, PprConfig, PprLaw, STATE
from pam_actuation.drivers.vented import check_vents
from pam_sim.errors import InputError
from pam_sim.records import fields, zeros
from pam_sim.units import P_ATM_PA
import pytest


@pytest.mark.parametrize('gauge_kpa, volts', [(0.0, 0.0), (300.0, 3.0), (600.0, 6.0)])
def test_static_inverse(gauge_kpa, volts):
    """100 kPa per volt, exactly at the check points."""
    assert PprLaw().step(P_ATM_PA + gauge_kpa * 1e3) == pytest.approx(volts, abs=1e-12)


def test_clips_and_says_so():
    """Outside 0..6 V the law clips and reports the side."""
    law = PprLaw()
    assert law.step(P_ATM_PA + 700e3) == 6.0 and law.saturated == 1
    assert law.step(0.0) == 0.0 and law.saturated == -1
    assert law.step(P_ATM_PA + 100e3) == pytest.approx(1.0) and law.saturated == 0


def test_gain_is_configurable():
    """Another regulator: 60 kPa per volt, 10 V."""
    law = PprLaw(PprConfig(gain_pa_per_v=60e3, highest_v=10.0))
    assert law.step(P_ATM_PA + 480e3) == pytest.approx(8.0)


def test_slew_limit():
    """At 20 V/s and 5 ms a step of 3 V takes 30 ticks and never overshoots."""
    law = PprLaw(PprConfig(slew_v_per_s=20.0))
    law.step(P_ATM_PA)
    volts = [law.step(P_ATM_PA + 300e3) for _ in range(40)]
    assert max(np.diff([0.0] + volts)) == pytest.approx(0.1)
    assert volts[28] < 3.0 - 1e-6 and volts[30] == pytest.approx(3.0) and max(volts) <= 3.0 + 1e-12


def test_a_command_of_the_atmosphere_is_not_slow():
    """A controller vents by it, also for a fault; it took 5 s from 500 kPa."""
    law = PprLaw(PprConfig(slew_v_per_s=1.0))
    law.step(P_ATM_PA + 500e3)
    assert law.step(P_ATM_PA + 100e3) == pytest.approx(4.995)      # a fall is limited
    assert law.step(P_ATM_PA) == 0.0
    assert law.step(P_ATM_PA + 500e3) == pytest.approx(0.005)
    law = PprLaw(PprConfig(slew_v_per_s=1.0, lowest_v=1.0, atmospheric_v=1.0))
    law.step(P_ATM_PA + 300e3)
    assert law.step(P_ATM_PA - 1.0, 0.01) == 1.0


def test_forced_signal_is_where_the_slew_limit_starts():
    """After venting the limit counts from 0 V."""
    law = PprLaw(PprConfig(slew_v_per_s=20.0))
    law.step(P_ATM_PA + 500e3)
    law.force(0.0)
    assert law.step(P_ATM_PA + 500e3) == pytest.approx(0.1)
    assert law.step(P_ATM_PA + 500e3, dt_s=0.020) == pytest.approx(0.5)


def test_compiled_step_is_the_law():
    """The compiled function gives the object's numbers to the bit."""
    config = PprConfig(slew_v_per_s=100.0)
    law, state, out = PprLaw(config), zeros(STATE), zeros(OUTPUT)
    for k in range(50):
        command = P_ATM_PA + 3e5 * math.sin(0.3 * k)
        ppr_step(state, config.par(), command, math.nan, math.nan, out)
        assert law.step(command) == fields(out, OUTPUT).signal_v


@pytest.mark.parametrize('numbers, left_kpa, words', [
    ({'lowest_v': -1.0, 'atmospheric_v': -1.0}, 100.0, (
        '0 V, the signal that vents, leaves 100 kPa gauge in the muscle, since ppr.atmospheric_v '
        'is -1 V; at most 10 kPa are allowed, which is a ppr.atmospheric_v of -0.1 V')),
    ({'atmospheric_v': -0.2}, 20.0, 'leaves 20 kPa gauge in the muscle'),
    ({'lowest_v': 2.0}, 200.0, (
        'ppr.lowest_v of 2 V is above ppr.atmospheric_v of 0 V and leaves 200 kPa gauge in a '
        'vented muscle; at most 10 kPa are allowed, which is a ppr.lowest_v of 0.1 V')),
    ({'lowest_v': 1.0, 'atmospheric_v': 0.85}, 15.0, 'which is a ppr.lowest_v of 0.95 V')])
def test_a_regulator_that_0_v_does_not_vent_is_refused(numbers, left_kpa, words):
    config = PprConfig(**numbers)
    assert config.left_gauge_pa == pytest.approx(1e3 * left_kpa)
    with pytest.raises(InputError, match=re.escape(words)):
        check_vents(config, 'here')


@pytest.mark.parametrize('numbers', [
    {}, {'lowest_v': 1.0, 'atmospheric_v': 1.0}, {'lowest_v': -5.0}, {'atmospheric_v': -0.1},
    {'lowest_v': 1.0, 'atmospheric_v': 1.0 - 10e3 / 75e3, 'gain_pa_per_v': 75e3},
    {'lowest_v': 1.0, 'atmospheric_v': 3.0}])
def test_a_regulator_that_0_v_vents_is_taken(numbers):
    check_vents(PprConfig(**numbers), 'here')


@pytest.mark.parametrize('command_pa', [math.nan, math.inf, -math.inf])
def test_a_command_that_is_not_finite_vents(command_pa):
    """Its volts were NaN, so what a valve output did was up to the output."""
    law = PprLaw(PprConfig(slew_v_per_s=1.0))
    law.step(P_ATM_PA + 500e3)
    assert law.step(command_pa) == 0.0
    assert law.step(P_ATM_PA + 500e3) == pytest.approx(0.005)       # and then it rises again
