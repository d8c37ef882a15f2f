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

"""An investigation: rounds kept whole, the same bytes after a kill, every ending."""

from dataclasses import replace
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys

from jsonschema import Draft202012Validator
from pam_actuation.bags.load import load_run
from pam_actuation.cli.main import main
from pam_actuation.experiments import load_experiment
from pam_actuation.investigate import Budget, Investigation, loop, Question
from pam_actuation.investigate.decide import decide
from pam_actuation.investigate.page import investigation_page
from pam_actuation.investigate.question import digest_of
from pam_actuation.investigate.recorder import Declined, Recorder, RecordingFailed
from pam_actuation.investigate.rounds import Round
from pam_actuation.investigate.schema import investigation_schema
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.gap.result import GapResult
import pytest

MODEL = 'dmsp_5_300_hanging_mass'
TRUTH = f"""
rig: {MODEL}
effects:
- name: coulomb_friction
  parameters: {{force_n: 3.0}}
sensors: {{pressure_noise_pa: 300.0, contraction_noise_m: 1.0e-5, force_noise_n: 0.1}}
"""
EXPERIMENT = """
name: short_check
description: Six seconds
domain: pressure
segments:
  - rest: {duration_s: 0.5}
  - random_steps: {low_pa: 351325.0, high_pa: 651325.0, min_hold_s: 0.25, max_hold_s: 0.8,
                   duration_s: 5.5, seed: 3}
"""
NEXT = {'name': 'tell_apart_edges', 'why': 'Edges tell them apart.', 'separation_sigma': 2.0,
        'needs': ['pressure'], 'experiment': {
            'name': 'tell_apart_edges', 'domain': 'pressure', 'description': 'Edges',
            'segments': [{'rest': {'duration_s': 1.0}},
                         {'step': {'to_pa': 300000.0, 'duration_s': 1.0}}]}}


def arguments(folder, out):
    """Return the command line of a small investigation."""
    return ['investigate', '--rig', str(folder / 'truth.yaml'), '--experiment',
            str(folder / 'short.yaml'), '--effects', 'coulomb_friction,leakage', '--out', str(out)]


@pytest.fixture(scope='module')
def lab(tmp_path_factory):
    """Return a folder with the files of the true rig and of the experiment."""
    folder = tmp_path_factory.mktemp('lab')
    (folder / 'truth.yaml').write_text(TRUTH)
    (folder / 'short.yaml').write_text(EXPERIMENT)
    return folder


@pytest.fixture(scope='module')
def done(lab):
    """Return the folder of an investigation that ended in one round."""
    assert main([*arguments(lab, lab / 'done'), '--json']) == 0
    return lab / 'done'


def content(folder):
    """Return {name: bytes} of an investigation, times aside."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob('*')
            if path.is_file() and path.name not in ('times.csv', '.lock')}


def test_one_round_ends_with_a_name_a_model_and_a_page(done):
    data = json.loads((done / 'investigation.json').read_text())
    Draft202012Validator(investigation_schema()).validate(data)
    assert data['ended'] == 'answered' and data['verdict'] == 'effects'
    [effect], [told] = data['effects'], data['rounds']
    low, high = effect['parameters']['force_n']['ci95']
    assert effect['name'] == 'coulomb_friction' and low < 3.0 < high
    assert told['recordings'] == [
        {'path': 'recordings/1/bag', 'experiment': 'short_check', 'duration_s': 6.0}]
    assert data['signals']['contraction']['shrink_percent'] > 95.0
    [added] = load_rig(str(done / data['model'])).effects
    assert added.name == 'coulomb_friction'
    assert data['next_command'] == 'pam tune --model model.yaml --out tuned.yaml'
    page = (done / 'report.html').read_text()
    assert 'Round 1</h2>' in page and 'href="rounds/1/report.html"' in page
    assert 'coulomb_friction' in page and data['next_command'] in page
    assert (done / 'rounds' / '1' / 'report.html').is_file()
    # The path of the folder is in no file, so that it may be moved.
    assert not [name for name, held in content(done).items() if str(done).encode() in held]


def test_a_kill_costs_a_step_and_no_byte(done, lab, capsys):
    code = ('import os, signal, sys\n'
            'from pam_actuation.investigate import loop\n'
            'from pam_actuation.cli.main import main\n'
            'loop.save_gap = lambda result, runs, folder: (\n'
            '    (folder / "half").write_text("half"), os.kill(os.getpid(), signal.SIGKILL))\n'
            'main(sys.argv[1:])\n')
    out = lab / 'killed'
    ended = subprocess.run([sys.executable, '-c', code, *arguments(lab, out)], check=False,
                           capture_output=True)
    assert ended.returncode == -signal.SIGKILL
    assert (out / 'recordings' / '1').is_dir() and not (out / 'rounds' / '1').exists()
    bag = out / 'recordings' / '1' / 'bag' / 'bag_0.mcap'
    recorded = os.stat(bag).st_mtime_ns
    assert main(arguments(lab, out)) == 0
    assert 'round 1, short_check (6 s): effects: coulomb_friction' in capsys.readouterr().out
    assert os.stat(bag).st_mtime_ns == recorded         # not recorded again
    assert content(out) == content(done)
    # And once more: nothing is left to do.
    assert main([*arguments(lab, out), '--rounds', '1']) == 0
    assert content(out) == content(done)
    assert (out / 'times.csv').read_text().count('\n') == 2


def test_a_folder_holds_one_question(done, lab, tmp_path, capsys):
    before = content(done)
    assert main([*arguments(lab, done), '--seed', '7']) == 2
    assert 'another seed' in capsys.readouterr().err and content(done) == before
    (tmp_path / 'rounds').mkdir()
    assert main(arguments(lab, tmp_path)) == 2
    assert 'belongs to no investigation' in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ['rounds']
    shutil.copytree(done, tmp_path / 'damaged')
    (tmp_path / 'damaged' / 'rounds' / '1' / 'gap.json').write_text('{')
    assert main(arguments(lab, tmp_path / 'damaged')) == 2
    assert 'rounds/1: this round is damaged' in capsys.readouterr().err


def test_mistakes_are_told_before_anything_moves(lab, tmp_path, capsys, monkeypatch):
    out = tmp_path / 'out'
    monkeypatch.setattr(
        'pam_actuation.rigging.node_template.prepare_template', lambda *_: None)
    rig = ['--rig', str(lab / 'truth.yaml')]
    for words, says in (
            ([], '--hardware NAME|FILE for a real one'),
            ([*rig, '--hardware', 'dummy'], 'goes without --hardware'),
            (['--hardware', 'dummy', '--live'], 'is live already'),
            (['--hardware', 'dumy', '--yes'], '`dummy`'),
            (['--hardware', 'sim', '--yes'], 'is no real rig; a simulated one is --rig'),
            (['--hardware', 'dummy'], 'nobody can be asked'),
            (['--hardware', str(lab / 'dac.yaml'), '--yes'], 'did you mean `backend`'),
            ([*rig, '--domain-id', '7'], 'goes with --live or --hardware'),
            ([*rig, '--namespace', '/muscle'], 'goes with bags'),
            ([*rig, '--effects', 'leak'], '`leakage`'),
            ([*rig, '--experiment', 'sine'], 'experiment'),
            ([*rig, '--experiment', 'force_sine'], 'moves freely'),
            ([*rig, '--rounds', '0'], '1 to 50'),
            ([*rig, '--model', str(lab / 'hsv.yaml')], 'has valve hsv, the rig has ppr'),
            ([*rig, str(tmp_path / 'no_bag')], 'no_bag')):
        (lab / 'dac.yaml').write_text(
            '/**/valve_driver:\n  ros__parameters: {backnd: dummy}\n')
        (lab / 'hsv.yaml').write_text(f'rig: {MODEL}\nvalve: hsv\n')
        assert main(['investigate', *words, '--out', str(out)]) == 2, words
        said = capsys.readouterr().err
        assert says in said and said.count('\n') == 1, said
    assert not out.exists()


class Copies(Recorder):
    """Records by copying a bag; the answers of the test decide what else happens."""

    valve = 'ppr'

    def __init__(self, bag, failing=None):
        self.bag, self.failing, self.played = bag, failing or {}, []

    def check(self, experiment):
        """Allow everything."""

    def record(self, experiment, bag, seed, why, progress):
        """Copy the bag, or raise what is due."""
        self.played.append((experiment.name, seed, why))
        due = self.failing.get(len(self.played))
        if not isinstance(due, Declined):       # of a declined motion there is no bag
            shutil.copytree(self.bag, bag)
        if due is not None:
            raise due

    def to_dict(self):
        """Return how."""
        return {'how': 'simulated', 'rig': ''}


@pytest.fixture
def small(done, tmp_path, monkeypatch):
    """Return a function that runs an investigation whose looks give prepared verdicts."""
    asked = []

    def investigate(verdicts, failing=None, given=(), folder=tmp_path / 'out', loaded=(),
                    **budget):
        left = list(verdicts)

        def gap_of(runs, model, played, progress, **options):
            asked.append((len(runs), list(played)))
            verdict = left.pop(0)
            result = GapResult(verdict, f'It is {verdict}.', model_yaml=TRUTH)
            if verdict == 'ambiguous':
                result.ambiguity_set, result.next_experiment = ['creep', 'hysteresis'], NEXT
            return result

        monkeypatch.setattr(loop, 'gap_of', gap_of)
        recorder = Copies(done / 'recordings' / '1' / 'bag', failing)
        outcome = Investigation(
            Question(load_rig(MODEL), load_experiment(EXPERIMENT), tuple(map(str, given))),
            recorder, folder, Budget(**budget), given=loaded).run()
        data = json.loads((folder / 'investigation.json').read_text())
        Draft202012Validator(investigation_schema()).validate(data)
        assert data == json.loads(json.dumps(outcome.to_dict()))
        assert 'Answer</h2>' in (folder / 'report.html').read_text()
        return outcome, recorder.played

    investigate.asked = asked
    return investigate


def test_rivals_are_told_apart_by_what_the_look_suggests(small):
    outcome, played = small(['ambiguous', 'effects'])
    assert [one[:2] for one in played] == [('short_check', 0), ('tell_apart_edges', 1)]
    assert played[1][2] == 'Edges tell them apart.'
    assert [count for count, _ in small.asked] == [1, 2]        # the second judges both
    assert outcome.answered and [one.verdict for one in outcome.rounds] == [
        'ambiguous', 'effects']
    assert 'round 1, short_check (6 s): ambiguous: creep or hysteresis' in outcome.text('x')


def test_a_spent_budget_is_an_ending_and_more_goes_on(small):
    outcome, _ = small(['ambiguous', 'ambiguous'], rounds=2)
    assert outcome.ended == 'rounds' and 'with --rounds 3 or more' in outcome.text('x')
    outcome, played = small(['no_gap'], rounds=3)
    assert outcome.answered and len(outcome.rounds) == 3 and len(played) == 1


def test_no_time_is_no_round(small):
    outcome, played = small([], minutes=-1.0)
    assert outcome.ended == 'minutes' and not played and not outcome.rounds
    assert outcome.to_dict()['verdict'] is None and outcome.next_command('x') is None


def test_a_motion_that_is_declined_or_fails_ends_in_order(small, tmp_path):
    outcome, _ = small(['ambiguous'], {2: Declined('not allowed')})
    assert (outcome.ended, outcome.because) == ('declined', 'not allowed')
    assert not outcome.wrong and 'the same command goes on' in outcome.text('x')
    outcome, _ = small([], {1: RecordingFailed('the driver vented')})
    assert outcome.ended == 'failed' and outcome.wrong and len(outcome.rounds) == 1
    # What was recorded until then is kept beside the whole recordings, for the person.
    names = sorted(path.name for path in (tmp_path / 'out' / 'recordings').iterdir())
    assert names == ['1', '2_stopped'] and load_run(
        tmp_path / 'out' / 'recordings' / '2_stopped').topics
    with pytest.raises(KeyboardInterrupt):
        small([], {1: KeyboardInterrupt()})
    assert (tmp_path / 'out' / 'recordings' / '2_stopped_2' / 'metadata.yaml').is_file()
    outcome, played = small(['effects'])
    assert outcome.answered and [one[0] for one in played] == ['tell_apart_edges']


def test_what_the_rig_cannot_do_is_an_ending_and_what_goes_wrong_is_none(
        small, tmp_path, monkeypatch):
    full = InputError('No space left on device', 'recordings/2/bag')
    with pytest.raises(InputError, match='No space left'):
        small(['ambiguous'], {2: full})
    assert not (tmp_path / 'out' / 'investigation.json').exists()
    outcome, played = small(['effects'])            # the first round is kept
    assert outcome.answered and [one[0] for one in played] == ['tell_apart_edges']

    def check(_, experiment):
        if experiment.name == 'tell_apart_edges':
            raise InputError('asks for too much')

    monkeypatch.setattr(Copies, 'check', check)
    outcome, played = small(['ambiguous'], folder=tmp_path / 'weak')
    assert (outcome.ended, outcome.because) == ('impossible', 'asks for too much')
    assert not outcome.wrong and len(played) == 1


def test_a_live_recording_that_is_refused_is_made_again(small, tmp_path, monkeypatch):
    outcome, _ = small(['refused'])
    assert outcome.wrong and not outcome.has_model
    outcome, played = small([])                 # a simulated rig would give the same again
    assert outcome.ended == 'refused' and not played
    monkeypatch.setattr(Copies, 'is_live', True)
    outcome, played = small(['no_gap'])
    assert outcome.answered and len(played) == 1 and len(outcome.rounds) == 1
    assert sorted(path.name for path in (tmp_path / 'out' / 'recordings').iterdir()) == [
        '1', '1_refused']


def test_recordings_that_are_there_are_the_first_round(small, done, tmp_path, monkeypatch):
    bags = [done / 'recordings' / '1' / 'bag'] * 2
    outcome, played = small(['unknown', 'refused'], given=bags)
    assert [one[0] for one in played] == [] and small.asked[0][0] == 2
    assert outcome.ended == 'not_named'     # what shows every effect is among them
    assert outcome.rounds[0].recordings[0]['path'].startswith('..')
    runs = [load_run(bag) for bag in bags]
    monkeypatch.setattr(loop, 'load_run', lambda *told, **more: pytest.fail('loaded again'))
    again, _ = small(['unknown'], given=bags, folder=tmp_path / 'again', loaded=runs)
    assert again.to_dict() == outcome.to_dict()


@pytest.mark.parametrize('load', ['driven', 'isometric'])
def test_no_controller_is_tuned_on_a_load_that_does_not_move_freely(small, load):
    outcome, _ = small(['effects'])
    assert 'next: pam tune --model x/model.yaml' in outcome.text('x')
    model = load_rig(f'dmsp_5_300_{load}').to_yaml()
    outcome = replace(outcome, question={**outcome.question, 'model': model})
    assert outcome.has_model and outcome.next_command('x') is None
    assert 'next:' not in outcome.text('x') and 'model: x/model.yaml' in outcome.text('x')
    page = investigation_page(outcome, model)
    assert 'The final model</h2>' in page and 'Next: pam' not in page


def test_a_proposed_term_lies_beside_the_model(small, done, tmp_path):
    bag, out = done / 'recordings' / '1' / 'bag', tmp_path / 'out'
    small(['unknown'], given=[bag])
    round_1 = out / 'rounds' / '1'
    gap = json.loads((round_1 / 'gap.json').read_text())
    gap['proposal'] = {'equation': 'dF = a x', 'file': 'proposed_effect.py', 'explained': 0.9,
                       'subsystem': 'muscle', 'range': {'x': [0.0, 0.02]}}
    (round_1 / 'gap.json').write_text(json.dumps(gap))
    (round_1 / 'proposed_effect.py').write_text('a = 1\n')
    outcome, _ = small([], given=[bag])
    assert outcome.ended == 'not_named' and 'dF = a x' in outcome.text('x')
    assert (out / 'proposed_effect.py').read_text() == 'a = 1\n'
    gap['proposal'] = None
    (round_1 / 'gap.json').write_text(json.dumps(gap))
    small([], given=[bag])
    assert not (out / 'proposed_effect.py').exists() and (out / 'model.yaml').is_file()


def test_a_surrogate_lies_beside_the_model(small, done, tmp_path):
    bag, out = done / 'recordings' / '1' / 'bag', tmp_path / 'out'
    small(['unknown'], given=[bag])
    round_1 = out / 'rounds' / '1'
    gap = json.loads((round_1 / 'gap.json').read_text())
    gap['surrogate'] = {
        'names': ['flow_limit'], 'file': 'surrogate_model.yaml', 'explained': 0.6,
        'signals': {'pressure': {'rmse_refit': 2e3, 'rmse_surrogate': 1e3}}}
    (round_1 / 'gap.json').write_text(json.dumps(gap))
    (round_1 / 'surrogate_model.yaml').write_text('rig: a\n')
    outcome, _ = small([], given=[bag])
    assert 'surrogate: flow_limit; file' in outcome.text('x')
    assert 'A model with flow_limit follows' in (out / 'report.html').read_text()
    Draft202012Validator(investigation_schema()).validate(
        json.loads((out / 'investigation.json').read_text()))
    assert (out / 'surrogate_model.yaml').read_text() == 'rig: a\n'
    # As an earlier version wrote it.
    del gap['surrogate']
    (round_1 / 'gap.json').write_text(json.dumps(gap))
    small([], given=[bag])
    assert not (out / 'surrogate_model.yaml').exists()
    assert json.loads((out / 'investigation.json').read_text())['surrogate'] is None


def test_what_follows_a_round():
    wide = load_experiment(EXPERIMENT)

    def told(verdict, name, following=None):
        return Round(1, ({'path': 'p', 'experiment': name, 'duration_s': 6.0},), '', {
            'verdict': verdict, 'next_experiment': following, 'effects': [], 'parameters': [],
            'ambiguity_set': []})
    assert decide([], wide).experiment is wide
    # A gap without a name in a narrow recording: the experiment that shows every effect.
    assert decide([told('unknown', 'sine')], wide).experiment is wide
    assert decide([told('partial', 'sine', NEXT)], wide).experiment.name == 'tell_apart_edges'
    for verdict, name, ended in (
            ('unknown', 'short_check', 'not_named'), ('ambiguous', 'short_check', 'not_separable'),
            ('partial', 'short_check', 'partly_named'),
            ('refused', 'sine', 'refused'), ('no_gap', 'sine', 'answered'),
            ('parameter', 'sine', 'answered')):
        assert decide([told(verdict, name)], wide).ended == ended


def test_the_digests_of_a_recording_stay(tmp_path):
    bag = tmp_path / 'bag'
    (bag / 'a').mkdir(parents=True)
    (bag / 'a' / 'x').write_bytes(b'12')
    (bag / 'b').write_bytes(b'3' * 3_000_000)       # more than is read at once
    content = b'a/x\0' + b'12' + b'b\0' + b'3' * 3_000_000
    assert digest_of(bag) == hashlib.sha256(content).hexdigest()
    with pytest.raises(InputError, match='No such file'):
        digest_of(tmp_path / 'gone')
