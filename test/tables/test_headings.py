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

"""What stands over a column: name and unit in several forms and languages."""

import json

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.cli.main import main
from pam_actuation.tables.day_and_time import is_called_time
from pam_actuation.tables.guess import guess
from pam_actuation.tables.mapping import TableMapping
from pam_actuation.tables.preview import may_be_signals, question_sentence
from pam_actuation.tables.table import Table
import pandas as pd
import pytest

WAVE = 2.0 - 2.0 * np.cos(0.03 * np.arange(400))


def of_heading(name, unit=''):
    """Return the table of one column, and what is guessed of it."""
    table = Table('m.csv', {'t_s': pd.Series(0.01 * np.arange(400)), name: pd.Series(WAVE)},
                  units={name: unit} if unit else {})
    return table, guess([table], TableMapping())


@pytest.mark.parametrize('name, read', [
    ('Druck in bar', 'pressure bar_gauge'), ('Druck in kPa', 'pressure kPa_gauge'),
    ('p in kPa', 'pressure kPa_gauge'), ('pressure in bar', 'pressure bar_gauge'),
    ('Druck in bar abs', 'pressure bar_abs'), ('Druck in bar (abs)', 'pressure bar_abs'),
    ('p_bar (g)', 'pressure bar_gauge'), ('Druck (in bar)', 'pressure bar_gauge'),
    ('pression en bar', 'pressure bar_gauge'), ('presión en kPa', 'pressure kPa_gauge'),
    ('pressão em bar', 'pressure bar_gauge'), ('p/bar', 'pressure bar_gauge'),
    ('p, bar', 'pressure bar_gauge'), ('p_bar (muscle)', 'pressure bar_gauge'),
    ('Druck in Pascal', 'pressure Pa_gauge'), ('Muskeldruck in bar', 'pressure bar_gauge'),
    ('Solldruck in bar', 'pressure_command bar_gauge'), ('F/N', 'force N'),
    ('Kraft (in N)', 'force N'), ('Kraft_in_N', 'force N'), ('force en kN', 'force kN'),
    ('s/mm', 'contraction mm'), ('s in mm', 'contraction mm'), ('Weg in Zoll', 'contraction in'),
    ('x in', 'contraction in'), ('displacement in in', 'contraction in'),
    ('desplazamiento en mm', 'contraction mm'), ('Spannung/V', 'ppr_voltage V'),
    ('fill_pct', 'fill_duty %'), ('vent_pct', 'vent_duty %'), ('fill_duty_pct', 'fill_duty %'),
    ('inlet_pct', 'fill_duty %'), ('Outlet [pct]', 'vent_duty %'), ('valve_fill_%', 'fill_duty %'),
    ('valve_vent [%]', 'vent_duty %'), ('fill valve duty (%)', 'fill_duty %'),
    ('duty_in_%', 'fill_duty %'), ('duty_in [%]', 'fill_duty %'), ('duty_out_pct', 'vent_duty %'),
    ('flexor/pressure/bar', 'flexor/pressure bar_gauge'), ('x_mm (soll)', 'reference mm'),
    # Of the supply, by their own words.
    ('Versorgungsdruck in bar', 'supply_pressure bar_gauge'),
    ('inlet pressure in bar', 'supply_pressure bar_gauge'),
    ('p_in [bar]', 'supply_pressure bar_gauge'), ('p_in in bar', 'supply_pressure bar_gauge'),
    # Of something else.
    ('Federkraft in N', ''), ('x in mm/s', ''), ('p in bar/s', ''), ('duty in %', ''),
    ('temperature in C', ''), ('humidity_pct', ''), ('valve_out_mm', '')])
def test_a_name_and_its_unit(name, read):
    _, found = of_heading(name)
    assert not found.questions
    assert ' '.join(f'{signal} {one.unit.name}' for signal, one in found.mapping.signals.items()
                    ) == read


@pytest.mark.parametrize('name', [
    'Zeit in s', 'Zeit in ms', 'Time in s', 't in s', 'Zeit_in_s', 'temps en s', 'tiempo en ms',
    'Zeit (in s)', 'Zeit in Sekunden'])
def test_a_time_and_its_unit(name):
    assert is_called_time(Table('m.csv', {name: pd.Series(WAVE)}), name)


@pytest.mark.parametrize('name, unit', [
    ('p_in_bar', ''), ('pressure_in_bar', ''), ('Druck.in.bar', ''), ('pressure in [bar]', ''),
    ('Pressure In (bar)', ''), ('pressure in', 'bar')])
def test_in_may_be_the_inlet_and_is_asked(name, unit):
    table, found = of_heading(name, unit)
    assert not found.mapping.signals
    said = question_sentence(found)
    assert 'pressure in the muscle or the pressure of the supply: which one?' in said
    assert f'--map pressure="{name}:bar_gauge" or --map supply_pressure="{name}:bar_g' in said
    assert not may_be_signals([table], found)


@pytest.mark.parametrize('name, signal', [
    ('p_in', 'supply_pressure'), ('pressure in', 'supply_pressure'), ('p_m', 'pressure'),
    ('p_s', 'supply_pressure'), ('F_m', 'force'), ('u_in', 'ppr_voltage'),
    ('duty_in', 'fill_duty'), ('duty_out', 'vent_duty')])
def test_an_index_is_no_unit_of_another_quantity(name, signal):
    question, = of_heading(name)[1].questions
    assert question.signal == signal and 'in which unit' in question.text


@pytest.mark.parametrize('name', [
    'Kontraktion in %', 'Verkürzung in Prozent', 'contraction in %', 'Kontraktion in % von L0',
    'contraction [% of L0]', 'contraction_pct', 'x_percent'])
def test_a_share_of_the_length_is_asked_for(name):
    question, = of_heading(name)[1].questions
    assert 'how long is the muscle at rest' in question.text


@pytest.mark.parametrize('name, unit, option', [
    ('Seilzug', 'mV', 'contraction="Seilzug:mm:zero=ZERO:gain=GAIN"'),
    ('Seilzug', 'mV', 'force="Seilzug:N:zero=ZERO:gain=GAIN"'),
    ('Stellsignal [%]', '', 'pressure_command="Stellsignal [%]:bar_gauge:zero=ZERO:gain=GAIN"'),
    ('Stellsignal_pct', '', 'pressure_command="Stellsignal_pct:bar_gauge:zero=ZERO:gain=GAIN"'),
    ('Sollstrom (mA)', '', 'pressure_command="Sollstrom (mA):bar_gauge:zero=ZERO:gain=GAIN"'),
    ('Drahtlänge (mm)', '', 'contraction="Drahtlänge (mm):mm"'),
    ('p_bar [corr]', '', 'pressure="p_bar [corr]:bar_gauge"')])
def test_what_may_be_a_signal_is_named_with_its_option(name, unit, option):
    table, found = of_heading(name, unit)
    assert not found.mapping.signals and not found.questions
    assert f'--map {option}' in may_be_signals([table], found)


def test_either_of_two_signals_is_answered_at_a_terminal(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'm.csv').write_text('t in s,p_in_bar,x in mm\n' + ''.join(
        f'{0.01 * k:.2f},{p:.4f},{3.0 * p:.4f}\n' for k, p in enumerate(WAVE)))
    assert main(['import', 'm.csv', '--preview']) == 0
    assert 'pressure? (pressure in the muscle) or supply_pressure?' in capsys.readouterr().out
    assert main(['import', 'm.csv', '--out', 'bag']) == 2
    capsys.readouterr()
    for stream in ('stdin', 'stdout'):
        monkeypatch.setattr(f'sys.{stream}.isatty', lambda: True)
    answers = iter(['bar_gauge', 'pressure=bar_gauge'])
    monkeypatch.setattr('builtins.input', lambda _: next(answers))
    assert main(['import', 'm.csv', '--out', 'bag']) == 0
    assert "'bar_gauge' is not one of them" in capsys.readouterr().out
    assert load_run('bag')['pressure']['pressure_pa'].max() == pytest.approx(501_325.0, rel=1e-3)


def test_duties_are_the_command_of_the_valve(tmp_path, monkeypatch, capsys):
    """Output, --json and bag of an import of duties say that the valves are on/off."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'm.csv').write_text('t in s,p [bar(g)],x in mm,fill_duty,vent_duty\n' + ''.join(
        f'{0.01 * k:.2f},{p:.4f},{3.0 * p:.4f},{0.25 * p:.4f},{1.0 - 0.25 * p:.4f}\n'
        for k, p in enumerate(WAVE)))
    main(['import', 'm.csv', '--map', 'fill_duty=fill_duty:1', '--map', 'vent_duty=vent_duty:1',
          '--out', 'bag', '--json'])
    assert json.loads(capsys.readouterr().out)['valve'] == 'hsv'
    assert load_run('bag').metadata['valve'] == 'hsv'
    main(['import', 'm.csv', '--map', 'fill_duty=fill_duty:1', '--map', 'vent_duty=vent_duty:1',
          '--out', 'again'])
    assert 'no command of the valve' not in capsys.readouterr().out


def test_a_duty_in_per_cent_that_never_exceeds_1_is_asked_about(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'm.csv').write_text('t_s;p_bar_gauge;fill_pct;vent_pct\n' + ''.join(
        f'{0.01 * k:.2f};{p:.4f};{0.25 * p:.4f};{1.0 - 0.25 * p:.4f}\n'
        for k, p in enumerate(WAVE)))
    words = ['import', 'm.csv', '--out', 'bag', '--overwrite']
    assert main(words) == 1
    said = capsys.readouterr().out
    assert 'is it a share of 1? Then write --map fill_duty="fill_pct:1"' in said
    assert '--map vent_duty="vent_pct:1"' in said
    main([*words, '--map', 'fill_duty=fill_pct:1', '--map', 'vent_duty=vent_pct:1'])
    assert 'share of 1' not in capsys.readouterr().out
    assert load_run('bag')['valve_signal']['vent_duty'].max() == pytest.approx(
        1.0 - 0.25 * min(WAVE), abs=1e-3)


@pytest.mark.parametrize('first', ['NaN,NaN,NaN', ',,', 'nan,,n/a'])
def test_a_first_row_of_missing_values_is_no_header(first, tmp_path):
    path = tmp_path / 'm.csv'
    path.write_text(f't_s,p_bar_g,x_mm\n{first}\n' + ''.join(
        f'{0.01 * k:.2f},{k % 7},{k % 9}\n' for k in range(200)))
    assert main(['import', str(path), '--out', str(tmp_path / 'bag')]) == 0
    assert {'pressure', 'contraction'} <= set(load_run(tmp_path / 'bag').topics)


@pytest.mark.parametrize('columns, chosen', [
    (('P_raw [kPa gauge]', 'P_filt [kPa gauge]'), 'P_raw [kPa gauge]'),
    (('filtered pressure [kPa gauge]',), 'filtered pressure [kPa gauge]'),
    (('p_raw [kPa gauge]', 'p [kPa gauge]', 'p_filtered [kPa gauge]'), 'p [kPa gauge]')])
def test_a_filtered_signal_is_read_where_there_is_no_other(columns, chosen):
    values = pd.Series(np.linspace(0.0, 400.0, 50))
    table = Table('a.csv', {'t_s': values / 100.0, **dict.fromkeys(columns, values)})
    found = guess([table], TableMapping())
    assert not found.questions
    assert {name: one.column for name, one in found.mapping.signals.items()} == {
        'pressure': chosen}
