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

"""The last results of something slow."""

from pam_sim.gap.subsystems.recent import Recent


def test_the_last_results_are_kept_those_that_were_asked_for_longest():
    recent, made = Recent(2), []

    def get(key):
        return recent.get(key, lambda: made.append(key) or f'of {key}')

    assert [get(key) for key in 'abab'] == ['of a', 'of b', 'of a', 'of b'] and made == ['a', 'b']
    assert get('a') == 'of a' and get('c') == 'of c' and get('a') == 'of a'
    assert made == ['a', 'b', 'c']          # `b` was asked for longest ago
    assert get('b') == 'of b' and made == ['a', 'b', 'c', 'b']
    recent.clear()
    assert get('b') == 'of b' and made[-2:] == ['b', 'b']
