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
"""Commands act at a steady age whatever the phase of driver and controller, offline."""

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.control.config import load_controller
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.drivers.recorded import as_recorded, driver_facts
from pam_actuation.drivers.steady_age import SteadyAge
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.messages import Pressure
from pam_actuation.replay.driver import replay_driver
import pam_sim
from pam_sim.errors import InputError
from pam_sim.units import P_ATM_PA
import pytest

MS = 1_000_000
START = 1_700_000_000_123_456_789
WAY_NS = 300_000            # of a command to the driver
SLOPE_PA_PER_NS = 1e-3      # of the commands: 1 MPa/s
# When a driver ticks that finds the command of now or the one before, at random.
EDGE = {'driver': np.arange(-9, 1350) * 10 * MS + np.random.default_rng(1).choice(
    [-200_000, 200_000], 1359)}
SINE = """
name: one_hertz
domain: contraction
segments:
  - rest: {duration_s: 0.5}
  - ramp: {to_m: 0.004, duration_s: 1.0}
  - sine: {center_m: 0.014, amplitude_m: 0.010, frequency_hz: 1.0, cycles: 12}
"""


def command_pa(stamp_ns):
    return P_ATM_PA + 200_000.0 + SLOPE_PA_PER_NS * (stamp_ns - START)


def ages_ms(sender_ns, ticks_ns, wait_ns=15 * MS, period_ns=10 * MS):
    """Return the ages at which ramp commands act, and those of the newest commands."""
    ages, sent = SteadyAge(wait_ns, period_ns), list(sender_ns)
    acted, newest, newest_ns = [], [], None
    for now_ns in ticks_ns:
        while sent and sent[0] + WAY_NS <= now_ns:
            newest_ns = sent.pop(0)
            ages.take(newest_ns, command_pa(newest_ns))
        if newest_ns is None:
            continue
        acts_pa = ages.at(now_ns, command_pa(newest_ns))
        acted.append((command_pa(now_ns) - acts_pa) / SLOPE_PA_PER_NS * 1e-6)
        newest.append((now_ns - newest_ns) * 1e-6)
        assert ages.age_ns * 1e-6 == pytest.approx(acted[-1], abs=1e-3)
    return np.array(acted), np.array(newest)


def sender(count, period_ns=5 * MS):
    return START + period_ns * np.arange(count)


def edge(count, jitter_ns, seed=3):
    """Return ticks each 10 ms that fall just before or after the arrival of a command."""
    jitter = np.random.default_rng(seed).uniform(-jitter_ns, jitter_ns, count)
    return START + WAY_NS + 10 * MS * np.arange(1, count + 1) + jitter.astype(int)


def test_alternating_ages_become_one():
    ticks = START + WAY_NS + 10 * MS * np.arange(1, 301) + np.where(np.arange(300) % 2, 1, -1)
    acted, newest = ages_ms(sender(700), ticks)
    assert np.ptp(newest) == pytest.approx(5.0, abs=0.001)
    assert np.ptp(acted[2:]) < 0.01 and acted[-1] == pytest.approx(5.3, abs=0.01)


def test_jitter_at_the_edge_moves_the_age_by_no_more_than_the_jitter():
    ticks = edge(400, 300_000)
    acted, newest = ages_ms(sender(900), ticks)
    assert np.ptp(newest) > 4.8
    assert np.ptp(acted[20:]) < 0.65 and acted[20:].std() < 0.25 < 1.8 < newest[20:].std()


@pytest.mark.parametrize('phase_ns', [WAY_NS, WAY_NS + 1, 2_500_000, 5 * MS + WAY_NS - 1])
def test_at_a_constant_age_the_newest_command_acts_to_the_bit(phase_ns):
    ages, sent = SteadyAge(15 * MS, 10 * MS), sender(500).tolist()
    for now_ns in (sender(240, 10 * MS) + 10 * MS + phase_ns).tolist():
        while sent[0] + WAY_NS <= now_ns:
            newest_ns = sent.pop(0)
            ages.take(newest_ns, command_pa(newest_ns))
        assert ages.at(now_ns, command_pa(newest_ns)) == command_pa(newest_ns)


def test_a_sender_whose_period_does_not_fit_has_a_steady_age_too():
    acted, newest = ages_ms(sender(900, 6_700_000), START + MS + 10 * MS * np.arange(1, 500))
    assert np.ptp(newest) > 6.0 and np.ptp(acted[50:]) < 0.25


def test_a_late_command_acts_as_it_comes_and_changes_nothing_afterwards():
    sent = sender(800)
    late = sent[(sent < sent[600]) | (sent > sent[608])]       # a stall of 45 ms
    ticks = START + WAY_NS + MS + 10 * MS * np.arange(1, 380)
    acted, newest = ages_ms(late, ticks)
    assert newest.max() > 40.0 and acted == pytest.approx(newest, abs=1e-6)


def test_the_age_rises_once_many_commands_are_late_and_falls_late_and_slowly():
    before = np.arange(600, 1400)               # ticks that come before their command does
    ticks = START + WAY_NS + 10 * MS * np.arange(1, 3200) + 300_000
    ticks[before] -= 600_000
    acted, newest = ages_ms(sender(6600), ticks)
    assert newest[[599, 600, 1399, 1400]] == pytest.approx([0.6, 5.0, 5.0, 0.6])
    assert acted[590] == pytest.approx(0.6) and np.ptp(acted[620:2390]) < 0.8
    falls = np.diff(acted[2500:])
    assert np.all(falls < 0.0) and falls.min() > -0.01


def test_two_late_commands_at_the_start_are_forgotten():
    sent = sender(1000)
    late = sent[~np.isin(np.arange(1000), [100, 200])]
    acted, newest = ages_ms(late, START + WAY_NS + MS + 10 * MS * np.arange(1, 480))
    assert np.sum(newest > 2.0) == 2 and acted[120:] == pytest.approx(newest[120:], abs=1e-6)


def test_rare_flips_leave_the_age_as_it_is():
    ticks = START + WAY_NS + 10 * MS * np.arange(1, 3000) + 200_000
    ticks[np.random.default_rng(2).uniform(size=len(ticks)) < 0.015] -= 400_000
    acted, newest = ages_ms(sender(6200), ticks)
    assert np.ptp(newest) > 4.5 and np.ptp(acted[100:]) < 0.5


def test_waiting_can_be_switched_off():
    acted, newest = ages_ms(sender(500), edge(200, 300_000), wait_ns=0)
    assert acted == pytest.approx(newest, abs=1e-6)


def driven(valve, commands, ticks_ns, **changes):
    """Return what a driver follows at its ticks."""
    driver, followed, left = DriverLoop(valve, changes), [], list(commands)
    for now_ns in ticks_ns:
        now_ns = int(now_ns)
        while left and left[0].stamp_ns + WAY_NS <= now_ns:
            driver.on_command(left.pop(0))
        driver.on_pressure(Pressure(now_ns - MS, P_ATM_PA + 3e5 + now_ns % 977))
        driver.act(now_ns)
        followed.append(driver.followed().pressure_pa)
    return np.array(followed), driver


def test_a_vent_command_does_not_wait():
    stamps = sender(800)
    commands = [Pressure(int(stamp), P_ATM_PA if stamp > stamps[700] else P_ATM_PA + 3e5)
                for stamp in stamps]
    ticks = edge(380, 300_000)
    followed, _ = driven('hsv', commands, ticks)
    first = int(np.argmax(ticks >= stamps[701] + WAY_NS))
    assert followed[first - 1] > P_ATM_PA + 1e5 and followed[first] == P_ATM_PA


def test_after_a_silence_nothing_from_before_acts():
    stamps = [int(stamp) for stamp in sender(800)]
    commands = [Pressure(stamp, P_ATM_PA + (4e5 if stamp < stamps[400] else 1e5))
                for stamp in stamps if not stamps[400] <= stamp < stamps[440]]
    ticks = edge(390, 300_000)
    followed, driver = driven('hsv', commands, ticks)
    after = ticks > stamps[400]
    assert driver.safety.vents == 1 and P_ATM_PA in followed[after]
    assert followed[after][15:].max() <= P_ATM_PA + 1e5


def test_the_status_tells_both_ages():
    stamps = sender(800)
    commands = [Pressure(int(stamp), P_ATM_PA + 3e5) for stamp in stamps]
    ticks = edge(380, 300_000)
    _, driver = driven('hsv', commands, ticks)
    values = dict(driver.status().values)
    newest, acted = (float(values[key]) for key in ('command_age_ms', 'command_acted_age_ms'))
    assert 0.3 <= newest <= 5.6 and acted == pytest.approx(5.3, abs=0.5)


def test_a_regulator_passes_each_command_on():
    stamps = sender(400)
    commands = [Pressure(int(stamp), P_ATM_PA + 1e5 + (stamp - START) * 1e-5) for stamp in stamps]
    followed, _ = driven('ppr', commands, stamps + WAY_NS, resume_rate_pa_per_s=1e9)
    assert followed[20:] == pytest.approx([c.pressure_pa for c in commands[20:]], abs=0.0)


def tracked(tmp_path, name, ticks, wait_s=0.015):
    """Return (RMSE of the last six cycles [mm], run) of a 1 Hz sine behind on/off valves."""
    rig, experiment = pam_sim.load_rig('dmsp_5_300_realistic', valve='hsv'), load_experiment(SINE)
    bag = simulate_experiment(experiment, rig, load_controller('sofc_hsv', rig), tmp_path / name,
                              seed=1, ticks=ticks, driver={'command_wait_s': wait_s})['bag']
    run = load_run(bag)
    state = run.topics['controller_state']
    error = state.values['reference_m'] - state.values['contraction_m']
    late = state.stamp_ns > state.stamp_ns[-1] - 6_000_000_000
    return 1e3 * float(np.sqrt(np.nanmean(error[late] ** 2))), run


@pytest.fixture(scope='module')
def at_the_edge(tmp_path_factory):
    return tracked(tmp_path_factory.mktemp('edge'), 'edge', EDGE)


def test_random_ages_cost_no_tracking(tmp_path, at_the_edge):
    tied, _ = tracked(tmp_path, 'tied', {})
    assert at_the_edge[0] < 1.3 * tied
    newest, run = tracked(tmp_path, 'newest', EDGE, 0.0)
    assert newest > 3.0 * tied
    assert replay_driver(run).identical


def test_a_replay_waits_as_the_recorded_driver_did(at_the_edge):
    run = at_the_edge[1]
    assert driver_facts().items() <= run.metadata.items()
    assert replay_driver(run).identical
    del run.metadata['command_wait_s']          # as of versions before
    assert not replay_driver(run).identical
    # Another recorder tells neither: the driver is taken for one of this version.
    assert as_recorded({'rig': 'text'}, 'a bag') == as_recorded(
        {**driver_facts(), 'software_version': '0.1.0'}, 'a bag')
    with pytest.raises(InputError, match='command_wait_s is .soon., a number is needed'):
        as_recorded({'command_wait_s': 'soon'}, 'a bag')
