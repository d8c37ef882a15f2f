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

"""A bag says how far the run came and why it ended, and every verb that reads it does."""

import json
from pathlib import Path
import re
import signal
import subprocess
import sys
import time

from pam_actuation.bags.ending import Ending, ending_of, EndWatch
from pam_actuation.bags.info import bag_info, render_text
from pam_actuation.bags.load import load_run
from pam_actuation.cli.main import main
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.messages import Status
from pam_sim import load_rig
import pytest
from sample_bag import write_bag

TRACK = """\
name: track
domain: contraction
segments:
  - rest: {duration_s: 0.5}
  - sine: {center_m: 0.010, amplitude_m: 0.005, frequency_hz: 0.5, cycles: 7}
"""
LONG = 'name: long\ndomain: pressure\nsegments:\n  - rest: {duration_s: 900.0}\n'
INCREMENTS = """
name: few_increments
domain: pressure
segments:
  - rest: {duration_s: 2.0}
  - increments: {to_pa: 701325.0, steps: 6, move_s: 0.7, hold_s: 1.8}
"""
OLDER = Path(__file__).resolve().parents[1] / 'replay' / 'older' / 'pid_ppr.mcap'


@pytest.fixture(scope='module')
def stopped(tmp_path_factory):
    """Return a bag whose simulation was stopped after 9 of 14.5 s."""
    from pam_actuation.control.config import load_controller

    def stop(done_s):
        if done_s >= 9:
            raise KeyboardInterrupt

    rig = load_rig('dmsp_5_300_realistic')
    out = tmp_path_factory.mktemp('stopped') / 'bag'
    with pytest.raises(KeyboardInterrupt):
        simulate_experiment(load_experiment(TRACK), rig, load_controller('sofc_ppr', rig), out,
                            progress=stop)
    return out


def test_ctrl_c_leaves_a_bag_that_says_so(tmp_path):
    """A real process and a real signal, while the messages are being written."""
    (tmp_path / 'long.yaml').write_text(LONG)
    process = subprocess.Popen(
        [sys.executable, '-m', 'pam_actuation.cli.main', 'simulate', 'long.yaml', '--out', 'bag'],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    file, deadline = tmp_path / '.unfinished-bag' / 'bag_0.mcap', time.monotonic() + 60.0
    while not (file.exists() and file.stat().st_size > 300_000) and time.monotonic() < deadline:
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate()
    assert process.returncode == 130
    assert re.fullmatch(r'pam simulate: stopped; the bag .*/bag holds \d+\.\d of 900\.0 s\n', said)
    info = bag_info(tmp_path / 'bag')
    assert info.complete is False and info.has_findings and info.lost == 0
    assert info.ending.ended == 'interrupted' and info.ending.planned_s == 900.0
    assert abs(info.ending.reached_s - info.duration_s) < 0.2
    assert (f'Stopped early after {info.ending.reached_s:.1f} s of 900.0 s planned: interrupted.'
            ) in render_text(info)
    assert 'Nothing is known to be missing' not in render_text(info)


def test_every_verb_says_that_the_run_stopped_early(stopped, tmp_path, capsys):
    sentence = 'Stopped early after 9.0 s of 14.5 s planned: interrupted.'
    out = tmp_path / 'out'
    for arguments, code in (
            (['info', stopped], 1), (['replay', stopped], 0),
            (['report', stopped, '--out', tmp_path / 'page.html'], 0),
            (['gap', stopped, '--seconds', 1, '--effects', 'coulomb_friction', '--out', out], 0),
            (['tune', stopped, '--rollouts', 10, '--out', tmp_path / 'tuned.yaml'], None)):
        got = main([str(word) for word in arguments])
        shown = capsys.readouterr().out
        assert sentence in shown, arguments
        assert got == code if code is not None else got in (0, 1)
    for page in (tmp_path / 'page.html', out / 'report.html'):
        assert sentence in page.read_text()
    assert main(['info', str(stopped), '--json']) == 1
    found = json.loads(capsys.readouterr().out)
    assert found['complete'] is False and found['ending']['ended'] == 'interrupted'
    assert found['ending']['reached_s'] == pytest.approx(9.0, abs=0.02)


def test_characterise_says_it_too(tmp_path, capsys):
    from pam_actuation.experiments.load_series import simulate_loads, with_sensor_noise
    rig = with_sensor_noise(load_rig('dmsp_5_300_hanging_mass'))
    short = tmp_path / 'short.yaml'
    short.write_text(INCREMENTS)
    bags = simulate_loads(rig, tmp_path / 'bags', loads_n=(0.0, 40.0, 80.0), jobs=1,
                          experiment=str(short))
    assert all(ending_of(load_run(bag).metadata).ended == 'complete' for bag in bags)

    def stop(done_s):
        if done_s >= 14:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt, match=r'holds 14\.0 of 17\.0 s'):
        simulate_experiment(load_experiment(short), rig, None, tmp_path / 'bags' / 'cut',
                            progress=stop)
    assert main(['characterise', *bags, str(tmp_path / 'bags' / 'cut'), '--load-n', '0', '40',
                 '80', '49.05', '--out', str(tmp_path / 'out')]) == 0
    words = 'cut: Stopped early after 14.0 s of 17.0 s planned: interrupted.'
    assert words in capsys.readouterr().out
    assert words in (tmp_path / 'out' / 'report.html').read_text()


def test_a_run_to_its_end_says_that(tmp_path):
    text = TRACK.replace('cycles: 7', 'cycles: 1')
    from pam_actuation.control.config import load_controller
    rig = load_rig('dmsp_5_300_realistic')
    simulate_experiment(
        load_experiment(text), rig, load_controller('pid', rig), tmp_path / 'bag')
    info = bag_info(tmp_path / 'bag')
    assert info.ending == Ending(2.5, 2.5, 'complete')
    assert info.ending.sentence == 'Ran to its end: 2.5 s planned and reached.'
    assert info.complete and not info.remarks


def test_a_bag_of_before_is_read_and_its_length_is_not_known():
    assert ending_of(load_run(OLDER).metadata) == Ending()
    info = bag_info(OLDER)
    assert 'Length planned: not recorded.' in render_text(info)
    assert not info.ending.early and info.complete is not False


@pytest.mark.parametrize('texts', [
    {'planned_length_s': 'long', 'ended': 'never'}, {'planned_length_s': '-1'},
    {'planned_length_s': 'nan', 'reached_length_s': 'inf'}, None])
def test_entries_of_others_are_not_believed(texts):
    assert ending_of(texts) == Ending()


def said(by, message, at_s, level=0, **values):
    return [Status(round(at_s * 1e9), level, f'/muscle/{by}', message,
                   tuple((key, str(value)) for key, value in values.items()))]


def watch(*heard):
    """Return an EndWatch that has heard words of reference generator and driver."""
    made = EndWatch('/muscle')
    made.hear(said('valve_driver', 'no valid command yet (venting)', 0.0, 1))
    for statuses in heard:
        made.hear(statuses)
    return made


PLAYING = said('reference_generator', 'playing sine', 10.0, elapsed_s=0.5)
VENTED = said('valve_driver', 'vented because the reading is above the limit', 12.0, 2)


@pytest.mark.parametrize(('heard', 'ending'), [
    ((), Ending(8.0)),
    ((PLAYING,), Ending(8.0, 0.5, 'interrupted')),
    ((PLAYING, said('reference_generator', 'deactivated', 13.0, elapsed_s=3.5), VENTED),
     Ending(8.0, 3.5, 'interrupted')),
    ((PLAYING, said('reference_generator', 'finished sine', 18.0, elapsed_s=8.01), VENTED),
     Ending(8.0, 8.0, 'complete')),
    ((PLAYING, VENTED, said('reference_generator', 'finished sine', 18.0, elapsed_s=8.0)),
     Ending(8.0, 2.5, 'vented', 'vented because the reading is above the limit')),
    ((PLAYING, VENTED, said('valve_driver', 'following', 12.5),
      said('reference_generator', 'finished sine', 18.0, elapsed_s=8.0)),
     Ending(8.0, 8.0, 'complete', vents='/muscle/valve_driver vented once, 0.5 s in all, first '
            'at 2.5 s: vented because the reading is above the limit')),
    # Of a joint the driver of one muscle follows again, that of the other does not.
    ((PLAYING, said('flexor/valve_driver', 'vented', 12.0, 2),
      said('extensor/valve_driver', 'stopped', 11.0, 2),
      said('extensor/valve_driver', 'following', 12.5),
      said('reference_generator', 'finished sine', 18.0, elapsed_s=8.0)),
     Ending(8.0, 2.5, 'vented', 'vented', '/muscle/extensor/valve_driver vented once, 1.5 s in '
            'all, first at 1.5 s: stopped')),
    ((PLAYING, said('reference_generator', 'the loop of this node failed: x', 13.0, 2)),
     Ending(8.0, 0.5, 'error', 'the loop of this node failed: x')),
    ((said('reference_generator', 'nothing is measured', 10.0, 2),),
     Ending(8.0, 0.0, 'error', 'nothing is measured')),
    ((said('reference_generator', 'cannot configure', 9.0, 2), PLAYING),
     Ending(8.0, 0.5, 'interrupted'))])
def test_a_live_run_is_judged_by_what_its_nodes_say(heard, ending):
    assert watch(*heard).ending(8.0) == ending


def test_each_reason_of_a_vent_is_told_once_in_order():
    stale = said('valve_driver', 'stale', 13.0, 2)
    made = watch(PLAYING, said('flexor/valve_driver', 'stopped', 12.5, 2), VENTED,
                 said('valve_driver', 'following', 12.6), stale,
                 said('valve_driver', 'following', 13.1), stale)
    assert made.faults == ['/muscle/valve_driver: vented because the reading is above the limit',
                           '/muscle/flexor/valve_driver: stopped', '/muscle/valve_driver: stale']
    assert watch(PLAYING).faults == [] == watch(VENTED).faults


def test_who_ended_the_run_knows_better():
    told = Ending(ended='error', because='sofc_controller was ended by SIGKILL.')
    found = watch(PLAYING, VENTED).ending(8.0, told)
    assert found.ended == 'error' and found.reached_s == 0.5
    assert found.sentence == (
        'Stopped early after 0.5 s of 8.0 s planned: an error ended it '
        '(sofc_controller was ended by SIGKILL).')


def test_a_node_that_died_is_told_with_its_own_reason_if_it_said_one():
    told = Ending(ended='error', because='reference_generator ended with exit code 1')
    assert watch(PLAYING).ending(8.0, told) == Ending(8.0, 0.5, 'error', told.because)
    failed = watch(said('reference_generator', 'nothing is measured', 10.0, 2))
    assert failed.ending(8.0, told) == Ending(8.0, 0.0, 'error', 'nothing is measured')


def test_a_vent_in_the_run_is_a_remark(tmp_path):
    again = [said('valve_driver', 'stale', 14.0, 2), said('valve_driver', 'following', 14.2)]
    ending = watch(PLAYING, VENTED, said('valve_driver', 'following', 12.5), *again, said(
        'reference_generator', 'finished sine', 18.0, elapsed_s=8.0)).ending(8.0)
    info = bag_info(write_bag(tmp_path / 'bag', 50, metadata=ending.texts()))
    assert info.ending == ending
    words = ('In the run /muscle/valve_driver vented 2 times, 0.7 s in all, first at 2.5 s: '
             'vented because the reading is above the limit.')
    assert words in info.remarks and info.has_findings
    assert 'Ran to its end' in render_text(info)
