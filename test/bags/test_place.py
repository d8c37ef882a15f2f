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

"""A bag replaces another only when it is whole, and nothing but that other."""

import os
from pathlib import Path
import shutil

from pam_actuation.bags.load import load_run
from pam_actuation.bags.place import bags_called, check_bag_target
from pam_actuation.bags.writer import BagWriter
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_sim import load_rig
from pam_sim.errors import InputError
import pytest

PUSH = 'name: push\ndomain: pressure\nsegments:\n  - step: {to_pa: 250000.0, duration_s: 0.4}\n'


def simulate(out, seed=0, text=PUSH, **options):
    return simulate_experiment(
        load_experiment(text), load_rig('dmsp_5_300_hanging_mass'), None, out, seed=seed,
        **options)['bag']


def listed(folder):
    """Return relative path to content of every file below a folder."""
    return {str(path.relative_to(folder)): path.read_bytes()
            for path in sorted(folder.rglob('*')) if path.is_file()}


def test_the_former_bag_is_there_until_the_new_one_is_whole(tmp_path):
    bag = Path(simulate(tmp_path / 'bag'))
    before = listed(bag)
    writer = BagWriter(bag, {'valve': 'ppr'}, overwrite=True)
    assert listed(bag) == before and writer.file.parent == tmp_path / 'bag_unfinished'
    writer.close()
    assert os.listdir(tmp_path) == ['bag'] and writer.file == bag / 'bag_0.mcap'
    assert load_names(bag) == ['bag_0.mcap', 'metadata.yaml']
    assert listed(bag) != before


def load_names(folder):
    return sorted(os.listdir(folder))


def test_a_bag_of_several_files_is_replaced_as_a_whole(tmp_path):
    with BagWriter(tmp_path / 'bag', {}, max_file_bytes=100_000) as writer:
        writer.add_topic('/imu', 'sensor_msgs/msg/Imu')
        for k in range(6):
            writer.write('/imu', os.urandom(60_000), k, k)
    assert len(load_names(tmp_path / 'bag')) > 3
    simulate(tmp_path / 'bag', overwrite=True)
    assert load_names(tmp_path / 'bag') == ['bag_0.mcap', 'metadata.yaml']


@pytest.mark.parametrize('kind', [
    'other recordings', 'more recordings', 'a thesis', 'no metadata', 'foreign metadata',
    'a list of other files', 'a link in place of a file'])
def test_anything_else_is_refused_and_stays(kind, tmp_path):
    folder = tmp_path / 'many'
    simulate(folder)
    file = folder / 'many_0.mcap'
    if kind == 'other recordings':
        (folder / 'metadata.yaml').unlink()
        file.rename(folder / 'monday.mcap')
        shutil.copy(folder / 'monday.mcap', folder / 'tuesday.mcap')
    elif kind == 'more recordings':
        shutil.copy(file, folder / 'monday.mcap')
    elif kind == 'a thesis':
        (folder / 'thesis.txt').write_text('mine')
    elif kind == 'no metadata':
        (folder / 'metadata.yaml').unlink()
    elif kind == 'foreign metadata':
        (folder / 'metadata.yaml').write_text('title: mine\n')
    elif kind == 'a list of other files':
        shutil.copy(file, tmp_path / 'kept.mcap')
        text = (folder / 'metadata.yaml').read_text()
        (folder / 'metadata.yaml').write_text(text.replace('many_0.mcap', '../kept.mcap'))
    else:
        file.rename(tmp_path / 'kept.mcap')
        file.symlink_to('../kept.mcap')
    before = listed(tmp_path)
    with pytest.raises(InputError, match='is not overwritten|holds no bag') as told:
        simulate(folder, overwrite=True)
    assert str(folder) in str(told.value) and '\n' not in str(told.value)
    assert listed(tmp_path) == before


def test_a_run_that_fails_leaves_what_was_there_and_nothing_else(tmp_path):
    bag = Path(simulate(tmp_path / 'bag'))
    before = listed(tmp_path)
    for out in (bag, tmp_path / 'deep' / 'down'):
        with pytest.raises(Exception, match='seed|non-negative|negative'):
            simulate(out, seed=-1, overwrite=True)
        assert listed(tmp_path) == before and os.listdir(tmp_path) == ['bag']
    assert load_run(bag).metadata['seed'] == '0'


@pytest.mark.parametrize('out', ['.', '..', '', '~', '/', '/proc', 'link', 'file', 'x' * 240,
                                 'file/below', '/dev/null', 'here/..'])
def test_folders_that_are_no_place_for_a_bag(out, tmp_path, monkeypatch):
    here = tmp_path / 'here'
    here.mkdir()
    (here / 'file').write_text('mine')
    (here / 'link').symlink_to(tmp_path)
    (here / 'here').mkdir()
    monkeypatch.chdir(here)
    for overwrite in (False, True):
        with pytest.raises(InputError):
            check_bag_target(out, overwrite)
        with pytest.raises(InputError):
            BagWriter(out, {}, overwrite=overwrite)
    assert sorted(path.name for path in tmp_path.rglob('*')) == ['file', 'here', 'here', 'link']


def test_the_home_folder_is_no_place_for_a_bag(tmp_path, monkeypatch):
    monkeypatch.setenv('HOME', str(tmp_path))
    with pytest.raises(InputError, match='no folder for one bag'):
        check_bag_target(tmp_path)


def test_one_that_is_not_whole_goes_beside_the_former(tmp_path):
    bag = Path(simulate(tmp_path / 'bag'))
    before = listed(bag)
    for name in ('bag_stopped', 'bag_stopped2'):
        writer = BagWriter(bag, {}, overwrite=True)
        writer.replace_nothing()
        writer.close()
        assert writer.directory == tmp_path / name
        assert load_names(tmp_path / name) == ['bag_0.mcap', 'metadata.yaml']
    assert listed(bag) == before


def test_a_new_bag_is_told_from_the_one_it_replaces(tmp_path):
    bag = tmp_path / 'bag'
    assert bags_called(bag) == {}
    BagWriter(bag).close()
    (tmp_path / 'bag_unfinished').mkdir()       # empty
    before = bags_called(bag)
    assert list(before) == [bag]
    writer = BagWriter(bag, overwrite=True)
    assert bags_called(bag) == {**before, writer.file.parent: writer.file.parent.stat().st_ino}
    writer.close()
    assert list(bags_called(bag)) == [bag] and bags_called(bag) != before


def test_what_was_put_into_the_former_folder_meanwhile_stays(tmp_path):
    bag = Path(simulate(tmp_path / 'bag'))
    writer = BagWriter(bag, {}, overwrite=True)
    (bag / 'notes.txt').write_text('mine')
    writer.close()
    assert writer.finished and writer.directory == bag
    assert load_names(bag) == ['bag_0.mcap', 'metadata.yaml']
    assert load_names(tmp_path) == ['bag', 'bag_former']
    assert listed(tmp_path / 'bag_former') == {'notes.txt': b'mine'}
