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

"""What a fit needs of an effect stands in the file of the effect, and nowhere else."""

import ast
from pathlib import Path
import re

from pam_sim.effects.effect import Effect
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.effects.registry import effects
from pam_sim.errors import InputError
import pam_sim.gap
from pam_sim.parameters import Parameter
from pam_sim.records import record
import pytest

FOLDER = Path(pam_sim.gap.__file__).parent


def strings(path):
    """Return (line, text) of the strings of a file that are no docstrings."""
    tree = ast.parse(path.read_text(encoding='utf-8'))
    documents = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    return [(node.lineno, node.value) for node in ast.walk(tree)
            if isinstance(node, ast.Constant) and isinstance(node.value, str)
            and id(node) not in documents]


def test_no_effect_is_named_by_the_search():
    names = set(effects())
    files = sorted(FOLDER.rglob('*.py'))
    assert len(files) > 20
    found = [(path.name, line, text) for path in files for line, text in strings(path)
             if names & set(re.findall(r'\w+', text))]
    assert found == []


def test_a_name_in_a_string_would_be_seen(tmp_path):
    (tmp_path / 'one.py').write_text('"""On creep."""\nX = {\'creep\': 1}\n')
    assert strings(tmp_path / 'one.py') == [(2, 'creep')]


@pytest.mark.parametrize('subsystem, given, sentence', [
    ('sensor', {}, 'of a sensor has the sensor_signal ``; write fitting=Fitting(sensor_signal=...'
     ') with one of pressure, contraction, force'),
    ('sensor', {'sensor_signal': 'presure', 'sensor_change': 'bias'},
     'of a sensor has the sensor_signal `presure` (did you mean `pressure`?); write'),
    ('sensor', {'sensor_signal': 'force'}, 'has the sensor_change ``; write fitting=Fitting('
     'sensor_change=...) with one of bias, gain, lag, other'),
    ('sensor', {'sensor_signal': 'force', 'sensor_change': 'gian'}, '(did you mean `gain`?)'),
    ('load', {'sensor_signal': 'force'},
     'effect `made_up` of the load has the sensor_signal `force`, which a sensor effect states'),
    ('load', {'sensor_change': 'bias'}, 'has the sensor_change `bias`, which a sensor effect')])
def test_a_sensor_effect_says_what_it_changes_and_others_do_not(subsystem, given, sentence):
    with pytest.raises(InputError) as caught:
        Effect('made_up', 'family', subsystem, 'A test.', 'here',
               (Parameter('force_n', 'N', 1.0, 0.0, 2.0),), ('force_n',),
               fitting=Fitting(**given))
    assert sentence in caught.value.problem


def test_of_several_amplitudes_one_is_the_bias():
    given = {'sensor_signal': 'force', 'sensor_change': 'bias'}
    with pytest.raises(InputError, match='name the one that is the bias as `sensor_parameter`'):
        Effect('made_up', 'family', 'sensor', 'A test.', 'here', (
            Parameter('first_n', 'N', 1.0, 0.0, 2.0), Parameter('then_n', 'N', 1.0, 0.0, 2.0)),
            ('first_n', 'then_n'), fitting=Fitting(**given))


def made_up(*free, **changed):
    """Return an effect with one parameter from 0 to 2 N that is fitted as given."""
    given = {'parameters': (Parameter('force_n', 'N', 1.0, 0.0, 2.0),),
             'amplitude': ('force_n',), 'fitting': Fitting(free=free), **changed}
    return Effect('made_up', 'friction', 'muscle', 'A test.', 'here', **given)


@pytest.mark.parametrize('free, sentence', [
    (FreeParameter('force_n', 1.0, 0.0, 2.0, shape=True),
     'fits `force_n` on a logarithmic scale (shape) from 0 to 2; the range must not hold 0'),
    (FreeParameter('force_n', 0.0, 0.0, 2.0), 'fits `force_n` with the typical size 0; write'),
    (FreeParameter('force_n', 1.0, 0.0, 3.0), 'fits `force_n` from 0 to 3; allowed 0 to 2 N'),
    (FreeParameter('force_n', 1.0, -1.0, 2.0), 'fits `force_n` from -1 to 2; allowed 0 to 2 N'),
    (FreeParameter('force_n', 1.9, 0.0, 1.5), 'size or start 1.9; allowed 0 to 1.5'),
    (FreeParameter('force_n', 1.0, 0.0, 1.5, starts=(0.5, 1.6)), 'or start 1.6; allowed 0 to 1.5'),
    (FreeParameter('force_n', 1.0, 1.0, 1.0), 'the lower end must be below the upper one'),
    (FreeParameter('force_n', 1.0, 0.0, 2.0, ends=('uper',)),
     'names the end `uper` of `force_n` (did you mean `upper`?); allowed: lower, upper'),
    (FreeParameter('force_n', 1.0, 0.0, 2.0, valves=('pr',)),
     'names the valve `pr` for `force_n` (did you mean `ppr`?); allowed: ppr, hsv')])
def test_a_range_that_cannot_be_fitted_is_refused(free, sentence):
    assert made_up(FreeParameter('force_n', 1.0, 0.5, 2.0, shape=True)).fitting.free
    with pytest.raises(InputError) as caught:
        made_up(free)
    assert sentence in caught.value.problem
    assert caught.value.problem.startswith('effect `made_up` ')


@pytest.mark.parametrize('changed, sentence', [
    ({'amplitude': 'force_n'}, "has amplitude = 'force_n'; write a tuple, amplitude=('x',) or"),
    ({'parameters': (('force_n', 'N'),)}, "has ('force_n', 'N') in parameters; write Parameter("),
    ({'relative_of': (1,)}, "has 1 in relative_of; write a text, '...'"),
    ({'order': 'first'}, "has order = 'first'; write a whole number"),
    ({'parameters': (Parameter('force_n', 'N', 1.0, 0.0, 2.0),) * 2},
     'has two parameters of one name'),
    ({'parameters': (Parameter('force_n', 'N', 0.0),)}, 'with the typical size inf; write'),
    ({'valves': ('hvs',)}, 'names the valve `hvs` (did you mean `hsv`?)')])
def test_numbers_without_a_range_and_unknown_valves_are_refused(changed, sentence):
    with pytest.raises(InputError) as caught:
        made_up(**changed)
    assert sentence in caught.value.problem


@pytest.mark.parametrize('one, given, sentence', [
    (Fitting, {'limits': 'creep'}, "fitting has limits = 'creep'; write a tuple, limits=('x',)"),
    (Fitting, {'remembers': 'no'}, "fitting has remembers = 'no'; write True or False"),
    (FreeParameter, {'name': 'force_n', 'typical': '1', 'lower': 0.0, 'upper': 2.0},
     "free parameter `force_n` has typical = '1'; write a number")])
def test_what_a_fit_needs_is_of_the_kind_that_it_states(one, given, sentence):
    with pytest.raises(InputError) as caught:
        one(**given)
    assert sentence in caught.value.problem


def test_a_state_that_is_a_pressure_says_where_it_begins():
    with pytest.raises(InputError) as caught:
        made_up(states=record('count', 'pilot_pa'))
    assert caught.value.problem.startswith(
        'effect `made_up` has the state `pilot_pa` and no `initial`, so it would begin at 0 Pa, '
        "in a vacuum; write initial=lambda values, numbers: {'pilot_pa': numbers.pressure_pa}")
    assert made_up(states=record('pilot_pa'),
                   initial=lambda values, numbers: {'pilot_pa': numbers.pressure_pa})
    assert made_up(states=record('bending_m'))


@pytest.mark.parametrize('default, typical', [(1.0, 1.0), (-1.0, 1.0), (-4.0, -4.0), (0.0, 5e-3)])
def test_an_amplitude_is_fitted_from_a_size_within_its_range(default, typical):
    effect = made_up(parameters=(Parameter('force_n', 'N', default, -5.0, 2.0),))
    assert [free.typical for free in effect.free_parameters('ppr')] == [typical]


@pytest.mark.parametrize('fitting', (
    Fitting(free=(FreeParameter('width_m', 1.0, 0.0, 2.0),)), Fitting(delay='delay_s'),
    Fitting(edges=('open_time_s',)), Fitting(sensor_parameter='bias_n')))
def test_what_is_no_parameter_cannot_be_fitted(fitting):
    with pytest.raises(InputError, match='`made_up` has no parameter .*allowed: force_n'):
        Effect('made_up', 'friction', 'muscle', 'A test.', 'here',
               (Parameter('force_n', 'N', 1.0, 0.0, 2.0),), ('force_n',), fitting=fitting)
