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

"""A file as a lab keeps it: what its columns are, and a zero of the encoder that is not set."""

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.bags.plausibility import Size
from pam_actuation.cli.main import main
from pam_actuation.tables.guess import Guess, guess
from pam_actuation.tables.mapping import column_of_text, TableMapping
from pam_actuation.tables.plausible import doubts
from pam_actuation.tables.preview import how_to_begin
from pam_actuation.tables.signals import is_time, of_words, signal_of, SIGNALS
from pam_actuation.tables.table import Table
from pam_actuation.tables.words import unit_in, words_of
from pam_sim.errors import InputError
from pam_sim.units import P_ATM_PA
import pandas as pd
import pytest

PRESSURE_PA = P_ATM_PA + np.repeat([2e3, 3e5, 4e5], 20)
STAMP_NS = np.arange(60)
SHORTENED_M = np.repeat([0.0, 0.03, 0.04], 20)


@pytest.mark.parametrize('column', [
    'valve cmd [V]', 'regulator_set_point_V', 'U_valve (V)', 'prop valve input [V]', 'dac_cmd_V'])
def test_a_voltage_to_the_regulator_in_many_words(column):
    assert next(one.name for one in SIGNALS if one.is_named(words_of(column))) == 'ppr_voltage'


@pytest.mark.parametrize('column, signal', [
    ('force_sensor', 'force'), ('Druck_bar', 'pressure'), ('Presión (bar)', 'pressure'),
    ('压力（kPa）', 'pressure'), ('압력(kPa)', 'pressure'), ('変位[mm]', 'contraction'),
    ('Siła [N]', 'force'), ('Druck soll (bar)', 'pressure_command'), ('角度(deg)', 'angle'),
    ('Tension (N)', 'force'), ('Spannung [V]', 'ppr_voltage'), ('position_weg', None)])
def test_columns_in_the_language_of_the_lab(column, signal):
    found = of_words(words_of(column))
    assert (found and found.name) == signal


@pytest.mark.parametrize('column, signal', [
    ('Zugkraft [N]', 'force'), ('Seilkraft_N', 'force'), ('Kraftaufnehmer [N]', 'force'),
    ('Muskeldruck [bar]', 'pressure'), ('Muskelinnendruck_kPa', 'pressure'),
    ('Muskelsolldruck [bar]', 'pressure_command'), ('Versorgungsdruck [bar]', 'supply_pressure'),
    ('Sollwert Regler [V]', 'ppr_voltage'), ('Sollspannung [V]', 'ppr_voltage'),
    ('Stellgröße [V]', 'ppr_voltage'), ('Stellgroesse_V', 'ppr_voltage'),
    ('Drucksollwert [V]', 'ppr_voltage'), ('Drucksollwert [bar]', 'pressure_command'),
    ('Sollwert [mm]', 'reference'), ('Hub_mm', 'contraction'), ('Hubweg [mm]', 'contraction'),
    ('contraction_mm', 'contraction'), ('Störkraft [N]', 'external_force'),
    ('muscle pull force [N]', 'force'),
    ('setpoint [V]', 'ppr_voltage'), ('regulator command [V]', 'ppr_voltage'),
    ('Force de traction [N]', 'force'), ('Tension de commande [V]', 'ppr_voltage'),
    ("Pression d'alimentation [bar]", 'supply_pressure'), ('Course [mm]', 'contraction'),
    ('Pressione del muscolo [bar]', 'pressure'), ('Tensione di comando [V]', 'ppr_voltage'),
    ('Fuerza de tracción [N]', 'force'), ('Señal de mando [V]', 'ppr_voltage'),
    ('Kniewinkel [°]', 'angle')])
def test_compound_words_and_units_say_what_a_column_is(column, signal):
    assert of_words(words_of(column), '', unit_in(column)).name == signal


@pytest.mark.parametrize('word', [
    'contraction', 'traction', 'compression', 'expression', 'composition', 'flange', 'stopsignal',
    'tension', 'displacement', 'setpoint', 'ballast', 'readposition'])
def test_an_english_word_is_no_compound(word):
    assert words_of(f'{word}_mm') in (word, {'traction': 'pull'}.get(word))


@pytest.mark.parametrize('column', [
    'Federkraft [N]', 'spring force [N]', 'Luftdruck [hPa]', 'ambient pressure [bar]',
    'Sensorspannung [V]', 'Referenzspannung [V]', 'Versorgungsspannung [V]', 'Muskelspannung [mV]',
    'Regler Istwert [V]', 'Druckregler [bar]', 'Kraft Weg [N]', 'Sollwert', 'Temperatur [°C]',
    'Muskellänge [mm]', 'github', 'Spannung 1 [V]', 'Stellgröße [%]'])
def test_what_may_be_of_something_else_is_not_taken_for_a_signal(column):
    assert of_words(words_of(column), '', unit_in(column)) is None


def test_a_table_of_a_german_lab_is_read_by_its_names():
    columns = {name: pd.Series(values) for name, values in (
        ('Zeit [s]', 0.01 * STAMP_NS), ('Sollwert Regler [V]', np.repeat([0.0, 6.0, 8.0], 20)),
        ('Muskeldruck [bar]', 1e-5 * (PRESSURE_PA - P_ATM_PA)),
        ('Absolutdruck Versorgung [bar]', 6.0 + 0.01 * STAMP_NS),
        ('Zugkraft [N]', 40.0 + STAMP_NS), ('Federkraft [N]', 9.0 + STAMP_NS))}
    found = guess([Table('m.csv', columns)], TableMapping())
    assert not found.questions
    assert {name: (one.column, one.unit.name) for name, one in found.mapping.signals.items()} == {
        'ppr_voltage': ('Sollwert Regler [V]', 'V'), 'force': ('Zugkraft [N]', 'N'),
        'pressure': ('Muskeldruck [bar]', 'bar_gauge'),
        'supply_pressure': ('Absolutdruck Versorgung [bar]', 'bar_abs')}


def test_advice_pairs_a_column_with_a_signal_of_its_unit():
    columns = {'A [V]': np.arange(9.0), 'B [N]': np.arange(9.0), 'C [mm]': np.arange(9.0),
               'D [psi]': np.arange(9.0), 'E [MPa]': 0.2 + np.arange(9.0)}
    tables = [Table('m.csv', {name: pd.Series(values) for name, values in columns.items()})]
    assert how_to_begin(tables, Guess(TableMapping())) == (
        '--map pressure="D [psi]:psi_gauge" --map contraction="C [mm]:mm" --map force="B [N]:N"')
    del tables[0].columns['D [psi]']
    tables[0].columns['C [mm]'] = pd.Series(250.0 + np.arange(9.0))
    assert '"C [mm]:mm:zero=258:gain=-1"' in how_to_begin(tables, Guess(TableMapping()))
    assert '"E [MPa]:MPa_gauge" (or MPa_abs)' in how_to_begin(tables, Guess(TableMapping()))
    only = [Table('m.csv', {'A [V]': pd.Series(np.arange(9.0))})]
    assert how_to_begin(only, Guess(TableMapping())) == '--map SIGNAL="COLUMN:UNIT"'


def test_a_column_that_may_be_a_signal_is_told(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    rows = ''.join(f'{0.01 * k:.2f},{k % 9},{40 + k % 7},{k % 5}\n' for k in range(200))
    (tmp_path / 'a.csv').write_text(f't_s,x_mm,Federkraft [N],rest [m2]\n{rows}')
    option = '--map force="Federkraft [N]:N"'
    for more in (['--preview'], ['--out', 'bag']):
        assert main(['import', 'a.csv', *more]) == 0
        assert option in capsys.readouterr().out
    assert main(['import', 'a.csv', '--preview', '--map', 'force=rest [m2]:N']) == 0
    assert option not in capsys.readouterr().out


@pytest.mark.parametrize('column, values, answers', [
    ('Laenge_mm', 200.0 - 1e3 * SHORTENED_M, ['mm:zero=200:gain=-1']),
    ('Länge [mm]', 200.0 - 1e3 * SHORTENED_M, ['mm:zero=200:gain=-1']),
    ('L_mm', 300.2 - 1e3 * SHORTENED_M, ['mm:zero=300.2:gain=-1']),
    ('muscle length [m]', 0.3 - SHORTENED_M, ['m:zero=0.3:gain=-1']),
    ('Longueur du muscle (cm)', 25.0 - 1e2 * SHORTENED_M, ['cm:zero=25:gain=-1']),
    ('length', 200.0 - 1e3 * SHORTENED_M, ['mm:zero=200:gain=-1']),
    ('length', 0.2 - SHORTENED_M, ['m:zero=0.2:gain=-1']),
    ('Länge [mm]', 1e3 * SHORTENED_M, []), ('Länge [mm]', 0.0 * SHORTENED_M + 200.0, []),
    ('Länge [mm]', 5e3 - 1e3 * SHORTENED_M, []), ('Länge [V]', 5.0 - SHORTENED_M, []),
    ('hose length [mm]', 200.0 - 1e3 * SHORTENED_M, []),
    ('L', np.array(['left', 'right'] * 30), [])])
def test_a_length_in_place_of_the_contraction_is_asked_for(column, values, answers):
    tables = [Table('m.csv', {
        'p_bar': pd.Series(1e-5 * (PRESSURE_PA - P_ATM_PA)), column: pd.Series(values)})]
    found = guess(tables, TableMapping())
    assert [list(one.answers) for one in found.questions] == ([answers] if answers else [])
    assert all(one.signal == 'contraction' and one.column == column and 'guess' in one.text
               for one in found.questions)
    tables[0].columns['x_mm'] = pd.Series(1e3 * SHORTENED_M)
    assert not guess(tables, TableMapping()).questions


def test_two_lengths_are_asked_for_together_and_a_mapped_one_is_not():
    lengths = pd.Series(200.0 - 1e3 * SHORTENED_M)
    tables = [Table('m.csv', {'L_mm': lengths, 'length_mm': lengths - 3.0})]
    question, = guess(tables, TableMapping()).questions
    assert question.answers == ('L_mm:mm:zero=200:gain=-1', 'length_mm:mm:zero=197:gain=-1')
    mapping = TableMapping().with_options(['contraction=L_mm:mm:zero=201:gain=-1'])
    assert not guess(tables, mapping).questions


def test_a_table_with_a_length_is_refused_or_asked(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    rows = ''.join(f'{0.01 * k:.2f};{k % 9 / 3:.2f};{200 - k % 9}\n' for k in range(200))
    (tmp_path / 'a.csv').write_text(f'Zeit_s;Druck_bar;Länge [mm]\n{rows}', encoding='utf-8')
    option = '--map contraction="Länge [mm]:mm:zero=200:gain=-1"'
    assert main(['import', 'a.csv', '--preview']) == 0
    assert option in capsys.readouterr().out
    assert main(['import', 'a.csv', '--out', 'bag']) == 2
    assert option in capsys.readouterr().err and not (tmp_path / 'bag').exists()
    for stream in ('stdin', 'stdout'):
        monkeypatch.setattr(f'sys.{stream}.isatty', lambda: True)
    answers = iter(['m:zero=201:gain=-1', 'mm:zero=201:gain=-1'])
    monkeypatch.setattr('builtins.input', lambda _: next(answers))
    assert main(['import', 'a.csv', '--out', 'bag']) == 0
    said = capsys.readouterr().out
    assert 'where the zero may be another' in said
    assert 'contraction: column "Länge [mm]" in mm, zero=201, gain=-1 (as answered)' in said
    mapped = 'contraction=Länge [mm]:mm:zero=202:gain=-1:missing=0'
    assert main(['import', 'a.csv', '--preview', '--map', mapped]) == 0
    said = capsys.readouterr().out
    assert 'contraction in mm, zero=202, gain=-1, missing=0 (as stated)' in said
    assert load_run('bag')['contraction']['contraction_m'][0] == pytest.approx(1e-3)


def test_a_muscle_longer_than_usual_is_taken_as_the_question_says(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    shares = 0.5 - 0.5 * np.cos(np.arange(400) / 40.0)
    rows = ''.join(f'{0.01 * k:.2f},{4.0 * share:.3f},{1234.4 - 250.0 * share:.1f}\n'
                   for k, share in enumerate(shares))
    (tmp_path / 'a.csv').write_text(f't_s,p_bar,L_mm\n{rows}')
    assert main(['import', 'a.csv', '--out', 'bag']) == 2
    option = 'contraction=L_mm:mm:zero=1234:gain=-1'
    assert option.partition('=')[2] in capsys.readouterr().err
    assert main(['import', 'a.csv', '--out', 'bag', '--map', option]) == 0
    assert load_run('bag')['contraction']['contraction_m'].max() == pytest.approx(
        0.2496, abs=1e-4)


@pytest.mark.parametrize('columns, there, options, following', [
    ('p_bar,x_mm', '', [], 'pam rig new, which writes my_rig.yaml; then pam identify bag --rig '
     'my_rig.yaml, or pam gap bag --model my_rig.yaml --out gap'),
    ('p_bar,F_N', 'my_rig.yaml', [], 'pam identify bag --rig my_rig.yaml, or pam gap bag --model '
     'my_rig.yaml --out gap'),
    ('p_bar,x_mm', 'a.yaml', ['--rig', 'a.yaml'], 'pam identify bag --rig a.yaml, or pam gap bag '
     '--model a.yaml --out gap'),
    ('p_bar,x_mm', 'a b.yaml', ['--rig', 'a b.yaml', '--out', 'my bag'], "pam identify 'my bag' "
     "--rig 'a b.yaml', or pam gap 'my bag' --model 'a b.yaml' --out gap"),
    ('p_bar,x_mm', '', ['--rig', 'dmsp_5_300_hanging_mass'],
     'pam gap bag --model dmsp_5_300_hanging_mass --out gap'),
    ('x_mm,F_N', '', [], 'pam report bag')])
def test_what_comes_next_needs_the_file_of_the_rig(columns, there, options, following, tmp_path,
                                                   monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    rows = ''.join(f'{0.01 * k:.2f},{k % 9 / 3:.2f},{1 + k % 7}\n' for k in range(200))
    (tmp_path / 'a.csv').write_text(f't_s,{columns}\n{rows}')
    if there:
        assert main(['rig', 'new', '--unknown', 'mass_kg', '--out', there]) == 0
    assert main(['import', 'a.csv', '--out', 'bag', *options]) in (0, 1)
    assert f'next: {following}\n' in capsys.readouterr().out


@pytest.mark.parametrize('column', [
    'Tijd (s)', 'Messzeit_s', 'Zeitstempel [s]', 'Zeit_ms', '時間[s]', 'Čas (s)', '시간', 'Datum',
    'Uhrzeit', 'Datum Uhrzeit', 'Datum/Zeit', 'Datum und Uhrzeit', 'Horodatage', 'Laufzeit [s]',
    'Prüfzeit', 'Fecha y hora', 'Date/Heure', 'Tijdstip', 'znacznik czasu', 'Дата и время', '日時',
    'Temps écoulé [s]', 'Päivämäärä ja kellonaika'])
def test_the_time_in_the_language_of_the_lab(column):
    assert is_time(words_of(column))


@pytest.mark.parametrize('column', ['data', 'dato', 't_y', 'a_t', 'y', 'up_time_max', 'Totzeit'])
def test_what_is_no_time(column):
    assert not is_time(words_of(column))


@pytest.mark.parametrize('text, shortening', [
    ('pos:mm', 1.0), ('length:mm:zero=250:gain=-1', -1.0)])
def test_a_zero_that_is_off_shows_while_the_muscle_is_empty(text, shortening):
    column = column_of_text('contraction', text, 'here')
    mapped = {'contraction': column, 'pressure': column_of_text('pressure', 'p:bar_abs', 'here')}
    for at_rest_m in (0.0, 0.004, 0.0314):
        said = ' '.join(one.sentence for one in doubts(
            {'pressure': (10 * STAMP_NS[:-7], PRESSURE_PA[:-7]),
             'contraction': (10 * STAMP_NS, SHORTENED_M + at_rest_m)}, mapped, Size()))
        off = at_rest_m > 0.03
        assert ('31.4 mm while the muscle is empty' in said) == off
        assert (f'zero={column.zero + shortening * 31.4:.4g}' in said) == off


NOISE = np.random.default_rng(2).standard_normal(600)


@pytest.mark.parametrize('contraction_m, size, is_told', [
    (0.025 + 1e-5 * NOISE, Size(), False), (1e-5 * NOISE, Size(), False),
    (0.025 + np.linspace(0.0, 1e-3, 600), Size(), True),        # in the wrong unit, or a frame
    (0.025 + np.linspace(0.0, 1e-3, 600), Size(is_held=True), False),
    (np.linspace(0.0, 1e-3, 600), Size(is_held=True), False),
    (np.repeat(SHORTENED_M, 10) / 20.0, Size(), True)])
def test_a_muscle_that_is_held_is_no_doubt(contraction_m, size, is_told):
    mapped = {'contraction': column_of_text('contraction', 'x:mm', 'here'),
              'pressure': column_of_text('pressure', 'p:bar_abs', 'here')}
    stamp_ns = 10**7 * np.arange(600)
    said = [one.sentence for one in doubts(
        {'pressure': (stamp_ns, np.repeat(PRESSURE_PA, 10) + 1e2 * NOISE),
         'contraction': (stamp_ns, contraction_m)}, mapped, size)]
    assert ['is the muscle held?' in one for one in said] == [True] * is_told
    # Advice would make the held length 0.
    assert not any('zero=' in one for one in said)


@pytest.mark.parametrize('rig', [None, 'dmsp_5_300_isometric'])
def test_a_table_of_a_held_muscle_is_imported_without_a_remark(rig, tmp_path, capsys):
    rows = ''.join(f'{0.01 * k:.2f},{k % 9 / 2:.2f},{25 + 0.01 * one:.3f},{0.01 * k % 100:.2f}\n'
                   for k, one in enumerate(NOISE))
    (tmp_path / 'a.csv').write_text(f't_s,p_bar,x_mm,F_N\n{rows}')
    assert main(['import', str(tmp_path / 'a.csv'), '--out', str(tmp_path / 'bag'),
                 *(['--rig', rig] if rig else [])]) == 0
    said = capsys.readouterr().out
    assert 'contraction: the muscle is held at 25 mm' in said and 'remark' not in said


@pytest.mark.parametrize('begin, end, zero, is_told', [
    (20, 24, ':zero=4', True), (0, 4, ':zero=4', True), (0, 4, '', False),
    (20, 40, ':zero=4', False)])
def test_a_wire_that_breaks_is_told_with_its_option(begin, end, zero, is_told):
    text = f'p_mA:bar_gauge{zero}:gain=0.75'
    current = 8.0 + 4.0 * np.sin(np.arange(60) / 9.0)
    current[begin:end] = 0.0
    column = column_of_text('pressure', text, 'here')
    said = [one.sentence for one in doubts(
        {'pressure': (STAMP_NS, column.to_si(current))}, {'pressure': column}, Size())]
    assert ('4 of 60 values are 0' in ' '.join(said)) == is_told
    assert any(one.endswith(f'--map pressure="{text}:missing=0"') for one in said) == is_told
    whole = column_of_text('pressure', f'{text}:missing=0', 'here')
    assert np.isnan(whole.to_si(current)).sum() == end - begin


def test_the_name_of_a_topic_leads_to_its_signals():
    with pytest.raises(InputError, match='a topic: fill_duty or vent_duty or ppr_voltage; allow'):
        signal_of('valve_signal', '--map')


@pytest.mark.parametrize('text, is_told', [
    ('Piezo_P_(mA):bar_gauge', True), ('Piezo_P_(mA):bar_gauge:zero=4:gain=0.75', False),
    ('p_bar:bar_gauge', False)])
def test_a_sensor_in_milliamperes_without_a_gain(text, is_told):
    column = column_of_text('pressure', text, 'here')
    said = ' '.join(one.sentence for one in doubts(
        {'pressure': (STAMP_NS, column.to_si(5.0 + 0.02 * np.arange(60.0)))},
        {'pressure': column}, Size()))
    assert ('mA is what a sensor puts out' in said) == is_told


@pytest.mark.parametrize('name, unit, stated, said', [
    ('Force', 'lbf', 'force=Force:N', 'the file says lbf'),
    ('Force', 'N', 'force=Force:N', ''), ('Force [N]', 'kgf', 'force=#2:N', 'the file says kgf'),
    ('Pressure', 'bar g', 'pressure=Pressure:bar_abs', 'the file says bar_gauge'),
    ('Pressure', 'bar', 'pressure=Pressure:bar_abs', ''),
    ('p_bar_abs', '-', 'pressure=p_bar_abs:bar_gauge', 'the name of the column says bar_abs'),
    ('Absolutdruck [bar]', '-', 'pressure=Absolutdruck [bar]:bar_gauge', 'column says abs'),
    ('p_bar_abs', '-', 'pressure=p_bar_abs:bar_abs', '')])
def test_a_unit_against_that_of_the_file_is_told(name, unit, stated, said, tmp_path, monkeypatch,
                                                 capsys):
    monkeypatch.chdir(tmp_path)
    rows = ''.join(f'{0.01 * k:.2f};{2 + k % 70 / 20:.2f}\n' for k in range(200))
    units = '' if unit == '-' else f's;{unit}\n'
    (tmp_path / 'a.csv').write_text(f'Time{"" if units else "_s"};{name}\n{units}{rows}')
    assert main(['import', 'a.csv', '--out', 'bag', '--map', stated]) < 2
    out = capsys.readouterr().out
    assert said in out if said else ' says ' not in out


def test_how_to_begin_with_names_that_nobody_knows():
    columns = {name: pd.Series(np.arange(9.0)) for name in (
        'T_(ms)', 'Sys_Volts_(V)', 'Piezo_P_(mA)', 'V_dist_(mA)')}
    tables = [Table('daq.dat', columns)]
    found = guess(tables, TableMapping())
    assert not found.mapping.signals and how_to_begin(tables, found) == (
        '--map pressure="Piezo_P_(mA):kPa_gauge:zero=4:gain=62.5" '
        '--map contraction="V_dist_(mA):mm:zero=4:gain=6.25"')


def test_how_to_begin_with_topics():
    rising = pd.Series(np.arange(9.0))
    tables = []
    for topic, name, unit in (('controller_state', 'position[tick]', 'm'),
                              ('followed_pressure', 'fluid_pressure', 'Pa'),
                              ('pressure', 'variance', ''), ('pressure', 'fluid_pressure', 'Pa'),
                              ('encoder', 'position[thigh]', 'm')):
        column = f'/thigh/{topic}.{name}'
        tables.append(Table('run', {column: rising if unit else 0.0 * rising},
                            topic=f'/thigh/{topic}', units={column: unit} if unit else {}))
    assert how_to_begin(tables, Guess(TableMapping())) == (
        '--map pressure="/thigh/pressure.fluid_pressure:Pa_gauge" '
        '--map contraction="/thigh/encoder.position[thigh]:m"')


def of_pressure(gauge_pa):
    """Return the doubts on a pressure that a person gave as gauge."""
    mapped = column_of_text('pressure', 'p:kPa_gauge', '--map')
    return doubts({'pressure': (np.arange(gauge_pa.size), P_ATM_PA + gauge_pa)},
                  {'pressure': mapped}, Size())


@pytest.mark.parametrize('highest_pa', [1.4e5, 5e5])
def test_a_muscle_mostly_vented_may_have_a_sensor_with_a_zero(highest_pa):
    doubt, = of_pressure(np.repeat([-11.7e3, highest_pa], [40, 20]))
    assert not doubt.is_wrong
    assert 'the sensor has a zero' in doubt.sentence
    # It was said to be gauge.
    assert 'Add 101325' not in doubt.sentence


@pytest.mark.parametrize('gauge_pa', [
    np.repeat([-60e3, 5e5], [40, 20]),              # absolute, and said to be gauge
    np.repeat([-11.7e3, -9e3], 30)])                # no muscle was filled
def test_a_pressure_below_atmosphere_beyond_a_zero_is_refused(gauge_pa):
    doubt, = of_pressure(gauge_pa)
    assert doubt.is_wrong


def test_psi_that_are_called_bar_are_refused_beside_the_noise_of_a_vented_muscle():
    psi = np.repeat([-0.1, 40.0, 78.0], 20)
    mapped = column_of_text('pressure', 'p_bar:bar_gauge', '--map')
    doubt, = doubts({'pressure': (STAMP_NS, mapped.to_si(psi))}, {'pressure': mapped}, Size())
    assert doubt.is_wrong and '--map pressure="p_bar:psi_gauge"' in doubt.sentence


def test_no_unit_is_proposed_in_which_no_muscle_moves():
    doubt, = of_pressure(np.repeat([-60e3, 90e3], [40, 20]))
    assert doubt.is_wrong and 'hPa' not in doubt.sentence


@pytest.mark.parametrize('stroke_mm', [60.0, 98.0])
def test_a_contraction_that_counts_the_other_way_is_refused(stroke_mm, tmp_path, monkeypatch,
                                                            capsys):
    monkeypatch.chdir(tmp_path)
    lifted = (1.0 - np.cos(np.arange(500) / 50.0)) / 2.0
    (tmp_path / 'm.csv').write_text('t_s,p_bar_gauge,x_mm\n' + ''.join(
        f'{0.01 * k:.2f},{4.0 * one:.3f},{0.1 - stroke_mm * one:.3f}\n'
        for k, one in enumerate(lifted)))
    words = ['import', 'm.csv', '--out', 'bag']
    assert main(words) == 2
    said = capsys.readouterr().err
    assert 'if it counts the other way, write --map contraction="x_mm:mm:gain=-1"' in said
    # With its zero at the shortest length it would be long under pressure.
    assert main([*words, '--map', f'contraction=x_mm:mm:zero={0.1 - stroke_mm:g}']) == 2
    said = capsys.readouterr().err
    assert 'while the muscle is empty, and falls to' in said and 'gain=-1"' in said
    way = said.partition('--map ')[2].partition('"')[2].partition('"')[0]
    assert way.startswith('x_mm:mm:zero=') and way.endswith(':gain=-1')
    assert main([*words, '--map', f'contraction={way}']) < 2
    assert load_run('bag')['contraction']['contraction_m'].max() == pytest.approx(
        1e-3 * stroke_mm, abs=1e-3)


def test_a_contraction_that_the_rig_gives_may_fall_under_pressure():
    mapped = {'contraction': column_of_text('contraction', 'x:mm', 'here'),
              'pressure': column_of_text('pressure', 'p:bar_abs', 'here')}
    signals = {'pressure': (STAMP_NS, PRESSURE_PA),
               'contraction': (STAMP_NS, 0.04 - SHORTENED_M)}
    for size, is_wrong in ((Size(), True), (Size(is_held=True), False)):
        assert any(one.is_wrong for one in doubts(signals, mapped, size)) == is_wrong


@pytest.mark.parametrize('air_bar', [0.83, 0.76])
def test_an_absolute_pressure_high_above_the_sea_is_asked_for(air_bar, tmp_path, monkeypatch,
                                                              capsys):
    monkeypatch.chdir(tmp_path)
    gauge_bar = 2.0 - 2.0 * np.cos(np.arange(500) / 50.0)

    def write(name):
        (tmp_path / 'm.csv').write_text(f't_s,{name}\n' + ''.join(
            f'{0.01 * k:.2f},{air_bar + one:.4f}\n' for k, one in enumerate(gauge_bar)))

    words = ['import', 'm.csv', '--out', 'bag', '--overwrite']
    way = f'--map pressure="{{}}:bar_gauge:zero={air_bar}"'
    write('p_bar')
    assert main(words) == 2
    said = capsys.readouterr().err
    assert way.format('p_bar') in said and 'or --map pressure="p_bar:bar_gauge", or' in said
    assert main([*words, '--map', f'pressure=p_bar:bar_gauge:zero={air_bar}']) == 0
    np.testing.assert_allclose(load_run('bag')['pressure']['pressure_pa'],
                               P_ATM_PA + 1e5 * gauge_bar, atol=10.0)
    capsys.readouterr()
    for name in ('p_bar_abs', 'Absolutdruck [bar]'):
        write(name)
        assert main(words) == 1
        assert f'high above the sea, write {way.format(name)}' in capsys.readouterr().out


def test_a_gauge_pressure_that_ends_near_zero_is_not_asked_for(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for low_bar in (0.0, 0.5):
        (tmp_path / 'm.csv').write_text('t_s,p_bar\n' + ''.join(
            f'{0.01 * k:.2f},{low_bar + k % 70 / 20:.3f}\n' for k in range(500)))
        assert main(['import', 'm.csv', '--out', 'bag', '--overwrite']) == 0
        assert load_run('bag')['pressure']['pressure_pa'].min() == pytest.approx(
            P_ATM_PA + 1e5 * low_bar)


@pytest.mark.parametrize('counts, options, words', [
    (np.maximum(np.arange(400) % 200 - 20, 0), 'zero=30:gain=1.5',
     'the converter reads 0, its lowest, for 10 % of the rows: what lies below is lost'),
    (np.minimum(900 + np.arange(400) % 200, 1023), 'gain=0.3',
     'the converter reads 1023, the largest number of 10 bits, for 38 % of the rows: what lies '
     'above is lost'),
    (np.minimum(900 + np.arange(400) % 200, 1000), 'gain=0.3', ''),
    (np.maximum(np.arange(400) % 200 - 20, 0), 'gain=1.5', ''),
    (np.minimum(200 + np.arange(400) % 200, 255), 'gain=1', '')])
def test_counts_at_the_end_of_a_converter_are_told(counts, options, words, tmp_path, capsys):
    path = tmp_path / 'run.csv'
    np.savetxt(path, np.column_stack([0.01 * np.arange(400), counts]), '%.6g', ',', comments='',
               header='t_s,force')
    main(['import', str(path), '--out', str(tmp_path / 'bag'), '--map',
          f'force=force:N:{options}'])
    said = capsys.readouterr().out
    assert ('the converter reads' in said) == bool(words) and words in said
