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

"""Surfaces from recordings: right, honest about their uncertainty, and refused where senseless."""

from dataclasses import replace

import numpy as np
from pam_sim import load_rig
from pam_sim.characterise import against_rig, characterise_runs, Dimensions
from pam_sim.characterise import characterise
from pam_sim.characterise.fixed_load import by_load, fixed_load, FixedLoad
from pam_sim.characterise.points import load_grid, points_of, with_no_load
from pam_sim.errors import InputError
from pam_sim.joint import load_joint
from pam_sim.muscle.registry import make_law
from pam_sim.tolerance import UNKNOWN
import pytest
from stepped_runs import contraction_m, LENGTH_M, LEVELS_PA, series_of_runs, stepped_run

MUSCLE = Dimensions(LENGTH_M, 0.005, 3e-6)


@pytest.fixture(scope='module')
def found():
    return characterise_runs(series_of_runs(), MUSCLE)


def test_contraction_is_recovered_at_sensor_noise(found):
    truth = against_rig(found.surfaces, load_rig('dmsp_5_300_hanging_mass'))
    assert truth['rms_percent'] < 0.01 and truth['max_percent'] < 0.1
    assert truth['between_rms_percent'] < 0.2 and truth['within_2u_share'] > 0.9
    assert found.surfaces.load_n.tolist() == list(range(0, 151, 10))
    assert found.surfaces.pressure_gauge_pa == pytest.approx(LEVELS_PA)


@pytest.mark.parametrize('step_n, count, grid', [
    (12.5, 9, [0.0, 12.5, 25.0, 37.5, 50.0, 62.5, 75.0, 87.5, 100.0]),      # not to 96 N
    (7.5, 4, [0.0, 7.5, 15.0, 22.5]),
    (10.02, 16, range(0, 151, 10)), (2.5, 5, range(0, 11, 2))])
def test_loads_of_the_table_reach_the_largest_measured_one(step_n, count, grid):
    assert load_grid(step_n * np.arange(count)).tolist() == list(grid)


def test_the_law_of_the_table_is_the_law_of_the_muscle(found):
    law, truth = make_law('lookup', found.table()), make_law('sarosi')
    rng = np.random.default_rng(1)
    pressure, load = rng.uniform(100e3, 600e3, 50), rng.uniform(0.0, 130.0, 50)
    strain = truth.max_strain(pressure, load)
    assert law.strain_at(pressure, load) == pytest.approx(strain, abs=2e-3)
    lifted = strain > 0.002
    assert law.force_n(pressure, strain)[lifted] == pytest.approx(load[lifted], abs=2.5)
    mass = MUSCLE.air_mass_kg(pressure, strain)
    assert law.pressure_gauge_pa(mass, load) == pytest.approx(pressure, abs=3e3)


def test_air_is_that_of_the_rig(found):
    rig = load_rig('dmsp_5_300_hanging_mass')
    assert Dimensions.of_rig(rig) == MUSCLE
    assert MUSCLE.volume_m3(0.1) == pytest.approx(rig.volume_m3(0.03))
    assert MUSCLE.volume_m3(0.0) == pytest.approx(8.89e-6, rel=1e-3)


def test_hysteresis_is_lumped_and_its_half_distance_reported():
    found = characterise_runs(series_of_runs(half_m=1.5e-3), MUSCLE).surfaces
    truth = contraction_m(found.pressure_gauge_pa[:, None], found.load_n[None, :]) / LENGTH_M
    inside = (truth > 0.006) & (found.pressure_gauge_pa < 590e3)[:, None]
    assert found.strain[inside] == pytest.approx(truth[inside], abs=2e-5)
    assert found.half_distance[inside] == pytest.approx(0.005, abs=2e-5)
    assert found.parts['hysteresis'][inside] == pytest.approx(0.005 / np.sqrt(3.0), rel=0.02)
    # Where the pressure turns the branches meet, and the doubt stays.
    top = truth[-1] > 0.01
    assert found.half_distance[-1, top] == pytest.approx(0.0, abs=2e-5)
    assert np.all(found.strain_u[-1, top] > 0.0028)
    assert np.all(np.abs(found.strain - truth) <= 2.0 * found.strain_u + 1e-6)


def test_uncertainty_is_carried_to_force_and_pressure(found):
    wide = characterise_runs(series_of_runs(half_m=1.5e-3), MUSCLE).surfaces
    i = int(np.argmin(np.abs(wide.pressure_gauge_pa - 400e3)))
    truth = make_law('sarosi')
    k = int(np.argmin(np.abs(wide.force_strain - 0.05)))
    strain = wide.force_strain[k]
    slope = (truth.force_n(400e3, strain + 1e-4) - truth.force_n(400e3, strain - 1e-4)) / 2e-4
    assert wide.force_u_n[i, k] == pytest.approx(abs(slope) * 0.005 / np.sqrt(3), rel=0.1)
    # A contraction larger by u holds more air at one pressure: P(m, load) is lower by u_P.
    j = 4
    more = MUSCLE.air_mass_kg(400e3, wide.strain[i, j] + wide.strain_u[i, j])
    law = make_law('lookup', wide.table())
    moved = law.pressure_gauge_pa(more, wide.load_n[j]) - 400e3
    assert wide.pressure_u_pa[i, j] == pytest.approx(moved, rel=0.15)
    assert np.all(found.surfaces.pressure_u_pa < wide.pressure_u_pa.max())


def test_no_load_is_extrapolated_from_a_small_one():
    loads = [0.98, *np.arange(10.0, 151.0, 10.0)]
    found = characterise_runs(series_of_runs(loads), MUSCLE)
    truth = contraction_m(found.surfaces.pressure_gauge_pa, 0.0) / LENGTH_M
    assert found.surfaces.load_n[0] == 0.0 and any('0 N' in line for line in found.remarks)
    assert found.surfaces.strain[:, 0] == pytest.approx(truth, abs=1e-3)
    assert found.surfaces.parts['reading'][:, 0].max() > 1e-5


def test_what_no_load_was_lifted_at_is_not_known():
    loads = np.arange(40.0, 161.0, 40.0)
    found = characterise_runs(series_of_runs(loads), MUSCLE)
    surfaces, law = found.surfaces, make_law('sarosi')
    pressure = surfaces.pressure_gauge_pa
    truth = contraction_m(pressure, 0.0) / LENGTH_M
    unlifted = (pressure > 1e3) & (contraction_m(pressure, 40.0) == 0.0)
    assert unlifted.sum() >= 2
    assert np.all(np.abs(surfaces.strain[unlifted, 0] - truth[unlifted])
                  <= 2.0 * surfaces.strain_u[unlifted, 0])
    assert np.all(surfaces.strain_u[unlifted, 0] > 0.02)
    assert np.all(surfaces.force_u_n[unlifted, 0] > 20.0)
    assert np.all(np.abs(surfaces.force_n[unlifted, 0] - law.force_n(pressure[unlifted], 0.0))
                  <= 2.0 * surfaces.force_u_n[unlifted, 0])
    low, high = 1e-3 * pressure[unlifted][[0, -1]]
    said = f'At {low:.0f} to {high:.0f} kPa no load was lifted: the force at rest lies between 0'
    assert any(line.startswith(said) for line in found.remarks)
    assert f'not known: {said}' in found.table().source
    # Without pressure the muscle is at rest.
    assert surfaces.strain_u[0, 0] < 1e-3


def test_loads_that_are_all_lifted_leave_nothing_unknown(found):
    assert not any('extrapolated' in line for line in found.remarks)
    assert not found.surfaces.unknown and 'not known' not in found.table().source


def test_a_load_that_friction_holds_is_left_out():
    runs = series_of_runs(np.arange(10.0, 151.0, 10.0), half_m=1e-3)
    without = characterise_runs(runs, MUSCLE)
    for stuck_n in (0.0, 1.0):
        found = characterise_runs([stepped_run(stuck_n, half_m=8e-3), *runs], MUSCLE)
        assert any('friction holds it' in line for line in found.remarks)
        assert any('0 N: that column was extrapolated' in line for line in found.remarks)
        assert np.array_equal(found.surfaces.strain, without.surfaces.strain)


def test_one_branch_is_enough_and_said():
    runs = series_of_runs()
    for run in runs:
        for series in run.topics.values():
            keep = series.time_s(run.start_ns) < 2.0 * LEVELS_PA.size
            series.stamp_ns = series.stamp_ns[keep]
            series.values = {key: value[keep] for key, value in series.values.items()}
    found = characterise_runs(runs, MUSCLE)
    assert any('one branch only' in line for line in found.remarks)
    truth = against_rig(found.surfaces, load_rig('dmsp_5_300_hanging_mass'))
    assert truth['rms_percent'] < 0.01


def without_settling(one, *levels_pa):
    """Return a FixedLoad of which the holds at some levels had not settled."""
    lost = [hold for hold in one.holds
            if min(abs(hold.pressure_gauge_pa - level) for level in levels_pa) < 3e3]
    return replace(one, holds=[hold for hold in one.holds if hold not in lost], unsettled=lost)


def test_a_load_that_did_not_settle_costs_no_pressure():
    loads = [fixed_load(run, LENGTH_M) for run in series_of_runs([0.0, 30.0, 60.0, 90.0, 120.0])]
    whole = points_of(loads)
    found = points_of([without_settling(loads[0], 200e3, 250e3), *loads[1:]])
    assert np.array_equal(found.pressure_gauge_pa, whole.pressure_gauge_pa)
    assert np.array_equal(found.strain[:, 1:], whole.strain[:, 1:])
    lost = np.isin(found.pressure_gauge_pa, (200e3, 250e3))
    assert np.all(found.reading[lost, 0] > 1e-4) and np.all(found.reading[~lost] == 0.0)
    assert np.all(np.abs(found.strain - whole.strain)[lost, 0] < found.reading[lost, 0])
    # An extrapolation from such a number knows no more than it.
    runs = [fixed_load(run, LENGTH_M) for run in series_of_runs([5.0, 30.0, 60.0, 90.0])]
    lifted = with_no_load(points_of([without_settling(runs[0], 200e3), *runs[1:]]))
    at = int(np.flatnonzero(np.isclose(lifted.pressure_gauge_pa, 200e3))[0])
    assert lifted.reading[at, 0] > lifted.reading[at, 1] > 1e-3
    # A pressure at which few loads settled is none of the table.
    few = points_of([*(without_settling(one, 200e3) for one in loads[:3]), *loads[3:]])
    assert 200e3 not in few.pressure_gauge_pa


def test_the_pressures_that_did_not_settle_are_named(monkeypatch):
    def lost(run, length_m, *rest):
        one = fixed_load(run, length_m, *rest)
        return without_settling(one, 200e3, *([400e3] if one.load_n > 40.0 else [])) if (
            one.load_n < 10.0 or one.load_n > 40.0) else one
    monkeypatch.setattr(characterise, 'fixed_load', lost)
    said = ' '.join(characterise_runs(
        series_of_runs([0.0, 30.0, 35.0, 40.0, 60.0]), MUSCLE).remarks)
    assert '0.00 N had no settled hold at 200 kPa: its contraction there is read between' in said
    assert '60.00 N had no settled hold at 200, 400 kPa: its contraction' in said


def test_repetitions_of_a_load_are_put_together():
    runs = series_of_runs([0.0, 30.0, 60.0]) + [stepped_run(30.1, seed=9)]
    assert characterise_runs(runs, MUSCLE).surfaces.load_n.tolist() == [
        0.0, 15.0, 30.0, 45.0, 60.0]


def test_given_loads_in_another_order_than_the_load_cell_read_are_refused():
    hung = [10.0, 150.0, 20.0, 40.0, 5.0, 80.0]        # as a shell sorts load_10, load_150, ...
    runs = series_of_runs(hung)
    with pytest.raises(InputError, match='load 150: --load-n gives it 10 N and load 20 20 N, '
                       'and the load cell read 150.0 N and 20.0 N; give the loads in the order'):
        characterise_runs(runs, MUSCLE, sorted(hung))
    assert not [line for line in characterise_runs(runs, MUSCLE, hung).remarks
                if 'load cell' in line]
    # A cell with a wrong scale and zero keeps the order; one that was not connected has none.
    for weight_n, told in ((lambda load: 1.3 * load + 3.0, 6), (lambda load: 0.01 * load, 6)):
        off = [stepped_run(load, seed=k, weight_n=weight_n(load), path=f'load {load:g}')
               for k, load in enumerate(hung)]
        found = characterise_runs(off, MUSCLE, hung)
        assert [one.load_n for one in found.loads] == sorted(hung)
        assert len([line for line in found.remarks if 'The given one counts' in line]) == told


def test_the_load_of_repetitions_is_their_mean():
    hung = [10.0, 10.3, 10.4]
    found = by_load([FixedLoad(load, 0.1, 'given', LENGTH_M, [], path=f'{load:g}')
                     for load in (20.0, 0.0, *hung[::-1])])
    assert [one.path for one in found] == ['0', '10, 10.3, 10.4', '20']
    assert found[1].load_n == pytest.approx(np.mean(hung))
    assert found[1].load_u_n == pytest.approx(np.hypot(0.1 / np.sqrt(3.0), np.std(hung)))


def test_loads_may_be_an_array():
    loads = np.array([0.0, 30.0, 60.0])
    found = characterise_runs(series_of_runs(loads), MUSCLE, loads_n=loads)
    assert [one.load_from for one in found.loads] == ['given'] * 3
    with pytest.raises(InputError, match='0 loads for 3'):
        characterise_runs(series_of_runs(loads), MUSCLE, loads_n=[])


def rig_text(**parameters):
    return load_rig('dmsp_5_300_hanging_mass').with_(parameters=parameters).to_yaml()


@pytest.mark.parametrize('runs, options, words', [
    (lambda: [], {}, 'no recording'),
    (lambda: series_of_runs([0.0, 50.0]), {}, '3 or more'),
    (lambda: series_of_runs([50.0, 50.1, 50.2]), {}, 'differ by at least'),
    (lambda: series_of_runs([60.0, 70.0, 80.0]), {}, 'too far from 0 N'),
    (lambda: series_of_runs(levels_pa=np.array([0.0, 3e5])), {}, '3 or more'),
    (lambda: series_of_runs(leave_out=('pressure',)), {}, 'no `pressure`'),
    (lambda: series_of_runs([120.0, 0.0, 60.0], levels_pa=np.array([0.0, 10e3, 20e3])), {},
     'does not contract'),
    (lambda: series_of_runs(), {'loads_n': [1.0]}, '1 loads for 16'),
    (lambda: series_of_runs(), {'load_step_n': 100.0}, 'load-step-n'),
])
def test_bad_recordings_are_refused_in_one_sentence(runs, options, words):
    with pytest.raises(InputError, match=words) as mistake:
        characterise_runs(runs(), MUSCLE, **options)
    assert '\n' not in str(mistake.value)


def with_zeros(run, pressure_zero_pa, contraction_zero_m, force_zero_n):
    """Return a run whose sensors read other than 0 where nothing is measured."""
    for topic, key, zero in (('pressure', 'pressure_pa', pressure_zero_pa),
                             ('contraction', 'contraction_m', contraction_zero_m),
                             ('force', 'force_n', force_zero_n)):
        run[topic].values[key] = run[topic][key] + zero
    return run


def test_the_zeros_that_the_rig_states_are_no_part_of_the_muscle(found):
    zeros = {'pressure_zero_pa': -30e3, 'contraction_zero_m': 5e-3, 'force_zero_n': -4.0}
    runs = [with_zeros(run, **zeros)
            for run in series_of_runs(metadata={'rig': rig_text(**zeros)})]
    read_pa = runs[0]['pressure']['pressure_pa'].copy()
    without = characterise_runs(runs)
    assert without.surfaces.load_n.tolist() == found.surfaces.load_n.tolist()
    assert without.surfaces.pressure_gauge_pa == pytest.approx(found.surfaces.pressure_gauge_pa)
    assert without.surfaces.strain == pytest.approx(found.surfaces.strain, abs=1e-6)
    for said in ('All recordings: the rig states `pressure_zero_pa`, -30 kPa, which was taken off',
                 '`contraction_zero_m`, 5 mm', '`force_zero_n`, -4 N'):
        assert any(said in one for one in without.remarks)
    assert np.array_equal(runs[0]['pressure']['pressure_pa'], read_pa)
    assert not any('states `' in one for one in found.remarks)


def test_a_zero_that_nobody_knows_is_told():
    unknown = load_rig('dmsp_5_300_hanging_mass').with_(
        tolerance={'contraction_zero_m': UNKNOWN}).to_yaml()
    runs = series_of_runs([0.0, 30.0, 60.0, 90.0])
    runs[1].metadata = {'rig': unknown}
    assert ('load 30: the rig does not know its `contraction_zero_m`, so the readings count as '
            'they are.') in characterise_runs(runs, MUSCLE).remarks


def test_a_sensor_that_reads_below_the_atmosphere_makes_a_table_that_says_so():
    """Two levels below 0 kPa are one pressure of the table."""
    levels_pa = np.arange(-30e3, 575e3, 20e3)
    off = characterise_runs(series_of_runs(levels_pa=levels_pa), MUSCLE)
    assert off.surfaces.pressure_gauge_pa == pytest.approx([0.0, *levels_pa[2:]])
    assert np.isfinite(off.surfaces.strain).all()
    assert any('the pressure stood still at -30.' in one and 'is not evacuated' in one
               for one in off.remarks)


def test_recordings_of_different_muscles_or_of_none_are_refused():
    runs = series_of_runs([0.0, 30.0, 60.0], metadata={'rig': rig_text()})
    assert characterise_runs(runs).dimensions == MUSCLE
    runs[1].metadata = {'rig': rig_text(V_dead=6e-6)}
    with pytest.raises(InputError, match='different muscles'):
        characterise_runs(runs)
    with pytest.raises(InputError, match='--length-m'):
        characterise_runs(series_of_runs([0.0, 30.0, 60.0]))


def test_a_muscle_of_a_joint_is_characterised():
    joint = load_joint('knee_dmsp_20_300')
    runs = series_of_runs([0.0, 30.0, 60.0], metadata={'rig': joint.to_yaml()})
    with pytest.raises(InputError, match='--length-m'):
        characterise_runs(runs)
    assert characterise_runs(runs, MUSCLE).dimensions == MUSCLE
    for run in runs:
        run.namespace = '/knee/flexor'
    assert characterise_runs(runs).dimensions == Dimensions.of_rig(joint.flexor)


def test_without_a_force_the_mass_of_the_rig_is_the_load():
    runs = [stepped_run(9.80665 * mass, seed=k, leave_out=('force',),
                        metadata={'rig': rig_text(mass_kg=mass)})
            for k, mass in enumerate((0.1, 3.0, 6.0, 9.0))]
    found = characterise_runs(runs)
    assert [one.load_from for one in found.loads] == ['rig'] * 4
    assert found.loads[1].load_n == pytest.approx(29.42, abs=0.01)
