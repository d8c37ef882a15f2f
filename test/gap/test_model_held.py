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

"""The model that is held against a recording is named, and by default the recorded one."""

import json
from pathlib import Path
import sys

from pam_actuation.bags.facts import recorded_muscle
from pam_actuation.bags.writer import BagWriter
from pam_actuation.cli.main import main
from pam_actuation.report.model_held import model_held
from pam_sim import load_rig
from pam_sim.joint import load_joint
from pam_sim.run import Run
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'bags'))
from sample_bag import write_bag  # noqa: E402, I100

NOMINAL = 'dmsp_5_300_hanging_mass'
OWN = """name: own
muscle: {like: dmsp_10_250, length_m: 0.22}
load: hanging_mass
parameters: {mass_kg: 4.0}
valve: ppr
"""
EXPERIMENT = """name: up
domain: pressure
segments:
  - rest: {duration_s: 1.0}
  - step: {to_pa: 301325.0, duration_s: 4.0}
  - step: {to_pa: 201325.0, duration_s: 4.0}
"""


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    """Return a bag that holds its rig, which has a muscle of 10 mm."""
    folder = tmp_path_factory.mktemp('own')
    (folder / 'own.yaml').write_text(OWN)
    (folder / 'up.yaml').write_text(EXPERIMENT)
    assert main(['simulate', str(folder / 'up.yaml'), '--rig', str(folder / 'own.yaml'), '--out',
                 str(folder / 'bag')]) == 0
    return folder / 'bag'


@pytest.mark.parametrize('options, line, is_recorded', [
    ([], 'Model: own (muscle_hanging_mass), valve ppr, the rig that the recording holds.',
     True),
    (['--model', NOMINAL], f'Model: {NOMINAL}, valve ppr; the recording names own '
     '(muscle_hanging_mass).', False)])
def test_terminal_page_and_json_name_the_model(bag, tmp_path, capsys, options, line, is_recorded):
    out = tmp_path / 'gap'
    main(['gap', str(bag), *options, '--effects', 'creep', '--seconds', '1', '--out', str(out)])
    said = capsys.readouterr().out.splitlines()
    told = json.loads((out / 'gap.json').read_text())['model']
    assert said[0] == line and line in (out / 'report.html').read_text()
    assert told['is_recorded'] is is_recorded and told['valve'] == 'ppr'
    remark = '' if is_recorded else (
        'The recording is of a muscle of 10 mm by 220 mm, the model has one of 5 mm by 300 mm. Is '
        'it the right model?')
    assert told['remark'] == remark and (said[1] == remark) == bool(remark)


def test_a_bag_without_a_rig_needs_a_model(tmp_path, capsys):
    with BagWriter(tmp_path / 'bag', {'origin': 'imported'}) as writer:
        writer.add_topic('/muscle/pressure', 'sensor_msgs/msg/FluidPressure')
    for more in (['--out', str(tmp_path / 'gap')], ['--explain', 'creep']):
        assert main(['gap', str(tmp_path / 'bag'), *more]) == 2
        if more[0] == '--out':
            assert 'holds no rig' in (said := capsys.readouterr().err)
            assert '--model NAME|FILE' in said and 'pam rig new' in said
    assert not (tmp_path / 'gap').exists()


RIG = f'rig: {NOMINAL}\nlaw: straight\n'
CONTROLLER = 'controller: sofc\nmade_for:\n  load: pendulum2\n'


@pytest.mark.parametrize('verb, words', [
    (['gap', '--out', '{out}'], ('rig', 2, 'muscle law `straight`', 'MUSCLE_LAWS')),
    (['gap', '--explain', 'creep'], ('rig', 2, 'muscle law `straight`', 'MUSCLE_LAWS')),
    (['tune', '--out', '{out}.yaml'], ('rig', 2, 'muscle law `straight`', 'MUSCLE_LAWS')),
    (['replay'], ('controller', 3, 'load `pendulum2`', 'LOADS')),
    (['replay', '--chain'], ('rig', 2, 'muscle law `straight`', 'MUSCLE_LAWS')),
    (['rules'], ('controller', 3, 'load `pendulum2`', 'LOADS'))])
def test_a_bag_of_a_plug_in_that_is_not_here_is_named(verb, words, tmp_path, capsys):
    held = write_bag(tmp_path / 'held', metadata={'rig': RIG, 'controller': CONTROLLER})
    text, line, missing, variable = words
    name, *options = verb
    assert main([name, str(held), *(one.format(out=tmp_path / 'x') for one in options)]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f'pam {name}: {held}: the {text} that it holds cannot be read here: '
                           f'line {line}: unknown {missing}'), said
    assert said.endswith(f'if it is your own, set PAM_{variable}_PATH to its folder\n'), said


def test_the_model_of_an_explanation_is_named(bag, capsys):
    assert main(['gap', str(bag), '--explain', 'creep', '--json']) == 0
    assert json.loads(capsys.readouterr().out)['model'] == 'own (muscle_hanging_mass)'
    assert main(['gap', '--explain', 'creep']) == 0
    assert f'model: {NOMINAL}, valve ppr' in capsys.readouterr().out


def test_the_rig_of_a_muscle_of_a_joint_is_its_side():
    joint = load_joint('joint_dmsp_5_300_realistic')
    metadata = {'rig': joint.to_yaml()}
    assert recorded_muscle(metadata, '/knee/extensor').to_yaml() == joint.extensor.to_yaml()
    assert recorded_muscle(metadata, '/muscle') is None
    run = Run({}, metadata, '/knee/flexor')
    assert model_held(joint.flexor, [run])['is_recorded']
    assert model_held(load_rig(NOMINAL), [Run({}, {})]) == {
        'name': NOMINAL, 'valve': 'ppr', 'recorded': None, 'is_recorded': False, 'remark': ''}
