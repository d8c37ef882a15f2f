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

"""Closed loops of force and joint mode on realistic rigs: tracking, learning, limits."""

from dataclasses import replace
import math

import numpy as np
from pam_actuation.bags.load_joint import load_recording
from pam_actuation.control.config import load_controller
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.tuning.force_loop import ForceLoop
from pam_actuation.tuning.joint_loop import JointLoop
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.joint import load_joint
from pam_sim.units import P_ATM_PA
import pytest

VALVES = ('ppr', 'hsv')
SHORT = """
name: short
domain: {domain}
segments:
  - rest: {{duration_s: 0.3}}
  - ramp: {{{values}, duration_s: 0.8}}
  - hold: {{duration_s: 0.4}}
"""


def isometric(valve):
    return load_rig('dmsp_5_300_isometric_realistic', valve=valve)


@pytest.mark.parametrize('valve', VALVES)
def test_a_force_is_tracked_and_learned_on_an_isometric_load(valve):
    rig = isometric(valve)
    controller = load_controller(f'sofc_force_{valve}', rig)
    result = ForceLoop(rig, load_experiment('force_sine'), seed=1).run(controller)
    rmse_n = result.cycle_rmse()
    assert len(rmse_n) == 20 and rmse_n[-1] < 0.5 and rmse_n[-1] < 0.7 * rmse_n[0]
    assert controller.rules.motion.any()
    command_pa = result.signals['command_pa']
    assert command_pa.min() >= P_ATM_PA and command_pa.max() <= P_ATM_PA + 6e5


@pytest.mark.parametrize('valve', VALVES)
def test_a_force_is_tracked_while_the_contraction_is_driven(valve):
    rig = isometric(valve).with_(load='driven')
    loop = ForceLoop(rig, load_experiment('force_sine'), seed=2, contraction_m=lambda t: (
        0.006 + 0.004 * math.sin(2.0 * math.pi * 0.2 * t)))
    result = loop.run(load_controller(f'sofc_force_{valve}', rig))
    assert np.ptp(result.signals['contraction_m']) == pytest.approx(0.008, rel=1e-3)
    assert result.cycle_rmse()[-5:].max() < 1.0


@pytest.mark.parametrize('valve', VALVES)
@pytest.mark.parametrize('name, limb', [
    ('joint', 'joint_dmsp_5_300_realistic'), ('knee', 'knee_dmsp_20_300_realistic')])
def test_an_angle_is_tracked_and_learned_with_the_co_contraction_held(name, limb, valve):
    joint = load_joint(limb).with_(valve=valve)
    controller = load_controller(f'sofc_{name}_{valve}', joint)
    loop = JointLoop(joint, load_experiment(f'{name}_sine'), seed=3)
    result = loop.run(controller)
    rmse_deg = np.degrees(result.cycle_rmse())
    assert rmse_deg[-1] < 0.5 and rmse_deg[-1] < 0.7 * rmse_deg[0]
    commands = np.stack([result.signals[f'{side}_command_pa'] for side in ('flexor', 'extensor')])
    assert commands.min() >= P_ATM_PA and commands.max() <= P_ATM_PA + 6e5
    late = commands[:, result.time_s > 10.0].mean(axis=0)
    assert late == pytest.approx(
        np.full(len(late), P_ATM_PA + controller.co_contraction_gauge_pa), abs=1.0)
    again = loop.run(load_controller(f'sofc_{name}_{valve}', joint))
    assert np.array_equal(again.value, result.value)
    frame = result.to_dataframe()
    assert list(frame)[:3] == ['time_s', 'reference_rad', 'value_rad'] and len(frame) == loop.ticks
    assert (frame.flexor_command_pa == result.signals['flexor_command_pa']).all()


def sampled(loop):
    """Return what the experiment wants at the ticks and a little beyond, and its rate."""
    return np.transpose([loop.experiment.at(k / loop.rate_hz) for k in range(loop.ticks + 120)])


def test_the_compiled_loop_of_force_mode_steps_the_live_class():
    rig = load_rig('dmsp_5_300_driven')
    experiment = load_experiment(SHORT.format(domain='force', values='to_n: 30.0'))
    loop = ForceLoop(rig, experiment, contraction_m=lambda t: 0.005 + 0.002 * t)
    result = loop.run(load_controller('sofc_force_ppr', rig))
    controller = load_controller('sofc_force_ppr', rig)
    lead = controller.lead_s
    position, rate = sampled(loop)
    for k in range(loop.ticks):
        ahead = k + lead * loop.rate_hz
        wanted = (position[k], rate[k], *(
            np.interp(ahead, np.arange(len(values)), values) for values in (position, rate)))
        command_pa = controller.step(
            result.signals['contraction_m'][k], *wanted, True, math.nan,
            result.signals['pressure_pa'][k], result.value[k])
        assert command_pa == pytest.approx(result.signals['command_pa'][k], abs=1e-6)


def test_the_compiled_loop_of_joint_mode_steps_the_live_class():
    joint = load_joint('joint_dmsp_5_300')
    experiment = load_experiment(SHORT.format(domain='joint_angle', values='to_rad: 0.2'))
    loop = JointLoop(joint, experiment, angle_noise_rad=0.0, angle_step_rad=0.0)
    result = loop.run(load_controller('sofc_joint_ppr', joint))
    controller = load_controller('sofc_joint_ppr', joint)
    lead = controller.lead_s
    position, rate = sampled(loop)
    for k in range(loop.ticks):
        ahead = k + lead * loop.rate_hz
        wanted = (position[k], rate[k], *(
            np.interp(ahead, np.arange(len(values)), values) for values in (position, rate)))
        commands_pa = controller.step(
            result.value[k], *wanted, True, math.nan,
            *([result.signals[f'{side}_{name}'][k] for side in ('flexor', 'extensor')]
              for name in ('pressure_pa', 'force_n')))
        assert commands_pa == pytest.approx(
            [result.signals[f'{side}_command_pa'][k] for side in ('flexor', 'extensor')],
            abs=1e-6)


def loop_of(mode, supply_factor=1.0):
    """Return a loop behind on/off valves, its rig, and drivers that believe in a supply."""
    if mode == 'joint':
        rig, make, values = load_joint('joint_dmsp_5_300_realistic', valve='hsv'), JointLoop, (
            'joint_angle', 'to_rad: 0.2')
    else:
        rig, make, values = isometric('hsv'), ForceLoop, ('force', 'to_n: 60.0')
    experiment = load_experiment(SHORT.format(domain=values[0], values=values[1]))
    configs = [driver_config(muscle) for muscle in rig.muscles.values()]
    configs = [replace(one, hsv=replace(one.hsv, supply_pa=supply_factor * one.hsv.supply_pa))
               for one in configs]
    known = {'drivers': configs} if mode == 'joint' else {'driver': configs[0]}
    return make(rig, experiment, seed=1, **known), load_controller(f'sofc_{mode}_hsv', rig)


@pytest.mark.parametrize('mode', ['joint', 'force'])
def test_the_driver_of_a_rollout_is_told_the_measured_supply(mode):
    """What it believes without one changes nothing, as live."""
    (loop, controller), (other, again) = loop_of(mode), loop_of(mode, 0.8)
    assert np.array_equal(other.run(again).value, loop.run(controller).value)


@pytest.mark.parametrize('mode', ['joint', 'force'])
def test_the_driver_of_a_rollout_is_told_the_measured_contraction(mode):
    """A controller may ask for a driver whose volume grows with it; that of the rig does not."""
    loop, controller = loop_of(mode)
    controller.driver = {'hsv.volume_slope_m3_per_m': 4e-4}
    usual = loop.run(controller, learn=False)
    controller.driver['hsv.correct_by_contraction'] = 0.5
    corrected = loop.run(controller, learn=False)
    for name, pressures_pa in usual.signals.items():
        if name.endswith('pressure_pa'):
            assert np.abs(corrected.signals[name] - pressures_pa).max() > 100.0


def test_frozen_rules_stay_as_they_are():
    rig = isometric('ppr')
    controller = load_controller('sofc_force_ppr', rig)
    before = controller.rules.digest()
    ForceLoop(rig, load_experiment('force_sine')).run(controller, learn=False)
    assert controller.rules.digest() == before


def test_the_cost_of_a_force_is_in_newtons():
    rig, sine = isometric('ppr'), load_experiment(SHORT.format(
        domain='force', values='to_n: 40.0'))
    loop = ForceLoop(rig, sine)
    result = loop.run(load_controller('sofc_force_ppr', rig))
    late = result.error[-int(0.3 * loop.ticks):]
    assert loop.cost(load_controller('sofc_force_ppr', rig)) == pytest.approx(
        np.sqrt(np.mean(late ** 2)) + 0.25 * np.sqrt(np.mean(result.error ** 2))
        + 0.1 * np.abs(late).max(), rel=1e-12)


def test_what_cannot_be_tracked_is_refused():
    rig = isometric('ppr')
    sine = load_experiment('force_sine')
    with pytest.raises(InputError, match='moves freely'):
        ForceLoop(load_rig('dmsp_5_300_realistic'), sine)
    with pytest.raises(InputError, match='does not move'):
        ForceLoop(rig, sine, contraction_m=lambda t: 0.0)
    with pytest.raises(InputError, match='stroke'):
        ForceLoop(rig.with_(load='driven'), sine, contraction_m=0.2)
    for name in ('supply_pa', 'external_force_n'):
        with pytest.raises(InputError, match='acts on nothing') as caught:
            ForceLoop(rig, sine, **{name: lambda t: 5e5})
        assert caught.value.where == name
    with pytest.raises(InputError, match='this loop tracks force'):
        ForceLoop(rig, load_experiment('joint_sine'))
    joint = load_joint('joint_dmsp_5_300')
    with pytest.raises(InputError, match='tracks joint, this loop force'):
        ForceLoop(rig, sine).run(load_controller('sofc_joint_ppr', joint))
    with pytest.raises(InputError, match='not pid'):
        ForceLoop(rig, sine).run(load_controller('controller: pid\nmode: force\n', rig))
    for name, loop in (('sofc_force_hsv', ForceLoop(rig, sine)),
                       ('sofc_joint_hsv', JointLoop(joint, load_experiment('joint_sine')))):
        on = (rig if 'force' in name else joint).with_(valve='hsv')
        with pytest.raises(InputError, match='was loaded for valve hsv, the rig has ppr'):
            loop.run(load_controller(name, on))
    for wrong in ('x', np.zeros(2), lambda t: 'x'):
        with pytest.raises(InputError, match='contraction_m: is .* at 0 s; a number is needed'):
            ForceLoop(rig.with_(load='driven'), sine, contraction_m=wrong)
    for drivers in ([driver_config(rig)], [3, 4], 3):
        with pytest.raises(InputError, match=r'drivers: is .*as|drivers: is 3; give what'):
            JointLoop(joint, load_experiment('joint_sine'), drivers=drivers)
    for wrong in ({'angle_noise_rad': np.nan}, {'angle_step_rad': -1.0}):
        with pytest.raises(InputError, match='rad; allowed is 0 or more'):
            JointLoop(joint, load_experiment('joint_sine'), **wrong)
    with pytest.raises(InputError, match='joint: is Rig.*; give what `load_joint'):
        JointLoop(rig, load_experiment('joint_sine'))
    with pytest.raises(InputError, match='rad'):
        JointLoop(joint.with_(parameters={'upper_stop_rad': 0.2}), load_experiment('joint_sine'))


@pytest.mark.parametrize('mode', ['joint', 'force'])
def test_a_slow_start_is_that_of_a_simulated_run(tmp_path, mode):
    """The pressures rise as in a real run; without it they are ahead."""
    if mode == 'joint':
        rig, make, topic = load_joint('joint_dmsp_5_300_realistic'), JointLoop, 'flexor/pressure'
        wanted, domain = 'rad: 0.2', 'joint_angle'
    else:
        rig, make, topic = load_rig('dmsp_5_300_isometric_realistic'), ForceLoop, 'pressure'
        wanted, domain = 'n: 60.0', 'force'
    experiment = load_experiment(f"""
name: jump
domain: {domain}
segments:
  - rest: {{duration_s: 0.1}}
  - step: {{to_{wanted}, duration_s: 1.5}}
""")
    controller = load_controller(f'sofc_{mode}_ppr', rig)
    simulate_experiment(experiment, rig, controller, tmp_path / 'run', seed=4)
    run = load_recording(tmp_path / 'run')
    measured = run[topic]
    begins_s = run['joint_reference' if mode == 'joint' else 'reference'].time_s[0]
    away_pa = []
    for slow in (False, True):
        made = make(rig, experiment, seed=4, slow_start=slow).run(
            load_controller(f'sofc_{mode}_ppr', rig))
        pressure_pa = made.signals['flexor_pressure_pa' if mode == 'joint' else 'pressure_pa']
        away_pa.append(np.abs(pressure_pa - np.interp(
            made.time_s + begins_s, measured.time_s, measured['pressure_pa'])).max())
    assert away_pa[1] < 0.3 * away_pa[0], away_pa
