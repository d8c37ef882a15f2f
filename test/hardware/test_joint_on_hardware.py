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

"""A joint on hardware: back ends of another package, brought up by one option; a lost angle."""

from pathlib import Path
import sys
import threading
import time
import tomllib

import pytest

pytest.importorskip('rclpy')

from live_rig import LiveRig, wait_for                                      # noqa: E402, I100
from pam_actuation.hardware.back_ends import open_sensors, OWN_SENSOR_INPUTS  # noqa: E402
from pam_actuation.hardware.other_packages import SENSOR_GROUP, with_others   # noqa: E402
from pam_actuation.hardware.sensor_input import SensorInput                 # noqa: E402
from pam_actuation.messages import AngleReference                           # noqa: E402
from pam_actuation.nodes.ros_messages import class_of                       # noqa: E402
from pam_actuation.rigging import layouts                                   # noqa: E402
from pam_actuation.rigging.supervisor import Supervisor                     # noqa: E402
from pam_actuation.topics.codec import Writer                               # noqa: E402
from pam_sim.errors import InputError                                       # noqa: E402
from pam_sim.joint.parameters import SIDES                                  # noqa: E402

EXAMPLE = Path(__file__).resolve().parents[2] / 'examples' / 'lab_back_end'


def installed(folder, monkeypatch, **more):
    """Let Python find the example as if it were installed, in this process and its children."""
    project = tomllib.loads((EXAMPLE / 'pyproject.toml').read_text())['project']
    points = {group: {**names, **more} for group, names in project['entry-points'].items()}
    about = folder / 'lab_back_end-0.1.0.dist-info'
    about.mkdir()
    (about / 'METADATA').write_text('Metadata-Version: 2.1\nName: lab-back-end\nVersion: 0.1.0\n')
    (about / 'entry_points.txt').write_text(''.join(
        f'[{group}]\n' + ''.join(f'{name} = {value}\n' for name, value in names.items())
        for group, names in points.items()))
    monkeypatch.setenv('PYTHONPATH', f'{folder}:{EXAMPLE}')
    for path in (folder, EXAMPLE):
        monkeypatch.syspath_prepend(path)


def bench_in(folder):
    """Return a folder with the files of a knee, and its parameter file."""
    bench = folder / 'bench'
    for part, names in (*((side, ('pressure',)) for side in SIDES), ('joint', ('joint_state',))):
        (bench / part).mkdir(parents=True)
        for name in names:
            (bench / part / name).write_text('101325\n' if name == 'pressure' else '0\n')
    file = folder / 'knee.yaml'
    file.write_text((EXAMPLE / 'knee.yaml').read_text().replace('bench/', f'{bench}/'))
    return bench, str(file)


def test_a_back_end_that_cannot_be_loaded_hurts_no_other(tmp_path, monkeypatch, capsys):
    installed(tmp_path, monkeypatch, broken='no_such_module:Sensors', dummy='os:sep', odd='os:sep')
    found = with_others(OWN_SENSOR_INPUTS, SENSOR_GROUP, SensorInput)
    assert sorted(found) == ['dummy', 'iio_adc', 'text_files']
    told = capsys.readouterr().err
    assert told.count('\n') == 3
    for part in ('broken (no_such_module:Sensors) is left out: ModuleNotFoundError',
                 'dummy (os:sep) is left out: the name is taken',
                 'odd (os:sep) is left out: it is no class made from SensorInput'):
        assert part in told


@pytest.mark.parametrize('parameters', ['PORT', "('port',)", '[PORT, 3]', "'port'", 'None'])
def test_a_back_end_whose_parameters_are_none_hurts_no_other(
        parameters, tmp_path, monkeypatch, capsys):
    (tmp_path / 'bench_of_a_lab.py').write_text(
        'from pam_actuation.drivers.parameter import node_parameter\n'
        'from pam_actuation.hardware.sensor_input import SensorInput\n'
        "PORT = node_parameter('port', '', 'Port.')\n"
        f'class Sensors(SensorInput):\n    PARAMETERS = {parameters}\n')
    installed(tmp_path, monkeypatch, bench='bench_of_a_lab:Sensors')
    monkeypatch.delitem(sys.modules, 'bench_of_a_lab', raising=False)
    assert 'bench' not in with_others(OWN_SENSOR_INPUTS, SENSOR_GROUP, SensorInput)
    assert ('back end bench (bench_of_a_lab:Sensors) is left out: its PARAMETERS are no tuple of '
            'what node_parameter returns; one alone needs a comma' in capsys.readouterr().err)


def test_the_dummy_reads_a_muscle_or_a_joint():
    assert open_sensors('dummy', {}).topics == ('pressure', 'contraction', 'force')
    joint = open_sensors('dummy', {'place': 'joint'})
    assert joint.topics == ('joint_state',) and joint.read('joint_state') == 0.0


def test_a_joint_on_hardware_has_sensors_in_place_of_the_simulator():
    def names(**options):
        return [(node.namespace, node.name) for node in layouts.knee(**options)]
    real = names(hardware='dummy')
    assert ('/knee', 'hardware_sensors') in real
    assert {(f'/knee/{side}', name) for side in SIDES
            for name in ('hardware_sensors', 'valve_driver')} <= {*real}
    assert not [name for _, name in real if 'simulator' in name or 'watchdog' in name]
    assert {*real} - {*names(hardware='dummy', angle='topic')} == {('/knee', 'hardware_sensors')}
    files = {node.parameter_file for node in layouts.exo(hardware='dummy')
             if node.name != 'joint_controller'}
    assert len(files) == 1 and files.pop().endswith('dummy.yaml')
    with pytest.raises(InputError, match='no_such'):
        layouts.knee(hardware='no_such')


@pytest.mark.ros
def test_a_lost_angle_vents_both_muscles_of_a_knee_on_hardware(tmp_path, monkeypatch):
    installed(tmp_path, monkeypatch)
    bench, file = bench_in(tmp_path)
    rig = LiveRig(tmp_path, namespace='/knee')
    ending = threading.Event()

    def volts():
        texts = [(bench / side / 'valve').read_text() for side in SIDES]
        return [float(text) if text.strip() else float('nan') for text in texts]

    try:
        supervisor = Supervisor(layouts.knee(hardware=file), rig.domain_id, realtime_priority=1)
        with supervisor:
            supervisor.start()
            rig.heard = {'joint_state': []}
            rig.listen(('joint_state',))
            publisher = rig.node.create_publisher(
                class_of('joint_reference'), 'joint_reference', 10)
            writer = Writer('joint_reference')

            def ask():
                while not ending.wait(0.02):
                    publisher.publish(writer.fill(AngleReference(time.time_ns(), 0.0)))
            thread = threading.Thread(target=ask)
            thread.start()
            wait_for(lambda: min(volts()) > 0.8, 60.0, 'pressure in both muscles')
            (bench / 'joint' / 'joint_state').unlink()
            wait_for(lambda: volts() == [0.0, 0.0], 10.0, 'both muscles vented')
            for name, why in (('joint_controller', 'joint angle is older than'),
                              ('hardware_sensors', 'joint_state is not measured')):
                wait_for(lambda name=name, why=why: any(
                    why in one.message for one in rig.health[name]), 20.0, f'{name} to say so')
            time.sleep(0.5)
            assert volts() == [0.0, 0.0]
            ending.set()
            thread.join()
            assert supervisor.finish() == []
    finally:
        ending.set()
        rig.close()
