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

"""A muscle longer than usual, or one that shortens by more: what an import and its bag say."""

import numpy as np
from pam_actuation.bags.info import bag_info
from pam_actuation.bags.load import load_run
from pam_actuation.cli.main import main
import pytest

LIFTED = np.clip(1.0 + 2.0 * np.sin(np.arange(400) / 20.0), 0.0, 1.0)     # mostly at the top


@pytest.fixture
def table(tmp_path, monkeypatch):
    """Return what writes m.csv with a column of a length."""
    monkeypatch.chdir(tmp_path)

    def write(name, values):
        (tmp_path / 'm.csv').write_text(f't_s,p_bar_gauge,{name}\n' + ''.join(
            f'{0.01 * k:.2f},{4.0 * p:.3f},{x:.3f}\n' for k, (p, x) in enumerate(
                zip(LIFTED, values))))
    return write


def remarks_on_contraction():
    return [one for one in bag_info('bag').remarks if 'contraction from' in one]


def rig_file(max_strain):
    with open('rig.yaml', 'w', encoding='utf-8') as stream:
        stream.write('muscle: {like: dmsp_20_300, length_m: 0.4, max_strain: %g}\n'
                     'load: hanging_mass\nvalve: ppr\n' % max_strain)
    return '--rig', 'rig.yaml'


def test_a_muscle_that_shortens_as_its_rig_says_is_left_alone(table, capsys):
    table('x_mm', 118.7 * LIFTED - 0.06)
    assert main(['import', 'm.csv', '--out', 'bag', *rig_file(0.35)]) == 0, capsys.readouterr()
    assert load_run('bag').implausible == ()
    assert not remarks_on_contraction()


def test_more_than_the_rig_says_is_told_with_the_way_out(table, capsys):
    table('x_mm', 118.7 * LIFTED - 0.06)
    assert main(['import', 'm.csv', '--out', 'bag', *rig_file(0.25)]) == 1
    said = capsys.readouterr().out
    assert 'leaves 0 to 100 mm (25 % of a 400 mm muscle' in said
    assert 'state `max_strain`' in said and 'share' not in said
    sentence, = load_run('bag').implausible
    assert 'by `max_strain` of its rig' in sentence and 'share' not in sentence


def test_without_a_rig_the_import_tells_it_and_the_bag_does_not(table, capsys):
    table('x_mm', 99.5 * LIFTED)
    assert main(['import', 'm.csv', '--out', 'bag']) == 1
    said = capsys.readouterr().out
    assert 'of a 300 mm muscle, as no rig is stated' in said and '--rig' in said
    assert load_run('bag').implausible == ()
    assert not remarks_on_contraction()


def test_a_length_in_the_mapping_is_kept(table, capsys):
    table('L_mm', 400.0 - 118.7 * LIFTED)
    option = 'contraction=L_mm:mm:zero=400:gain=-1'
    assert main(['import', 'm.csv', '--out', 'bag', '--map', option]) == 0, capsys.readouterr()
    assert load_run('bag').metadata['length_m'] == '0.4'
    assert not remarks_on_contraction()


@pytest.mark.parametrize('values, ways', [
    (100.0 * LIFTED + 200.0, ('zero=300:gain=-1', 'zero=200"')),
    (70.0 * LIFTED + 80.0, ('zero=150:gain=-1', 'zero=80"')),
    (100.0 * LIFTED + 60.0, ('zero=60"',)), (140.0 * LIFTED - 0.06, ('look for the unit',)),
    (160.0 * LIFTED, ('which no rig has', 'look for the unit'))])
def test_a_way_out_is_named_only_where_it_leads_out(table, capsys, values, ways):
    table('x_mm', values)
    assert main(['import', 'm.csv', '--out', 'bag']) == 2
    said = capsys.readouterr().err
    assert all(way in said for way in ways) and '--rig' in said, said
    for way in ('zero=', 'gain=-1'):
        assert (way in said) == any(way in one for one in ways), said


def test_a_bag_of_a_table_names_no_muscle_that_nobody_stated(tmp_path, capsys):
    table = tmp_path / 'run.csv'
    time_s = 0.01 * np.arange(300)
    np.savetxt(table, np.column_stack([time_s, 20.0 * np.sin(time_s) - 2.0]), '%.6f', ',',
               comments='', header='t_s,x_mm')
    assert main(['import', str(table), '--out', str(tmp_path / 'bag')]) == 1
    assert 'as no rig is stated' in capsys.readouterr().out
    main(['info', str(tmp_path / 'bag')])
    said = ''.join(capsys.readouterr())
    assert 'leaves 0 to 500 mm (no muscle shortens by more)' in said and '1163' not in said
