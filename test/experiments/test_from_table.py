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

"""A column of a table as an experiment: a gait that was measured, in percent or in seconds."""

import json

import numpy as np
from pam_actuation.cli.main import main
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.primitives.knee_gait import knee_flexion_deg
import pytest

KNEE = np.array([knee_flexion_deg(k / 100.0)[0] for k in range(101)])


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Return an empty folder, the current one."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(path, columns):
    """Write a CSV of columns by name."""
    rows = zip(*columns.values())
    path.write_text('\n'.join([','.join(columns), *(
        ','.join(f'{value:.6g}' for value in row) for row in rows), '']))


def made(*words):
    """Run ``pam experiments --samples``; return the experiment."""
    assert main(['experiments', '--samples', *words]) == 0
    out = words[words.index('--out') + 1] if '--out' in words else f'{words[0][:-4]}.yaml'
    return load_experiment(out)


def test_a_gait_in_percent_becomes_strides_of_the_muscle(here, capsys):
    write(here / 'gait.csv', {'percent': range(101), 'knee (deg)': KNEE})
    one = made('gait.csv', '--map', 'contraction=knee (deg)', '--range', '4:20', '--period',
               '1.25', '--cycles', '8', '--out', 'stride.yaml')
    told = capsys.readouterr().out
    assert 'stride: 4 to 20 mm, 8 cycles of 1.25 s' in told and 'next: pam simulate' in told
    assert one.name == 'stride' and one.domain == 'contraction' and not one.remarks('ppr')
    assert one.cycles == (4.0, 1.25, 8) and one.duration_s == pytest.approx(14.5)
    assert one.chain.extremes() == pytest.approx((0.0, 0.02), abs=1e-6)
    wanted = 0.004 + 0.016 * (KNEE - KNEE.min()) / np.ptp(KNEE)
    for stride in (0, 3, 7):
        found = [one.at(4.0 + 1.25 * (stride + k / 100.0))[0] for k in range(100)]
        assert found == pytest.approx(wanted[:100], abs=3e-5)


def test_a_recording_keeps_its_time_and_unit_and_loses_its_noise(here, capsys):
    t_s = np.arange(0.0, 6.0, 0.002)
    clean = np.interp(t_s % 1.0, np.linspace(0.0, 1.0, 101), KNEE)
    noisy = clean + np.random.default_rng(3).normal(0.0, 1.0, len(t_s))
    write(here / 'mocap.csv', {'t_ms': 1e3 * t_s, 'knee': noisy})
    arguments = ('mocap.csv', '--map', 'angle=knee:deg', '--map', 'time=t_ms:ms', '--from', '1',
                 '--to', '5.2', '--overwrite')
    rough = made(*arguments)
    assert 'if that is noise of the measurement, add --lowpass 6' in capsys.readouterr().out
    smooth = made(*arguments, '--lowpass', '6')
    assert '--lowpass' not in capsys.readouterr().out and smooth.domain == 'joint_angle'
    truth = np.radians([np.interp((1.0 + k / 100.0) % 1.0, np.linspace(0.0, 1.0, 101), KNEE)
                        for k in range(420)])
    errors = [np.degrees([one.at(4.0 + k / 100.0)[0] for k in range(420)]) - np.degrees(truth)
              for one in (rough, smooth)]
    assert np.std(errors[0]) > 0.8 and np.std(errors[1]) < 0.5 and abs(errors[1].mean()) < 0.1


def test_the_low_pass_has_the_cut_off_it_is_asked_for(here):
    t_s = np.arange(0.0, 20.0, 0.005)
    write(here / 'sine.csv', {'t': t_s, 'x': 10.0 + 4.0 * np.sin(2.0 * np.pi * 3.0 * t_s)})
    one = made('sine.csv', '--map', 'contraction=x:mm', '--lowpass', '3')
    values = [one.at(10.0 + k / 1000.0)[0] for k in range(5000)]
    assert np.ptp(values) == pytest.approx(0.008 / np.sqrt(2.0), rel=0.01)


def test_pressures_are_gauge_for_people_and_absolute_in_the_file(here, capsys):
    write(here / 'p.csv', {'t': np.arange(0.0, 3.0, 0.05), 'p': np.linspace(1.0, 4.0, 60) ** 2})
    one = made('p.csv', '--map', 'pressure=p', '--range', '300:100', '--json')
    assert json.loads(capsys.readouterr().out)['remarks'][0].startswith('100 to 300 kPa gauge')
    assert one.at(4.0)[0] == 401325.0 and one.at(one.duration_s)[0] == 201325.0


def test_a_range_may_begin_below_zero(here):
    write(here / 'knee.csv', {'t': np.arange(101) / 50.0, 'knee': KNEE})
    one = made('knee.csv', '--map', 'angle=knee', '--range', '-15:15')
    assert np.degrees(one.chain.extremes()) == pytest.approx((-15.0, 15.0), abs=0.01)


@pytest.mark.parametrize('words, told', [
    (['--map', 'contraction=knee'], 'the unit is missing: write SIGNAL="COLUMN:UNIT", or add'),
    ([], 'say what is followed, such as --map contraction="COLUMN:mm"'),
    (['--map', 'contraction=ankle:mm'], 'there is no column "ankle"'),
    (['--map', 'force=knee:deg'], "'deg' is no unit of a force"),
    (['--map', 'fill_duty=knee:1'], 'an experiment follows one signal, and fill_duty is mapped'),
    (['--map', 'contraction=knee:mm'], 'allowed for contraction is 0 to 0.25 m'),
    (['--map', 'contraction=knee', '--range', '4-20'], "'4-20' is not LOW:HIGH"),
    (['--map', 'contraction=knee', '--range', '4:20', '--to', '0.3', '--cycles', '2'],
     'of its range away from where it begins, and is to be repeated; choose one whole cycle'),
    (['--map', 'contraction=knee', '--range', '4:20', '--from', '7'], '0 numbers of column'),
    (['--map', 'contraction=flat', '--range', '4:20'], 'the values do not change'),
    (['--map', 'contraction=knee', '--range', '4:20', '--out', 'x.csv'], 'must end with .yaml')])
def test_what_cannot_be_followed_is_told_in_a_sentence(here, capsys, words, told):
    write(here / 'gait.csv', {'t': np.arange(101) / 100.0, 'knee': KNEE - 10.0,
                              'flat': np.ones(101)})
    try:
        assert main(['experiments', '--samples', 'gait.csv', *words]) == 2
    except SystemExit as end:       # options are refused by the parser
        assert end.code == 2
    said = capsys.readouterr().err
    assert told in said and said.count('\n') == 1 and not (here / 'gait.yaml').exists()


def test_options_that_need_a_table_are_refused_without_one(here, capsys):
    assert main(['experiments', '--range', '4:20']) == 2
    assert '--range: add --samples FILE' in capsys.readouterr().err


def test_a_long_recording_stays_a_file_that_can_be_loaded(here, capsys):
    t_s = np.arange(0.0, 400.0, 0.02)
    write(here / 'long.csv', {'t': t_s, 'x': 10.0 + 4.0 * np.sin(0.3 * t_s)})
    one = made('long.csv', '--map', 'contraction=x:mm')
    assert 'one value each 27 ms' in capsys.readouterr().out
    again = load_experiment(one.to_yaml())      # as a bag keeps it
    assert again.at(200.0) == one.at(200.0)
    assert one.at(204.0)[0] == pytest.approx(0.01 + 0.004 * np.sin(0.3 * 200.0), abs=1e-6)


def test_a_gap_in_the_table_is_told_and_a_spike_is_refused_with_a_way_on(here, capsys):
    t_s = np.arange(0.0, 6.0, 0.01)
    knee = 30.0 + 20.0 * np.sin(2.0 * np.pi * t_s)
    kept = ~((t_s > 2.0) & (t_s < 3.2)) & ~((t_s > 4.0) & (t_s < 4.3))
    write(here / 'gap.csv', {'t': t_s[kept], 'knee': knee[kept]})
    made('gap.csv', '--map', 'contraction=knee', '--range', '4:20')
    told = capsys.readouterr().out
    assert 'no values for 1.2 s from 2 s on, and 1 more gap; the motion goes smoothly' in told
    write(here / 'whole.csv', {'t': t_s, 'knee': knee})
    made('whole.csv', '--map', 'contraction=knee', '--range', '4:20')
    assert 'no values' not in capsys.readouterr().out
    knee[300] = 400.0
    write(here / 'spike.csv', {'t': t_s, 'knee': knee})
    assert main(['experiments', '--samples', 'spike.csv', '--map', 'contraction=knee', '--range',
                 '4:20']) == 2
    said = capsys.readouterr().err
    assert 'spike.csv: samples moves at 2.' in said and '--lowpass takes single wrong' in said
    assert not (here / 'spike.yaml').exists()
