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

"""``pam rig`` with a table: what the file takes from it, and what a reader is told of it."""

import re

from pam_actuation.cli.main import main
from pam_sim.muscle.law import ExtrapolationWarning
import pytest
from test_rig import new


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def forces_of(folder, begin_kpa=0):
    """Write a force map of 20 mm by 180 mm up to 30 % contraction, from a pressure on."""
    lines = ['pressure_kPa,length_mm,force_N']
    for kpa in range(begin_kpa, 601, 100):
        lines += [f'{kpa},{180.0 * (1.0 - 0.01 * percent):.2f},'
                  f'{max(0.0, 1.5 * kpa * (1.0 - percent / 30.0)):.3f}'
                  for percent in range(0, 31, 3)]
    (folder / 'forces.csv').write_text('\n'.join(lines) + '\n')
    return '--force-map', 'forces.csv', '--length-mm', '180', '--bore-mm', '20'


def test_a_file_that_is_refused_leaves_the_force_map_of_the_old_one(folder, capsys):
    new(*forces_of(folder))
    table = folder / 'made_force_map.csv'
    before = table.read_bytes(), sorted(folder.iterdir())
    options = forces_of(folder, begin_kpa=100)
    assert main(['rig', 'new', *options, '--regulator', 'nosuch', '--overwrite', '--out',
                 'made.yaml']) == 2
    assert 'nosuch' in capsys.readouterr().err
    assert (table.read_bytes(), sorted(folder.iterdir())) == before
    new(*options, '--overwrite')
    assert table.read_bytes() != before[0]


def test_a_table_above_0_kpa_says_what_a_vented_muscle_would_pull(folder, capsys):
    said = ('The table begins at 100 kPa, and below that its edge is used: a vented muscle would '
            'still pull 150 N at rest. Measure at 0 kPa as well')
    size = ('--length-m', '0.18', '--bore-m', '0.02', '--overwrite')
    options = forces_of(folder, begin_kpa=100)
    assert main(['characterise', 'forces.csv', *size, '--out', 'surfaces']) == 0
    assert capsys.readouterr().out.count(said) == 1
    for some in (options, ('--force-map', 'surfaces/lookup.csv')):
        rig = new(*some, '--overwrite')
        assert capsys.readouterr().out.count(said) == 1
        assert main(['rig', 'check', 'made.yaml']) == 0
        assert capsys.readouterr().out.count(said) == 1
        with pytest.warns(ExtrapolationWarning):
            assert float(rig.muscle.law.law.force_n(0.0, 0.0)) == pytest.approx(150.0, rel=0.01)
    # What the remark says to add is enough.
    text = (folder / 'forces.csv').read_text()
    (folder / 'forces.csv').write_text(text + ''.join(
        f'0,{row.split(",")[1]},0\n' for row in text.splitlines() if row.startswith('100,')))
    rig = new(*options, '--overwrite')
    assert main(['rig', 'check', 'made.yaml']) == 0
    assert 'vented' not in capsys.readouterr().out
    assert float(rig.muscle.law.law.force_n(0.0, 0.0)) < 1.0


def test_a_table_beyond_25_percent_moves_the_end_of_the_muscle(folder, capsys):
    options = forces_of(folder)
    rig = new(*options, '--known', 'mass_kg=0.1')
    assert 0.29 < rig.muscle.max_strain <= 0.301
    assert 'the largest contraction of the force map' in open('made.yaml', encoding='utf-8').read()
    assert 'max_strain' not in capsys.readouterr().out
    assert main(['rig', 'check', 'made.yaml']) == 0
    assert 'max_strain' not in capsys.readouterr().out
    # What the braid allows is more.
    rig = new(*options, '--angle-deg', '25', '--overwrite')
    assert rig.muscle.max_strain == pytest.approx(0.363)
    capsys.readouterr()
    assert new(*options, '--max-strain', '0.2', '--overwrite').muscle.max_strain == 0.2
    assert main(['rig', 'check', 'made.yaml']) == 0
    said = re.findall(r'The table goes to (.+) % contraction, but max_strain ends the muscle at '
                      r'(.+) %\.', capsys.readouterr().out)
    assert said == [said[0]] * 2 and 29.0 < float(said[0][0]) <= 30.1 and said[0][1] == '20'


def test_a_braid_whose_volume_is_largest_before_the_end_is_told(folder, capsys):
    text = 'load: hanging_mass\nmuscle: {like: dmsp_5_300, braid_angle_rad: 0.8'
    told = ('With a braid angle of 45.8 degrees the volume is largest at 17.1 % contraction, and '
            'max_strain is 25 %. Beyond that the simulated muscle pulls and compresses its air. '
            'State max_strain: 0.171, or the right braid_angle_rad.')
    for more, count in (('}', 1), (', max_strain: 0.171}', 0)):
        (folder / 'flat.yaml').write_text(f'{text}{more}\n')
        assert main(['rig', 'check', 'flat.yaml']) == 0
        assert capsys.readouterr().out.count(told) == count
    # A new file ends the muscle there.
    new('--muscle', 'dmsp_5_300', '--angle-deg', '45.8')
    assert 'With a braid angle' not in capsys.readouterr().out


def test_a_table_that_pulls_at_0_kpa_is_told(folder, capsys):
    options = forces_of(folder)
    new(*options)
    assert 'at 0 kPa' not in capsys.readouterr().out
    rows = [row.split(',') for row in (folder / 'forces.csv').read_text().splitlines()]
    # The sensor read 0 kPa at 100 kPa.
    (folder / 'forces.csv').write_text('\n'.join(
        [','.join(rows[0])] + [f'{float(kpa) - 100.0:g},{length},{force}'
                               for kpa, length, force in rows[1:] if kpa != '0']) + '\n')
    new(*options, '--overwrite')
    assert re.search(r'The table pulls up to 1[34]\d N at 0 kPa beyond 2 % contraction, so a '
                     r'vented muscle would hold a load up\.', capsys.readouterr().out)


@pytest.mark.parametrize('rig, said', [
    ('rig: dmsp_5_300_hanging_mass\nlaw: repperger\n',
     'Law `repperger` still pulls 179 N at 0 kPa, below the 207 kPa at which its numbers begin. '
     'It lets go at 13 % contraction.'),
    ('rig: dmsp_20_300_hanging_mass\nparameters: {force_map_gain: 2}\n',
     'Law `sarosi` still pulls 222 N at 0 kPa, below the 35 kPa at which its numbers begin. It '
     'lets go at 0.54 % contraction.'),
    ('rig: dmsp_5_300_hanging_mass\n', ''), ('rig: dmsp_10_250_hanging_mass\n', '')])
def test_a_law_that_pulls_in_a_vented_muscle_is_told(rig, said, folder, capsys):
    (folder / 'rig.yaml').write_text(rig)
    assert main(['rig', 'check', 'rig.yaml']) == 0
    out = capsys.readouterr().out
    assert out.count('at 0 kPa') == bool(said) and said in out


@pytest.mark.parametrize('law, angle, said', [
    ('chou_hannaford', 0.436, True), ('tondu_lopez', 0.436, True),
    ('chou_hannaford', 0.499, False),
    ('{name: chou_hannaford, parameters: {diameter_m: 0.02, braid_angle_rad: 0.436}}', 0.436,
     False), ('sarosi', 0.436, False)])
def test_a_law_with_the_braid_angle_of_another_muscle_is_told(law, angle, said, tmp_path, capsys):
    (tmp_path / 'own.yaml').write_text(
        f'muscle: {{like: dmsp_20_300, braid_angle_rad: {angle}, law: {law}}}\n'
        'load: hanging_mass\nvalve: ppr\n')
    assert main(['rig', 'check', str(tmp_path / 'own.yaml')]) == 0
    assert ('parameters: {diameter_m: 0.02, braid_angle_rad: 0.436}}' in capsys.readouterr().out
            ) == said
