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

"""What to measure next of a muscle in a joint: motions of the angle that the joint can make."""

import numpy as np
from pam_actuation.experiments import load_experiment, separating
from pam_actuation.experiments.separating_joint import in_joint, InJoint
from pam_sim.joint import load_joint
from pam_sim.located_yaml import dump_yaml
from pam_sim.run import Run, Series
import pytest

JOINT = load_joint('joint_dmsp_5_300')
KNOWN = {'rest', 'step', 'hold', 'triangle', 'random_steps', 'multisine', 'decay', 'two_bands'}


def moved(side, low_rad, high_rad, joint=JOINT):
    """Return a run of a muscle whose joint went from one angle to another."""
    index = ('flexor', 'extensor').index(side)
    x = joint.contractions_m(np.linspace(low_rad, high_rad, 500))[index]
    stamp = np.arange(500) * 5_000_000
    return Run({'contraction': Series(stamp, {'contraction_m': x})}, {'rig': joint.to_yaml()},
               f'/knee/{side}', 'bag')


@pytest.mark.parametrize('side', ['flexor', 'extensor'])
def test_it_stays_within_the_recorded_angles(side):
    place = in_joint([moved(side, -0.2, 0.3)])
    assert (place.side, place.joint.to_yaml()) == (side, JOINT.to_yaml())
    assert (place.low_rad, place.high_rad) == pytest.approx((-0.175, 0.275), abs=0.002)
    still = in_joint([moved(side, 0.1, 0.11)])
    assert (still.low_rad, still.high_rad) == pytest.approx(
        tuple(0.9 * end for end in JOINT.range_rad), abs=0.002)


def test_a_muscle_of_its_own_has_no_joint():
    run = moved('flexor', -0.2, 0.3)
    assert in_joint([Run(run.topics, run.metadata, '/muscle')]) is None
    assert in_joint([Run(run.topics, {}, '/knee/flexor')]) is None
    assert in_joint([Run(run.topics, {}, '/knee/flexor')], JOINT).joint is JOINT


def test_every_piece_is_one_the_joint_can_make(monkeypatch):
    monkeypatch.setattr(InJoint, 'simulated', lambda self, plain, truth: plain)
    monkeypatch.setattr(separating, 'separation', lambda *given: (5.0, 2.0))
    place = in_joint([moved('flexor', -0.3, 0.3)])
    rivals = [(name, JOINT.flexor, None, ()) for name in ('hysteresis', 'creep')]
    for piece in place.menu():
        found = separating.next_experiment(
            JOINT.flexor, rivals, ('pressure', 'contraction', 'force'), {}, pieces=[piece],
            place=place)
        experiment = load_experiment(dump_yaml(found['experiment']))
        experiment.check_reachable(JOINT)
        assert experiment.domain == 'joint_angle' and not experiment.remarks('ppr', JOINT)
        assert {name for one in found['experiment']['segments'] for name in one} <= KNOWN
        assert 'The angle goes from -0.27 to 0.27 rad.' in found['why']
    # A piece for a muscle alone is none of a joint.
    assert separating.next_experiment(JOINT.flexor, rivals, ('force',), {}, pieces=['shut'],
                                      place=place) is None


def test_the_truth_is_simulated_in_its_joint():
    place = InJoint(JOINT, 'extensor', -0.2, 0.2)
    truth = JOINT.extensor.with_(valve='hsv', effects=[
        {'name': 'coulomb_friction', 'parameters': {'force_n': 3.0}}])
    run = place.simulated({'name': 'short', 'domain': 'joint_angle', 'segments': [
        {'rest': {'duration_s': 0.5}}, {'step': {'to_rad': 0.2, 'duration_s': 1.0}}]}, truth)
    assert run.namespace == '/knee/extensor' and {'pressure', 'contraction', 'force'} <= set(
        run.topics)
    assert load_joint(run.metadata['rig']).extensor.effects[0].name == 'coulomb_friction'
