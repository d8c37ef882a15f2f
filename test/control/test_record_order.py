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

"""Numbers of the compiled laws belong to their names, wherever they lie in memory."""

import numpy as np
from pam_actuation.control import ilc, laws, lqi, mpc, pid
from pam_actuation.control.compiled_controller import CompiledController
from pam_actuation.control.inputs import INPUT, write_inputs
from pam_actuation.control.settings import parameter_record, setting
from pam_actuation.control.sofc import records, settings, step
from pam_sim.compiled import sources
from pam_sim.parameters import check_parameters
from pam_sim.records import fields, values_of, zeros
import pytest

LAWS = {'sofc': (settings.SETTINGS, settings.PARAMETERS, records.OUTPUT, step.sofc_step),
        'pid': (pid.SETTINGS, pid.PARAMETERS, pid.OUTPUT, pid.pid_step),
        'lqi': (lqi.SETTINGS, lqi.PARAMETERS, lqi.OUTPUT, lqi.lqi_step),
        'ilc': (ilc.SETTINGS, ilc.PARAMETERS, ilc.OUTPUT, ilc.ilc_step),
        'mpc': (mpc.SETTINGS, mpc.PARAMETERS, mpc.OUTPUT, mpc.mpc_step)}
OUTPUTS = {
    'pid': (
        'command_pa', 'error_m', 'change_of_error_m_per_s', 'inverse_pa', 'proportional_pa',
        'integral_pa', 'derivative_pa', 'unlimited_command_pa', 'saturated_low',
        'saturated_high', 'slew_limited', 'start_offset_m'),
    'lqi': (
        'command_pa', 'error_m', 'estimated_contraction_m', 'innovation_m', 'feedforward_pa',
        'state_feedback_pa', 'integral_pa', 'unlimited_command_pa', 'saturated_low',
        'saturated_high', 'slew_limited', 'start_offset_m'),
    'ilc': (
        'command_pa', 'error_m', 'change_of_error_m_per_s', 'inverse_pa', 'proportional_pa',
        'integral_pa', 'derivative_pa', 'learned_pa', 'cycle_s', 'unlimited_command_pa',
        'saturated_low', 'saturated_high', 'slew_limited', 'start_offset_m'),
    'mpc': (
        'command_pa', 'error_m', 'estimated_contraction_m', 'innovation_m', 'disturbance_pa',
        'bounded', 'unlimited_command_pa', 'saturated_low', 'saturated_high', 'slew_limited',
        'start_offset_m'),
    'sofc': (
        'command_pa', 'error_m', 'change_of_error_m_per_s', 'inverse_pa',
        'dynamic_feedforward_pa', 'feedback_rules_pa', 'feedforward_rules_pa', 'motion_rules_pa',
        'proportional_pa', 'integral_pa', 'derivative_pa', 'unlimited_command_pa',
        'saturated_low', 'saturated_high', 'slew_limited', 'contracting_share', 'error_set',
        'error_degree', 'change_set', 'change_degree', 'reference_knot', 'reference_knot_degree',
        'motion_knot', 'motion_knot_degree', 'motion_rate_knot', 'motion_rate_knot_degree',
        'performance_index_m', 'learning_reason', 'credited_tick_valid',
        'feedback_rule_change_norm_pa', 'feedforward_rule_change_norm_pa',
        'motion_rule_change_norm_pa', 'start_offset_m', 'jump_to_go_m', 'window_rms_error_m',
        'best_window_rms_error_m', 'learning_rate_factor', 'times_rolled_back', 'path_rules_pa',
        'disturbance_pa', 'predicted_feedback_pa', 'path_rule_change_norm_pa')}


def test_every_law_of_controller_files_is_here():
    assert set(LAWS) == set(OUTPUTS) == set(laws.LAWS), 'add the law to LAWS and OUTPUTS above'


@pytest.mark.parametrize('law', LAWS)
def test_every_setting_is_the_compiled_parameter_of_its_name(law):
    specification, parameters, _, _ = LAWS[law]
    values = {setting.name: 1.0 + i for i, setting in enumerate(specification)}
    array = settings.parameter_array(values) if law == 'sofc' else values_of(parameters, values)
    compiled = fields(array, parameters)
    assert {name: compiled[name] for name in values} == values


@pytest.mark.parametrize('law', LAWS)
def test_outputs_keep_the_names_recordings_have(law):
    _, _, output, _ = LAWS[law]
    assert output.names == OUTPUTS[law]


def test_every_input_of_a_tick_gets_into_the_field_of_its_name():
    values = {name: 1.0 + i for i, name in enumerate(INPUT.names)}
    array = zeros(INPUT)
    write_inputs(array, **values)
    assert {name: fields(array, INPUT)[name] for name in values} == values


def test_the_arguments_of_a_step_are_its_inputs():
    class Recorded(CompiledController):
        state_names = ('command_pa',)

        def __init__(self):
            super().__init__({}, records.STATE)
            self._step, self._arguments = (lambda: 0.0), ()

    controller = Recorded()
    controller.step(1.0, 2.0, 3.0, 4.0, 5.0, True, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0)
    seen = fields(controller.input_array, INPUT)
    assert {name: seen[name] for name in INPUT.names} == {
        'contraction_m': 1.0, 'reference_m': 2.0, 'reference_rate_m_per_s': 3.0,
        'lead_reference_m': 4.0, 'lead_rate_m_per_s': 5.0, 'learning': 1.0, 'elapsed_s': 6.0,
        'pressure_pa': 7.0, 'force_n': 8.0, 'held_back': 9.0, 'age_s': 10.0,
        'pressure_age_s': 11.0}


@pytest.mark.parametrize('law', LAWS)
def test_a_changed_record_is_another_program(law):
    """Machine code on disk is found by a key; the records it reads are part of it."""
    _, parameters, output, compiled_step = LAWS[law]
    _, constants = sources(compiled_step)
    for name, record in (('PARAMETERS', parameters), ('OUTPUT', output), ('INPUT', INPUT)):
        assert f'{name} = {record!r}' in constants


def test_a_declared_setting_is_read_checked_and_compiled_without_more():
    """One line: name, unit, default, range, sentence."""
    added = setting('damping_pa_s_per_m', 'Pa s/m', 2.0, 0.0, 9.0, 'damping, for this test')
    first, *others = pid.SETTINGS
    specification = (first, added, *others)
    parameters = parameter_record(specification)
    read = check_parameters(specification, {'damping_pa_s_per_m': 3.0})
    compiled = fields(values_of(parameters, read), parameters)
    assert compiled.damping_pa_s_per_m == 3.0
    assert fields(values_of(parameters, check_parameters(specification, {})),
                  parameters).damping_pa_s_per_m == 2.0
    assert np.isclose(compiled.start_time_s, read['start_time_s'])
