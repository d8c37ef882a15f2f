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

"""Test that a wrong name in a file of hardware is refused before any node starts."""

import pytest

pytest.importorskip('rclpy')

from pam_actuation.cli import up                                            # noqa: E402, I100
from pam_actuation.cli.main import build_parser, main                       # noqa: E402
from pam_actuation.nodes.hardware_check import (                            # noqa: E402
    check_given_files, check_hardware, check_users_file)
from pam_actuation.rigging import layouts                                   # noqa: E402
from pam_sim.errors import InputError                                       # noqa: E402

DRIVER = """/**/valve_driver:
  ros__parameters:
    backend: dummy
    dac: {channel: 1}
    diagnostics_period_s: 0.2
    use_sim_time: false
"""
SENSORS = """/**:
  hardware_sensors:
    ros__parameters: {backend: dummy, place: muscle}
"""
WILD = '/**:\n  ros__parameters: {backend: dummy, publish_rate_hz: 200.0, hsv.period_s: 0.01}\n'
OTHER = '/**/experiment_recorder:\n  ros__parameters: {overwrite: true}\n'

MISTAKES = {
    'a parameter': (
        DRIVER.replace('use_sim_time: false', 'max_pressure_gauge: 1.0e5'),
        ':6: unknown parameter `max_pressure_gauge` of valve_driver (did you mean '
        '`max_pressure_gauge_pa`?)'),
    'a nested one': (
        DRIVER.replace('channel: 1', 'chanel: 1'),
        ':4: unknown parameter `dac.chanel` of valve_driver (did you mean `dac.channel`?)'),
    'one of another node': (
        SENSORS.replace('place', 'valve_type'),
        ':3: unknown parameter `valve_type` of hardware_sensors'),
    'a node': (
        DRIVER.replace('valve_driver', 'valve_drivr'),
        ':1: unknown node `valve_drivr` (did you mean `valve_driver`?)'),
    'no back end': (
        DRIVER.replace('    backend: dummy\n', ''),
        '`backend` is missing for /muscle/valve_driver'),
    'another namespace': (
        DRIVER.replace('**', 'flexor'), '`backend` is missing for /muscle/valve_driver'),
    'no namespace': (
        DRIVER.replace('/**', ''), '`backend` is missing for /muscle/valve_driver')}


@pytest.mark.parametrize('case', MISTAKES)
def test_a_wrong_name_is_one_sentence_with_its_line(tmp_path, capsys, case):
    text, words = MISTAKES[case]
    file = tmp_path / 'mine.yaml'
    file.write_text(text)
    assert main(['up', 'rig', '--hardware', str(file)]) == 2
    told = capsys.readouterr().err
    assert f'{file}' in told and words in told and told.count('\n') == 1


@pytest.mark.parametrize('text', [DRIVER, DRIVER + SENSORS, WILD, DRIVER + OTHER])
def test_what_is_right_is_taken(tmp_path, text):
    file = tmp_path / 'mine.yaml'
    file.write_text(text)
    check_hardware(layouts.rig(hardware=str(file)))


def test_each_muscle_of_a_joint_needs_a_back_end(tmp_path):
    file = tmp_path / 'mine.yaml'
    file.write_text(DRIVER.replace('/**', '/**/flexor'))
    with pytest.raises(InputError, match='missing for /knee/extensor/valve_driver: nothing'):
        check_hardware(layouts.knee(hardware=str(file)))
    file.write_text(file.read_text() + DRIVER.replace('/**', '/*/extensor'))
    check_hardware(layouts.knee(hardware=str(file)))


@pytest.mark.parametrize('name', ['dummy', 'ppr_iio', 'hsv_pwm'])
def test_the_shipped_files_are_right(name):
    check_hardware(layouts.rig(hardware=name))


STACK = """
/**:
  ros__parameters: {use_sim_time: false, valve_type: ppr}
/**/valve_driver:
  ros__parameters: {max_pressure_gauge_pa: 300000}
/*/flexor/valve_driver:
  ros__parameters: {rig: joint_dmsp_5_300_realistic/flexor}
/right/knee/joint_controller:
  ros__parameters: {learning: false}
/planner:
  ros__parameters: {stride_s: 1.1}
"""
WRONG = {
    'a misspelt parameter': (
        STACK.replace('max_pressure', 'max_presure'), 'did you mean `max_pressure_gauge_pa`'),
    'out of range': (STACK.replace('300000', '3.0e7'), 'must lie in 1000 to 1e+06'),
    'another type': (STACK.replace('300000', '300 kPa'), 'must be of type float'),
    'a misspelt node': (STACK.replace('**/valve_driver', '**/valve_drivr'), 'did you mean `valve'),
    'of an option': (STACK.replace('valve_type: ppr', 'valve_type: hsv'), "started with, 'ppr'"),
    'of bringing up': (
        STACK.replace('use_sim_time: false', 'autostart: true'), 'set by what starts the nodes'),
    'a clock for some': (
        '/**/flexor/valve_driver:\n  ros__parameters: {use_sim_time: true}\n',
        '`use_sim_time` is true for /knee/flexor/valve_driver and not for /knee/joint_simulator'),
    'for nobody': ('/planner:\n  ros__parameters: {x: 1.0}\n', 'is for none of the nodes'),
    'no parameter file': ('name: x\nsegments: []\n', 'is no parameter file'),
    'no node': ('ros__parameters: {max_pressure_gauge_pa: 2.0e5}\n', 'is no parameter file'),
    'below another': (
        '/**:\n  ros__parameters: {use_sim_time: false}\n  valve_driver:\n'
        '    ros__parameters: {max_presure: 2.0e5}\n', 'unknown parameter `max_presure`'),
    'no YAML': ('/**: [', '')}


@pytest.mark.parametrize('case', WRONG)
def test_a_mistake_in_a_file_of_the_users_is_one_sentence(tmp_path, capsys, case):
    text, words = WRONG[case]
    file = tmp_path / 'stack.yaml'
    file.write_text(text)
    assert main(['up', 'knee', '--valve', 'ppr', '--params-file', str(file)]) == 2
    told = capsys.readouterr().err
    assert f'{file}' in told and words in told and told.count('\n') == 1
    assert main(['up', 'knee', '--params-file', str(tmp_path / 'none.yaml')]) == 2
    assert capsys.readouterr().err.count('\n') == 1


def test_one_clock_for_all_nodes_is_taken(tmp_path):
    file = tmp_path / 'stack.yaml'
    file.write_text('/**:\n  ros__parameters: {use_sim_time: true}\n')
    check_users_file(str(file), layouts.knee())
    file.write_text(file.read_text().replace('/**', '/**/valve_driver'))
    check_users_file(str(file), layouts.knee(), {'use_sim_time': True})


def test_a_file_of_the_users_is_for_all_nodes_and_may_be_that_of_a_stack(tmp_path):
    file = tmp_path / 'stack.yaml'
    file.write_text(STACK)
    args = build_parser().parse_args(
        ['up', 'knee', '--valve', 'ppr', '--params-file', str(file)])
    nodes = up._nodes(args)
    assert {node.users_file for node in nodes} == {str(file)}
    check_users_file(str(file), nodes)
    nodes = layouts.knee('/right/knee')
    with pytest.raises(InputError, match='False is not what .*joint_controller is started with'):
        check_users_file(str(file), nodes, {'learning': True})


LIMIT = '/**/valve_driver:\n  ros__parameters: {max_pressure_gauge_pa: 50000}\n'


def test_two_files_that_state_two_limits_are_refused(tmp_path, capsys):
    hardware, mine = tmp_path / 'hardware.yaml', tmp_path / 'mine.yaml'
    hardware.write_text(
        f'{DRIVER}    max_pressure_gauge_pa: 100000.0\n{SENSORS}')
    mine.write_text(LIMIT)
    words = ['up', 'rig', '--hardware', str(hardware), '--params-file', str(mine)]
    assert main(words) == 2
    told = capsys.readouterr().err
    assert (f'{mine}:2: `max_pressure_gauge_pa`: 50000.0 is not what {hardware} states for '
            '/muscle/valve_driver, 100000.0' in told) and told.count('\n') == 1
    nodes = layouts.rig(hardware=str(hardware))
    for same in ('100000', '1.0e5'):
        mine.write_text(LIMIT.replace('50000', same))
        check_users_file(str(mine), nodes)
    mine.write_text(LIMIT)
    check_users_file(str(mine), layouts.rig())          # simulated: no file of hardware


@pytest.mark.parametrize('line, words', {
    'valve_type: hsv': "`valve_type`: 'hsv' is not what /muscle/valve_driver is started with, "
                       "'ppr'",
    'rig: other.yaml': "`rig`: 'other.yaml' is not what",
    'max_pressure_gauge_pa: 3.0e7': 'must lie in 1000 to 1e+06',
    'backend: iio_dca': "`backend`: 'iio_dca' is not allowed",
    'autostart: true': '`autostart` is set by what starts the nodes'}.items())
def test_a_file_of_hardware_that_says_otherwise_than_the_options_is_refused(
        tmp_path, capsys, line, words):
    file = tmp_path / 'mine.yaml'
    file.write_text(f'/**/valve_driver:\n  ros__parameters:\n    backend: dummy\n    {line}\n'
                    .replace('    backend: dummy\n' * line.startswith('backend'), ''))
    assert main(['up', 'rig', '--hardware', str(file)]) == 2
    told = capsys.readouterr().err
    assert f'{file}:' in told and words in told and told.count('\n') == 1
    file.write_text(DRIVER.replace('use_sim_time: false', 'valve_type: ppr'))
    check_hardware(layouts.rig(hardware=str(file)))


NEAR = ('/left/knee/valve_driver', '/left/valve_driver', 'valve_driver', '/*/*/valve_driver')


@pytest.mark.parametrize('name', NEAR)
@pytest.mark.parametrize('which', ['hardware', 'params'])
def test_a_limit_that_misses_the_drivers_of_the_rig_is_refused(tmp_path, name, which):
    file, limit = tmp_path / 'mine.yaml', f'\n{LIMIT.replace("/**/valve_driver", name)}'
    if which == 'hardware':
        file.write_text(DRIVER + SENSORS.replace(', place: muscle', '') + limit)
        with pytest.raises(InputError, match='is none of the nodes that are started') as refused:
            check_hardware(layouts.knee('/left/knee', hardware=str(file)))
    else:
        file.write_text(STACK + limit)
        nodes = layouts.knee('/left/knee')
        if '*' in name:             # the drivers get their limit by another entry
            check_users_file(str(file), nodes)
            file.write_text(STACK.replace('max_pressure_gauge_pa: 300000', '') + limit)
        with pytest.raises(InputError, match='is none of the nodes that are started') as refused:
            check_users_file(str(file), nodes)
    assert '/left/knee/extensor/valve_driver, /left/knee/flexor/valve_driver' in str(refused.value)
    assert str(refused.value).startswith(f'{file}:') and '/**/valve_driver' in str(refused.value)


@pytest.mark.parametrize('name', ['/right/knee/flexor/valve_driver', '/arm/valve_driver',
                                  '/right/**/valve_driver', '/left/knee/flexor/valve_driver'])
def test_a_limit_of_another_rig_may_stand_in_the_file_of_a_stack(tmp_path, name):
    file, limit = tmp_path / 'mine.yaml', f'\n{LIMIT.replace("/**/valve_driver", name)}'
    file.write_text(STACK + limit)
    told = check_users_file(str(file), layouts.knee('/left/knee'))
    # It may be a misspelt name as well, so it is told.
    reached = name == '/left/knee/flexor/valve_driver'
    assert any(f'`{name}` names none of the nodes' in one for one in told) is not reached
    assert check_users_file(str(file), layouts.knee('/left/knee'), alone=False) == []
    file.write_text(DRIVER + SENSORS.replace(', place: muscle', '') + limit)
    check_hardware(layouts.knee('/left/knee', hardware=str(file)))


ADC = """
/**/hardware_sensors:
  ros__parameters: {backend: iio_adc, adc.device: ads1115, pressure.channel: 0,
                    supply_pressure.channel: 3}
"""


def test_two_muscles_that_read_one_sensor_are_refused(tmp_path):
    file = tmp_path / 'mine.yaml'
    of_joint = '\n/*/hardware_sensors:\n  ros__parameters: {angle.channel: 2}\n'
    file.write_text(DRIVER + ADC + of_joint)
    check_hardware(layouts.rig(hardware=str(file)))
    for nodes in (layouts.knee(hardware=str(file)), layouts.exo(hardware=str(file))):
        with pytest.raises(InputError, match=r'flexor/hardware_sensors and /\w+/extensor/hardware_'
                           'sensors both read channel 0 of ads1115'):
            check_hardware(nodes)
    both = ''.join(ADC.replace('/**', f'/**/{side}').replace('channel: 0', f'channel: {k}')
                   for k, side in enumerate(('flexor', 'extensor')))
    file.write_text(DRIVER + both + of_joint.replace('{', '{adc.device: ads1115, '))
    check_hardware(layouts.knee(hardware=str(file)))       # they share the supply
    file.write_text(file.read_text().replace('angle.channel: 2', 'angle.channel: 1'))
    with pytest.raises(InputError, match='/knee/extensor/hardware_sensors both read channel 1'):
        check_hardware(layouts.knee(hardware=str(file)))


def test_the_files_of_a_command_line_may_hold_what_is_for_others(tmp_path):
    file, words = tmp_path / 'mine.yaml', ['-r', '__ns:=/left', '--params-file']
    for text in (STACK, LIMIT, LIMIT.replace('**', 'right'), '[', 'x: 1\n', ''):
        file.write_text(text)
        check_given_files([*words, str(file)], 'valve_driver', '/left/flexor/valve_driver')
    for name in ('/left/valve_driver', 'valve_driver', '/left/flexor/valve_driver'):
        file.write_text(LIMIT.replace('/**/valve_driver', name))
        check_given_files([*words, str(file)], 'joint_controller', '/left/joint_controller')
        with pytest.raises(InputError, match='is none of the nodes that are started'):
            check_given_files([*words, str(file)], 'valve_driver', '/left/flexor/own_name')


OWN = '/muscle/valve_driver:\n  ros__parameters: {max_pressure_gauge_pa: 40000.0}\n'


@pytest.mark.parametrize('wide', ['/**', '/**/valve_driver', '/*/valve_driver'])
def test_a_wildcard_below_the_limit_of_a_node_is_refused(tmp_path, wide):
    """ROS would take the last entry, and not the one for fewer nodes."""
    file, limit = tmp_path / 'mine.yaml', LIMIT.replace('/**/valve_driver', wide)
    words = ['--params-file', str(file)]
    for text, is_right in ((limit + OWN, True), (OWN + limit, False), (
            OWN + limit.replace('50000', '40000'), True)):
        file.write_text(text)
        whole = tmp_path / 'hardware.yaml'
        whole.write_text(f'{text}/muscle/*:\n  ros__parameters: {{backend: dummy}}\n')
        for check in (lambda: check_users_file(str(file), layouts.rig()),
                      lambda: check_hardware(layouts.rig(hardware=str(whole))),
                      lambda: check_given_files(words, 'valve_driver', '/muscle/valve_driver')):
            if is_right:
                check()
                continue
            with pytest.raises(InputError, match='50000 would overrule 40000.0, stated above for '
                               '/muscle/valve_driver'):
                check()
