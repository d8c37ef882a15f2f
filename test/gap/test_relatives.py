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

"""What looks like an effect and is none of the names: the name is held against it."""

from gap_runs import assert_form, nominal, recorded, voltages
from pam_sim.effects.registry import effects
from pam_sim.gap import find_gap
from pam_sim.gap.select.candidates import candidates, relatives
import pytest

NAMES = ['coulomb_friction', 'pressure_friction', 'viscous_damping']


def run_with(name, **parameters):
    effect = {'name': name, 'parameters': parameters}
    return recorded(nominal().with_(effects=[effect]), voltages(10.0))


@pytest.fixture(scope='module')
def smooth():
    return run_with('smooth_friction', force_n=2.0, speed_m_per_s=1.5e-3)


def test_friction_that_does_not_stick_is_not_called_dry(smooth):
    result = find_gap(smooth, nominal(), effects=NAMES, unnamed=())
    assert result.verdict == 'unknown' and not result.effects
    assert_form(result)
    assert 'coulomb_friction' in result.reason and 'smooth_friction' in result.reason


def test_it_is_named_by_whoever_asks_for_it(smooth):
    result = find_gap(smooth, nominal(), effects=[*NAMES, 'smooth_friction'])
    assert [e['name'] for e in result.effects] == ['smooth_friction']
    assert result.effects[0]['equivalent']['force_n']['value'] == pytest.approx(2.0, rel=0.1)


def test_one_that_the_model_has_is_not_held_against_a_name():
    model = nominal().with_(effects=[{'name': 'smooth_friction', 'parameters': {'force_n': 2.0}}])
    dry = {'name': 'coulomb_friction', 'parameters': {'force_n': 3.0}}
    result = find_gap(recorded(model.with_(effects=[*model.effects, dry]), voltages(10.0)),
                      model, effects=NAMES)
    assert [e['name'] for e in result.effects] == ['coulomb_friction']


@pytest.mark.parametrize('name, formulation', [
    ('coulomb_friction', 'coulomb_friction'), ('coulomb_friction', 'coulomb_friction_presliding'),
    ('pressure_friction', 'pressure_friction_presliding')])
def test_dry_friction_keeps_its_name(name, formulation):
    result = find_gap(run_with(formulation), nominal(), effects=NAMES)
    assert [e['name'] for e in result.effects] == [name]


def test_a_relative_is_no_candidate_and_knows_what_it_looks_like():
    shown = nominal(), ('pressure', 'contraction', 'force')
    named = {c.effect for c in candidates(*shown)}
    found = {n: e.relative_of for n, e in effects().items() if e.relative_of}
    assert found and not named & set(found)
    for relative, names in found.items():
        for name in names:
            assert name in named and relative in [c.effect for c in relatives(*shown, name)]
    assert not relatives(*shown, 'creep')
