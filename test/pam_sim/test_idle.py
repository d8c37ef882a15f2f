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


"""What a model file states that does nothing: told, and true by simulation."""

import json

import numpy as np
from pam_actuation.cli.main import main
from pam_sim import load_rig
from pam_sim.effects.registry import effects
from pam_sim.idle import idle_remarks
from pam_sim.joint import load_rig_or_joint
import pytest

TIME_S = 0.001 * np.arange(1500)
WAVE = 1.0 * (TIME_S % 0.5 < 0.25)        # steps, which ask for the largest flow
SIGNALS = {'ppr': 4.0 * WAVE, 'hsv': np.column_stack([0.9 * WAVE, 0.9 - 0.9 * WAVE])}
REALISTIC = 'dmsp_5_300_realistic'
OTHERS = 'parameters: {C: 1e-9, b: 0.5, V_dead: 1e-5, supply_pa: 6e5, pwm_period_s: 0.005}'


def told(tmp_path, text, valve=None):
    """Return the rig of a file, and what is said of it without the name of the file."""
    path = tmp_path / 'rig.yaml'
    path.write_text(text)
    rig = load_rig_or_joint(path, valve)
    return rig, [one.partition('does nothing: ')[2] for one in idle_remarks(path, rig)]


def moves(rig, other):
    """Return whether two rigs differ in a simulation."""
    one, two = (each.simulate(SIGNALS[rig.valve]) for each in (rig, other))
    return any((getattr(one, name) != getattr(two, name)).any()
               for name in ('pressure_pa', 'contraction_m', 'force_n'))


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_an_effect_is_told_just_where_the_simulation_is_the_same(valve, tmp_path):
    for name, effect in effects().items():
        if effect.subsystem == 'sensor':        # of readings, which are none of the simulation
            continue
        rig, said = told(tmp_path, f'rig: dmsp_5_300_hanging_mass\nvalve: {valve}\n'
                                   f'effects: [{{name: {name}}}]\n')
        assert bool(said) != moves(rig, rig.with_(effects=[])), name


@pytest.mark.parametrize('effect', ['creep', 'flow_limit', 'leakage', 'vent_bleed'])
def test_numbers_of_the_other_valve_are_told_unless_an_effect_reads_them(effect, tmp_path):
    text = f'rig: dmsp_5_300_hanging_mass\neffects: [{{name: {effect}}}]\n'
    rig, said = told(tmp_path, f'{text}{OTHERS}\n')
    idle = said[0].partition(' are numbers of hsv')[0].split(', ')
    for name, value in rig.parameters.items():
        if name in OTHERS and len(name) > 1 or name == 'b':
            nominal = load_rig(text).parameters[name]
            assert value != nominal
            assert (name in idle) != moves(rig, rig.with_(parameters={name: nominal})), name


@pytest.mark.parametrize('valve, stated', [
    ('ppr', 'C: 1e-9, V_dead: 1e-5'), ('hsv', 'K_m: 9.0e+4, T_m: 0.05, ppr_highest_v: 7')])
def test_numbers_of_the_other_valve_may_stand_beside_any_effect(valve, stated, tmp_path):
    for name, effect in effects().items():
        if valve not in effect.valves:
            continue
        _, said = told(tmp_path, f'rig: dmsp_5_300_hanging_mass\nvalve: {valve}\nparameters: '
                                 f'{{{stated}}}\neffects: [{{name: {name}}}]\n')
        assert len(said) <= 1, name        # it ended with a traceback


@pytest.mark.parametrize('text, valve, said', [
    ('rig: dmsp_5_300_hanging_mass\nfidelity: switching\n', None, 'fidelity switching is of hsv'),
    ('rig: dmsp_5_300_hanging_mass\nvalve: hsv\nfidelity: switching\n', None, ''),
    ('rig: dmsp_5_300_hanging_mass\nparameters: {K_m: 9e4}\n', 'hsv', 'K_m is a number of ppr'),
    ('rig: dmsp_5_300_driven\neffects: [{name: guide_friction}]\n', None,
     'effect guide_friction acts on a load that moves freely'),
    ('rig: dmsp_5_300_hanging_mass\nvalve: hsv\nparameters: {supply_pa: 401325}\neffects: [{name: '
     'supply_droop, parameters: {band_pa: 450000, reservoir_volume_m3: 0.001}}]\n', None,
     'the compressor of effect supply_droop, which never starts: `band_pa` is 450 kPa, and the '
     'supply 300 kPa gauge'),
    # Of the preset, and switched off on purpose.
    (f'rig: {REALISTIC}\n', None, ''),
    (f'rig: {REALISTIC}\neffects: [{{name: valve_dead_time, parameters: {{delay_s: 0}}}}]\n',
     None, ''),
    ('joint: joint_dmsp_5_300\nflexor: dmsp_5_300_driven\nextensor: {rig: dmsp_5_300_driven, '
     'effects: [{name: dead_volume}]}\n', None, 'effect dead_volume acts with hsv')])
def test_what_is_told(text, valve, said, tmp_path):
    assert told(tmp_path, text, valve)[1] == ([said] if said else [])


def test_a_preset_serves_both_valves():
    assert idle_remarks(REALISTIC, load_rig(REALISTIC)) == []


def test_it_is_a_remark_of_check_and_simulate(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'rig.yaml').write_text(
        'rig: dmsp_5_300_hanging_mass\neffects: [{name: dead_volume}]\n')
    (tmp_path / 'rest.yaml').write_text(
        'name: rest\ndomain: pressure\nsegments:\n  - rest: {duration_s: 0.1}\n')
    said = ('with valve ppr some of what rig.yaml states does nothing: effect dead_volume acts '
            'with hsv')
    assert main(['rig', 'check', 'rig.yaml', '--json']) == 0
    assert json.loads(capsys.readouterr().out)['remarks'] == [said]
    assert main(['rig', 'check', 'rig.yaml']) == 0
    assert f'remark: {said}\n' in capsys.readouterr().out + '\n'
    assert main(['simulate', 'rest.yaml', '--rig', 'rig.yaml', '--json', '--out', 'one']) == 0
    assert json.loads(capsys.readouterr().out)['remarks'] == [said]
    assert main(['simulate', 'rest.yaml', '--rig', 'rig.yaml', '--valve', 'hsv', '--json',
                 '--out', 'two']) == 0
    assert json.loads(capsys.readouterr().out)['remarks'] == []
