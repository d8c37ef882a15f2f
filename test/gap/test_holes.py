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

"""Recordings with holes: what lies between is compared, what nobody measured is not."""

from gap_runs import nominal, NS, recorded, voltages
import numpy as np
from pam_sim.errors import InputError
from pam_sim.gap import find_gap
from pam_sim.gap.data.checked import by_recording, checked_runs
from pam_sim.gap.data.holes import between, holes_in, stretches
from pam_sim.gap.data.split import CERTIFY
from pam_sim.identify import identify
from pam_sim.identify.records import offers_of, problems_of
from pam_sim.run import Run, Series
import pytest

HOLE_S = 9.0, 11.5


def without(run, begin_s, end_s, topics=None):
    """Return a run in which all topics, or some, have no messages for a while."""
    begin_ns, end_ns = (int(run.start_ns + seconds * NS) for seconds in (begin_s, end_s))

    def kept(name, one):
        inside = (one.stamp_ns <= begin_ns) | (one.stamp_ns >= end_ns)
        inside |= topics is not None and name not in topics
        return Series(one.stamp_ns[inside],
                      {key: value[inside] for key, value in one.values.items()}, one.unit)
    return Run({name: kept(name, one) for name, one in run.topics.items()}, path='bag')


@pytest.fixture(scope='module')
def whole():
    return recorded(nominal(), voltages(24.0))


def test_a_run_without_a_hole_is_left_as_it_is(whole):
    assert stretches(whole, 1.0) == ([whole], '')
    # A force, or a contraction that the model gives, may be missing for a while.
    run = without(whole, *HOLE_S, topics=('force', 'contraction'))
    assert stretches(run, 1.0) == ([run], '')
    assert len(stretches(run, 1.0, driven=True)[0]) == 2


def test_the_proof_takes_blocks_of_the_first_bag_with_all_its_stretches(whole):
    other = recorded(nominal(), voltages(24.0), seed=1)
    runs = [without(whole, *HOLE_S), without(other, *HOLE_S)]
    checked = checked_runs(runs, None, nominal())
    assert (len(checked.runs), checked.certify_runs) == (4, 2)
    assert checked_runs(runs[0], other, nominal()).certify_runs == 0
    offers, _ = offers_of(runs, nominal(), [0.0] * 2, spare_certify=True)
    assert [one.holds_certify for one in offers] == [True, True, False, False]
    for problem in problems_of(nominal(), offers):
        assert set(problem.run[problem.part == CERTIFY]) == {0, 1}
    assert not any(one.holds_certify for one in offers_of(runs, nominal(), [0.0] * 2)[0])


def test_stretches_come_longest_first_and_are_told(whole):
    parts, text = stretches(without(whole, *HOLE_S), 1.0)
    assert [round(part.duration_s, 1) for part in parts] == [12.5, 9.0]
    assert text == ('bag: no pressure for 2.5 s from 9.0 s on; the stretches without a hole count '
                    'as 2 recordings')
    assert parts[0].path == 'bag, 11.5 to 24.0 s'
    run = without(without(whole, *HOLE_S), 12.0, 13.0)
    parts, text = stretches(run, 1.0)
    assert len(parts) == 2
    assert '2 holes in the pressure, the longest of 2.5 s at 9.0 s' in text
    assert text.endswith('count as 2 recordings, without those of less than 1 s')


def test_a_hole_within_another_leaves_no_stretch_inside(whole):
    run = without(whole, 5.0, 15.0, topics=('pressure',))
    for begin_s, end_s in ((6.0, 7.0), (10.0, 11.0)):
        run = without(run, begin_s, end_s, topics=('contraction',))
        parts, text = stretches(run, 1.0, driven=True)
        assert [part.path for part in parts] == ['bag, 15.0 to 24.0 s', 'bag, 0.0 to 5.0 s']
        assert text.endswith('count as 2 recordings')


def test_a_recording_of_short_stretches_alone_is_refused(whole):
    parts, text = stretches(without(whole, *HOLE_S), 20.0)
    assert parts == [] and 'no stretch of 20 s is left' in text
    result = find_gap(without(without(whole, 4.0, 10.0), 14.0, 20.0), nominal())
    assert result.verdict == 'refused' and 'no stretch of 5 s is left' in result.reason
    rare = whole
    for second in np.arange(0.5, 24.0, 0.9):
        rare = without(rare, second, second + 0.5)
    with pytest.raises(InputError, match='no stretch of 1 s is left; repair the logger'):
        identify(rare, nominal(), ['mass_kg'])


def test_what_holds_is_known_from_the_begin_of_a_stretch(whole):
    signal = whole.topics['valve_signal']
    rare = Series(signal.stamp_ns[::400], {k: v[::400] for k, v in signal.values.items()})
    run = Run({**whole.topics, 'valve_signal': rare})
    begin_ns = int(run.start_ns + 3.0 * NS)
    part = between(run, begin_ns, run.end_ns)
    held = part.topics['valve_signal']
    assert held.stamp_ns[0] == begin_ns
    assert held.values['ppr_voltage'][0] == rare.values['ppr_voltage'][1]
    assert part.topics['pressure'].stamp_ns[0] >= begin_ns
    assert part.start_ns == begin_ns


def test_a_slow_log_has_no_holes():
    stamps = np.arange(0, 20 * NS, NS // 10)
    assert not len(holes_in(np.delete(stamps, [50, 51])))
    assert holes_in(np.delete(stamps, range(50, 60))).tolist() == [[49 * NS // 10, 6 * NS]]
    assert not len(holes_in(stamps[:1]))


def test_a_true_model_has_no_gap_beside_a_hole(whole):
    result = find_gap(without(whole, *HOLE_S), nominal(), effects=('creep', 'hysteresis'))
    assert result.verdict == 'no_gap'
    assert any(text.startswith('bag: no pressure for 2.5 s') for text in result.remarks)


def test_a_proof_with_a_hole_is_its_longest_stretch(whole):
    other = recorded(nominal(), voltages(24.0, seed=8), seed=8)
    result = find_gap(whole, nominal(), certify=without(other, *HOLE_S), effects=('creep',))
    assert result.verdict == 'no_gap'
    assert np.ptp(result.traces['pressure'].stamp_ns) < 12.6 * NS


def test_numbers_are_found_beside_a_hole():
    rig = nominal().with_(parameters={'mass_kg': 6.0})
    run = without(recorded(rig, voltages(9.0)), 3.0, 5.0)
    found = identify(run, nominal(), ['mass_kg'], advise=False)
    mass, = (one for one in found.found if one.number.name == 'mass_kg')
    assert mass.interval.low <= 6.0 <= mass.interval.high
    assert mass.value == pytest.approx(6.0, rel=0.01)
    assert found.signals['contraction']['rmse_after'] < 1e-4
    assert any('no pressure for 2.0 s' in text for text in found.remarks)
    assert [one['path'] for one in found.records] == [
        'bag, 5.0 to 9.0 s', 'bag, 0.0 to 3.0 s']


def test_what_is_said_of_one_recording_names_it():
    say = by_recording
    assert say(['a', 'b'], [['one', 'both'], ['both']]) == ['recording a: one', 'both']
    assert say(['a', 'b', 'c'], [['two'], ['two'], []]) == ['recordings a and b: two']
    # Stretches of one recording, and recordings without a name, are not told apart.
    assert say(['a', 'a'], [['one'], []]) == say(['', 'b'], [['one'], []]) == ['one']
