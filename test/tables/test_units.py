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

"""Units and mappings: what people write, and what they are told."""

import numpy as np
from pam_actuation.tables.mapping import load_mapping, TableMapping
from pam_actuation.tables.table import Table
from pam_actuation.tables.units import checked_unit, PRESSURE, TIME, unit_of_text
from pam_actuation.tables.words import unit_in, words_of
from pam_sim.errors import InputError
import pandas as pd
import pytest


@pytest.mark.parametrize('text, name, pascal', [
    ('bar_gauge', 'bar_gauge', 201_325.0), ('barg', 'bar_gauge', 201_325.0),
    ('bar Ü', 'bar_gauge', 201_325.0), ('bar(ü)', 'bar_gauge', 201_325.0),
    ('barü', 'bar_gauge', 201_325.0), ('bar_eff', 'bar_gauge', 201_325.0),
    ('bar(g)', 'bar_gauge', 201_325.0), ('bar abs', 'bar_abs', 1e5), ('BARA', 'bar_abs', 1e5),
    ('kPa_gauge', 'kPa_gauge', 102_325.0), ('kpa-gauge', 'kPa_gauge', 102_325.0),
    ('MPa_abs', 'MPa_abs', 1e6), ('psig', 'psi_gauge', 101_325.0 + 6894.757293168361),
    ('[mbar abs]', 'mbar_abs', 100.0)])
def test_a_pressure_in_many_spellings(text, name, pascal):
    unit = unit_of_text(text, PRESSURE)
    assert unit.name == name
    assert unit.to_si(np.array([1.0]))[0] == pytest.approx(pascal, rel=1e-12)


@pytest.mark.parametrize('text', ['mPa_abs', 'bar_x', 'V', '', 'mm', 'barx'])
def test_what_is_no_pressure(text):
    assert unit_of_text(text, PRESSURE) is None


@pytest.mark.parametrize('text, quantity, size', [
    ('daN', 'force', 10.0), ('kp', 'force', 9.80665), ('kp/cm²', PRESSURE, 98066.5),
    ('kg/cm2', PRESSURE, 98066.5), ('N/mm²', PRESSURE, 1e6), ('V DC', 'voltage', 1.0),
    ('inches', 'length', 0.0254), ('lbs', 'force', 4.4482216152605),
    ('Pounds', 'force', 4.4482216152605)])
def test_units_that_testing_machines_write(text, quantity, size):
    assert unit_of_text(text, quantity).factor == pytest.approx(size)


def test_capitals_that_are_a_prefix_count():
    assert unit_of_text('MM', 'length') is None and unit_of_text('Mm', 'length') is None
    assert unit_of_text('MS', TIME) is None and unit_of_text('Ms', TIME) is None
    assert unit_of_text('KN', 'force').name == 'kN'
    # `cmd_G` may be of a muscle called G.
    assert unit_of_text('G', 'force') is None and unit_of_text('g', 'force').name == 'gf'


def test_a_pressure_says_gauge_or_absolute():
    with pytest.raises(InputError, match='bar_gauge .0 for a vented muscle. or bar_abs'):
        checked_unit('bar', PRESSURE, 'here')


@pytest.mark.parametrize('text, quantity, option', [
    ('mA', PRESSURE, 'COLUMN:bar_gauge:zero=4:gain=0.625 for 10 bar over 4 to 20 mA'),
    ('mA', 'length', 'COLUMN:mm:zero=4:gain=6.25 for 100 mm'), ('V', 'force', ':N:gain=100 for')])
def test_the_output_of_a_sensor_is_no_unit_of_what_it_measures(text, quantity, option):
    with pytest.raises(InputError, match=option) as error:
        checked_unit(text, quantity, 'here')
    assert 'did you mean' not in str(error.value)


@pytest.mark.parametrize('text', ['counts', 'Ticks', 'Inkremente', 'Ink', 'digits', 'LSB', 'mV/V'])
def test_the_steps_of_an_encoder_are_no_unit(text):
    with pytest.raises(InputError, match='such as COLUMN:mm:zero=ZERO:gain=GAIN'):
        checked_unit(text, 'length', 'here')


@pytest.mark.parametrize('name, unit, words', [
    ('F_daN', 'daN', 'f'), ('F [kp]', 'kp', 'f'), ('force_kp', '', 'force kp'),
    ('p [kp/cm²]', 'kp/cm²', 'p'), ('Encoder_counts', 'counts', 'encoder'),
    ('p_mA', 'mA', 'p'), ('x_ma', '', 'x ma'),
    ('p_bar', 'bar', 'p'), ('Pressure [kPa gauge]', 'kPa gauge', 'pressure'),
    ('t_nominal_s', 's', 't nominal'), ('Force (N)', 'N', 'force'), ('time', '', 'time'),
    ('p_kpa_gauge', 'kpa_gauge', 'p'), ('loadCell', '', 'load cell'),
    ('pressure_1', '', 'pressure 1')])
def test_the_unit_in_a_name(name, unit, words):
    assert (unit_in(name), words_of(name)) == (unit, words)


def test_options_are_a_mapping_that_comes_back_from_its_file(tmp_path):
    mapping = TableMapping().with_options([
        'time=t:ms', 'pressure=p:bar_gauge:zero=0.03', 'contraction=a:b:mm:gain=-1:zero=300'])
    assert mapping.signals['contraction'].column == 'a:b'
    assert mapping.signals['contraction'].to_si(np.array([290.0]))[0] == pytest.approx(0.01)
    (tmp_path / 'm.yaml').write_text(mapping.to_yaml(), encoding='utf-8')
    assert load_mapping(tmp_path / 'm.yaml') == mapping
    assert mapping.with_options([], rate_hz=500.0).time is None


@pytest.mark.parametrize('numbers', [
    'zero=1048576:gain=0.001', 'zero=0.5:gain=2.5', 'gain=-0.0123456789', 'missing=4294967295'])
def test_an_option_that_is_told_says_what_was_stated(numbers):
    """Counts of an encoder have more than six digits."""
    option = f'contraction=c:mm:{numbers}'
    one = TableMapping().with_options([option]).signals['contraction']
    assert one.words == f'mm:{numbers}'
    told = one.option('contraction').partition(' ')[2].replace('"', '')
    assert TableMapping().with_options([told]).signals['contraction'] == one


@pytest.mark.parametrize('option, said', [
    ('pressure', 'write --map NAME='), ('presure=p:bar_abs', 'did you mean `pressure`'),
    ('pressure=p', 'the unit is missing'), ('pressure=p:bar_gauge:gain=0', 'gain that is not 0'),
    ('pressure=p:bar_gauge:zero=x', "zero is 'x'"), ('force=f:NN', 'no unit of a force'),
    ('time=t:parsec', 'no unit of a time')])
def test_a_wrong_option_is_told(option, said):
    with pytest.raises(InputError, match=said) as caught:
        TableMapping().with_options([option])
    assert option in str(caught.value)


@pytest.mark.parametrize('text, said', [
    ('signals: {pressure: {column: p}}', 'unit'),
    ('signals: {pressure: {column: p, unit: bar}}', 'm.yaml:1.*gauge or absolute'),
    ('signals: {pressure: {column: p, unit: bar_abs, gian: 1}}', 'gain'),
    ('signals: {presure: {column: p, unit: bar_abs}}', 'pressure'),
    ('time: {column: t}\nrate_hz: 100\nsignals: {}', 'm.yaml:2.*not both'),
    ('rate_hz: 0\nsignals: {}', '0.1 to'), ('columns: {}', 'columns')])
def test_a_wrong_mapping_file_is_told(tmp_path, text, said):
    (tmp_path / 'm.yaml').write_text(text, encoding='utf-8')
    with pytest.raises(InputError, match=said):
        load_mapping(tmp_path / 'm.yaml')


@pytest.mark.parametrize('cell, unit', [
    ('50%', '%'), ('12.3 N', 'N'), ('0,35 bar', 'bar'), ('-1.2e-3 mm', 'mm'), ('12.3 x', ''),
    ('OVL', ''), ('1.2.3', '')])
def test_cells_that_hold_their_unit_are_no_missing_values(cell, unit):
    table = Table('m.csv', {'a': pd.Series(['1.5', cell, '2.5'])})
    with pytest.raises(InputError) as caught:
        table.numbers('a')
    said = str(caught.value)
    assert ('--missing' not in said) == bool(unit)
    assert not unit or f'write the numbers alone, and {unit} in the name of the column' in said
