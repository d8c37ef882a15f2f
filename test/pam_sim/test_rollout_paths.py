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

"""The short cuts of the compiled step: same numbers as the long way."""

import math

import numpy as np
from pam_actuation.experiments import load_experiment
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_sim import load_rig
from pam_sim.effects.registry import effects, get_effect
from pam_sim.errors import InputError
from pam_sim.joint import load_joint
from pam_sim.records import columns, fields, size_of, values_of
from pam_sim.rollout import kernel
from pam_sim.rollout.layout import EFFECTS, OUTPUT, PARAMETERS, TERMS
from pam_sim.rollout.simulate import input_array
from pam_sim.valve.flow import flow_function, mass_flow_kg_per_s
import pytest

STEPS = 600
VALVES = (('ppr', 'averaged'), ('hsv', 'averaged'), ('hsv', 'switching'))


TERM = {'name': 'muscle_term', 'parameters': {'first_of_1': 2.0}}


def rolled(rig, used=None, beyond=EFFECTS):
    """Return the outputs of a rollout; with hooks ``used``, as if effects acted through them."""
    phase = np.arange(STEPS) * 0.02
    signal = 3.0 + 2.0 * np.sin(phase)
    if rig.valve == 'hsv':
        drive = 0.5 * np.sin(phase)
        signal = np.stack([np.clip(drive, 0.0, 1.0), np.clip(-drive, 0.0, 1.0)], axis=1)
    inputs, _ = input_array(rig, signal, 2.0 * np.cos(phase))
    state, par = rig.pack(initial_pressure_pa=300e3)
    if used is not None:
        numbers = fields(par, PARAMETERS)
        numbers.beyond_nominal = beyond
        for hook in used:
            numbers.used[hook] = 1.0
    outputs = np.empty((STEPS + 1, size_of(OUTPUT)))
    kernel.entries_for(par).rollout(state, par, inputs, outputs)
    return outputs


@pytest.mark.parametrize('valve, fidelity', VALVES)
@pytest.mark.parametrize('hooks', [(), ('mass_flow', 'volume', 'muscle_force', 'sensor')])
def test_the_nominal_step_has_the_bits_of_the_step_with_hooks(valve, fidelity, hooks):
    rig = load_rig('dmsp_5_300_hanging_mass', valve=valve, fidelity=fidelity)
    nominal = rolled(rig)
    assert np.ptp(columns(nominal, OUTPUT)['contraction_m']) > 2e-3
    assert np.array_equal(nominal, rolled(rig, hooks))


def test_only_the_nominal_rig_takes_the_short_way():
    def beyond(rig):
        _, par = rig.pack()
        return fields(par, PARAMETERS).beyond_nominal

    nominal = load_rig('dmsp_5_300_hanging_mass')
    assert beyond(nominal) == 0.0
    assert beyond(nominal.with_(law='tondu_lopez')) == 1.0
    assert beyond(nominal.with_(effects=['pressure_bias'])) == 1.0
    silent = {'name': 'pressure_bias', 'parameters': {'bias_pa': 0.0}}
    assert beyond(nominal.with_(effects=[silent])) == 0.0
    assert beyond(nominal.with_(effects=[TERM])) == TERMS
    assert beyond(nominal.with_(effects=[TERM, 'pressure_bias'])) == TERMS


def test_what_knows_terms_without_a_name_has_the_same_bits_for_effects_that_have_one():
    for valve, fidelity in VALVES:
        rig = load_rig('dmsp_5_300_realistic', valve=valve, fidelity=fidelity)
        assert np.array_equal(rolled(rig, ()), rolled(rig, (), TERMS))
        assert np.abs(rolled(rig.with_(effects=[*rig.effects, TERM])) - rolled(rig)).max() > 1e-4


def test_code_that_does_not_know_terms_without_a_name_refuses_them():
    rig = load_rig('dmsp_5_300_hanging_mass').with_(effects=[TERM])
    with pytest.raises(InputError, match='a term without a name'):
        ClosedLoop(rig, load_experiment('short_sine'))
    joint = load_joint('joint_dmsp_5_300')
    joint = joint.with_(flexor=joint.flexor.with_(effects=[TERM]))
    with pytest.raises(InputError, match='a term without a name'):
        joint.simulate(*np.zeros((3, 5)))


@pytest.mark.parametrize('ratio', [0.05, 0.3, 0.5, 0.9])
def test_the_flow_in_factors_is_that_of_the_flow_function(ratio):
    for r in (0.0, ratio, ratio + 1e-9, 0.5 * (ratio + 1.0), 0.998999, 0.999, 0.9995, 1.0, 1.2):
        wanted = 2e-10 * 7e5 * flow_function(r, ratio)
        assert mass_flow_kg_per_s(7e5, r * 7e5, 2e-10, ratio) == pytest.approx(
            wanted, rel=1e-11, abs=1e-25)


def test_the_flow_is_continuous_where_the_law_changes():
    for r in (0.38, 0.999):
        below, above = (mass_flow_kg_per_s(1.0, r * (1.0 + s), 1.0, 0.38) for s in (-1e-9, 1e-9))
        assert below == pytest.approx(above, rel=1e-5)


@pytest.mark.parametrize('scale', [-1.0, 1.0])
def test_the_heat_exchange_by_series_is_that_by_exponential(scale):
    from pam_sim.effects import thermal
    before_rt = 80_000.0
    par = fields(values_of(thermal.EFFECT.packed, {
        'conductance_kg_per_s': 0.0, 'ambient_rt_j_per_kg': 84_148.0}), thermal.EFFECT.packed)
    state = fields(values_of(thermal.EFFECT.states, {
        'rt_j_per_kg': before_rt, 'stage_rt_j_per_kg': 0.0}), thermal.EFFECT.states)
    found = {}
    for name, factor in (('series', 0.99), ('exponential', 1.01)):
        # A loss a little to either side of the limit between the two, by the volume alone.
        loss = scale * factor * thermal._SMALL_LOSS
        grown = (2.0 + loss / 0.4) / (2.0 - loss / 0.4)
        start_m3 = 1e-4 * before_rt / 4e5
        found[name] = thermal.air_rt(
            1e-4, 0.0, 0.0, 4e5, grown * start_m3, 1e-3, state, par)
        assert found[name] == pytest.approx(before_rt * math.exp(-loss), rel=1e-12)
    assert found['series'] != found['exponential']


def test_every_effect_at_once_stays_within_the_numbers():
    sizes = {'valve_dead_zone': {
        'half_width_pa': 2e3, 'open_time_s': 1.7e-3, 'close_time_s': 2e-3}}
    every = [{'name': name, 'parameters': sizes.get(name, {})} for name in effects()]
    for valve, fidelity in VALVES:
        rig = load_rig('dmsp_5_300_hanging_mass', valve=valve, fidelity=fidelity)
        outputs = rolled(rig.with_(effects=every))
        assert np.isfinite(outputs).all()
        here = [name for name in effects() if valve in get_effect(name).valves]
        state, par = rig.with_(effects=every).pack()
        assert len(here) > 20 and fields(par, PARAMETERS).beyond_nominal == 1.0
        assert np.abs(outputs - rolled(rig)).max() > 1.0
