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

"""A controller made for another rig is refused, or runs when told so and says it."""

import json
import re

from pam_actuation.bags.load import load_run
from pam_actuation.bags.metadata import experiment_metadata
from pam_actuation.cli.main import main
from pam_actuation.control.config import load_controller
from pam_actuation.control.made_for import facts_of, other_valve
from pam_actuation.experiments import load_experiment
from pam_actuation.replay.settings import changed_controller
from pam_actuation.resources import list_config
from pam_actuation.rigging.layouts import knee, rig as rig_layout
from pam_actuation.rigging.plan import make_plan
from pam_actuation.tuning.problem import rebuild
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.joint import load_joint
from pam_sim.run import Run
import pytest

SMALL, LARGE = 'dmsp_5_300_realistic', 'dmsp_10_250_hanging_mass'
FORCE, JOINT = 'dmsp_5_300_isometric_realistic', 'joint_dmsp_5_300_realistic'


@pytest.fixture(scope='module')
def small():
    return load_rig(SMALL)


@pytest.fixture(scope='module')
def tuned(small):
    """Return the texts of controllers as `pam tune` writes them, by preset and rig."""
    return {(name, rig): load_controller(name, load_rig(rig)).to_yaml()
            for name in ('sofc_ppr', 'pid', 'lqi') for rig in (SMALL, LARGE)
            if (name, rig) != ('lqi', LARGE)}


def without_facts(text):
    """Return a controller text as it was before it stated what it was made for."""
    found = re.sub(r'made_for:\n(  .*\n)+', '', text)
    assert found != text
    return found


@pytest.mark.parametrize('name', ['sofc_ppr', 'pid'])
def test_a_file_for_another_muscle_is_refused_with_what_differs(name, tuned, small, tmp_path):
    for k, text in enumerate((tuned[name, LARGE], without_facts(tuned[name, LARGE]))):
        path = tmp_path / f'large_{k}.yaml'
        path.write_text(text)
        with pytest.raises(InputError) as found:
            load_controller(path, small)
        said = str(found.value)
        for words in (f'large_{k}.yaml:', '250 mm length (here 300)', '10 mm bore (here 5)',
                      'name its rig (with --rig', '--accept-other-rig', 'accept_other_rig:=true'):
            assert words in said, said
        assert '\n' not in said


def test_a_file_that_only_names_an_unknown_rig_is_for_that_name(tuned, small):
    text = without_facts(tuned['pid', LARGE]).replace(f'rig: {LARGE}/ppr', 'rig: mine/ppr')
    with pytest.raises(InputError, match=f'`mine`, of unknown size .here {SMALL}'):
        load_controller(text, small)
    assert load_controller(text, small.with_(name='mine')).other_rig == ''


@pytest.mark.parametrize('change, words', [
    ({'valve': 'hsv'}, 'valve ppr (here hsv)'), ({'load': 'isometric'}, 'load hanging_mass'),
    ({'parameters': {'mass_kg': 15.0}}, 'a load of 5 kg (here 15)')])
def test_valve_and_load_must_fit(change, words, tuned, small):
    with pytest.raises(InputError, match=re.escape(words)):
        load_controller(tuned['lqi', SMALL], small.with_(**change))


def test_other_effects_numbers_and_names_are_the_same_rig(tuned, small):
    for rig in (load_rig('dmsp_5_300_hanging_mass'), small.with_(name='mine', effects=[
            'coulomb_friction', 'leakage']), small.with_(parameters={'mass_kg': 6.0})):
        for name in ('sofc_ppr', 'pid', 'lqi'):
            for text in (tuned[name, SMALL], without_facts(tuned[name, SMALL])):
                assert load_controller(text, rig).other_rig == ''


@pytest.mark.parametrize('name', ['sofc_ppr', 'pid', 'lqi'])
def test_a_file_keeps_what_it_was_made_for_on_a_rig_that_will_do(name, tuned, small):
    heavy = small.with_(parameters={'mass_kg': 7.0})
    controller = load_controller(tuned[name, SMALL], heavy)
    assert controller.made_for == facts_of(small) != facts_of(heavy)
    told = load_controller(experiment_metadata(None, heavy, controller)['controller'], heavy)
    assert told.made_for == facts_of(small)
    # 14 kg is twice the mass of that rig, and not that of the file.
    with pytest.raises(InputError, match='a load of 5 kg .here 14'):
        load_controller(told.to_yaml(), small.with_(parameters={'mass_kg': 14.0}))


def test_what_a_file_does_not_say_is_that_of_the_rig(small):
    controller = load_controller('controller: pid\nmade_for: {mass_kg: 4.0}\n', small)
    assert controller.made_for == {**facts_of(small), 'mass_kg': 4.0}


def test_presets_run_on_every_rig_they_are_for(small):
    for preset, rig in (('sofc_ppr', load_rig(LARGE)), ('sofc_hsv', small.with_(valve='hsv')),
                        ('sofc_force_ppr', load_rig(FORCE)),
                        ('sofc_force_ppr', load_rig('dmsp_5_300_driven')),
                        ('sofc_joint_ppr', load_joint(JOINT))):
        controller = load_controller(preset, rig)
        assert controller.other_rig == '' and controller.made_for == facts_of(rig)
        again = load_controller(controller.to_yaml(), rig)
        assert again.made_for == controller.made_for and again.other_rig == ''
    # A force is tracked on any load whose motion is prescribed.
    text = load_controller('sofc_force_ppr', load_rig(FORCE)).to_yaml()
    assert load_controller(text, load_rig('dmsp_5_300_driven')).other_rig == ''
    with pytest.raises(InputError, match='load joint'):
        load_controller(load_controller('sofc_joint_ppr', load_joint(JOINT)).to_yaml(), small)


def test_a_hand_written_file_may_say_what_it_is_for(small, tmp_path):
    path = tmp_path / 'mine.yaml'
    path.write_text('controller: pid\nmade_for: {valve: hsv}\n')
    with pytest.raises(InputError, match='mine.yaml:2: .*valve hsv .here ppr'):
        load_controller(path, small)
    assert load_controller(path, small.with_(valve='hsv')).other_rig == ''
    path.write_text('controller: pid\nmade_for: {mass: 5}\n')
    with pytest.raises(InputError, match='mine.yaml:2: unknown key `mass`'):
        load_controller(path, small)


def test_accepted_it_runs_and_the_bag_says_so(tuned, small):
    controller = load_controller(tuned['sofc_ppr', LARGE], small, accept_other_rig=True)
    assert controller.other_rig.startswith('made for another rig: a muscle of 250 mm length')
    assert rebuild(controller, {}).other_rig == controller.other_rig
    told = experiment_metadata(None, small, controller)
    assert told['controller_other_rig'] == controller.other_rig
    assert 'muscle_bore_m: 0.01' in told['controller']
    fits = experiment_metadata(None, small, load_controller('sofc_ppr', small))
    assert 'controller_other_rig' not in fits


def test_a_replay_asks_as_well(tuned, small, tmp_path):
    path = tmp_path / 'large.yaml'
    path.write_text(tuned['pid', LARGE])
    run = Run(metadata={'rig': small.to_yaml()}, topics={})
    with pytest.raises(InputError, match='made for another rig'):
        changed_controller(run, [str(path)])
    assert changed_controller(run, [str(path)], accept_other_rig=True).other_rig


def test_nodes_are_told(tuned, small):
    controller = load_controller(tuned['sofc_ppr', LARGE], small, accept_other_rig=True)
    plan = make_plan(load_experiment('short_sine'), small, controller)
    assert plan.parameters['sofc_controller']['accept_other_rig'] is True
    plan = make_plan(load_experiment('short_sine'), small)
    assert plan.parameters['sofc_controller']['accept_other_rig'] is False
    for nodes, name in ((rig_layout(accept_other_rig=True), 'sofc_controller'),
                        (knee(accept_other_rig=True), 'joint_controller')):
        told = {node.name: node.parameters.get('accept_other_rig') for node in nodes}
        assert told.pop(name) is True and not any(told.values())


def test_pam_up_refuses_before_any_node_starts(tuned, tmp_path, capsys):
    path = tmp_path / 'large.yaml'
    path.write_text(tuned['pid', LARGE])
    assert main(['up', 'rig', '--controller', str(path)]) == 2
    said = capsys.readouterr()
    assert 'made for another rig' in said.err and said.err.count('\n') == 1 and not said.out


@pytest.mark.parametrize('preset, valve, right', [
    ('pid', 'hsv', 'pid_hsv'), ('pid_hsv', 'ppr', 'pid'), ('sofc_ppr', 'hsv', 'sofc_hsv'),
    ('sofc_model_hsv', 'ppr', 'sofc_model_ppr'), ('pid', 'ppr', ''), ('sofc_hsv', 'hsv', ''),
    ('sofc_untuned', 'hsv', ''), ('own_ppr', 'hsv', '')])
def test_a_preset_for_the_other_valve_is_told_with_the_right_one(preset, valve, right):
    known = list_config('controllers')
    said = other_valve(preset, valve, known)
    assert said.endswith(f'`{right}` is the one made for it') if right else said == ''


def test_simulation_and_replay_tell_that_a_preset_is_for_the_other_valve(tmp_path, capsys):
    bag, told = str(tmp_path / 'bag'), 'preset `pid` is made for valve ppr, this rig has hsv'
    call = ['simulate', 'short_sine', '--valve', 'hsv', '--out', bag, '--overwrite', '--json']
    assert main([*call, '--controller', 'pid']) == 0
    assert any(told in one for one in json.loads(capsys.readouterr().out)['remarks'])
    assert told in load_run(bag).metadata['remarks']
    assert main([*call, '--controller', 'pid_hsv']) == 0
    assert not any('preset' in one for one in json.loads(capsys.readouterr().out)['remarks'])
    for wanted in (['pid'], ['pid', 'lead_s=0.05']):
        changes = [word for one in wanted for word in ('--set', one)]
        assert main(['replay', bag, '--chain', *changes]) == 0
        assert told in capsys.readouterr().out
