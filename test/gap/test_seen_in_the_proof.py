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

"""What only the motion of the proof shows is searched in that recording as well."""

from gap_runs import assert_form, nominal, recorded, voltages
import numpy as np
from pam_sim import load_rig
from pam_sim.gap import find_gap
from pam_sim.gap.workflow import PROOF_ALONE, PROOF_SEARCHED
import pytest

SECONDS = 24.0
GIVEN = load_rig('dmsp_5_300_hanging_mass', valve='hsv')
LEAKING = GIVEN.with_(effects=[
    {'name': 'leakage', 'parameters': {'conductance_m3_per_s_pa': 3e-14}}])


def swaying():
    """Return duties under which air always flows, so that a small leak cannot be seen."""
    t = np.arange(int(SECONDS * 1000)) * 1e-3
    duty = 0.22 * np.sin(np.pi * t) + 0.1 * np.sin(2.6 * np.pi * t + 1.0)
    return np.column_stack([np.clip(duty, 0.0, 1.0), np.clip(-duty, 0.0, 1.0)])


def holding():
    """Return duties of few pulses, after which the muscle is shut for seconds."""
    duties = np.zeros((int(SECONDS * 1000), 2))
    duties[500:620, 0], duties[8000:8050, 1], duties[14_000:14_080, 0] = 0.8, 0.8, 0.6
    return duties


@pytest.fixture(scope='module')
def leaking():
    return (recorded(LEAKING, swaying(), 100, seed=1), recorded(LEAKING, holding(), 100, seed=2))


def test_an_effect_that_the_searched_motion_hides_is_found_in_that_of_the_proof(leaking):
    moving, held = leaking
    names = ['leakage', 'dead_volume']
    assert find_gap(moving, GIVEN, effects=names).verdict == 'no_gap'
    result = find_gap(moving, GIVEN, held, effects=names)
    assert_form(result)
    assert (result.verdict, result.ambiguity_set) == ('effects', ['leakage'])
    assert result.remarks[0] == PROOF_SEARCHED
    leak = result.effects[0]['parameters']['conductance_m3_per_s_pa']
    assert leak['value'] == pytest.approx(3e-14, rel=0.05)
    assert leak['ci95'][0] < 3e-14 < leak['ci95'][1]


def test_what_no_name_explains_there_stays_unknown(leaking):
    moving, held = leaking
    result = find_gap(moving, GIVEN, held, effects=['dead_volume'], unnamed=())
    assert (result.verdict, result.effects) == ('unknown', [])
    assert PROOF_SEARCHED not in result.remarks


def test_a_proof_of_another_rig_is_asked_after():
    rigs = nominal(), nominal().with_(parameters={'mass_kg': 6.5})
    runs = [recorded(rig, voltages(12.0, seed), seed=seed) for seed, rig in enumerate(rigs)]
    result = find_gap(runs[0], nominal(), runs[1], effects=['coulomb_friction'], unnamed=())
    assert_form(result)
    assert result.verdict == 'unknown' and result.remarks[0] == PROOF_ALONE
    # What the searched recording shows as well is no question of the proof.
    stiff = nominal().with_(effects=[{'name': 'coulomb_friction', 'parameters': {'force_n': 3.0}}])
    result = find_gap(*(recorded(stiff, voltages(12.0), seed=1), nominal(), recorded(
        stiff, voltages(12.0, 4), seed=2)), effects=['dead_volume', 'creep'], unnamed=())
    assert result.verdict == 'unknown' and PROOF_ALONE not in result.remarks


def test_a_number_that_the_searched_motion_hardly_tells_is_found_in_that_of_the_proof():
    damped = nominal().with_(effects=[
        {'name': 'viscous_damping', 'parameters': {'damping_n_s_per_m': 15.0}}])
    t = np.arange(int(SECONDS * 1000)) * 1e-3
    slow = recorded(damped, 3.4 - 0.4 * np.cos(np.pi * t / 6.0), seed=1)
    quick = recorded(damped, voltages(SECONDS), seed=2)
    result = find_gap(slow, nominal(), quick, effects=['coulomb_friction'], unnamed=())
    assert (result.verdict, result.ambiguity_set) == ('parameter', ['damping_n_s_per_m'])
    assert result.parameters[0].value == pytest.approx(40.0, rel=0.02)
    assert result.remarks[0] == PROOF_SEARCHED
