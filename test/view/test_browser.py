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

"""The page in a real browser: connect, emergency stop, a server that dies, phone, bag, dark."""

from browser import Browser, find_chromium
from made_rig import feed, feed_rules, MadeRig, Running
from pam_actuation.view.recording import load
from pam_actuation.view.server import ViewServer
from pam_actuation.view.source import BagSource
import pytest
from sample_bag import write_bag

pytestmark = pytest.mark.skipif(
    find_chromium() is None,
    reason='no Chromium or Chrome is installed; PAM_CHROMIUM may name one')
READY = 'page.time !== null && page.charts.length > 4 && page.drivers.length === 1'


@pytest.fixture(scope='module')
def browser(tmp_path_factory):
    """Return one browser for all tests of this file."""
    with Browser(tmp_path_factory.mktemp('chromium')) as one:
        one.size(1280, 900)
        yield one


@pytest.fixture
def rig():
    """Return a made-up rig whose time passes."""
    one = MadeRig()
    with Running(one):
        yield one


@pytest.fixture
def server(rig):
    """Return its server."""
    one = ViewServer(rig, port=0)
    one.start()
    yield one
    one.stop()


def drawn(browser):
    """Return for each plot the share of its pixels that are not empty."""
    return browser.run("""[...document.querySelectorAll('canvas')].map((canvas) => {
        const pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
        let count = 0;
        for (let k = 3; k < pixels.data.length; k += 4) count += pixels.data[k] > 0;
        return count / (canvas.width * canvas.height); })""")


def test_the_page_shows_the_rig_and_goes_on(browser, server):
    browser.go_to(server.url)
    browser.wait_for(READY)
    assert browser.text('#link') == 'live'
    titles = browser.run("[...document.querySelectorAll('figcaption b')].map((b) => b.innerText)")
    assert titles == ['Contraction [mm]', 'Error [mm]', 'Pressure, gauge [kPa]',
                      'Valve signal [V]', 'Force [N]']
    browser.wait_for("document.querySelector('[data-plot=pressure]').innerText.includes('200')")
    assert min(drawn(browser)) > 0.005
    assert 'following the pressure command' in browser.text('#nodes')
    assert '/muscle/pressure\t' in browser.text('#topics')
    now = browser.run('page.time.now_s')
    browser.wait_for(f'page.time.now_s > {now} + 0.2')


def test_emergency_stop_by_one_press_and_reset_by_two(browser, server, rig):
    browser.go_to(server.url)
    browser.wait_for(READY)
    browser.press('#stop')
    browser.wait_for("document.querySelector('#banner').innerText.includes('confirmed')")
    assert browser.text('#banner') == 'Emergency stop confirmed. /muscle/valve_driver: vents'
    browser.press('#reset')
    assert rig.asked == ['emergency_stop']
    assert browser.text('#reset') == 'Press again to reset'
    assert browser.text('#banner') == 'A second press resets /muscle/valve_driver.'
    browser.press('#reset')
    browser.wait_for("document.querySelector('#banner').innerText.startsWith('Reset confirmed')")
    assert rig.asked == ['emergency_stop', 'reset']
    rig.silent = True
    browser.press('#stop')
    browser.wait_for("document.querySelector('#banner').className === 'bad'")
    assert 'NOT confirmed' in browser.text('#banner')


def test_an_experiment_is_started_by_two_presses_and_ended_by_one(browser, server, rig):
    browser.go_to(server.url)
    browser.wait_for(f'{READY} && page.players.length === 1')
    browser.run("document.querySelector('#experiment').value = 'staircase'")
    browser.press('#begin')
    assert rig.asked == [] and browser.text('#begin') == 'Press again to start'
    browser.press('#begin')
    browser.wait_for("document.querySelector('#banner').className === 'good'")
    assert browser.text('#banner') == (
        'Start of staircase confirmed. /muscle/reference_generator: plays staircase')
    browser.press('#halt')
    browser.wait_for("document.querySelector('#banner').innerText.startsWith('End of')")
    assert rig.asked == ['play', 'halt']


def test_a_marker_is_set_listed_and_drawn(browser, server, rig):
    browser.go_to(server.url)
    browser.wait_for(READY)
    browser.run("""(() => { document.querySelector('#marker').value = ' supply <on> ';
        document.querySelector('#marking').requestSubmit(); })()""")
    browser.wait_for("document.querySelector('#banner').className === 'good'")
    assert browser.text('#banner') == 'Marker "supply <on>" confirmed. /muscle: recorded'
    browser.wait_for('page.markers.length === 1')
    assert browser.text('#markers li').endswith('supply <on>') and rig.asked == ['mark']
    browser.wait_for(
        'page.markers[0].time_s < page.time.now_s && page.markers[0].time_s > page.time.now_s - 9')
    assert browser.run("""(() => { const canvas = document.querySelector('canvas');
        page.charts[0].draw({...page.time, cursor: null, markers: []}, () => '#000');
        const without = canvas.toDataURL();
        page.charts[0].draw({...page.time, cursor: null, markers: page.markers}, () => '#000');
        return without !== canvas.toDataURL(); })()""")
    assert browser.text('#marker') == ''


def test_a_reset_names_the_drivers_of_the_rig_that_is_shown(browser, server, rig):
    rig.more_drivers = ['/right/valve_driver']
    feed(rig.store, 0, 4000, '/right')
    browser.go_to(server.url)
    browser.wait_for("page.drivers.length === 2 && page.views === ',/muscle,/right'")

    def show(view):
        browser.run(f"""(() => {{ const view = document.querySelector('#view');
            view.value = '{view}'; view.dispatchEvent(new Event('change')); }})()""")

    show('/right')
    browser.press('#reset')
    assert browser.text('#banner') == 'A second press resets /right/valve_driver.'
    show('/muscle')         # which the first press was not for
    browser.press('#reset')
    assert browser.text('#banner') == 'A second press resets /muscle/valve_driver.'
    assert rig.asked == []
    browser.press('#reset')
    browser.wait_for("document.querySelector('#banner').innerText.startsWith('Reset confirmed')")
    assert rig.asked == ['reset']


def test_it_comes_back_after_the_server_died(browser, rig):
    first = ViewServer(rig, port=0)
    first.start()
    browser.go_to(first.url)
    browser.wait_for(READY)
    first.stop()
    browser.wait_for("document.querySelector('#link').innerText === 'no connection'")
    assert browser.run("document.querySelector('#stop').disabled")
    second = ViewServer(rig, port=first.port)
    second.start()
    browser.wait_for("document.querySelector('#link').innerText === 'live'")
    now = browser.run('page.time?.now_s ?? 0')
    browser.wait_for(f'page.time && page.time.now_s > {now} + 0.2')
    assert not browser.run("document.querySelector('#stop').disabled")
    second.stop()


def test_on_a_phone_nothing_is_cut_and_the_stop_button_stays(browser, server, rig):
    feed_rules(rig.store, 0, 4000)
    browser.size(390, 844, phone=True)
    browser.go_to(server.url)
    browser.wait_for(f'{READY} && page.surfaces.length === 1 && page.surfaces[0].drawn !== null')
    assert 'orange adds, blue takes off' in browser.text('#rules')
    assert browser.run('document.documentElement.scrollWidth') <= 390
    browser.run('window.scrollTo(0, document.body.scrollHeight)')
    top, bottom = browser.run("""(() => { const box = document.querySelector('#stop')
        .getBoundingClientRect(); return [box.top, box.bottom]; })()""")
    assert 0 <= top < bottom < 200
    browser.size(1280, 900)


def test_a_bag_has_a_slider_and_colours_follow_the_system(browser, tmp_path):
    one = ViewServer(BagSource(load(write_bag(tmp_path / 'bag', 1600))), port=0)
    one.start()
    browser.dark(True)
    browser.go_to(one.url)
    browser.wait_for('page.time !== null && page.charts.length > 3')
    assert browser.run("document.querySelector('#stop').hidden")
    assert browser.run('getComputedStyle(document.body).backgroundColor') == 'rgb(20, 24, 27)'
    browser.run("""(() => { const slider = document.querySelector('#slider');
        slider.value = 2.5; slider.dispatchEvent(new Event('input')); })()""")
    browser.wait_for('Math.abs(page.time.end_s - 2.5) < 0.01')
    assert browser.text('#time') == '2.50 of 8.00 s'
    browser.press('#play')
    browser.wait_for('page.time.end_s > 3')
    browser.press('#play')
    assert browser.run('document.documentElement.scrollWidth') <= 1280
    browser.dark(False)
    assert browser.run('getComputedStyle(document.body).backgroundColor') == 'rgb(246, 247, 248)'
    one.stop()
