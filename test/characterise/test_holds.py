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

"""Holds of a recording: found, averaged, told apart from what has not settled."""

import numpy as np
from pam_sim.characterise.fixed_load import fixed_load
from pam_sim.characterise.held import held_points
from pam_sim.characterise.holds import find_holds
from pam_sim.errors import InputError
import pytest
from stepped_runs import contraction_m, LENGTH_M, LEVELS_PA, stepped_run, up_and_down


def test_every_hold_is_found_with_its_means_and_branch():
    holds = find_holds(stepped_run(50.0), LENGTH_M)
    wanted = up_and_down()
    assert len(holds) == wanted.size and all(hold.settled for hold in holds)
    measured = np.array([hold.pressure_gauge_pa for hold in holds])
    assert measured == pytest.approx(wanted, abs=150.0)
    x = np.array([hold.contraction_m for hold in holds])
    assert x == pytest.approx(contraction_m(wanted, 50.0), abs=5e-6)
    assert [hold.branch for hold in holds] == ['up'] * LEVELS_PA.size + ['down'] * (
        LEVELS_PA.size - 1)
    assert all(hold.force_n == pytest.approx(50.0, abs=0.05) for hold in holds)
    # The stated uncertainty is that of the means: 10 um over about 100 samples.
    assert np.median([hold.contraction_u_m for hold in holds]) == pytest.approx(1e-6, rel=0.5)


def test_a_hold_that_creeps_is_flagged_and_a_slow_one_says_its_drift():
    assert not any(hold.settled for hold in find_holds(stepped_run(50.0, drift_m=1e-3), LENGTH_M))
    slow = find_holds(stepped_run(50.0, drift_m=1e-4), LENGTH_M)
    assert all(hold.settled for hold in slow)
    # Blocks of a window of 0.85 s lie 0.68 s apart; three standard errors are taken away.
    assert np.median([hold.drift_m for hold in slow]) == pytest.approx(2.7e-5, rel=0.3)


def test_gaps_and_disorder_of_the_recording_do_no_harm():
    run = stepped_run(50.0)
    wanted = [hold.contraction_m for hold in find_holds(run, LENGTH_M)]
    rng = np.random.default_rng(3)
    for series in run.topics.values():
        keep = rng.permutation(len(series))[:int(0.8 * len(series))]
        series.stamp_ns = series.stamp_ns[keep]
        series.values = {key: value[keep] for key, value in series.values.items()}
    run.topics['contraction'].values['contraction_m'][::50] = np.nan
    found = [hold.contraction_m for hold in find_holds(run, LENGTH_M)]
    assert found == pytest.approx(wanted, abs=1e-5)


def test_a_stamp_far_from_the_others_is_refused():
    run = stepped_run(50.0)
    run.topics['pressure'].stamp_ns[0] = 0
    for holds in (lambda: find_holds(run, LENGTH_M), lambda: held_points(run)):
        with pytest.raises(InputError, match='made: .* 1.7e[+]09 s; allowed is at most 1e[+]06 s'):
            holds()


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('every', [5, 10, 12, 25])
def test_a_pressure_that_is_read_too_seldom_is_refused_with_its_rate(every):
    """Most of the times over which it is averaged would be empty."""
    run = stepped_run(50.0)
    for series in run.topics.values():
        series.stamp_ns = series.stamp_ns[::every]
        series.values = {key: value[::every] for key, value in series.values.items()}
    for holds, longest_s in ((lambda: find_holds(run, LENGTH_M), 0.1),
                             (lambda: held_points(run), 0.05)):
        if 0.01 * every <= longest_s:
            holds()
            continue
        with pytest.raises(InputError, match=f'made: its pressure comes every {0.01 * every:g} s; '
                           f'.* a reading each {longest_s:g} s or more often'):
            holds()


@pytest.mark.parametrize('topic', ['pressure', 'contraction'])
def test_a_recording_without_pressure_or_contraction_is_refused(topic):
    with pytest.raises(InputError, match=f'has no `{topic}`'):
        find_holds(stepped_run(50.0, leave_out=(topic,)), LENGTH_M)


def test_a_pressure_with_a_single_usable_value_is_refused_with_that_number():
    run = stepped_run(50.0)
    run.topics['pressure'].values['pressure_pa'][1:] = np.nan
    with pytest.raises(InputError, match='has 1 finite `pressure` values; at least 2 are needed'):
        find_holds(run, LENGTH_M)


def test_a_recording_without_steps_is_refused():
    with pytest.raises(InputError, match='settled holds of different pressure'):
        fixed_load(stepped_run(50.0, levels_pa=np.array([2e5, 2e5, 2e5])), LENGTH_M)
    with pytest.raises(InputError, match='settled holds of different pressure'):
        fixed_load(stepped_run(50.0, drift_m=2e-3), LENGTH_M)


def test_the_load_comes_from_the_cell_or_from_what_is_given():
    measured = fixed_load(stepped_run(50.0, weight_n=51.2), LENGTH_M)
    assert measured.load_from == 'load cell'
    assert measured.load_n == pytest.approx(51.2, abs=0.01) and measured.load_u_n < 0.01
    given = fixed_load(stepped_run(50.0, weight_n=51.2), LENGTH_M, load_n=50.0)
    assert (given.load_from, given.load_n) == ('given', 50.0)
    with pytest.raises(InputError, match='--load-n'):
        fixed_load(stepped_run(50.0, leave_out=('force',)), LENGTH_M)


def test_a_load_that_is_not_fixed_is_refused():
    run = stepped_run(50.0)
    force = run.topics['force'].values['force_n']
    force += np.linspace(0.0, 30.0, force.size)
    with pytest.raises(InputError, match='not fixed'):
        fixed_load(run, LENGTH_M)
