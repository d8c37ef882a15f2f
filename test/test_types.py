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

"""Types: what mypy says of both packages, and that nothing is left without annotations."""

import ast
import importlib
import os
from pathlib import Path
import re
import subprocess
import sys
import tomllib  # noqa: I201

import numpy as np
import pytest
from source_trees import parsed, statements

ROOT = Path(__file__).resolve().parent.parent
CONFIG = tomllib.loads((ROOT / 'pyproject.toml').read_text(encoding='utf-8'))['tool']['mypy']


def modules():
    """Return {name: file} of all modules of both packages."""
    files = (path for top in CONFIG['packages'] for path in sorted((ROOT / top).rglob('*.py')))
    return {'.'.join(path.relative_to(ROOT).with_suffix('').parts).removesuffix('.__init__'): path
            for path in files}


def bare_parts(path):
    """Return the functions of a file with parameters or results that are not annotated."""
    bare = []
    all_of_it = list(statements(parsed(path)))
    methods = {id(function) for parent in all_of_it if isinstance(parent, ast.ClassDef)
               for function in parent.body
               if isinstance(function, (ast.FunctionDef, ast.AsyncFunctionDef))
               and not any(getattr(d, 'id', '') == 'staticmethod'
                           for d in function.decorator_list)}
    for function in all_of_it:
        if not isinstance(function, (ast.FunctionDef, ast.AsyncFunctionDef)):
            continue
        said = function.args
        named = [*said.posonlyargs, *said.args][id(function) in methods:]
        taken = [*named, *said.kwonlyargs, *filter(None, (said.vararg, said.kwarg))]
        if function.returns is None or any(one.annotation is None for one in taken):
            bare.append(f'{path.name}:{function.lineno} {function.name}')
    return bare


def test_mypy_finds_nothing():
    """Both packages, strictly; seconds where `mypy` left a cache. To write one takes longer."""
    pytest.importorskip('mypy')
    if tuple(map(int, np.__version__.split('.')[:2])) < (2, 2):
        pytest.skip('the annotations of numpy before 2.2 say less')
    cache = '.mypy_cache' if (ROOT / '.mypy_cache').is_dir() else os.devnull
    done = subprocess.run([sys.executable, '-m', 'mypy', '--cache-dir', cache], cwd=ROOT,
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-5000:]


# What mypy is told to pass over, and why: `# type: ignore[code]  # reason`.
PASSED_OVER = re.compile(r'#\s*type:\s*ignore')
REASONED = re.compile(r'# type: ignore\[[a-z-]+\]  # \w+( \S+)+$')


def unreasoned(text):
    """Return the numbers of the lines that mypy passes over without a code and a reason."""
    return [number for number, line in enumerate(text.splitlines(), 1)
            if PASSED_OVER.search(line) and not REASONED.search(line)]


def test_what_mypy_passes_over_has_a_reason():
    found = {name: lines for name, path in modules().items()
             if (lines := unreasoned(path.read_text(encoding='utf-8')))}
    assert found == {}


@pytest.mark.parametrize('line, is_refused', [
    ('a = b  # type: ignore[assignment]  # mcap has no annotations', False),
    ('a = b     # type: ignore[assignment]', True), ('a = b  # type: ignore', True),
    ('a = b  # type:ignore  # mcap has no annotations', True),
    ('a = b  # type: ignore[misc]  # why', True), ('a = b  # of type ignore', False)])
def test_what_counts_as_a_reason(line, is_refused):
    assert bool(unreasoned(line)) == is_refused


def test_no_module_is_left_out():
    assert not [one for one in CONFIG['overrides'] if one.get('ignore_errors')]


@pytest.mark.parametrize('package', CONFIG['packages'])
def test_every_function_is_annotated(package):
    found = {name: bare for name, path in modules().items()
             if name.split('.')[0] == package and (bare := bare_parts(path))}
    assert found == {}


@pytest.mark.parametrize('package', CONFIG['packages'])
def test_the_annotations_are_for_users_of_the_package_too(package):
    assert (Path(importlib.import_module(package).__file__).parent / 'py.typed').is_file()
