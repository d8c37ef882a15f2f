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

"""Rules of files, controllers and recordings, and the verb that shows them."""

import json
from pathlib import Path
import shutil

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.cli.main import main
from pam_actuation.control.config import load_controller
from pam_actuation.control.sofc.persistence import load_rules
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.rules.source import find_rules, saved_beside
from pam_sim import load_rig
from pam_sim.errors import InputError
import pytest
from rule_bases import taught

RIG = 'dmsp_5_300_hanging_mass'


@pytest.fixture(scope='module')
def learned(tmp_path_factory):
    """Return (bag, the rules its controller had at the end)."""
    rig = load_rig(RIG)
    controller = load_controller('sofc_untuned', rig)
    path = tmp_path_factory.mktemp('learned') / 'run'
    simulate_experiment(load_experiment('short_sine'), rig, controller, path)
    return path, controller.rules


@pytest.fixture
def bag(learned, tmp_path):
    """Return a copy of the bag that a test may change."""
    return shutil.copytree(learned[0], tmp_path / 'run')


def test_rules_of_a_recording_are_those_learned_in_it(learned):
    shares = []
    found = find_rules(learned[0], progress=shares.append)
    assert found.kind == 'recording' and found.remarks == ()
    assert found.rules.digest() == learned[1].digest()
    assert found.before.digest() != learned[1].digest()
    assert not any(fired.any() for fired in found.before.arrays('_fired'))
    for mine, theirs in zip(found.rules.arrays('_fired'), learned[1].arrays('_fired')):
        assert np.array_equal(mine, theirs)
    assert shares and 0.0 <= min(shares) <= max(shares) < 1.0


def test_rules_saved_beside_a_recording_are_taken(learned, bag):
    other = learned[1].copy()
    other.feedforward[0, 3] = 4321.0
    other.save(saved_beside(bag))
    for name in (bag, bag / 'metadata.yaml'):
        found = find_rules(name)
        assert found.rules.feedforward[0, 3] == 4321.0
        assert 'were read from' in found.remarks[0]
    assert saved_beside(Path('runs/one.mcap')) == Path('runs/one.rules.json')
    other.scaling['rig'] = 'another/ppr'
    other.save(saved_beside(bag))
    with pytest.raises(InputError, match='another'):
        find_rules(bag)


def test_a_recording_that_cannot_be_replayed_shows_its_start(learned, monkeypatch):
    from pam_actuation.replay import controller

    def refuses(run, progress=None):
        raise InputError('its ticks are missing')

    monkeypatch.setattr(controller, 'replay_controller', refuses)
    found = find_rules(learned[0])
    assert found.rules.digest() == found.before.digest()
    assert found.remarks == ('These are the rules at its start: what was learned is not known, '
                             'for its ticks are missing.',)


def pam(capsys, *arguments):
    """Return (exit code, standard output, standard error) of a verb."""
    code = main(['rules', *map(str, arguments)])
    shown = capsys.readouterr()
    return code, shown.out, shown.err


def test_verb_shows_saves_and_compares(learned, tmp_path, capsys):
    file, html = tmp_path / 'learned.json', tmp_path / 'rules.html'
    code, shown, _ = pam(capsys, learned[0], '--save', file, '--html', html, '--top', 3)
    assert code == 0 and f'rule file: {file}' in shown and f'page: {html}' in shown
    assert '3 most important of' in shown and '\x1b' not in shown
    assert html.read_text().count('<svg') == 4
    assert load_rules(file).digest() == learned[1].digest()
    code, shown, _ = pam(capsys, file, '--against', learned[0], '--json')
    found = json.loads(shown)
    assert code == 0 and found['since'] == 'run' and len(found['rules']) == 12
    assert not any(np.any(table['change']) for table in found['tables'])
    code, shown, _ = pam(capsys, file, '--json', '--top', 0)
    found = json.loads(shown)
    assert found['since'] == 'the initial rules' and found['rules'] == []
    assert any(np.any(table['change']) for table in found['tables'])


def test_saved_rules_start_another_run(learned, tmp_path):
    learned[1].save(tmp_path / 'learned.json')
    again = load_controller('sofc_untuned', load_rig(RIG), tmp_path / 'learned.json')
    assert again.rules.digest() == learned[1].digest()


@pytest.mark.parametrize('preset, rig, mode', [
    ('sofc_force_ppr', RIG, 'force at 1769.5 N/m'),
    ('sofc_joint_ppr', 'joint_dmsp_5_300', 'joint at 300 kPa')])
def test_other_modes_say_what_their_places_are(preset, rig, mode, capsys):
    code, shown, _ = pam(capsys, preset, '--rig', rig)
    assert code == 0 and f'not a contraction ({mode})' in shown


def test_the_rig_may_be_the_file_of_a_joint(tmp_path, capsys):
    (tmp_path / 'mine.yaml').write_text(
        'joint: joint_dmsp_5_300\nparameters: {limb_mass_kg: 0.2}\n')
    code, shown, _ = pam(capsys, 'sofc_joint_ppr', '--rig', tmp_path / 'mine.yaml')
    assert code == 0 and 'not a contraction (joint at 300 kPa)' in shown


def test_presets_and_controller_files(tmp_path, capsys):
    code, shown, _ = pam(capsys, 'sofc_untuned', '--rig', RIG)
    assert code == 0 and 'No rule has fired yet' in shown
    taught().save(tmp_path / 'learned.json')
    (tmp_path / 'mine.yaml').write_text('controller: sofc\nrules: learned.json\n')
    code, _, wrong = pam(capsys, tmp_path / 'mine.yaml', '--rig', RIG)
    assert code == 2 and 'learned with rig straight' in wrong


@pytest.mark.parametrize('arguments, words', [
    (('missing.json',), ('missing.json', 'cannot read')),
    (('missing',), ('missing', 'sofc_ppr')), (('runs/none',), ('runs/none', 'no such file')),
    (('pid', '--rig', RIG), ('a pid controller has no rules',)),
    (('sofc_ppr', '--rig', 'nothing_such'), ('nothing_such',)),
    (('sofc_ppr', '--top', '-1'), ('--top', '-1')),
    (('sofc_ppr', '--save', 'rules.yaml'), ('rules.yaml', '.json'))])
def test_mistakes_are_one_sentence_and_exit_code_2(
        arguments, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    code, shown, wrong = pam(capsys, *arguments)
    assert code == 2 and not shown and wrong.count('\n') == 1
    assert all(word in wrong for word in words)
    assert not list(tmp_path.iterdir())


def test_a_recording_without_rules_says_so(bag, capsys):
    run = load_run(bag)
    assert run.metadata['controller']
    for text, words in (('', 'does not say which controller'),
                        (_pid_text(), 'a pid controller, which has no rules')):
        code, _, wrong = pam(capsys, _with_controller(bag, text))
        assert code == 2 and words in wrong


def _pid_text():
    return load_controller('pid', load_rig(RIG)).to_yaml()


def _with_controller(bag, text):
    """Return a bag with a pressure and another controller in its metadata."""
    from pam_actuation.topics.codec import encode
    from pam_actuation.topics.table import RECORDED
    from pam_actuation.bags.metadata import experiment_metadata
    from pam_actuation.bags.writer import BagWriter
    from pam_actuation.messages import Pressure
    metadata = experiment_metadata(
        experiment='', rig=load_rig(RIG).to_yaml(), controller=text, valve='ppr',
        experiment_name='none', seed=0)
    path = bag.parent / f'with_{len(text)}'
    writer = BagWriter(path, {'pam_experiment': metadata})
    writer.add_topic('/muscle/pressure', RECORDED['pressure'].type_name)
    writer.write('/muscle/pressure', encode('pressure', Pressure(5, 1e5)), 5, 5)
    writer.close()
    return path
