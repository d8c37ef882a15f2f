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

"""Columns whose unit is none of the signal: what is asked, and which answers are admitted."""

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.cli.main import main
from pam_actuation.tables.guess import guess
from pam_actuation.tables.mapping import column_of_text, load_mapping, TableMapping
from pam_actuation.tables.preview import question_sentence
from pam_actuation.tables.table import Table
from pam_sim.errors import InputError
import pandas as pd
import pytest

PLACES = np.arange(200) % 9


def guessed(*columns, values=None):
    """Return what is guessed of a table with columns of these names."""
    return guess([Table('m.csv', {'t_s': pd.Series(0.01 * np.arange(200)), **{
        name: pd.Series(PLACES if values is None else values) for name in columns}})],
        TableMapping())


@pytest.mark.parametrize('column, signal, answer', [
    ('Encoder [counts]', 'contraction', 'mm:zero=ZERO:gain=GAIN'),
    ('Encoder_ticks', 'contraction', 'mm:zero=ZERO:gain=GAIN'),
    ('Weg (Ink)', 'contraction', 'mm:zero=ZERO:gain=GAIN'),
    ('x [V]', 'contraction', 'mm:zero=ZERO:gain=GAIN'),
    ('Position [xyz]', 'contraction', 'mm:zero=ZERO:gain=GAIN'),
    ('p [mA]', 'pressure', 'bar_gauge:zero=ZERO:gain=GAIN'),
    ('p [mA DC]', 'pressure', 'bar_gauge:zero=ZERO:gain=GAIN'),
    ('Kraft [% FS]', 'force', 'N:zero=ZERO:gain=GAIN'),
    ('x_volts', 'contraction', 'mm:zero=ZERO:gain=GAIN'),
    ('p_mA', 'pressure', 'bar_gauge:zero=ZERO:gain=GAIN'),
    ('Druck [Digits]', 'pressure', 'bar_gauge:zero=ZERO:gain=GAIN'),
    ('Kraft [mV/V]', 'force', 'N:zero=ZERO:gain=GAIN'),
    ('F [%]', 'force', 'N:zero=ZERO:gain=GAIN'),
    ('u [counts]', 'ppr_voltage', 'V:zero=ZERO:gain=GAIN'),
    ('Kontraktion [%]', 'contraction', 'mm:gain=GAIN'), ('x [-]', 'contraction', 'mm:gain=GAIN')])
def test_a_unit_that_is_none_of_the_signal_needs_a_gain(column, signal, answer):
    question, = guessed(column).questions
    answers = (answer, answer.replace('gauge', 'abs')) if signal == 'pressure' else (answer,)
    assert (question.signal, question.answers) == (signal, answers) and question.is_output == (
        column != 'Position [xyz]')


def test_a_column_that_is_no_signal_may_be_left_out(tmp_path, capsys):
    path = tmp_path / 'm.csv'
    path.write_text('t_s,p_bar_gauge,x [V],Weg (Ink)\n' + ''.join(
        f'{0.01 * k:.2f},{k / 100},{k / 50},{k}\n' for k in range(200)))
    words = ['import', str(path), '--out', str(tmp_path / 'bag')]
    assert main(words) == 2
    assert '--leave-out' in capsys.readouterr().err
    assert main([*words, '--leave-out', 'x [V]', '--leave-out', 'nothing']) == 2
    assert 'nothing' in capsys.readouterr().err
    assert main([*words, '--leave-out', 'x [V]', '--leave-out', '#4']) == 0
    assert 'contraction' not in load_run(tmp_path / 'bag')


def test_what_the_question_says():
    said = question_sentence(guessed('Encoder [counts]'))
    assert 'in counts, which is no unit of a length' in said and 'mm is one step' in said
    said = question_sentence(guessed('p [mA]'))
    assert 'zero=4:gain=0.625 for 10 bar over 4 to 20 mA' in said
    assert 'one V (GAIN)? Such as mm:gain=10' in question_sentence(guessed('x [Volt DC]'))
    assert '1/100 of that length, in mm' in question_sentence(guessed('Kontraktion [%]'))
    assert 'state one in place of' in question_sentence(guessed('x (left)'))


def test_a_column_with_a_unit_goes_before_the_output_of_a_sensor():
    found = guessed('x_mm', 'Encoder [counts]', 'p [V]', 'p_bar_gauge', 'p [mm]')
    assert not found.questions
    assert {one.column for one in found.mapping.signals.values()} == {'x_mm', 'p_bar_gauge'}
    question, = guessed('x [V]', 'Länge [mm]', values=200 - PLACES).questions
    assert question.column == 'Länge [mm]'
    question, = guessed('x [V]', 'Encoder [counts]').questions
    assert question.answers == ('x [V]:mm:zero=ZERO:gain=GAIN',
                                'Encoder [counts]:mm:zero=ZERO:gain=GAIN')


@pytest.mark.parametrize('column, said, why', [
    ('x [counts]', 'mm:zero=10:gain=0.005', ''), ('x [counts]', 'um:gain=5', ''),
    ('x [counts]', 'um', 'says no gain'), ('x [counts]', 'mm:zero=4', 'says no gain'),
    ('x [counts]', 'mm:zero=ZERO:gain=GAIN', 'allowed is a number'),
    ('x [counts]', 'bar_gauge:gain=3', 'is no unit of a length'),
    ('x (left)', 'mm', ''), ('p [mA]', 'kPa_abs:zero=4:gain=62.5', ''),
    ('p_bar', 'bar_gauge:zero=0.03', ''), ('p_bar', 'kPa_gauge', 'is not one of them'),
    ('length_mm', 'mm:gain=-1', 'says no zero'), ('length_mm', 'mm:zero=201:gain=-1', '')])
def test_the_answers_that_are_admitted(column, said, why):
    values = 200 - PLACES if column == 'length_mm' else 2.0 + PLACES
    question, = guessed(column, values=values).questions
    assert why in question.refusal(said) and bool(question.refusal(said)) == bool(why)


def test_counts_are_imported_by_the_answer_at_a_terminal(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'enc.csv').write_text('t_s,p_bar_gauge,Encoder [counts]\n' + ''.join(
        f'{0.01 * k:.2f},{0.1 * place},{500 * place}\n' for k, place in enumerate(PLACES)))
    assert main(['import', 'enc.csv', '--out', 'bag']) == 2
    said = capsys.readouterr().err
    assert '"Encoder [counts]:mm:zero=ZERO:gain=GAIN"' in said and ':um"' not in said
    # Stated without a gain it is taken, and told.
    stated = 'contraction=Encoder [counts]:um'
    assert main(['import', 'enc.csv', '--out', 'bag', '--map', stated]) == 1
    assert 'counts is what a sensor puts out' in capsys.readouterr().out
    for stream in ('stdin', 'stdout'):
        monkeypatch.setattr(f'sys.{stream}.isatty', lambda: True)
    answers = iter(['um', 'mm:gain=0.005'])
    monkeypatch.setattr('builtins.input', lambda _: next(answers))
    assert main(['import', 'enc.csv', '--out', 'right']) == 0
    assert "'um' says no gain" in capsys.readouterr().out
    assert load_run('right')['contraction']['contraction_m'].max() == pytest.approx(0.020)


def test_of_two_numbered_columns_nobody_knows_which_is_the_muscle(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'a.csv').write_text('t_s,p1_bar_g,p2_bar_g,q_deg\n' + ''.join(
        f'{0.01 * k:.2f},{6 - place / 90:.3f},{place / 3:.3f},{place}\n'
        for k, place in enumerate(PLACES.tolist())))
    words = ['import', 'a.csv', '--out', 'bag', '--overwrite']
    assert main(words) == 2
    said = capsys.readouterr().err
    assert 'columns "p1_bar_g" and "p2_bar_g" could each be the pressure in the muscle' in said
    assert ('If they are the two of a joint, write --map flexor/pressure="p1_bar_g:bar_gauge" '
            '--map extensor/pressure="p2_bar_g:bar_gauge"') in said
    assert main([*words, '--map', 'pressure=p2_bar_g:bar_gauge']) < 2
    assert load_run('bag')['pressure']['pressure_pa'].max() < 4e5
    assert main([*words, '--leave-out', 'p2_bar_g']) < 2
    assert load_run('bag')['pressure']['pressure_pa'].max() > 6e5
    capsys.readouterr()
    assert main([*words, '--map', 'flexor/pressure=p1_bar_g:bar_gauge', '--map',
                 'extensor/pressure=p2_bar_g:bar_gauge']) < 2
    assert 'angle: column "q_deg" in deg' in capsys.readouterr().out


def test_the_time_in_seconds_goes_before_that_in_ticks(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'a.csv').write_text('t_ticks,t_s,x_mm\n' + ''.join(
        f'{84000 * k},{0.01 * k:.2f},{place}\n' for k, place in enumerate(PLACES)))
    assert main(['import', 'a.csv', '--out', 'bag']) == 0
    assert np.diff(load_run('bag')['contraction'].stamp_ns).max() == 10_000_000


@pytest.mark.parametrize('ending', ['csv', 'xlsx'])
def test_a_row_of_units_may_state_outputs_of_sensors(tmp_path, ending, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    rows = [['t', 'p', 'Encoder'], ['s', 'mA', 'counts'],
            *([0.01 * k, 4 + place, 500 * place] for k, place in enumerate(PLACES.tolist()))]
    frame = pd.DataFrame(rows)
    if ending == 'csv':
        frame.to_csv('m.csv', header=False, index=False)
    else:
        frame.to_excel('m.xlsx', header=False, index=False)
    assert main(['import', f'm.{ending}', '--out', 'bag']) == 2
    said = capsys.readouterr().err
    assert '"p:bar_gauge:zero=ZERO:gain=GAIN"' in said
    assert '"Encoder:mm:zero=ZERO:gain=GAIN"' in said
    assert main(['import', f'm.{ending}', '--out', 'bag', '--map',
                 'pressure=p:bar_gauge:zero=4:gain=0.625', '--map',
                 'contraction=Encoder:mm:gain=0.005']) == 0
    # Stated without a gain it is taken, and told.
    capsys.readouterr()
    assert main(['import', f'm.{ending}', '--out', 'plain', '--map',
                 'pressure=p:bar_gauge:zero=4:gain=0.625', '--map', 'contraction=#3:um']) == 1
    assert 'the file says counts' in capsys.readouterr().out


def test_a_signal_of_the_mapping_may_be_missing(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    rows = ''.join(f'{0.01 * k:.2f},{k % 9 / 3:.2f},{1 + k % 7}\n' for k in range(200))
    (tmp_path / 'a.csv').write_text(f't_s,p_bar,x_mm\n{rows}')
    text = ('signals:\n  pressure: {column: p_bar, unit: bar_gauge}\n'
            '  force: {column: F_N, unit: N}\n')
    (tmp_path / 'm.yaml').write_text(text)
    words = ['import', 'a.csv', '--mapping', 'm.yaml', '--out', 'bag', '--overwrite']
    assert main(words) == 2
    said = capsys.readouterr().err
    assert 'no column "F_N"' in said and '--without force' in said and '"optional: true"' in said
    assert main([*words, '--without', 'force']) == 0
    assert 'force' not in capsys.readouterr().out
    assert main([*words, '--without', 'angle']) == 2
    assert 'it holds pressure, force' in capsys.readouterr().err
    (tmp_path / 'm.yaml').write_text(text.replace('unit: N', 'unit: N, optional: true'))
    assert load_mapping('m.yaml').to_yaml().count('optional: true') == 1
    assert main(words) == 0
    assert 'force: no column "F_N", which is optional' in capsys.readouterr().out
    assert 'force' not in load_run('bag').metadata['mapping']


@pytest.mark.parametrize('column, values, share', [
    ('strain [%]', 5.0 * PLACES, '1/100 of that length'), ('strain', 0.05 * PLACES, 'that length'),
    ('strain', 5.0 * PLACES, '1/100 of that length'),
    ('Contraction ratio (%)', 5.0 * PLACES, '1/100 of that length'),
    ('strain [mm/mm]', 0.05 * PLACES, 'that length')])
def test_a_strain_is_a_share_of_the_length(column, values, share):
    question, = guessed(column, values=values).questions
    assert (question.signal, question.answers) == ('contraction', ('mm:gain=GAIN',))
    assert f'(GAIN is {share}, in mm)' in question.text
    assert not guessed(column, 'x_mm', values=values).questions
    assert not guessed('strain gauge [mV]', values=values).questions


@pytest.mark.parametrize('unit, way', [('%', 'mm:gain=3 '), ('1', 'mm:gain=300 ')])
def test_a_share_that_is_stated_as_a_unit_of_a_length_is_told_its_gain(unit, way):
    with pytest.raises(InputError, match=f'COLUMN:{way}for 300 mm; allowed: m, cm'):
        column_of_text('contraction', f'strain:{unit}', 'here')


def test_the_pressures_of_several_muscles_are_all_named(tmp_path, capsys):
    path = tmp_path / 'arm.csv'
    rows = np.column_stack([0.01 * np.arange(200), *(
        200.0 + 200.0 * np.sin(0.1 * k * np.arange(200)) for k in (1, 2, 3, 4))])
    np.savetxt(path, rows, '%.4f', ',', comments='', header='t_s,p1_kPa,p2_kPa,p3_kPa,p4_kPa')
    assert main(['import', str(path), '--out', str(tmp_path / 'bag')]) == 2
    said = capsys.readouterr().err
    assert ('columns "p1_kPa", "p2_kPa", "p3_kPa" and "p4_kPa" could each be the pressure in the '
            'muscle: which one? Of several muscles, import each by itself.' in said)
    assert main(['import', str(path), '--out', str(tmp_path / 'bag'), '--map',
                 'pressure=p3_kPa:kPa_gauge']) == 0
