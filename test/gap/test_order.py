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

"""Numbers of load and regulator come before effects, and these before errors of sensors."""

from dataclasses import replace
from types import SimpleNamespace

from gap_runs import nominal, recorded, voltages
from pam_sim.gap import find_gap
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.select.order import in_order, is_sensor_error, uncertain_numbers
from pam_sim.gap.subsystems.effects import subsystem_of_number
from pam_sim.gap.subsystems.problems import subsystem_problems
from pam_sim.tolerance import UNKNOWN
import pytest

WITHOUT_CELL = ('pressure', 'contraction')


@pytest.mark.parametrize('effects', [['contraction_bias'], None])
def test_a_wrong_load_is_not_an_offset_of_the_encoder(effects):
    """Far off, its prior holds it: the misfit is so large that the data have little weight."""
    run = recorded(nominal().with_(parameters={'mass_kg': 3.0}), voltages(14.0),
                   topics=WITHOUT_CELL)
    result = find_gap(run, nominal(), effects=effects)
    assert result.verdict == 'parameter' and result.effects == []
    assert [p.name for p in result.parameters] == ['mass_kg']
    assert result.parameters[0].value == pytest.approx(3.0, abs=0.02)
    assert result.subsystems['load'].names == ('mass_kg',)


def test_an_offset_of_the_encoder_is_named_where_no_number_explains_it():
    rig = nominal().with_(effects=[{'name': 'contraction_bias', 'parameters': {'bias_m': 5e-4}}])
    result = find_gap(recorded(rig, voltages(14.0), topics=WITHOUT_CELL), nominal())
    assert 'contraction_bias' in result.ambiguity_set
    assert result.parameters == []


def test_numbers_are_uncertain_by_their_tolerance():
    rig = replace(nominal(), tolerance={'mass_kg': 0.3, 'T_m': 0.05, 'damping_n_s_per_m': 0.5})
    problems = subsystem_problems(rig, [Recording(recorded(nominal(), voltages(6.0)), 'ppr')])
    # Damping is a number of the muscle; a twentieth is not rough yet.
    assert subsystem_of_number('damping_n_s_per_m') == 'muscle'
    assert uncertain_numbers(problems, CRITERIA) == {'mass_kg'}


def test_the_zero_of_a_sensor_does_not_stand_before_its_bias():
    rig = replace(nominal(), tolerance={'contraction_zero_m': UNKNOWN, 'spring_n_per_m': UNKNOWN})
    problems = subsystem_problems(rig, [Recording(recorded(nominal(), voltages(6.0)), 'ppr')])
    assert 'contraction_zero_m' in {k.name for p in problems for k in p.known}
    assert uncertain_numbers(problems, CRITERIA) == {'spring_n_per_m'}


def test_an_error_of_a_sensor_is_a_bias_or_a_gain():
    assert is_sensor_error('pressure_bias') and is_sensor_error('force_gain')
    assert not is_sensor_error('pressure_lag')      # it delays; no number of the load does
    assert not is_sensor_error('creep') and not is_sensor_error('mass_kg')


def rivals(**shares):
    return [SimpleNamespace(name=name, share={'muscle': share}) for name, share in shares.items()]


@pytest.mark.parametrize('tied, behind, uncertain, stay', [
    # Without a rough number the set stays as it is, in its order.
    ({'contraction_bias': 0.99, 'mass_kg': 0.98}, {}, set(), ['contraction_bias', 'mass_kg']),
    ({'contraction_bias': 0.99, 'mass_kg': 0.98}, {}, {'mass_kg'}, ['mass_kg']),
    ({'contraction_bias': 0.99, 'end_taper': 0.99, 'mass_kg': 0.98}, {}, {'mass_kg'},
     ['mass_kg', 'end_taper']),
    # One that the test leaves behind still explains as much.
    ({'contraction_bias': 0.99}, {'mass_kg': 0.95}, {'mass_kg'}, ['mass_kg']),
    ({'contraction_bias': 0.99}, {'mass_kg': 0.93}, {'mass_kg'}, ['contraction_bias']),
    # An effect that is best is no error of a sensor.
    ({'end_taper': 0.99}, {'mass_kg': 0.98}, {'mass_kg'}, ['end_taper']),
    ({}, {'mass_kg': 0.98}, {'mass_kg'}, [])])
def test_a_rough_number_takes_the_place_of_an_error_of_a_sensor(tied, behind, uncertain, stay):
    first, rest = rivals(**tied), rivals(**behind)
    found = in_order(first, [*first, *rest], 'muscle', uncertain, 0.05)
    assert [r.name for r in found] == stay


def test_a_number_that_is_unknown_is_no_excuse_for_a_clear_gap():
    """Its prior would allow for any error; what is left of a clear gap is unknown."""
    rig = replace(nominal(), tolerance={'spring_n_per_m': UNKNOWN})
    run = recorded(nominal().with_(parameters={'spring_n_per_m': 400.0}), voltages(14.0),
                   topics=WITHOUT_CELL)
    result = find_gap(run, rig, effects=['contraction_bias', 'pressure_bias'], unnamed=())
    contraction = result.signals['contraction']
    left = contraction.rmse_after > 5.0 * contraction.noise_floor
    assert left == (result.verdict == 'unknown') and result.effects == []
    assert left == (result.subsystems['muscle'].verdict == 'unknown')
