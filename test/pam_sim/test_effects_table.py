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

"""The effects there are, as a result names them; all of them at once."""

from both_ways import compiled_and_not
import numpy as np
from pam_sim import load_rig
from pam_sim.effects.registry import effects
from pam_sim.units import P_ATM_PA
from profiles import duties, profile
import pytest

# subsystem, family, name, reported as
TABLE = """
valve transport valve_dead_time delay_s
valve transport valve_dead_time_by_direction delay_s fill_delay_s vent_delay_s
valve transport tube_lag time_constant_s
valve transport tube_lag_two_stage time_constant_s
valve transport regulator_overshoot inner_lag_s
valve valve_nonlinearity valve_dead_zone half_width_pa open_time_s close_time_s
valve valve_nonlinearity valve_dead_zone_gradual half_width_pa open_time_s close_time_s
valve valve_nonlinearity valve_dead_zone_two_ramps open_time_s close_time_s
valve valve_nonlinearity valve_hysteresis half_width_pa
valve valve_nonlinearity flow_limit fill_rate_at_400kpa_pa_per_s vent_rate_at_400kpa_pa_per_s
valve valve_nonlinearity vent_asymmetry vent_to_fill_time_ratio
valve valve_nonlinearity vent_bleed closing_pressure_pa bleed_rate_pa_per_s
valve valve_nonlinearity vent_bleed_fill_creep closing_pressure_pa bleed_rate_pa_per_s \
fill_closing_pressure_pa creep_rate_pa_per_s
valve loss leakage conductance_m3_per_s_pa mass_flow_at_400kpa_kg_per_s
valve loss leakage_slit conductance_m3_per_s_pa mass_flow_at_400kpa_kg_per_s
valve loss supply_droop reservoir_volume_m3
valve loss supply_droop_line reservoir_volume_m3
valve volume dead_volume extra_volume_m3
valve volume thermal heat_exchange_time_s
muscle friction coulomb_friction force_n
muscle friction coulomb_friction_presliding force_n
muscle friction pressure_friction force_at_400kpa_n
muscle friction pressure_friction_presliding force_at_400kpa_n
muscle friction hysteresis loop_half_width_at_400kpa_n
muscle friction hysteresis_bouc_wen loop_half_width_at_400kpa_n
muscle friction hysteresis_prandtl_ishlinskii loop_half_width_at_400kpa_n
muscle friction hysteresis_lugre loop_half_width_at_400kpa_n
muscle friction history_friction loop_half_width_at_400kpa_n
muscle friction braid_contact_friction force_at_400kpa_n
muscle friction smooth_friction force_n
muscle damping viscous_damping force_at_50mm_per_s_n
muscle damping viscous_damping_thinning force_at_50mm_per_s_n
muscle slow creep relaxing_stiffness_n_per_m creep_fraction_at_400kpa
muscle slow thermal_softening gain_loss_at_20mm_per_s
muscle static_map threshold_pressure pressure_pa
muscle static_map end_taper k_minus_1 force_change_at_500kpa_10mm_n
muscle static_map end_taper_growing k_minus_1 force_change_at_500kpa_10mm_n
muscle static_map bladder_stiffness stiffness_n_per_m
muscle static_map bladder_stiffness_progressive stiffness_n_per_m
load friction guide_friction force_n
load friction guide_friction_presliding force_n
load load parallel_spring stiffness_n_per_m
load load parallel_spring_progressive stiffness_n_per_m
sensor sensor pressure_bias bias_pa
sensor sensor contraction_bias bias_m
sensor sensor force_bias bias_n
sensor sensor pressure_gain gain_error
sensor sensor force_gain gain_error
sensor sensor pressure_lag time_constant_s
sensor sensor contraction_lag time_constant_s
""".strip().splitlines()


@pytest.mark.parametrize('line', TABLE, ids=lambda line: line.split()[2])
def test_named_as_results_name_it(line):
    subsystem, family, name, *reported = line.split()
    effect = effects()[name]
    assert (effect.subsystem, effect.family) == (subsystem, family)
    assert [item.name for item in effect.reported] == reported
    if effect.variant_of:       # states what the effect states of which it is a variant
        stated = [item.name for item in effects()[effect.variant_of].reported]
        if effect.valves == ('hsv',):
            stated = [name for name in stated if name != 'half_width_pa']      # a regulator's
        assert reported[:len(stated)] == stated         # then what only this form can tell
    for parameter in effect.parameters:
        assert parameter.unit and parameter.description
        assert parameter.lower <= parameter.default <= parameter.upper
    hsv_only = ('supply_droop', 'supply_droop_line', 'dead_volume', 'thermal',
                'valve_dead_zone_two_ramps')
    ppr_only = ('valve_hysteresis', 'flow_limit', 'vent_bleed', 'regulator_overshoot',
                'vent_bleed_fill_creep', 'valve_dead_time_by_direction')
    expected = ('hsv',) if name in hsv_only else ('ppr',) if name in ppr_only else ('ppr', 'hsv')
    assert effect.valves == expected


@pytest.mark.parametrize('name', sorted(effects()))
@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_halving_the_step_changes_little_beside_the_realistic_effects(name, valve):
    rig = load_rig('dmsp_5_300_realistic', valve=valve)
    if valve not in effects()[name].valves:
        return
    others = [item for item in rig.effects if item.name != name]
    rig = rig.with_(effects=[*others, {'name': name}])
    count = 2000
    signal = profile('step', count) / 100.0 if valve == 'ppr' else duties('step', count)
    start = {'initial_pressure_pa': P_ATM_PA + 300e3}
    coarse = rig.simulate(signal, **start)
    fine = rig.simulate(np.repeat(signal, 2, axis=0), dt_s=0.0005, **start)
    for key in ('pressure_pa', 'contraction_m', 'force_n'):
        theirs = getattr(fine, key)[::2]
        assert np.max(np.abs(getattr(coarse, key) - theirs)) <= 1e-3 * np.ptp(theirs), (
            f'{key} depends on the step; return means over it, see pam_sim/rollout/hooks.py')


def test_no_the_realistic_and_all_effects_interpreted_and_compiled(tmp_path):
    script = (
        'import sys, numpy as np\n'
        'from pam_sim import load_rig\n'
        'from pam_sim.effects.registry import effects\n'
        't = np.arange(60) * 1e-3\n'
        'rows = []\n'
        'given = {"half_width_pa": 3e3, "open_time_s": 1.7e-3, "close_time_s": 2e-3,\n'
        '         "fill_rate_at_400kpa_pa_per_s": 3e5}\n'
        'chosen = [{"name": name, "parameters": {\n'
        '    key: value for key, value in given.items() if key in effect.values()}}\n'
        '    for name, effect in effects().items()]\n'
        'for valve, fidelity in (("ppr", "averaged"), ("hsv", "averaged"),\n'
        '                        ("hsv", "switching")):\n'
        '    rig, realistic = [load_rig(f"dmsp_5_300_{name}", valve=valve, fidelity=fidelity)\n'
        '                      for name in ("hanging_mass", "realistic")]\n'
        '    s = 4 + 2 * np.sin(40 * t)\n'
        '    if valve == "hsv":\n'
        '        s = np.sin(40 * t)\n'
        '        s = np.stack([np.clip(s, 0, 1), np.clip(-s, 0, 1)], axis=1)\n'
        '    for one in (rig, realistic, rig.with_(effects=chosen)):\n'
        '        rows.append(one.simulate(s, initial_pressure_pa=501325.0).outputs)\n'
        'np.save(sys.argv[1], np.array(rows))\n')
    results = compiled_and_not(script, tmp_path)
    assert np.isfinite(results[0]).all()
    assert np.array_equal(*results)


@pytest.mark.parametrize('valve, fidelity', [
    ('ppr', 'averaged'), ('hsv', 'averaged'), ('hsv', 'switching')])
def test_a_plant_with_all_effects_steps_as_simulate_does(valve, fidelity):
    rig = load_rig('dmsp_5_300_hanging_mass', valve=valve, fidelity=fidelity).with_(
        effects=sorted(effects()))
    signal = profile('random', 300) / 100.0 if valve == 'ppr' else duties('random', 300)
    start = {'initial_pressure_pa': P_ATM_PA + 300e3}
    response = rig.simulate(signal, **start)
    plant = rig.plant(**start)
    for row, outputs in zip(signal, response.outputs):
        assert np.array_equal(plant.outputs, outputs)
        plant.step(np.atleast_1d(row))
    assert load_rig(rig.to_yaml()).effects == rig.effects
