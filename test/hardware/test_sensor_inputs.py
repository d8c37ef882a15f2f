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

"""Test analog inputs as sensors: straight lines, and refusals in one sentence."""

from contextlib import suppress
import math
import struct
from types import SimpleNamespace

from fake_sysfs import make_adc, put
from pam_actuation.hardware import sensor_input, waits
from pam_actuation.hardware.back_ends import open_sensors, parameters_of, SENSOR_INPUTS
from pam_actuation.hardware.sensor_input import NewReadings, SensorInput
from pam_actuation.hardware.sysfs import DeviceError
from pam_sim.errors import InputError
from pam_sim.units import P_ATM_PA
import pytest


def open_adc(root, **changes):
    values = {p.name: p.default for p in parameters_of(SENSOR_INPUTS)}
    values.update({'sysfs_root': str(root), 'adc.device': 'ads1115'})
    values.update({name.replace('__', '.'): value for name, value in changes.items()})
    return open_sensors('iio_adc', values)


def test_each_connected_sensor_has_its_line(tmp_path):
    make_adc(tmp_path, [2.0, 1.5, 0.5])
    sensors = open_adc(
        tmp_path, pressure__channel=0, pressure__pa_at_0_v=5e4, pressure__pa_per_v=2e5,
        force__channel=1, force__n_at_0_v=-10.0, force__n_per_v=40.0,
        contraction__channel=2, contraction__m_per_v=-0.02)
    assert sensors.topics == ('pressure', 'contraction', 'force')
    assert sensors.read('pressure') == pytest.approx(4.5e5)
    assert sensors.read('force') == pytest.approx(50.0)
    assert sensors.read('contraction') == pytest.approx(-0.01)


def test_the_offset_of_a_channel_is_added_before_scaling(tmp_path):
    path, = make_adc(tmp_path, [1.0])
    put(path.with_name('in_voltage0_offset'), 1000)
    sensors = open_adc(tmp_path, pressure__channel=0, pressure__pa_at_0_v=0.0)
    assert sensors.read('pressure') == pytest.approx(1.5e5)


def test_a_sensor_that_falls_silent_is_told_and_comes_back(tmp_path):
    path, = make_adc(tmp_path, [1.0])
    sensors = open_adc(tmp_path, pressure__channel=0)
    path.rename(path.with_name('away'))
    with pytest.raises(DeviceError, match='in_voltage0_raw.*No such file'):
        sensors.read('pressure')
    path.with_name('away').rename(path)
    assert sensors.read('pressure') == pytest.approx(P_ATM_PA + 1e5)


@pytest.mark.parametrize('changes, words', [
    ({}, 'no sensor is connected'),
    ({'pressure__channel': 5}, 'in_voltage5_raw: there is no such channel'),
    ({'pressure__channel': 0, 'adc__device': ''}, 'adc.device: the name of the device is needed'),
    ({'pressure__channel': 0, 'pressure__pa_per_v': 0.0}, 'pressure.pa_per_v: 0 is not allowed'),
    ({'pressure__channel': 1}, "'broken' is not a number"),
    ({'pressure__channel': 0, 'force__channel': 0},
     'parameter force.channel: 0 is that of pressure already'),
])
def test_sensors_that_are_not_usable_are_one_sentence(tmp_path, changes, words):
    put(make_adc(tmp_path, [1.0, 1.0])[1], 'broken')
    with pytest.raises(InputError) as told:
        open_adc(tmp_path, **changes)
    assert words in str(told.value) and '\n' not in str(told.value)


def test_a_scale_that_is_no_scale_is_refused(tmp_path):
    path, = make_adc(tmp_path, [1.0])
    put(path.with_name('in_voltage_scale'), 0)
    with pytest.raises(InputError, match='scale of 0.0 mV is not above 0'):
        open_adc(tmp_path, pressure__channel=0)


def test_sensors_that_are_not_there_read_a_muscle_at_rest():
    sensors = open_sensors('dummy', {})
    assert {topic: sensors.read(topic) for topic in sensors.topics} == {
        'pressure': P_ATM_PA, 'contraction': 0.0, 'force': 0.0}


class SlowCell(SensorInput):
    """A load cell with a new value now and then."""

    topics = ('force',)

    def read(self, topic):
        reading = self.values['next'].pop(0)
        if isinstance(reading, BaseException):
            raise reading
        return reading


def test_only_what_is_new_is_taken_with_the_time_it_was_measured():
    begin_ns, ms = 1_700_000_000 * 10 ** 9, 10 ** 6
    given = [None, (5.0, begin_ns + ms), (5.0, begin_ns + ms), (5.0, begin_ns + 9 * ms),
             OSError('gone'), SystemExit(3), 'text', struct.error('4 bytes'), 7]
    readings = NewReadings(SlowCell({'next': given}), begin_ns)
    now_ns = [begin_ns + k * 4 * ms for k in range(1, 10)]
    assert [readings.take('force', now_ns[k]) for k in range(4)] == [
        None, (5.0, begin_ns + ms), None, (5.0, begin_ns + 9 * ms)]
    for k, words in ((4, 'back end SlowCell: OSError: gone'), (5, 'SystemExit: 3'),
                     (6, 'could not convert'), (7, 'struct.error: 4 bytes')):
        with pytest.raises(DeviceError, match=words):
            readings.take('force', now_ns[k])
    assert readings.take('force', now_ns[8]) == (7.0, now_ns[8])
    given += [7.5, None, None]
    back_ns = now_ns[8] - 3600 * 1000 * ms          # a clock that was set back
    assert readings.take('force', back_ns) == (7.5, back_ns)
    now_ns[7] = back_ns
    assert readings.take('force', now_ns[7] + 900 * ms) is None
    with pytest.raises(DeviceError, match='force: no new value for 1 s; check cable'):
        readings.take('force', now_ns[7] + 1100 * ms)


@pytest.mark.parametrize('topic, steps, sentence', [
    ('contraction', (0.0, 0.0029, 0.0, 0.028), 'contraction jumped by 28.0 mm in 4 ms'),
    ('contraction', (0.010, -0.005), 'contraction jumped by -15.0 mm in 4 ms'),
    ('joint_state', (0.0, 0.05, 0.3), 'joint_state jumped by 0.2 rad in 4 ms'),
    ('force', (0.0, 500.0), ''), ('contraction', (0.0, 0.0035, 0.0065), '')])
def test_a_jump_that_is_no_motion_is_told_for_a_minute(topic, steps, sentence):
    ms = 10 ** 6
    now_ns = 1_700_000_000 * 10 ** 9
    cell = SlowCell({'next': [*steps]})
    cell.topics = (topic,)
    readings = NewReadings(cell, now_ns)
    for _ in steps:
        assert readings.jump(now_ns) == ''
        now_ns += 4 * ms
        readings.take(topic, now_ns)
    assert readings.jump(now_ns).startswith(sentence) and readings.jumps == bool(sentence)
    assert bool(readings.jump(now_ns + 59_000 * ms)) == bool(sentence)
    assert readings.jump(now_ns + 61_000 * ms) == ''


@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf])
def test_a_reading_that_is_no_number_is_told_and_published(value):
    ms = 10 ** 6
    now_ns = 1_700_000_000 * 10 ** 9
    cell = SlowCell({'next': [0.0, value, value, 0.0001, value, 0.028]})
    cell.topics = ('contraction',)
    readings = NewReadings(cell, now_ns)
    readings.take('contraction', now_ns)
    assert readings.no_number(now_ns) == ''
    for _ in range(2):
        now_ns += 4 * ms
        # The driver is to notice it; without any pressure it would drive a regulator.
        assert str(readings.take('contraction', now_ns)) == str((value, now_ns))
    said = f'contraction reads {value}, which is no number'
    assert readings.no_number(now_ns) == said and readings.not_finite == 2
    assert readings.take('contraction', now_ns + 4 * ms) and readings.jumps == 0
    assert readings.no_number(now_ns + 1001 * ms) == ''
    said = f'contraction read {value} within the last minute'
    assert readings.was_no_number(now_ns + 59_000 * ms) == said
    assert readings.was_no_number(now_ns + 61_000 * ms) == ''
    for later in (8, 12):                                   # lost its index behind it
        readings.take('contraction', now_ns + later * ms)
    assert readings.jumps == 1
    assert readings.jump(now_ns + 12 * ms).startswith('contraction jumped by 27.9 mm in 8 ms')


@pytest.mark.parametrize('stamp', [
    1_700_000_000, 4321 * 10 ** 9, -5, 1_700_000_000_000_000, 1_700_000_061 * 10 ** 9,
    1_700_000_000.5])
def test_a_reading_with_the_time_of_another_clock_is_told(stamp):
    """Seconds, the time since the start of the computer, microseconds, a minute ahead."""
    now_ns = 1_700_000_000 * 10 ** 9
    given = [(5.0, stamp), (5.0, stamp + 1), (5.0, now_ns)]
    readings = NewReadings(SlowCell({'next': given}), now_ns)
    assert readings.another_clock(now_ns) == ''
    # The driver is to notice a pressure that is too old; without any it would drive a regulator.
    assert readings.take('force', now_ns) == (5.0, int(stamp))
    said = readings.another_clock(now_ns)
    assert said.startswith(f'force is stamped {int(stamp)} ns, which is not') and 'time_ns' in said
    readings.take('force', now_ns)
    assert readings.another_clock(now_ns) == said       # no flood of numbers
    assert readings.take('force', now_ns) == (5.0, now_ns)
    assert readings.another_clock(now_ns + 2 * 10 ** 9) == ''


@pytest.mark.parametrize('stamp', [float('nan'), None, 'now'])
def test_a_stamp_that_is_no_number_is_told(stamp):
    readings = NewReadings(SlowCell({'next': [(5.0, stamp)]}), 0)
    with pytest.raises(DeviceError, match='back end SlowCell: (Value|Type)Error'):
        readings.take('force', 10 ** 9)


@pytest.mark.parametrize('fails', [False, True])
def test_a_read_that_waits_is_told_for_a_minute(fails, monkeypatch):
    cell, now_ns, clock_s = SlowCell({}), 1_700_000_000 * 10 ** 9, [0.0]
    clock = SimpleNamespace(monotonic=lambda: clock_s[0])
    for module in (sensor_input, waits):
        monkeypatch.setattr(module, 'time', clock)
    readings = NewReadings(cell, now_ns)

    def read(waits_s):
        def waiting(topic):
            clock_s[0] += waits_s
            if fails:
                raise TimeoutError('no answer')
            return 7.0

        cell.read = waiting
        with suppress(DeviceError):
            readings.take('force', now_ns)
        return readings.waits.says

    assert read(0.09) == '' and readings.waits.count == 0
    said = read(2.0)
    assert said == 'the back end took 2.0 s to read force' and readings.waits.count == 1
    clock_s[0] += 59.0
    assert read(0.2) == said and readings.waits.count == 2      # the longest
    clock_s[0] += 61.0
    assert readings.waits.says == ''
    assert read(0.3) == 'the back end took 0.3 s to read force'


def test_a_back_end_slower_than_the_period_is_told_until_it_keeps_up(monkeypatch):
    clock_s = [0.0]
    monkeypatch.setattr(waits, 'time', SimpleNamespace(monotonic=lambda: clock_s[0]))
    noted = waits.Waits()

    def behind(call_s, times=400):
        for _ in range(times):
            begun_s = clock_s[0]
            clock_s[0] += call_s
            noted.note(begun_s, 'read force')
        return noted.behind(0.004, 3, 'read all sensors')

    assert behind(0.02, 49) == '' and behind(0.001) == ''       # at the start, and kept up
    said = behind(0.0014)
    assert said == ('the back end takes 4.2 ms to read all sensors, longer than the period of '
                    '4 ms')
    assert behind(0.0016) == said == behind(0.0012)             # no flood of numbers
    assert behind(0.01).startswith('the back end takes 30 ms')
    assert behind(0.001) == '' and noted.count == 0 and noted.says == ''


@pytest.mark.parametrize('topic, told', [('contraction', True), ('force', False)])
def test_new_values_that_come_too_seldom_are_told_until_they_come_faster(topic, told):
    now_ns, every_ns = 1_700_000_000 * 10 ** 9, 4 * 10 ** 6
    cell = SlowCell({})
    cell.topics = (topic,)
    readings = NewReadings(cell, now_ns)

    def after(seconds, share):
        """Ask at 250 Hz, where one of ``share`` values is new."""
        nonlocal now_ns
        for k in range(round(250 * seconds)):
            now_ns += every_ns
            cell.read = lambda topic, k=k: None if k % share else 0.001
            readings.take(topic, now_ns)
        return readings.slow

    assert after(5, 1) == ''
    said = after(5, 6)                      # 42 Hz
    assert bool(said) == told
    if told:
        assert said == 'contraction has a new value at 42 Hz only, needed are 100 Hz or more'
    assert after(5, 7) == said and after(5, 1) == ''        # no flood of numbers
    now_ns += 10 ** 9
    assert after(5, 1) == ''


def with_topics(topics):
    """Return a back end that publishes some topics, and notes that it was closed."""
    class Board(SensorInput):
        closed = 0

        def __init__(self, values):
            self.topics = topics        # values are of no use here

        def read(self, topic):
            raise OSError('no such board')

        def close(self):
            Board.closed += 1

    return Board


@pytest.mark.parametrize('topics', [
    'pressure', (), None, ('pressure', 'temperature'), ('pressure', 'pressure'),
    ('joint_state',), ('pressure_command',), ([],)])
def test_topics_that_no_sensor_of_a_muscle_has_are_refused(topics, monkeypatch):
    board = with_topics(topics)
    monkeypatch.setitem(SENSOR_INPUTS, 'board', board)
    with pytest.raises(InputError) as told:
        open_sensors('board', {})
    if topics == ([],):
        assert 'TypeError' in str(told.value)
        return
    assert str(told.value).startswith(f'back end Board: its topics are {topics!r}; needed is a')
    assert "such as ('pressure',)" in str(told.value) and board.closed == 1


def test_a_back_end_that_keeps_no_values_is_told_by_what_it_raises(monkeypatch):
    monkeypatch.setitem(SENSOR_INPUTS, 'board', with_topics(('pressure', 'force')))
    sensors = open_sensors('board', {})
    with pytest.raises(DeviceError, match='back end Board: OSError: no such board'):
        NewReadings(sensors, 0).take('pressure', 0)


def test_garbage_of_a_board_is_told_with_its_parameters(tmp_path, monkeypatch):
    def garbage(self, topic):
        raise ConnectionError('no such board')
    path, = make_adc(tmp_path, [1.0])
    monkeypatch.setattr(SENSOR_INPUTS['iio_adc'], 'read', garbage)
    with pytest.raises(InputError) as told:
        open_adc(tmp_path, pressure__channel=0)
    assert str(told.value) == (
        f'back end IioAdc (sysfs_root {tmp_path}, adc.device ads1115, pressure.channel 0): '
        'ConnectionError: no such board')
