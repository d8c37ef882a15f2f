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
"""Loops that stand still for a moment, offline: the cost is in proportion, and is not learned."""

import math

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.control.config import load_controller
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.loops.bus import every
from pam_actuation.messages import Contraction, Reference, START_NS
from pam_actuation.replay.controller import replay_controller
from pam_sim import load_rig
from pam_sim.located_yaml import dump_yaml, load_yaml
import pytest

MS = 1_000_000
SECONDS, AMPLITUDE_M = 13.0, 0.010
SPEED_MM_PER_S = 2.0 * math.pi * AMPLITUDE_M * 1e3      # of the sine of 1 Hz, at most
SINE = """
name: one_hertz
domain: contraction
segments:
  - ramp: {to_m: 0.004, duration_s: 1.0}
  - sine: {center_m: 0.014, amplitude_m: 0.010, frequency_hz: 1.0, cycles: 12}
"""
RATES_HZ = {'plant': 250.0, 'controller': 200.0, 'driver': None, 'reference': 100.0}


def stalls_of(seed, shortest_ms=20, longest_ms=90):
    """Return (begin, end) of stalls of random length [ns since the start], 1.7 s apart."""
    draw = np.random.default_rng(seed)
    begins_s = np.arange(5.0, SECONDS - 3.0, 1.7) + draw.uniform(0.0, 0.5, 3)
    return [(int(begin_s * 1e9), int(begin_s * 1e9 + draw.uniform(shortest_ms, longest_ms) * MS))
            for begin_s in begins_s]


def ticks_with(stalls, rate_hz, lead_s):
    """Return when a loop ticks that does so once at the end of a stall instead of within."""
    times, ends = [], [end for _, end in stalls]
    for time_ns in every(rate_hz, 0, round(lead_s * 1e9)):
        if time_ns > SECONDS * 1e9:
            return np.array(sorted({*times, *ends}))
        if not any(begin < time_ns < end for begin, end in stalls):
            times.append(time_ns)


def recorded(folder, valve, loops=(), stalls=(), controller=None):
    """Return a recording of a simulation in which some loops stand still."""
    rig = load_rig('dmsp_5_300_realistic', valve=valve)
    ticks = {loop: ticks_with(
        stalls, RATES_HZ[loop] or (100.0 if valve == 'hsv' else 200.0),
        0.0 if loop == 'reference' else 0.1) for loop in loops}
    return load_run(simulate_experiment(
        load_experiment(SINE), rig, controller or load_controller(f'sofc_{valve}', rig),
        folder / f'{valve}_{"_".join(loops) or "none"}', seed=1, ticks=ticks,
        transport_ns=300_000, overwrite=True)['bag'])


def error_mm(run, at_s):
    """Return the error against what the experiment asks for [mm]."""
    moved = run.topics['contraction']
    time_s = (moved.stamp_ns - START_NS) * 1e-9
    measured = np.interp(at_s, time_s, moved.values['contraction_m'])
    wanted = 0.014 - AMPLITUDE_M * np.cos(2.0 * math.pi * (at_s - 1.0))
    return 1e3 * (measured - wanted)


@pytest.fixture(scope='module')
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp('undisturbed')
    return {valve: recorded(folder, valve) for valve in ('ppr', 'hsv')}


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
@pytest.mark.parametrize('loops', [
    ('controller',), ('driver',), ('plant',), ('controller', 'driver'),
    ('plant', 'controller', 'driver', 'reference')], ids='+'.join)
def test_a_stall_costs_no_more_than_the_way_meanwhile(tmp_path, undisturbed, valve, loops):
    stalls = stalls_of(4)
    run = recorded(tmp_path, valve, loops, stalls)
    for begin, end in stalls:
        at_s = np.arange(begin * 1e-9, begin * 1e-9 + 1.2, 0.002)
        extra = np.abs(error_mm(run, at_s) - error_mm(undisturbed[valve], at_s)).max()
        assert extra <= 0.5 * SPEED_MM_PER_S * (end - begin) * 1e-9 + 0.2, (begin, end)
    late_s = np.arange(SECONDS - 2.0, SECONDS - 0.05, 0.002)
    after, without = (np.sqrt(np.mean(error_mm(one, late_s) ** 2))
                      for one in (run, undisturbed[valve]))
    assert after < 2.5 * without        # two seconds after the last, nothing wrong was learned


def test_the_motion_meanwhile_is_no_jump(tmp_path):
    stalls = stalls_of(4, 60, 90)
    state = recorded(tmp_path, 'hsv', ('controller',), stalls).topics['controller_state'].values
    assert np.all(state['jump_to_go_m'] == 0.0)
    assert np.nanmax(state['elapsed_s']) > 0.06


def test_controllers_of_before_do_as_before(tmp_path):
    rig = load_rig('dmsp_5_300_realistic', valve='hsv')
    tree = load_yaml(load_controller('sofc_hsv', rig).to_yaml(), name='text').plain()
    assert tree['settings'].pop('late_s') == 0.02
    run = recorded(tmp_path, 'hsv', ('controller',), stalls_of(4, 60, 90),
                   load_controller(dump_yaml(tree), rig))
    assert np.abs(run.topics['controller_state'].values['jump_to_go_m']).max() > 1e-3
    assert replay_controller(run).identical


def test_a_step_during_a_stall_is_still_a_jump(tmp_path):
    rig = load_rig('dmsp_5_300_realistic', valve='hsv')
    experiment = load_experiment("""
name: step
domain: contraction
segments:
  - ramp: {to_m: 0.006, duration_s: 1.0}
  - hold: {duration_s: 1.0}
  - step: {to_m: 0.012, duration_s: 2.0}
""")
    run = load_run(simulate_experiment(
        experiment, rig, load_controller('sofc_hsv', rig), tmp_path / 'step', seed=1,
        ticks={'controller': ticks_with([(1_960 * MS, 2_030 * MS)], 200.0, 0.1)})['bag'])
    assert np.abs(run.topics['controller_state'].values['jump_to_go_m']).max() > 5e-3


def loop_that_ran(until_ns=400 * MS):
    """Return a loop in its stride and the time of its last tick."""
    rig = load_rig('dmsp_5_300_realistic', valve='hsv')
    loop, learned = ControllerLoop(load_controller('sofc_hsv', rig)), []
    for now_ns in range(START_NS, START_NS + until_ns, 5 * MS):
        told(loop, now_ns)
        learned.append(dict(zip(loop.state.names, loop.state.values))['learning']
                       if loop.sent(now_ns) else None)
    return loop, now_ns, learned


def told(loop, now_ns):
    loop.take('contraction', Contraction(now_ns - MS, 0.01 + 1e-9 * (now_ns % 977)))
    loop.take('reference', Reference(now_ns - MS, 0.01, 0.0))


def test_after_a_stall_it_waits_for_what_was_measured_meanwhile():
    loop, now_ns, learned = loop_that_ran()
    assert None not in learned and learned[-1] == 1.0
    woke_ns = now_ns + 120 * MS
    assert loop.sent(woke_ns) == {} and loop.sent(woke_ns + 5 * MS) == {}
    told(loop, woke_ns + 9 * MS)
    assert loop.sent(woke_ns + 10 * MS) and loop.reason == 'ok'
    state = dict(zip(loop.state.names, loop.state.values))
    assert state['learning'] == 0.0         # the error is that of the stall


def test_it_waits_20_ms_and_no_longer():
    loop, now_ns, _ = loop_that_ran()
    woke_ns = now_ns + 120 * MS
    assert not any(loop.sent(woke_ns + k * 5 * MS) for k in range(4))
    sent = loop.sent(woke_ns + 20 * MS)
    assert loop.reason == 'contraction is older than 0.1 s'
    assert sent['pressure_command'].pressure_pa == pytest.approx(101_325.0)


def test_a_sensor_that_falls_silent_is_not_waited_for():
    loop, now_ns, _ = loop_that_ran()
    for k in range(1, 30):
        assert loop.sent(now_ns + k * 5 * MS)
    assert loop.reason == 'contraction is older than 0.1 s'


def test_learning_goes_on_once_the_stall_is_over():
    loop, now_ns, _ = loop_that_ran()
    learned = []
    for k in range(80):
        now = now_ns + 60 * MS + k * 5 * MS
        told(loop, now)
        loop.sent(now)
        learned.append(dict(zip(loop.state.names, loop.state.values))['learning'])
    assert learned[0] == learned[61] == 0.0 and learned[-1] == 1.0
