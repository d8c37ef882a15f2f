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

"""
A folder of things a user would miss, and a look at it that notices every change.

``prepare`` fills it: recordings whole and broken, pages, tables, links, a pipe, a socket.
``look`` returns what is there, byte for byte.
"""

import hashlib
import json
import os
from pathlib import Path
import shutil
import socket
import stat

from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.report.gap import FILES
from pam_sim import load_rig

EXPERIMENT = """\
name: pushes
domain: pressure
segments:
  - rest: {duration_s: 0.3}
  - step: {to_pa: 250000.0, duration_s: 0.5}
"""
RIG = 'dmsp_5_300_hanging_mass'
WRONG_YAML = {
    'evil.yaml': EXPERIMENT.replace('pushes', '../../evil'),
    'hidden.yaml': EXPERIMENT.replace('pushes', '.hidden'),
    'long_name.yaml': EXPERIMENT.replace('pushes', 'p' * 300),
    'wrong_key.yaml': EXPERIMENT + 'colour: red\n',
    'broken.yaml': 'name: [1, 2\n',
    'list.yaml': '- 1\n- 2\n',
    'empty.yaml': ''}


def prepare(root):
    """
    Fill a folder; return the one to call from, three levels down in it.

    Parameters
    ----------
    root : pathlib.Path
        An empty folder.

    """
    here = root / 'home' / 'work' / 'here'
    here.mkdir(parents=True)
    (here / 'good.yaml').write_text(EXPERIMENT)
    (here / 'rig.yaml').write_text(f'rig: {RIG}\nvalve: ppr\n')
    experiment = load_experiment(here / 'good.yaml')
    simulate_experiment(experiment, load_rig(RIG), None, here / 'bag')
    for name, text in WRONG_YAML.items():
        (here / name).write_text(text)
    (here / 'binary.yaml').write_bytes(bytes(range(256)))
    _wrong_bags(here)
    for name in ('page.html', 'table.csv', 'notes.txt', 'tuned.yaml', 'rules.json', 'kept.npz',
                 'kept.md', 'kept.json'):
        (here / name).write_text('years of work\n')
    (here / 'results').mkdir()
    for name in (*FILES, 'plan.json', 'experiment.yaml', 'characterise.json', 'valve_driver.md'):
        (here / 'results' / name).write_text('years of work\n')
    (here / 'folder').mkdir()
    (here / 'empty_folder').mkdir()
    (here / 'folder' / 'diary.txt').write_text('years of work\n')
    (here / 'link.html').symlink_to('page.html')
    (here / 'link_folder').symlink_to('folder')
    (here / 'dangling').symlink_to('nothing')
    (here / 'loop').symlink_to('loop')
    for name in ('pipe', 'pipe.mcap', 'pipe.yaml', 'pipe.json', 'pipe.csv', 'pipe.html'):
        os.mkfifo(here / name)
    with socket.socket(socket.AF_UNIX) as made:
        before = os.getcwd()
        os.chdir(here)              # a socket's path may have 107 characters only
        try:
            made.bind('socket')
        finally:
            os.chdir(before)
    return here


def _wrong_bags(here):
    """Make recordings that are no bag, and folders with more in them than one bag."""
    file = here / 'bag' / 'bag_0.mcap'
    whole = file.read_bytes()
    (here / 'cut.mcap').write_bytes(whole[:len(whole) // 2])
    (here / 'binary.mcap').write_bytes(bytes(range(256)) * 40)
    (here / 'text.mcap').write_text('this is no recording\n' * 50)
    (here / 'empty.mcap').write_bytes(b'')
    (here / 'many').mkdir()
    for day in ('monday', 'tuesday'):
        shutil.copy(file, here / 'many' / f'{day}.mcap')
    shutil.copytree(here / 'bag', here / 'bag_and_more')
    (here / 'bag_and_more' / 'thesis.txt').write_text('years of work\n')
    shutil.copytree(here / 'bag', here / 'bag_and_another')
    shutil.copy(file, here / 'bag_and_another' / 'wednesday.mcap')
    shutil.copytree(here / 'bag', here / 'cut_bag')
    (here / 'cut_bag' / 'bag_0.mcap').write_bytes(whole[:len(whole) // 3])
    shutil.copytree(here / 'bag', here / 'odd_bag')
    (here / 'odd_bag' / 'metadata.yaml').write_text('a: b\n')
    (here / 'gone_bag').mkdir()
    shutil.copy(here / 'bag' / 'metadata.yaml', here / 'gone_bag' / 'metadata.yaml')
    (here / 'sqlite.db3').write_text('this is no database\n')


def look(root):
    """Return relative path to kind, size and content of everything below a folder."""
    found = {}
    for folder, names, files in os.walk(root):
        for name in (*names, *files):
            path = Path(folder) / name
            status = path.lstat()
            kind = stat.S_IFMT(status.st_mode)
            content = ''
            if stat.S_ISREG(kind):
                content = hashlib.sha256(path.read_bytes()).hexdigest()
            elif stat.S_ISLNK(kind):
                content = os.readlink(path)
            found[str(path.relative_to(root))] = (kind, status.st_mode, content)
    return found


def changes(before, after):
    """Return what differs between two looks, as a sentence; '' if nothing does."""
    told = {'new': after.keys() - before.keys(), 'gone': before.keys() - after.keys(),
            'changed': {k for k in before.keys() & after.keys() if before[k] != after[k]}}
    return json.dumps({what: sorted(names) for what, names in told.items() if names}) \
        if any(told.values()) else ''


def clear(root, before):
    """Remove what has come since a look."""
    for name in sorted(look(root).keys() - before.keys(), reverse=True):
        path = root / name
        path.rmdir() if path.is_dir() and not path.is_symlink() else path.unlink()
