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


def test_look_alikes_are_effects_and_go_by_their_own_name():
    for effect in effects().values():
        for name in effect.fitting.limits:
            assert effects()[name].variant_of == '' and effect.variant_of == ''


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


def test_fitted_ranges_lie_within_those_of_the_model_file():
    for effect in effects().values():
        whole = {p.name: p for p in effect.parameters}
        for valve in effect.valves:
            fitted = effect.free_parameters(valve)
            assert fitted
            for free in fitted:
                assert whole[free.name].lower <= free.lower < free.upper
                assert free.upper <= whole[free.name].upper
                assert all(free.lower <= start <= free.upper for start in free.starts)


@pytest.mark.parametrize('fitting', (
    Fitting(free=(FreeParameter('width_m', 1.0, 0.0, 2.0),)), Fitting(delay='delay_s'),
    Fitting(edges=('open_time_s',)), Fitting(sensor_parameter='bias_n')))
def test_what_is_no_parameter_cannot_be_fitted(fitting):
    with pytest.raises(InputError, match='`made_up` has no parameter .*allowed: force_n'):
        Effect('made_up', 'friction', 'muscle', 'A test.', 'here',
               (Parameter('force_n', 'N', 1.0, 0.0, 2.0),), ('force_n',), fitting=fitting)
