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

"""A sample of the spoiled bags of ``mutations.py``: an answer within the limits, always."""

from mutations import Mutations
import pytest

CASES = 200


@pytest.fixture(scope='module')
def mutations(tmp_path_factory):
    return Mutations(tmp_path_factory.mktemp('mutations'))


def test_spoiled_bags_are_read_or_refused_in_a_sentence(mutations):
    for seed in range(CASES):
        mutations.check(seed)
    assert not mutations.findings, '\n'.join(mutations.findings[:3])
    # The sample is worth something only if both ends of the scale are in it.
    assert mutations.outcomes['read'] > CASES / 2
    assert mutations.outcomes['refused'] > CASES / 2


def test_a_reader_that_fails_is_found(mutations, monkeypatch):
    before = len(mutations.findings)

    def broken(path, recover, known):
        raise KeyError('unexpected')

    monkeypatch.setattr('mutations.check_load', broken)
    mutations.check(0)
    assert len(mutations.findings) == before + 1 and 'KeyError' in mutations.findings[-1]
    del mutations.findings[before:]
