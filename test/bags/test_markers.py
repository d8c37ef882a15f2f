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

"""Markers in a bag: loaded, told by ``pam info``, drawn by page and report."""

from pam_actuation.bags.info import bag_info, render_text
from pam_actuation.bags.load import load_run
from pam_actuation.bags.markers import markers_of
from pam_actuation.bags.source import read_bag
from pam_actuation.cli.main import main
from pam_actuation.messages import Marker
from pam_actuation.report import signals
from pam_actuation.topics.table import MARKER, RECORDED, RECORDED_OF_JOINT
from pam_actuation.view.recording import load
import pytest
from sample_bag import START_NS, STEP_NS, write_bag

TEXTS = ('supply on', 'leak <opened>')
MARKERS = tuple(Marker(START_NS + i * STEP_NS, text, '/pam_view_1')
                for i, text in zip((100, 300), TEXTS))


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    """Return a bag of 2 s with two markers."""
    def change(short, i, message):
        return message if short != MARKER else next(
            (one for one in MARKERS if one.stamp_ns == message.stamp_ns), None)

    return write_bag(tmp_path_factory.mktemp('bag') / 'marked', 400, change=change)


def test_every_recorder_records_markers_of_its_rig():
    assert RECORDED[MARKER].full_name('/muscle') == '/muscle/marker'
    assert MARKER in RECORDED_OF_JOINT and not any(
        name.endswith(f'/{MARKER}') for name in RECORDED_OF_JOINT)


def test_a_loaded_run_and_pam_info_have_them(bag, capsys):
    run = load_run(bag)
    assert run.markers == MARKERS and MARKER not in run.topics
    info = bag_info(bag)
    assert [one['text'] for one in info.markers] == list(TEXTS)
    assert info.markers[0]['time_s'] == pytest.approx(0.5, abs=0.01)
    assert info.markers[0]['namespace'] == '/muscle'
    assert '1.50 s, marker in /muscle: leak <opened>' in render_text(info)
    assert not [one for one in info.remarks if MARKER in one]
    main(['info', str(bag), '--json'])
    assert '"text": "supply on"' in capsys.readouterr().out


def test_markers_of_a_joint_are_those_of_its_muscles_too(tmp_path):
    def change(short, i, message):
        return message if short != MARKER or i == 3 else None

    path = write_bag(tmp_path / 'bag', 10, namespaces=('/knee',), change=change)
    found = read_bag(path)
    assert [place for place, _ in markers_of(found, '/knee/flexor')] == ['/knee']
    assert markers_of(found) == markers_of(found, '/knee') != []
    assert markers_of(found, '/kneecap') == markers_of(found, '/other') == []


def test_the_page_of_the_bag_shows_them_at_any_time(bag):
    store = load(bag).store
    assert store.markers == [('/muscle', one) for one in MARKERS]
    shown = store.state(START_NS)['markers']
    assert [(one['text'], one['time_s']) for one in shown] == [
        (one.text, one.stamp_ns * 1e-9) for one in MARKERS]
    assert ('/muscle', MARKER) not in store.histories


def test_the_report_draws_and_lists_them(bag, tmp_path):
    times = [time_s for time_s, _ in signals.markers(load_run(bag))]
    assert times == pytest.approx([0.5, 1.5])
    page = tmp_path / 'page.html'
    assert main(['report', str(bag), '--out', str(page)]) in (0, 1)
    text = page.read_text(encoding='utf-8')
    assert 'leak &lt;opened&gt;' in text and '<opened>' not in text
    assert text.count('"dash":"dot"') + text.count('"dash": "dot"') >= 2 and '1.50 s' in text
