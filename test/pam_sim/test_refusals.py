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

"""What a rollout refuses, by name and range, and that it never gives back what is no number."""

from hypothesis import given, HealthCheck, settings, strategies as st
import numpy as np
from pam_sim import load_joint, load_rig, Rig
from pam_sim.effects.registry import effects
from pam_sim.errors import InputError
from pam_sim.muscle.registry import make_law
from pam_sim.records import columns, fields, size_of
from pam_sim.rollout import kernel
from pam_sim.rollout.layout import INPUT, OUTPUT, STATE
from pam_sim.rollout.physical import is_physical
from pam_sim.rollout.simulate import check_outputs, prepare
import pytest

RIG = 'dmsp_5_300_hanging_mass'


@pytest.mark.parametrize('valve, signal, words', [
    ('ppr', [1.0, np.nan], 'ppr_voltage: is nan at sample 1; allowed -1 to 12 V'),
    ('ppr', [1.0, 2.0, 400.0], 'ppr_voltage: is 400 at sample 2; allowed -1 to 12 V'),
    ('ppr', [-np.inf], 'ppr_voltage: is -inf at sample 0'),
    ('hsv', [[0.0, 0.0], [0.5, 1.01]], 'vent_duty: is 1.01 at sample 1; allowed 0 to 1'),
    ('hsv', [[-0.2, 0.0]], 'fill_duty: is -0.2 at sample 0; allowed 0 to 1'),
    ('hsv', [[np.nan, 0.0]], 'fill_duty: is nan'),
    ('ppr', 'abc', "valve_signal: is no array of numbers: 'abc'"),
    ('hsv', [[0.0, 0.0], [0.0]], 'valve_signal: is no array of numbers: [[0.0, 0.0], [0.0]]'),
])
def test_signals_out_of_range_are_refused_by_name_and_range(valve, signal, words):
    with pytest.raises(InputError) as caught:
        load_rig(RIG, valve=valve).simulate(signal)
    assert str(caught.value).startswith(words)


def test_a_saturated_voltage_is_no_mistake():
    rig = load_rig(RIG)
    assert np.array_equal(rig.simulate(np.full(50, 8.0)).outputs,
                          rig.simulate(np.full(50, 6.0)).outputs)


@pytest.mark.parametrize('given_inputs, words', [
    ({'external_force_n': [1.0, np.nan]}, 'external_force_n: is nan at sample 1'),
    ({'external_force_n': 1e7}, 'external_force_n: is 1e+07 at sample 0; allowed -100000'),
    ({'external_force_n': 'x'}, "external_force_n: is no array of numbers: 'x'"),
    ({'initial_pressure_pa': np.nan}, 'initial_pressure_pa` is nan; allowed'),
    ({'initial_pressure_pa': 400.0}, 'initial_pressure_pa` is 400; allowed 50662.5 to 2e'),
    ({'initial_contraction_m': 0.2}, 'initial_contraction_m` is 0.2; allowed 0 to 0.075 m'),
    ({'initial_contraction_m': np.nan}, 'initial_contraction_m` is nan'),
    ({'initial_signal': np.nan}, 'initial_signal` is nan; allowed -1 to 12 V'),
    ({'dt_s': np.nan}, 'dt_s` is nan; allowed 1e-06 to 0.02 s'),
    ({'dt_s': 0.0}, 'dt_s` is 0; allowed'),
    ({'dt_s': 'x'}, "`dt_s` is 'x'; a number is needed"),
    ({'initial_pressure_pa': None}, '`initial_pressure_pa` is None; a number is needed'),
    ({'initial_contraction_m': 'x'}, "`initial_contraction_m` is 'x'; a number is needed"),
    ({'initial_signal': 'x'}, "`initial_signal` is no array of numbers: 'x'"),
])
def test_other_inputs_are_refused_by_name_and_range(given_inputs, words):
    with pytest.raises(InputError) as caught:
        load_rig(RIG).simulate([1.0, 2.0], **given_inputs)
    assert words in str(caught.value)


@pytest.mark.parametrize('effects, words', [
    ('hysteresis', "effects: is 'hysteresis'; a list is needed: write `[{'name': NAME"),
    ({'name': 'hysteresis'}, "effects: is {'name': 'hysteresis'}; a list is needed"),
    ([{'hysteresis': {}}], "effects: has {'hysteresis': {}}; write `[{'name': NAME"),
    ([7], 'effects: has 7; write'),
    (7, 'effects: is 7; a list is needed'),
    ([{'name': 'creep', 'params': {'tau_1_s': 2.0}}],
     'effect creep: has the unknown key `params` (did you mean `parameters`?); allowed: name, '),
    ([{'name': 'creep', 'parameters': [2.0]}], 'parameters of effect creep: is [2.0]; write'),
    ([{'name': 'creep', 'source': 'me'}], "source of effect creep: is 'me'; write"),
])
def test_effects_of_another_form_are_refused_with_the_form(effects, words):
    with pytest.raises(InputError) as caught:
        load_rig(RIG).with_(effects=effects)
    assert str(caught.value).startswith(words)


@pytest.mark.parametrize('given_things, words', [
    ({'parameters': [('mass_kg', 3.0)]}, "parameters: is [('mass_kg', 3.0)]; write `{'NAME': "),
    ({'parameters': {3: 4.0}}, 'parameters: is {3: 4.0}; write'),
    ({'parameters': {'mass_kg': np.array([3.0, 4.0])}},
     '`mass_kg` must be a number, not array([3., 4.]); allowed 0.1 to 500 kg'),
    ({'parameters': {'law.a3': 'x'}}, "`law.a3` is 'x'; a number is needed"),
    ({'sensors': ['force_noise_n']}, "sensors: is ['force_noise_n']; write"),
    ({'tolerance': 0.1}, 'tolerance: is 0.1; write'),
    ({'muscle': 5}, 'muscle: is 5; give a Muscle, or a name of dmsp_10_250, '),
    ({'law': ['sarosi']}, "law: is ['sarosi']; give a LawChoice or the name of a law"),
    ({'volume': ['law']}, "volume `['law']` is not known"),
    ({'load': ['driven']}, "load: `['driven']` is not known; allowed: hanging_mass"),
    ({'name': 5}, 'name: is 5; a text is needed'),
])
def test_a_change_of_a_rig_of_another_kind_is_refused_in_one_sentence(given_things, words):
    with pytest.raises(InputError) as caught:
        load_rig(RIG).with_(**given_things)
    assert str(caught.value).startswith(words)


def test_what_is_no_rig_file_is_refused_in_one_sentence():
    for wrong in (None, 3, ['dmsp_5_300_realistic']):
        for load in (load_rig, load_joint):
            with pytest.raises(InputError, match='is no name, path or YAML text'):
                load(wrong)
    with pytest.raises(InputError, match='parameters of `sarosi`: is 3; write'):
        make_law('sarosi', 3)
    with pytest.raises(InputError, match='parameters: is 3; write'):
        Rig('mine', 'hanging_mass', parameters=3)


def test_a_number_that_is_not_known_gives_a_pressure_that_is_not_known():
    for law in ('sarosi', 'tondu_lopez'):           # by formula, and by bisection
        rig = load_rig(RIG).with_(law=law)
        held_pa = rig.static_pressure_pa(np.array([0.005, np.nan]))
        assert held_pa[0] == rig.static_pressure_pa(0.005) and np.isnan(held_pa[1])
        assert np.isnan(rig.static_pressure_pa(0.005, np.nan))
        assert np.isnan(rig.static_contraction_m(4e5, np.nan))


@pytest.mark.parametrize('wrong', [np.nan, -1e5, 450.0, [5e5, 4.5]])
@pytest.mark.parametrize('spring_n_per_m', [0.0, 100.0])
def test_a_pressure_at_rest_is_absolute_and_in_pascals(wrong, spring_n_per_m):
    rig = load_rig(RIG).with_(parameters={'spring_n_per_m': spring_n_per_m})
    with pytest.raises(InputError, match=r'pressure_pa: is .*; a pressure is absolute and in Pa'):
        rig.static_contraction_m(wrong)
    assert rig.static_contraction_m(60e3) == 0.0


@pytest.mark.parametrize('path', [[0.0, np.nan, 0.0], [0.0, 0.01, 0.4], [-0.1, 0.0, 0.0]])
def test_a_driven_contraction_must_be_one_of_the_muscle(path):
    with pytest.raises(InputError, match='contraction_m: is .* allowed -0.015 to 0.15 m'):
        load_rig('dmsp_5_300_driven').simulate([1.0, 1.0], contraction_m=path)


def test_a_driven_contraction_has_one_beginning():
    """A jump of 10 mm within the first step was a force of 270 N."""
    rig = load_rig('dmsp_5_300_driven')
    with pytest.raises(InputError, match='initial_contraction_m: is 0.02, and `contraction_m` '
                                         'begins at 0.01 m; leave it out'):
        rig.simulate([3.0, 3.0], contraction_m=0.01, initial_contraction_m=0.02)
    same = rig.simulate([3.0, 3.0], contraction_m=0.01, initial_contraction_m=0.01)
    assert np.array_equal(same.outputs, rig.simulate([3.0, 3.0], contraction_m=0.01).outputs)


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_every_parameter_of_rig_and_effects_refuses_what_is_not_physical(valve):
    rig = load_rig(RIG, valve=valve)
    for parameter in rig.parameter_list:
        step = 1e-3 * (parameter.upper - parameter.lower)
        for value in (np.nan, np.inf, parameter.lower - step, parameter.upper + step, 'much'):
            with pytest.raises(InputError, match=f'`{parameter.name}`.* allowed'):
                rig.with_(parameters={parameter.name: value})
    for name, effect in effects().items():
        for parameter in effect.parameters:
            step = 1e-3 * (parameter.upper - parameter.lower)
            for value in (np.nan, parameter.lower - step, parameter.upper + step):
                with pytest.raises(InputError, match=f'`{parameter.name}`.* allowed'):
                    rig.with_(effects=[{'name': name, 'parameters': {parameter.name: value}}])


@pytest.mark.parametrize('signal, value', [
    ('contraction_m', np.nan), ('force_n', np.inf), ('true_pressure_pa', -5.0),
    ('true_pressure_pa', np.nan)])
def test_outputs_that_are_no_physics_are_noticed(signal, value):
    outputs = load_rig(RIG).simulate(np.full(20, 3.0)).outputs
    row = outputs.shape[1]
    assert is_physical(outputs.ravel(), 7 * row)
    columns(outputs, OUTPUT)[signal][7] = value
    assert [k for k in range(21) if not is_physical(outputs.ravel(), k * row)] == [7]


@pytest.mark.parametrize('effects', [[], [{'name': 'creep'}]])
def test_a_result_that_is_no_physics_is_not_handed_over(effects):
    rig = load_rig(RIG).with_(effects=effects)
    state, par, inputs = prepare(rig, np.full(20, 3.0), None, None, 0.001, {})
    columns(inputs, INPUT)['signal_0'][6:] = np.nan
    outputs = np.empty((21, size_of(OUTPUT)))
    row = kernel.entries_for(par).rollout(state, par, inputs, outputs)
    assert np.isfinite(outputs[:row]).all() and not np.isfinite(outputs[row]).all()
    with pytest.raises(InputError, match=f'leaves what is physical at step {row}'):
        check_outputs(rig, outputs, row)


def test_the_live_plant_stops_as_well():
    plant = load_rig(RIG).plant()
    plant.step(3.0)
    fields(plant.state, STATE).pressure_pa = np.nan
    with pytest.raises(InputError, match='not finite'):
        plant.step(3.0)


@given(data=st.data())
@settings(max_examples=60, deadline=None, derandomize=True,
          suppress_health_check=[HealthCheck.too_slow])
def test_extreme_numbers_give_finite_results_or_a_sentence(data):
    valve, fidelity = data.draw(st.sampled_from(
        [('ppr', 'averaged'), ('hsv', 'averaged'), ('hsv', 'switching')]))
    rig = load_rig(RIG, valve=valve, fidelity=fidelity)
    share = st.sampled_from([0.0, 1e-3, 0.5, 1.0])

    def extreme(parameters):
        return {p.name: p.lower + data.draw(share) * (p.upper - p.lower) for p in parameters}

    chosen = data.draw(st.sets(st.sampled_from(sorted(effects())), max_size=6))
    some = data.draw(st.sets(st.sampled_from([p.name for p in rig.parameter_list]), max_size=5))
    rig = rig.with_(
        parameters=extreme(p for p in rig.parameter_list if p.name in some),
        effects=[{'name': name, 'parameters': extreme(effects()[name].parameters)}
                 for name in sorted(chosen)])
    random = np.random.default_rng(data.draw(st.integers(0, 99)))
    signal = random.uniform(0.0, 6.0, 60) if valve == 'ppr' else random.uniform(size=(60, 2))
    try:
        response = rig.simulate(signal, dt_s=data.draw(st.sampled_from([1e-3, 2e-2])))
    except InputError as refused:
        assert 'physical' in str(refused)
    else:
        assert np.isfinite(response.outputs).all()
