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

"""A muscle whose ends are held: the force tells of it, at a contraction that is an input."""

from gap_runs import assert_form, nominal, recorded, voltages
import numpy as np
from pam_actuation.experiments import protocols
from pam_actuation.experiments.protocols import sensitivities
from pam_actuation.report.gap import free_run_overlay
from pam_actuation.report.sections.gap import gap_section
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.gap import find_gap
from pam_sim.gap.data.checked import recording_of
from pam_sim.gap.data.given_motion import hardly_moves
from pam_sim.gap.data.health import check_for
from pam_sim.gap.plan.outlook import outlooks
from pam_sim.gap.report.fingerprint import conditions_of
from pam_sim.tolerance import UNKNOWN
import pytest

LENGTH_M = 0.01
WITHOUT_LENGTH = ('pressure', 'force')
LOOP = {'name': 'hysteresis_prandtl_ishlinskii', 'parameters': {
    'half_width_pa': 4e3, 'half_width_per_pa': 0.03}}


def held(**changes):
    """Return the nominal isometric rig at 10 mm, with changes."""
    return load_rig('dmsp_5_300_isometric').with_(
        parameters={'contraction_m': LENGTH_M}, **changes)


def test_a_held_muscle_is_judged_and_a_free_one_that_stands_still_is_not():
    run = recorded(held(), voltages(6.0))
    for rig in (held(), held().with_(load='driven')):
        assert check_for(run, rig).problems == []
    told, = check_for(run, nominal()).problems
    assert told.startswith('the contraction hardly moves')
    # A pressure that stands still tells nothing of either.
    still = recorded(held(), np.full(6000, 4.0), initial_pressure_pa=501_325.0)
    told, = check_for(still, held()).problems
    assert told.startswith('the pressure hardly moves')


def test_the_model_states_the_length_that_was_not_recorded():
    run, rig = recorded(held(), voltages(6.0), topics=WITHOUT_LENGTH), held()
    health = check_for(run, rig)
    assert health.problems == [] and health.remarks == [
        'the recording has no contraction; by the model, the muscle is held at 10 mm']
    assert recording_of(run, rig).given_contraction_m == pytest.approx(LENGTH_M)
    unknown = held(tolerance={'contraction_m': UNKNOWN})
    for other in (held().with_(load='driven'), unknown, nominal()):
        assert 'the recording has no contraction' in check_for(run, other).problems


def test_the_isometric_preset_has_no_gap_to_its_own_recording():
    rig = load_rig('dmsp_5_300_isometric_realistic')
    run = recorded(rig, voltages(12.0))
    result = find_gap(run, rig, effects=['threshold_pressure', 'leakage'])
    assert_form(result)
    assert result.verdict == 'no_gap', result.reason
    assert set(result.signals) == {'pressure', 'force'} and set(result.subsystems) == {
        'valve', 'muscle'}


@pytest.mark.parametrize('topics', [('pressure', 'contraction', 'force'), WITHOUT_LENGTH])
def test_an_effect_hidden_in_a_held_muscle_is_named(topics):
    run = recorded(held(effects=[LOOP]), voltages(16.0), topics=topics)
    result = find_gap(run, held(), effects=['hysteresis', 'threshold_pressure', 'force_gain'])
    assert_form(result)
    assert [effect['name'] for effect in result.effects] == ['hysteresis'], result.reason
    assert result.signals['force'].shrink_percent > 90.0
    # The force errs with the way of the pressure, for nothing else moves.
    assert result.fingerprint['muscle']['rms'] > 4.0 * result.fingerprint['muscle']['rms_left']
    assert 'What the gap depends on' in gap_section(result).body


def test_of_a_held_muscle_the_pressure_is_the_motion():
    recording = recording_of(recorded(held(), voltages(8.0)), held())
    assert hardly_moves(recording.given_contraction_m)
    assert np.ptp(recording.given_contraction_m) == 0.0
    found = conditions_of(recording, 'muscle', recording.time_s['force'])
    assert found['direction'].tolist() == conditions_of(
        recording, 'valve', recording.time_s['force'])['direction'].tolist()
    assert np.mean(found['motion'] != 0) > 0.5


def test_a_page_shows_the_model_against_a_held_recording():
    run = recorded(held(), voltages(8.0), topics=WITHOUT_LENGTH)
    assert {one.signal for one in free_run_overlay(run, held())} == {'pressure', 'force'}


def test_a_protocol_can_be_planned_for_a_held_muscle():
    piece = {'name': 'short', 'domain': 'pressure', 'segments': [
        {'rest': {'duration_s': 1.0}}, *protocols.pieces('ppr')['quick']]}
    rig = load_rig('dmsp_5_300_isometric_realistic')
    found = sensitivities(piece, rig, only=['threshold_pressure', 'coulomb_friction'])
    assert set(found.signals) == {'pressure', 'force'}
    seen = {one.name: one for one in outlooks(found)}
    # The noise of the contraction is no motion that would turn the friction.
    assert seen['threshold_pressure'].visible and not seen['coulomb_friction'].visible


def test_where_no_piece_can_be_used_the_plan_tells_why(monkeypatch):
    def refuse(*given):
        raise InputError('nothing can be read from it: too short', 'planned')

    monkeypatch.setattr(protocols, 'sensitivities', refuse)
    with pytest.raises(InputError, match='can do none of the candidate protocols; of the last '
                       'one: planned: nothing can be read from it: too short'):
        protocols.plan(held())
