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

"""Which past commands decide with a dead time of its own for each direction."""

import numpy as np
from pam_sim import load_rig
from pam_sim.units import P_ATM_PA
import pytest


def held_for(values, samples):
    return np.repeat(values, samples)[:1500]


RANDOM = np.random.default_rng(3)
AT = np.arange(1500)
COMMANDS = {
    'falling': 5.0 - 2e-3 * AT,
    'rising, each sample held': held_for(2.0 + 1e-2 * np.arange(300), 5),
    'falling, each sample held': held_for(5.0 - 1e-2 * np.arange(300), 5),
    'waves': 4.0 + np.sin(AT / 37.0) + 0.4 * np.sin(AT / 5.0),
    'random': RANDOM.uniform(2.0, 5.0, 6000),
    'a few values again and again': held_for(RANDOM.integers(2, 5, 500).astype(float), 3)}


def before(signal, steps):
    """Return the signal of so many steps ago, straight between two samples; 3 V before it."""
    whole = int(np.floor(steps + 1e-9))
    newer, older = (np.concatenate([np.full(n, 3.0), signal])[:signal.size]
                    for n in (whole, whole + 1))
    share = steps - whole
    return newer + share * (older - newer) if share > 1e-9 else newer


@pytest.mark.parametrize('vent_later_s', [0.040, -0.040, 0.1207, -0.1207, -0.002])
@pytest.mark.parametrize('command', COMMANDS)
def test_the_highest_or_lowest_command_between_both_delays_decides(command, vent_later_s):
    """To the bit what a search of all of them finds."""
    signal = np.concatenate([np.full(200, 3.0), COMMANDS[command]])
    first, last = sorted((0.07 + way * 0.5 * vent_later_s) / 0.001 for way in (-1.0, 1.0))
    between = [before(signal, steps) for steps in (
        first, last, *range(int(first + 1e-9) + 1, int(last + 1e-9) + 1))]
    decides = (np.max if vent_later_s > 0.0 else np.min)(between, axis=0)
    rig = load_rig('dmsp_5_300_isometric')
    late = rig.with_(effects=[{'name': 'valve_dead_time_by_direction', 'parameters': {
        'delay_s': 0.07, 'vent_later_s': vent_later_s}}])
    found, expected = (one.simulate(
        s, initial_pressure_pa=P_ATM_PA + 300e3).pressure_pa for one, s in (
            (late, signal), (rig, decides)))
    assert np.array_equal(found, expected)
