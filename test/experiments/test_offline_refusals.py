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

"""What a simulated experiment refuses, before it writes anything."""

import math

from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_sim import load_rig
from pam_sim.errors import InputError
import pytest


@pytest.fixture(scope='module')
def whole():
    """Return (experiment, rig, controller) that go together."""
    rig = load_rig('dmsp_5_300_realistic')
    return load_experiment('short_sine'), rig, load_controller('pid', rig)


@pytest.mark.parametrize('place, other, words', [
    (0, 'short_sine', "experiment: is 'short_sine'; give what `load_experiment(NAME)` returns"),
    (1, 'dmsp_5_300', "rig: is 'dmsp_5_300'; give what `load_rig(NAME)` returns"),
    (2, 'pid', "controller: is 'pid'; give what `load_controller(NAME, rig)` returns"),
])
def test_names_are_no_parts(whole, place, other, words, tmp_path):
    parts = list(whole)
    parts[place] = other
    with pytest.raises(InputError) as caught:
        simulate_experiment(*parts, tmp_path / 'bag')
    assert str(caught.value) == words and not any(tmp_path.iterdir())


@pytest.mark.parametrize('change, words', [
    ({'valve': 'hsv'}, 'controller: the controller was loaded for valve ppr, the rig has hsv'),
    ({'load': 'isometric'}, 'asks for a contraction; the load `isometric` of'),
])
def test_a_controller_of_another_rig_is_refused(whole, change, words, tmp_path):
    experiment, rig, controller = whole
    with pytest.raises(InputError) as caught:
        simulate_experiment(experiment, rig.with_(**change), controller, tmp_path / 'bag')
    assert words in str(caught.value) and not any(tmp_path.iterdir())


@pytest.mark.parametrize('more, words', [
    ({'seed': 'x'}, "seed: is 'x'; a whole number"),
    ({'seed': -1}, 'seed: is -1'),
    ({'preview_s': -1.0}, 'preview_s: is -1 s; allowed is 0 or more'),
    ({'preview_s': math.nan}, 'preview_s: is nan s'),
    ({'transport_ns': -5}, 'transport_ns: is -5 ns; allowed is 0 or more'),
    ({'ticks': {'drive': [1]}}, 'ticks: has `drive`; allowed: plant, reference, controller, driv'),
])
def test_times_and_loops_that_cannot_be_are_refused(whole, more, words, tmp_path):
    with pytest.raises(InputError) as caught:
        simulate_experiment(*whole, tmp_path / 'bag', **more)
    assert str(caught.value).startswith(words) and not any(tmp_path.iterdir())
