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

"""What is unknown is identified before the look for what a model misses."""

import json

import jsonschema
from made_records import record, RIG
from pam_actuation.report import gap
from pam_actuation.report.gap import gap_of, write_gap
from pam_sim import load_rig
from pam_sim.gap.report.schema import report_schema
from pam_sim.gap.result import GapResult
from pam_sim.identify import before_gap
from pam_sim.identify.before_gap import numbers_first
from pam_sim.identify.records import offers_of
from pam_sim.identify.result import Identification
from pam_sim.tolerance import UNKNOWN
import pytest


def test_an_unknown_load_is_found_first_and_no_sensor_is_blamed(tmp_path):
    run = record(RIG.with_(parameters={'mass_kg': 3.1}))
    given = tmp_path / 'given.yaml'
    given.write_text('rig: dmsp_5_300_hanging_mass\ntolerance: {mass_kg: unknown}\n')
    told = []
    result = write_gap([run], str(given), tmp_path / 'gap', seconds=60.0, progress=told.append)
    assert result.verdict == 'no_gap' and result.effects == []
    assert told == sorted(told) and told[-1] == pytest.approx(1.0)
    data = json.loads((tmp_path / 'gap' / 'gap.json').read_text())
    jsonschema.validate(data, report_schema())
    (mass,) = data['numbers_first']['numbers']
    assert mass['name'] == 'mass_kg' and mass['status'] == 'determined'
    low, high = mass['ci95']
    assert low < 3.1 < high and mass['value'] == pytest.approx(3.1, rel=0.01)
    assert load_rig(str(tmp_path / 'gap' / 'model.yaml')).unknown == ()
    page = (tmp_path / 'gap' / 'report.html').read_text()
    assert 'Unknown numbers first' in page and 'mass_kg' in page
    assert '.\nunknown numbers first:\n  mass_kg' in result.text()


def test_without_an_unknown_number_or_with_a_bag_that_cannot_be_used_nothing_is_sought():
    run = record(RIG, hold_s=0.3)
    assert numbers_first([run], RIG, True) == (RIG, None, [])
    run.topics.pop('pressure')
    unknown = RIG.with_(tolerance={'mass_kg': UNKNOWN})
    rig, found, remarks = numbers_first([run], unknown, True)
    assert rig == unknown and found is None and remarks == []


def test_a_recording_with_a_hole_is_used_first_too_and_the_hole_told_once(monkeypatch):
    run, unknown = record(RIG, hold_s=1.6), RIG.with_(tolerance={'mass_kg': UNKNOWN})
    for topic in run.topics.values():
        keep = abs(topic.stamp_ns - 5.4e9) > 0.4e9
        topic.stamp_ns = topic.stamp_ns[keep]
        topic.values = {key: value[keep] for key, value in topic.values.items()}

    def identified(law, why, runs, rig, **options):
        _, hole = offers_of(runs, rig, [0.0])
        return Identification(rig, [], [], [], {}, False, ['mass_kg'],
                              remarks=[*hole, 'of the numbers'])

    monkeypatch.setattr(before_gap, 'identify_beside', identified)
    found = numbers_first([run], unknown, True)[1]
    assert 'count as 2 recordings' in found.remarks[0]
    monkeypatch.setattr(gap, 'find_gap', lambda *given, **options: GapResult(
        'no_gap', '', remarks=found.remarks[:1]))
    assert gap_of([run], unknown).numbers_first['remarks'] == ['of the numbers']


def test_an_unknown_law_is_held_at_first_and_nobody_is_asked_to_state_it_as_unknown():
    """The stated law is of another muscle: it leaves a clear gap while it is held."""
    other = RIG.with_(parameters={'law.a3': 1.5 * RIG.number('law.a3')})
    run = record(other)
    given = RIG.with_(tolerance={'law.a3': UNKNOWN, 'spring_n_per_m': UNKNOWN})
    rig, found, _ = numbers_first([run], given, True)
    assert [one.number.name for one in found.found] == ['spring_n_per_m']
    assert 'law.a3' in rig.unknown and not any('--unknown law' in one for one in found.remarks)
    (held,) = [one for one in found.remarks if one.startswith('law.a3: as in the model')]
    assert 'fits the force law' in held
    _, found, _ = numbers_first([run], given.with_(tolerance={'law.a3': 0.0}), True)
    assert any('--unknown law' in one for one in found.remarks)
