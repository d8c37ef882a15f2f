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

"""What changed over time: each shape is found on its day, and chance is not."""

from dataclasses import replace
import json
import math

import numpy as np
from pam_actuation.campaign.campaign import Campaign
from pam_actuation.campaign.cases import Case
from pam_actuation.campaign.changes import Change, changes_of, far_from_neighbours
from pam_actuation.campaign.findings import Findings, Odd, sentence
from pam_actuation.campaign.results import seen_before, write_results
from pam_actuation.campaign.series import IN_95, Series, series_of
from pam_actuation.campaign.work import Settings, size
import pytest

DAYS = 25


def series(value, sd=0.02, named=True, rig='rig_1', time=None):
    """Return a series of one quantity, a value a day."""
    count = len(value)
    time = np.arange(1.0, count + 1.0) if time is None else time
    return Series(rig, 'friction', 'effect', 'force_n', 'N', time, [str(t) for t in time],
                  np.array(value, dtype=float), np.full(count, sd),
                  np.full(count, named) if isinstance(named, bool) else named,
                  [f'k{i}' for i in range(count)], 0.0)


def noisy(shape, seed=0, sd=0.02):
    return shape + sd * np.random.default_rng(seed).standard_normal(DAYS)


DAY = np.arange(1.0, DAYS + 1.0)


@pytest.mark.parametrize('value, shape, day', [
    (1.0 + 0.2 * (DAY >= 11), 'step', 11), (1.0 + 0.2 * (DAY >= 20), 'step', 20),
    (1.0 + 0.05 * np.maximum(DAY - 5, 0), 'ramp', 5),
    (2.0 - 0.05 * np.maximum(DAY - 14, 0), 'ramp', 14), (1.0 + 0.03 * DAY, 'line', 1)])
def test_a_change_is_found_with_shape_and_day(value, shape, day):
    for seed in range(5):
        [found] = changes_of([series(noisy(value, seed))])
        assert found.shape == shape and found.p < 1e-4
        assert abs(found.series.time[found.begin] - day) <= 1.0
        assert found.series.time[found.earliest] <= day <= found.series.time[found.latest] + 1.0
        assert np.max(np.abs(found.fitted() - value)) < 0.05
        if shape != 'step':
            slope = (value[-1] - value[-2])
            assert abs(found.amount - slope) < 4.0 * found.amount_sd


def test_chance_is_no_change():
    # Intervals so short that every change is told that is significant.
    several = [series(noisy(np.ones(DAYS), seed), sd=0.005, rig=f'rig_{seed}')
               for seed in range(100)]
    assert changes_of(several) == []
    # Without the correction for their number chance finds some, and no more than it may.
    assert 3 <= sum(bool(changes_of([one], level=0.5)) for one in several) <= 60


def test_one_far_value_is_no_change_and_hides_none():
    value = noisy(np.ones(DAYS))
    value[22] = 3.0
    assert changes_of([series(value)]) == []
    value = noisy(1.0 + 0.2 * (DAY >= 11), 3)
    value[22] = 3.0
    [found] = changes_of([series(value)])
    assert found.begin == 10 and found.left_out == [22]


def test_less_than_a_recording_can_tell_and_few_names_are_no_change():
    assert changes_of([series(noisy(1.0 + 0.02 * (DAY >= 11), sd=0.001), sd=0.02)]) == []
    named = DAY >= 24
    assert changes_of([series(np.where(named, 1.0, 0.0), named=named)]) == []


def test_a_sentence_counts_days_or_numbered_recordings():
    numbered = series(1.0 + 0.03 * DAY)
    numbered.days = [str(k) for k in range(1, DAYS + 1)]
    [found] = changes_of([numbered])
    assert 'grows over all recordings from 1: ' in sentence([found])
    assert ' a recording (95 %: ' in sentence([found])
    found.series.days = [f'2026-03-{k:02}' for k in range(1, DAYS + 1)]
    assert 'grows over all days from 2026-03-01: ' in sentence([found])
    assert ' a day (95 %: ' in sentence([found])


def test_what_gets_larger_rises_below_zero_too():
    [found] = changes_of([series(noisy(-2.0 + 3.0 * (DAY >= 11)))])
    assert ' friction rises from ' in sentence([found])


def change(name, begin, rises=True, spread=1, shape='step'):
    """Return a change that began on a day, give or take ``spread`` days."""
    one = series(1.0 + DAY)
    one.name, one.days = name, [f'2026-03-{k:02}' for k in range(1, DAYS + 1)]
    before, after = (1.0, 2.0) if rises else (2.0, 1.0)
    return Change(one, shape, begin, begin - spread, begin + spread, before, after,
                  after - before, 0.1, 1e-5, [])


def odd(day, recording, key):
    row = {'case': Case('p', 'rig_1', day, 1.0), 'key': key, 'recording': recording}
    return Odd(row, 'why', 9.0)


def told(tmp_path, groups, several=()):
    """Return what a run says that it told, from its files."""
    write_results(Campaign(Settings('gap'), []), Findings([], groups, list(several)), tmp_path, '')
    return seen_before(tmp_path)


@pytest.mark.parametrize('now, new', [
    ([change('friction', 6)], []), ([change('friction', 4)], []),
    ([change('friction', 14)], ['rig_1 friction force_n step up from 2026-03-15']),
    ([change('friction', 5, rises=False)], ['rig_1 friction force_n step down from 2026-03-06']),
    ([change('leak', 5), change('noise', 5)], ['rig_1 leak force_n step up from 2026-03-06'])])
def test_an_alert_is_of_what_was_not_told(now, new, tmp_path):
    before = told(tmp_path, [[change('friction', 5), change('noise', 5)]])
    assert Findings([], [now], []).new(before) == new


def test_an_odd_recording_is_told_once_whatever_the_code(tmp_path):
    before = told(tmp_path, [], [odd('2026-03-01', 'bytes', 'key')])
    several = [odd('2026-03-01', 'bytes', 'key of other code'), odd('2026-03-01', 'others', 'k')]
    assert Findings([], [], several).new(before) == ['rig_1 others']


def test_what_a_former_version_told_is_told(tmp_path):
    told(tmp_path, [[change('friction', 5)]], [odd('2026-03-01', 'bytes', 'key')])
    path = tmp_path / 'findings.json'
    seen = json.loads(path.read_text())
    seen['identities'] = ['rig_1 friction step', 'rig_1 key']
    del seen['odd'][0]['recording']
    path.write_text(json.dumps(seen))
    before = seen_before(tmp_path)
    again = Findings([], [[change('leakage', 5), change('friction', 6)]],
                     [odd('2026-03-01', 'bytes', 'key of other code')])
    assert again.new(before) == []
    later = Findings([], [[change('friction', 14)]], [odd('2026-03-02', 'bytes', 'key')])
    assert len(later.new(before)) == 2


def test_several_recordings_a_day_begin_together():
    time = np.repeat(np.arange(1.0, 13.0), 2)
    value = 1.0 + 0.5 * (time >= 6) + 0.02 * np.random.default_rng(1).standard_normal(24)
    [found] = changes_of([series(value, time=time)])
    assert found.begin == 10 and time[found.begin] == 6.0


def test_of_one_time_nothing_can_change():
    value = 1.0 + 0.5 * (np.arange(10) >= 5)
    assert changes_of([series(value, time=np.full(10, 3.0))]) == []
    # Nor where the one value of another day is far from all others.
    value = np.where(np.arange(12) == 0, 9.0, 1.0 + 0.02 * (np.arange(12) % 2))
    assert changes_of([series(value, time=np.where(np.arange(12) == 0, 2.0, 3.0))]) == []


def test_two_days_may_differ():
    time = np.repeat([1.0, 2.0], 5)
    [found] = changes_of([series(noisy(1.0 + 0.5 * (DAY >= 6))[:10], time=time)])
    assert found.fitted() == pytest.approx(1.0 + 0.5 * (time > 1.0), abs=0.05)


def row(day, verdict='effects', sizes=(), ambiguous=(), least=None):
    """Return a row of a campaign."""
    return {'case': Case('p', 'rig', str(day), float(day)), 'key': f'k{day}', 'verdict': verdict,
            'reason': '', 'sizes': list(sizes), 'ambiguous': list(ambiguous),
            'least': least or {}, 'bad': False}


def without_interval(values, rig='rig'):
    """Return the series of the rms differences of replays, which have no interval."""
    found = [row(day, 'replayed', [size('plant.contraction', 'difference', 'rms', {
        'value': value, 'unit': 'm'})]) for day, value in enumerate(values, 1)]
    [one] = series_of([{**each, 'case': replace(each['case'], rig=rig)} for each in found])
    return one


def test_sizes_without_interval_change_in_any_unit():
    value = noisy(1.0 + 2.0 * (DAY >= 11), sd=0.1)
    found = [changes_of([without_interval(factor * value)]) for factor in (1e-6, 1e-3, 1.0, 1e3)]
    assert [(one.shape, one.begin) for [one] in found] == [('step', 10)] * 4
    assert [one.p for [one] in found] == pytest.approx([found[0][0].p] * 4, rel=1e-3)
    value[5] = 9.0
    assert [bool(far) for far in far_from_neighbours(without_interval(1e-6 * value))] == [
        day == 6 for day in DAY]


def test_chance_is_no_change_of_sizes_without_interval():
    several = [without_interval(1e-4 * np.exp(noisy(np.zeros(DAYS), seed, sd=0.3)), f'rig_{seed}')
               for seed in range(100)]
    assert changes_of(several) == []
    assert sum(bool(changes_of([one], level=0.05)) for one in several) <= 10
    assert changes_of([without_interval(np.zeros(DAYS))]) == []


def test_days_without_a_name_count_as_nothing_or_not_at_all():
    leak = {'name': 'leakage', 'kind': 'effect', 'quantity': 'c', 'value': 5.0, 'low': 4.0,
            'high': 6.0, 'unit': '-', 'nothing': 0.0}
    least = {'leakage': {'value': 0.7, 'unit': '-', 'quantity': 'c'}}
    [found] = series_of([
        row(1, 'no_gap', least=least), row(2, sizes=[leak]), row(3, 'unknown', least=least),
        row(4, 'ambiguous', ambiguous=['leakage'], least=least), row(5, 'no_gap'),
        row(6, 'no_gap', least={'leakage': {**least['leakage'], 'value': None, 'why': 'w'}})])
    assert found.time.tolist() == [1.0, 2.0] and found.named.tolist() == [False, True]
    assert found.value.tolist() == [0.0, 5.0]
    assert found.sd == pytest.approx([0.7 / IN_95, 1.0 / IN_95])
    assert not math.isnan(found.nothing)
