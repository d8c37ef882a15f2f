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

"""A muscle held at a few lengths: no isobars in its points, and yet a table."""

import json

import numpy as np
from pam_actuation.cli.main import main
from pam_sim import load_rig
from pam_sim.characterise import characterise_held, characterise_table, Dimensions
from pam_sim.characterise.scattered import is_scattered
from pam_sim.characterise.tables import read_measured_table
from pam_sim.errors import InputError
from pam_sim.muscle.force_maps import read_force_map
from pam_sim.muscle.registry import make_law
from pam_sim.run import Run, Series
from pam_sim.tolerance import UNKNOWN
from pam_sim.units import P_ATM_PA
import pytest

LENGTH_M, BORE_M = 0.3, 0.02
TRUTH = make_law('sarosi', muscle='dmsp_20_300_map')
HELD = (0.0, 0.04, 0.09, 0.15)
RATE_HZ, PULSE_S = 500.0, 0.5
START_NS = 1_700_000_000_000_000_000


def pulses(strain, seed=0, zero_pa=0.0, zero_n=0.0):
    """Return a Run: 24 pulses into a held muscle, and out again, as a load cell sees it."""
    random = np.random.default_rng(seed)
    steps = np.cumsum(random.uniform(15e3, 35e3, 24)) + 3e4
    holds = np.concatenate([[0.0], steps, steps[-2::-1], [0.0]])
    count = int(PULSE_S * RATE_HZ)
    within = np.tile(np.arange(count) / RATE_HZ, holds.size)
    before = np.concatenate([holds[:1], holds[:-1]])
    pressure = np.repeat(holds, count) + np.exp(-within / 0.02) * np.repeat(before - holds, count)
    force = np.maximum(TRUTH.formula_n(pressure, np.full(pressure.size, strain)), 0.0)
    stamp = START_NS + np.round(1e9 * np.arange(pressure.size) / RATE_HZ).astype(np.int64)
    noise = random.standard_normal((2, pressure.size))
    return Run({
        'pressure': Series(stamp, {'pressure_pa': P_ATM_PA + pressure + zero_pa + 300 * noise[0]}),
        'force': Series(stamp, {'force_n': force + zero_n + 0.5 * noise[1]})},
        {}, '/muscle', f'held {strain:g}')


def off_percent(found, strains=HELD):
    """Return how far the table of a result is off the truth, rms of the largest force."""
    law = make_law('lookup', found.table())
    pressure, strain = (one.ravel() for one in np.meshgrid(np.linspace(1e5, 5.5e5, 10), strains))
    force = np.maximum(TRUTH.formula_n(pressure, strain), 0.0)
    read = law.force_n(pressure, strain, outside='allow')
    return 100.0 * float(np.sqrt(np.mean((read - force) ** 2))) / force.max()


def scattered_table(path):
    """Write a force map whose pressures differ from length to length."""
    random = np.random.default_rng(5)
    rows = ['pressure_kPa,contraction_percent,force_N']
    for strain in HELD:
        for pressure in np.sort(random.uniform(80.0, 620.0, 25)):
            force = max(float(TRUTH.formula_n(np.array(1e3 * pressure), np.array(strain))), 0.0)
            rows.append(f'{pressure:.1f},{100 * strain:g},{force:.1f}')
    path.write_text('\n'.join(rows) + '\n')
    return path


def test_points_without_isobars_make_a_table_that_is_right(tmp_path):
    table = read_measured_table(scattered_table(tmp_path / 'map.csv'))
    found = characterise_table(table, Dimensions(LENGTH_M, BORE_M))
    assert off_percent(found) < 1.5
    assert 'pressures differ from length to length' in found.remarks[0]
    assert 'between others' in found.remarks[0]
    # What the law leaves of the points is in the uncertainty; a vented muscle is certain.
    lifted = found.surfaces.strain > 0.0
    assert (found.surfaces.strain_u[lifted] > 0.0).all()
    # It begins vented, where a muscle does not pull.
    assert found.surfaces.pressure_gauge_pa[0] == 0.0
    assert make_law('lookup', found.table()).force_n(0.0, 0.05, outside='allow') == 0.0


@pytest.mark.parametrize('name', ['dmsp_10_250', 'dmsp_20_300'])
def test_a_map_with_isobars_is_read_as_it_is(name):
    points = read_force_map(name)
    assert not is_scattered(points.pressure_gauge_pa, points.strain)
    measured = points.pressure_gauge_pa + np.linspace(0.0, 900.0, points.strain.size)
    assert is_scattered(measured, points.strain)


def test_a_rig_of_such_a_map_says_how_well_it_is_known(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scattered_table(tmp_path / 'map.csv')
    assert main(['rig', 'new', '--force-map', 'map.csv', '--length-mm', '300', '--bore-mm', '20',
                 '--out', 'rig.yaml', '--json']) == 0
    remarks = json.loads(capsys.readouterr().out)['remarks']
    assert any('of the largest force' in one for one in remarks)
    rig = load_rig('rig.yaml')
    force = float(TRUTH.formula_n(np.array(4e5), np.array(0.04)))
    assert rig.muscle.law.law.formula_n(4e5, 0.04) == pytest.approx(force, rel=0.1)


def test_recordings_at_held_lengths_make_a_table():
    # The zeros of the sensors differ from day to day.
    runs = [pulses(strain, seed=k, zero_pa=-9e3, zero_n=-12.0 * k)
            for k, strain in enumerate(HELD)]
    found = characterise_held(runs, [LENGTH_M * strain for strain in HELD],
                              Dimensions(LENGTH_M, BORE_M))
    assert off_percent(found) < 1.5
    assert found.paths == [run.path for run in runs]
    # The force at the full length, where equal loads lose the end of the isobar.
    law, full = make_law('lookup', found.table()), np.array([2e5, 3e5, 4e5, 5e5])
    assert law.force_n(full, 0.0) == pytest.approx(TRUTH.formula_n(full, np.zeros(4)), rel=0.02)
    assert any('measured points the force of the table is off' in one for one in found.remarks)
    stepped = characterise_held(runs, [LENGTH_M * strain for strain in HELD],
                                Dimensions(LENGTH_M, BORE_M), load_step_n=200.0)
    assert stepped.surfaces.load_n[1] == 200.0
    told = [one for one in found.remarks if one.startswith('held ')]
    assert sum('does not push' in one for one in told) == 3
    assert sum('not evacuated' in one for one in told) == 4


def with_contraction(run, contraction_m):
    """Return a run that recorded its contraction, too."""
    stamp = run['pressure'].stamp_ns
    noise = 2e-5 * np.random.default_rng(9).standard_normal(stamp.size)
    return Run({**run.topics, 'contraction': Series(
        stamp, {'contraction_m': contraction_m + noise})}, run.metadata, '/muscle', run.path)


def test_the_length_of_each_recording_is_told():
    runs = [with_contraction(pulses(strain, seed=k), LENGTH_M * strain)
            for k, strain in enumerate(HELD)]
    found = characterise_held(runs, [LENGTH_M * strain for strain in HELD],
                              Dimensions(LENGTH_M, BORE_M))
    assert found.remarks[0] == ('Contraction of each recording as stated: held 0 0 mm, held 0.04 '
                                '12 mm, held 0.09 27 mm, held 0.15 45 mm.')
    assert not any('pulls' in one for one in found.remarks[1:])


def test_a_length_that_the_recording_contradicts_is_refused():
    size, held = Dimensions(LENGTH_M, BORE_M), [LENGTH_M * strain for strain in HELD]
    runs = [pulses(strain, seed=k) for k, strain in enumerate(HELD)]
    recorded = [with_contraction(run, one) for run, one in zip(runs, held)]
    swapped = [held[0], held[2], held[1], held[3]]
    with pytest.raises(InputError, match='held 0.04: --held-mm says that it was held at 27 mm, '
                       'and it recorded a contraction of 12 mm; .* or leave out a sensor'):
        characterise_held(recorded, swapped, size)
    # A zero that nobody knows makes a contraction that nobody knows.
    rig = load_rig('dmsp_5_300_isometric').with_(
        {'contraction_m': held[1]}, tolerance={'contraction_zero_m': UNKNOWN})
    recorded[1] = Run(recorded[1].topics, {'rig': rig.to_yaml()}, '/muscle', 'of a rig')
    recorded[2] = runs[2]
    with pytest.raises(InputError, match='of a rig: .* 27 mm, and its rig states .* of 12 mm'):
        characterise_held(recorded, swapped, size)


def test_the_stated_zeros_are_taken_off_a_recording_at_a_held_length():
    held = [LENGTH_M * strain for strain in HELD]
    zeros = {'pressure_zero_pa': 12e3, 'contraction_zero_m': 5e-3, 'force_zero_n': 30.0}
    text = load_rig('dmsp_5_300_isometric').with_(zeros).to_yaml()
    runs = [with_contraction(pulses(strain, seed=k, zero_pa=12e3, zero_n=30.0), one + 5e-3)
            for k, (strain, one) in enumerate(zip(HELD, held))]
    for run in runs:
        run.metadata = {'rig': text}
    found = characterise_held(runs, held, Dimensions(LENGTH_M, BORE_M))
    assert off_percent(found) < 1.5
    assert any('`pressure_zero_pa`, 12 kPa, which was taken off' in one for one in found.remarks)


def test_a_force_that_rises_with_contraction_is_told():
    runs = [pulses(strain, seed=k) for k, strain in enumerate(HELD)]
    found = characterise_held(runs, [LENGTH_M * HELD[k] for k in (0, 2, 3, 1)],
                              Dimensions(LENGTH_M, BORE_M))
    assert found.remarks[1].startswith('held 0.04, stated as contracted by 27 mm, pulls ')
    assert 'order of the recordings' in found.remarks[1]


def test_a_contraction_that_moves_is_told():
    runs = [pulses(strain, seed=k) for k, strain in enumerate(HELD)]
    held = [LENGTH_M * strain for strain in HELD]
    moved = np.linspace(0.0, 0.02, len(runs[1]['pressure'].stamp_ns))
    runs[1] = with_contraction(runs[1], moved)
    found = characterise_held(runs, held, Dimensions(LENGTH_M, BORE_M))
    assert any('held 0.04: the recorded contraction moved by 19.' in one for one in found.remarks)


def test_what_is_no_recording_at_a_held_length_is_refused():
    size, run = Dimensions(LENGTH_M, BORE_M), pulses(0.05)
    with pytest.raises(InputError, match='--held-mm: has 1 contractions for 2 recordings'):
        characterise_held([run, run], [0.01], size)
    no_force = Run({'pressure': run['pressure']}, {}, '/muscle', 'blind')
    with pytest.raises(InputError, match='force'):
        characterise_held([run, no_force], [0.01, 0.02], size)
    stamp = run['pressure'].stamp_ns
    ramp = Run({'pressure': Series(stamp, {'pressure_pa': np.linspace(1e5, 6e5, stamp.size)}),
                'force': run['force']}, {}, '/muscle', 'ramp')
    with pytest.raises(InputError, match='ramp: has 0 stretches of 0.25 s or more'):
        characterise_held([ramp], [0.01], size)
    with pytest.raises(InputError, match='holds forces at 1 lengths; 2 or more'):
        characterise_held([run], [0.015], size)


@pytest.mark.parametrize('more, words', [
    (['--load-n', '3'], 'a fixed load is another record'),
    ([], 'a table says its lengths itself')])
def test_held_lengths_go_with_bags_alone(more, words, tmp_path, capsys):
    table = scattered_table(tmp_path / 'map.csv')
    assert main(['characterise', str(table), '--length-m', '0.3', '--held-mm', '0', '5', *more,
                 '--out', str(tmp_path / 'out')]) == 2
    assert words in capsys.readouterr().err
