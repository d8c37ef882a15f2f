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
"""The table of pressures over contractions reaches as far as the muscle does."""

import math

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.static_inverse import (
    GRID_SIZE, inverse_pressure_pa, static_inverse, tabulate_static_inverse)
from pam_actuation.experiments import load_experiment
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_sim import load_rig
from pam_sim.compiled import interpreted
from pam_sim.units import P_ATM_PA
import pytest


@pytest.mark.parametrize('name', ['dmsp_5_300_realistic', 'dmsp_20_300_hanging_mass'])
def test_it_holds_what_the_rig_says_up_to_1_mpa(name):
    rig = load_rig(name)
    table = tabulate_static_inverse(rig)
    reach_m = float(rig.static_contraction_m(P_ATM_PA + 1e6))
    assert reach_m > 0.05
    x = np.linspace(0.0, reach_m - 3e-4, 57)
    found = np.array([inverse_pressure_pa(table, one) for one in x])
    assert found == pytest.approx(rig.static_pressure_pa(x), rel=2e-3)
    assert table[-1] <= P_ATM_PA + 1e6


def test_the_first_35_mm_are_the_nodes_of_older_recordings():
    rig = load_rig('dmsp_5_300_realistic')
    table = tabulate_static_inverse(rig)
    nodes_m = np.linspace(0.0, 0.035, 141)
    assert table[:GRID_SIZE].tolist() == [0.0, 0.035 / 140]
    assert np.array_equal(table[GRID_SIZE:][:140], rig.static_pressure_pa(nodes_m[:140]))
    weak = tabulate_static_inverse(rig.with_(parameters={'mass_kg': 60.0}))
    assert weak.size == GRID_SIZE + 141 and np.isfinite(weak).all()


def test_a_contraction_that_is_not_known_has_no_pressure():
    table = static_inverse(0.0, 0.01, [1e5, 2e5, 3e5])
    of = interpreted(inverse_pressure_pa)       # compiled, no place of a table is checked
    assert of(table, 0.015) == inverse_pressure_pa(table, 0.015) == 2.5e5
    assert math.isnan(of(table, math.nan)) and math.isnan(inverse_pressure_pa(table, math.nan))


def test_a_long_muscle_is_held_at_40_mm():
    rig = load_rig('dmsp_20_300_hanging_mass')
    hold = load_experiment("""
name: hold
segments:
  - ramp: {to_m: 0.040, duration_s: 3.0}
  - hold: {duration_s: 4.0}
""")
    run = ClosedLoop(rig, hold, seed=1).run(load_controller('sofc_ppr', rig))
    assert run.rmse_m(5.0, 6.0) < 2e-5


@pytest.mark.parametrize('name', ['pid', 'sofc_ppr', 'mpc_ppr'])
def test_a_preset_knows_its_rig_and_a_written_file_the_one_before(name):
    """What the reference says of files of a controller: how to compare designs on another rig."""
    nominal = load_rig('dmsp_5_300_realistic')
    heavy = nominal.with_(parameters={'mass_kg': 6.5})
    written = load_controller(name, nominal).to_yaml()
    at_rest_pa = [float(inverse_pressure_pa(load_controller(one, rig).static_inverse, 0.0))
                  for one, rig in ((name, nominal), (name, heavy), (written, heavy))]
    assert at_rest_pa[2] == at_rest_pa[0] < at_rest_pa[1] - 5e4
