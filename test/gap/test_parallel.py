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

"""Work spread over the cores: in order, whoever does it, and never more threads than cores."""

import threading
import time

from pam_sim.gap.subsystems.parallel import parallel_map
import pytest


@pytest.fixture(params=['1', '3'])
def cores(request, monkeypatch):
    monkeypatch.setenv('PAM_THREADS', request.param)
    return int(request.param)


def test_calls_within_calls_keep_the_order_and_use_no_more_threads_than_cores(cores):
    seen, most, lock = set(), [0], threading.Lock()

    def inner(number):
        with lock:
            seen.add(threading.get_ident())
            most[0] = max(most[0], len(seen))
        time.sleep(1e-3)
        with lock:
            seen.discard(threading.get_ident())
        return number

    def outer(number):
        return parallel_map(inner, range(number, number + 4))

    assert parallel_map(outer, range(6)) == [[n, n + 1, n + 2, n + 3] for n in range(6)]
    assert most[0] == cores


def test_an_error_ends_the_work_and_leaves_the_helpers_free(cores):
    done = []

    def refuse(number):
        if number == 2:
            raise ValueError('two')
        time.sleep(1e-3)
        done.append(number)

    for _ in range(3):
        with pytest.raises(ValueError, match='two'):
            parallel_map(refuse, range(200))
    assert len(done) < 100
    assert parallel_map(lambda n: n * n, range(5)) == [0, 1, 4, 9, 16]
