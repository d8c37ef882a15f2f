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

"""What is sent: changes alone build the same picture as a whole one; errors; bags."""

import json

from made_rig import feed, feed_rules, MadeRig, Page, START_NS, STEP_NS
import numpy as np
from pam_actuation.view import store as store_module
from pam_actuation.view.recording import load
from pam_actuation.view.store import Store
from pam_actuation.view.stream import COLUMNS, decode, Stream
from pam_actuation.view.surfaces import CELLS, surfaces
from pam_sim.errors import InputError
import pytest
from sample_bag import write_bag


def page_of(stream):
    """Return a page that has the layout and the whole picture."""
    page = Page()
    stream.refresh()
    page.take(json.dumps(stream.layout()))
    page.take(stream.picture())
    return page


@pytest.mark.parametrize('window_s', [2, 60])
def test_changes_build_what_a_whole_picture_shows(window_s):
    rig = MadeRig(3000)
    stream = Stream(rig.store, '/muscle', window_s)
    page = page_of(stream)
    sizes = []
    for _ in range(120):
        rig.go_on(51)
        message = stream.changes()
        sizes.append(len(message))
        page.take(message)
    header, parts = decode(stream.picture())
    first = header['base'] - COLUMNS
    for known, (numbers, one, other) in zip(page.columns, parts):
        shown = dict(zip(numbers.tolist(), zip(one.tolist(), other.tolist())))
        assert {at: pair for at, pair in known.items() if at > first} == {
            at: pair for at, pair in shown.items() if at > first}
    # Of the first change the lines are new, then only what came.
    assert max(sizes[1:]) < 0.1 * len(stream.picture()) or window_s == 2


def test_pressure_is_in_kpa_gauge_motion_in_mm_and_the_error_is_exact():
    rig = MadeRig(2000)
    page = page_of(Stream(rig.store, '/muscle', 2))
    newest = {}
    for plot, label in (('pressure', 'pressure'), ('contraction', 'contraction'),
                        ('error', 'error'), ('voltage', 'voltage'), ('force', 'force')):
        columns = page.columns[page.index(plot, label)]
        newest[label] = columns[max(columns)][1]
    assert newest['pressure'] == pytest.approx(200.0)
    assert newest['force'] == pytest.approx(49.0)
    # At 1 ms after the reference of 100 Hz the error is that of the held reference.
    reference = rig.store.histories['/muscle', 'reference']
    contraction = rig.store.histories['/muscle', 'contraction']
    error = rig.store.histories['/muscle', 'error.error_m']
    held = np.searchsorted(reference.times_ns, error.times_ns, side='right') - 1
    measured = contraction.values('contraction_m')[:len(error)]
    assert len(error) == 1991           # up to the newest reference
    assert (error.values('error_m')
            == reference.values('contraction_m')[held] - measured).all()


def test_a_view_shows_what_is_below_it_and_titles_tell_them_apart():
    store = Store()
    for side in ('flexor', 'extensor'):
        feed(store, 0, 100, f'/knee/{side}')
    stream = Stream(store, '/knee', 10)
    assert stream.refresh()
    titles = [plot['title'] for plot in stream.layout()['plots']]
    assert 'Pressure, gauge (flexor)' in titles and 'Pressure, gauge (extensor)' in titles
    assert not stream.refresh()
    feed(store, 0, 100, '/other')
    assert not stream.refresh() and Stream(store, '/other', 10).refresh()


def test_a_wrong_stamp_of_one_topic_moves_nothing():
    rig = MadeRig(2000)
    now_ns = rig.store.now_ns()
    rig.store.add('/muscle', 'supply_pressure', np.array([now_ns + 10**15]),
                  {'pressure_pa': np.array([8e5])})
    assert rig.store.now_ns() == now_ns


def test_a_rig_that_falls_silent_is_told_also_where_all_of_it_does(monkeypatch):
    steady_s = 100.0
    monkeypatch.setattr(store_module, 'monotonic', lambda: steady_s)
    rig = MadeRig(2000)
    steady_s += 0.5
    later_ns = rig.store.now_ns() + 5 * 10**9       # a clock of another computer is ahead
    assert [node['level'] for node in rig.store.state(later_ns)['nodes']] == [0]
    before = {one['rate_hz'] for one in rig.store.state(rig.store.now_ns())['topics']}
    assert before == {100.0, 1000.0}
    steady_s += 4.5
    state = rig.store.state(rig.store.now_ns())
    node, = state['nodes']
    assert node['level'] == 3 and node['message'].startswith('silent for 5 s; last: following')
    assert {one['rate_hz'] for one in state['topics']} == {0.0}
    rig.go_on()
    state = rig.store.state(rig.store.now_ns())
    assert state['nodes'][0]['level'] == 0
    assert {one['rate_hz'] for one in state['topics']} == before


def test_a_node_of_a_bag_is_silent_by_the_stamps():
    store = Store(span_ns=None)
    feed(store, 0, 2000)
    for later_s, level in ((1.0, 0), (5.0, 3)):
        later_ns = START_NS + 2000 * STEP_NS + round(later_s * 1e9)
        assert [node['level'] for node in store.state(later_ns)['nodes']] == [level]


def test_a_bag_shows_the_same_values_and_what_its_nodes_said_then(tmp_path):
    bag = write_bag(tmp_path / 'bag', 400, ('/left', '/right'))
    recording = load(bag)
    store = recording.store
    assert recording.title == 'sine' and store.namespaces() == ['/left', '/right']
    begin_ns, end_ns = store.span_ns()
    stream = Stream(store, '/left', 2)
    stream.refresh()
    page = Page()
    page.take(json.dumps(stream.layout()))
    page.take(stream.picture(end_ns))
    force = page.columns[page.index('force', 'force')]
    at = 5_000_000 // round(2e9 / COLUMNS)
    assert at and max(force.values())[0] == pytest.approx(50.0, abs=1e-3)
    assert min(min(pair) for pair in force.values()) == pytest.approx(48.0, abs=1e-3)
    state = store.state(begin_ns + 10**9)
    assert state['nodes'][0]['name'] == '/muscle/valve_driver'
    assert {one['rate_hz'] for one in state['topics']} == {200.0}
    assert all(one['lost'] is None for one in state['topics'])
    only = load(bag, namespace='/left').store
    assert only.namespaces() == ['/left']
    with pytest.raises(InputError, match='no signal of a rig in the namespace /none'):
        load(bag, namespace='/none')


@pytest.mark.parametrize('namespace, shown', [('', 1), ('/muscle', 1), ('/mus', 0), ('/other', 0)])
def test_of_a_bag_the_nodes_of_the_shown_namespace_are_shown(namespace, shown, tmp_path):
    bag = write_bag(tmp_path / 'bag', 20, ('/muscle', '/mus', '/other'))
    nodes = load(bag, namespace=namespace).store.state(None)['nodes']
    assert [node['name'] for node in nodes] == ['/muscle/valve_driver'] * shown


def test_the_surface_of_the_rules_shows_the_newest_output_at_each_place():
    store = Store()
    feed_rules(store, 0, 5000)
    feedback, = surfaces(store, '', store.now_ns())     # motion rules are missing: no surface
    assert feedback['title'] == 'Feedback rules'
    assert feedback['x'] == {'label': 'error [mm]', 'range': (-2.0, 2.0)}
    assert feedback['y']['range'] == (-20.0, 20.0)

    def grid(shown):
        return np.array([np.nan if one is None else one for one in shown['values']]
                        ).reshape(CELLS, CELLS)

    values = grid(feedback)
    middles_mm = (np.arange(CELLS) + 0.5) / CELLS * 4.0 - 2.0
    known = ~np.isnan(values)
    assert 50 < known.sum() < 200           # a ring, and nothing inside it
    difference = np.abs(values - 2.0 * middles_mm)[known]
    assert difference.max() <= 2.0 * 4.0 / CELLS
    feed_rules(store, 5000, 1000, gain=5.0)
    learned, = surfaces(store, '/muscle', store.now_ns())
    assert np.nanmax(grid(learned)) == pytest.approx(10.0, abs=0.1)
    # A bag at an earlier time knows nothing of what came later.
    before, = surfaces(store, '', START_NS + 4999 * STEP_NS)
    assert before['values'] == feedback['values']
    assert surfaces(store, '/other', store.now_ns()) == surfaces(store, '', None) == []
