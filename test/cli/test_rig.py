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

"""``pam rig``: a described rig becomes a file that loads, simulates and says what is known."""

import json
import math
import os
from pathlib import Path
import pty
import re
import subprocess
import sys

from pam_actuation.cli.main import main
from pam_actuation.rig_files.questions import ask_description
from pam_actuation.rig_files.text import rig_file
from pam_sim import load_rig
from pam_sim.muscle.laws.lookup import SHIPPED
from pam_sim.tolerance import AbsoluteSd, UNKNOWN
from pam_sim.units import P_ATM_PA
from pam_sim.valve.regulator_presets import get_regulator, regulator_names
import pytest


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def new(*options):
    """Write a rig with options; return it."""
    assert main(['rig', 'new', '--out', 'made.yaml', *options]) == 0
    return load_rig('made.yaml')


def test_what_was_said_is_in_the_rig():
    rig = new('--muscle', 'dmsp_10_250', '--length-mm', '200', '--unknown', 'mass_kg=3',
              '--about', 'spring_n_per_m=200±50', '--about', 'T_m=0.05 +- 20%',
              '--known', 'damping_n_s_per_m=40', '--known', 'pressure_noise_pa=300',
              '--regulator-volts', '1:9', '--regulator-kpa', '0:500')
    assert (rig.name, rig.load, rig.valve) == ('made', 'hanging_mass', 'ppr')
    assert rig.muscle.length_m == 0.2 and rig.muscle.bore_m == 0.010
    assert rig.unknown == ('mass_kg',) and rig.parameters['mass_kg'] == 3.0
    assert rig.tolerance['spring_n_per_m'] == AbsoluteSd(50.0)
    assert rig.tolerance['T_m'] == 0.2 and rig.tolerance['damping_n_s_per_m'] == 0.0
    assert rig.sensors['pressure_noise_pa'] == 300.0
    wanted = {'K_m': 62500.0, 'ppr_lowest_v': 1.0, 'ppr_highest_v': 9.0, 'ppr_zero_pa': 0.0,
              'spring_n_per_m': 200.0, 'T_m': 0.05, 'damping_n_s_per_m': 40.0}
    assert wanted.items() <= rig.parameters.items()
    assert rig.tolerance['K_m'] == 0.02        # not said: that of the parameter


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
@pytest.mark.parametrize('load', ['hanging_mass', 'isometric', 'driven'])
def test_without_a_word_it_is_the_nominal_rig_with_its_numbers_in_comments(load, valve):
    rig = new('--load', load, '--valve', valve)
    unsure = {'T_m': 0.5, 'ppr_zero_pa': AbsoluteSd(12e3)} if valve == 'ppr' else {
        'C': 0.5, 'V_dead': 0.5}
    assert rig == load_rig(f'dmsp_5_300_{load}', valve=valve).with_(
        name='made', parameters={'vent_intake': 1.0},       # a vent of a real rig lets air in
        tolerance={'force_map_gain': 0.15, **unsure})
    text = open('made.yaml', encoding='utf-8').read()
    other = {'K_m', 'T_m'} if valve == 'hsv' else {'C', 'b', 'V_dead', 'supply_pa'}
    for parameter in rig.parameter_list:
        if parameter.name in other or valve == 'hsv' and parameter.name.startswith('ppr_'):
            continue
        if parameter.name in ('pwm_period_s', 'vent_intake') and valve == 'ppr':
            continue
        sign = '' if parameter.name in ('force_map_gain', *unsure) else '# '
        row = re.search(rf'^  {sign}{parameter.name}: (\S+) .*# (.*)$', text, re.M)
        assert row and float(row[1]) == parameter.default and parameter.allowed in row[2]
    # Without the comment sign each line states the same number.
    stated = re.sub(r'^  # (\w+: [-\d.e+]+ )', r'  \1', text, flags=re.M)
    open('stated.yaml', 'w', encoding='utf-8').write(stated)
    assert load_rig('stated.yaml').with_(name='made') == rig


def test_the_force_law_may_be_unknown(capsys):
    new('--muscle', 'dmsp_10_250', '--unknown', 'mass_kg')
    assert 'force law: its shape is exact' in capsys.readouterr().out
    rig = new('--muscle', 'dmsp_10_250', '--unknown', 'mass_kg', 'law', '--overwrite')
    assert 'force law' not in capsys.readouterr().out
    assert rig.unknown[0] == 'mass_kg' and 'law.a3' in rig.unknown and len(rig.unknown) == 7
    assert main(['rig', 'check', 'made.yaml']) == 0
    assert 'law.a3: unknown, -85.' in capsys.readouterr().out
    assert new('--unknown', 'law.a2_n', '--overwrite').unknown == ('law.a2_n',)
    assert main(['rig', 'new', '--out', 'other.yaml', '--unknown', 'law.a9']) == 2
    assert 'law.a9' in capsys.readouterr().err and not os.path.exists('other.yaml')


def test_the_volume_of_the_muscle_is_a_choice(folder, capsys):
    table = SHIPPED / 'dmsp_5_300.csv'
    assert new('--valve', 'hsv', '--force-map', str(table)).muscle.volume == 'bore'
    assert new('--overwrite', '--valve', 'hsv', '--force-map', str(table), '--volume',
               'law').muscle.volume == 'law'
    capsys.readouterr()
    assert main(['rig', 'new', '--volume', 'law', '--out', 'none.yaml']) == 2
    assert 'law `sarosi` has no volume of its own; these have: ' in capsys.readouterr().err
    assert main(['rig', 'new', '--volume', 'lav', '--out', 'none.yaml']) == 2
    assert '--volume: `lav` is not known (did you mean `law`?)' in capsys.readouterr().err
    assert not Path('none.yaml').exists()


@pytest.mark.parametrize('options, tolerance', [
    (['--muscle', 'dmsp_10_250'], 0.15), (['--length-mm', '200'], 0.15),
    (['--muscle', 'dmsp_10_250', '--unknown', 'law'], 0.02),
    (['--about', 'force_map_gain=1±5%'], 0.05), (['--known', 'force_map_gain=1.1'], 0.0),
    (['--unknown', 'force_map_gain'], UNKNOWN), (['--force-map', 'map.csv'], 0.02)])
def test_a_force_law_of_the_type_is_known_as_well_as_muscles_of_it_are_alike(
        options, tolerance, folder):
    from pam_sim.muscle.laws.lookup import SHIPPED
    (folder / 'map.csv').write_bytes((SHIPPED / 'dmsp_5_300.csv').read_bytes())
    assert new(*options).tolerance['force_map_gain'] == tolerance
    said = 'muscles of a type differ by 10 to 20 %'
    assert (said in open('made.yaml', encoding='utf-8').read()) == (tolerance == 0.15)


def test_another_bore_scales_the_force_map_and_says_so():
    rig = new('--bore-mm', '12')
    assert rig.muscle.bore_m == 0.012 and rig.muscle.law == load_rig(
        'dmsp_10_250_hanging_mass').muscle.law
    assert rig.parameters['force_map_gain'] == pytest.approx(1.44)
    assert rig.tolerance['force_map_gain'] == 0.2
    assert 'first guess' in open('made.yaml', encoding='utf-8').read()


def test_the_damping_of_another_bore_goes_by_cross_section_and_is_hardly_known():
    rig = new('--muscle', 'dmsp_10_250')
    assert rig.parameters['damping_n_s_per_m'] == 100.0
    assert rig.tolerance['damping_n_s_per_m'] == 0.5
    rig = new('--bore-mm', '30', '--unknown', 'damping_n_s_per_m', '--overwrite')
    assert rig.parameters['damping_n_s_per_m'] == 562.0     # that of the 40 mm preset times 9/16
    assert rig.unknown == ('damping_n_s_per_m',)
    # What is stated stays, and the nominal muscle is known.
    rig = new('--muscle', 'dmsp_40_300', '--known', 'damping_n_s_per_m=7', '--overwrite')
    assert rig.parameters['damping_n_s_per_m'] == 7.0
    nominal = new('--muscle', 'dmsp_5_300', '--overwrite')
    assert nominal.tolerance['damping_n_s_per_m'] == 0.02


@pytest.mark.parametrize('muscle', ['dmsp_5_300', 'dmsp_10_250', 'dmsp_20_300', 'dmsp_40_300'])
def test_damping_and_valves_are_those_of_the_preset_with_this_muscle(muscle):
    preset = load_rig(f'{muscle}_hanging_mass', valve='hsv')
    rig = new('--muscle', muscle, '--valve', 'hsv')
    for name in ('damping_n_s_per_m', 'C', 'V_dead'):
        assert rig.parameters[name] == preset.parameters[name], name
    assert rig.tolerance['C'] == rig.tolerance['V_dead'] == 0.5


def test_valves_go_by_the_size_of_the_muscle_unless_they_are_stated():
    rig = new('--muscle', 'dmsp_10_250', '--length-mm', '220', '--valve', 'hsv')
    assert rig.parameters['C'] == pytest.approx(7e-10 * 220 / 250, rel=1e-3)
    assert 'C: 6.16e-10' in (text := open('made.yaml', encoding='utf-8').read())
    assert 'not stated: that of dmsp_10_250_hanging_mass by volume' in text
    rig = new('--muscle', 'dmsp_10_250', '--valve', 'hsv', '--known', 'C=3e-10', '--unknown',
              'V_dead', '--overwrite')
    assert rig.parameters['C'] == 3e-10 and rig.tolerance['C'] == 0.0
    assert rig.unknown == ('V_dead',) and rig.parameters['V_dead'] == 3e-6


def test_a_check_says_what_is_nominal_and_not_of_this_size(folder, capsys):
    (folder / 'like.yaml').write_text(
        'muscle: {like: dmsp_10_250}\nload: hanging_mass\nvalve: hsv\n')
    assert main(['rig', 'check', 'like.yaml']) == 0
    said = capsys.readouterr().out
    assert ('damping_n_s_per_m: 25 N s/m is the nominal number, of a 5 mm muscle; for one of '
            '10 mm "pam rig new" writes 100, that of dmsp_10_250_hanging_mass by cross-section.'
            ) in said
    assert '"pam rig new" writes 7e-10' in said and 'V_dead: 3e-06 m3 is' not in said
    for preset in ('dmsp_5_300_hanging_mass', 'dmsp_10_250_hanging_mass'):
        assert main(['rig', 'check', preset]) == 0
        assert 'nominal' not in capsys.readouterr().out


def test_a_force_map_is_found_from_another_folder(folder, monkeypatch):
    from pam_sim.muscle.laws.lookup import SHIPPED
    (folder / 'maps').mkdir()
    (folder / 'maps' / "o'map.csv").write_bytes((SHIPPED / 'dmsp_5_300.csv').read_bytes())
    assert main(['rig', 'new', '--force-map', "maps/o'map.csv", '--out', 'rigs/a.yaml']) == 0
    (folder / 'elsewhere').mkdir()
    monkeypatch.chdir(folder / 'elsewhere')
    assert load_rig('../rigs/a.yaml').muscle.law.name == 'lookup'


@pytest.mark.filterwarnings('error')
def test_forces_measured_by_others_become_a_muscle(folder, capsys):
    lines = ['pressure_Pa,length_m,force_N']
    for gauge_pa in range(50_000, 650_000, 50_000):
        for contraction in (0.0, 0.04, 0.08, 0.12, 0.16, 0.2, 0.24):
            force_n = max(0.0, 2.5e-3 * gauge_pa * (1.0 - contraction / 0.25) - 30.0)
            lines.append(f'{gauge_pa},{0.3 * (1.0 - contraction)},{force_n:.3f}')
    (folder / 'others.csv').write_text('\n'.join(lines) + '\n')
    rig = new('--force-map', 'others.csv', '--length-mm', '300', '--bore-mm', '20')
    assert rig.muscle.law.name == 'lookup'
    # (49 N + 30 N) / (1 - 0.15 / 0.25) / 2.5 mN per Pa, from the formula above
    assert float(rig.static_pressure_pa(0.045)) - P_ATM_PA == pytest.approx(79e3, rel=0.03)
    assert (folder / 'made_force_map.csv').is_file()
    # As a user's first command does, in a process that has used no muscle before.
    subprocess.run(
        [sys.executable, '-m', 'pam_actuation.cli.main', 'rig', 'new', '--force-map', 'others.csv',
         '--length-mm', '300', '--bore-mm', '20', '--out', 'first.yaml'], check=True, timeout=60)
    assert (folder / 'first.yaml').read_text().count('first_force_map.csv') > 0
    before = sorted(path.name for path in folder.iterdir())
    assert main(['rig', 'new', '--force-map', 'others.csv', '--out', 'other.yaml']) == 2
    assert '--length-mm' in capsys.readouterr().err
    assert main(['rig', 'new', '--force-map', 'others.csv', '--length-mm', '300', '--bore-mm',
                 '20', '--load', 'driven', '--known', 'mass_kg=1', '--out', 'other.yaml']) == 2
    assert sorted(path.name for path in folder.iterdir()) == before


def test_the_strength_is_known_no_better_than_the_table_holds_its_points(folder, capsys):
    lines = ['pressure_kPa,contraction_percent,force_N']
    for gauge_kpa in range(0, 601, 100):
        for percent in (0, 5, 10, 15, 20, 25):
            force_n = max(0.0, gauge_kpa * (1.0 + 2.0 * 2.0 ** -percent) * (1.0 - percent / 25))
            lines.append(f'{gauge_kpa},{percent},{force_n:.3f}')
    (folder / 'others.csv').write_text('\n'.join(lines) + '\n')
    sizes = ('--length-mm', '200', '--bore-mm', '20')
    assert new('--force-map', 'others.csv', *sizes).tolerance['force_map_gain'] == 0.02
    capsys.readouterr()
    assert main(['characterise', 'others.csv', '--length-m', '0.2', '--bore-m', '0.02',
                 '--load-step-n', '550', '--out', 'rough', '--json']) == 0
    said = json.loads(capsys.readouterr().out)['remarks'][1]
    percent = float(said.split('(')[1].split(' %')[0])
    assert percent > 2.0
    rig = new('--force-map', 'rough/lookup.csv', *sizes, '--overwrite')
    assert rig.tolerance['force_map_gain'] == pytest.approx(0.01 * percent)
    assert 'what the table is off' in open('made.yaml', encoding='utf-8').read()
    stated = new('--force-map', 'rough/lookup.csv', '--about', 'force_map_gain=1±1%',
                 '--overwrite')
    assert stated.tolerance['force_map_gain'] == 0.01


def test_a_braid_of_another_angle_shortens_by_more(capsys):
    rig = new('--length-mm', '400', '--bore-mm', '20', '--angle-deg', '25')
    assert rig.muscle.max_strain == pytest.approx(0.363)
    stated = new('--length-mm', '400', '--bore-mm', '20', '--angle-deg', '25', '--max-strain',
                 '0.3', '--overwrite')
    assert stated.muscle.stroke_m == pytest.approx(0.12)
    for nominal in ((), ('--angle-deg', '28.6')):
        rig = new('--length-mm', '400', *nominal, '--overwrite')
        assert (rig.muscle.max_strain, rig.muscle.braid_angle_rad) == (
            0.25, pytest.approx(math.radians(28.6)))
    assert '# max_strain: 0.25' in open('made.yaml', encoding='utf-8').read()


def test_the_angle_of_the_braid_goes_into_table_and_rig(folder, capsys):
    lines = ['pressure_kpa,load_n,contraction_mm']
    for load_n in (0, 100, 200, 300):
        lines += [f'{kpa},{load_n},{max(0.0, 0.2 * (kpa - load_n / 2.0)):.2f}'
                  for kpa in range(0, 401, 25)]
    (folder / 'lifted.csv').write_text('\n'.join(lines) + '\n')
    assert main(['characterise', 'lifted.csv', '--length-m', '0.4', '--bore-m', '0.02',
                 '--angle-deg', '25', '--out', 'surfaces', '--json']) == 0
    assert 'braid of 25.0 degrees' in capsys.readouterr().out
    rig = new('--force-map', 'surfaces/lookup.csv')
    assert rig.muscle.braid_angle_rad == pytest.approx(math.radians(25.0))
    # What others measured is characterised with the angle that is stated.
    rig = new('--force-map', 'lifted.csv', '--length-mm', '400', '--bore-mm', '20',
              '--angle-deg', '25', '--overwrite')
    assert 'braid of 25.0 degrees' in open('made_force_map.csv', encoding='utf-8').read()


def test_a_table_says_what_it_does_not_know(folder, capsys):
    lines = ['pressure_kpa,load_n,contraction_mm']
    for load_n in (100, 200, 300):
        lines += [f'{kpa},{load_n},{max(0.0, 0.2 * (kpa - load_n / 2.0)):.2f}'
                  for kpa in range(0, 401, 25)]
    (folder / 'lifted.csv').write_text('\n'.join(lines) + '\n')
    sizes = ('--length-m', '0.4', '--bore-m', '0.02')
    assert main(['characterise', 'lifted.csv', *sizes, '--out', 'surfaces', '--json']) == 0
    summary = json.loads(capsys.readouterr().out)
    assert any(one.startswith('At 25 to 50 kPa no load was lifted') for one in summary['remarks'])
    new('--force-map', 'surfaces/lookup.csv')
    said = 'no load was lifted: the force at rest lies between 0 and 100.0 N'
    assert said in capsys.readouterr().out
    assert 'At 25 to 50 kPa no load was lifted' in open('made.yaml', encoding='utf-8').read()


def test_a_force_map_from_60_kpa_on_gives_no_warning(folder):
    from pam_sim.muscle.laws.lookup import SHIPPED
    lines = (SHIPPED / 'dmsp_5_300.csv').read_text(encoding='utf-8').splitlines(keepends=True)
    begins = next(k for k, line in enumerate(lines) if line.startswith('60'))
    names = next(k for k, line in enumerate(lines) if not line.startswith('#'))
    (folder / 'map.csv').write_text(''.join((*lines[:names + 1], *lines[begins:])), 'utf-8')
    assert new('--force-map', 'map.csv').muscle.law.name == 'lookup'


def test_a_table_of_pam_characterise_tells_the_size_of_its_muscle(folder):
    from pam_sim.muscle.laws.lookup import SHIPPED
    text = (SHIPPED / 'dmsp_5_300.csv').read_text(encoding='utf-8')
    (folder / 'map.csv').write_text(text.replace('300 mm, bore 5 mm', '250 mm, bore 10 mm', 1))
    muscle = new('--force-map', 'map.csv').muscle
    assert (muscle.length_m, muscle.bore_m) == (0.25, 0.01)
    stated = new('--force-map', 'map.csv', '--length-mm', '200', '--overwrite').muscle
    assert (stated.length_m, stated.bore_m) == (0.2, 0.005)
    for option, value, name in (('--max-strain', '0.3', 'max_strain'),
                                ('--angle-deg', '25', 'braid_angle_rad')):
        muscle = new('--force-map', 'map.csv', option, value, '--overwrite').muscle
        assert (muscle.length_m, muscle.bore_m) == (0.25, 0.01)
        assert getattr(muscle, name) == pytest.approx(
            0.3 if name == 'max_strain' else math.radians(25.0))


@pytest.mark.parametrize('name', regulator_names())
def test_a_data_sheet_gives_the_pressures_and_asks_for_what_it_lacks(name, capsys):
    sheet = get_regulator(name)
    assert 'http' in sheet.rests_on and sheet.lowest_v is None
    assert main(['rig', 'new', '--out', 'x.yaml', '--regulator', name]) == 2
    assert '--regulator-volts' in capsys.readouterr().err
    rig = new('--regulator', name, '--regulator-volts', '0:10')
    ends = [rig.with_(parameters={'T_m': 0.01}).simulate([volts] * 1000).true_pressure_pa[-1]
            - 101_325.0 for volts in (0.0, 10.0)]
    assert ends == pytest.approx([sheet.lowest_gauge_pa, sheet.highest_gauge_pa], abs=1.0)
    range_pa = sheet.highest_gauge_pa - sheet.lowest_gauge_pa
    assert rig.prior_sd('ppr_zero_pa') == max(sheet.lowest_gauge_pa, 0.02 * range_pa)
    # An unknown zero of the sensor has the regulator as its reference.
    rig = new('--regulator', name, '--regulator-volts', '0:10', '--unknown', 'pressure_zero_pa',
              '--overwrite')
    assert rig.prior_sd('ppr_zero_pa') == sheet.lowest_gauge_pa


def test_a_regulator_is_the_exact_reference_of_an_unknown_zero(folder):
    rig = new('--regulator-kpa', '0:600', '--unknown', 'pressure_zero_pa')
    assert rig.tolerance['ppr_zero_pa'] == 0.0
    assert new('--regulator-kpa', '0:600', '--overwrite').prior_sd('ppr_zero_pa') == 12e3


@pytest.mark.parametrize('options, kpa, said', [
    (['--regulator-volts=-1:6'], '85.7', 'The valve driver refuses this rig: at most 10 kPa'),
    (['--regulator', 'smc_itv1030', '--regulator-volts', '0:10'], '5.0', 'A dump valve empties'),
    (['--regulator-volts', '1:9'], '', '')])
def test_a_remark_tells_what_0_v_leaves_in_the_muscle(
        options, kpa, said, folder, capsys):
    for words in (['new', '--out', 'made.yaml', '--known', 'mass_kg=5', *options],
                  ['check', 'made.yaml']):
        assert main(['rig', *words, '--json']) == 0
        remarks = json.loads(capsys.readouterr().out)['remarks']
        told = [one for one in remarks if 'a loss of power leaves' in one]
        assert len(told) == bool(kpa)
        assert all(f'keeps {kpa} kPa gauge' in one and said in one for one in told)


@pytest.mark.parametrize('options, said', [
    (['--known', 'mass_kg=-3'], '0.1 to 500 kg'),
    (['--known', 'mass_kg=nan'], '0.1 to 500 kg'),
    (['--known', 'mass_kg=heavy'], 'heavy'),
    (['--known', 'mass_kg'], 'no value'),
    (['--known', 'mass_kg=1±1'], 'not a number alone'),
    (['--about', 'mass_kg=3'], 'not a number with ±'),
    (['--about', 'mass_kg=3±-1'], '{sd: 0 to 499.9 kg}'),
    (['--about', 'mass_kg=3±200%'], '0 to 1 (relative)'),
    (['--unknown', 'mass_kg=1±1'], 'nothing'),
    (['--about', 'pressure_zero_pa=0±5%'], '5 % of 0 is 0; write 0+-NUMBER, in Pa'),
    (['--unknown', 'mas_kg'], 'did you mean `mass_kg`'),
    (['--unknown', 'pressure_noise_pa'], 'unknown parameter'),
    (['--unknown', 'mass_kg', '--known', 'mass_kg=1'], 'stated twice'),
    (['--unknown', 'mass_kg', '--load', 'isometric'], 'allowed: force_map_gain'),
    (['--known', 'K_m=9e4', '--regulator-kpa', '0:500'], 'K_m'),
    (['--regulator-volts', '0-10'], 'LOW:HIGH'), (['--regulator-volts', '10:0'], 'below'),
    (['--regulator-volts', '0:10', '--regulator-kpa', '0:9000'], 'K_m'),
    (['--regulator', 'smc'], 'smc_itv1030'), (['--regulator-kpa', 'nan:5'], 'below'),
    (['--valve', 'hsv', '--regulator-volts', '0:10'], 'no regulator'),
    (['--muscle', 'dsmp'], 'dmsp_5_300'), (['--load', 'hung'], 'hanging_mass'),
    (['--bore-mm', '90'], '17.9 to 89.4 mm'), (['--force-map', 'none.csv'], 'none.csv'),
    (['--known', 'valve_dead_zone.open_time_s=0.3'], '0 to 0.02 s'),
    (['--known', 'valve_dead_zone.open_time=0.003'], 'did you mean `open_time_s`'),
    (['--known', 'valve_ded_zone.open_time_s=0.003'], 'did you mean `valve_dead_zone`'),
    (['--known', 'valve_dead_zone.open_time_s=0.001', 'valve_dead_zone.open_time_s=0.002'],
     'stated twice'),
    (['--unknown', 'valve_dead_zone.open_time_s'], 'pam identify'),
    (['--out', 'rig.txt'], '.yaml'), (['rig.yaml'], 'rig.yaml')])
def test_a_mistake_is_one_sentence_and_nothing_is_written(options, said, folder, capsys):
    assert main(['rig', 'new', '--out', 'x.yaml', *options]) == 2
    error = capsys.readouterr().err
    assert said in error and error.count('\n') == 1
    assert list(folder.iterdir()) == []


def test_a_file_is_kept_unless_it_may_be_replaced(capsys):
    new('--known', 'mass_kg=2')
    assert main(['rig', 'new', '--out', 'made.yaml', '--known', 'mass_kg=3']) == 2
    assert '--overwrite' in capsys.readouterr().err
    assert load_rig('made.yaml').parameters['mass_kg'] == 2.0
    assert new('--known', 'mass_kg=3', '--overwrite').parameters['mass_kg'] == 3.0


def test_the_next_command_works(capsys):
    new('--load', 'isometric')
    command = capsys.readouterr().out.rpartition('next: pam ')[2].split()
    assert main(command) == 0
    new('--unknown', 'mass_kg', '--overwrite')
    assert 'next: pam identify RUN --rig made.yaml' in capsys.readouterr().out
    for options in (['--load', 'isometric'], ['--unknown', 'mass_kg']):
        assert main(['rig', 'new', *options, '--out', 'my rig.yaml', '--overwrite']) == 0
        assert "--rig 'my rig.yaml'" in capsys.readouterr().out


def test_questions_come_again_until_the_answer_is_possible():
    answers = iter(['dsmp', 'own', '5', '200', '', 'hanging_mass', '-1', 'unknown', '300±100',
                    'ppr', 'smc_itv1050', '0-10', '0:10', '', '200', '', ''])
    told = []
    described = ask_description(lambda question: next(answers), told.append)
    described.work_out()
    text, rig = rig_file(described, 'asked.yaml')
    assert next(answers, None) is None
    assert len([line for line in told if line.startswith('  ')]) == 4
    assert rig.muscle.length_m == 0.2 and rig.muscle.bore_m == 0.005
    assert rig.tolerance['mass_kg'] == UNKNOWN
    assert rig.tolerance['spring_n_per_m'] == AbsoluteSd(100.0)
    assert rig.parameters['K_m'] == pytest.approx(89_500.0)
    assert rig.sensors['pressure_noise_pa'] == 200.0 and text.startswith('# A rig')


@pytest.mark.parametrize('answer, length_m, muscle', [
    ('200', 0.2, '  length_m: 0.2\n'), ('', 0.3, 'muscle: dmsp_20_300\n'),
    ('300', 0.3, 'muscle: dmsp_20_300\n')])
def test_the_length_of_a_listed_muscle_is_asked_for(answer, length_m, muscle):
    answers = iter(['dmsp_20_300', '5', answer])
    asked, told = [], []

    def reply(question):
        asked.append(question)
        return next(answers, '')
    described = ask_description(reply, told.append)
    described.work_out()
    text, rig = rig_file(described, 'asked.yaml')
    assert rig.muscle.length_m == length_m and rig.muscle.bore_m == 0.02 and muscle in text
    assert sum('Length at rest' in one and '[300]' in one for one in asked) == 2
    assert any('20 to 9000 mm' in one for one in asked) and any('0.02' in one for one in told)


def test_a_terminal_is_asked_and_an_early_end_writes_nothing(folder):
    above, below = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, '-m', 'pam_actuation.cli.main', 'rig', 'new'], cwd=folder,
        stdin=below, stdout=below, stderr=subprocess.PIPE)
    os.close(below)
    os.write(above, b'dmsp_10_250\n\x04')
    try:
        _, error = process.communicate()
    finally:
        process.kill()
        os.close(above)
    assert process.returncode == 2 and b'nothing was written' in error
    assert list(folder.iterdir()) == []
