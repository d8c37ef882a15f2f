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

"""Style: the rules of the ROS 2 linters, the licence header, the size of files."""

import configparser
from importlib.metadata import distribution, PackageNotFoundError
from pathlib import Path
import re
import statistics
import subprocess
import sys

import pytest

ROOT = Path(__file__).resolve().parent.parent
HIDDEN = ('build', 'install', 'log')        # of colcon, beside what begins with a dot
SOURCES = sorted(
    path for path in ROOT.rglob('*.py')
    if not any(part.startswith('.') or part in HIDDEN for part in path.relative_to(ROOT).parts))
HEADER = ''.join(
    f'{line}\n' for line in (ROOT / 'setup.py').read_text(encoding='utf-8').splitlines()[:13])
QUICK_FLAKE8 = 'test/quick_flake8.py'
# What ament_flake8 and ament_pep257 of ROS 2 Jazzy leave out; its linters read no setup.cfg.
FLAKE8_IGNORED = 'B902,C816,D100,D101,D102,D103,D104,D105,D106,D107,D203,D212,D404,I202'
PEP257_IGNORED = 'D100,D101,D102,D103,D104,D105,D106,D107,D203,D212,D404'
PLUG_INS = (
    'flake8-blind-except', 'flake8-builtins', 'flake8-class-newline', 'flake8-comprehensions',
    'flake8-deprecated', 'flake8-docstrings', 'flake8-import-order', 'flake8-quotes')
BAD_DOCSTRINGS = '''"""summary without a capital"""


def one(a):
    """Returns the thing
    second line"""
    return a


class Two:
    """
    A class
    """
    def three(self):
        """ Spaces. """

    def four(self):
        """The four(self) signature."""

    def five(self):

        """Blank lines."""

        return 1

    def six(self):
        """Six!

        Parameters
        ---------
        x : int
        Returns
        -------
        y
        """


def seven():
    """"""
'''
BAD_SOURCE = """import sys, os
from json import *
from abc import ABC


class Two():
    x = "double"
    def id(self, list = [] ):
        l = dict([(a, 1) for a in list])    # noqa: E741
        m = "double"    # noqa
        return f"{l}{m}", lambda: undefined
    def assertEquals(self): self.assertEquals(1, 2); return list([_ for _ in ABC])
"""


def checked(*command):
    """Run a linter on everything it would look at in this repository; fail with what it says."""
    done = subprocess.run(
        [sys.executable, *command], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-5000:]


@pytest.mark.slow
def test_linters_find_nothing():
    """
    The sources, the launch files, the examples, the benchmarks and the tests, all of them.

    The plug-in for docstrings is pydocstyle, with the convention ``all`` every rule of it.
    """
    pytest.importorskip('flake8')
    checked(QUICK_FLAKE8, '--config', 'setup.cfg', '--docstring-convention', 'all',
            *map(str, SOURCES))


def test_flake8_says_of_a_docstring_what_pydocstyle_says(tmp_path):
    """One run of a linter over all files is enough."""
    pytest.importorskip('flake8')
    pytest.importorskip('pydocstyle')
    file = tmp_path / 'bad.py'
    file.write_text(BAD_DOCSTRINGS, encoding='utf-8')
    found = []
    for module, *options in (('pydocstyle',), ('flake8', '--docstring-convention', 'all')):
        done = subprocess.run(
            [sys.executable, '-m', module, '--config', str(ROOT / 'setup.cfg'), *options,
             str(file)], cwd=ROOT, capture_output=True, text=True)
        found.append(sorted(re.findall(r'\bD\d{3}\b', done.stdout)))
    assert found[0] == found[1] and len(set(found[0])) > 10


def test_quick_flake8_says_what_flake8_says(tmp_path):
    pytest.importorskip('flake8')
    files = [tmp_path / name for name in ('one.py', 'two.py', 'three.py')]
    for file, text in zip(files, (BAD_SOURCE, BAD_DOCSTRINGS, f'{BAD_SOURCE}def three(:\n')):
        file.write_text(text, encoding='utf-8')
    said = [subprocess.run(
        [sys.executable, *linter, '-j1', '--config', str(ROOT / 'setup.cfg'),
         '--docstring-convention', 'all', *map(str, files)], cwd=ROOT, capture_output=True,
        text=True).stdout for linter in (('-m', 'flake8'), (QUICK_FLAKE8,))]
    assert said[0] == said[1]
    codes = set(re.findall(r': ([A-Z]\d{3}) ', said[0]))
    assert {code[0] for code in codes} >= set('ACDEFQ') and len(codes) > 25


def test_setup_cfg_holds_the_rules_of_the_ament_linters():
    config = configparser.ConfigParser()
    config.read(ROOT / 'setup.cfg')
    flake8, pydocstyle = config['flake8'], config['pydocstyle']
    assert set(flake8) == {'max-line-length', 'import-order-style', 'extend-ignore'}
    assert flake8['extend-ignore'] == f'A005,{FLAKE8_IGNORED}'
    assert (flake8['max-line-length'], flake8['import-order-style']) == ('99', 'google')
    assert dict(pydocstyle) == {'ignore': PEP257_IGNORED}


def test_the_plug_ins_of_ament_flake8_are_installed():
    missing = []
    for name in PLUG_INS:
        try:
            distribution(name)
        except PackageNotFoundError:
            missing.append(name)
    if missing:
        pytest.skip(f'not installed: {", ".join(missing)}; make env brings them')


@pytest.mark.parametrize('linter', ['ament_copyright', 'ament_flake8', 'ament_pep257'])
def test_the_linters_of_ros_2_find_nothing(linter):
    """Where they are installed, which is on a machine with ROS 2."""
    pytest.importorskip(linter)
    checked('-m', f'{linter}.main')


def test_every_source_begins_with_the_licence_header():
    """All that ament_copyright looks at: every Python file, of whatever folder."""
    assert 'Licensed under the Apache License, Version 2.0' in HEADER
    assert {path.relative_to(ROOT).parts[0] for path in SOURCES} >= {
        'benchmarks', 'examples', 'launch', 'pam_actuation', 'pam_sim', 'setup.py', 'test'}
    assert [str(p) for p in SOURCES if not p.read_text(encoding='utf-8').startswith(HEADER)] == []


def test_contributing_says_what_ament_copyright_looks_for():
    text = ' '.join((ROOT / 'CONTRIBUTING.md').read_text(encoding='utf-8').split())
    assert 'Any contribution that you make to this repository will be under the Apache 2 ' \
        'License, as dictated by that [license]' in text
    assert '5. Submission of Contributions. Unless You explicitly state otherwise, any ' \
        'Contribution intentionally submitted for inclusion in the Work by You to the ' \
        'Licensor shall be under the terms and conditions of this License' in text


def test_files_stay_readable():
    lengths = {str(path.relative_to(ROOT)): len(path.read_text(encoding='utf-8').splitlines())
               for path in SOURCES}
    assert {name: length for name, length in lengths.items() if length > 500} == {}
    assert statistics.median(lengths.values()) < 250
