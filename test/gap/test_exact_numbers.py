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

"""Numbers that a model takes as exact."""

from gap_runs import duties, NOMINAL, recorded
from pam_sim import load_rig
from pam_sim.gap import find_gap


def test_a_number_taken_as_exact_that_explains_the_valve_is_told():
    """A ratio of the data sheet that is wrong looks like a supply and an asymmetry."""
    given = load_rig(NOMINAL, valve='hsv')
    truth = given.with_(parameters={'b': 0.2})
    moves = {'lasts_ms': (40, 280), 'openings': (0.1, 1.0)}
    asked = recorded(truth, duties(16.0, **moves)), recorded(truth, duties(12.0, seed=8, **moves))
    told = find_gap(asked[0], given, asked[1], ['leakage', 'dead_volume'], unnamed=())
    sentence, = (r for r in told.remarks if 'takes b as exact' in r)
    assert '0.2 in place of 0.38' in sentence and '`tolerance: {b: 0.3}`' in sentence
    again = find_gap(asked[0], given.with_(tolerance={'b': 0.3}), asked[1],
                     ['leakage', 'dead_volume'], unnamed=())
    assert again.verdict == 'no_gap' and not any('as exact' in r for r in again.remarks)
    # What no number explains has no such sentence.
    leak = given.with_(effects=[
        {'name': 'leakage', 'parameters': {'conductance_m3_per_s_pa': 5e-13}}])
    other = find_gap(recorded(leak, duties(16.0, **moves)), given, None, ['creep'], unnamed=())
    assert other.verdict == 'unknown' and not any('as exact' in r for r in other.remarks)
