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

"""Test the outputs a valve hangs on with files in place of devices: values, order, refusals."""

import gc
import subprocess
import sys
import threading
import time

from fake_sysfs import (
    break_attribute, DAC_SCALE_MV, duties, export, make_dac, make_pwm, number_in, PERIOD_NS, put)
from pam_actuation.drivers.config import DriverConfig
from pam_actuation.hardware import sysfs
from pam_actuation.hardware.back_ends import open_valve, parameters_of, VALVE_OUTPUTS
from pam_actuation.hardware.claim import Claim
from pam_actuation.hardware.sysfs import DeviceError
from pam_sim.errors import InputError
import pytest

SAFE = {'ppr': (0.0,), 'hsv': (0.0, 1.0)}
BACK_END = {'ppr': 'iio_dac', 'hsv': 'pwm_sysfs'}

FAILING = """
from pam_actuation.drivers.config import DriverConfig
from pam_actuation.hardware.iio_dac import IioDac
from pam_actuation.hardware.valve_output import GuardedOutput
values = {{'sysfs_root': {root!r}, 'dac.device': 'mcp4725', 'dac.channel': 0,
          'dac.amplification': 1.0}}
device = IioDac(values, DriverConfig())
device.safe_efforts = (0.0,)
device.open()
output = GuardedOutput(device)
output.send((3.0,))
assert open({raw!r}).read() == '2000\\n'
raise RuntimeError('something else went wrong')
"""


def open_one(root, valve, backend=None, config=None, **changes):
    values = {p.name: p.default for p in parameters_of(VALVE_OUTPUTS)}
    values.update({'sysfs_root': str(root), 'dac.device': 'mcp4725'})
    values.update({name.replace('__', '.'): value for name, value in changes.items()})
    return open_valve(backend or BACK_END[valve], valve, values, config or DriverConfig(),
                      SAFE[valve])


def test_volts_become_raw_values_and_opening_vents(tmp_path):
    raw = make_dac(tmp_path)
    output = open_one(tmp_path, 'ppr', dac__amplification=2.0)
    assert number_in(raw) == 0
    assert number_in(raw.with_name('out_voltage0_powerdown')) == 0
    assert output.send((5.0,)) == ''
    assert number_in(raw) == round(5000.0 / 2.0 / DAC_SCALE_MV)
    assert output.send((0.0,)) == '' and number_in(raw) == 0
    assert (output.failures, output.close()) == (0, '')


def test_a_converter_around_zero_has_an_offset_and_may_share_its_scale(tmp_path):
    raw = make_dac(tmp_path)
    raw.with_name('out_voltage0_scale').rename(raw.with_name('out_voltage_scale'))
    put(raw.with_name('out_voltage0_raw_available'), '[0 1 65535]')
    put(raw.with_name('out_voltage_offset'), -2048)
    output = open_one(tmp_path, 'ppr', dac__device='iio:device0')
    assert number_in(raw) == 2048
    output.send((1.0,))
    assert number_in(raw) == 2048 + round(1000.0 / DAC_SCALE_MV)


@pytest.mark.parametrize('told', [True, False])
def test_full_scale_is_the_highest_value(tmp_path, told):
    """10 V behind an amplifier of 2 are all 4096 steps of 5 V; the highest value is 4095."""
    raw = make_dac(tmp_path)
    put(raw.with_name('out_voltage0_scale'), 5000.0 / 4096)
    if not told:            # as the driver of the kernel for an MCP4725
        raw.with_name('out_voltage0_raw_available').unlink()
    config = DriverConfig.from_parameters({'ppr.highest_v': 10.0})
    output = open_one(tmp_path, 'ppr', config=config, dac__amplification=2.0)
    for volts, value in ((9.99, 4092), (10.0, 4095), (5.0, 2048), (0.0, 0)):
        assert output.send((volts,)) == '' and number_in(raw) == value
    assert output.close() == ''
    with pytest.raises(InputError, match='10 V at .* raw value 8192, the converter has 0 to 4095'):
        open_one(tmp_path, 'ppr', config=config)


def test_duties_become_times_and_a_running_channel_is_taken_over(tmp_path):
    chip = make_pwm(tmp_path)
    output = open_one(tmp_path, 'hsv')
    assert duties(chip) == (0, PERIOD_NS)
    for k in (0, 1):
        assert number_in(chip / f'pwm{k}/period') == PERIOD_NS
        assert number_in(chip / f'pwm{k}/enable') == 1
        assert sysfs.read_text(chip / f'pwm{k}/polarity') == 'normal'
    assert output.send((0.25, 0.0)) == '' and duties(chip) == (PERIOD_NS // 4, 0)
    assert output.send((0.0, 0.5)) == '' and duties(chip) == (0, PERIOD_NS // 2)
    assert output.close() == '' and duties(chip) == (0, PERIOD_NS)


def test_a_venting_valve_that_is_open_without_current(tmp_path):
    chip = make_pwm(tmp_path)
    output = open_one(tmp_path, 'hsv', pwm__vent_normally_open=True)
    assert duties(chip) == (0, 0)
    output.send((0.25, 0.0))
    assert duties(chip) == (PERIOD_NS // 4, PERIOD_NS)


@pytest.mark.timed
def test_a_channel_is_exported_and_waited_for(tmp_path):
    chip = make_pwm(tmp_path, exported=(0,))

    def kernel():
        while number_in(chip / 'export') != 1:
            time.sleep(0.002)
        time.sleep(0.05)
        export(chip, 1)

    helper = threading.Thread(target=kernel, daemon=True)
    helper.start()
    open_one(tmp_path, 'hsv')
    helper.join(5.0)
    assert duties(chip) == (0, PERIOD_NS)


def test_what_shuts_is_written_before_what_opens(tmp_path, monkeypatch):
    chip = make_pwm(tmp_path)
    output = open_one(tmp_path, 'hsv')
    seen = []
    write = sysfs.write

    def watched(path, value):
        write(path, value)
        seen.append(duties(chip))

    monkeypatch.setattr(sysfs, 'write', watched)
    for efforts in ((0.5, 0.0), (0.0, 0.5), (0.9, 0.0), (0.0, 1.0), (0.0, 0.0), (0.2, 0.0)):
        assert output.send(efforts) == ''
    assert len(seen) == 12
    assert all(fill == 0 or vent == 0 for fill, vent in seen)


@pytest.mark.parametrize('backend', ['dummy', 'pwm_sysfs'])
def test_both_valves_are_never_opened_together_for_long(tmp_path, backend):
    chip = make_pwm(tmp_path)
    output = open_one(tmp_path, 'hsv', backend)
    assert output.send((0.3, 0.0)) == '' and output.send((0.3, 0.25)) == ''
    assert 'never open together beyond a duty of 0.5' in output.send((0.6, 0.1))
    assert output.failures == 1
    if backend == 'pwm_sysfs':
        assert duties(chip) == (0, PERIOD_NS)


def test_a_write_that_fails_is_told_and_the_safe_signal_is_tried_again(tmp_path):
    raw = make_dac(tmp_path)
    output = open_one(tmp_path, 'ppr')
    assert output.send((3.0,)) == ''
    break_attribute(raw)
    problem = output.send((3.1,))
    assert str(raw) in problem and 'No space left' in problem
    assert output.failures == 2                  # the signal, and the safe one at once
    assert output.vent(3) and output.failures == 5
    raw.unlink()
    put(raw, 2400)                               # the device is back, with its old value
    assert output.send((0.0,)) == '' and number_in(raw) == 0


def test_the_venting_valve_opens_even_if_the_filling_one_does_not_answer(tmp_path):
    chip = make_pwm(tmp_path)
    output = open_one(tmp_path, 'hsv')
    output.send((0.4, 0.0))
    break_attribute(chip / 'pwm0/duty_cycle')
    assert 'pwm0' in output.send((0.5, 0.0))
    assert number_in(chip / 'pwm1/duty_cycle') == PERIOD_NS


def test_an_output_nobody_holds_vents(tmp_path):
    raw = make_dac(tmp_path)
    output = open_one(tmp_path, 'ppr')
    output.send((3.0,))
    assert number_in(raw) > 0
    del output
    gc.collect()
    assert number_in(raw) == 0


def test_a_program_that_fails_vents_at_its_very_end(tmp_path):
    raw = make_dac(tmp_path)
    program = FAILING.format(root=str(tmp_path), raw=str(raw))
    done = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True)
    assert done.returncode == 1 and 'something else went wrong' in done.stderr
    assert number_in(raw) == 0


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_a_channel_has_one_driver_at_a_time(tmp_path, valve):
    make_dac(tmp_path)
    make_pwm(tmp_path)
    output = open_one(tmp_path, valve)
    with pytest.raises(InputError, match='is driven by another driver in this process already'):
        open_one(tmp_path, valve)
    assert output.close() == ''
    output = open_one(tmp_path, valve)
    del output
    gc.collect()
    assert open_one(tmp_path, valve).close() == ''


def test_the_process_that_drives_a_channel_is_named(tmp_path):
    folder = make_dac(tmp_path).parent
    program = ('import sys; from pam_actuation.hardware.claim import Claim; '
               'claim = Claim(sys.argv[1]); print(flush=True); input()')
    with subprocess.Popen([sys.executable, '-c', program, str(folder)], stdin=subprocess.PIPE,
                          stdout=subprocess.PIPE) as other:
        other.stdout.readline()
        with pytest.raises(DeviceError, match=f'is driven by process {other.pid} .*python'):
            Claim(folder)
        other.stdin.close()
    Claim(folder)
    Claim(tmp_path / 'nothing')


def no_device(root):
    make_dac(root, name='ad5624')


def two_devices(root):
    make_dac(root)
    make_dac(root, number=3)


def no_channel(root):
    make_dac(root).unlink()


def scale_is_text(root):
    put(make_dac(root).with_name('out_voltage0_scale'), 'fine')


def no_scale(root):
    make_dac(root).with_name('out_voltage0_scale').unlink()


def read_only(root):
    raw = make_dac(root)
    raw.unlink()
    raw.symlink_to('/proc/version')     # no one can write there, root included


def a_folder(root):
    raw = make_dac(root)
    raw.unlink()
    raw.mkdir()


def too_small(root):
    put(make_dac(root).with_name('out_voltage0_raw_available'), '[0 1 1023]')


MISTAKES = {
    'nothing there': (lambda root: None, "no device 'mcp4725'", 'there are: none'),
    'no device': (no_device, "no device 'mcp4725'", 'there are: iio:device0'),
    'two devices': (two_devices, "2 devices 'mcp4725'", 'iio:device3'),
    'no channel': (no_channel, 'out_voltage0_raw', 'no such channel'),
    'scale is text': (scale_is_text, 'out_voltage0_scale', "'fine' is not a number"),
    'no scale': (no_scale, 'out_voltage0_raw', 'no scale'),
    'read-only': (read_only, 'out_voltage0_raw', 'cannot write 0'),
    'a folder': (a_folder, 'out_voltage0_raw', 'Is a directory'),
    'too small': (too_small, '6 V at the regulator are the raw value', '0 to 1023'),
}


@pytest.mark.parametrize('case', MISTAKES)
def test_an_analog_output_that_is_not_usable_is_one_sentence(tmp_path, case):
    prepare, *words = MISTAKES[case]
    prepare(tmp_path)
    with pytest.raises(InputError) as told:
        open_one(tmp_path, 'ppr')
    assert all(word in str(told.value) for word in words), str(told.value)
    assert '\n' not in str(told.value)


def test_a_pwm_chip_that_is_not_usable_is_one_sentence(tmp_path, monkeypatch):
    with pytest.raises(InputError, match="no device 'pwmchip0'"):
        open_one(tmp_path, 'hsv')
    chip = make_pwm(tmp_path, exported=(0,))
    with pytest.raises(InputError, match='there is no channel 7, the chip has 2'):
        open_one(tmp_path, 'hsv', pwm__vent_channel=7)
    with pytest.raises(InputError, match='drives the filling valve already'):
        open_one(tmp_path, 'hsv', pwm__vent_channel=0)
    monkeypatch.setattr('pam_actuation.hardware.pwm_sysfs.EXPORT_WAIT_S', 0.05)
    with pytest.raises(InputError, match='channel 1 did not appear'):
        open_one(tmp_path, 'hsv')
    assert number_in(chip / 'export') == 1


@pytest.mark.parametrize('backend, valve, choices', [
    ('pwm_sysfs', 'ppr', 'sim or dummy or iio_dac'), ('iio_dac', 'hsv', 'sim or dummy or pwm')])
def test_a_back_end_that_does_not_fit_the_valve_is_refused(tmp_path, backend, valve, choices):
    with pytest.raises(InputError, match=choices):
        open_one(tmp_path, valve, backend)


@pytest.mark.parametrize('valve', ['ppr', 'hsv'])
def test_without_a_device_every_signal_is_taken(tmp_path, valve):
    output = open_one(tmp_path, valve, 'sim')
    assert output.send((0.3, 0.0)[:len(SAFE[valve])]) == '' and output.close() == ''
