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

"""Faults of sensors and of the command are told by every verb; fast motion of a rig is not."""

import json
import re

import numpy as np
from pam_actuation.bags.sensor_faults import course_remarks
from pam_actuation.cli.main import main
from pam_sim.units import P_ATM_PA
import pytest

RATE_HZ = 1000.0
TIME_S = np.arange(0.0, 30.0, 1.0 / RATE_HZ)
NOISE = np.random.default_rng(3).standard_normal(TIME_S.size)
SMOOTH_M = 0.012 - 0.011 * np.cos(TIME_S)
MOVED_M = SMOOTH_M + 1e-5 * NOISE


def told(name, column, every=1):
    """Return the remarks on a column of which every so many samples are kept."""
    return course_remarks(name, (1e9 * TIME_S[::every]).astype(np.int64), column[::every])


def stepped(*steps):
    """Return steps (time in s, size) as one column."""
    return sum(size * (TIME_S >= at_s) for at_s, size in steps)


def fallen(rest_s, period_s):
    """Return the motion of a load that falls off, by 8 mm: an oscillation that dies out."""
    since_s = np.maximum(TIME_S - 12.0, 0.0)
    return 0.008 * (1.0 - np.exp(-since_s / rest_s) * np.cos(2.0 * np.pi * since_s / period_s))


def valves(rise_s):
    """Return what on/off valves do to a light load: 15 mm up and down, ended by a stop."""
    wanted = 0.018 * (np.sin(2.0 * TIME_S) > 0.0)
    state, column = 0.0, []
    for one in wanted:
        state += (one - state) / (rise_s * RATE_HZ)
        column.append(state)
    return np.clip(column, 0.0, 0.015)


def jumps_in(sentence):
    """Return the jumps in a sentence, a list of (size, time in s)."""
    return [(float(size), float(at_s))
            for size, at_s in re.findall(r'by ([-+][.\d]+) \w+ at ([.\d]+) s', sentence)]


@pytest.mark.parametrize('column, every, jumps', [
    (MOVED_M + stepped((15.0, 3e-3)), 1, [(3.0, 15.0)]),
    (MOVED_M + stepped((15.0, -4e-3)), 5, [(-4.0, 15.0)]),
    (np.round(SMOOTH_M, 5) + stepped((4.0, 2e-3), (25.0, 2.5e-3)), 1, [(2.0, 4.0), (2.5, 25.0)])])
def test_an_encoder_that_slips_is_told_with_time_and_size(column, every, jumps):
    sentence, = told('contraction_m', column, every)
    assert jumps_in(sentence) == [pytest.approx(one, abs=0.05) for one in jumps]
    assert 'Did the encoder slip?' in sentence


def test_a_slip_of_a_joint_is_told_in_radians():
    sentence, = told('angle_rad', 20.0 * MOVED_M + stepped((15.0, 0.1)))
    assert jumps_in(sentence) == [pytest.approx((0.1, 15.0), abs=1e-3)]


@pytest.mark.parametrize('every', [1, 5, 20])
@pytest.mark.parametrize('column', [
    MOVED_M, np.round(MOVED_M, 4), valves(0.01), valves(0.002) + 1e-5 * NOISE,
    MOVED_M + fallen(0.2, 0.05), MOVED_M + fallen(0.02, 0.02), fallen(0.1, 0.012),
    np.where(abs(TIME_S - 20.0) < 0.5, 0.0, MOVED_M + 0.02),        # drops out for a second
    np.where(abs(TIME_S - 20.0) < 0.003, 0.1, MOVED_M),             # a spike
    np.repeat(MOVED_M[::40], 40),                                   # a slow sensor
    np.full(TIME_S.size, 0.01), 0.01 * (TIME_S > 9.0)])
def test_fast_motion_and_a_sensor_that_drops_out_are_no_slip(column, every):
    assert told('contraction_m', column, every) == []


def test_a_step_across_a_gap_is_no_slip():
    column = MOVED_M + stepped((15.0, 5e-3))
    column[abs(TIME_S - 15.0) < 0.1] = np.nan
    assert told('contraction_m', column) == []


PRESSURE_PA = P_ATM_PA + 200e3 - 190e3 * np.cos(TIME_S) + 300.0 * NOISE


@pytest.mark.parametrize('name, column, words', [
    ('pressure_pa', PRESSURE_PA.clip(max=P_ATM_PA + 350e3), 'largest value, exactly 350 kPa gaug'),
    ('pressure_pa', PRESSURE_PA.clip(min=P_ATM_PA + 50e3), 'smallest value, exactly 50 kPa gauge'),
    ('contraction_m', MOVED_M.clip(max=0.02), 'largest value, exactly 20 mm'),
    ('force_n', 40.0 - 30.0 * np.cos(TIME_S) + NOISE.clip(max=0.0), ''),
    ('force_n', (40.0 - 30.0 * np.cos(TIME_S) + NOISE).clip(max=60.0), 'exactly 60 N')])
def test_a_clipped_sensor_is_told_with_value_and_share(name, column, words):
    sentences = told(name, column)
    assert len(sentences) == bool(words)
    if words:
        share = np.mean((column == column.max()) | (column == column.min()))
        assert words in sentences[0] and f'for {100.0 * share:.0f} % of the time' in sentences[0]


@pytest.mark.parametrize('name, column', [
    ('pressure_pa', PRESSURE_PA), ('pressure_pa', PRESSURE_PA.clip(max=P_ATM_PA + 395e3)),
    # A vented muscle, with and without noise; a coarse sensor; a simulation on its stop.
    ('pressure_pa', (PRESSURE_PA - 50e3).clip(min=P_ATM_PA)),
    ('pressure_pa', (PRESSURE_PA - 300.0 * NOISE - 50e3).clip(min=P_ATM_PA)),
    ('pressure_pa', np.round(PRESSURE_PA, -3).clip(max=P_ATM_PA + 350e3)),
    ('contraction_m', SMOOTH_M.clip(max=0.02)), ('contraction_m', SMOOTH_M.clip(min=0.005)),
    ('contraction_m', np.round(MOVED_M, 5).clip(max=0.02)),
    ('contraction_m', SMOOTH_M.clip(max=0.02) + 1e-5 * NOISE),
    ('ppr_voltage', (4.0 - 6.0 * np.cos(TIME_S) + 0.1 * NOISE).clip(0.0, 10.0)),
    ('force_n', np.repeat(40.0 - 30.0 * np.cos(TIME_S) + NOISE, 10)[:TIME_S.size].clip(max=55.0))])
def test_what_rests_at_a_limit_by_nature_is_not_clipped(name, column):
    assert told(name, column) == []


def table_of(path, **columns):
    """Write a table of a hanging mass, with columns in place of the usual ones."""
    known = {'t_s': TIME_S, 'u_V': 4.0 - 3.0 * np.cos(TIME_S),
             'p_kPa': 200.0 - 190.0 * np.cos(TIME_S) + 0.3 * NOISE, 'x_mm': 1e3 * MOVED_M,
             **columns}
    np.savetxt(path, np.column_stack(list(known.values()))[::5], '%.6f', ',', comments='',
               header=','.join(known))
    return path


MAPS = ['--map', 'ppr_voltage=u_V:V', '--map', 'pressure=p_kPa:kPa_gauge', '--map',
        'contraction=x_mm:mm']
FAULTS = {
    'clip': ({'p_kPa': 1e-3 * (PRESSURE_PA.clip(max=P_ATM_PA + 350e3) - P_ATM_PA)},
             'largest value, exactly 350 kPa gauge'),
    'silent': ({'u_V': np.where(TIME_S > 12.0, np.nan, 4.0 - 3.0 * np.cos(TIME_S))},
               'valve_signal: no value that can be used from 12.000 s to 29.995 s'),
    'slip': ({'x_mm': 1e3 * (MOVED_M + stepped((15.0, 4e-3)))}, 'Did the encoder slip?')}


@pytest.mark.parametrize('fault', ['', *FAULTS])
def test_import_and_every_verb_tell_of_a_fault(fault, tmp_path, capsys):
    columns, words = FAULTS.get(fault, ({}, ''))
    table = table_of(tmp_path / 'a.csv', **columns)
    bag = str(tmp_path / 'bag')
    for call in (['import', str(table), '--out', bag, *MAPS], ['info', bag],
                 ['report', bag, '--out', str(tmp_path / 'page.html')],
                 ['export', bag, '--out', str(tmp_path / 'b.csv')]):
        assert main(call) == bool(fault)
        said = capsys.readouterr().out
        assert said.count(words) == 1 if fault else 'remark' not in said, said
    if fault != 'slip':         # all tell by the same function
        return
    assert main(['gap', bag, '--model', 'dmsp_5_300_hanging_mass', '--seconds', '1', '--effects',
                 'coulomb_friction', '--out', str(tmp_path / 'gap'), '--json']) in (0, 1)
    remarks = json.loads(capsys.readouterr().out)['remarks']
    assert sum(words in one for one in remarks) == 1


@pytest.mark.parametrize('name, column', [
    ('pressure_pa', P_ATM_PA + 2e5 + 1e5 * np.sin(TIME_S) + 300.0 * NOISE),
    ('contraction_m', MOVED_M)])
def test_a_sensor_that_repeats_its_last_value_is_told(name, column):
    assert told(name, column) == []
    frozen = column.copy()
    frozen[8000:14_000] = frozen[8000]
    frozen[20_000:21_000] = frozen[20_000]
    said, = told(name, frozen)
    assert 'stands still at exactly' in said and 'from 8.00 to 14.00 s' in said
    assert 'and 1 more time, 7 s in all' in said
    # A few values are no dropout, and a coarse sensor repeats its values everywhere.
    few = column.copy()
    few[8000:8015] = few[8000]
    assert not any('stands still' in one for one in told(name, few))
    step = 0.02 * np.ptp(column)
    assert not any('stands still' in one for one in told(name, step * np.round(frozen / step)))


def test_a_model_without_noise_that_comes_to_rest_is_no_dropout():
    levels = np.repeat([1e5, 3e5, 2e5, 4e5, 1.5e5, 2.5e5], len(TIME_S) // 6)
    state, column = 1e5, []
    for one in levels:
        state += (one - state) * 0.05
        column.append(state)
    said = told('pressure_pa', P_ATM_PA + np.array(column))
    assert not any('stands still' in one for one in said)


def test_a_load_without_noise_that_sticks_and_glides_is_no_dropout():
    """Only where it slips does the force of such a model seem noisy."""
    slips = np.sin(TIME_S) > 0.2
    column = 30.0 + 5.0 * np.sin(0.3 * TIME_S) + np.where(slips, 0.05 * NOISE, 0.0)
    for begin in (1500, 8000, 20_500):          # while it slips
        column[begin:begin + 100] = column[begin]
    assert slips[[1490, 7990, 20_490]].all()
    assert not any('stands still' in one for one in told('force_n', column))
    # It rests at the weight of the load, again and again.
    column = 30.0 + 5.0 * np.sin(0.3 * TIME_S) + 0.05 * NOISE
    for begin in (1500, 8000, 20_500):
        column[begin:begin + 100] = 31.381
    assert not any('stands still' in one for one in told('force_n', column))
