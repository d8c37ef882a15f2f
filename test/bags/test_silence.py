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

"""A topic that is silent for long is told; a table does not hold its last value for ever."""

import numpy as np
from pam_actuation import messages
from pam_actuation.bags.info import bag_info
from pam_actuation.bags.load_joint import load_recording
from pam_actuation.bags.oddities import silent_remarks
from pam_sim.run import Run, Series
from pam_sim.silence import silences
import pytest
from sample_bag import write_bag

STAMP_NS = np.arange(0, 30_000_000_000, 10_000_000)
SIGNAL, PRESSURE = '/muscle/valve_signal', '/muscle/pressure'


@pytest.mark.parametrize('stamp_ns, silent_s', [
    (STAMP_NS, []), (STAMP_NS[STAMP_NS < 12e9], [(11.99, 30.0)]),
    (STAMP_NS[abs(STAMP_NS - 15e9) > 2e9], [(12.99, 17.01)]),
    (STAMP_NS[abs(STAMP_NS - 15e9) > 0.4e9], []),
    (STAMP_NS[::100], []),                                  # a message a second
    (np.cumsum(np.arange(1, 80)**3) * 20_000, []),          # sent when it changes
    (STAMP_NS[:5], []), (STAMP_NS[:0], [])])
def test_a_steady_signal_that_ends_is_silent(stamp_ns, silent_s):
    assert [(1e-9 * begin, 1e-9 * end) for begin, end in silences(stamp_ns, 30_000_000_000)] == [
        pytest.approx(one) for one in silent_s]


@pytest.mark.parametrize('name, end_s, is_told', [
    (SIGNAL, 28.0, False), (SIGNAL, 24.0, True), ('/muscle/reference', 10.0, False)])
def test_nodes_may_stop_one_after_the_other(name, end_s, is_told):
    told = silent_remarks({PRESSURE: STAMP_NS, name: STAMP_NS[STAMP_NS < 1e9 * end_s]})
    assert len(told) == is_told and all(one.startswith(name) for one in told)


def test_a_time_in_which_no_topic_goes_on_is_told_once():
    hole = STAMP_NS[abs(STAMP_NS - 15e9) > 2e9]
    more = hole[abs(hole - 24e9) > 1e9]
    assert silent_remarks({PRESSURE: hole, SIGNAL: more}) == [
        'all topics: no value that can be used from 12.990 s to 17.010 s.',
        f'{SIGNAL}: no value that can be used from 22.990 s to 25.010 s, while others go on.']


def test_entries_that_are_not_finite_tell_nothing(tmp_path):
    def change(short, i, message):
        lost = short == 'valve_signal' and 300 <= i < 900
        return messages.ValveSignal(message.stamp_ns, message.names, (float('nan'),)) if (
            lost) else message

    path = write_bag(tmp_path / 'bag', 1000, change=change)
    run = load_recording(path)
    sentence, = run.left_out
    assert sentence == f'{SIGNAL}: no value that can be used from 1.495 s to 4.500 s, while ' \
                       'others go on.'
    assert sentence in bag_info(path).remarks


@pytest.mark.parametrize('topic, stamp_ns, is_empty', [
    ('valve_signal', STAMP_NS[STAMP_NS < 12e9], True),
    ('reference', np.array([0, 5_000_000_000]), False), ('pressure', STAMP_NS, False)])
def test_a_table_is_empty_after_a_long_silence(topic, stamp_ns, is_empty):
    run = Run({'contraction': Series(STAMP_NS, {'contraction_m': 1e-12 * STAMP_NS}),
               topic: Series(stamp_ns, {'one': np.full(len(stamp_ns), 3.0)})})
    frame = run.to_dataframe(10.0)
    held = frame[f'{topic}.one'].notna()
    assert held[frame.time_s < 12.9].all() and held[frame.time_s > 13.1].any() != is_empty
    assert run.on_grid(0.1, topics=[topic, 'contraction'])[topic, 'one'][-1] == 3.0


def test_a_table_makes_up_no_measurement_in_a_long_silence():
    stamp_ns = np.where(STAMP_NS < 10e9, STAMP_NS, STAMP_NS + 3_600_000_000_000)
    run = Run({topic: Series(stamp_ns, {field: 1e-12 * stamp_ns}) for topic, field in (
        ('pressure', 'pressure_pa'), ('contraction', 'contraction_m'))})
    frame = run.to_dataframe(10.0)
    empty = (frame.time_s > 9.991) & (frame.time_s < 3609.999)
    for name in ('pressure.pressure_pa', 'contraction.contraction_m'):
        assert (frame[name].isna() == empty).all()
    assert not np.isnan(run.on_grid(0.1)['pressure', 'pressure_pa']).any()
