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

"""The simulated rig on a clock: steps, held signal, samples, catch-up."""

import math

from pam_actuation.loops.bus import Bus
from pam_actuation.loops.wiring import attach_plant
from pam_actuation.messages import Force, Torque, ValveSignal
from pam_actuation.plant_loop import Backlog, PlantLoop
import pam_sim
from pam_sim.joint import load_joint
from pam_sim.units import P_ATM_PA
import pytest

MS = 1_000_000
START = 1_700_000_000_000_000_007


def make(valve='ppr', preset='dmsp_5_300_hanging_mass', seed=1):
    """Return a started plant loop."""
    plant = PlantLoop(pam_sim.load_rig(preset, valve=valve), seed)
    assert plant.advance_to(START) == 0
    return plant


def test_steps_to_the_clock():
    """1 kHz physics: as many steps as ms have passed, the rest carried over."""
    plant = make()
    assert plant.advance_to(START + 5 * MS) == 5
    assert plant.advance_to(START + 5 * MS + MS // 2) == 0
    assert plant.advance_to(START + 7 * MS - 1) == 1
    assert plant.advance_to(START + 3 * MS) == 0          # the clock went back
    assert plant.advance_to(START + 10 * MS) == 4
    assert plant.plant.time_s == pytest.approx(0.010) and plant.steps == 10


def test_the_plant_goes_on_from_a_clock_that_begins_anew():
    plant = make()
    plant.advance_to(START + 200 * MS)
    before = plant.plant.time_s
    plant.follow(START + 150 * MS)              # a little back: it waits
    assert plant.now_ns == START + 200 * MS
    plant.follow(START - 10_000 * MS)           # a recording is played again
    assert plant.now_ns == START - 10_000 * MS and plant.plant.time_s == before
    assert plant.advance_to(START - 9_990 * MS) == 10 and not plant.skipped_s


def test_equals_the_rollout():
    """The same inputs through simulate give the same pressures to the bit."""
    plant = make('hsv', 'dmsp_5_300_realistic')
    duties = [(0.4, 0.0)] * 10 + [(0.0, 0.3)] * 10
    for k, duty in enumerate(duties):
        plant.set_signal(ValveSignal(0, ('fill_duty', 'vent_duty'), duty))
        plant.advance_to(START + (k + 1) * 10 * MS)
    response = plant.rig.simulate([duty for duty in duties for _ in range(10)])
    assert plant.plant.pressure_pa == response.pressure_pa[-1]


def test_signal_by_name_and_held():
    """Matched by name in any order; not finite or unknown: ignored, the old one stays."""
    plant = make('hsv')
    plant.set_signal(ValveSignal(0, ('vent_duty', 'fill_duty'), (0.0, 0.7)))
    assert plant.muscles[''].signal.efforts == (0.7, 0.0)
    plant.set_signal(ValveSignal(0, ('fill_duty', 'vent_duty'), (math.nan, 0.2)))
    assert plant.muscles[''].signal.efforts == (0.7, 0.2)
    plant.set_signal(ValveSignal(0, ('ppr_voltage',), (3.0,)))
    assert plant.muscles[''].signal.efforts == (0.7, 0.2) and plant.muscles[''].signal.ignored == 2
    plant.set_signal(ValveSignal(0, ('fill_duty',), (0.0,)))
    assert plant.muscles[''].signal.efforts == (0.0, 0.2) and plant.muscles[''].signal.taken == 4


@pytest.mark.parametrize('valve, opening, safe', [
    ('ppr', (6.0,), (0.0,)), ('hsv', (1.0, 0.0), (0.0, 1.0))])
def test_of_several_senders_one_that_vents_is_enough(valve, opening, safe):
    """A safe signal acts for 0.1 s against openings of others, not of its own writer."""
    plant = make(valve)
    names = plant.rig.signal_names

    def acts(at_ms, writer, efforts):
        plant.advance_to(START + at_ms * MS)
        plant.set_signal(ValveSignal(0, names, efforts), writer)
        return plant.muscles[''].signal.efforts

    assert acts(0, 'driver', opening) == opening
    assert acts(1, 'driver', safe) == safe
    assert acts(2, 'stranger', opening) == safe
    assert acts(90, 'stranger', opening) == safe
    assert acts(102, 'stranger', opening) == opening
    assert acts(103, 'driver', safe) == safe and acts(104, 'driver', opening) == opening
    assert acts(105, 'stranger', opening) == opening


@pytest.mark.parametrize('names, efforts, got', [
    (('fill_duty', 'vent_duty'), (0.5, 0.0), 'fill_duty, vent_duty'),
    ((), (), 'no names'),
    (('ppr_voltage',), (math.nan,), 'ppr_voltage nan'),
    (('a', 'ppr_voltage'), (1.0,), 'a, ppr_voltage nan'),
    (tuple('abcdef'), (1.0,) * 6, 'a, b, c, d, 2 more')])
def test_a_plant_that_can_use_nothing_of_its_signal_says_what_it_got_and_needs(
        names, efforts, got):
    plant = make('ppr')
    told = [f'nothing of valve_signal can be used: it has {got}; this PPR valve needs ppr_voltage']

    def problems(at_ms, *signal):
        plant.advance_to(START + at_ms * MS)
        plant.set_signal(ValveSignal(0, *signal))
        return plant.problems(START + at_ms * MS)

    assert problems(100, names, efforts) == [] and problems(599, names, efforts) == []
    assert problems(600, names, efforts) == told and plant.problems(START + 5000 * MS) == told
    assert plant.muscles[''].signal.unusable == 3
    assert problems(700, ('x', 'ppr_voltage'), (1.0, 2.0)) == []
    assert problems(1500, names, efforts) == [] and problems(2000, names, efforts) == told


def test_a_joint_names_the_muscle_whose_signal_it_cannot_use():
    plant = PlantLoop(load_joint('joint_dmsp_5_300_realistic', valve='hsv'))
    plant.advance_to(START)
    plant.takes()['extensor/valve_signal'](ValveSignal(0, ('ppr_voltage',), (1.0,)))
    assert plant.problems(START + 600 * MS) == [
        'nothing of extensor/valve_signal can be used: it has ppr_voltage; '
        'this HSV valve needs fill_duty, vent_duty']


def test_ppr_reaches_its_pressure():
    """3 V give 300 kPa gauge and the contraction of the force map."""
    plant = make()
    plant.set_signal(ValveSignal(0, ('ppr_voltage',), (3.0,)))
    for k in range(1, 31):
        plant.advance_to(START + k * 100 * MS)
    sample = plant.sample(START + 3000 * MS)
    assert sample['pressure'].pressure_pa == pytest.approx(P_ATM_PA + 300e3, rel=1e-6)
    assert sample['contraction'].contraction_m == pytest.approx(2.62e-3, abs=2e-5)
    assert math.isnan(sample['contraction'].velocity_m_per_s)
    assert sample['force'].force_n == pytest.approx(49.03, abs=0.05)
    assert 'supply_pressure' not in sample
    assert sample['pressure'].stamp_ns == START + 3000 * MS


def test_external_force():
    """10 N against the contraction reduce it; NaN is ignored."""
    held = []
    for force_n in (0.0, 10.0):
        plant = make()
        plant.set_signal(ValveSignal(0, ('ppr_voltage',), (4.0,)))
        plant.set_external_force(Force(0, force_n))
        plant.set_external_force(Force(0, math.nan))
        for k in range(1, 21):
            plant.advance_to(START + k * 100 * MS)
        held.append(plant.sample(0)['contraction'].contraction_m)
    assert held[1] < held[0] - 1e-3


def test_external_torque_turns_the_limb():
    """0.3 N m in flexion bend a limb without air; NaN is ignored."""
    held = []
    for torque_n_m in (0.0, 0.3):
        plant = PlantLoop(load_joint('joint_dmsp_5_300_realistic', valve='ppr'))
        plant.advance_to(START)
        take = plant.takes()['external_torque']
        take(Torque(0, torque_n_m))
        take(Torque(0, math.nan))
        plant.advance_to(START + 250 * MS)
        held.append(plant.plant.angle_rad)
    assert held[1] > held[0] + 0.1


def contraction_after(stamps_and_forces, at_ms):
    """Return the contraction [m] at some times; each force is sent at the start."""
    plant, found = make(), []
    plant.set_signal(ValveSignal(0, ('ppr_voltage',), (4.0,)))
    for stamp_ms, force_n in stamps_and_forces:
        plant.set_external_force(Force(START + stamp_ms * MS, force_n))
    for now_ms in at_ms:
        plant.advance_to(START + now_ms * MS)
        found.append(plant.plant.contraction_m)
    return found


@pytest.mark.parametrize('at_ms', [range(4, 600, 4), range(7, 600, 97), range(200, 600, 200)])
def test_a_force_stamped_ahead_acts_from_its_stamp_on_however_often_the_plant_is_called(at_ms):
    plant, expected = make(), []
    plant.set_signal(ValveSignal(0, ('ppr_voltage',), (4.0,)))
    for now_ms in at_ms:
        for stamp_ms, force_n in ((300, 10.0), (450, 0.0)):
            if stamp_ms < now_ms:
                plant.advance_to(START + stamp_ms * MS)
                plant.set_external_force(Force(0, force_n))
        plant.advance_to(START + now_ms * MS)
        expected.append(plant.plant.contraction_m)
    assert contraction_after([(450, 0.0), (300, 10.0)], at_ms) == expected
    assert contraction_after([(300, 7.0), (450, 0.0), (300, 10.0)], at_ms) == expected
    assert expected != contraction_after([], at_ms)


def test_a_torque_stamped_ahead_waits_as_well():
    angles_rad = []
    for stamp_ms in (100, 10):
        plant = PlantLoop(load_joint('joint_dmsp_5_300_realistic', valve='ppr'))
        plant.advance_to(START)
        plant.takes()['external_torque'](Torque(START + stamp_ms * MS, 0.3))
        plant.advance_to(START + 100 * MS)
        before_rad = plant.plant.angle_rad
        plant.advance_to(START + 250 * MS)
        angles_rad.append((before_rad, plant.plant.angle_rad))
    assert angles_rad[0][0] < angles_rad[1][0] - 0.05
    assert angles_rad[0][0] < angles_rad[0][1] - 0.05


def test_a_force_too_far_ahead_is_refused_told_and_not_kept():
    plant = make()
    plant.set_external_force(Force(START + 10_000 * MS, 1.0))
    assert plant.disturbance.waiting == 1 and plant.problems(START) == []
    plant.set_external_force(Force(START + 10_001 * MS, 1.0))
    assert plant.disturbance.waiting == 1 and plant.disturbance.refused == 1
    assert plant.problems(START + 999 * MS) == [
        'an external_force was ignored: it is stamped 10.001 s ahead (limit 10 s)']
    assert plant.problems(START + 1001 * MS) == []
    for k in range(1100):
        plant.set_external_force(Force(START + 5000 * MS + k, 1.0))
    assert plant.disturbance.waiting == 1000 and plant.disturbance.refused == 102
    assert '1000 that lie ahead' in plant.problems(START)[0]


def test_a_valve_signal_stamped_ahead_is_never_delayed():
    plant = make()
    plant.set_signal(ValveSignal(START + 5000 * MS, ('ppr_voltage',), (3.0,)))
    plant.advance_to(START + 500 * MS)
    assert plant.plant.pressure_pa > P_ATM_PA + 200e3


def test_on_a_bus_a_force_stamped_ahead_lets_the_valve_signals_before_it_act():
    plant, bus = PlantLoop(pam_sim.load_rig('dmsp_5_300_hanging_mass', valve='ppr')), Bus()
    bus.add(attach_plant(bus, plant), range(START, START + 400 * MS, 4 * MS))
    bus.step()
    bus.send('external_force', Force(START + 350 * MS, 5.0), START)
    bus.send('valve_signal', ValveSignal(START, ('ppr_voltage',), (3.0,)), START)
    bus.run_until(START + 300 * MS)
    assert plant.now_ns == START + 300 * MS
    assert plant.plant.pressure_pa > P_ATM_PA + 200e3


def test_late_call_is_bounded_and_counted():
    """After a pause of 10 s at most 0.25 s are simulated; the time goes on from now."""
    plant = make()
    plant.advance_to(START + 10 * MS)
    assert plant.advance_to(START + 10_010 * MS) == 250
    assert plant.overruns == 1 and plant.skipped_s == pytest.approx(9.75)
    assert plant.now_ns == START + 10_010 * MS
    assert plant.advance_to(START + 10_015 * MS) == 5


def test_noise_and_jitter_from_the_rig():
    """The realistic rig: 0.3 kPa, 10 um, 0.1 N, 50 us; the same seed gives the same."""
    def read(seed):
        plant = make('hsv', 'dmsp_5_300_realistic', seed)
        samples = []
        for k in range(1, 1001):
            plant.advance_to(START + k * 5 * MS)
            samples.append(plant.sample(START + k * 5 * MS))
        return samples

    def spread(values):
        mean = sum(values) / len(values)
        return math.sqrt(sum((value - mean) ** 2 for value in values) / len(values))

    samples = read(1)
    assert spread([s['pressure'].pressure_pa for s in samples]) == pytest.approx(300, rel=0.1)
    assert spread([s['contraction'].contraction_m for s in samples]) == pytest.approx(
        1e-5, rel=0.1)
    jitter = [s['pressure'].stamp_ns - START - (k + 1) * 5 * MS for k, s in enumerate(samples)]
    assert spread(jitter) == pytest.approx(50_000, rel=0.1)
    assert samples[0]['supply_pressure'].pressure_pa == pytest.approx(801_325.0)
    assert str(read(1)) == str(samples)
    assert str(read(2)) != str(samples)


def test_what_arrives_after_a_standstill_waits_for_the_rest():
    """Nothing for 20 ms, then all of it; on time everything at once."""
    backlog = Backlog(after_s=0.05, patience_s=0.02)
    assert backlog.take(START, ['a']) == ['a']
    assert backlog.take(START + 40 * MS, []) == []
    back = START + 1000 * MS
    assert backlog.take(back, []) is None
    assert backlog.take(back + 1 * MS, ['b', 'c']) is None
    assert backlog.take(back + 19 * MS, ['d']) is None
    assert backlog.take(back + 20 * MS, ['e']) == ['b', 'c', 'd', 'e']
    assert backlog.take(back + 21 * MS, ['f']) == ['f']
    assert backlog.take(START, ['g']) == ['g']          # a clock that was set back waits for none


def test_a_wait_ends_where_the_clock_is_set_back():
    """Nothing waits for a time that lies ahead again."""
    backlog = Backlog(after_s=0.05, patience_s=0.02)
    backlog.take(START, [])
    assert backlog.take(START + 1000 * MS, ['a']) is None
    assert backlog.take(START, ['b']) == ['a', 'b']
    assert backlog.take(START + 1 * MS, ['c']) == ['c']


def test_late_calls_do_not_hold_messages_back_for_ever():
    """On a machine where every call is late each second one goes on."""
    backlog = Backlog(after_s=0.05, patience_s=0.02)
    backlog.take(START, [])
    taken = [backlog.take(START + k * 60 * MS, [k]) for k in range(1, 5)]
    assert taken == [None, [1, 2], None, [3, 4]]
