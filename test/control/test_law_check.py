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

"""A law that estimates or commands what is impossible vents the muscle, and says so."""

import math

import numpy as np
from pam_actuation.control.law_check import LawCheck
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.control.static_inverse import inverse_pressure_pa
from pam_actuation.messages import Contraction, Pressure, Reference, START_NS
from pam_sim import load_rig
from pam_sim.units import P_ATM_PA
import pytest
from straight_rig import sofc
from test_ilc_mpc import INVERSE, model_of_lag_and_mass, Muscle
from test_observer import mpc

TICK_NS = 5_000_000
SAYS = 'the controller estimated or commanded what is impossible, asks for the atmosphere'


def ticks(loop, muscle, count, begin=0):
    """Run a loop on a muscle; return its commands [Pa] and what it said."""
    commands, said = [], []
    for k in range(begin, begin + count):
        now_ns = START_NS + k * TICK_NS
        loop.take('contraction', Contraction(now_ns, muscle.contraction_m))
        loop.take('pressure', Pressure(now_ns, inverse_pressure_pa(INVERSE, 0.014)))
        loop.take('reference', Reference(now_ns, 0.016, 0.0))
        (command,), _ = loop.tick(now_ns)
        muscle.step(command.pressure_pa)
        muscle.contraction_m = min(max(muscle.contraction_m, 0.0), 0.03)
        commands.append(command.pressure_pa)
        said.append(loop.reason)
    return np.array(commands), np.array(said)


@pytest.mark.parametrize('gain', [30.0, math.nan], ids=['diverges', 'not finite'])
def test_an_estimate_that_is_lost_vents_for_two_seconds_and_starts_again(gain):
    controller = mpc()
    loop, muscle = ControllerLoop(controller), Muscle(model_of_lag_and_mass())
    _, said = ticks(loop, muscle, 100)
    assert set(said) == {'ok'}
    right = controller.observer.copy()
    controller.observer[:] = gain
    commands, said = ticks(loop, muscle, 100, 100)
    lost = int(np.argmax(said == SAYS))
    assert 0 < lost < 60 and set(said[lost:]) == {SAYS}
    assert np.all(np.isfinite(commands)) and np.all(commands[lost:] == P_ATM_PA)
    assert not loop.valid
    controller.observer[:] = right
    commands, said = ticks(loop, muscle, 1000, 200)
    assert np.flatnonzero(said == 'ok')[0] == 400 - (100 - lost)     # 2 s after it was noticed
    assert commands[-1] == pytest.approx(inverse_pressure_pa(INVERSE, 0.016), rel=1e-3)


def test_a_command_that_is_not_finite_is_never_sent(monkeypatch):
    controller = sofc()
    loop, muscle = ControllerLoop(controller), Muscle(model_of_lag_and_mass())
    ticks(loop, muscle, 50)
    step = controller._step

    def broken(*arguments):
        step(*arguments)
        controller._outputs[controller.state_names.index('command_pa')] = math.nan
        return math.nan

    monkeypatch.setattr(controller, '_step', broken)
    commands, said = ticks(loop, muscle, 3, 50)
    assert commands.tolist() == [P_ATM_PA] * 3
    assert said.tolist() == ['ok', SAYS, SAYS]


def test_the_bound_of_the_estimate_lies_beyond_the_stroke_of_a_long_muscle():
    rig = load_rig('muscle: {like: dmsp_20_300, length_m: 1.0}\nload: hanging_mass\nvalve: ppr\n')
    stroke_m = rig.muscle.stroke_m
    assert stroke_m > 0.2
    check = ControllerLoop(mpc(), rig)._law_check
    at = ControllerLoop(mpc())._core.names.index('estimated_contraction_m')

    def failed(estimate_m):
        check.forget()
        return check.failed(0, (0.0,) * at + (estimate_m,) + (0.0,) * 99)

    assert not failed(stroke_m) and not failed(stroke_m + 0.099)
    assert failed(stroke_m + 0.101) and failed(-0.101) and failed(math.nan)


def test_a_forgotten_failure_is_over():
    check = LawCheck(('tick', 'command_pa', 'estimated_contraction_m'))
    assert not check.failed(0, (0.0, 2e5, 0.03))
    assert check.failed(1, (0.0, 2e5, 0.21)) and check.failed(2, (0.0, 2e5, 0.03))
    check.forget()
    assert not check.failed(3, (0.0, 2e5, 0.03))
    assert not LawCheck(('tick',)).failed(0, (math.nan,))
