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

"""Controllers from YAML: presets, exact round trip, mistakes with file and line."""

import importlib

import numpy as np
from pam_actuation import warm_up
from pam_actuation.control.config import load_controller
from pam_actuation.control.laws import LAWS
from pam_actuation.control.pid import PidController, SETTINGS as PID_SETTINGS
from pam_actuation.control.sofc.settings import SETTINGS as SOFC_SETTINGS
from pam_actuation.experiments import load_experiment
from pam_actuation.resources import config_dir
from pam_actuation.tuning.closed_loop import _rollout_of, ClosedLoop, ROLLOUTS
from pam_actuation.tuning.problem import rebuild
from pam_actuation.tuning.space import AXES_OF, default_axes
from pam_sim import load_joint, load_rig
from pam_sim.errors import InputError
from pam_sim.located_yaml import load_yaml
import pytest
from straight_rig import StraightRig


@pytest.mark.parametrize('name, kind', [
    ('sofc_ppr', 'sofc'), ('sofc_hsv', 'sofc'), ('sofc_untuned', 'sofc'), ('pid', 'pid'),
    ('pid_plain', 'pid'), ('pid_hsv', 'pid'), ('pid_plain_hsv', 'pid')])
def test_presets_load(name, kind):
    controller = load_controller(name, StraightRig())
    assert controller.kind == kind
    assert controller.rate_hz == 200.0


@pytest.mark.parametrize('name', ['sofc_ppr', 'pid'])
def test_text_of_a_controller_rebuilds_it_to_the_bit(name):
    first = load_controller(name, StraightRig())
    random = np.random.default_rng(5)
    moves = [(random.uniform(0.0, 0.02), random.uniform(0.0, 0.02)) for _ in range(300)]
    for x, r in moves:
        first.step(x, r, 0.013, r, 0.013)
    text = first.to_yaml()
    second = load_controller(text)
    assert second.to_yaml() == text
    first.pause()
    for x, r in moves:
        assert first.step(x, r, -0.01, r, -0.01) == second.step(x, r, -0.01, r, -0.01)
    assert first.state_values() == second.state_values()


@pytest.mark.parametrize('text, line, words', [
    ('controller: sofc\nsettings:\n  lead_sec: 0.1\n', 3, 'lead_s'),
    ('controller: sofc\nsettings:\n  lead_s: 7.0\n', 3, 'allowed 0 to 0.5 s'),
    ('controller: sofc\nsettings:\n  lead_s: soon\n', 3, 'number'),
    ('controller: sofc\nsettings:\n  index_form: round\n', 3, 'linear'),
    ('controller: fuzzy\nsettings: {}\n', 1, 'sofc'),
    ('controller: sofc\n\ngains: {}\n', 3, 'gains'),
    ('controller: pid\nrules: a.json\n', 2, 'rules'),
    ('controller: sofc\nstatic_inverse:\n  lower_m: 0\n  step_m: 0\n  pressure_pa: [1, 2]\n', 4,
     'step_m')])
def test_mistakes_name_file_line_and_what_is_allowed(text, line, words, tmp_path):
    path = tmp_path / 'mine.yaml'
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        load_controller(str(path), StraightRig())
    assert caught.value.where == f'{path}:{line}'
    assert words in str(caught.value)


SWITCHES = [(kind, one) for kind, law in (('sofc', SOFC_SETTINGS), ('pid', PID_SETTINGS))
            for one in law if one.choices]


@pytest.mark.parametrize('kind, one', SWITCHES, ids=[one.name for _, one in SWITCHES])
def test_a_switch_takes_its_words_and_numbers_and_nothing_between(kind, one, tmp_path):
    path = tmp_path / 'mine.yaml'

    def load(value):
        path.write_text(f'controller: {kind}\nsettings:\n  {one.name}: {value}\n')
        return load_controller(str(path), StraightRig())

    for number, word in enumerate(one.choices):
        assert load(word).settings[one.name] == load(number).settings[one.name] == number
        assert load_controller(load(word).to_yaml()).settings[one.name] == number
    for value in (0.3, 0.7, 2, -1, '.nan', 'round', 'true', "'1'", '[]'):
        with pytest.raises(InputError) as caught:
            load(value)
        assert caught.value.where == f'{path}:3'
        for number, word in enumerate(one.choices):
            assert f'{number} or {word}' in str(caught.value)


PREDICTED = 'predicted_proportional_pa_per_m', 'predicted_derivative_pa_s_per_m'


@pytest.mark.parametrize('gain', PREDICTED)
def test_a_prediction_without_inertia_is_refused(gain, tmp_path):
    path, inertia = tmp_path / 'mine.yaml', 'acceleration_feedforward_pa_s2_per_m'

    def load(*lines):
        path.write_text('\n  '.join(('controller: sofc\nsettings:', *lines)) + '\n')
        return load_controller(str(path), StraightRig())

    for line, lines in ((4, ('lead_s: 0.1', f'{gain}: 1.0e+3')),
                        (5, ('lead_s: 0.1', f'{gain}: 1.0e+3', f'{inertia}: 0.5'))):
        with pytest.raises(InputError, match='allowed 1 to 1e.07 Pa s2/m with') as caught:
            load(*lines)
        assert caught.value.where == f'{path}:{line}'
    assert load(f'{gain}: 1.0e+3', f'{inertia}: 1').settings[gain] == 1e3
    assert load(f'{gain}: 0.0', f'{inertia}: 0').settings[gain] == 0.0
    with pytest.raises(InputError, match=inertia):
        rebuild(load(f'{gain}: 1.0e+3', f'{inertia}: 1'), {inertia: 0.0})


def test_the_settings_that_choose_are_switches():
    assert {one.name for _, one in SWITCHES} == {
        'index_form', 'membership_form', 'jump_form', 'jump_announced', 'use_static_inverse'}


@pytest.mark.parametrize('kind', LAWS)
def test_the_lowest_pressure_of_every_law_is_below_its_highest(kind, tmp_path):
    path = tmp_path / 'mine.yaml'
    path.write_text(f'controller: {kind}\nsettings:\n  min_pressure_gauge_pa: 3.0e+5\n'
                    '  max_pressure_gauge_pa: 1.0e+5\n')
    with pytest.raises(InputError, match='must be larger than min_pressure_gauge_pa') as caught:
        load_controller(str(path), load_rig('dmsp_5_300_hanging_mass'))
    assert caught.value.where == f'{path}:4'


def preset_of(kind):
    """Return the preset by which a law is compiled ahead, '' without one."""
    return next((name for name in warm_up.LAWS if load_yaml(
        config_dir() / 'controllers' / f'{name}.yaml')['controller'] == kind), '')


@pytest.mark.parametrize('kind', LAWS)
def test_every_law_may_be_tuned_and_is_compiled_ahead(kind):
    assert kind in AXES_OF, 'add its axes to AXES_OF of tuning/space.py'
    assert kind in ROLLOUTS, 'add the file of its loop to ROLLOUTS of tuning/closed_loop.py'
    module = importlib.import_module(f'pam_actuation.tuning.{ROLLOUTS[kind]}')
    assert callable(getattr(module, f'{kind}_rollout', None)), f'write it in {module.__file__}'
    assert preset_of(kind), 'add its preset of config/controllers to LAWS of warm_up.py'


@pytest.mark.parametrize('kind', LAWS)
def test_a_law_with_the_settings_it_has_is_the_same_to_the_bit(kind):
    assert preset_of(kind), 'add its preset of config/controllers to LAWS of warm_up.py'
    first = load_controller(preset_of(kind), load_rig('dmsp_5_300_hanging_mass'))
    assert first.kind == kind
    first.step(0.0, 0.01, 0.0, 0.01, 0.0)
    second = rebuild(first, {})
    assert type(second) is type(first) and second.to_yaml() == first.to_yaml()
    first.pause()
    for _ in range(5):
        assert first.step(0.002, 0.01, 0.0, 0.01, 0.0) == second.step(0.002, 0.01, 0.0, 0.01, 0.0)


def test_a_law_without_axes_or_loop_is_refused_in_a_sentence():
    controller = load_controller('pid', StraightRig())
    controller.kind = 'relay'
    with pytest.raises(InputError, match='no axes for a relay controller; tuned are sofc, pid'):
        default_axes(controller)
    with pytest.raises(InputError, match='no compiled loop of a relay controller'):
        _rollout_of('relay')


@pytest.mark.parametrize('name', ['pid', 'lqi', 'ilc_ppr', 'mpc_ppr', 'sofc_ppr'])
def test_with_settings_changes_those_that_are_named(name):
    controller = load_controller(name, load_rig('dmsp_5_300_realistic'))
    assert controller.with_settings({}).settings == controller.settings
    changed = controller.with_settings({'max_pressure_gauge_pa': 4e5})
    assert changed.settings == {**controller.settings, 'max_pressure_gauge_pa': 4e5}
    assert changed.made_for == controller.made_for is not None


def test_other_settings_ask_the_same_of_the_driver():
    rig = load_rig('dmsp_5_300_realistic', valve='hsv')
    controller = load_controller('sofc_model_hsv', rig)
    loop = ClosedLoop(rig, load_experiment('short_sine'))
    fresh = controller.with_settings({})
    assert fresh.driver == controller.driver and fresh.driver
    assert loop.cost(fresh) == loop.cost(controller)


@pytest.mark.parametrize('name, model', [
    ('sofc_force_ppr', 'dmsp_5_300_isometric'), ('sofc_model_joint_hsv', 'joint_dmsp_5_300')])
def test_with_settings_keeps_what_a_mode_tracks(name, model):
    rig = load_rig(model) if 'force' in name else load_joint(model).with_(valve='hsv')
    controller = load_controller(name, rig)
    fresh = controller.with_settings({'slew_pa_per_s': 1e5})
    assert fresh.settings == {**controller.settings, 'slew_pa_per_s': 1e5}
    assert (fresh.driver, fresh.made_for) == (controller.driver, controller.made_for)
    assert not np.shares_memory(fresh.static_inverse, controller.static_inverse)
    same = controller.with_settings({})
    assert same.to_yaml() == controller.to_yaml()
    told = (3e5, 2.9e5) if 'joint' in name else 3e5
    named = 'pressures_pa' if 'joint' in name else 'pressure_pa'
    measured = {named: told, **({} if 'joint' in name else {'force_n': 30.0})}
    for _ in range(50):
        assert (same.step(0.01, 0.1, 0.0, 0.1, 0.0, True, **measured)
                == controller.step(0.01, 0.1, 0.0, 0.1, 0.0, True, **measured))


def test_a_law_without_with_settings_is_refused_in_a_sentence(monkeypatch):
    monkeypatch.delattr(PidController, '_fresh')
    with pytest.raises(InputError, match='^controller: a pid controller takes no other settings'):
        rebuild(load_controller('pid', StraightRig()), {})


def test_rules_are_no_path_and_settings_no_list():
    controller = load_controller('sofc_ppr', load_rig('dmsp_5_300_realistic'))
    for take in (controller.take_rules, controller.replace_rules,
                 lambda rules: controller.with_settings({}, rules)):
        with pytest.raises(InputError, match=r"rules: is 'my.json'; give what `load_rules\(PATH"):
            take('my.json')
    with pytest.raises(InputError, match=r"settings: is \['lead_s'\]; write"):
        controller.with_settings(['lead_s'])


def test_unknown_preset_lists_the_known_ones():
    with pytest.raises(InputError, match='sofc_hsv'):
        load_controller('sofc_xyz', StraightRig())


def test_without_a_rig_the_text_must_bring_its_inverse():
    with pytest.raises(InputError, match='static_inverse'):
        load_controller('controller: sofc\nsettings: {}\n')


def test_rules_file_beside_the_controller_file_is_loaded(tmp_path):
    first = load_controller('sofc_ppr', StraightRig())
    first.rules.feedforward[0, 4] = 1234.5
    first.rules.save(tmp_path / 'learned.json')
    preset = first.to_yaml().split('static_inverse:')[0]
    (tmp_path / 'mine.yaml').write_text(preset + 'rules: learned.json\n')
    second = load_controller(tmp_path / 'mine.yaml', StraightRig())
    assert second.rules.feedforward[0, 4] == 1234.5
    third = load_controller('sofc_ppr', StraightRig(), rules_file=tmp_path / 'learned.json')
    assert third.rules.digest() == second.rules.digest()
    with pytest.raises(InputError, match='no rules'):
        load_controller('pid', StraightRig(), rules_file=tmp_path / 'learned.json')
    (tmp_path / 'learned.json').write_text('{}')
    with pytest.raises(InputError, match='learned.json'):
        load_controller(tmp_path / 'mine.yaml', StraightRig())
