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

"""A bag of another stack: its names, its types and its order say which signal is where."""

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.cli.main import main
from pam_actuation.tables.formats import bag as bag_format, read_tables
from pam_actuation.tables.own_bag import needs_no_import
from pam_sim.errors import InputError
from pam_sim.units import P_ATM_PA
import pytest
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import Writer
from rosbags.typesys import get_typestore, Stores

STORE = get_typestore(Stores.ROS2_JAZZY)
START_NS, STEP_NS, ROWS = 10**18, 5_000_000, 200
TIME_S = 0.005 * np.arange(ROWS)
PRESSURE_PA = 2e5 * (1.0 - np.cos(2.0 * np.pi * TIME_S))       # gauge, empty at both ends
LENGTH_M = 0.412 - 0.02 * (1.0 - np.cos(2.0 * np.pi * TIME_S))
PULL_N = 5.0 + 1e-4 * PRESSURE_PA
FILL_PERCENT = 50.0 + 50.0 * np.sin(2.0 * np.pi * TIME_S)
JOINTS = '/exo/joint_states.position'


def made(of_type, **fields):
    return STORE.types[of_type](**fields)


def header(stamp_ns):
    seconds, nanoseconds = divmod(int(stamp_ns), 10**9)
    return made('std_msgs/msg/Header', frame_id='', stamp=made(
        'builtin_interfaces/msg/Time', sec=seconds, nanosec=nanoseconds))


def vector(z):
    return made('geometry_msgs/msg/Vector3', x=0.0, y=0.0, z=float(z))


def joints(stamp_ns, names, positions):
    return made('sensor_msgs/msg/JointState', header=header(stamp_ns), name=names,
                position=np.array(positions), velocity=np.array([]), effort=np.array([]))


def messages_at(row, pressure_offset_pa, moved):
    """Return (topic, message, time of its arrival) of a row; the encoder is late at times."""
    stamp_ns = START_NS + row * STEP_NS
    late_ns = 7_000_000 if row % 50 == 7 else 0
    names = ['knee', 'left_pam'] if not moved or row % 2 else ['left_pam', 'knee']
    values = {'knee': 0.1 + 0.01 * row, 'left_pam': LENGTH_M[row]}
    found = [
        ('/exo/joint_states', joints(stamp_ns, names, [values[name] for name in names]),
         stamp_ns + late_ns),
        ('/exo/left/pressure', made(
            'sensor_msgs/msg/FluidPressure', header=header(stamp_ns), variance=0.0,
            fluid_pressure=float(PRESSURE_PA[row] + pressure_offset_pa)), stamp_ns),
        ('/exo/left/load_cell', made(
            'geometry_msgs/msg/WrenchStamped', header=header(stamp_ns), wrench=made(
                'geometry_msgs/msg/Wrench', force=vector(-PULL_N[row]), torque=vector(0.0))),
         stamp_ns),
        ('/exo/left/valve_cmd', made(
            'std_msgs/msg/Float64MultiArray', data=np.array([FILL_PERCENT[row], 0.01 * row]),
            layout=made('std_msgs/msg/MultiArrayLayout', dim=[], data_offset=0)), stamp_ns)]
    if moved:       # another sender on the topic, at the same times
        found.append(('/exo/joint_states', joints(stamp_ns, ['hip'], [0.5]), stamp_ns + late_ns))
    return found


def written(path, pressure_offset_pa=0.0, moved=False):
    rows = [one for row in range(ROWS) for one in messages_at(row, pressure_offset_pa, moved)]
    with Writer(path, version=9) as writer:
        connections = {}
        for topic, message, arrival_ns in sorted(rows, key=lambda row: row[2]):
            if topic not in connections:
                connections[topic] = writer.add_connection(
                    topic, message.__msgtype__, typestore=STORE)
            writer.write(connections[topic], arrival_ns,
                         STORE.serialize_cdr(message, message.__msgtype__))
    return str(path)


@pytest.fixture(scope='module')
def exo(tmp_path_factory):
    return written(tmp_path_factory.mktemp('exo') / 'run')


def test_the_preview_names_topics_joints_and_what_is_open(exo, capsys):
    assert main(['import', exo, '--preview']) == 0
    said = capsys.readouterr().out
    for part in (f'/exo/joint_states, {ROWS} messages', f'{JOINTS}[knee]',
                 'contraction in m (unit m by message type)',
                 'pressure in Pa_gauge (gauge, since it falls to',
                 'force in N (unit N by message type)',
                 '--map fill_duty="/exo/left/valve_cmd.data[0]:%" or '
                 '--map fill_duty="/exo/left/valve_cmd.data[1]:%"'):
        assert part in said, part
    assert 'variance' in said and 'knee]  0.1' in said


@pytest.mark.parametrize('place', ['left_pam', '1'])
def test_a_few_words_make_a_recording_of_it(exo, place, tmp_path, capsys):
    out = str(tmp_path / 'bag')
    maps = [word for text in (
        'fill_duty=/exo/left/valve_cmd.data[0]:%', 'vent_duty=/exo/left/valve_cmd.data[1]:%',
        f'contraction={JOINTS}[{place}]:m:zero=0.412:gain=-1',
        'force=/exo/left/load_cell.wrench.force.z:N:gain=-1') for word in ('--map', text)]
    assert main(['import', exo, '--out', out, *maps]) == 0
    assert 'put in order (4 arrived late, by up to 5 ms)' in capsys.readouterr().out
    run = load_run(out)
    for topic, field, values in (
            ('pressure', 'pressure_pa', P_ATM_PA + PRESSURE_PA), ('force', 'force_n', PULL_N),
            ('contraction', 'contraction_m', 0.412 - LENGTH_M),
            ('valve_signal', 'fill_duty', 0.01 * FILL_PERCENT)):
        np.testing.assert_allclose(run[topic][field], values, atol=1e-9)
        assert run[topic].stamp_ns.tolist() == (START_NS + STEP_NS * np.arange(ROWS)).tolist()


def test_what_cannot_be_is_said_with_the_way_out(exo, tmp_path, capsys):
    duties = ['--map', 'fill_duty=/exo/left/valve_cmd.data[0]:%',
              '--map', 'vent_duty=/exo/left/valve_cmd.data[1]:%', '--out', str(tmp_path / 'bag')]
    assert main(['import', exo, *duties]) == 2
    assert f'{JOINTS}[left_pam]:m:zero=0.412:gain=-1' in capsys.readouterr().err
    maps = ['--map', f'contraction={JOINTS}[left_pam]:m:zero=0.412:gain=-1']
    assert main(['import', exo, *duties, *maps]) == 1
    said = capsys.readouterr().out
    assert '--map force="/exo/left/load_cell.wrench.force.z:N:gain=-1"' in said
    assert 'the name of the column says' not in said


def test_a_pressure_is_absolute_as_its_type_says(tmp_path, capsys):
    bag = written(tmp_path / 'run', pressure_offset_pa=P_ATM_PA)
    assert main(['import', bag, '--preview']) == 0
    assert 'pressure in Pa_abs (unit Pa_abs by message type)' in capsys.readouterr().out


def test_joints_that_change_places_are_told_by_their_names(tmp_path, capsys):
    bag, out = written(tmp_path / 'run', moved=True), str(tmp_path / 'bag')
    only = ['--map', 'fill_duty=/exo/left/valve_cmd.data[0]:%',
            '--map', 'vent_duty=/exo/left/valve_cmd.data[1]:%', '--out', out]
    zero = ':m:zero=0.412:gain=-1'
    assert main(['import', bag, *only, '--map', f'contraction={JOINTS}[1]{zero}']) == 2
    assert f'did you mean "{JOINTS}[' in capsys.readouterr().err
    assert main(['import', bag, *only, '--map', f'contraction={JOINTS}[left_pam]{zero}']) == 1
    contraction = load_run(out)['contraction']
    assert contraction.stamp_ns.tolist() == (START_NS + STEP_NS * np.arange(ROWS)).tolist()
    np.testing.assert_allclose(contraction['contraction_m'], 0.412 - LENGTH_M, atol=1e-9)


def written_by_our_nodes(path, *namespaces):
    """Write a bag of our topics with another recorder; return its path."""
    with Writer(path, version=9) as writer:
        for place in namespaces:
            for topic, message in (
                    ('pressure', made('sensor_msgs/msg/FluidPressure', header=header(START_NS),
                                      fluid_pressure=2e5, variance=0.0)),
                    ('contraction', joints(START_NS, ['muscle'], [0.01]))):
                connection = writer.add_connection(
                    f'{place}/{topic}', message.__msgtype__, typestore=STORE)
                writer.write(connection, START_NS,
                             STORE.serialize_cdr(message, message.__msgtype__))
    return str(path)


def test_a_bag_of_our_topics_needs_no_import(exo, tmp_path, capsys):
    bag = written_by_our_nodes(tmp_path / 'own bag', '/muscle')
    assert main(['import', bag, '--out', str(tmp_path / 'out')]) == 2
    said = capsys.readouterr().err
    assert 'holds the muscle /muscle in topics of this package' in said
    assert f"can be read as it is: pam info '{bag}'. To import it" in said
    assert not (tmp_path / 'out').exists()
    stack = written_by_our_nodes(tmp_path / 'stack', '/thigh', '/shank')
    assert main(['import', stack, '--preview']) == 0
    assert 'holds the muscle /shank and the muscle /thigh in topics' in capsys.readouterr().out
    # Who says what a column is wants an import; bags of others need one.
    assert main(['import', stack, '--map', 'pressure=/thigh/no:Pa_abs']) == 2
    assert 'as it is' not in capsys.readouterr().err
    assert needs_no_import(exo) == '' and needs_no_import(tmp_path / 'a.csv') == ''


def arrays(place, data, topic='/Sensors'):
    """Write a bag with one array a message; return its path."""
    with Writer(place, version=9) as writer:
        connection = writer.add_connection(topic, 'std_msgs/msg/Float64MultiArray',
                                           typestore=STORE)
        for row, values in enumerate(data):
            message = made('std_msgs/msg/Float64MultiArray', data=np.array(values, float), layout=(
                made('std_msgs/msg/MultiArrayLayout', dim=[], data_offset=0)))
            writer.write(connection, START_NS + row * STEP_NS,
                         STORE.serialize_cdr(message, message.__msgtype__))
    return str(place)


def test_messages_without_numbers_are_rows_without_values(tmp_path):
    table, = read_tables(arrays(tmp_path / 'a', [[], [1.0], [], [2.0], [3.0] * 4000]))
    np.testing.assert_array_equal(
        table.numbers('/Sensors.data[0]'), [np.nan, 1.0, np.nan, 2.0, 3.0])
    assert table.stamp_ns.tolist() == (START_NS + STEP_NS * np.arange(5)).tolist()
    for place, data in (('image', [[3.0] * 4000, [1.0]]), ('empty', [[], []])):
        with pytest.raises(InputError, match='holds no rows of numbers'):
            read_tables(arrays(tmp_path / place, data))


@pytest.mark.parametrize('column', ['/Sensors.data[0]', ' /sensors.DATA[0]', '#1'])
def test_a_topic_is_wanted_by_any_name_that_means_its_column(column, tmp_path, monkeypatch):
    monkeypatch.setattr(bag_format, '_PREVIEWED', 3)
    bag = arrays(tmp_path / 'a', [[float(row)] for row in range(9)])
    table, = read_tables(bag, wanted=[column])
    assert table.name_of(column) and len(table) == 9
    table, = read_tables(bag, wanted=['/Sensors2.data[0]'])
    assert len(table) == 3


def test_a_topic_that_is_cut_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(bag_format, 'MOST_ROWS', 10)
    bag = arrays(tmp_path / 'a', [[float(row)] for row in range(41)])
    table, = read_tables(bag, every=2)
    assert (len(table), table.remarks) == (10, [
        'of 41 messages on /Sensors the first 20 are read; keep one of several, with --every 5'])
    assert [table.remarks for table in read_tables(bag, every=5)] == [[]]


def test_a_bag_of_ros_1(tmp_path, capsys):
    store, bag = get_typestore(Stores.ROS1_NOETIC), tmp_path / 'old.bag'
    number = store.types['std_msgs/msg/Float64']
    with Ros1Writer(bag) as writer:
        for topic, values in (('/pam/pressure_kpa', 1e-3 * PRESSURE_PA),
                              ('/pam/position_mm', 1e3 * (0.412 - LENGTH_M))):
            connection = writer.add_connection(topic, number.__msgtype__, typestore=store)
            for row, value in enumerate(values):
                writer.write(connection, START_NS + row * STEP_NS, store.serialize_ros1(
                    number(data=float(value)), number.__msgtype__))
    out = str(tmp_path / 'bag')
    assert main(['import', str(bag), '--out', out]) == 0
    run = load_run(out)
    np.testing.assert_allclose(run['pressure']['pressure_pa'], P_ATM_PA + PRESSURE_PA, atol=1e-6)
    np.testing.assert_allclose(run['contraction']['contraction_m'], 0.412 - LENGTH_M, atol=1e-9)
    bag.write_bytes(bag.read_bytes()[:2000])
    capsys.readouterr()
    assert main(['import', str(bag), '--preview']) == 2
    assert 'is no readable bag' in capsys.readouterr().err


def test_a_table_of_plotjuggler(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    wrench = '/exo/left/load_cell/wrench/force'
    columns = {'__time': 1.7e9 + TIME_S, '/exo/left/pressure/fluid_pressure': PRESSURE_PA,
               '/exo/joint_states/left_pam/position': LENGTH_M, f'{wrench}/x': 0.0 * TIME_S,
               f'{wrench}/z': PULL_N, '/exo/left/valve_cmd/data.0': 3.0 + TIME_S}
    np.savetxt('pj.csv', np.column_stack([*columns.values()]), '%.6f', ',', comments='',
               header=','.join(columns))
    assert main(['import', 'pj.csv', '--preview']) == 0
    said = capsys.readouterr().out
    for part in ('--map pressure="/exo/left/pressure/fluid_pressure:Pa_gauge"',
                 '--map contraction="/exo/joint_states/left_pam/position:m"',
                 f'--map force="{wrench}/z:N"',
                 '--map ppr_voltage="/exo/left/valve_cmd/data.0:V"'):
        assert part in said, part
    assert f'{wrench}/x:' not in said and 'no column is known' not in said
