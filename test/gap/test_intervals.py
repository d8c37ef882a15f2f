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

"""95 % intervals: along what the data leave open, within the allowed range, one for a name."""

from gap_runs import assert_form, duties, NOMINAL, nominal, recorded, voltages
import numpy as np
from pam_sim import load_rig
from pam_sim.gap import find_gap
from pam_sim.gap.fit.profile import NORMAL_95, profile_ends
from pam_sim.gap.subsystems.known import LATENCY_SD_S
from pam_sim.gap.verify.together import known_together
import pytest

SD = 1e-3                    # of the difference in the toy problem
OPEN_S, CLOSE_S = 1.7e-3, 2.0e-3


class Valley:
    """Two numbers of which the data tell the difference, until their sum is above 2."""

    bounds = (np.array([0.0, 0.0]), np.array([9.0, 9.0]))

    def residuals(self, x):
        """Return the errors."""
        return np.array([(x[1] - x[0] - 0.3) / SD, 1e3 * max(x[0] + x[1] - 2.0, 0.0)])

    def slopes(self, x):
        """Return slopes whose steps make a bend of the difference look like a slope of the sum."""
        bend = 1e-3 / SD
        beyond = 1e3 * (x[0] + x[1] > 2.0)
        return np.array([[-1.0 / SD, 1.0 / SD], [bend + beyond, bend + beyond]])


class Gate(Valley):
    """The same, and a third number that shuts the way early, but for values near 0."""

    bounds = (np.zeros(3), np.full(3, 9.0))

    def residuals(self, x):
        """Return the errors."""
        most = 2.0 if x[2] < 0.5 else 0.7
        return np.array([(x[1] - x[0] - 0.3) / SD, 1e3 * max(x[0] + x[1] - most, 0.0),
                         1e-6 * x[2]])

    def slopes(self, x):
        """Return slopes that see nothing of the third number."""
        return np.column_stack([np.vstack([super().slopes(x), np.zeros(2)]), [0.0, 0.0, 1e-6]])


class Plane:
    """Two numbers, each with its own standard deviation."""

    bounds = (np.array([-9.0, -9.0]), np.array([9.0, 9.0]))

    def residuals(self, x):
        """Return the errors."""
        return self.slopes(x) @ x

    def slopes(self, x):
        """Return their slopes."""
        return np.array([[2.0, 0.0], [1.0, 5.0]])


def covariance(problem, x):
    slopes = problem.slopes(x)
    return np.linalg.inv(slopes.T @ slopes)


def test_the_ends_reach_as_far_as_the_errors_stay_the_same():
    problem, x = Valley(), np.array([0.1, 0.4])
    own = covariance(problem, x)
    assert 1.96 * np.sqrt(own[0, 0]) < 2.0           # by its slopes alone
    ends = profile_ends(problem, x, [[0, 1]], [own])
    assert ends[0, :, 0] == pytest.approx([0.0, 0.85], abs=0.03)
    assert ends[1, :, 1] == pytest.approx([0.3, 1.15], abs=0.03)
    assert ends[:, :, 1] - ends[:, :, 0] == pytest.approx(0.3, abs=5 * SD)


def test_a_number_without_effect_here_makes_room_for_the_others():
    problem, x = Gate(), np.array([0.1, 0.4, 5.0])
    own = covariance(problem, x)
    assert profile_ends(problem, x, [[0, 1]], [own])[0, 1, 0] == pytest.approx(0.2, abs=0.02)
    ends = profile_ends(problem, x, [[0, 1, 2]], [own])
    assert ends[0, :, 0] == pytest.approx([0.0, 0.85], abs=0.03)
    assert ends[1, 1, 1] == pytest.approx(1.15, abs=0.03)


def test_where_the_slopes_tell_all_the_ends_are_those_of_the_covariance():
    problem, x = Plane(), np.zeros(2)
    own = covariance(problem, x)
    half = NORMAL_95 * np.sqrt(np.diag(own))
    ends = profile_ends(problem, x, [[0, 1]], [own])
    assert ends[0, :, 0] == pytest.approx([-half[0], half[0]])
    assert ends[1, :, 1] == pytest.approx([-half[1], half[1]])
    # Blocks of errors that last tell less.
    ends = profile_ends(problem, x, [[0]], [own, 4.0 * own])
    assert ends[0, :, 0] == pytest.approx([-2.0 * half[0], 2.0 * half[0]])


@pytest.mark.parametrize('close, ends, text', [
    (0.4, [[0.0, 0.3], [1.7, 2.0]], 'close - open = 0.3 ± 0.003'),
    (4.0, [[0.05, 8.0], [0.4, 1.0]], 'close · open = 0.4 ± 1 %'),
    (0.4, [[0.0, 0.1], [0.2, 0.9]], None),          # known no better together
    (0.4, [[0.099, 0.398], [0.101, 0.402]], None)])         # known alone
def test_a_sum_or_a_product_is_told_where_neither_number_is_known(close, ends, text):
    values = {'open': (0.1, 's'), 'close': (close, 's')}
    covariances = [np.array([[0.5, 0.5], [0.5, 0.5]]) * 1e-8]
    found = known_together(values, np.eye(2), covariances, np.array([ends]), 0.01)
    assert [one.text() for one in found] == ([] if text is None else [text])
    # Two quantities of one parameter are no two numbers.
    one_parameter = np.array([[1.0, 0.0], [2.0, 0.0]])
    assert known_together(values, one_parameter, covariances, np.array([ends]), 0.01) == []


def switching(**effect):
    """Return the rig with on/off valves and dead zone, and duties that are 0 or long."""
    rig = load_rig(NOMINAL, valve='hsv')
    return rig, rig.with_(effects=[{'name': 'valve_dead_zone', 'parameters': effect}])


def test_of_opening_and_closing_times_only_the_difference_is_told():
    given, true = switching(open_time_s=OPEN_S, close_time_s=CLOSE_S)
    result = find_gap(recorded(true, duties()), given, effects=['valve_dead_zone'], unnamed=())
    assert [e['name'] for e in result.effects] == ['valve_dead_zone']
    said = result.effects[0]
    assert_form(result)
    for name, value in (('open_time_s', OPEN_S), ('close_time_s', CLOSE_S)):
        assert said['equivalent'][name]['ci95'][0] <= value <= said['equivalent'][name]['ci95'][1]
        assert 0.0 <= said['equivalent'][name]['ci95'][0]
        assert said['parameters'][name] == said['equivalent'][name]
    assert len(said['together']) == 1
    sentence = said['together'][0]
    assert sentence.startswith('close_time_s - open_time_s = ')
    assert float(sentence.split()[4]) == pytest.approx(CLOSE_S - OPEN_S, abs=1e-5)
    assert f'the data determine only {said["together"][0]}' in result.reason


@pytest.mark.parametrize('seconds', [12.0, 24.0])
def test_a_formulation_at_the_end_of_its_range_gives_way_to_one_that_explains_as_much(seconds):
    given, true = switching(open_time_s=OPEN_S, close_time_s=CLOSE_S)
    result = find_gap(recorded(true, duties(seconds)), given, effects=['valve_dead_zone'],
                      unnamed=())
    effect, = result.effects
    assert set(effect['equivalent']) == {'open_time_s', 'close_time_s'}
    assert not any('at the end of its range' in remark for remark in result.remarks)


@pytest.mark.parametrize('delay_s', [0.0115, 0.0155, 0.0204])
def test_a_pure_delay_is_known_no_better_than_the_latency_of_the_sensors(delay_s):
    # Whole steps or parts of one: the interval does not rest on how the simulation steps.
    rig = nominal().with_(effects=[{
        'name': 'valve_dead_time', 'parameters': {'delay_s': delay_s}}])
    result = find_gap(recorded(rig, voltages(20.0), 500), nominal(),
                      effects=['valve_dead_time'], unnamed=())
    told = result.effects[0]['equivalent']['delay_s']
    low, high = told['ci95']
    assert low <= delay_s <= high
    assert min(told['value'] - low, high - told['value']) >= NORMAL_95 * LATENCY_SD_S
    assert_form(result)


def test_a_number_has_the_interval_of_the_data_not_that_of_its_prior():
    rig = nominal().with_(parameters={'force_map_gain': 0.97})
    result = find_gap(recorded(rig, voltages(8.0)), nominal(), effects=['creep'], unnamed=())
    gain = next(c for c in result.calibration if c.name == 'force_map_gain')
    prior = NORMAL_95 * abs(gain.value - gain.nominal) / abs(gain.prior_deviation)
    assert gain.ci95[0] <= 0.97 <= gain.ci95[1]
    assert gain.ci95[1] - gain.ci95[0] < 0.5 * prior


def test_what_is_left_beside_a_wrong_number_is_in_its_interval():
    """Friction that nobody looks for may be some of the mass, as of a form that is off."""
    widths = []
    for effects in ([], [{'name': 'coulomb_friction', 'parameters': {'force_n': 0.15}}]):
        rig = nominal().with_(parameters={'mass_kg': 5.75}, effects=effects)
        result = find_gap(recorded(rig, voltages(11.0)), nominal(), effects=['creep'], unnamed=())
        found, = result.parameters
        assert found.name == 'mass_kg' and found.ci95[0] < 5.75 < found.ci95[1]
        widths.append(found.ci95[1] - found.ci95[0])
    assert widths[1] > 3.0 * widths[0]
