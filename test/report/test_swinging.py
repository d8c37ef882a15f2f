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

"""A run that swings at a frequency nobody asked for is told; one that is only late is not."""

from types import SimpleNamespace

import numpy as np
from pam_actuation.cli.main import main
from pam_actuation.report.swinging import find_swinging, swinging, swinging_section
import pytest

TIME_S = np.arange(0.0, 24.0, 0.01)
NOISE = 0.02 * np.random.default_rng(3).standard_normal(TIME_S.size)


def sine(amplitude, hz, begin_s=0.0, end_s=24.0):
    """Return a sine within a span of time."""
    return amplitude * np.sin(2.0 * np.pi * hz * TIME_S) * (
        (TIME_S >= begin_s) & (TIME_S < end_s))


def steps(size=8.0, hold_s=2.0):
    """Return jumps to and fro."""
    return size * ((TIME_S // hold_s) % 2)


def ringing(wanted, hz=4.0, decay_s=0.25):
    """Return the answer of a load that overshoots each jump and comes to rest."""
    jumps = np.diff(wanted, prepend=0.0)
    answer = 1.0 - np.exp(-TIME_S / decay_s) * np.cos(2.0 * np.pi * hz * TIME_S)
    return np.convolve(jumps, answer)[:TIME_S.size]


@pytest.mark.parametrize('wanted', [sine(8.0, 0.5), steps(), np.zeros(TIME_S.size)])
def test_a_swing_is_found_with_its_size_frequency_and_time(wanted):
    found = find_swinging(TIME_S, wanted, wanted + sine(3.0, 4.2, 9.0, 20.0) + NOISE, 0.5, 'mm')
    assert found.amplitude == pytest.approx(3.0, rel=0.15)
    assert found.frequency_hz == pytest.approx(4.2, abs=0.1)
    assert found.begin_s == pytest.approx(9.0, abs=2.1)
    assert found.end_s == pytest.approx(20.0, abs=2.1)


@pytest.mark.parametrize('wanted, measured', [
    (sine(8.0, 0.5), sine(8.0, 0.5)),
    (sine(8.0, 2.0), np.roll(sine(6.0, 2.0), 12)),                    # late and too small
    (sine(8.0, 0.5), np.clip(sine(8.0, 0.5), -5.0, 5.0)),             # at a limit
    (steps(), ringing(steps())),                                      # overshoots, comes to rest
    (sine(8.0, 0.5), sine(8.0, 0.5) + sine(3.0, 4.2, 9.0, 12.0)),     # for a moment
    (sine(8.0, 0.5), sine(8.0, 0.5) + sine(0.3, 4.2)),                # little
    (np.zeros(TIME_S.size), 3.0 * np.exp(-TIME_S / 10.0)),            # creep
    (sine(8.0, 0.5), sine(8.0, 0.5) * np.nan)])
def test_what_is_late_at_a_limit_or_settles_is_no_swing(wanted, measured):
    assert find_swinging(TIME_S, wanted, measured + NOISE, 0.5) is None


def run_of(swing_m, pushed_n=0.0):
    """Return a run that follows a sine, with a swing beside it."""
    wanted_m = 1e-3 * sine(8.0, 0.5)
    names = {'reference': ('contraction_m', wanted_m),
             'contraction': ('contraction_m', wanted_m + swing_m / 3.0 * sine(3.0, 4.2)),
             'external_force': ('force_n', np.full(TIME_S.size, pushed_n))}
    topics = {topic: SimpleNamespace(stamp_ns=np.round(1e9 * TIME_S).astype(np.int64),
                                     values={field: values})
              for topic, (field, values) in names.items()}
    return SimpleNamespace(topics=topics, metadata={}, namespace='/muscle')


def test_the_sentence_tells_size_frequency_and_what_to_do():
    said = swinging(run_of(0.003))
    assert said.startswith('the muscle swings by ± 3.0 mm at 4.2 Hz, from 0 to 2')
    assert 'pam tune --model RIG' in said
    assert 'swings by' in swinging_section([('first', run_of(0.003))]).body
    assert swinging_section([('first', run_of(0.0))]) is None
    assert not swinging(run_of(0.003, pushed_n=5.0))        # of what pushes it nothing is said


def test_simulate_and_report_tell_of_a_controller_that_swings(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'wild.yaml').write_text(
        'controller: pid\n'
        'settings: {proportional_pa_per_m: 3.0e+7, integral_pa_per_m_s: 1.0e+8}\n')
    assert main(['simulate', 'sine_half_hz', '--controller', 'wild.yaml', '--out', 'wild']) == 0
    assert 'remark: the muscle swings by ±' in capsys.readouterr().out
    assert main(['report', 'wild', '--out', 'wild.html']) == 0
    assert 'remark: wild: the muscle swings by ±' in capsys.readouterr().out
    assert 'the muscle swings by' in (tmp_path / 'wild.html').read_text()
    assert main(['simulate', 'sine_half_hz', '--out', 'calm']) == 0
    assert 'swings' not in capsys.readouterr().out
