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

"""Live recordings: asked before a motion, vented after it, whatever comes in between."""

import sys
from types import SimpleNamespace

from pam_actuation.cli.main import main
from pam_actuation.experiments import load_experiment
from pam_actuation.investigate.live import LiveRecorder
from pam_actuation.investigate.recorder import Declined, RecordingFailed
from pam_actuation.rigging import supervisor as supervisors
from pam_actuation.rigging.transitions import SessionFailed
from pam_sim import load_rig
from pam_sim.errors import InputError
import pytest

MODEL = 'dmsp_5_300_hanging_mass'
REFERENCE, DRIVER = '/muscle/reference_generator', '/muscle/valve_driver'


class Nodes:
    """Stands in for the processes of a rig; a script says what its nodes report."""

    script, made = (), []

    def __init__(self, nodes, domain_id=None):
        self.nodes, self.finished, self.said = {one.name: one for one in nodes}, 0, {}
        Nodes.made.append(self)

    def __enter__(self):
        """Return the nodes."""
        return self

    def __exit__(self, *why):
        """Note that all ended."""
        assert self.finished == 1      # vented before the processes end

    def start(self):
        """Start, or fail as the script says."""
        if self.script and isinstance(self.script[0], BaseException):
            raise self.script[0]

    def status(self, name):
        """Return what a node said last."""
        return self.said.get(name, (0, ''))

    def watch(self, seconds, until):
        """Let the nodes say what the script holds, one line after the other."""
        self.seconds = seconds
        for line in self.script:
            if isinstance(line, BaseException):
                raise line
            self.said.update(line)
            if until():
                return

    def finish(self, failure=None):
        """Vent."""
        self.finished += 1
        return []


@pytest.fixture
def record(monkeypatch, tmp_path):
    """Return a function that records on a pretended rig and returns its nodes."""
    monkeypatch.setattr(supervisors, 'Supervisor', Nodes)
    experiment = load_experiment('random_steps')

    def play(*script, ask=lambda motion: True, hardware='dummy'):
        Nodes.script, Nodes.made = script, []
        recorder = LiveRecorder(load_rig(MODEL), ask, hardware)
        recorder.record(experiment, tmp_path / 'bag', 0, 'why', lambda share: None)
        [nodes] = Nodes.made
        return nodes
    return play


def test_an_experiment_is_played_to_its_end_and_vented(record, tmp_path):
    nodes = record({REFERENCE: (0, 'playing')}, {REFERENCE: (0, 'finished')}, {DRIVER: (2, 'x')})
    assert nodes.finished == 1 and nodes.status(DRIVER) == (0, '')      # not watched any longer
    assert nodes.seconds == load_experiment('random_steps').duration_s + 5.0
    assert nodes.nodes['experiment_recorder'].parameters['output'] == str(tmp_path / 'bag')
    assert nodes.nodes['valve_driver'].parameter_file.endswith('dummy.yaml')
    assert 'sofc_controller' not in nodes.nodes      # pressure goes to the driver


def test_a_program_of_the_users_own_is_heard_and_drives_the_valve(record):
    nodes = record({REFERENCE: (0, 'finished')}, hardware='topics')
    assert {*nodes.nodes} == {
        'valve_driver', 'valve_watchdog', 'reference_generator', 'experiment_recorder'}
    assert not any(node.parameter_file for node in nodes.nodes.values())
    assert 'seed' not in nodes.nodes['experiment_recorder'].parameters


@pytest.mark.parametrize('script, said', [
    ([SessionFailed('the driver refused')], 'the driver refused'),
    ([{REFERENCE: (0, 'playing')}, SessionFailed('a node ended')], 'a node ended'),
    ([{REFERENCE: (0, 'playing'), DRIVER: (2, 'vents: no pressure')}], 'vents: no pressure'),
    ([{DRIVER: (2, 'vents: latched')}], 'vents: latched'),
    ([{REFERENCE: (0, 'waiting')}], 'did not finish within 26 s')])
def test_whatever_fails_ends_vented_with_a_sentence(record, script, said):
    with pytest.raises(RecordingFailed, match=said):
        record(*script)
    assert Nodes.made[0].finished == 1


def test_ctrl_c_vents(record):
    with pytest.raises(KeyboardInterrupt):
        record({REFERENCE: (0, 'playing')}, KeyboardInterrupt())
    assert Nodes.made[0].finished == 1


def test_a_motion_that_is_not_allowed_starts_no_node(record):
    asked = []
    with pytest.raises(Declined, match='nothing moved'):
        record(ask=lambda motion: asked.append(motion.text()))
    assert not Nodes.made
    [text] = asked
    for told in ('the muscle of your rig', '"random_steps", 21.0 s', 'up to 539 kPa gauge',
                 'limit of the driver is 600 kPa', 'Why: why', 'dump valve'):
        assert told in text, told


def test_the_limit_told_is_the_lower_one(tmp_path):
    file = tmp_path / 'hardware.yaml'
    file.write_text('/**/valve_driver:\n  ros__parameters: {backend: dummy, '
                    'max_pressure_gauge_pa: 250000.0}\n')
    recorder = LiveRecorder(load_rig(MODEL), lambda motion: True, str(file))
    assert recorder.motion(load_experiment('rest')).limit_gauge_pa == 250e3
    recorder.check(load_experiment('rest'))
    with pytest.raises(InputError, match='asks for 539 kPa gauge; the driver allows 0 to 250'):
        recorder.check(load_experiment('random_steps'))
    for first, second in ((1e5, 2e5), (2e5, 1e5)):      # of two nodes: the lowest again
        file.write_text(''.join(
            f'{node}:\n  ros__parameters: {{max_pressure_gauge_pa: {limit}}}\n'
            for node, limit in (('/**', first), ('/muscle/valve_driver', second))))
        assert recorder.motion(load_experiment('rest')).limit_gauge_pa == 1e5
    simulated = LiveRecorder(load_rig(MODEL), lambda motion: True)
    told = simulated.motion(load_experiment('rest'))
    assert told.limit_gauge_pa == 600e3 and 'a simulated muscle' in told.text()


@pytest.mark.parametrize('hardware', ['', 'dummy'])
def test_the_reach_of_a_regulator_is_not_the_limit_of_the_driver(hardware):
    rig = load_rig(MODEL)
    rig = rig.with_(parameters={'K_m': 400e3 / rig.parameters['ppr_highest_v']})
    recorder, experiment = LiveRecorder(rig, lambda motion: True, hardware), load_experiment(
        'random_steps')
    recorder.check(experiment)              # as pam up and pam run, which play it as well
    motion = recorder.motion(experiment)
    assert motion.limit_gauge_pa == 600e3
    assert 'Remark: the experiment asks for up to 539 kPa gauge; the regulator of this rig ends ' \
        'at 400 kPa' in motion.text()


@pytest.mark.parametrize('answer', ['no\n', 'y\n', 'Y\n', 'YES\n', 'yes, but\n', '\n', ''])
def test_anything_but_yes_at_the_terminal_ends_with_nothing_moved(
        answer, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(
        'pam_actuation.rigging.node_template.prepare_template', lambda *_: None)
    answers = SimpleNamespace(isatty=lambda: True, readline=lambda: answer)
    monkeypatch.setattr(sys, 'stdin', answers)
    monkeypatch.setattr(supervisors, 'Supervisor', Nodes)
    Nodes.made = []
    assert main(['investigate', '--hardware', 'dummy', '--out', str(tmp_path / 'out')]) == 130
    said = capsys.readouterr()
    assert 'Start? Type yes' in said.err and 'nothing moved' in said.out and not Nodes.made
    assert (tmp_path / 'out' / 'investigation.json').is_file()


def test_yes_at_the_terminal_starts_the_nodes(tmp_path, monkeypatch):
    monkeypatch.setattr(
        'pam_actuation.rigging.node_template.prepare_template', lambda *_: None)
    monkeypatch.setattr(sys, 'stdin', SimpleNamespace(
        isatty=lambda: True, readline=lambda: 'yes\n'))
    monkeypatch.setattr(supervisors, 'Supervisor', Nodes)
    Nodes.script, Nodes.made = (SessionFailed('a node refused'),), []
    assert main(['investigate', '--hardware', 'dummy', '--out', str(tmp_path / 'out')]) == 1
    assert len(Nodes.made) == 1
