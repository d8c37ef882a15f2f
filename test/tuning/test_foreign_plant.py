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

"""A closed loop with a plant of somebody else: ours gives the same bits, a hidden one works."""

import math
from pathlib import Path
import pickle
import sys

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.experiments.experiment import load_experiment
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_actuation.tuning.foreign_plant import ForeignLoop
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.units import P_ATM_PA
import pytest
import yaml

sys.path.append(str(Path(__file__).resolve().parent.parent / 'hidden'))

import truth_realistic  # noqa: E402, I100

MOTION = load_experiment("""
name: motion
segments:
  - rest: {duration_s: 0.5}
  - ramp: {to_m: 0.012, duration_s: 1.0}
  - sine: {center_m: 0.012, amplitude_m: 0.004, frequency_hz: 0.5, cycles: 4}
""")

RANDOM_MOTION = load_experiment("""
name: random
segments:
  - rest: {duration_s: 1.0}
  - ramp: {to_m: 0.014, duration_s: 2.0}
  - multisine: {center_m: 0.014, amplitude_m: 0.008, min_hz: 0.02, max_hz: 1.0, lines: 40,
                duration_s: 40.0, seed: 77}
""")
CONTROLLERS = Path(__file__).resolve().parents[2] / 'config' / 'controllers'


def pulled_n(time_s):
    return 8.0 if time_s > 3.0 else 0.0


def falling_pa(time_s):
    return 7e5 if time_s > 4.0 else 8e5


@pytest.fixture(scope='module', params=['ppr', 'hsv'])
def rig(request):
    return load_rig('dmsp_5_300_realistic', valve=request.param)


def test_our_own_plant_gives_the_bits_of_the_compiled_loop(rig):
    more = {'seed': 2, 'external_force_n': pulled_n, 'supply_pa': falling_pa}
    controller = load_controller(f'sofc_{rig.valve}', rig)
    compiled = ClosedLoop(rig, MOTION, **more).run(controller)
    controller.reset()
    loop = pickle.loads(pickle.dumps(ForeignLoop(rig.plant, rig, MOTION, **more)))
    foreign = loop.run(controller)
    for name in ('contraction_m', 'pressure_pa', 'force_n', 'command_pa', 'signal'):
        assert np.array_equal(getattr(foreign, name), getattr(compiled, name)), name


def test_the_driver_of_a_rollout_is_told_the_supply_behind_a_reservoir():
    rig = load_rig('dmsp_5_300_realistic', valve='hsv').with_(
        effects=[{'name': 'supply_droop', 'parameters': {'reservoir_volume_m3': 2e-4}}])
    controller = load_controller('sofc_hsv', rig)
    compiled = ClosedLoop(rig, MOTION, seed=2).run(controller)
    controller.reset()
    foreign = ForeignLoop(rig.plant, rig, MOTION, seed=2).run(controller)
    assert np.array_equal(foreign.signal, compiled.signal)
    assert np.array_equal(foreign.contraction_m, compiled.contraction_m)


def test_a_hidden_rig_is_tracked_and_answers_to_load_and_supply(rig):
    controller = load_controller(f'pid{"_hsv" * (rig.valve == "hsv")}', rig)
    plant = truth_realistic.HiddenPlant(rig.valve, 5)
    plain, pulled, starved = (ForeignLoop(plant, rig, MOTION, **more).run(controller)
                              for more in ({}, {'external_force_n': lambda t: 10.0},
                                           {'supply_pa': lambda t: 3e5}))
    assert plain.rmse_m(2.0) < 1e-3
    assert pulled.pressure_pa[-400:].mean() > plain.pressure_pa[-400:].mean() + 1e4
    if rig.valve == 'hsv':        # a regulator's supply is not part of either model
        assert starved.pressure_pa.max() < 3e5 < plain.pressure_pa.max()


def test_hidden_rigs_are_off_by_up_to_30_per_cent_and_repeat(rig):
    middle = truth_realistic.realistic_numbers(rig.valve, None)
    drawn = [truth_realistic.realistic_numbers(rig.valve, seed) for seed in range(30)]
    assert drawn[3] == truth_realistic.realistic_numbers(rig.valve, 3) != drawn[4]
    assert {'dahl_travel' in numbers for numbers in drawn} == {True, False}
    name = truth_realistic.VALVE[rig.valve][0]
    for number in ('loop_400', 'delay', name):
        off = np.array([numbers[number] / middle[number] for numbers in drawn])
        assert 0.7 <= off.min() < 0.8 and 1.2 < off.max() <= 1.3


def error_mm(text, **settings):
    """Return the error [mm] from 25 s on of a preset with other settings."""
    tree = yaml.safe_load(text)
    tree['settings'].update(settings)
    named = load_rig('dmsp_5_300_realistic', valve='ppr')
    controller = load_controller(yaml.safe_dump(tree), named)
    loop = ForeignLoop(truth_realistic.HiddenPlant('ppr', 5), named, RANDOM_MOTION, seed=3)
    return 1e3 * loop.run(controller).rmse_m(25.0)


def test_the_friction_of_dahl_is_followed_better_with_sets_that_fade():
    assert 'dahl_travel' in truth_realistic.realistic_numbers('ppr', 5)
    text = (CONTROLLERS / 'sofc_model_ppr.yaml').read_text(encoding='utf-8')
    without = error_mm(text, path_sets=5, path_fading_sets=0)
    assert error_mm(text) < 0.75 * without < 0.15


class Broken:
    """A plant whose contraction is lost at once."""

    dt_s, supply_pa, pressure_pa, contraction_m, force_n = 1e-3, 8e5, P_ATM_PA, 0.0, 0.0

    def step(self, signal, external_force_n=0.0, steps=1):
        """Lose it."""
        self.contraction_m = math.nan


def test_a_plant_that_does_not_fit_is_refused(rig):
    controller = load_controller(f'sofc_{rig.valve}', rig)
    with pytest.raises(InputError, match='not finite'):
        ForeignLoop(Broken, rig, MOTION).run(controller)
    for pressure_pa in (101.325, 0.0, math.nan):
        other = type('Other', (Broken,), {'pressure_pa': pressure_pa})
        with pytest.raises(InputError, match='has pressure_pa = .*, absolute and in Pa'):
            ForeignLoop(other, rig, MOTION).run(controller)
    in_mm = type('InMillimetres', (Broken,), {
        'step': lambda self, *_, **__: setattr(self, 'contraction_m', 12.0)})
    with pytest.raises(InputError, match='has contraction_m from 0 to 12; a muscle of 0.3 m allo'):
        ForeignLoop(in_mm, rig, MOTION).run(controller)
    coarse = type('Coarse', (Broken,), {'dt_s': 2e-3})
    with pytest.raises(InputError, match='steps by 0.002 s, allowed is 0.001 s'):
        ForeignLoop(coarse, rig, MOTION).run(controller)


@pytest.mark.parametrize('name, value, sentence', [
    ('force_n', None, 'plant: has force_n = None; a number is needed'),
    ('supply_pa', 'high', "plant: has supply_pa = 'high'; a number is needed"),
    ('step', None, 'plant: has no method `step`; write `step(signal, external_force_n=0.0, *, ')])
def test_an_object_that_is_no_plant_is_refused(rig, name, value, sentence):
    kind = type('Other', (Broken,), {name: value})
    with pytest.raises(InputError) as caught:
        ForeignLoop(kind, rig, MOTION).run(load_controller('pid', rig))
    assert str(caught.value).startswith(sentence)


def test_a_plant_instead_of_what_makes_one_is_refused(rig):
    with pytest.raises(InputError, match='give what returns a plant at its start, such as `rig.p'):
        ForeignLoop(rig.plant(), rig, MOTION)
