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

"""The name of a rig as people see it, and what a bag does not say of itself."""

from types import SimpleNamespace

from pam_actuation.bags.facts import NOT_RECORDED, recorded_rig_title
from pam_actuation.bags.info import bag_info
from pam_actuation.bags.info_text import render_text
from pam_actuation.bags.load import load_run
from pam_actuation.bags.metadata import experiment_metadata
from pam_actuation.report.sections.provenance import provenance
from pam_actuation.rigging.layouts import rig as rig_layout
from pam_sim import load_rig
from pam_sim.joint import load_joint
from pam_sim.rig_text import rig_title
import pytest
from sample_bag import write_bag

NOMINAL, REALISTIC = 'dmsp_5_300_hanging_mass', 'dmsp_5_300_realistic'


def test_a_rig_is_called_after_its_preset_its_file_or_what_the_file_says(tmp_path):
    path = tmp_path / 'my_rig.yaml'
    path.write_text(f'rig: {REALISTIC}\n')
    named = tmp_path / 'other.yaml'
    named.write_text(f'name: bench\nrig: {NOMINAL}\n')
    titles = {REALISTIC: f'{REALISTIC} ({NOMINAL}, 4 effects)', NOMINAL: NOMINAL,
              'dmsp_10_250_hanging_mass': 'dmsp_10_250_hanging_mass',
              path: f'my_rig ({NOMINAL}, 4 effects)', named: f'bench ({NOMINAL})'}
    for source, title in titles.items():
        rig = load_rig(source)
        assert rig_title(rig) == title
        # The same on the other side of a bag.
        assert recorded_rig_title({'rig': rig.to_yaml()}) == title
    assert load_rig(f'rig: {NOMINAL}').name == NOMINAL      # a text has no file
    joint = tmp_path / 'my_joint.yaml'
    joint.write_text('joint: joint_dmsp_5_300_realistic\n')
    assert recorded_rig_title({'rig': load_joint(joint).to_yaml()}) == 'my_joint'


def test_texts_that_cannot_be_read_are_still_named():
    assert recorded_rig_title({}) == recorded_rig_title(None) == NOT_RECORDED
    assert recorded_rig_title({'rig': 'name: old\nrig: gone\nsome: thing\n'}) == 'old'
    assert recorded_rig_title({'rig': 'rig: gone\n'}) == 'gone'
    assert recorded_rig_title({'rig': 'nothing of the kind'}) == NOT_RECORDED


def test_info_and_report_name_the_rig_of_the_preset(tmp_path):
    metadata = experiment_metadata(None, load_rig(REALISTIC), seed=3)
    bag = write_bag(tmp_path / 'run', 30, metadata=metadata)
    text = render_text(bag_info(bag))
    assert f'rig: {REALISTIC} ({NOMINAL}, 4 effects)\n' in text and 'seed: 3\n' in text
    assert bag_info(bag).to_dict()['rig'].startswith(REALISTIC)
    page = provenance([('run', load_run(bag))]).body
    assert f'<td>Rig</td><td data-label="run">{REALISTIC} ({NOMINAL}, 4 effects)</td>' in page


def test_of_a_foreign_bag_nothing_is_invented(tmp_path):
    bag = write_bag(tmp_path / 'run', 30, metadata={})
    text = render_text(bag_info(bag))
    for key in ('experiment_name', 'rig', 'valve', 'seed', 'software_version'):
        assert f'{key}: {NOT_RECORDED}\n' in text
    page = provenance([('run', load_run(bag))]).body
    assert '<td>Valve</td><td data-label="run">PPR, by its signal</td>' in page
    assert f'<td>Random seed</td><td data-label="run">{NOT_RECORDED}</td>' in page
    assert f'<td>Rig</td><td data-label="run">{NOT_RECORDED}</td>' in page


def test_a_controller_for_another_rig_is_told(tmp_path):
    controller = SimpleNamespace(other_rig='made for another rig: valve ppr (here hsv)',
                                 to_yaml=lambda: 'controller: pid\n')
    bag = write_bag(tmp_path / 'run', 30, metadata=experiment_metadata(controller=controller))
    sentence = 'The controller was made for another rig: valve ppr (here hsv); this was accepted.'
    assert sentence in bag_info(bag).notes and sentence in render_text(bag_info(bag))
    page = provenance([('run', load_run(bag))]).body
    assert 'made for another rig: valve ppr (here hsv)' in page


def test_the_recorder_writes_only_what_it_was_told():
    pytest.importorskip('rclpy')
    from pam_actuation.nodes.experiment_recorder import ExperimentRecorder
    defaults = {one.name: one.default for one in ExperimentRecorder.PARAMETERS}

    def metadata(**given):
        return ExperimentRecorder._metadata(SimpleNamespace(value={**defaults, **given}.get))

    assert not {'valve', 'seed', 'rig'} & set(metadata())
    assert metadata(rig=REALISTIC)['valve'] == 'ppr' and 'seed' not in metadata(rig=REALISTIC)
    told = metadata(rig=REALISTIC, valve_type='hsv', seed=0)
    assert (told['valve'], told['seed']) == ('hsv', '0') and 'valve: hsv' in told['rig']


def test_real_sensors_have_no_seed():
    for hardware, seed in (('sim', 0), ('dummy', None)):
        nodes = {node.name: node for node in rig_layout(record='bag', hardware=hardware)}
        assert nodes['experiment_recorder'].parameters.get('seed') == seed
