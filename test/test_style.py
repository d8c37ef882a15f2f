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

import ast
import builtins
import json
from pathlib import Path
import statistics
import subprocess
import sys
import tomllib

import pytest
from source_trees import statements

ROOT = Path(__file__).resolve().parent.parent
HIDDEN = ('build', 'install', 'log')        # of colcon, beside what begins with a dot


def shown(part):
    """Tell whether a part of a path is of the project."""
    return not part.startswith('.') and part not in HIDDEN


# The folder of an environment, with ten thousand files, is not entered.
SOURCES = sorted([*ROOT.glob('*.py'), *(
    path for top in ROOT.iterdir() if top.is_dir() and shown(top.name)
    for path in top.rglob('*.py') if all(map(shown, path.relative_to(top).parts)))])
HEADER = ''.join(
    f'{line}\n' for line in (ROOT / 'setup.py').read_text(encoding='utf-8').splitlines()[:13])
# What ament_flake8 and ament_pep257 of ROS 2 Jazzy leave out, of the rules that Ruff has.
IGNORED_BY_AMENT = {
    'D100', 'D101', 'D102', 'D103', 'D104', 'D105', 'D106', 'D107', 'D203', 'D212', 'D404',
    'E226', 'E241', 'E242', 'E704'}
NO_RULES_OF_AMENT = {'A005', 'C420', 'D420', 'D421'}     # younger than Ubuntu 24.04
# E121, E123 and E126 are left out by pycodestyle itself; Ruff has no rules on such lines.
CONTINUATION_LINES = ['E122', 'E124', 'E125', 'E127', 'E128', 'E129', 'E131']
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


# What flake8 7.3 with the plug-ins of ament_flake8 says of these, line by line. Of the source it
# adds I100 of the second and third line and A003 of the eighth, and names the twelfth D001.
FOUND_IN_SOURCE = [
    (1, 'E401'), (1, 'F401'), (1, 'F401'), (2, 'F403'), (7, 'Q000'), (8, 'A002'), (8, 'E202'),
    (8, 'E251'), (8, 'E251'), (8, 'E301'), (9, 'C404'), (11, 'F405'), (11, 'Q000'), (12, 'C411'),
    (12, 'C416'), (12, 'E301'), (12, 'E702'), (12, 'UP005')]
FOUND_IN_DOCSTRINGS = [
    (1, 'D400'), (1, 'D415'), (5, 'D205'), (5, 'D209'), (5, 'D213'), (5, 'D400'), (5, 'D401'),
    (5, 'D415'), (11, 'D200'), (11, 'D204'), (11, 'D400'), (11, 'D415'), (15, 'D210'),
    (18, 'D401'), (18, 'D402'), (22, 'D201'), (22, 'D202'), (27, 'D213'), (27, 'D400'),
    (30, 'D409'), (32, 'D413'), (39, 'D419')]


def ruff(*arguments):
    """Run Ruff with the rules of this project; return what it found as a list of dict."""
    done = subprocess.run(
        [sys.executable, '-m', 'ruff', 'check', '--no-cache', '--output-format', 'json',
         '--config', str(ROOT / 'pyproject.toml'), *arguments],
        cwd=ROOT, capture_output=True, text=True)
    assert done.returncode in (0, 1), done.stderr
    return json.loads(done.stdout)


def parsed(file):
    """Return the lines of a file and its module."""
    text = file.read_text(encoding='utf-8')
    return text.splitlines(keepends=True), ast.parse(text)


def out_of_order(name, lines, module, style):
    """Return the mistakes in the order of the imports of a file, as ament_flake8 names them."""
    from flake8_import_order.checker import ImportOrderChecker
    # It looks at no import in a function or class: without those it is ten times as fast.
    imports = [node for node in module.body
               if isinstance(node, (ast.Import, ast.ImportFrom, ast.If))]
    checker = ImportOrderChecker(name, ast.Module(imports, []))
    checker.lines = lines
    checker.options = {
        'import_order_style': style, 'application_import_names': [],
        'application_package_names': []}
    return [(error.lineno, error.code) for error in checker.check_order()
            if error.code != 'I202']


def shadowed(lines, module):
    """Return the lines on which a class gives a method or an attribute the name of a builtin."""
    of_classes = (one for node in statements(module)
                  if isinstance(node, ast.ClassDef) for one in node.body)
    named = ((one.lineno, name) for one in of_classes for name in (
        [one.name] if isinstance(one, (ast.FunctionDef, ast.AsyncFunctionDef))
        else [getattr(target, 'id', '') for target in getattr(one, 'targets', ())]))
    return [line for line, name in named
            if hasattr(builtins, name) and not name.startswith('__')
            and 'noqa: A003' not in lines[line - 1]]


def first_row(node):
    """Return the line on which a statement begins, with its decorators."""
    return min([node.lineno, *(one.lineno for one in getattr(node, 'decorator_list', ()))])


def crowded(lines, module):
    """Return the lines of methods that follow the first line of their class at once, CNL100."""
    methods = (node.body[0] for node in statements(module) if isinstance(node, ast.ClassDef)
               and isinstance(node.body[0], (ast.FunctionDef, ast.AsyncFunctionDef)))
    return [row for row in map(first_row, methods)
            if lines[row - 2].strip() and not lines[row - 2].lstrip().startswith('#')]


def rows_of(node, lines):
    """Yield (first, last) line of what may be continued lines of a statement."""
    for one in getattr(node, 'decorator_list', ()):
        yield one.lineno, one.end_lineno
    begin = node.pattern.lineno if isinstance(node, ast.match_case) else node.lineno
    if not getattr(node, 'body', ()):
        text = getattr(node, 'value', None)
        if not isinstance(node, ast.Expr) or not isinstance(text, ast.Constant) or (
                lines[begin - 1].lstrip().startswith('(')):
            yield begin, node.end_lineno
        return
    body = node.body[0]
    row = first_row(body)
    # Where the body begins on the last line of the head, it ends these lines.
    beside = lines[row - 1].encode()[:body.col_offset].strip() and row == body.lineno
    yield begin, body.end_lineno if beside else row - 1


def continued(lines, module):
    """Return the statements of more than one line, as (first, last) line in their order."""
    found = []
    for begin, end in sorted({
            rows for node in statements(module) for rows in rows_of(node, lines)
            if rows[0] < rows[1]}):
        if found and begin <= found[-1][1]:
            begin, end = found[-1][0], max(end, found.pop()[1])
        found.append((begin, end))
    return found


def badly_continued(lines, module, options):
    """
    Return what pycodestyle says of continuation lines, as (line, code).

    It gets to see the statements of more than one line only. Between them stand lines without
    indentation, so that each may have its own.
    """
    import pycodestyle
    parts, places = [], []
    for begin, end in continued(lines, module):
        parts += ['pass\n', *lines[begin - 1:end]]
        places += [0, *range(begin, end + 1)]
    checker = pycodestyle.Checker(lines=parts, options=options)
    said = []
    checker.report_error = lambda line, offset, text, check: said.append(
        (places[line - 1], text[:4]))
    checker.check_all()
    return [one for one in said if one[1] in CONTINUATION_LINES]


def test_ruff_finds_nothing():
    """The sources, the launch files, the examples, the benchmarks and the tests, all of them."""
    pytest.importorskip('ruff')
    looked_at = subprocess.run(
        [sys.executable, '-m', 'ruff', 'check', '--show-files'], cwd=ROOT, capture_output=True,
        text=True, check=True).stdout.splitlines()
    assert {str(path) for path in SOURCES} <= set(looked_at)
    found = ruff()
    assert [f"{one['filename']}:{one['location']['row']}: {one['code']} {one['message']}"
            for one in found] == []


@pytest.fixture(scope='module')
def google():
    styles = pytest.importorskip('flake8_import_order.styles')
    return styles.lookup_entry_point('google')


@pytest.fixture(scope='module')
def continuation():
    """Return the options of pycodestyle for continuation lines."""
    pycodestyle = pytest.importorskip('pycodestyle')
    return pycodestyle.StyleGuide(select=CONTINUATION_LINES, max_line_length=99).options


@pytest.fixture(scope='module')
def found(google, continuation):
    """Return {rule: {file: mistakes}} of all sources; each is read and parsed once."""
    mistakes = {}
    for path in SOURCES:
        lines, module = parsed(path)
        for rule, said in (
                ('imports', out_of_order(str(path), lines, module, google)),
                ('builtins', shadowed(lines, module)), ('classes', crowded(lines, module)),
                ('continued', badly_continued(lines, module, continuation))):
            mistakes.setdefault(rule, {}).update({str(path): said} if said else {})
    return mistakes


@pytest.mark.slow
def test_continuation_lines_are_indented(found):
    assert found['continued'] == {}


def test_a_class_ends_its_first_line_with_an_empty_one_where_a_method_follows(found):
    assert found['classes'] == {}


def test_imports_have_the_order_of_google(found):
    assert found['imports'] == {}


def test_no_attribute_of_a_class_has_the_name_of_a_builtin(found):
    """A003 of flake8-builtins; that of Ruff looks only where such an attribute is used."""
    assert found['builtins'] == {}


def test_the_linters_say_what_flake8_with_its_plug_ins_says(google, tmp_path):
    pytest.importorskip('ruff')
    for text, wanted, mistakes, attributes, methods in (
            (BAD_SOURCE, FOUND_IN_SOURCE, [(2, 'I100'), (3, 'I100')], [8], []),
            (BAD_DOCSTRINGS, FOUND_IN_DOCSTRINGS, [], [], [])):
        file = tmp_path / 'bad.py'
        file.write_text(text, encoding='utf-8')
        said = sorted((one['location']['row'], one['code']) for one in ruff(str(file)))
        # Of sections of a docstring Ruff finds more than pydocstyle.
        assert [one for one in said if one not in ((29, 'D410'), (32, 'D411'))] == wanted
        lines, module = parsed(file)
        assert out_of_order(str(file), lines, module, google) == mistakes
        assert shadowed(lines, module) == attributes
        assert crowded(lines, module) == methods


def test_pyproject_holds_the_rules_of_the_ament_linters():
    rules = tomllib.loads((ROOT / 'pyproject.toml').read_text(encoding='utf-8'))['tool']['ruff']
    assert (rules['line-length'], rules['lint']['flake8-quotes']['inline-quotes']) == (
        99, 'single')
    assert set(rules['lint']['ignore']) == IGNORED_BY_AMENT | NO_RULES_OF_AMENT


@pytest.mark.parametrize('linter', ['ament_copyright', 'ament_flake8', 'ament_pep257'])
def test_the_linters_of_ros_2_find_nothing(linter):
    """Where they are installed, which is on a machine with ROS 2."""
    pytest.importorskip(linter)
    done = subprocess.run(
        [sys.executable, '-m', f'{linter}.main'], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-5000:]


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
    assert {name: length for name, length in lengths.items() if length > 500} == {}, (
        'a file has at most 500 lines; split it')
    assert statistics.median(lengths.values()) < 250


def test_no_two_test_files_have_the_same_name():
    """Pytest imports a test file by its name alone, and refuses the second one."""
    names = [path.name for path in SOURCES if path.name.startswith('test_')]
    assert sorted({name for name in names if names.count(name) > 1}) == []
