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

"""Primitives and experiment files: continuity, rates, seeds, and every way to get a file wrong."""

import math
import os
from pathlib import Path
import re
import subprocess
import sys
import textwrap

import numpy as np
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.chain import Chain, DOMAINS
from pam_actuation.experiments.primitives import make_primitive, PRIMITIVES
from pam_actuation.resources import list_config
from pam_sim.errors import InputError
import pytest

GUIDE = (Path(__file__).parents[2] / 'docs/guides/experiments.md').read_text(encoding='utf-8')
EXAMPLES = {
    'rest': {'duration_s': 1.0},
    'hold': {'duration_s': 1.0},
    'step': {'to_m': 0.01, 'duration_s': 1.0},
    'ramp': {'to_m': 0.01, 'duration_s': 1.0},
    'sine': {'center_m': 0.01, 'amplitude_m': 0.004, 'frequency_hz': 0.5, 'cycles': 2},
    'chirp': {'center_m': 0.01, 'amplitude_m': 0.004, 'from_hz': 0.1, 'to_hz': 2.0,
              'duration_s': 5.0},
    'triangle': {'low_m': 0.002, 'high_m': 0.02, 'period_s': 4.0, 'cycles': 2},
    'staircase': {'low_m': 0.0, 'high_m': 0.02, 'steps': 4, 'hold_s': 1.0},
    'increments': {'to_m': 0.02, 'steps': 3, 'move_s': 0.8, 'hold_s': 1.0},
    'random_steps': {'low_m': 0.0, 'high_m': 0.02, 'min_hold_s': 0.2, 'max_hold_s': 0.9,
                     'duration_s': 5.0, 'seed': 3},
    'multisine': {'center_m': 0.01, 'amplitude_m': 0.005, 'min_hz': 0.1, 'max_hz': 2.0,
                  'lines': 8, 'duration_s': 6.0, 'seed': 3},
    'decay': {'duration_s': 2.0},
    'knee_gait': {'low_m': 0.004, 'high_m': 0.02, 'frequency_hz': 0.8, 'cycles': 3},
    'pulses': {'height_m': 0.002, 'width_s': 0.5, 'every_s': 2.0, 'count': 3},
    'rates': {'low_m': 0.002, 'high_m': 0.02, 'slow_period_s': 8.0, 'fast_period_s': 2.0,
              'rates': 3},
    'triangle_loops': {'low_m': 0.002, 'high_m': 0.02, 'depth_m': 0.003, 'loops': 2,
                       'period_s': 8.0, 'cycles': 2},
    'samples': {'values_m': [0.003, 0.004, 0.009, 0.007, 0.007, 0.012, 0.005, 0.003],
                'every_s': 0.2,
                'cycles': 3},
    'two_bands': {'low_center_m': 0.006, 'high_center_m': 0.016, 'amplitude_m': 0.002,
                  'frequency_hz': 0.5, 'cycles': 2, 'move_s': 1.0},
}
SMOOTH = ('rest', 'hold', 'ramp', 'sine', 'chirp', 'increments', 'multisine', 'decay',
          'knee_gait', 'samples', 'two_bands')
NAMED = list_config('experiments')


def make(name):
    """Build the example of a primitive, starting from 3 mm."""
    return make_primitive(name, EXAMPLES[name], 0.003, 0.0, 'm')


def test_every_primitive_has_an_example():
    assert set(EXAMPLES) == set(PRIMITIVES), 'each primitive has its keys in EXAMPLES above'


@pytest.mark.parametrize('name', SMOOTH)
def test_rate_is_the_derivative_of_the_value(name):
    primitive = make(name)
    for k in range(1, 100):
        t = primitive.duration_s * k / 100
        if name == 'multisine' and min(abs(t - 1), abs(primitive.duration_s - 1 - t)) < 1e-3:
            continue                                # corner of the fade
        if name == 'samples' and primitive.at(t)[0] in (0.003, 0.012):
            continue                                # held within its values
        numeric = (primitive.at(t + 1e-6)[0] - primitive.at(t - 1e-6)[0]) / 2e-6
        assert primitive.at(t)[1] == pytest.approx(numeric, abs=1e-7)


def test_triangle_rate_and_turning_points():
    primitive = make('triangle')
    assert primitive.at(0.0) == (0.002, pytest.approx(0.009))
    assert primitive.at(2.0)[0] == pytest.approx(0.02)
    assert primitive.at(3.0) == (pytest.approx(0.011), pytest.approx(-0.009))
    assert primitive.end == pytest.approx(0.002)


def test_increments_end_where_they_should_and_hold_between():
    primitive = make('increments')
    assert primitive.duration_s == pytest.approx(5.4)
    assert primitive.at(0.0) == (pytest.approx(0.003), 0.0)
    for k in range(1, 4):
        for t in (1.8 * k - 0.9, 1.8 * k - 1e-6):
            assert primitive.at(t) == (pytest.approx(0.003 + 0.017 * k / 3), pytest.approx(0.0))
    assert primitive.end == pytest.approx(0.02)


def test_ramp_is_at_rest_at_both_ends_and_starts_where_the_last_ended():
    primitive = make('ramp')
    assert primitive.at(0.0) == (0.003, 0.0)
    assert primitive.at(1.0) == (pytest.approx(0.01), pytest.approx(0.0, abs=1e-12))


def test_triangle_with_loops_turns_where_it_should_at_one_rate():
    primitive = make('triangle_loops')
    assert primitive.rate == pytest.approx(0.0045)
    assert primitive.cycle_s == pytest.approx(8.0 + 4 * 2 * 0.003 / 0.0045)
    values = [primitive.at(0.001 * k)[0] for k in range(int(1000 * primitive.cycle_s))]
    turns = [b for a, b, c in zip(values, values[1:], values[2:]) if (b - a) * (c - b) < 0]
    expected = [0.008, 0.005, 0.014, 0.011, 0.02, 0.014, 0.017, 0.008, 0.011]
    assert turns == pytest.approx(expected, abs=1e-5)
    assert max(abs(b - a) for a, b in zip(values, values[1:])) <= 0.0045e-3 * (1 + 1e-9)
    assert primitive.end == 0.002


def test_rates_go_the_same_path_ever_faster():
    primitive = make('rates')
    assert primitive.all_periods_s == pytest.approx((8.0, 4.0, 2.0))
    assert primitive.duration_s == pytest.approx(14.0)
    assert primitive.at(4.0)[0] == pytest.approx(0.02)
    assert primitive.at(10.0)[0] == pytest.approx(0.02)
    assert primitive.at(13.0)[0] == pytest.approx(0.02)
    assert [abs(primitive.at(t)[1]) for t in (1.0, 9.0, 12.5)] == pytest.approx(
        [0.0045, 0.009, 0.018])


def test_two_bands_make_the_same_motion_twice():
    primitive = make('two_bands')
    for k in range(40):
        low, high = primitive.at(1.0 + 0.1 * k), primitive.at(6.0 + 0.1 * k)
        assert high[0] - low[0] == pytest.approx(0.01)
        assert high[1] == pytest.approx(low[1])
    assert primitive.at(0.0)[0] == 0.003 and primitive.end == pytest.approx(0.014)


def test_samples_go_through_every_value_and_cycles_join_without_a_corner():
    primitive = make('samples')
    assert primitive.duration_s == pytest.approx(4.2)
    assert primitive.periods == (pytest.approx(1.4), 3)
    for k in range(22):
        value = EXAMPLES['samples']['values_m'][k % 7]
        assert primitive.at(0.2 * k)[0] == pytest.approx(value, abs=1e-12)
    assert [primitive.at(1.4 + s)[1] for s in (-1e-7, 1e-7)] == pytest.approx([0.0] * 2, abs=1e-6)
    between = [primitive.at(0.001 * k)[0] for k in range(4201)]
    assert min(between) >= 0.003 and max(between) <= 0.012


def test_samples_of_a_smooth_motion_have_no_corners_in_their_rate():
    # Of 8 mm and 1 Hz: at most 0.316 m/s2. A monotone cubic jumped by 0.31 m/s2 where it turns.
    values = [0.012 + 0.008 * math.sin(2.0 * math.pi * 0.01 * k + 0.3) for k in range(201)]
    primitive = make_primitive('samples', {'values_m': values, 'every_s': 0.01}, 0.0, 0.0, 'm')
    rate = [primitive.at(0.05 + 0.001 * k)[1] for k in range(1900)]
    acceleration = [1e3 * (b - a) for a, b in zip(rate, rate[1:])]
    assert max(abs(b - a) for a, b in zip(acceleration, acceleration[1:])) < 0.03
    path = [primitive.at(0.001 * k)[0] for k in range(2001)]
    assert min(path) >= min(values) and max(path) <= max(values)


@pytest.mark.parametrize('cycles', [1, 2])
def test_samples_do_not_swing_beyond_a_step(cycles):
    values = [0.004] * 10 + [0.012] * 10 + [0.004]
    keys = {'values_m': values, 'every_s': 0.1, 'cycles': cycles}
    primitive = make_primitive('samples', keys, 0.0, 0.0, 'm')
    for k in range(2000 * cycles):
        place = int(k / 100) % 20
        low, high = sorted(values[place:place + 2])
        assert low - 8.1e-5 <= primitive.at(0.001 * k)[0] <= high + 8.1e-5


@pytest.mark.parametrize('keys, told', [
    ({'values_m': [0.001]}, 'has 1 values; allowed are 2 to 15000'),
    ({'values_m': [0.001, 'x']}, "item 2 of samples.values_m is 'x'; a finite number is needed"),
    ({'values_m': 0.001}, 'samples.values_m is 0.001; a list of numbers is needed'),
    ({'values_m': [0.001, 0.002], 'cycles': 2}, 'the last value must be the first'),
    ({'values_m': [0.001, 0.002], 'every_s': 0.001}, 'samples.every_s is 0.001; allowed is')])
def test_samples_that_make_no_path_are_refused(keys, told):
    with pytest.raises(InputError, match=re.escape(told)):
        make_primitive('samples', {'every_s': 0.1, **keys}, 0.0, 0.0, 'm')


def test_knee_gait_has_two_flexions_per_stride_and_stays_in_its_range():
    primitive = make('knee_gait')
    stride = [primitive.at(k / 800.0)[0] for k in range(1000)]
    assert min(stride) == pytest.approx(0.004, abs=1e-9)
    assert max(stride) == pytest.approx(0.02, abs=1e-6)
    peaks = [b for a, b, c in zip(stride, stride[1:], stride[2:]) if a < b >= c]
    assert len(peaks) == 2 and peaks[0] < 0.009 < peaks[1]
    assert primitive.at(0.0)[1] == pytest.approx(0.0, abs=1e-9)
    assert primitive.at(1.25) == pytest.approx(primitive.at(0.0), abs=1e-9)


def test_pulses_begin_each_interval_and_end_at_the_base():
    primitive = make('pulses')
    assert [primitive.at(t)[0] for t in (0.0, 0.49, 0.5, 1.9, 2.0, 4.2, 5.0)] == pytest.approx(
        [0.005, 0.005, 0.003, 0.003, 0.005, 0.005, 0.003])
    assert primitive.end == 0.003


@pytest.mark.parametrize('rest_s', [0.7, 1.0, 1.7])
@pytest.mark.parametrize('every, width', [(10, 1), (10, 5), (7, 3), (30, 2)])
def test_all_pulses_of_a_train_are_as_wide_as_asked(rest_s, every, width):
    keys = {'height_m': 0.01, 'width_s': width / 100, 'every_s': every / 100, 'count': 20}
    primitive, first = make_primitive('pulses', keys, 0.0, 0.0, 'm'), round(100 * rest_s)
    high = [k for k in range(21 * every)                 # the ticks of a reference at 100 Hz
            if primitive.at((first + k) * 10_000_000 * 1e-9 - rest_s)[0] > 0.0]
    assert high == [pulse * every + k for pulse in range(20) for k in range(width)]


def test_the_file_that_the_guide_shows_is_a_primitive(tmp_path):
    # A name that is free, should the example stand in the package.
    (tmp_path / 'own_sawtooth.py').write_text(re.search('```python\n(.*?)```', GUIDE, re.S)[1])
    code = ('from pam_actuation.experiments.primitives import PRIMITIVES, make_primitive\n'
            'keys = {"height_m": 0.003, "period_s": 1.0, "duration_s": 3.0}\n'
            'print(make_primitive("own_sawtooth", keys, 0.0, 0.0, "m").at(1.5)[0])')
    done = subprocess.run(
        [sys.executable, '-c', code], capture_output=True, text=True,
        env={**os.environ, 'PAM_PRIMITIVES_PATH': str(tmp_path)})
    assert done.stdout.strip() == '0.0015', done.stderr


def test_a_value_that_cannot_be_calculated_is_told_with_its_place(monkeypatch):
    class Inverse(PRIMITIVES['hold']):
        """A value without a limit at its start."""

        def at(self, t_s):
            return 1e-3 / t_s, 0.0

    monkeypatch.setitem(PRIMITIVES, 'inverse', Inverse)
    with pytest.raises(InputError, match='^here: inverse cannot be calculated with these keys: '):
        Chain(DOMAINS['contraction'], [('inverse', {'duration_s': 1.0}, 'here')])


def test_the_guide_shows_an_experiment_and_names_all():
    shown = re.search('^    name: my_loops\n(?:    .*\n)+', GUIDE, re.M)[0]
    experiment = load_experiment(textwrap.dedent(shown))
    assert (experiment.duration_s, experiment.needs) == (20.0, ('force',))
    assert not [name for name in NAMED if f'`{name}`' not in GUIDE]


def test_random_steps_follow_their_seed():
    same, other = make('random_steps'), dict(EXAMPLES['random_steps'], seed=4)
    times = [0.01 * k for k in range(500)]
    first = [make('random_steps').at(t)[0] for t in times]
    assert first == [same.at(t)[0] for t in times]
    different = make_primitive('random_steps', other, 0.0, 0.0, 'm')
    assert first != [different.at(t)[0] for t in times]
    assert all(0.0 <= v <= 0.02 for v in first)


def test_multisine_keeps_its_peak_bound():
    primitive = make('multisine')
    values = [primitive.at(0.001 * k)[0] for k in range(6001)]
    assert max(abs(v - 0.01) for v in values) <= 0.005 * 1.02


@pytest.mark.parametrize('seed', range(1, 4))
def test_multisine_exceeds_its_bound_by_what_the_guide_says(seed):
    keys = {'amplitude_m': 0.01, 'center_m': 0.02, 'min_hz': 0.5, 'max_hz': 1.0, 'lines': 3}
    one = make_primitive('multisine', {**keys, 'duration_s': 20.0, 'seed': seed}, 0.0, 0.0, 'm')
    highest = max(abs(one.at(0.01 * k)[0] - 0.02) for k in range(2001))
    assert 0.0 <= highest / 0.01 - 1.0 < 0.05
    assert '`amplitude` bounds the peak, to within 5 %' in GUIDE


@pytest.mark.parametrize('name', NAMED)
def test_named_experiments_load_and_round_trip(name):
    experiment = load_experiment(name)
    again = load_experiment(experiment.to_yaml())
    assert experiment.name == name
    times = [0.05 * k for k in range(int(experiment.duration_s / 0.05))]
    assert [experiment.at(t) for t in times] == [again.at(t) for t in times]


@pytest.mark.parametrize('name', NAMED)
def test_a_time_of_numpy_is_a_time(name):
    experiment = load_experiment(name)
    for t_s in np.linspace(-1.0, experiment.duration_s + 1.0, 60):
        assert experiment.at(t_s) == experiment.at(float(t_s))


def test_sine_experiment_states_its_cycles():
    start, period, count = load_experiment('sine_quarter_hz').cycles
    assert (start, period, count) == (6.0, 4.0, 10)
    assert load_experiment('knee_gait').periodic_parts == ((5.0, 2.0, 10), (25.0, 1.25, 10))


def test_experiment_is_continuous_but_for_steps():
    experiment = load_experiment('sine_quarter_hz')
    values = [experiment.at(0.001 * k)[0] for k in range(int(1000 * experiment.duration_s))]
    assert max(abs(b - a) for a, b in zip(values, values[1:])) < 2e-5


BAD = {
    'domain: torque\n':
        '`domain` is `torque`, allowed: contraction, force, joint_angle, pressure, ppr_voltage, '
        'hsv_duty',
    'sorts: 1\n': 'unknown key `sorts`',
    'segments: []\n': 'empty',
    'segments:\n  - jump: {to_m: 0.01}\n': 'unknown primitive `jump`',
    'segments:\n  - step: {to_pa: 0.01, duration_s: 1.0}\n': 'unknown key `to_pa` of step',
    'segments:\n  - step: {to_m: 0.01}\n': 'step lacks duration_s',
    'segments:\n  - step: {to_m: 0.3, duration_s: 1.0}\n': 'allowed for contraction is 0 to 0.25',
    'segments:\n  - step: {to_m: .nan, duration_s: 1.0}\n': 'finite number',
    'segments:\n  - hold: {duration_s: -1.0}\n': 'allowed is 0.01 to 3600 s',
    'segments:\n  - 7\n': 'one "primitive: {keys}" entry',
    'segments:\n  - hold: {duration_s: 1.0e+300}\n': 'allowed is 0.01 to 3600 s',
    'segments:\n  - sine: {center_m: 0.01, amplitude_m: 0.001, frequency_hz: 40, cycles: 2}\n':
        'allowed is 0.001 to 10 Hz',
    'segments:\n  - sine: {center_m: 0.12, amplitude_m: 0.1, frequency_hz: 9, cycles: 2}\n':
        'up to 1 m/s',
    'segments:\n  - staircase: {low_m: 0, high_m: 0.01, steps: 2.5, hold_s: 1}\n':
        'whole number',
    'segments:\n  - triangle: {low_m: 0.02, high_m: 0.01, period_s: 1, cycles: 1}\n':
        'low must be below high',
    'segments:\n  - knee_gait: {low_m: 0, high_m: 0.01, frequency_hz: 3, cycles: 1}\n':
        'walking is 0.5 to 1.2 Hz',
    'segments:\n  - decay: {duration_s: 1.0}\n': 'makes no sense in the domain contraction',
    'domain: ppr_voltage\nsegments:\n  - step: {to_v: 13, duration_s: 1}\n': '0 to 12 V',
    'domain: hsv_duty\nsegments:\n  - step: {to_duty: -2, duration_s: 1}\n': '-1 to 1 duty',
    'disturbance:\n  - hold: {duration_s: 2.0}\n': 'disturbance lasts 2 s',
    'disturbance:\n  - step: {to_n: 900, duration_s: 0.5}\n': '-200 to 200 N',
    'needs: [torque]\n': '`torque`',
}


@pytest.mark.parametrize('body', sorted(BAD))
def test_mistakes_are_refused_with_their_place(tmp_path, body):
    path = tmp_path / 'bad.yaml'
    text = 'name: bad\n' + body
    if 'segments' not in body:
        text += 'segments:\n  - rest: {duration_s: 1.0}\n'
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        load_experiment(str(path))
    assert BAD[body] in str(caught.value)
    assert 'bad.yaml' in str(caught.value)


def test_unknown_name_lists_what_exists():
    with pytest.raises(InputError) as caught:
        load_experiment('no_such_thing')
    assert 'sine_quarter_hz' in str(caught.value)


def test_before_and_after_the_experiment_the_reference_rests():
    experiment = load_experiment('short_sine')
    assert experiment.at(-1.0)[1] == 0.0
    assert experiment.at(1e6) == (pytest.approx(0.006), 0.0)
    assert math.isfinite(experiment.duration_s)
