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
"""Iterative learning control and model predictive control: the baselines that plan or repeat."""

import math

import numpy as np
from pam_actuation.control import mpc, mpc_gains
from pam_actuation.control.config import load_controller
from pam_actuation.control.controller_text import controller_to_yaml
from pam_actuation.control.ilc import IlcController
from pam_actuation.control.lqi_model import LinearModel
from pam_actuation.control.mpc import MpcController
from pam_actuation.control.static_inverse import inverse_pressure_pa, static_inverse
from pam_actuation.experiments import load_experiment
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.records import fields
from pam_sim.units import P_ATM_PA
import pytest

RATE_HZ = 200.0
INVERSE = static_inverse(0.0, 0.001, 2.5e5 + 2e7 * np.arange(31) * 1e-3 + 3e8 * (
    np.arange(31) * 1e-3) ** 2)


def model_of_lag_and_mass(delay_ticks=7, lag_s=0.06, rate=30.0, damping=0.3):
    """Return the model that identification should find, of this slope at 14 mm."""
    from scipy.signal import cont2discrete
    _, slope = mpc_gains.equivalent_pa(INVERSE, 4e5, 0.014)
    # In metres: next to a denominator of order one, a numerator in m/Pa drowns in rounding.
    numerator, denominator, _ = cont2discrete(
        ([rate ** 2], np.polymul([lag_s, 1.0], [1.0, 2.0 * damping * rate, rate ** 2])),
        1.0 / RATE_HZ)
    return LinearModel(RATE_HZ, delay_ticks, tuple(denominator[1:]),
                       tuple(numerator.ravel()[1:] / slope), 0.014, 0.0)


class Muscle:
    """A model as a plant: what the static inverse says, behind delay, lag and mass."""

    def __init__(self, model, bias_pa=0.0):
        self.model, self.bias_pa = model, bias_pa
        self._rows = np.zeros((2, 4))
        start = self.equivalent(inverse_pressure_pa(INVERSE, 0.014))
        self._waiting = [start] * model.delay_ticks
        self.contraction_m = 0.014

    def equivalent(self, pressure_pa):
        return mpc_gains.equivalent_pa(INVERSE, pressure_pa, 0.014)[0] + self.bias_pa

    def step(self, pressure_pa):
        """Advance by one tick."""
        self._waiting.append(self.equivalent(pressure_pa))
        self._rows = np.roll(self._rows, 1, axis=1)
        u, y = self._rows
        u[0] = self._waiting.pop(0)
        y[0] = (np.dot(self.model.numerator, u[:3]) - np.dot(self.model.denominator, y[1:]))
        self.contraction_m = 0.014 + y[0]


def tracked(controller, muscle, wanted, ticks, learn=True):
    """Return the errors [mm]; ``wanted(t)`` returns contraction and rate."""
    errors, pressure_pa = np.empty(ticks), inverse_pressure_pa(INVERSE, 0.014)
    for k in range(ticks):
        t = k / RATE_HZ
        (now, rate), (lead, lead_rate) = wanted(t), wanted(t + controller.lead_s)
        errors[k] = 1e3 * (now - muscle.contraction_m)
        pressure_pa = controller.step(muscle.contraction_m, now, rate, lead, lead_rate, learn,
                                      pressure_pa=pressure_pa)
        muscle.step(pressure_pa)
    return errors


def sine(hz, amplitude_m=0.004):
    def wanted(t):
        w = 2.0 * math.pi * hz
        return 0.014 + amplitude_m * math.sin(w * t), amplitude_m * w * math.cos(w * t)
    return wanted


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def ilc(**settings):
    return IlcController(INVERSE, {
        'lead_s': 0.0, 'proportional_pa_per_m': 0.0, 'integral_pa_per_m_s': 1e6,
        'derivative_pa_s_per_m': 0.0, 'learning_pa_per_m': 1e7, **settings})


@pytest.mark.parametrize('hz', [1.0, 0.7])       # the cycle of the second is no number of ticks
def test_an_ilc_learns_what_repeats(hz):
    cycle = RATE_HZ / hz
    controller = ilc()
    errors = tracked(controller, Muscle(model_of_lag_and_mass()), sine(hz), int(14 * cycle))
    first, last = rms(errors[int(cycle):int(2 * cycle)]), rms(errors[-int(cycle):])
    assert last < 0.15 * first
    out = fields(controller._outputs, controller_outputs(controller))
    assert out.cycle_s == pytest.approx(1.0 / hz, abs=1e-4)
    assert controller.learning_reason() == 'learning'


def controller_outputs(controller):
    """Return the record of what a controller puts out."""
    from pam_sim.records import record
    return record(*controller.state_names)


def test_an_ilc_that_may_not_learn_or_has_no_cycle_learns_nothing():
    frozen = ilc()
    errors = tracked(frozen, Muscle(model_of_lag_and_mass()), sine(1.0), 1600, learn=False)
    assert rms(errors[-200:]) > 0.9 * rms(errors[200:400])
    assert frozen.learning_reason() == 'learning is off'

    def drifting(t):
        """Return a sweep: no two cycles are alike."""
        phase = 2.0 * math.pi * (0.5 * t + 0.05 * t * t)
        rate = 0.004 * 2.0 * math.pi * (0.5 + 0.1 * t) * math.cos(phase)
        return 0.014 + 0.004 * math.sin(phase), rate
    controller = ilc()
    learned = []
    muscle = Muscle(model_of_lag_and_mass())
    for k in range(1600):
        value, rate = drifting(k / RATE_HZ)
        muscle.step(controller.step(muscle.contraction_m, value, rate, value, rate))
        learned.append(controller.state_values()[controller.state_names.index('learned_pa')])
    assert not np.any(learned)
    assert controller.learning_reason() == 'the reference does not repeat within 12 s'


def learned_pa(controller, muscle, ticks, begin=0, learn=True, measured=lambda command: command):
    """Track a sine of 1 Hz; return what was learned in each tick [Pa]."""
    learned, pressure_pa = np.empty(ticks), inverse_pressure_pa(INVERSE, 0.014)
    of = controller.state_names.index('learned_pa')
    for k in range(ticks):
        wanted = sine(1.0)((begin + k) / RATE_HZ)
        command = controller.step(
            muscle.contraction_m, *wanted, *wanted, learn, pressure_pa=pressure_pa)
        pressure_pa = measured(command)
        muscle.step(command)
        learned[k] = controller.state_values()[of]
    return learned


def test_an_ilc_learns_nothing_beyond_a_limit_of_its_command():
    """The upper half asks for more than is allowed: what is learned there would only grow."""
    limited = ilc(max_pressure_gauge_pa=inverse_pressure_pa(INVERSE, 0.0155) - P_ATM_PA,
                  integral_pa_per_m_s=0.0, anti_windup_time_s=10.0, learning_limit_pa=6e5)
    learned = learned_pa(limited, Muscle(model_of_lag_and_mass()), 4000)
    assert 4e4 < learned[600:800].max() and learned.max() < 1.5e5      # it grew by 20 kPa a cycle


def test_an_ilc_learns_nothing_where_the_pressure_does_not_follow():
    for supplied, learns in ((lambda command: 3e5, False), (lambda command: command - 1e4, True),
                             (lambda command: math.nan, True)):
        learned = learned_pa(ilc(), Muscle(model_of_lag_and_mass()), 1000, measured=supplied)
        assert learned.any() == learns


def test_an_ilc_does_not_learn_later_what_it_saw_while_it_may_not_learn():
    controller, muscle = ilc(learning_lead_s=0.0, learning_filter_s=0.0), Muscle(
        model_of_lag_and_mass())
    learned_pa(controller, muscle, 800, learn=False)
    learned = learned_pa(controller, muscle, 400, 800)
    assert not learned[:195].any() and learned[205:].any()


def test_an_ilc_whose_learning_is_switched_off_keeps_what_it_learned():
    controller, muscle = ilc(learning_filter_s=0.1), Muscle(model_of_lag_and_mass())
    learned = learned_pa(controller, muscle, 1600)[-200:]
    kept = learned_pa(controller, muscle, 4000, 1600, learn=False)
    assert np.ptp(learned) > 1e4
    assert kept[-200:] == pytest.approx(kept[:200], abs=10.0)


def test_an_ilc_finds_a_cycle_whatever_the_age_of_the_readings():
    """A sine of up to 63 mm/s, readings of 0 to 5 ms of age at random."""
    controller, ages_s = ilc(lead_s=0.1), np.random.default_rng(5).uniform(0.0, 0.005, 1000)
    cycle, found_s = controller.state_names.index('cycle_s'), []
    for k, age_s in enumerate(ages_s):
        (now, rate), lead = (sine(1.0, 0.01)(k / RATE_HZ + one) for one in (-age_s, 0.1))
        controller.step(0.014, now, rate, *lead, age_s=age_s)
        found_s.append(controller.state_values()[cycle])
    assert found_s[560:] == pytest.approx([1.0] * 440, abs=2e-3)     # two cycles after a minimum


@pytest.mark.parametrize('rate_hz, cycle_s', [(200.0, 4.0), (1000.0, 4.0), (1000.0, 12.0)])
def test_an_ilc_finds_a_cycle_up_to_twelve_seconds_at_any_rate(rate_hz, cycle_s):
    """It remembered 5000 ticks, so at 1000 Hz it found none beyond 2.5 s."""
    controller = ilc(rate_hz=rate_hz)
    for k in range(int(3.0 * cycle_s * rate_hz)):
        wanted = sine(1.0 / cycle_s)(k / rate_hz)
        controller.step(0.014, *wanted, *wanted)
    found = controller.state_values()[controller.state_names.index('cycle_s')]
    assert found == pytest.approx(cycle_s, abs=1e-3)


def test_an_ilc_of_steps_finds_their_cycle_and_forgets_in_a_pause():
    controller = ilc()
    tracked(controller, Muscle(model_of_lag_and_mass()),
            lambda t: (0.016 if (t + 0.5) % 2.0 < 1.0 else 0.012, 0.0), 1500)
    cycle = controller.state_names.index('cycle_s')
    assert controller.state_values()[cycle] == pytest.approx(2.0)
    controller.pause()
    assert not controller._memory.any() and not controller._state.any()


@pytest.mark.parametrize('bias_pa', [0.0, 2e4])
def test_an_mpc_on_its_own_model_tracks_and_leaves_no_error_at_rest(bias_pa):
    model = model_of_lag_and_mass()
    controller = MpcController(
        model, INVERSE, {'lead_s': 0.5, 'command_weight': 1e-3, 'change_weight': 1e-4})
    errors = tracked(controller, Muscle(model, bias_pa), sine(1.0), 1200)
    assert rms(errors[400:]) < 0.1          # of 2.8 mm
    rest = tracked(controller, Muscle(model, bias_pa), lambda t: (0.016, 0.0), 600)
    assert np.abs(rest[-100:]).max() < 1e-3


def test_a_plan_beyond_a_bound_is_the_best_one_within():
    from scipy.optimize import lsq_linear
    model = model_of_lag_and_mass()
    settings = {'command_weight': 1e-3, 'change_weight': 1e-3, 'max_pressure_gauge_pa': 4.2e5}
    controller = MpcController(model, INVERSE, settings)
    tracked(controller, Muscle(model), sine(0.8, 0.008), 45)
    st, packed = fields(controller._state, mpc.STATE), fields(controller.gains, mpc_gains.MODEL)
    assert (st.wanted_pa > packed.highest_pa).any()
    hessian = packed.hessian.reshape(mpc_gains.MOVES, -1)
    # The rows were scaled; a symmetric matrix has one scale that makes it so.
    scale = hessian[0] / hessian[:, 0]
    root = np.linalg.cholesky(0.5 * (hessian.T * scale + (hessian.T * scale).T)).T
    best = lsq_linear(root, root @ st.wanted_pa, (packed.lowest_pa, packed.highest_pa)).x
    assert st.plan_pa == pytest.approx(best, abs=20.0)


@pytest.mark.parametrize('starts', [mpc_gains._STARTS, (0.15, 12.0, 0.9, 0.6)])
def test_identification_finds_delay_lag_and_mass_from_any_start(starts, monkeypatch):
    """And the gain at rest is that of the static inverse, whatever the record lacks of it."""
    monkeypatch.setattr(mpc_gains, '_STARTS', starts)
    model = model_of_lag_and_mass()
    random = np.random.default_rng(0)
    command = np.repeat(random.uniform(-4e4, 4e4, 60), 60)
    moved = 0.014 + 0.8 * (model.simulate(command) - 0.014)
    _, slope = mpc_gains.equivalent_pa(INVERSE, 4e5, 0.014)
    found = mpc_gains.identify_lag_and_mass(command, moved, RATE_HZ, slope)
    assert found.delay_ticks == model.delay_ticks and found.fit > 0.9999
    assert found.denominator == pytest.approx(model.denominator, rel=1e-4)
    assert found.numerator == pytest.approx(model.numerator, rel=1e-3)
    assert found.gain_m_per_pa == pytest.approx(1.0 / slope)


def test_text_and_mistakes():
    model = model_of_lag_and_mass()
    controller = MpcController(model, INVERSE, {'change_weight': 0.02})
    again = load_controller(controller_to_yaml(controller))
    assert again.settings == controller.settings and again.model == model
    assert np.array_equal(again.gains, controller.gains)
    assert load_controller(controller_to_yaml(ilc())).settings == ilc().settings
    with pytest.raises(InputError, match='runs at 100 Hz'):
        MpcController(model, INVERSE, {'rate_hz': 100.0})
    with pytest.raises(InputError, match='a ilc controller has no `mode: force`'):
        load_controller('controller: ilc\nmode: force\n', load_rig('dmsp_5_300_isometric'))
    with pytest.raises(InputError, match='must bring its `model`'):
        load_controller(controller_to_yaml(controller).split('model:')[0])


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_the_presets_track_the_rig(valve):
    """Both better than the PID with inverse of the same search, the ILC once it has learned."""
    rig = load_rig('dmsp_5_300_realistic', valve=valve)
    loop = ClosedLoop(rig, load_experiment('tuning_one_hz'), seed=3)
    errors = {name: 1e3 * loop.run(load_controller(name, rig)).cycle_rmse_m()[-1]
              for name in (f'ilc_{valve}', f'mpc_{valve}', 'pid' if valve == 'ppr' else 'pid_hsv')}
    *both, pid = errors.values()
    assert both[0] < 0.3 * pid and both[1] < 1.2 * pid
