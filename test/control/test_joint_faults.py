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

"""Every fault of one muscle of a joint vents both, and the joint comes back calmly."""

import itertools
import math

from faulty_joint import FaultyJoint, MS_NS, RATE_HZ
from pam_actuation.control import tick as codes
from pam_actuation.control.frozen import RESUME_NS
from pam_actuation.drivers.faults import FAULT_TABLE, HOLD, VENT
from pam_actuation.messages import (
    AngleReference, JointAngle, NamedEfforts, Pressure, SAFE_EFFORTS, VALVE_NAMES, ValveSignal)
from pam_sim.joint.parameters import SIDES
from pam_sim.units import P_ATM_PA
import pytest

ANGLE_RAD = 0.3
VENTED_WITHIN_S = {'ppr': 0.5, 'hsv': 1.2}      # the pair of valves empties more slowly
VENTED_LEAST_S = RESUME_NS * 1e-9
SECOND = 1_000_000_000


def other(side):
    return SIDES[1 - SIDES.index(side)]


def _pressure(rig, side, arrives):
    rig.spoil[f'{side}/pressure'] = arrives


def _silent(topic):
    """Return how to lose a topic of a muscle, and how to find it again."""
    def begin(rig, side):
        rig.spoil[f'{side}/{topic}'] = lambda message: None

    def end(rig, side):
        rig.spoil.clear()
    return begin, end


def _readings(arrives):
    def begin(rig, side):
        _pressure(rig, side, arrives)

    def end(rig, side):
        rig.spoil.clear()
    return begin, end


def _latched(begin):
    def end(rig, side):
        rig.spoil.clear()
        rig.drivers[side].on_device('')
        done, why = rig.drivers[side].reset()
        assert done, why
    return begin, end


def _emergency_stop(rig, side):
    rig.drivers[side].emergency_stop()


def _over_pressure(rig, side):
    _pressure(rig, side, lambda sound: Pressure(sound.stamp_ns, P_ATM_PA + 700e3))
    rig.run(0.01)
    rig.spoil.clear()


def _device_refuses(rig, side):
    rig.drivers[side].on_device('no such device')


def _not_a_number(rig, side):
    driver = rig.drivers[side]
    driver.law.step = lambda *inputs: (math.nan, math.nan) if driver.is_hsv else math.nan


def _second_driver(rig, side):
    rig.drivers[side].set_sender_fault(('second_driver', 'two nodes send'))


def _two_senders(rig, side):
    """Tell of both kinds, one after the other: the driver judges them alike."""
    for key in TWO_SENDERS if side == 'flexor' else reversed(TWO_SENDERS):
        rig.drivers[side].set_sender_fault((key, f'{key}: two nodes send'))
        rig.run(0.05)


def _command_clock(rig, side):
    """Let every second command of the only controller be stamped 30 ms back."""
    behind_ns = itertools.cycle((0, 30 * MS_NS))
    rig.drivers[side].safety.commander = lambda now_ns: '/joint_controller'
    rig.spoil[f'{side}/pressure_command'] = lambda sound: Pressure(
        sound.stamp_ns - next(behind_ns), sound.pressure_pa)


def _one_sender(rig, side):
    rig.drivers[side].set_sender_fault(None)


def _no_command(rig, side):
    """Reset a stop, but let no command arrive any more."""
    rig.spoil[f'{side}/pressure_command'] = lambda message: None
    rig.drivers[side].emergency_stop()
    rig.run(0.02)
    rig.drivers[side].reset()


def _interrupted(rig, side):
    """Command the pair of valves itself, shut, and lose the pressure meanwhile."""
    rig.spoil[f'{side}/pressure_command'] = lambda message: None
    rig.drivers[side].on_valve_command(ValveSignal(
        rig.now_ns + MS_NS, VALVE_NAMES['hsv'], (0.0, 0.0)))
    rig.run(0.3)


def _stopped(rig, side):
    rig.stopped.add(side)


def _go_on(rig, side):
    rig.stopped.clear()


def _paused(rig, side):
    rig.stopped.add(side)
    rig.run(0.5)
    rig.stopped.clear()


def _clock_back(rig, side):
    rig.late_ns[side] = -SECOND


def _clock_ahead(rig, side):
    """Let time pass between two ticks that the steady clock of the driver does not know."""
    rig.stopped.add(side)
    rig.run(0.5)
    rig.unnoticed_ns[side] = SECOND // 2
    rig.stopped.clear()


def _wrong_sign(rig, side):
    """Let a reading be believable at the atmosphere only: the muscle is tried five times."""
    _pressure(rig, side, lambda sound: Pressure(
        sound.stamp_ns, P_ATM_PA - 2.0 * (sound.pressure_pa - P_ATM_PA)))
    rig.run(5.0)


def _clock_right(rig, side):
    rig.late_ns[side] = 0


def _ends(rig, side):
    rig.stopped.add(side)
    rig.plant.set_signal(rig.drivers[side].safe_signal(rig.now_ns), place=f'{side}/')


def _nothing(rig, side):
    """Do nothing: the fault ends by itself."""


TWO_SENDERS = 'two_publishers', 'two_sensors'
# Key in the fault table: (how it begins, how it ends) of a muscle under pressure.
ROWS = {
    'emergency_stop': _latched(_emergency_stop),
    'over_pressure': _latched(_over_pressure),
    'device_refuses': _latched(_device_refuses),
    'signal_not_finite': _latched(_not_a_number),
    'no_command': (_no_command, _silent('')[1]),
    'command_timeout': _silent('pressure_command'),
    'command_clock': (_command_clock, _silent('')[1]),
    'second_driver': (_second_driver, _one_sender),
    'two_senders': (_two_senders, _one_sender),
    'valve_command_interrupted': _latched(_interrupted),
    'pressure_timeout': _silent('pressure'),
    'pressure_frozen': _readings(lambda sound: Pressure(sound.stamp_ns, P_ATM_PA + 3e5)),
    'pressure_unmoved': _readings(lambda sound: Pressure(
        sound.stamp_ns, P_ATM_PA + 5e4 + 100.0 * (sound.stamp_ns // MS_NS % 7))),
    'driver_paused': (_paused, _nothing),
    'clock_back': (_clock_back, _clock_right),
    'clock_ahead': (_clock_ahead, _nothing),
    'pressure_relapses': _latched(_wrong_sign),
    'driver_ends': (_ends, _go_on),
    'driver_killed': (_stopped, _go_on)}
# What ends by itself.
BRIEF = ('driver_paused', 'clock_ahead')
OF_PAIRS_OF_VALVES = (
    'valve_command_interrupted', 'pressure_frozen', 'pressure_unmoved', 'no_pressure')
# What the driver tells, where that is not the key.
TELLS = {'two_senders': TWO_SENDERS, 'driver_ends': (), 'driver_killed': ()}
# What the controller says of the muscle.
WHY = {'emergency_stop': 'its driver vents although pressure is commanded',
       'driver_killed': 'its driver has been silent for 0.3 s',
       'pressure_timeout': 'its pressure has not been measured for 0.3 s'}
FROM_THE_START = {
    'no_pressure': _silent('pressure'),
    'no_command': _silent('pressure_command'),
    'emergency_stop': _latched(_emergency_stop),
    'driver_killed': (_stopped, _go_on)}
# What a muscle's readings are beside silent where they cannot be used: no number, from the past
# or the future, one after the other; not plausible, which the controller does not see.
UNUSABLE = [
    ('flexor', (lambda sound: Pressure(sound.stamp_ns, math.nan),
                lambda sound: Pressure(sound.stamp_ns - SECOND, sound.pressure_pa),
                lambda sound: Pressure(sound.stamp_ns + SECOND, sound.pressure_pa))),
    ('extensor', (lambda sound: Pressure(sound.stamp_ns, 0.0),))]


def test_every_row_that_vents_a_muscle_is_tested_for_a_joint():
    assert {fault.key for fault in FAULT_TABLE if fault.reaction in (VENT, HOLD)} == {
        *ROWS, *TWO_SENDERS, *FROM_THE_START} - {'two_senders'}


def under_pressure(valve, **options):
    """Return a joint that holds an angle with both muscles under pressure."""
    rig = FaultyJoint(valve, lambda time_s: ANGLE_RAD, **options).run(1.6)
    assert abs(rig.angle_rad[-1] - ANGLE_RAD) < 0.05 and min(rig.gauge_pa[-1]) > 150e3
    return rig


def both_stay_vented(rig, side):
    """Check that both muscles are vented, and stay so for longer than the least time."""
    rig.run(VENTED_LEAST_S + 1.0)
    vented_s = VENTED_LEAST_S + 0.7 - VENTED_WITHIN_S[rig.joint.flexor.valve]
    assert rig.highest_gauge_pa(other(side), vented_s) < 10e3
    # It alone is asked for a little, which shows when its driver follows again.
    assert rig.highest_gauge_pa(side, vented_s) < 60e3
    assert [pa for pair in rig.commands_pa[-round(vented_s * RATE_HZ):] for pa in pair
            if pa > P_ATM_PA + 50e3] == []
    assert rig.reasons[-1].startswith(f'{codes.REASONS[codes.MUSCLE_SLACK]}: {side}, it')


def comes_back(rig):
    """Check that the joint goes on without a jump."""
    rig.run(5.0)
    assert rig.reasons[-1] == codes.REASONS[codes.OK]
    assert abs(rig.angle_rad[-1] - ANGLE_RAD) < 0.05
    assert max(rig.angle_rad[-700:]) < ANGLE_RAD + 0.1
    assert rig.fastest_rise_pa_per_s(5.0) < 650e3


def told_faults(rig):
    """Return what the controller says is wrong with each muscle, '' for nothing."""
    told = dict(rig.control.values())
    return {side: told[f'{side}.fault'] for side in SIDES}


def cases(rows):
    return [(valve, key, SIDES[(k + (valve == 'hsv')) % 2])
            for k, key in enumerate(rows) for valve in ('ppr', 'hsv')
            if valve == 'hsv' or key not in OF_PAIRS_OF_VALVES]


@pytest.mark.parametrize('valve, key, side', cases(ROWS))
def test_a_fault_of_one_muscle_vents_both_until_it_has_ended(valve, key, side):
    begin, end = ROWS[key]
    rig = under_pressure(valve)
    assert told_faults(rig) == {'flexor': '', 'extensor': ''}
    begin(rig, side)
    if key in WHY:
        rig.run(0.5)
        assert rig.reasons[-1] == (
            f'one muscle is at fault, asks both for the atmosphere: {side}, {WHY[key]}')
        assert told_faults(rig) == {side: WHY[key], other(side): ''}
    rig.run(0.5) if key in BRIEF else both_stay_vented(rig, side)
    assert rig.faults[side] >= {*TELLS.get(key, (key,))}
    assert rig.faults[other(side)] <= {'', 'no_command', 'no_pressure'}
    end(rig, side)
    comes_back(rig)
    assert told_faults(rig) == {'flexor': '', 'extensor': ''}


def _gap(seconds):
    def begin(rig, side):
        _silent('pressure')[0](rig, side)
        rig.run(seconds)
        rig.spoil.clear()
    return begin


def _vented_elsewhere(rig, side):
    """Let the watchdog vent for a moment and the driver hear of it."""
    held = rig.plant.muscles[f'{side}/'].signal
    held.take(rig.drivers[side].safe_signal(rig.now_ns), None, rig.now_ns)
    rig.drivers[side].vented_elsewhere(rig.now_ns)


@pytest.mark.parametrize('side', SIDES)
@pytest.mark.parametrize('valve, begin', [
    ('ppr', _gap(0.105)), ('ppr', _gap(0.115)), ('ppr', _gap(0.15)), ('ppr', _gap(0.2)),
    ('hsv', _gap(0.115)), ('hsv', _gap(0.2)), ('ppr', _vented_elsewhere),
    ('hsv', _vented_elsewhere)])
def test_a_driver_that_vented_for_a_moment_does_not_rise_alone(valve, begin, side):
    rig = under_pressure(valve)
    before = len(rig.angle_rad)
    begin(rig, side)
    rig.run(0.2 + VENTED_WITHIN_S[valve])
    assert max(rig.gauge_pa[-1]) < 10e3         # both
    assert max(rig.angle_rad[before:]) < ANGLE_RAD + 0.2
    rig.run(VENTED_LEAST_S)
    comes_back(rig)


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_drivers_that_vented_together_for_a_moment_rise_together(valve):
    rig = under_pressure(valve)
    rig.stopped.add('controller')
    rig.run(0.15)
    rig.stopped.clear()
    rig.run(3.0)
    assert all('command_timeout' in rig.faults[side] for side in SIDES)
    assert set(rig.reasons) == {codes.REASONS[codes.OK]}
    assert abs(rig.angle_rad[-1] - ANGLE_RAD) < 0.05


@pytest.mark.parametrize('valve, key, side', cases(FROM_THE_START))
def test_a_joint_of_which_one_driver_does_not_follow_does_not_begin(valve, key, side):
    begin, end = FROM_THE_START[key]
    rig = FaultyJoint(valve, lambda time_s: ANGLE_RAD)
    begin(rig, side)
    rig.run(1.2)
    both_stay_vented(rig, side)
    assert max(map(max, rig.gauge_pa)) < (150e3 if key == 'driver_killed' else 120e3)
    end(rig, side)
    comes_back(rig)


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
@pytest.mark.parametrize('side, problems', UNUSABLE)
def test_a_pressure_that_cannot_be_used_vents_both_muscles(valve, side, problems):
    rig = under_pressure(valve)
    for arrives in problems if valve == 'ppr' else reversed(problems):
        _pressure(rig, side, arrives)
        both_stay_vented(rig, side)
    rig.spoil.clear()
    comes_back(rig)


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
@pytest.mark.parametrize('side', SIDES)
def test_a_muscle_whose_air_somebody_else_lets_out_is_not_left_to_the_other_one(valve, side):
    """A dump valve or a lost supply: the driver knows of nothing."""
    rig = under_pressure(valve)
    safe = SAFE_EFFORTS[valve]
    held = rig.plant.muscles[f'{side}/'].signal
    held.take = lambda message, writer, now_ns: None
    held.efforts = safe
    rig.run(1.0)
    both_stay_vented(rig, side)
    del held.take
    comes_back(rig)


@pytest.mark.parametrize('wanted', [-0.9, 0.9])
@pytest.mark.parametrize('side', SIDES)
def test_a_stop_is_seen_however_little_pressure_the_muscle_is_asked_for(wanted, side):
    rig = FaultyJoint('ppr', lambda time_s: wanted).run(2.0)
    rig.drivers[side].emergency_stop()
    rig.run(0.8)
    assert max(rig.gauge_pa[-1]) < 10e3


def test_a_stop_is_seen_where_no_pressure_was_ever_measured():
    rig = FaultyJoint('ppr', lambda time_s: ANGLE_RAD)
    for side in SIDES:
        rig.spoil[f'{side}/pressure'] = lambda message: None
    rig.run(5.0)        # regulators go on without after 2 s
    assert min(rig.gauge_pa[-1]) > 150e3
    rig.drivers['flexor'].emergency_stop()
    rig.run(0.8)
    assert max(rig.gauge_pa[-1]) < 10e3
    rig.run(2.0)
    assert max(rig.gauge_pa[-1]) < 10e3
    rig.drivers['flexor'].reset()
    comes_back(rig)


def test_a_stop_vents_both_muscles_of_a_joint_that_gives_a_torque():
    rig = under_pressure('ppr')
    rig.control.references.clear()
    rig.ask = lambda now_ns: ('joint_effort', NamedEfforts(now_ns, ('muscle',), (0.05,)))
    rig.run(0.5)
    assert rig.control.setpoint.effort.follows and min(rig.gauge_pa[-1]) > 100e3
    rig.drivers['extensor'].emergency_stop()
    rig.run(0.8)
    assert max(rig.gauge_pa[-1]) < 10e3


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_without_its_controller_both_drivers_vent_and_come_back_calmly(valve):
    rig = under_pressure(valve)
    rig.stopped.add('controller')
    rig.run(VENTED_WITHIN_S[valve] + 0.3)
    assert max(rig.gauge_pa[-1]) < 30e3
    assert all('command_timeout' in rig.faults[side] for side in SIDES)
    rig.run(1.0)
    rig.stopped.clear()
    comes_back(rig)


@pytest.mark.parametrize('problem', [
    lambda sound: None,
    lambda sound: JointAngle(sound.stamp_ns, math.nan),
    lambda sound: JointAngle(sound.stamp_ns - SECOND, sound.angle_rad)])
def test_an_angle_that_was_lost_and_found_brings_no_jump(problem):
    rig = under_pressure('ppr')
    rig.spoil['joint_state'] = problem
    rig.run(1.0)
    assert max(rig.gauge_pa[-1]) < 5e3
    rig.spoil.clear()
    comes_back(rig)


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_an_angle_and_pressures_frozen_in_motion_are_noticed(valve):
    """The pressures that should have moved the joint are those of the drivers."""
    rig = FaultyJoint(valve, lambda time_s: 0.6 * math.sin(math.pi * time_s)).run(3.3)
    rig.reasons.clear()
    sound = {}

    def frozen(topic, field):
        def arrives(message):
            value = sound.setdefault(topic, getattr(message, field))
            return type(message)(message.stamp_ns, value)
        return arrives

    rig.spoil['joint_state'] = frozen('joint_state', 'angle_rad')
    for side in SIDES:
        rig.spoil[f'{side}/pressure'] = frozen(f'{side}/pressure', 'pressure_pa')
    rig.run(2.5)
    told = tuple(codes.REASONS[code] for code in (codes.ANGLE_FROZEN, codes.MUSCLE_SLACK))
    assert any(reason.startswith(told) for reason in rig.reasons)
    assert max(rig.gauge_pa[-1]) < 50e3


def test_two_senders_of_the_angle_vent_both_muscles():
    rig = under_pressure('ppr')
    sentence = rig.control.two_sensors = 'two publishers send joint_state'
    rig.run(0.5)
    assert max(rig.gauge_pa[-1]) < 10e3
    assert rig.reasons[-1] == f'{codes.REASONS[codes.TWO_SENSORS]}: {sentence}'
    rig.control.two_sensors = ''
    comes_back(rig)


def test_a_joint_that_forgot_waits_for_new_inputs():
    rig = under_pressure('ppr')
    rig.control.forget()
    commands, _ = rig.control.tick(rig.now_ns + 5 * MS_NS)
    assert [command.pressure_pa for command in commands] == [P_ATM_PA] * 2
    assert rig.control.reason == codes.REASONS[codes.NO_ANGLE]


def test_a_reference_from_the_future_does_not_keep_the_muscles_filled():
    rig = under_pressure('ppr')
    rig.control.take('joint_reference', AngleReference(rig.now_ns + 3600 * SECOND, ANGLE_RAD, 0.0))
    rig.wanted = lambda time_s: math.nan        # no other one is usable
    rig.run(3.0)
    assert rig.reasons[-1] == codes.REASONS[codes.REFERENCE_LOST]
    assert max(rig.gauge_pa[-1]) < 5e3


def test_a_loop_that_stood_still_starts_bumplessly():
    rig = under_pressure('ppr')
    rig.stopped.add('controller')
    rig.run(0.3)
    rig.stopped.clear()
    rig.run(0.005)
    numbers = dict(zip(rig.state.names, rig.state.values))
    assert numbers['restarted'] == 1.0 and numbers['elapsed_s'] > 0.25
    for side, command_pa in zip(SIDES, rig.commands_pa[-1]):
        assert command_pa == pytest.approx(numbers[f'{side}_pressure_pa'], abs=5e3)


@pytest.mark.parametrize('wanted', [-1.02, 1.02])
def test_a_joint_pushed_against_its_stop_is_not_vented_for_the_noise_of_its_encoder(wanted):
    rig = FaultyJoint('ppr', lambda time_s: wanted).run(4.0)
    assert abs(rig.angle_rad[-1]) == 1.0
    assert set(rig.reasons) == {codes.REASONS[codes.OK]}
