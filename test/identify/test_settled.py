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


"""The zero of the pressure sensor where the edges of a regulator are not those of the model."""

from types import SimpleNamespace

from made_records import inside, record, RIG
import numpy as np
from pam_sim.identify.before_gap import left_open, numbers_first
from pam_sim.identify.fit import Weighted
from pam_sim.identify.numbers import known_numbers_of, unknown_numbers
from pam_sim.identify.profile import Interval, straight_end
from pam_sim.identify.records import offer_of, problems_of
from pam_sim.identify.result import Found
from pam_sim.identify.settled import beside_settled_zero, settled_zero
from pam_sim.tolerance import AbsoluteSd, UNKNOWN
import pytest

ZERO_PA = -20e3
LEVELS_PA = 0.0, 240e3, 120e3
GIVEN = RIG.with_(parameters={'mass_kg': 1.5}, tolerance={'pressure_zero_pa': UNKNOWN, 'T_m': 0.5})


@pytest.fixture(scope='module')
def steps():
    """Return what is read behind a regulator that is late, slow, and closes its vent early."""
    rig = GIVEN.with_(parameters={'T_m': 0.03}, effects=[
        {'name': 'valve_dead_time_by_direction', 'parameters': {
            'delay_s': 0.09, 'vent_later_s': -0.03}},
        {'name': 'flow_limit', 'parameters': {
            'fill_rate_at_400kpa_pa_per_s': 3.5e5, 'vent_rate_at_400kpa_pa_per_s': 4.0e5}},
        {'name': 'vent_bleed', 'parameters': {
            'closing_pressure_pa': 15e3, 'bleed_rate_pa_per_s': 8e3}}])
    return record(rig, LEVELS_PA, 2.5, ('pressure', 'contraction'), zero_pa=ZERO_PA)


def test_holds_tell_the_zero(steps):
    (valve, _) = problems_of(GIVEN, [offer_of(steps, GIVEN)])
    zero, interval = settled_zero(GIVEN, valve)
    assert interval.low < ZERO_PA < interval.high and abs(zero - ZERO_PA) < 4e3
    assert interval.high - interval.low < 20e3
    # Without the gain there is less to go by.
    _, wider = settled_zero(GIVEN.with_(tolerance={'K_m': UNKNOWN}), valve)
    assert wider.high - wider.low > interval.high - interval.low
    # The regulator's own zero looks the same.
    assert settled_zero(GIVEN.with_(tolerance={'ppr_zero_pa': UNKNOWN}), valve) is None
    exact = GIVEN.with_(tolerance={'ppr_zero_pa': AbsoluteSd(0.0)})
    assert settled_zero(exact, valve) == (zero, interval)
    moving = record(RIG, voltage=1.0 + np.sin(np.arange(4000) / 300.0))
    (valve,) = problems_of(GIVEN, [offer_of(moving, GIVEN)])    # the load is never lifted
    assert settled_zero(GIVEN, valve) is None


def test_muscle_and_load_are_fitted_anew_with_the_zero_of_the_holds(steps):
    rig = GIVEN.with_(tolerance={'mass_kg': UNKNOWN})
    sought = unknown_numbers(rig, ['pressure_zero_pa', 'mass_kg'])
    problems = problems_of(rig, [offer_of(steps, rig)])
    numbers = [*sought, *known_numbers_of(problems, sought)]
    weighted = Weighted(rig, problems, numbers, incomplete=frozenset(('valve', 'muscle')))
    names = [n.name for n in numbers]
    x = np.linspace(0.1, 0.2, len(numbers))
    found = [Found(n, ZERO_PA if n.name == 'pressure_zero_pa' else 1.5, Interval(
        ZERO_PA - 1960.0, ZERO_PA + 1960.0, False, False, ()), 'determined') for n in sought]
    other, start, count = beside_settled_zero(weighted, x, found)
    assert [p.subsystem for p in other.problems] == ['muscle'] and count == 1
    assert other.numbers[0].name == 'mass_kg' and start[0] == x[names.index('mass_kg')]
    assert not {'K_m', 'T_m'} & {n.name for n in other.numbers}
    zero = next(k for k, n in enumerate(other.numbers) if n.name == 'pressure_zero_pa')
    assert other.numbers[zero].sd == pytest.approx(1000.0, rel=1e-3)
    assert other.values(start)['pressure_zero_pa'] == ZERO_PA
    # Where the valve alone was recorded there is nothing to fit anew.
    alone = Weighted(rig, [p for p in problems if p.subsystem == 'valve'], numbers)
    assert beside_settled_zero(alone, x, found) is None


def test_an_end_by_the_slopes_minds_the_bounds_of_the_others():
    slopes = np.array([[2.0, 1.0], [0.0, 1.0]])
    covariance = np.linalg.inv(slopes.T @ slopes)
    most = 1.96 * np.sqrt(covariance[0, 0])
    free = SimpleNamespace(low=np.full(2, -9.0), high=np.full(2, 9.0),
                           residuals=lambda x: slopes @ x)
    for sign in (-1.0, 1.0):
        assert straight_end(free, np.zeros(2), 0, slopes, sign * most) == pytest.approx(
            most, rel=0.01)
    # An effect that may not be negative: it gives way on one side only.
    bound = SimpleNamespace(low=np.array([-9.0, 0.0]), high=free.high, residuals=free.residuals)
    assert straight_end(bound, np.zeros(2), 0, slopes, -most) == pytest.approx(most, rel=0.01)
    assert straight_end(bound, np.zeros(2), 0, slopes, most) == pytest.approx(0.98, rel=0.01)


def test_numbers_bent_by_what_no_effect_explains_stay_open_for_the_look(steps):
    first, found, remarks = numbers_first([steps], GIVEN, False)
    assert inside(found['pressure_zero_pa'], ZERO_PA) and not remarks
    assert any('where the regulator has settled' in remark for remark in found.remarks)
    # The muscle alone would move it away from what the valve says.
    assert first.tolerance['pressure_zero_pa'] == 0.0
    assert first.number('pressure_zero_pa') == found['pressure_zero_pa'].value
    open_ = GIVEN.with_(parameters={'mass_kg': 4.0}, tolerance={'mass_kg': UNKNOWN})
    found.bent.append('mass_kg')
    found.rig = found.rig.with_(parameters={'mass_kg': 7.0}, tolerance={'mass_kg': 0.01})
    left = left_open(open_, found)
    assert left.number('mass_kg') == 7.0 and left.unknown == ('mass_kg',)
