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

import re

import numpy as np
from pam_actuation.tables.guess import guess
from pam_actuation.tables.mapping import column_of_text, TableMapping
from pam_actuation.tables.plausible import doubts
from pam_actuation.tables.preview import how_to_begin
from pam_actuation.tables.signals import of_words, signal_of, SIGNALS, TIME_WORDS
from pam_actuation.tables.table import Table
from pam_actuation.tables.words import words_of
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


@pytest.mark.parametrize('column', ['Tijd (s)', 'Zeit_ms', '時間[s]', 'Čas (s)', '시간'])
def test_the_time_in_the_language_of_the_lab(column):
    assert re.fullmatch(TIME_WORDS, words_of(column))


@pytest.mark.parametrize('text, shortening', [
    ('pos:mm', 1.0), ('length:mm:zero=250:gain=-1', -1.0)])
def test_a_zero_that_is_off_shows_while_the_muscle_is_empty(text, shortening):
    column = column_of_text('contraction', text, 'here')
    mapped = {'contraction': column, 'pressure': column_of_text('pressure', 'p:bar_abs', 'here')}
    for at_rest_m in (0.0, 0.004, 0.0314):
        said = ' '.join(one.sentence for one in doubts(
            {'pressure': (10 * STAMP_NS[:-7], PRESSURE_PA[:-7]),
             'contraction': (10 * STAMP_NS, SHORTENED_M + at_rest_m)}, mapped, 0.3))
        off = at_rest_m > 0.03
        assert ('31.4 mm while the muscle is empty' in said) == off
        assert (f'zero={column.zero + shortening * 31.4:.4g}' in said) == off


@pytest.mark.parametrize('begin, end, zero, is_told', [
    (20, 24, ':zero=4', True), (0, 4, ':zero=4', True), (0, 4, '', False),
    (20, 40, ':zero=4', False)])
def test_a_wire_that_breaks_is_told_with_its_option(begin, end, zero, is_told):
    text = f'p_mA:bar_gauge{zero}:gain=0.75'
    current = 8.0 + 4.0 * np.sin(np.arange(60) / 9.0)
    current[begin:end] = 0.0
    column = column_of_text('pressure', text, 'here')
    said = [one.sentence for one in doubts(
        {'pressure': (STAMP_NS, column.to_si(current))}, {'pressure': column}, 0.3)]
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
        {'pressure': column}, 0.3))
    assert ('mA is what a sensor puts out' in said) == is_told


def test_how_to_begin_with_names_that_nobody_knows():
    columns = {name: pd.Series(np.arange(9.0)) for name in (
        'T_(ms)', 'Sys_Volts_(V)', 'Piezo_P_(mA)', 'V_dist_(mA)')}
    tables = [Table('daq.dat', columns)]
    found = guess(tables, TableMapping())
    assert not found.mapping.signals and how_to_begin(tables, found) == (
        '--map pressure="Piezo_P_(mA):kPa_gauge:zero=4:gain=62.5" '
        '--map contraction="V_dist_(mA):mm:zero=4:gain=6.25"')
