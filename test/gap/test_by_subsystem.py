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

"""One verdict per subsystem, on the certify data and on the measured inputs of each."""

from types import SimpleNamespace

from gap_runs import assert_form, nominal, recorded, voltages
import numpy as np
from pam_actuation.report.sections.gap import gap_section
from pam_sim.gap import find_gap
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.report.by_subsystem import subsystem_of, subsystem_verdicts
from pam_sim.gap.result import Calibrated, GapResult, OWN_INPUTS, SignalGap, WHOLE_CHAIN
from pam_sim.gap.select.rival import NamedEffect
import pytest

STICKY = {'name': 'valve_hysteresis', 'parameters': {'half_width_pa': 6e3}}
RUBBING = {'name': 'coulomb_friction', 'parameters': {'force_n': 1.0}}
QUIET = SignalGap('Pa', 300.0, 310.0, 290.0, 290.0)
WIDE = SignalGap('Pa', 300.0, 9e3, 7e3, 7e3)
MUSCLE = {'contraction': SignalGap('m', 2e-5, 6e-4, 4e-4, 1e-4),
          'force': SignalGap('N', 0.1, 1.0, 0.11, 0.1)}


@pytest.mark.parametrize('own_proof', [True, False])
def test_a_valve_without_a_name_takes_none_from_the_muscle(own_proof):
    rig = nominal().with_(effects=[STICKY, RUBBING])
    certify = None if own_proof else recorded(rig, voltages(12.0, seed=5), seed=8)
    result = find_gap(recorded(rig, voltages(14.0)), nominal(), certify,
                      effects=['coulomb_friction'], unnamed=())
    assert_form(result)
    # Much of the gap is of the valve, so the name in the muscle is a part of the answer.
    assert result.verdict == 'partial' and result.unexplained_fraction > 0.3
    assert result.reason.endswith(
        f'{100 * result.unexplained_fraction:.0f} % of the squared gap remain unexplained, so '
        'this is a part of the answer only.')
    valve, muscle = result.subsystems['valve'], result.subsystems['muscle']
    assert list(result.subsystems) == ['valve', 'muscle']
    assert valve.verdict == 'unknown' and valve.names == ()
    assert valve.unexplained > 2e3 and valve.unexplained_fraction > 0.9
    assert muscle.verdict == 'effects' and muscle.names == ('coulomb_friction',)
    # In the whole chain the error of the valve reaches the muscle; here it does not.
    assert muscle.unexplained_fraction < 0.05 < result.unexplained_fraction
    assert muscle.gap.rmse_after < muscle.gap.noise_floor < muscle.gap.rmse_refit
    lines = result.text().splitlines()
    assert lines[2] == OWN_INPUTS
    assert lines[3].startswith('  valve: ') and lines[3].endswith(' kPa unexplained')
    assert lines[4].startswith('  muscle: coulomb_friction, ')
    assert lines[lines.index(WHOLE_CHAIN) + 1].startswith('  pressure: noise floor ')
    page = gap_section(result).body
    assert 'By subsystem' in page and '% of the squared gap' in page


def test_a_subsystem_without_a_gap_has_none():
    result = find_gap(recorded(nominal(), voltages(12.0)), nominal(), effects=['creep'])
    assert {s: one.verdict for s, one in result.subsystems.items()} == {
        'valve': 'no_gap', 'muscle': 'no_gap'}
    assert 'valve: no gap beyond noise' in result.text()


def given(verdict, valve=QUIET, muscle=MUSCLE, effects=(), parameters=(), named=(), doubt=0.0,
          searched=0.0):
    """Return the verdicts by subsystem of such gaps and names."""
    result = GapResult(verdict, '', noise={'pressure': 300.0, 'contraction': 1e-5, 'force': 0.1},
                       effects=[{'name': name, 'subsystem': subsystem_of(name)}
                                for name in effects], parameters=list(parameters))
    gaps = {'valve': {'pressure': valve}, 'muscle': muscle}
    runs = SimpleNamespace(gaps=gaps, spread=lambda: {
        (s, signal): doubt for s, one in gaps.items() for signal in one},
        searched=lambda subsystem, signal: searched)
    return subsystem_verdicts(result, list(named), runs, CRITERIA, 1.0)


def test_every_name_stands_in_its_own_subsystem():
    mass = Calibrated('mass_kg', 'kg', 5.0, 5.75, (5.7, 5.8), 7.5)
    named = [NamedEffect('creep', 'muscle', [], ('creep', 'hysteresis'))]
    found = given('ambiguous', effects=['creep', 'contraction_bias'], parameters=[mass],
                  named=named)
    assert list(found) == ['valve', 'muscle', 'load', 'sensor']
    assert found['muscle'].verdict == 'ambiguous'
    assert found['muscle'].names == ('creep', 'hysteresis')
    assert found['muscle'].text() == 'creep or hysteresis, 0.098 mm unexplained'
    assert (found['load'].verdict, found['load'].names) == ('parameter', ('mass_kg',))
    assert found['sensor'].names == ('contraction_bias',)
    assert found['sensor'].signal == 'contraction'
    zero = Calibrated('pressure_zero_pa', 'Pa', 0.0, 9e3, (8e3, 1e4), 7.5)
    assert given('parameter', parameters=[zero])['sensor'].signal == 'pressure'
    assert subsystem_of('K_m') == 'valve'
    assert subsystem_of('force_map_gain') == 'muscle'


def test_what_is_left_is_unknown_only_beyond_the_doubt_about_numbers():
    certain = {'effects': ['creep'], 'verdict': 'effects'}
    assert given(valve=WIDE, **certain)['valve'].verdict == 'unknown'
    assert given(valve=WIDE, doubt=7e3, **certain)['valve'].verdict == 'no_gap'
    assert given(valve=WIDE, doubt=7e3, searched=310.0, **certain)['valve'].verdict == 'no_gap'
    # The numbers were free in the searched data: what stays there is not theirs.
    assert given(valve=WIDE, doubt=7e3, searched=5e3, **certain)['valve'].verdict == 'unknown'
    assert given(valve=QUIET, **certain)['valve'].verdict == 'no_gap'


def test_a_gap_of_the_whole_chain_stands_somewhere():
    quiet = {'contraction': SignalGap('m', 2e-5, 3e-5, 2e-5, 2e-5)}
    found = given('unknown', muscle=quiet)
    assert sorted(one.verdict for one in found.values()) == ['no_gap', 'unknown']
    assert np.isfinite([one.unexplained for one in found.values()]).all()
