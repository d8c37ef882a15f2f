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

"""The controller loop: validity of inputs, reference ahead, faults, state record."""

import math

import numpy as np
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.control.reference_buffer import ReferenceBuffer
from pam_actuation.control.tick import join_stamp
from pam_actuation.messages import Contraction, Pressure, Reference, ReferenceTrajectory
from pam_sim import load_rig
from pam_sim.units import P_ATM_PA
import pytest
from straight_rig import sofc

MS = 1_000_000
START = 1_700_000_000_000_000_123


def ready(contraction=0.01):
    loop = ControllerLoop(sofc())
    loop.take('contraction', Contraction(START, contraction))
    loop.take('reference', Reference(START, 0.01, 0.0))
    return loop


def by_name(state):
    return dict(zip(state.names, state.values))


def test_vented_and_says_why_until_there_are_contraction_and_reference():
    loop = ControllerLoop(sofc())
    (command,), _ = loop.tick(START)
    assert command.pressure_pa == P_ATM_PA
    assert not loop.valid and 'no contraction' in loop.reason
    loop.take('contraction', Contraction(START, 0.01))
    assert loop.tick(START + MS)[0][0].pressure_pa == P_ATM_PA
    assert 'no reference' in loop.reason
    loop.take('reference', Reference(START, 0.01, 0.0))
    assert loop.tick(START + 2 * MS)[0][0].pressure_pa > P_ATM_PA
    assert loop.valid and loop.reason == 'ok'


@pytest.mark.parametrize('message, words', [
    (Contraction(START - 101 * MS, 0.01), 'older'), (Contraction(START + 21 * MS, 0.01), 'ahead'),
    (Contraction(START, math.nan), 'finite'), (Contraction(START, math.inf), 'finite'),
    (Contraction(START, 0.3), 'outside')])
def test_unusable_contraction_vents_and_recovers(message, words):
    loop = ready()
    loop.tick(START)
    loop.take('contraction', message)
    (command,), state = loop.tick(START)
    assert command.pressure_pa == P_ATM_PA
    assert words in loop.reason
    assert by_name(state)['contraction_stamp_sec'] == -1.0
    loop.take('contraction', Contraction(START, 0.01))
    assert loop.tick(START)[0][0].pressure_pa > P_ATM_PA


def test_stale_pressure_is_not_used_but_does_not_stop_the_loop():
    loop = ready()
    loop.take('pressure', Pressure(START - 200 * MS, 3e5))
    _, state = loop.tick(START)
    assert loop.valid and math.isnan(by_name(state)['pressure_pa'])
    loop.take('pressure', Pressure(START, 3e5))
    assert by_name(loop.tick(START + MS)[1])['pressure_pa'] == 3e5


def test_silent_reference_is_held_then_vented_then_resumed():
    loop = ready()
    reasons = {}
    for k in range(0, 600):
        now = START + k * 5 * MS
        loop.take('contraction', Contraction(now, 0.01))
        _, state = loop.tick(now)
        reasons.setdefault(loop.reason, (k * 0.005, by_name(state)['learning'], loop.valid))
    assert reasons['ok'] == (0.0, 1.0, True)
    at, learning, valid = reasons['reference lost, holding its last position']
    assert at == pytest.approx(0.505) and learning == 0.0 and valid
    at, _, valid = reasons['reference lost, asks for the atmosphere']
    assert at == pytest.approx(2.005) and not valid
    loop.take('reference', Reference(now, 0.01, 0.0))
    loop.tick(now)
    assert loop.reason == 'ok'


def test_reference_that_is_not_finite_is_ignored_and_counted():
    loop = ready()
    loop.take('reference', Reference(START + MS, math.nan, 0.0))
    loop.take('reference_trajectory', ReferenceTrajectory(START, (0, 0), (0.1, 0.2), (0.0, 0.0)))
    _, state = loop.tick(START + MS)
    assert loop.rejected_references == 2
    assert by_name(state)['reference_m'] == 0.01


def test_a_reference_from_the_future_does_not_keep_the_muscle_filled():
    loop = ready()
    loop.tick(START)
    now = START + MS
    loop.take('reference', Reference(now + 3600_000 * MS, 0.02, -0.05))
    loop.take('reference_trajectory', ReferenceTrajectory(
        now + 3600_000 * MS, (0, 500 * MS), (0.01, 0.02), (0.02, 0.02)))
    _, state = loop.tick(now)
    assert loop.reason == 'ok' and by_name(state)['reference_m'] == 0.01    # the one before
    assert loop.rejected_references == 2 and 's ahead' in loop.references.refusal
    now += 2100 * MS
    loop.take('contraction', Contraction(now, 0.01))
    (command,), _ = loop.tick(now)
    assert loop.reason == 'reference lost, asks for the atmosphere'
    assert command.pressure_pa == P_ATM_PA


def test_a_reference_a_little_ahead_counts_and_one_of_a_clock_set_back_does_not():
    loop = ready()
    loop.take('reference', Reference(START + 15 * MS, 0.012, 0.0))
    assert by_name(loop.tick(START)[1])['reference_m'] == 0.012
    loop.take('contraction', Contraction(START - 60_000 * MS, 0.01))
    loop.tick(START - 60_000 * MS)
    assert loop.reason == 'no reference yet' and loop.rejected_references == 0


@pytest.mark.parametrize('wanted', [14.0, -0.02, 0.11])
def test_a_contraction_no_muscle_has_is_refused(wanted):
    loop = ready()
    loop.take('reference', Reference(START + MS, wanted, 0.0))
    loop.take('reference_trajectory', ReferenceTrajectory(
        START, (0, 500 * MS), (0.01, wanted), (0.0, 0.0)))
    _, state = loop.tick(START + MS)
    assert by_name(state)['reference_m'] == 0.01 and loop.rejected_references == 2
    assert 'not within -0.01 to 0.1 m' in loop.references.refusal


def test_a_long_muscle_is_followed_to_the_end_of_its_stroke():
    rig = load_rig('muscle: {like: dmsp_20_300, length_m: 0.6}\nload: hanging_mass\nvalve: ppr\n')
    loop = ControllerLoop(sofc(), rig)
    stroke_m = rig.muscle.stroke_m
    assert stroke_m > 0.14
    for wanted in (stroke_m, stroke_m + 0.03):
        loop.take('contraction', Contraction(START, stroke_m - 0.01))
        loop.take('reference', Reference(START, wanted, 0.0))
        _, state = loop.tick(START)
        assert loop.reason == 'ok' and by_name(state)['reference_m'] == stroke_m
    assert loop.rejected_references == 1


def test_a_loop_that_forgot_waits_for_new_inputs():
    loop = ready()
    loop.tick(START)
    assert loop.reason == 'ok'
    loop.forget()
    (command,), _ = loop.tick(START + MS)
    assert loop.reason == 'no contraction measured yet' and command.pressure_pa == P_ATM_PA
    loop.take('contraction', Contraction(START + MS, 0.01))
    loop.tick(START + MS)
    assert loop.reason == 'no reference yet'


def test_error_belongs_to_the_measurement_and_preview_to_now():
    loop = ControllerLoop(sofc({'lead_s': 0.1}))
    loop.take('contraction', Contraction(START - 4 * MS, 0.01))
    loop.take('reference', Reference(START, 0.01, 0.05))
    values = by_name(loop.tick(START + MS)[1])
    assert values['reference_m'] == pytest.approx(0.01 - 0.05 * 0.004)
    assert values['lead_reference_m'] == pytest.approx(0.01 + 0.05 * 0.101)


def sine_trajectory(stamp_ns, horizon=31):
    def at(t):
        return 0.014 + 0.01 * math.sin(6.3 * t), 0.063 * math.cos(6.3 * t)
    offsets = tuple(k * 20 * MS for k in range(horizon))
    points = [at((stamp_ns + o - START) * 1e-9) for o in offsets]
    return ReferenceTrajectory(
        stamp_ns, offsets, tuple(x for x, _ in points), tuple(v for _, v in points)), at


def test_trajectory_is_interpolated_in_absolute_time():
    buffer = ReferenceBuffer()
    message, at = sine_trajectory(START)
    buffer.set_trajectory(message)
    for k in range(0, 480, 7):
        t = START + k * MS
        position, rate = buffer.at(START, t)
        expected = at(k * 1e-3)
        assert position == pytest.approx(expected[0], abs=2e-8)
        assert rate == pytest.approx(expected[1], abs=2e-5)


def test_a_jump_between_two_points_stays_a_jump_and_a_slow_move_a_move():
    buffer = ReferenceBuffer()
    offsets = (0, 20 * MS, 40 * MS)
    buffer.set_trajectory(
        ReferenceTrajectory(START, offsets, (0.008, 0.018, 0.018), (0.0, 0.0, 0.0)))
    assert [buffer.at(START, START + k * MS) for k in (0, 10, 19)] == [(0.008, 0.0)] * 3
    assert buffer.at(START, START + 20 * MS) == (0.018, 0.0)
    buffer.set_trajectory(ReferenceTrajectory(START, (0, 500 * MS), (0.008, 0.018), (0.0, 0.0)))
    position, rate = buffer.at(START, START + 250 * MS)
    assert position == pytest.approx(0.013) and rate == pytest.approx(0.03)


def test_newest_trajectory_replaces_and_beyond_its_end_the_reference_counts():
    buffer = ReferenceBuffer()
    buffer.set_reference(Reference(START + 700 * MS, 0.02, 0.0))
    buffer.set_trajectory(ReferenceTrajectory(START, (0, 20 * MS), (0.01, 0.011), (0.0, 0.0)))
    second = ReferenceTrajectory(START, (0, 600 * MS), (0.012, 0.012), (0.0, 0.0))
    buffer.set_trajectory(second)
    assert buffer.at(START, START + 10 * MS)[0] == 0.012
    assert buffer.uses_trajectory(START + 600 * MS)
    assert not buffer.uses_trajectory(START + 601 * MS)
    assert buffer.at(START + 700 * MS, START + 700 * MS)[0] == 0.02


def test_state_holds_stamps_exactly_and_counts_ticks():
    loop = ready()
    for tick in range(3):
        values = by_name(loop.tick(START + tick)[1])
        assert values['tick'] == tick
    stamp = join_stamp(values['contraction_stamp_sec'], values['contraction_stamp_nanosec'])
    assert stamp == START
    assert values['command_pa'] >= P_ATM_PA
    assert all(isinstance(value, float) for value in values.values())


def test_a_loop_that_stood_still_starts_bumplessly():
    loop = ready()
    loop.tick(START)
    later = START + 900 * MS
    loop.take('contraction', Contraction(later, 0.004))
    loop.take('pressure', Pressure(later, 3e5))
    loop.take('reference', Reference(later, 0.02, 0.0))
    (command,), state = loop.tick(later)
    assert by_name(state)['restarted'] == 1.0
    assert abs(command.pressure_pa - 3e5) < 2e4


def swing(loop, start_ns, duration_s, contraction, pressure_pa):
    """Tick for a while; return (time since the start [s], reason, command) of every tick."""
    seen = []
    for k in range(round(duration_s / 0.005)):
        now = start_ns + k * 5 * MS
        loop.take('contraction', Contraction(now, contraction(k * 0.005)))
        loop.take('pressure', Pressure(now, pressure_pa(k * 0.005)))
        loop.take('reference', Reference(now, 0.01, 0.0))
        (command,), _ = loop.tick(now)
        seen.append((k * 0.005, loop.reason, command.pressure_pa))
    return seen


def test_a_frozen_contraction_vents_until_it_moves_again():
    loop = ready()
    seen = swing(loop, START, 1.0, lambda t: 0.01, lambda t: 3e5 + 2e5 * t)
    at_s, reason, command_pa = next(one for one in seen if one[1] != 'ok')
    assert at_s == pytest.approx(0.755) and 'contraction stands still' in reason
    assert command_pa == P_ATM_PA
    assert all(command_pa == P_ATM_PA for t, _, command_pa in seen if t >= at_s)
    # It moves at once when vented and comes to rest, to the last bit; what is only blocked is not
    # filled again for 2 s.
    seen = swing(loop, START + 1000 * MS, 3.0, lambda t: max(0.01 - 0.02 * t, 0.003),
                 lambda t: P_ATM_PA)
    assert next(t for t, reason, _ in seen if reason == 'ok') == pytest.approx(2.0, abs=0.01)


def test_the_noise_of_a_broken_encoder_is_no_motion():
    loop, random = ready(), np.random.default_rng(3)
    seen = swing(loop, START, 1.2, lambda t: 0.01 + 1e-5 * random.standard_normal(),
                 lambda t: 3e5 + 2e5 * t)
    at_s, reason, command_pa = next(one for one in seen if one[1] != 'ok')
    assert 0.9 < at_s < 1.0 and 'contraction stands still' in reason
    assert command_pa == P_ATM_PA
    seen = swing(loop, START + 1200 * MS, 3.0, lambda t: 0.01 + 1e-5 * random.standard_normal(),
                 lambda t: P_ATM_PA)
    assert all('stands still' in reason for _, reason, _ in seen)


def test_a_contraction_that_never_moves_again_stays_frozen():
    loop = ready()
    swing(loop, START, 1.0, lambda t: 0.01, lambda t: 3e5 + 2e5 * t)
    seen = swing(loop, START + 1000 * MS, 4.0, lambda t: 0.01, lambda t: P_ATM_PA)
    assert all('stands still' in reason for _, reason, _ in seen)


def test_an_encoder_with_the_wrong_sign_does_not_drop_the_load_for_ever():
    """Filled, it reads what is impossible; vented, it reads what is possible."""
    loop = ready()
    seen = swing(loop, START, 60.0, lambda t: -0.02 if t % 2.0 > 1.5 else 0.01,
                 lambda t: 2e5 + 100.0 * math.sin(t))
    runs = [reason == 'ok' for _, reason, _ in seen]
    drops = [t for (t, _, _), ran, runs_now in zip(seen, [True, *runs], runs)
             if ran and not runs_now]
    assert len(drops) == 6 and drops[5] - drops[4] > 30.0       # five times, then after 30 s
    told = [reason for t, reason, _ in seen if drops[4] < t < drops[4] + 29.0]
    assert {reason.partition(',')[0] for reason in told} == {
        'contraction is outside what the muscle can do'}
    assert all('sign, range or wiring of the sensor? Vented for 30 s' in one for one in told)
    loop.forget()
    assert {reason for _, reason, _ in swing(loop, START + 61_000 * MS, 1.0, lambda t: 0.01,
                                             lambda t: 2e5)} >= {'ok'}


def test_one_impossible_reading_passes_at_once_whatever_the_clock_shows():
    """Simulated time begins at 0."""
    loop = ControllerLoop(sofc())
    seen = swing(loop, 0, 1.0, lambda t: -0.02 if 0.5 <= t < 0.51 else 0.01,
                 lambda t: 2e5 + 100.0 * math.sin(t))
    assert {t for t, reason, _ in seen if reason != 'ok'} == {0.5, 0.505}


def lifted(loop, duration_s=1.0):
    """Let the muscle leave its stop, at 200 kPa gauge, and lie down again; return the time."""
    swing(loop, START, duration_s, lambda t: max(0.01 * math.sin(2.0 * math.pi * t), 0.0),
          lambda t: P_ATM_PA + 2e5 * (1.0 + 0.01 * math.sin(2.0 * math.pi * t)))
    assert loop.reason == 'ok'
    return START + round(duration_s * 1000) * MS


def test_a_contraction_frozen_on_its_stop_is_noticed_where_less_pressure_lifted_the_load():
    loop = ready()
    seen = swing(loop, lifted(loop), 2.0, lambda t: 0.001, lambda t: P_ATM_PA + 3e5 * t)
    at_s, reason, command_pa = next(one for one in seen if one[1] != 'ok')
    assert at_s == pytest.approx(4.0 / 3.0, abs=0.02) and 'contraction stands still' in reason
    assert command_pa == P_ATM_PA


def test_a_muscle_that_a_hand_lifted_may_lie_on_its_stop():
    loop = ready()
    swing(loop, START, 1.0, lambda t: 0.01 * t, lambda t: P_ATM_PA)
    swing(loop, START + 1000 * MS, 1.0, lambda t: max(0.01 - 0.02 * t, 0.0), lambda t: P_ATM_PA)
    seen = swing(loop, START + 2000 * MS, 1.0, lambda t: 0.0, lambda t: P_ATM_PA + 3.4e5 * t)
    assert {reason for _, reason, _ in seen} == {'ok'}


def test_a_muscle_with_noise_may_lie_on_its_stop():
    loop = ready()
    seen = swing(loop, lifted(loop), 1.8, lambda t: 1e-6 * (round(t / 0.005) % 2),
                 lambda t: P_ATM_PA + 3e5 * t)
    assert {reason for _, reason, _ in seen} == {'ok'}


@pytest.mark.parametrize('contraction, pressure_pa', [
    (lambda t: 0.01, lambda t: 3e5 + 7e4 * math.sin(20.0 * t)),       # held by friction
    (lambda t: 0.0, lambda t: P_ATM_PA + 3.4e5 * t),                  # on its stop
    (lambda t: 0.01 + 1e-5 * math.floor(t / 0.15), lambda t: 3e5 + 2e5 * t)])     # steps of 10 um
def test_what_a_muscle_may_do_is_not_taken_for_a_frozen_sensor(contraction, pressure_pa):
    assert {reason for _, reason, _ in swing(ready(), START, 1.0, contraction, pressure_pa)} == {
        'ok'}
