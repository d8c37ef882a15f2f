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

"""A run that is ahead of its reference, as its preview is too long, says so."""

import json

import numpy as np
from pam_actuation.cli.main import main
from pam_actuation.report.ahead import find_ahead
import pytest

TIME_S = np.arange(0.0, 25.0, 0.01)
NOISE = 0.05 * np.random.default_rng(2).standard_normal(TIME_S.size)


def motion(later_s=0.0):
    """Return a motion that does not repeat, some time later."""
    t_s = TIME_S + later_s
    return sum(np.sin(2.0 * np.pi * hz * t_s + 7.0 * hz) for hz in (0.31, 0.73, 1.17, 1.61))


@pytest.mark.parametrize('ahead_s', [0.02, 0.05, 0.12])
def test_the_time_ahead_is_found_with_what_it_costs(ahead_s):
    found = find_ahead((TIME_S, motion()), (TIME_S, motion(ahead_s) + NOISE))
    assert found[0] == pytest.approx(ahead_s, abs=0.005)
    assert found[1] > 2.0 * found[2] and found[2] == pytest.approx(0.05, rel=0.2)


@pytest.mark.parametrize('moved', [
    motion(), motion(-0.06), motion(0.01), 0.8 * motion(), motion() + 0.5,
    motion(0.02) + 20.0 * NOISE])
def test_what_is_late_or_off_in_another_way_is_not_ahead(moved):
    assert find_ahead((TIME_S, motion()), (TIME_S, moved + NOISE)) is None


def test_nothing_is_said_of_steps_and_short_runs():
    steps = 3.0 * (TIME_S // 2.0 % 2)
    assert find_ahead((TIME_S, steps), (TIME_S, np.roll(steps, -5))) is None
    short = slice(0, 700)
    assert find_ahead((TIME_S[short], motion()[short]), (
        TIME_S[short], motion(0.05)[short])) is None


def test_simulate_and_report_tell_of_a_preview_that_is_too_long(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for lead_s, told in ((0.4, 1), (0.13, 0)):
        (tmp_path / 'own.yaml').write_text(
            f'controller: pid\nsettings: {{use_static_inverse: 1, lead_s: {lead_s}, '
            'proportional_pa_per_m: 2.0e+6, integral_pa_per_m_s: 2.0e+7}\n')
        assert main(['simulate', 'sine_half_hz', '--controller', 'own.yaml', '--out', 'bag',
                     '--overwrite', '--json']) == 0
        said = [one for one in json.loads(capsys.readouterr().out)['remarks']
                if 'ahead of its reference' in one]
        assert len(said) == told
        assert main(['report', 'bag', '--out', 'page.html', '--overwrite', '--json']) == 0
        assert [f'bag: {one}' for one in said] == [
            one for one in json.loads(capsys.readouterr().out)['remarks']
            if 'ahead of its reference' in one]
        assert ('Ahead of the reference' in (tmp_path / 'page.html').read_text()) == bool(told)
        for one in said:
            assert f'lead_s of {lead_s} s, is too long for this rig' in one
