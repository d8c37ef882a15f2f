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

"""From where the next experiment is predicted, and how an interval is told."""

from made_records import record, RIG
import numpy as np
from pam_sim import load_rig
from pam_sim.identify.advice import next_experiment, proposals, where_open
from pam_sim.identify.judgement import (
    _combinations, DETERMINED, is_at_edge, TOGETHER, UNDETERMINED)
from pam_sim.identify.numbers import unknown_numbers
from pam_sim.identify.profile import Interval
from pam_sim.identify.records import offer_of
from pam_sim.identify.result import Found
from pam_sim.units import P_ATM_PA
import pytest

MASS, MAP, SPRING = unknown_numbers(RIG, ['mass_kg', 'force_map_gain', 'spring_n_per_m'])
LIFTS, GAIN = 0.3, 1.1


@pytest.mark.parametrize('status', [DETERMINED, TOGETHER, UNDETERMINED])
@pytest.mark.parametrize('low, high', [(0.2, 30.0), (2.0 * MASS.start, 4.0 * MASS.start)])
def test_a_load_that_is_about_to_lift_tells_nothing_of_its_mass(status, low, high):
    """Where it lifts the curvature is large, though the interval is wide."""
    x = np.array([MASS.coordinate(LIFTS), MAP.coordinate(GAIN)])
    information = np.array([[1e6, 10.0], [10.0, 4.0]])
    at, seen = where_open(
        [MASS, MAP], [Interval(*ends, False, False, ()) for ends in ((low, high), (0.9, 1.3))],
        [status, UNDETERMINED], x, information)
    kept = status != UNDETERMINED
    assert MASS.value(at[0]) == pytest.approx(
        LIFTS if kept else min(max(MASS.start, low), high))
    assert (seen[0, 0], seen[0, 1], seen[1, 0]) == ((1e6, 10.0, 10.0) if kept else (0.0,) * 3)
    # The other one is as little known as its curvature says: it stays.
    assert MAP.value(at[1]) == pytest.approx(GAIN) and seen[1, 1] == 4.0
    assert x[0] == MASS.coordinate(LIFTS) and information[0, 0] == 1e6


@pytest.mark.parametrize('rig, recorded_pa, first_pa, last_pa', [
    (RIG, 600e3, 500e3, 500e3), (RIG, 495e3, 495e3, 495e3), (RIG, 120e3, 120e3, 500e3),
    (RIG.with_(parameters={'K_m': 50e3}), 600e3, 300e3, 300e3),
    (load_rig('dmsp_5_300_hanging_mass', valve='hsv').with_(
        parameters={'supply_pa': P_ATM_PA + 350e3}), 100e3, 100e3, 350e3)])
def test_what_goes_above_the_recorded_pressure_comes_last_and_says_so(
        rig, recorded_pa, first_pa, last_pa):
    found = proposals(rig, False, recorded_pa)
    highest = [max(pressure for pressure, _ in one.steps) for one in found]
    assert highest == pytest.approx(sorted(highest)) and (
        highest[0], highest[-1]) == pytest.approx((first_pa, last_pa))
    for one, pa in zip(found, highest):
        assert ('the recordings stayed below' in one.why) == (pa > first_pa + 1.0)
        assert min(duration for _, duration in one.steps) > 0.0
    if last_pa > first_pa:
        assert f'up to {1e-3 * last_pa:.0f} kPa gauge; the recordings stayed below ' \
               f'{1e-3 * recorded_pa:.0f} kPa' in found[-1].why


def test_an_experiment_that_would_not_lift_the_load_is_not_the_next_one():
    low = record(RIG, gauge_pa=(0.0, 60e3, 20e3), keep=('pressure', 'contraction'))
    for valve in ('ppr', 'hsv'):
        rig = load_rig('dmsp_5_300_hanging_mass', valve=valve)
        found = next_experiment(rig, [MAP], [], np.zeros((0, 0)), [offer_of(low, RIG)], True)
        assert found['determines'] == ['force_map_gain']
        assert 'the recordings stayed below' in found['why']


def test_no_experiment_is_proposed_for_what_is_determined():
    run = record(RIG, gauge_pa=(50e3, 400e3, 100e3), keep=('pressure', 'contraction'))
    every = [MASS, MAP, SPRING]
    given = RIG, every, [], np.zeros((0, 0)), [offer_of(run, RIG)], False
    first = next_experiment(*given)
    assert len(first['determines']) > 1
    for name in first['determines']:
        left = next_experiment(*given, determined=[name])
        assert name not in left['determines'] and left['determines']
        assert name not in left['why']
    assert next_experiment(*given, determined=[n.name for n in every]) is None


@pytest.mark.parametrize('ends, said', [
    ((False, False), '95 %: 1 to 3 kg'), ((True, False), '95 %: up to 3 kg'),
    ((False, True), '95 %: 1 kg or more'), ((True, True), 'anywhere in its range')])
def test_an_interval_that_is_open_at_an_end_is_told_as_such(ends, said):
    assert Found(MASS, 2.0, Interval(1.0, 3.0, *ends, ()), DETERMINED).text().endswith(
        f'2 kg ({said})')


@pytest.mark.parametrize('number, value, interval, there', [
    (MAP, MAP.upper, (4.0, 5.0, False, True), True),
    (MAP, MAP.lower, (0.2, 0.25, True, False), True),
    (MAP, 4.7, (4.0, 5.0, False, True), False),         # the recordings rule out nothing above
    (MAP, MAP.upper, (4.0, 5.0, False, False), False),
    (MAP, MAP.upper, (0.2, 5.0, True, True), False),    # they say nothing at all
    (SPRING, SPRING.upper, (9e5, 1e6, False, True), True),
    (SPRING, 0.0, (0.0, 20.0, True, False), False)])    # there is no spring, and none below
def test_a_value_at_an_end_of_its_range_is_seen(number, value, interval, there):
    assert is_at_edge(number, value, Interval(*interval, ())) is there


def along(wide, narrow):
    """Return the covariance of two numbers of which the difference is known well."""
    return 0.5 * np.array([[wide ** 2 + narrow ** 2, wide ** 2 - narrow ** 2],
                           [wide ** 2 - narrow ** 2, wide ** 2 + narrow ** 2]])


def test_numbers_that_do_not_depend_on_each_other_are_not_combined():
    numbers = unknown_numbers(RIG, ['mass_kg', 'force_map_gain', 'K_m', 'T_m'])
    covariance = np.zeros((4, 4))
    covariance[:2, :2], covariance[2:, 2:] = along(2.0, 0.05), along(0.4, 0.05)
    found = _combinations(numbers, np.zeros(4), np.linalg.inv(covariance))
    assert sorted(sorted(c.weights) for c in found) == [
        ['K_m', 'T_m'], ['force_map_gain', 'mass_kg']]
    # The first weight is 1, so it is not that of a number which hardly counts.
    steep = np.array([[100.0, 2.0], [2.0, 0.0404]])
    [one] = _combinations(numbers[2:], np.zeros(2), np.linalg.inv(steep))
    assert list(one.weights) == ['T_m', 'K_m'] and one.product
    assert one.weights == pytest.approx({'T_m': 1.0, 'K_m': -0.02}, rel=0.05)
    assert one.value == pytest.approx(numbers[3].start * numbers[2].start ** -0.02, rel=0.05)
    assert one.half_width == pytest.approx(1.96 * 0.02, rel=0.05)
