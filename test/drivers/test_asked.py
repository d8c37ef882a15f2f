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
"""What a controller file asks of its driver: read, passed on, recorded and replayed."""

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.control.config import load_controller
from pam_actuation.drivers.asked import asked_by
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.replay.driver import replay_driver
from pam_actuation.rigging.layouts import rig as layout
from pam_actuation.rigging.plan import make_plan
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_actuation.tuning.force_loop import ForceLoop
from pam_actuation.tuning.foreign_plant import ForeignLoop
from pam_actuation.tuning.joint_loop import JointLoop
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.joint import load_joint
import pytest

TEXT = """
controller: pid
driver:
  hsv.gain: 0.4
  hsv.correct_by_contraction: 0.8
"""
ASKED = {'hsv.gain': 0.4, 'hsv.correct_by_contraction': 0.8}
SHORT = """
name: short
segments:
  - rest: {duration_s: 0.5}
  - sine: {center_m: 0.008, amplitude_m: 0.003, frequency_hz: 1.0, cycles: 2}
"""

JUMP = """
name: jump
segments:
  - rest: {duration_s: 0.2}
  - ramp: {to_m: 0.012, duration_s: 0.1}
  - hold: {duration_s: 0.5}
"""
TURN = """
name: turn
domain: joint_angle
segments:
  - ramp: {to_rad: 0.3, duration_s: 0.3}
  - hold: {duration_s: 0.3}
"""
FORCE = """
name: force
domain: force
segments:
  - ramp: {to_n: 40.0, duration_s: 0.2}
  - hold: {duration_s: 0.5}
"""


@pytest.fixture(scope='module')
def rig():
    """Return a rig with on/off valves."""
    return load_rig('dmsp_5_300_realistic', valve='hsv')


def test_asked_numbers(rig, tmp_path):
    """They are read from text and file, written again, and reach the node of the driver."""
    assert asked_by(TEXT) == ASKED
    for text in ('driver: {hsv.gain: 0.4}\ncontroller: pid\n',
                 'controller: pid\n"driver": {hsv.gain: 0.4}\n'):
        assert asked_by(text) == load_controller(text, rig).driver == {'hsv.gain': 0.4}
    assert asked_by('pid_hsv') == {}
    controller = load_controller(TEXT, rig)
    assert controller.driver == ASKED
    assert load_controller(controller.to_yaml()).driver == ASKED
    path = tmp_path / 'own.yaml'
    path.write_text(TEXT)
    nodes = {node.name: node for node in layout(valve='hsv', controller=str(path))}
    assert nodes['valve_driver'].parameters['controller'] == str(path)
    plan = make_plan(load_experiment(SHORT), rig, controller)
    try:
        assert asked_by(plan.parameters['valve_driver']['controller']) == ASKED
    finally:
        plan.remove()


@pytest.mark.parametrize('line, what', [
    ('max_pressure_gauge_pa: 7.0e5', 'unknown number of a driver law'),
    ('hsv.gain: 3', 'hsv.gain'),
    ('hsv.gian: 0.3', 'did you mean .?hsv.gain')])
def test_what_cannot_be_asked(line, what):
    """A safety limit, a value out of range and a typing error, each with its line."""
    with pytest.raises(InputError, match=what) as found:
        asked_by(f'\ncontroller: pid\ndriver:\n  {line}\n')
    assert ':4' in str(found.value) or 'line 4' in str(found.value)


@pytest.mark.parametrize('asked, largest_v', [
    ('', None), ('driver: {ppr.slew_v_per_s: 5.0}', 5.0)])
def test_a_rollout_drives_a_regulator_as_asked(asked, largest_v):
    """The volts change no faster than the controller asks for; without it they jump."""
    rig = load_rig('dmsp_5_300_realistic')
    run = ClosedLoop(rig, load_experiment(JUMP)).run(
        load_controller(f'controller: pid\n{asked}\n', rig))
    fastest = np.abs(np.diff(run.signal[:, 0])).max() * 200.0
    assert fastest > 10.0 if largest_v is None else fastest == pytest.approx(largest_v)


@pytest.mark.parametrize('asked, every', [
    ('', 2), ('driver: {hsv.period_s: 0.005}', 1), ('driver: {hsv.period_s: 0.01}', 2)])
def test_a_rollout_drives_valves_as_often_as_asked(rig, asked, every):
    """The duties change at each tick of 5 ms, or only at every second one."""
    controller = load_controller(f'controller: pid\n{asked}\n', rig)
    for loop in (ClosedLoop(rig, load_experiment(JUMP)),
                 ForeignLoop(rig.plant, rig, load_experiment(JUMP))):
        changes = np.flatnonzero(np.diff(loop.run(controller).signal, axis=0).any(axis=1)) + 1
        assert len(changes) > 10 and (changes % every == 0).all()
        assert every == 2 or (changes % 2 == 1).any()


@pytest.mark.parametrize('rate_hz', [50, 100, 125, 200, 250])
def test_a_rollout_keeps_the_period_of_the_driver_or_is_refused(rig, rate_hz):
    """Live the valves go on every 10 ms, whatever the rate of the controller."""
    controller = load_controller(
        f'controller: pid\nsettings: {{rate_hz: {rate_hz}}}\n', rig)
    for make, plant in ((ClosedLoop, ()), (ForeignLoop, (rig.plant,))):
        loop = make(*plant, rig, load_experiment(JUMP), rate_hz=float(rate_hz))
        if rate_hz in (100, 200):
            moves = np.flatnonzero(np.diff(loop.run(controller).signal, axis=0).any(axis=1)) + 1
            assert len(moves) > 10 and (moves % (rate_hz // 100) == 0).all()
            continue
        with pytest.raises(InputError, match=(
                'hsv.period_s: .*every 0.01 s.*0.0.* s.* 100, 200, 500, 1000 Hz')):
            loop.run(controller)


def test_a_period_that_is_asked_for_makes_another_rate_fit(rig):
    controller = load_controller(
        'controller: pid\nsettings: {rate_hz: 125}\ndriver: {hsv.period_s: 0.008}\n', rig)
    loop = ClosedLoop(rig, load_experiment(JUMP), rate_hz=125.0)
    assert np.ptp(loop.run(controller).signal) > 0.0
    controller.driver['hsv.period_s'] = 0.0035
    with pytest.raises(InputError, match='none; a period of whole milliseconds'):
        loop.run(controller)


def test_a_rollout_of_a_joint_drives_valves_as_often_as_asked():
    """Another period gives another motion; of one that does not fit the ticks there is none."""
    joint = load_joint('joint_dmsp_5_300_realistic', valve='hsv')
    loop, controller = JointLoop(joint, load_experiment(TURN)), load_controller(
        'sofc_joint_hsv', joint)
    usual, controller.driver = loop.run(controller, learn=False), {'hsv.period_s': 0.005}
    other = loop.run(controller, learn=False)
    assert np.abs(other.value - usual.value).max() > 1e-4
    controller.driver = {'hsv.period_s': 0.008}
    with pytest.raises(InputError, match='hsv.period_s.*0.008 s.*0.005 s'):
        loop.run(controller)


@pytest.mark.parametrize('valve, asked', [
    ('ppr', {'ppr.slew_v_per_s': 2.0}), ('hsv', {'hsv.gain': 0.1})])
def test_a_rollout_of_a_force_drives_as_asked(valve, asked):
    """The pressures are not those behind the usual driver."""
    rig = load_rig('dmsp_5_300_isometric_realistic', valve=valve)
    loop, controller = ForceLoop(rig, load_experiment(FORCE)), load_controller(
        f'sofc_force_{valve}', rig)
    usual, controller.driver = loop.run(controller, learn=False), asked
    other = loop.run(controller, learn=False)
    assert np.abs(other.signals['pressure_pa'] - usual.signals['pressure_pa']).max() > 1e3


def differing(run):
    """Return how many ticks of a replay differ from the recording."""
    return sum(one.differing for one in replay_driver(run).differences)


def test_a_recording_replays_with_what_was_asked(rig, tmp_path):
    """The driver's replay has the same bits; without what was asked it would have others."""
    bag = tmp_path / 'bag'
    simulate_experiment(load_experiment(SHORT), rig, load_controller(TEXT, rig), bag, seed=2)
    run = load_run(bag)
    assert not differing(run)
    text = run.metadata['controller']
    run.metadata['controller'] = text.replace('hsv.gain: 0.4', 'hsv.gain: 0.3')
    assert differing(run)
