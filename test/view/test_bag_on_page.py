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

"""A bag on the page: stamps are cleaned as for every verb, and what is odd is told."""

from dataclasses import replace
import json
from types import SimpleNamespace

from pam_actuation.bags.source import read_bag
from pam_actuation.cli.view import _say
from pam_actuation.view.recording import load
from pam_actuation.view.source import BagSource
import pytest
from sample_bag import START_NS, STEP_NS, write_bag

COUNT = 600
SPAN_S = (COUNT - 1) * STEP_NS * 1e-9
MEASURED = ('pressure', 'contraction', 'force')


def changed(folder, change):
    """Return the Recording of a bag whose measurements were changed."""
    return load(write_bag(folder / 'bag', COUNT, change=lambda short, i, message: (
        change(i, message) if short in MEASURED else message)))


def span_s(recording):
    begin_ns, end_ns = recording.store.span_ns()
    return (end_ns - begin_ns) * 1e-9


def test_a_bag_without_stamps_is_shown_by_receive_times(tmp_path):
    shown = changed(tmp_path, lambda i, message: replace(message, stamp_ns=0))
    times_ns = shown.store.histories['/muscle', 'pressure'].times_ns
    received_ns = read_bag(shown.path).topics['/muscle/pressure'].log_time_ns
    assert (times_ns == received_ns).all() and len(times_ns) == COUNT
    assert span_s(shown) == pytest.approx(SPAN_S, abs=0.01)
    told = [text for text in shown.remarks if 'no message has a header stamp' in text]
    assert len(told) == len(MEASURED)


@pytest.mark.parametrize('stamp_ns, says', [
    (0, 'messages without a header stamp, left out'),
    (START_NS + 10**17, 'messages have a stamp far from those around them')])
def test_a_stray_stamp_does_not_stretch_the_time(tmp_path, stamp_ns, says):
    shown = changed(tmp_path, lambda i, message: (
        replace(message, stamp_ns=stamp_ns) if i == 100 else message))
    assert span_s(shown) == pytest.approx(SPAN_S, abs=0.01)
    assert len(shown.store.histories['/muscle', 'pressure'].times_ns) == COUNT - 1
    assert any(f'/muscle/pressure: 1 {says}' in text for text in shown.remarks)


def test_values_in_a_wrong_unit_are_told(tmp_path):
    shown = changed(tmp_path, lambda i, message: (
        replace(message, pressure_pa=message.pressure_pa / 1000.0)
        if hasattr(message, 'pressure_pa') else message))
    assert any('/muscle/pressure' in text and 'kPa' in text for text in shown.remarks)


def test_the_remarks_are_printed_and_given_to_the_page(tmp_path, capsys):
    bag = write_bag(tmp_path / 'bag', COUNT)
    (bag / 'metadata.yaml').unlink()
    file, = bag.glob('*.mcap')
    file.write_bytes(file.read_bytes()[:-3000])
    source = BagSource(load(bag, recover=True))
    assert source.remarks
    for as_json in (False, True):
        _say(SimpleNamespace(json=as_json, open=False), source, 'http://localhost:1/')
    printed = capsys.readouterr().out.splitlines()
    assert printed[1:-2] == [f'remark: {text}' for text in source.remarks]
    assert json.loads(printed[-1]) == {
        'url': 'http://localhost:1/', 'live': False, 'remarks': list(source.remarks)}
