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

"""Which recordings a campaign has, and on which rig and day each was."""

from pathlib import Path
import sys

from pam_actuation.bags.writer import BagWriter
from pam_actuation.campaign.campaign import _with_models
from pam_actuation.campaign.cases import find_cases
from pam_actuation.campaign.work import Settings
from pam_actuation.topics.codec import encode
from pam_actuation.topics.table import BY_NAME
from pam_sim import load_rig
from pam_sim.errors import InputError
import pytest
import zstandard

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'bags'))
from sample_bag import plain_numbers, START_NS, write_bag  # noqa: E402, I100


@pytest.fixture(scope='module')
def lab(tmp_path_factory):
    """Return a folder with recordings of two rigs, one of them of two muscles."""
    folder = tmp_path_factory.mktemp('lab')
    for day in ('2026-03-02', '2026-03-01'):
        write_bag(folder / 'bench' / day / 'run', 20)
    write_bag(folder / 'exo_20260301_0930' / 'walk', 20,
              namespaces=('/left_knee/flexor', '/left_knee/extensor'))
    (folder / 'notes.txt').write_text('nothing')
    return folder


def test_folders_name_rig_and_day_and_every_muscle_is_a_case(lab):
    cases = find_cases(lab)
    assert [(case.rig, case.day, case.namespace) for case in cases] == [
        ('bench', '2026-03-01', None), ('bench', '2026-03-02', None),
        ('exo/left_knee/extensor', '2026-03-01T09:30', '/left_knee/extensor'),
        ('exo/left_knee/flexor', '2026-03-01T09:30', '/left_knee/flexor')]
    assert cases[1].time - cases[0].time == 1.0
    assert [case.rig for case in find_cases(lab, without=lab / 'bench')] == [
        'exo/left_knee/extensor', 'exo/left_knee/flexor']


def test_links_lead_to_recordings_and_each_is_one_case(tmp_path):
    runs, store = tmp_path / 'runs', tmp_path / 'store'
    for day in (runs / 'rig_1' / '2026-03-01', store / 'rig_b' / '2026-03-02'):
        write_bag(day / 'run', 2)
    (runs / 'rig_2').symlink_to(store / 'rig_b')
    for where, to in ((runs / 'a', runs / 'rig_1'), (runs / 'rig_3', store),
                      (store / 'rig_b' / 'round', store), (store / 'z', runs)):
        where.symlink_to(to)
    assert [(case.rig, case.day) for case in find_cases(runs)] == [
        ('rig_1', '2026-03-01'), ('rig_2', '2026-03-02')]
    assert [case.rig for case in find_cases(runs, without=store / 'rig_b')] == ['rig_1']


def test_results_of_campaigns_are_no_recordings(tmp_path):
    write_bag(tmp_path / 'bench' / 'run', 2)
    found = find_cases(tmp_path, without=tmp_path)
    for out in ('.', 'of_another_campaign'):
        case = tmp_path / out / 'cases' / '0123'
        case.mkdir(parents=True)
        (case / 'case.json').write_text('{}')
        (case / 'compare.mcap').write_bytes(b'results')
    assert find_cases(tmp_path, without=tmp_path) == found and len(found) == 1


def test_a_list_names_them_as_it_likes(lab):
    table = lab / 'list.csv'
    table.write_text('path, rig, day, namespace\n# a remark\nbench/2026-03-01/run, A, 2026-04-05,'
                     '\nexo_20260301_0930/walk, B, , /left_knee/flexor\ngone/bag, B, ,\n')
    assert [(case.rig, case.day, case.namespace) for case in find_cases(table)] == [
        ('A', '2026-04-05', None), ('B', '1970-01-01', None),
        ('B/left_knee/flexor', '2026-03-01T09:30', '/left_knee/flexor')]
    plain = lab / 'list.txt'
    plain.write_text('bench/2026-03-01/run\n\nbench/2026-03-02/run\n')
    assert [case.day for case in find_cases(plain)] == ['2026-03-01', '2026-03-02']


@pytest.mark.parametrize('path, rig, day', [
    # Serial numbers are no dates, and numbers of recordings no times.
    ('10023456/2026-03-02', '10023456', '2026-03-02'),
    ('10023999/2026-03-02', '10023999', '2026-03-02'),
    ('bench/2026-03-02_0075', 'bench', '2026-03-02'),
    ('bench/20260302_9999/20261399', 'bench/20261399', '2026-03-02')])
def test_digits_that_are_no_date_name_the_rig(tmp_path, path, rig, day):
    (tmp_path / path).mkdir(parents=True)
    (tmp_path / path / 'check.mcap').write_bytes(b'no bag')
    [case] = find_cases(tmp_path)
    assert (case.rig, case.day) == (rig, day)


def test_recordings_of_one_time_are_numbered(tmp_path):
    for name in ('b_10', 'b_2', 'b_02', 'a'):
        write_bag(tmp_path / name, 20)
    assert [(Path(case.path).name, case.day, case.rig) for case in find_cases(tmp_path)] == [
        ('a', '1', 'rig'), ('b_02', '2', 'rig'), ('b_2', '3', 'rig'), ('b_10', '4', 'rig')]
    # So are several of one day in order.
    table = tmp_path / 'list.csv'
    table.write_text('path,day\nb_10,2026-03-01\nb_2,2026-03-01\na,2026-03-02\n')
    assert [Path(case.path).name for case in find_cases(table)] == ['b_2', 'b_10', 'a']


@pytest.fixture(scope='module')
def exo(tmp_path_factory):
    """Return a folder with one bag of two knees, and one of a muscle."""
    folder = tmp_path_factory.mktemp('exo')
    with BagWriter(folder / 'runs' / '2026-03-01' / 'walk', {}) as writer:
        for knee in ('/left_knee', '/right_knee'):
            for short in ('joint_state', 'flexor/pressure', 'flexor/contraction',
                          'extensor/pressure', 'extensor/contraction'):
                place, _, name = f'{knee}/{short}'.rpartition('/')
                topic = BY_NAME[name]
                writer.add_topic(topic.full_name(place), topic.type_name)
                writer.write(topic.full_name(place), encode(name, plain_numbers(topic)),
                             START_NS, START_NS)
    write_bag(folder / 'runs' / '2026-03-02' / 'run', 2)
    return folder


MUSCLES = [f'/{knee}/{side}' for knee in ('left_knee', 'right_knee')
           for side in ('extensor', 'flexor')]


def test_a_bag_of_an_exoskeleton_has_four_muscles_or_two_joints(exo):
    walk = exo / 'runs' / '2026-03-01'
    assert [case.namespace for case in find_cases(walk)] == MUSCLES
    # The bag itself is a campaign as well.
    assert [case.namespace for case in find_cases(walk / 'walk')] == MUSCLES
    assert [(case.rig, case.namespace) for case in find_cases(walk, joints=True)] == [
        ('rig/left_knee', '/left_knee'), ('rig/right_knee', '/right_knee')]


def test_a_split_recording_is_one_case(tmp_path):
    split = tmp_path / 'lab' / 'bench' / '2026-03-01'
    with BagWriter(split / 'run', {}, max_file_s=1.0) as writer:
        topic = BY_NAME['pressure']
        writer.add_topic(topic.full_name('/muscle'), topic.type_name)
        for stamp_ns in range(START_NS, START_NS + 4_000_000_000, 100_000_000):
            writer.write(topic.full_name('/muscle'), encode('pressure', plain_numbers(topic)),
                         stamp_ns, stamp_ns)
    files = sorted((split / 'run').glob('*.mcap'))
    assert len(files) > 2
    [above] = find_cases(tmp_path / 'lab')
    assert Path(above.path) == split / 'run'
    # The bag itself is one recording too.
    [itself] = find_cases(split / 'run')
    assert (itself.path, itself.rig) == (above.path, 'rig')
    # So it is without metadata.yaml, as a killed recorder leaves it.
    (split / 'run' / 'metadata.yaml').unlink()
    assert find_cases(tmp_path / 'lab') == [above]
    assert [case.path for case in find_cases(split / 'run')] == [above.path]
    # rosbag2 compresses what is finished.
    packed = split / 'run' / f'{files[1].name}.zstd'
    packed.write_bytes(zstandard.compress(files[1].read_bytes()))
    assert find_cases(tmp_path / 'lab') == [above]
    files[1].unlink()
    assert find_cases(tmp_path / 'lab') == [above]
    # Files that are not numbered from 0 on by the name of their folder are recordings each.
    files[0].rename(split / 'run' / 'other.mcap')
    assert len(find_cases(tmp_path / 'lab')) == len(files)


def test_lone_files_of_a_folder_in_a_list_are_recordings_of_their_own(tmp_path):
    day = tmp_path / 'bench' / '2026-03-01'
    for name in ('a', 'b'):
        write_bag(tmp_path / name, 2)
        day.mkdir(parents=True, exist_ok=True)
        [file] = (tmp_path / name).glob('*.mcap')
        file.rename(day / f'{name}.mcap')
    table = tmp_path / 'list.txt'
    table.write_text('bench/2026-03-01\n')
    cases = find_cases(table)
    assert [Path(case.path) for case in cases] == [day / 'a.mcap', day / 'b.mcap']
    assert [case.path for case in find_cases(tmp_path / 'bench')] == [
        case.path for case in cases]
    assert [(case.rig, case.day) for case in cases] == [('bench', '1'), ('bench', '2')]


def test_each_recording_is_one_case_of_the_row_that_names_it_most_closely(exo, tmp_path):
    table = tmp_path / 'list.csv'
    runs = exo / 'runs'
    single, walk = runs / '2026-03-02' / 'run', runs / '2026-03-01' / 'walk'
    table.write_text(f'path,namespace,model\n{walk},/left_knee/flexor,a\n{single},/muscle,b\n'
                     f'{runs},,c\n{runs},right_knee,d\n')
    assert {(case.path, case.namespace): case.model for case in find_cases(table)} == {
        (str(single), '/muscle'): 'b', (str(walk), MUSCLES[0]): 'c', (str(walk), MUSCLES[1]): 'a',
        (str(walk), MUSCLES[2]): 'd', (str(walk), MUSCLES[3]): 'd'}
    # Also where it is named by another path.
    (tmp_path / 'link').symlink_to(runs / '2026-03-02')
    table.write_text(f'path,namespace\n{single},\nlink/run,/muscle\n')
    assert [case.namespace for case in find_cases(table)] == ['/muscle']
    for again in (single, 'link/run'):
        table.write_text(f'path\n{single}\n{again}\n')
        with pytest.raises(InputError, match='csv:3: names .*run, which .*csv:2 names already'):
            find_cases(table)
    table.write_text(f'path,namespace\n{walk},right_knee\n\n{walk},/right_knee/\n')
    with pytest.raises(InputError, match='csv:4: names /right_knee/.* in .*walk, which .*csv:2'):
        find_cases(table)


def test_the_name_of_the_bag_itself_tells_its_day(tmp_path):
    write_bag(tmp_path / 'check_2026-03-01', 2)
    assert [case.day for case in find_cases(tmp_path / 'check_2026-03-01')] == ['2026-03-01']


def test_each_muscle_has_its_model(exo):
    cases = find_cases(exo / 'runs' / '2026-03-01')
    knee = 'knee_dmsp_20_300'
    _, texts = _with_models(cases, Settings('gap', knee))
    assert texts == [f'{knee}/extensor', f'{knee}/flexor'] * 2
    own = exo / 'knee.yaml'
    own.write_text(f'joint: {knee}\nflexor: {{muscle: dmsp_20_300, load: driven, '
                   'parameters: {damping_n_s_per_m: 250.0}}\n')
    _, texts = _with_models(cases, Settings('gap', str(own)))
    assert [load_rig(text).parameters['damping_n_s_per_m'] for text in texts] == [
        300.0, 250.0, 300.0, 250.0]
    with pytest.raises(InputError, match='is a joint, and the only muscle in .*run'):
        _with_models(find_cases(exo / 'runs' / '2026-03-02'), Settings('gap', knee))
    # Or a list gives each its own, for all bags of a folder that have the muscle.
    table = exo / 'models.csv'
    (exo / 'flexor.yaml').write_text('rig: dmsp_20_300_hanging_mass\nname: mine\n')
    table.write_text('path,namespace,model\nruns,/left_knee/flexor,flexor.yaml\n'
                     f'runs,right_knee,{knee}\nruns/2026-03-02/run,,dmsp_5_300_realistic\n')
    single, left, *right = find_cases(table)
    assert single.model == 'dmsp_5_300_realistic' and single.namespace is None
    assert left.namespace == MUSCLES[1] and Path(left.model).name == 'flexor.yaml'
    assert [case.namespace for case in right] == MUSCLES[2:]
    table.write_text('path,namespace\nruns,/left_hip\n')
    with pytest.raises(InputError, match='no bag in this folder has the namespace /left_hip'):
        find_cases(table)


@pytest.mark.parametrize('text, says', [
    ('path,rigg\na,b\n', 'list.csv:1.*`rigg` .did you mean `rig`'),
    ('path,rig\na\n', 'list.csv:2.*1 values for 2 columns'),
    ('path,rig,day\n.,a,\n,b,2026-12-01\n', 'list.csv:3.*path is empty'),
    ('path,day\na,Monday\n', "list.csv:2.*day is 'Monday'"),
    ('path,day\na,2026-11-25T25:00\n', "list.csv:2.*day is '2026-11-25T25:00'"),
    ('# only\n', 'lists no recording'),
    ('path\n', 'lists no recording')])
def test_a_mistake_in_a_list_is_told_with_its_line(tmp_path, text, says):
    path = tmp_path / 'list.csv'
    path.write_text(text)
    with pytest.raises(InputError, match=says):
        find_cases(path)


def test_nothing_to_find_is_told(tmp_path):
    with pytest.raises(InputError, match='no bag in this folder'):
        find_cases(tmp_path)
    with pytest.raises(InputError, match='no such folder'):
        find_cases(tmp_path / 'gone')
