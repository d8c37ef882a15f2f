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

"""``pam tune`` of a joint: from its bag or a model to a controller that runs on it."""

from dataclasses import replace
import json

import numpy as np
from pam_actuation.bags.load_joint import load_recording
from pam_actuation.bags.source import read_bag
from pam_actuation.bags.writer import BagWriter
from pam_actuation.cli.main import main
from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.tuning.joint_loop import JointLoop
from pam_actuation.tuning.loops_of_rigs import reachable
from pam_actuation.tuning.problem import Problem, rebuild
from pam_actuation.tuning.random_rigs import LIMB_FACTOR, random_rigs
from pam_actuation.tuning.recording import check_recordings, counterfactual_of_joint
from pam_actuation.tuning.space import default_axes
from pam_sim.joint import load_joint
import pytest

EXPERIMENT = """
name: short_swing
domain: joint_angle
segments:
  - rest: {duration_s: 0.5}
  - ramp: {to_rad: -0.2, duration_s: 1.0}
  - sine: {center_rad: 0.0, amplitude_rad: 0.2, frequency_hz: 0.8, cycles: 2}
"""
JOINT = 'joint_dmsp_5_300_realistic'


@pytest.fixture(scope='module')
def joint():
    return load_joint(JOINT)


@pytest.fixture(scope='module')
def bag(joint, tmp_path_factory):
    place = tmp_path_factory.mktemp('bags') / 'swing'
    simulate_experiment(load_experiment(EXPERIMENT), joint,
                        load_controller('sofc_joint_ppr', joint), place, learning=False)
    return place


def without(bag, out, *, topics=(), metadata=()):
    """Copy a bag without some topics and entries of its metadata."""
    read = read_bag(bag)
    kept = {key: text for key, text in read.experiment.items() if key not in metadata}
    writer = BagWriter(out, {'pam_experiment': kept})
    for name, topic in read.topics.items():
        if name not in topics:
            writer.add_topic(name, topic.type_name)
            for payload, time_ns in zip(topic.payloads, topic.log_time_ns):
                writer.write(name, bytes(payload), int(time_ns), int(time_ns))
    writer.close()
    return out


def test_a_bag_gives_a_better_controller_with_the_same_bytes_for_any_threads(
        bag, joint, tmp_path, capsys):
    written = []
    for jobs in ('1', '2'):
        out = tmp_path / jobs / 'tuned.yaml'
        out.parent.mkdir()
        assert main(['tune', str(bag), '--rollouts', '60', '--randomise', '1', '--seed', '5',
                     '--check', str(_file(tmp_path)), '--jobs', jobs, '--out', str(out),
                     '--json']) == 0
        found = json.loads(capsys.readouterr().out)
        assert found['improved'] and (
            found['held_out_after_deg'] < found['held_out_before_deg'] < 10.0)
        written.append([path.read_bytes() for path in (out, out.parent / 'tuned_rules.json')])
    assert written[0] == written[1]
    check, = found['recordings']
    assert check['model']['verdict'] == 'trusted' and check['counterfactual']['rms_pa'] > 10.0
    page = out.with_suffix('.html').read_text(encoding='utf-8')
    for words in ('held-out cost after', r'error [\u00b0]', 'flexor command [kPa]', 'in degrees',
                  'extensor command [kPa]', 'The initial rules', r'best cost [\u00b0]'):
        assert words in page, words
    tuned = load_controller(out, joint)
    assert tuned.rules.scaling['tracked_unit'] == 'rad' and not tuned.other_rig
    for name, change in found['changed'].items():
        assert tuned.settings[name] == change['after']
    again = tmp_path / 'again'
    assert main(['simulate', str(_file(tmp_path)), '--rig', JOINT, '--controller', str(out),
                 '--out', str(again)]) == 0
    errors = [np.sqrt(np.mean(_error_rad(load_recording(one)) ** 2)) for one in (bag, again)]
    assert errors[1] < errors[0]


def _file(folder):
    path = folder / 'swing.yaml'
    path.write_text(EXPERIMENT)
    return path


def _error_rad(run):
    wanted, angle = run['joint_reference'], run['joint_state']
    return angle['angle_rad'] - np.interp(
        angle.stamp_ns, wanted.stamp_ns, wanted['angle_rad'])


def test_the_own_model_is_trusted_and_the_own_controller_agrees(bag, joint):
    run = load_recording(bag)
    controller = load_controller('sofc_joint_ppr', joint)
    found, = check_recordings([run], joint, controller)
    assert found.model.verdict == 'trusted' and found.notes == ()
    assert found.counterfactual.rms_pa == 0.0 and found.counterfactual.ticks > 700
    # A bag that names no joint counts as one of the model.
    unnamed = {name: text for name, text in run.metadata.items() if name != 'rig'}
    found = counterfactual_of_joint(replace(run, metadata=unnamed), controller, joint)
    assert found.rms_pa == 0.0 and found.ticks > 700
    heavy = joint.with_(parameters={'limb_mass_kg': 1.5, 'inertia_kg_m2': 0.03})
    found, = check_recordings([run], heavy, controller)
    assert found.model.verdict != 'trusted' and '°' in found.model.sentence()
    hsv = load_joint(JOINT, valve='hsv')
    found, = check_recordings([run], hsv, load_controller('sofc_joint_hsv', hsv))
    assert found.model is None and 'fill_duty' in found.notes[0]


def test_random_joints_are_reachable_or_left_out_and_tracked_alike_by_every_thread(joint):
    drawn = random_rigs(joint, 3, seed=2)
    assert [one.to_yaml() for one in random_rigs(joint, 1, seed=2)] == [drawn[0].to_yaml()]
    lower, upper = LIMB_FACTOR
    for one in drawn:
        limb = one.parameters['limb_mass_kg'] / joint.parameters['limb_mass_kg']
        assert lower <= limb <= upper and one.name == joint.name
        assert one.flexor.parameters['T_m'] != one.extensor.parameters['T_m']
    experiment, controller = load_experiment(EXPERIMENT), load_controller('sofc_joint_ppr', joint)
    assert reachable(joint, experiment, controller)
    assert not reachable(joint.with_(parameters={
        'limb_mass_kg': 30.0, 'inertia_kg_m2': 0.4}), experiment, controller)
    # A regulator that ends far below the limit of the controller, of either muscle.
    for side in ('flexor', 'extensor'):
        weak = getattr(joint, side).with_(parameters={'K_m': 1e4})
        assert not reachable(joint.with_(**{side: weak}), experiment, controller)
    loops = [JointLoop(one, experiment, 1) for one in (joint, drawn[0])]
    problem = Problem(loops, controller)
    assert list(problem.costs({})) == [loop.cost(rebuild(controller, {})) for loop in loops]
    knee = load_controller('sofc_knee_ppr', load_joint('knee_dmsp_20_300_realistic'))
    for axis in default_axes(knee):      # the start lies in the box, but for gains of nothing
        value = knee.settings[axis.name]
        assert value <= axis.upper and (value >= axis.lower or value == 0.0), axis.name


@pytest.mark.parametrize('left_out, options, says', [
    ({'topics': ('/knee/joint_state',)}, (), 'no joint_state: the recording of the joint is not'),
    ({'metadata': ('rig',)}, (), 'no model to tune on'),
    ({}, ('--model', 'dmsp_5_300_realistic'), 'is the recording of a joint'),
    ({}, ('--experiment', 'tuning_half_hz'), 'only joint_angle can be tracked'),
    ({}, ('--controller', 'sofc_hsv'), 'needs `mode: joint`')])
def test_what_does_not_fit_is_one_sentence_and_nothing_is_written(
        bag, tmp_path, capsys, left_out, options, says):
    given = without(bag, tmp_path / 'bag', **left_out) if left_out else bag
    assert main(['tune', str(given), *options, '--out', str(tmp_path / 'tuned.yaml')]) == 2
    told = capsys.readouterr().err
    assert says in told and told.count('\n') == 1
    assert not list(tmp_path.glob('tuned*'))


def test_what_a_bag_broke_off_is_one_sentence(bag, tmp_path, capsys):
    cut = tmp_path / 'cut.mcap'
    cut.write_bytes((bag / 'swing_0.mcap').read_bytes()[:60_000])
    assert main(['tune', str(cut), '--out', str(tmp_path / 'tuned.yaml')]) == 2
    assert capsys.readouterr().err.count('\n') == 1
    states = without(bag, tmp_path / 'bag', topics=('/knee/controller_state',))
    found, = check_recordings([load_recording(states)], load_joint(JOINT),
                              load_controller('sofc_joint_ppr', load_joint(JOINT)))
    assert found.model is not None and 'No counterfactual check' in found.notes[0]
