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

"""Forces worked out by hand from the equations as printed are those of the simulator."""

import math
import re

import numpy as np
from pam_sim import load_rig
from pam_sim.effects.registry import all_effects
from pam_sim.muscle.registry import make_law
from pam_sim.units import P_ATM_PA
import pytest

VOLTS = 4.0
# To and fro with strokes that grow, from 10 mm; an inner cycle that does not close.
TRAVEL_M = np.interp(np.arange(801), [0, 150, 300, 420, 500, 800],
                     [10e-3, 12e-3, 9.2e-3, 10.5e-3, 9.8e-3, 14e-3])


def numbers_behind(text, symbol):
    """Return the numbers of ``SYMBOL = 1, 2, 3`` in an equation."""
    listed = re.search(rf'\b{symbol} = ([\d.]+(?:, [\d.]+)*)', text)[1]
    return [float(one) for one in listed.split(', ')]


def driven(effects, signal, contraction_m):
    """Return the force [N] of a driven muscle without damping."""
    rig = load_rig('dmsp_5_300_driven').with_(
        parameters={'damping_n_s_per_m': 0.0}, effects=effects)
    return rig.simulate(signal, contraction_m=contraction_m,
                        initial_pressure_pa=P_ATM_PA + 1e5 * signal[0],
                        initial_contraction_m=contraction_m[0])


def lost(name, **parameters):
    """Return by how much an effect lowers the force along the travel [N]."""
    signal = np.full(len(TRAVEL_M) - 1, VOLTS)
    effect = {'name': name, 'parameters': {'force_n': 2.0, 'force_per_pa': 0.0, **parameters}}
    return driven([], signal, TRAVEL_M).force_n - driven([effect], signal, TRAVEL_M).force_n


def test_maxwell_slip():
    text = all_effects()['hysteresis'].equation
    widths, weights = numbers_behind(text, 'W_j'), numbers_behind(text, 'w_j')
    assert len(widths) == len(weights) == 4
    z, wanted = np.zeros(4), [0.0]
    for step in np.diff(TRAVEL_M):
        z = np.clip(z + step / (1e-3 * np.array(widths) * 1.5), -1.0, 1.0)
        wanted.append(2.0 * np.dot(weights, z))
    assert lost('hysteresis', width_scale=1.5) == pytest.approx(wanted, abs=1e-9)


def test_plays_on_the_pressure():
    text = all_effects()['hysteresis_prandtl_ishlinskii'].equation
    ratios, weight = np.array(numbers_behind(text, 'rho_j')), numbers_behind(text, 'w_j')[0]
    signal = np.interp(np.arange(600), [0, 200, 400, 599], [3.0, 5.0, 2.5, 4.0])
    held_m = np.full(len(signal) + 1, 8e-3)
    effect = {'name': 'hysteresis_prandtl_ishlinskii',
              'parameters': {'half_width_pa': 4e3, 'half_width_per_pa': 0.01}}
    response = driven([effect], signal, held_m)
    law, play, wanted = make_law('sarosi'), np.full(4, 3e5), []
    for gauge in response.true_pressure_pa - P_ATM_PA:
        half = ratios * (4e3 + 0.01 * gauge)
        play = np.clip(play, gauge - half, gauge + half)
        behind = gauge + weight * np.sum(play - gauge)
        wanted.append(float(law.force_n(behind, 8e-3 / 0.3)))
    assert response.force_n == pytest.approx(wanted, abs=0.02)
    assert np.ptp(response.force_n) > 20.0


def test_memory_of_turns():
    assert 'h = sgn(dx) (1 - exp(-|x - x_0| / W))' in all_effects()['history_friction'].equation
    width = 0.75e-3
    found = lost('history_friction', width_m=width, dry_share=0.0)[:301]
    first = 1.0 - np.exp(-(TRAVEL_M[:151] - 10e-3) / width)
    back = first[-1] - 2.0 * (1.0 - np.exp(-(12e-3 - TRAVEL_M[151:301]) / (2.0 * width)))
    # Down to the mirror image of the first turn at the start, where the cycle closes.
    inside = np.r_[np.full(151, True), TRAVEL_M[151:301] > 8e-3]
    wanted = 2.0 * np.r_[first, back]
    assert found[inside] == pytest.approx(wanted[inside], abs=1e-9)


def test_contraction_amplified_beyond_all_stroke():
    law = make_law('tondu_lopez', muscle='dmsp_5')
    assert 'max(0, 1 - k eps)^2' in law.FORMULA
    value, gauge = law.values, 50e3
    k = value['k0'] + value['k_rise'] * math.exp(-gauge / value['k_pressure_pa'])
    for strain in (0.0, 0.02, 0.25):
        wanted = gauge * 0.25 * math.pi * value['diameter_m'] ** 2 * (
            3.0 * max(0.0, 1.0 - k * strain) ** 2 / math.tan(value['braid_angle_rad']) ** 2
            - 1.0 / math.sin(value['braid_angle_rad']) ** 2)
        assert law.force_n(gauge, strain) == pytest.approx(max(wanted, 0.0), rel=1e-12)
    assert k * strain > 1.0 and wanted < 0.0
