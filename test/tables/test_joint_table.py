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

"""A joint with two muscles: its table has every signal of a muscle twice, and an angle."""

import json

import numpy as np
from pam_actuation.bags.load_joint import load_recording
from pam_actuation.cli.main import main
from pam_actuation.tables.signals import of_words
from pam_sim.units import P_ATM_PA
import pytest

TIME_S = 0.01 * np.arange(100)
SHARE = np.sin(2.0 * np.pi * TIME_S)
COLUMNS = {
    't [s]': TIME_S, 'p_flexor [kPa]': 200.0 + 150.0 * SHARE, 'p_extensor [kPa]': 200.0 - SHARE,
    'u_flexor [V]': 2.0 + 1.5 * SHARE, 'u_extensor [V]': 2.0 - 0.5 * SHARE,
    'F_flexor [N]': 20.0 + 5.0 * SHARE, 'knee angle [deg]': 30.0 * SHARE}
GAUGE = ['--map', 'flexor/pressure=p_flexor [kPa]:kPa_gauge',
         '--map', 'extensor/pressure=p_extensor [kPa]:kPa_gauge']


@pytest.fixture
def table(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.savetxt('knee.csv', np.column_stack([*COLUMNS.values()]), '%.6f', ',', comments='',
               header=','.join(COLUMNS))
    return 'knee.csv'


def test_it_becomes_the_recording_of_a_joint(table, capsys):
    assert main(['import', table, '--out', 'bag', *GAUGE, '--rig', 'joint_dmsp_5_300']) == 0
    assert 'angle: column "knee angle [deg]" in deg (unit deg by name)' in capsys.readouterr().out
    run = load_recording('bag')
    assert run.namespace == '/knee' and not run.remarks
    for topic, field, values in (
            ('flexor/pressure', 'pressure_pa', P_ATM_PA + 1e3 * COLUMNS['p_flexor [kPa]']),
            ('extensor/pressure', 'pressure_pa', P_ATM_PA + 1e3 * COLUMNS['p_extensor [kPa]']),
            ('flexor/valve_signal', 'ppr_voltage', COLUMNS['u_flexor [V]']),
            ('flexor/force', 'force_n', COLUMNS['F_flexor [N]']),
            ('joint_state', 'angle_rad', np.radians(COLUMNS['knee angle [deg]']))):
        np.testing.assert_allclose(run.topics[topic].values[field], values, rtol=1e-5, atol=1e-6)
    assert set(run.topics) == {f'{side}/{topic}' for side, topic in (
        ('flexor', 'pressure'), ('flexor', 'valve_signal'), ('flexor', 'force'),
        ('extensor', 'pressure'), ('extensor', 'valve_signal'))} | {'joint_state'}
    assert main(['info', 'bag']) == 0
    assert 'torque' not in capsys.readouterr().out


@pytest.mark.parametrize('options, words', [
    (['--map', 'angle=knee angle [deg]:mm'], "'mm' is no unit of an angle"),
    (['--map', 'pressure=p_flexor [kPa]:kPa_gauge', '--map', 'angle=knee angle [deg]:deg'],
     'pressure is the signal of a muscle alone, and others are of a joint; write flexor/pressure'),
    (['--map', 'flexor/fill_duty=u_flexor [V]:1'], 'flexor/vent_duty is not')])
def test_what_does_not_go_together_is_told(table, options, words, capsys):
    assert main(['import', table, '--out', 'bag', *GAUGE[2:], *options]) == 2
    assert words in capsys.readouterr().err


def test_ext_is_the_extensor_beside_a_column_of_the_flexor(table, capsys):
    text = open(table, encoding='utf-8').read().replace('extensor', 'ext').replace(
        'flexor', 'flex')
    for one, words in ((text, 'extensor/pressure in kPa_gauge'),
                       (text.replace('p_flex ', 'p_other ').replace('u_flex ', 'u_other '), '')):
        open(table, 'w', encoding='utf-8').write(one.replace(' [kPa]', ' [kPa gauge]'))
        assert main(['import', table, '--preview']) == 0
        said = capsys.readouterr().out
        assert ('extensor/' in said) == bool(words) and words in said


def test_a_joint_without_its_angle_is_refused(table, capsys):
    text = open(table, encoding='utf-8').read().replace('knee angle [deg]', 'other')
    open(table, 'w', encoding='utf-8').write(text)
    assert main(['import', table, '--out', 'bag', *GAUGE]) == 2
    assert 'none is its angle; add --map angle="COLUMN:deg"' in capsys.readouterr().err


def test_an_angle_beside_one_muscle_is_no_signal(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    np.savetxt('one.csv', np.column_stack([TIME_S, 5.0 + SHARE, SHARE]), '%.6f', ',', comments='',
               header='t_s,x_mm,angle_deg')
    assert main(['import', 'one.csv', '--preview']) == 0
    said = capsys.readouterr().out
    assert 'contraction in mm' in said and 'angle in' not in said


@pytest.mark.parametrize('words, path, signal', [
    ('p flexor', '', 'flexor/pressure'), ('extensor pressure', '', 'extensor/pressure'),
    ('pressure', '/knee/flexor', 'flexor/pressure'), ('f antagonist', '', 'extensor/force'),
    ('f ext', '', 'external_force'), ('knee angle', '', 'angle'),
    ('angle ref', '', 'reference_angle'), ('flexor extensor pressure', '', None)])
def test_words_of_a_joint(words, path, signal):
    found = of_words(words, path)
    assert (None if found is None else found.name) == signal


@pytest.mark.parametrize('ending', ['csv', 'tsv', 'parquet', 'mat', 'h5', 'npz', 'npy', 'xlsx'])
def test_a_joint_is_exported_as_a_whole_and_comes_back(table, ending, capsys):
    main(['import', table, '--out', 'bag', *GAUGE])
    assert main(['export', 'bag', '--out', f'out.{ending}']) == 0
    said = capsys.readouterr().out
    assert 'joint_state.angle_rad' in said and 'extensor/pressure.pressure_pa' in said
    assert main(['import', f'out.{ending}', '--out', 'back']) == 0
    first, second = load_recording('bag'), load_recording('back')
    assert set(first.topics) == set(second.topics) and len(first.topics) == 6
    for name, series in first.topics.items():
        np.testing.assert_array_equal(second.topics[name].stamp_ns, series.stamp_ns)
        for field, values in series.values.items():
            np.testing.assert_allclose(second.topics[name].values[field], values,
                                       rtol=1e-15 if ending == 'xlsx' else 0.0)


def test_topics_and_muscles_of_a_joint_are_chosen(table, capsys):
    main(['import', table, '--out', 'bag', *GAUGE])
    capsys.readouterr()
    assert main(['export', 'bag', '--out', 'a.csv', '--topics', 'joint_state',
                 '--namespace', '/knee', '--json']) == 0
    assert json.loads(capsys.readouterr().out)['columns'] == [
        'stamp_ns', 'time_s', 'joint_state.angle_rad']
    assert main(['export', 'bag', '--out', 'b.csv', '--namespace', '/knee/flexor', '--json']) == 0
    assert 'pressure.pressure_pa' in json.loads(capsys.readouterr().out)['columns']
    assert main(['export', 'bag', '--out', 'c.csv', '--topics', 'pressure']) == 2
    assert 'did you mean `flexor/pressure`' in capsys.readouterr().err
    assert main(['identify', 'bag', '--rig', 'dmsp_5_300_realistic']) == 2
    assert 'choose one with --namespace' in capsys.readouterr().err


def test_what_is_doubtful_names_the_muscle(table, capsys):
    columns = {**COLUMNS, 'p_flexor [kPa]': np.clip(150.0 * SHARE, 0.0, None),
               'x_flexor [mm]': 15.0 + np.clip(SHARE, 0.0, None)}
    np.savetxt('x.csv', np.column_stack([*columns.values()]), '%.6f', ',', comments='',
               header=','.join(columns))
    assert main(['import', 'x.csv', '--out', 'bag', *GAUGE]) == 1
    assert '--map flexor/contraction="x_flexor [mm]:mm:zero=15"' in capsys.readouterr().out
