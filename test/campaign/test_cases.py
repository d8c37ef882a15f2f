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

from pam_actuation.campaign.cases import find_cases
from pam_sim.errors import InputError
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'bags'))
from sample_bag import write_bag  # noqa: E402, I100


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


def test_recordings_of_one_time_are_numbered(tmp_path):
    for name in ('b', 'a'):
        write_bag(tmp_path / name, 20)
    assert [(Path(case.path).name, case.day, case.rig) for case in find_cases(tmp_path)] == [
        ('a', '1', 'rig'), ('b', '2', 'rig')]


@pytest.mark.parametrize('text, says', [
    ('path,rigg\na,b\n', 'list.csv:1.*`rigg` .did you mean `rig`'),
    ('path,rig\na\n', 'list.csv:2.*1 values for 2 columns'),
    ('path,day\na,Monday\n', "list.csv:2.*day is 'Monday'"), ('# only\n', 'lists no recording'),
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
