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

"""Replay of a synthetic recording: to the bit, and one sentence where it cannot be."""

import math

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.messages import Contraction, Force, Pressure, Reference
from pam_actuation.replay.controller import replay_controller
from pam_sim.errors import InputError
from pam_sim.run import Run, Series
import pytest
from straight_rig import SlowMuscle, sofc, StraightRig

START = 1_700_000_000_123_456_789


def record(controller, ticks=900, outage=(400, 440)):
    """Run a loop on a toy muscle with jittered stamps, noise and an outage; return a Run."""
    text = controller.to_yaml()
    loop, muscle = ControllerLoop(controller), SlowMuscle(bias_pa=1e4)
    random = np.random.default_rng(11)
    topics = {name: [] for name in (
        'contraction', 'pressure', 'force', 'reference', 'pressure_command',
        'controller_state')}
    for tick in range(ticks):
        now = START + tick * 5_000_000 + int(random.integers(-200_000, 200_000))
        wanted = 0.014 + 0.006 * math.sin(0.02 * tick)
        if not outage[0] <= tick < outage[1]:
            stamp = now - int(random.integers(100_000, 3_000_000))
            x = muscle.contraction_m + float(random.normal(0.0, 1e-5))
            topics['contraction'].append((stamp, {'contraction_m': x}))
            loop.take('contraction', Contraction(stamp, x))
        p = muscle.pressure_pa + float(random.normal(0.0, 300.0))
        topics['pressure'].append((now - 50_000, {'pressure_pa': p}))
        loop.take('pressure', Pressure(now - 50_000, p))
        if tick % 3 == 0:
            topics['force'].append((now - 60_000, {'force_n': 49.0}))
            loop.take('force', Force(now - 60_000, 49.0))
        rate = 0.006 * 0.02 / 0.005 * math.cos(0.02 * tick)
        topics['reference'].append((now, {'contraction_m': wanted}))
        loop.take('reference', Reference(now, wanted, rate))
        (command,), state = loop.tick(now)
        topics['pressure_command'].append((now, {'pressure_pa': command.pressure_pa}))
        topics['controller_state'].append((now, dict(zip(state.names, state.values))))
        muscle.advance(command.pressure_pa)
    series = {}
    for name, rows in topics.items():
        series[name] = Series(
            np.array([stamp for stamp, _ in rows], dtype=np.int64),
            {key: np.array([values[key] for _, values in rows]) for key in rows[0][1]})
    return Run(series, {'controller': text}, '/muscle', 'synthetic')


@pytest.fixture(scope='module')
def run():
    return record(sofc({'credit_spread_s': 0.02}))


def test_replay_is_bit_exact_twice_and_ends_with_the_same_rules(run):
    live = sofc({'credit_spread_s': 0.02})
    again = record(live)
    for _ in range(2):
        result = replay_controller(run)
        assert result.identical, result.sentence()
        assert result.max_abs_difference_pa == 0.0
        assert result.ticks == 900 and result.commands_missing == 0
    assert result.controller.rules.digest() == live.rules.digest()
    assert live.rules.feedforward.any()
    assert replay_controller(again).identical


def test_replay_of_a_pid(run):
    result = replay_controller(record(load_controller('pid', StraightRig())))
    assert result.identical, result.sentence()


def test_a_wrong_command_or_state_is_found(run):
    changed = record(sofc({'credit_spread_s': 0.02}))
    changed.topics['pressure_command'].values['pressure_pa'][300] += 1e-9 * 2 ** 8
    result = replay_controller(changed)
    assert not result.identical
    assert 0.0 < result.max_abs_difference_pa < 1e-6
    changed.topics['controller_state'].values['error_m'][300] += 1e-12
    result = replay_controller(changed)
    assert result.differing_states == {'error_m': 1}
    assert 'error_m' in result.sentence()


def test_another_controller_answers_what_it_would_have_done(run):
    result = replay_controller(run, sofc({'proportional_pa_per_m': 2e6}))
    assert not result.identical
    assert result.max_abs_difference_pa > 100.0


def test_a_controller_that_is_asked_stays_as_it_is(run):
    other = sofc({'proportional_pa_per_m': 2e6})
    before, (first, second) = other.to_yaml(), (replay_controller(run, other) for _ in range(2))
    assert np.array_equal(first.replayed_pa, second.replayed_pa)
    assert first.controller.rules.digest() != other.rules.digest() and other.to_yaml() == before


def test_a_controller_of_another_rate_is_refused(run):
    with pytest.raises(InputError, match='the controller runs at 100 Hz, the recorded ticks at '
                       '200 Hz; give it the same rate'):
        replay_controller(run, load_controller('pid', StraightRig()).with_settings(
            {'rate_hz': 100.0}))


def cut(run, topic, keep):
    series = run.topics[topic]
    part = Series(series.stamp_ns[keep], {k: v[keep] for k, v in series.values.items()})
    return Run({**run.topics, topic: part}, run.metadata, run.namespace, run.path)


def test_recordings_that_cannot_be_replayed_are_explained(run):
    everything = np.arange(900)
    with pytest.raises(InputError, match='begins with controller tick 5'):
        replay_controller(cut(run, 'controller_state', everything[5:]))
    with pytest.raises(InputError, match='missing or doubled'):
        replay_controller(cut(run, 'controller_state', np.delete(everything, 100)))
    with pytest.raises(InputError, match='contraction message'):
        replay_controller(cut(run, 'contraction', np.arange(0, 800)))
    with pytest.raises(InputError, match='which controller'):
        replay_controller(Run(run.topics, {}, '/muscle', 'synthetic'))
    series = run.topics['controller_state']
    values = {**series.values, 'rules_replaced': (everything > 500).astype(float)}
    topics = {**run.topics, 'controller_state': Series(series.stamp_ns, values)}
    with pytest.raises(InputError, match='by hand'):
        replay_controller(Run(topics, run.metadata, '/muscle', 'synthetic'))


def test_lost_commands_are_taken_from_the_state(run):
    result = replay_controller(cut(run, 'pressure_command', np.arange(0, 900, 2)))
    assert result.identical
    assert result.commands_missing == 450
