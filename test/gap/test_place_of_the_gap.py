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

"""The first row of ``where``: the subsystem in which the disagreement lives after calibration."""

from dataclasses import replace
from types import SimpleNamespace

from gap_runs import nominal, recorded, voltages
import numpy as np
from pam_actuation.report.sections.gap import gap_section
from pam_actuation.report.sections.gap_witness import witness_part
from pam_sim.gap import find_gap
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.means import behind
from pam_sim.gap.data.recording import GRID_S, Recording
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.report.by_subsystem import add_place
from pam_sim.gap.report.encoder import sensor_part
from pam_sim.gap.report.location import force_errors, ForceErrors
from pam_sim.gap.report.place import Evidence, first_place
from pam_sim.gap.result import GapResult, SignalGap, SubsystemVerdict
from pam_sim.gap.select.candidates import candidates
from pam_sim.gap.select.rival import NamedEffect, Rival
from pam_sim.gap.select.screening import Screened
from pam_sim.gap.share import Share
from pam_sim.gap.subsystems.simulation import pressure_driven, simulate_driven
import pytest

QUIET = SignalGap('Pa', 300.0, 310.0, 290.0, 290.0)
WIDE = SignalGap('Pa', 300.0, 9e3, 7e3, 7e3)
MUSCLE = {'contraction': SignalGap('m', 2e-5, 6e-4, 4e-4, 4e-4),
          'force': SignalGap('N', 0.1, 1.0, 0.11, 0.1)}
STILL = {'contraction': SignalGap('m', 2e-5, 2e-5, 2e-5, 2e-5)}
CELL = ForceErrors(0.5, 0.4, 0.01)


def test_a_page_has_no_table_without_rows():
    first, row = (Share('valve', 'pressure', 'all', 1.0, sure) for sure in (0.9, None))
    heading = 'Where the gap of the whole chain sits'
    result = GapResult('unknown', '', where=[first, row])
    assert heading in gap_section(result).body
    result.where.pop()
    body = gap_section(result).body
    assert heading not in body and first.text() in body


@pytest.fixture(scope='module')
def run():
    return recorded(nominal(), voltages(6.0))


@pytest.fixture(scope='module')
def pool():
    return {c.effect: c for c in candidates(nominal(), ('pressure', 'contraction', 'force'))}


def place(run, verdict, valve=QUIET, muscle=MUSCLE, named=(), screened=(), forces=None,
          errors=None, encoder=None):
    """Return the first row of a result with these gaps."""
    gaps = {'valve': {'pressure': valve}, 'muscle': muscle}
    recording = Recording(run, 'ppr')
    time_s = recording.time_s['contraction']
    result = GapResult(verdict, '', subsystems={
        s: SubsystemVerdict('unknown' if any(
            g.rmse_after > 2.0 * g.noise_floor for g in one.values()) else 'no_gap', (), '', QUIET,
            0.0) for s, one in gaps.items()})
    return first_place(result, named, Evidence(
        recording, SimpleNamespace(gaps=gaps, residual=lambda problem, signal: (
            time_s, 7e3 * np.ones(time_s.size) if errors is None else errors(time_s))),
        screened, forces, encoder, lambda w: {}, CRITERIA))


def found_as(name, pool, others=()):
    """Return what is named, with rivals that are behind by t."""
    fit = Fit(Hypothesis((pool[name],)), np.zeros(0), {}, {}, {})
    rivals = [Rival(name, fit, {'muscle': 0.99}, {'muscle': 0.0})]
    rivals += [Rival(o, fit, {'muscle': 0.9}, {'muscle': t}) for o, t in others]
    return NamedEffect(name, 'muscle', rivals, (name,))


def test_nothing_lives_anywhere_without_a_gap(run):
    assert place(run, 'no_gap', muscle=STILL) is None


def test_what_is_unknown_lives_where_its_own_run_errs(run):
    found = place(run, 'unknown', WIDE, STILL)
    assert (found.subsystem, found.signal, found.certainty) == ('valve', 'pressure', 1.0)
    found = place(run, 'unknown')
    assert (found.subsystem, found.signal) == ('muscle', 'contraction')
    assert found.certainty == 0.5              # no load cell tells it from the load
    for muscle, load, where in ((0.5, 0.02, 'muscle'), (0.02, 0.5, 'load')):
        found = place(run, 'unknown', forces=ForceErrors(muscle, load, 0.52))
        assert found.subsystem == where and found.certainty > 0.9 and found.share_of_gap > 0.9


def test_a_sensor_is_a_place_of_its_own(run, pool):
    lag, creep = (Screened(pool[name], (), {'muscle': promise}) for name, promise in (
        ('contraction_lag', 0.97), ('creep', 0.6)))
    found = place(run, 'unknown', screened=(creep, lag))
    assert (found.subsystem, found.signal) == ('sensor', 'contraction')
    assert place(run, 'unknown', screened=(creep,)).subsystem == 'muscle'
    found = place(run, 'unknown', forces=ForceErrors(0.5, 0.02, 0.5), encoder=0.9)
    assert (found.subsystem, found.signal, found.certainty) == ('sensor', 'contraction', 0.9)
    found = place(run, 'unknown', forces=CELL)
    assert (found.subsystem, found.signal) == ('sensor', 'force')


def test_a_name_and_the_place_agree(run, pool):
    explained = {'contraction': SignalGap('m', 2e-5, 6e-4, 4e-4, 2e-5)}
    for name, subsystem, signal in (
            ('creep', 'muscle', 'contraction'), ('guide_friction', 'load', 'contraction'),
            ('contraction_lag', 'sensor', 'contraction'), ('force_bias', 'sensor', 'force')):
        found = place(run, 'effects', muscle=explained, named=[found_as(name, pool)], forces=CELL)
        assert (found.subsystem, found.signal) == (subsystem, signal)
        assert found.share_of_gap == 1.0 and found.certainty == 1.0
    # A rival of another subsystem that is hardly behind makes it less sure, one of the same not.
    near = [found_as('creep', pool, [(other, 2.0)]) for other in ('hysteresis', 'guide_friction')]
    same, apart = (place(run, 'effects', muscle=explained, named=[w]) for w in near)
    assert same.certainty == 1.0 and 0.8 < apart.certainty < 0.9


def test_a_condition_is_told_where_it_holds_most_of_the_gap(run):
    def late(time_s):
        return np.where(time_s > 4.1, 4e-4, 0.0)

    found = place(run, 'unknown', errors=late)
    assert found.condition == 'in the last third' and found.share_of_gap > 0.9
    assert Share('muscle', 'force', '380 to 470 kPa', 0.5).text().endswith(
        ': 50 % of the squared gap in force, at 380 to 470 kPa, '
        'each subsystem on its own measured inputs.')
    assert place(run, 'unknown').condition == 'all'
    assert 'of the squared gap in contraction, in the last third, each' in found.text()


def test_the_balance_of_forces_tells_muscle_from_load(run):
    rig = nominal()
    recording = Recording(run, 'ppr')
    noise = force_errors(rig, recording)
    rubbing = force_errors(rig.with_(effects=[
        {'name': 'coulomb_friction', 'parameters': {'force_n': 2.0}}]), recording)
    assert rubbing.muscle_part > 0.9 and rubbing.muscle > 1.0 > 100.0 * noise.muscle


def test_an_encoder_that_creeps_is_told_from_a_muscle_that_does():
    rig = nominal()
    recording = Recording(recorded(rig, voltages(20.0)), 'ppr')
    time_s, x = recording.time_s['contraction'], recording.measured['contraction']
    grid = np.interp(recording.grid_s, time_s, x)
    late = np.interp(time_s, recording.grid_s, grid - behind(grid, 3.0, GRID_S))
    k = pressure_driven(rig)
    stiffness = (simulate_driven(k, recording, grid).force_n - simulate_driven(
        k, recording, grid + 1e-4).force_n) / 1e-4
    noise = 1e-5 * np.random.default_rng(1).standard_normal(x.size)
    sensor, muscle = 0.02 * late, 60.0 * late / np.interp(time_s, recording.grid_s, stiffness)
    told = [sensor_part(rig, recording, time_s, e + noise, CRITERIA)
            for e in (sensor, muscle, 0.0 * late)]
    assert told[0] > 0.9 and told[1:] == [None, None]


def test_an_unknown_load_is_told_of_by_subsystem():
    unknown = SubsystemVerdict('unknown', (), 'contraction', WIDE, 1.0)
    result = GapResult('unknown', '', where=[Share('load', 'contraction', 'all', 1.0, 0.9)],
                       subsystems={'valve': unknown, 'muscle': unknown})
    add_place(result)
    assert list(result.subsystems) == ['valve', 'muscle', 'load']


@pytest.mark.parametrize('signal, of', [('contraction', 'muscle'), ('pressure', 'valve'),
                                        ('force', 'muscle')])
def test_what_a_sensor_leaves_is_in_its_own_signal(signal, of):
    told = {'valve': SubsystemVerdict('unknown', (), 'pressure', WIDE, 1.0),
            'muscle': SubsystemVerdict('unknown', (), 'contraction', MUSCLE['contraction'], 1.0)}
    result = GapResult('unknown', 'Why.', where=[Share('sensor', signal, 'all', 1.0, 0.9)],
                       subsystems=told)
    add_place(result)
    assert result.subsystems['sensor'] is told[of]
    # The same gap is not told twice as if it were two.
    assert f'  sensor: {told[of].text()}, the same as above' in result.text().split('\n')
    assert result.text().count('the same as above') == 1


def test_page_and_terminal_open_with_the_place():
    rig = nominal().with_(effects=[
        {'name': 'contraction_lag', 'parameters': {'time_constant_s': 0.02}}])
    result = find_gap(recorded(rig, voltages(12.0)), nominal(), effects=['contraction_lag'])
    assert [e['name'] for e in result.effects] == ['contraction_lag']
    sentence = result.where[0].text()
    assert sentence.startswith('After calibration the disagreement lives in the sensor of the '
                               'contraction (certainty 1.00): ')
    assert result.text().startswith(f'{sentence}\neffects: ')
    assert gap_section(result).body.startswith(f'<p>{sentence}</p>')
    assert {w.subsystem for w in result.where} == {'sensor'}


def test_the_first_sentence_tells_its_basis_and_what_else_is_named():
    one = SubsystemVerdict('effects', ('leakage',), 'pressure', WIDE, 0.1)
    result = GapResult('effects', '', where=[Share('muscle', 'contraction', 'all', 1.0, 1.0)],
                       subsystems={'valve': one, 'muscle': replace(one, names=('creep',))})
    assert result.place.endswith(
        'in contraction, each subsystem on its own measured inputs. '
        'Something is named in the valve as well.')
    result.subsystems.pop('valve')
    assert 'as well' not in result.place


def test_the_page_tells_the_limits_by_which_rivals_are_left_behind():
    result = GapResult('effects', '', evidence=[
        {'subsystem': 'valve', 'name': 'leakage', 'share': 0.9, 't': None}])
    body = gap_section(result).body
    assert f'From {CRITERIA.ahead_t:g} on a rival is left behind' in body
    assert f'from {CRITERIA.behind_t:g} on one that explains at least 5 points less' in body


def test_a_page_lists_no_dependence_of_what_has_no_gap():
    shares = {'pressure': 0.1, 'contraction': 0.2, 'direction': 0.3, 'rate': 0.0,
              'time since reversal': 0.0, 'constant': 0.0, 'pressure x contraction': 0.4}
    row = {'signal': 'force', 'rms': 0.5, 'rms_left': 0.5, 'explained': shares,
           'explained_left': shares}
    quiet, unknown = (SubsystemVerdict(v, (), 'force', QUIET, 1.0) for v in ('no_gap', 'unknown'))
    result = GapResult('unknown', '', subsystems={'valve': unknown, 'muscle': quiet}, fingerprint={
        'valve': {**row, 'signal': 'pressure'}, 'muscle': row, 'load': row})
    assert witness_part(result).count('<tr>') == 2
    result.subsystems['muscle'] = unknown
    assert witness_part(result).count('<tr>') == 4
