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
Records are read by the names of their fields, in both packages.

Two kinds of index are refused:

* an upper-case name of a whole number, ``out[OUT_PRESSURE]`` or ``st[layout.S_TIME + i]``,
  set to a number or unpacked from ``range``;
* a written number on an array with the name of a record, ``par[2]``, ``par[k + 2]`` or
  ``log[:, 3]``.

Counts are no places: a slice of the only axis may have a name or a sum as a bound, and names
of sizes are free (``_SIZE``, ``_BYTES``). ``REASONS[OK]`` looks a number up in a table, whose
name is upper-case too.
"""

import ast
from pathlib import Path
import re

import pytest
from source_trees import imports, parsed

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ('pam_sim', 'pam_actuation')
UPPER = re.compile(r'_?[A-Z][A-Z0-9]*(_[A-Z0-9]+)*')
SIZE = re.compile(r'.*_(SIZE|BYTES)')
# The last word of the names that arrays of records have.
RECORDS = {'par', 'state', 'st', 'out', 'inp', 'inputs', 'log', 'entry', 'plant', 'joint'}


def name_of(node):
    """Return the last name of ``a``, ``a.b`` or ``a[0].b``, '' of anything else."""
    return getattr(node, 'id', getattr(node, 'attr', ''))


def module_of(path):
    """Return the dotted name of a file of a package."""
    return '.'.join(path.relative_to(ROOT).with_suffix('').parts).removesuffix('.__init__')


def numbered(tree):
    """Return the upper-case names a module sets to whole numbers."""
    names = set()
    for node in tree.body:
        if not isinstance(node, ast.Assign):
            continue
        for target in node.targets:
            targets = target.elts if isinstance(target, ast.Tuple) else [target]
            value = node.value
            values = value.elts if isinstance(value, ast.Tuple) else [value] * len(targets)
            counted = isinstance(value, ast.Call) and name_of(value.func) == 'range'
            names |= {name_of(one) for one, number in zip(targets, values)
                      if counted or type(getattr(number, 'value', None)) is int}
    return {name for name in names if UPPER.fullmatch(name)}


def imported(tree):
    """Return {name here: (module, name there)} of what a module imports by name."""
    found = {}
    for node in imports(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            found.update({one.asname or one.name: (node.module, one.name) for one in node.names})
    return found


def reads(tree):
    """Return (what a module imports by name, its subscripts): all that is needed of its tree."""
    return imported(tree), [node for node in ast.walk(tree) if isinstance(node, ast.Subscript)]


def refused(of_module, numbers, own):
    """
    Return the lines of a module with a subscript that reads a record by number.

    Parameters
    ----------
    of_module : tuple
        What ``reads`` says of the module.
    numbers : dict of str -> set of str
        Names of whole numbers of each module.
    own : set of str
        Those of this module.

    """
    known, subscripts = of_module

    def is_number(node):
        """Tell whether a name stands for a whole number set somewhere in the packages."""
        if isinstance(node, ast.Name):
            module, name = known.get(node.id, ('', ''))
            return node.id in own or name in numbers.get(module, ())
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            package, name = known.get(node.value.id, ('', ''))
            return node.attr in numbers.get(f'{package}.{name}', ())
        return False

    lines = set()
    for node in subscripts:
        if UPPER.fullmatch(name_of(node.value)):
            continue
        of_record = name_of(node.value).split('_')[-1] in RECORDS
        names, written = places(node.slice)
        if (any(is_number(one) and not SIZE.fullmatch(name_of(one)) for one in names)
                or of_record and written):
            lines.add(node.lineno)
    return sorted(lines)


def places(index):
    """Return the names an index is made of, and whether a number is written in it."""
    axes = index.elts if isinstance(index, ast.Tuple) else [index]
    names, written = [], False
    for axis in axes:
        bounds = [axis.lower, axis.upper] if isinstance(axis, ast.Slice) else [axis]
        sums_count = len(axes) == 1 and not isinstance(axis, ast.Slice)
        for bound in filter(None, bounds):
            nodes = list(terms(bound))
            if len(axes) > 1 or sums_count:
                names += [one for one in nodes if isinstance(one, (ast.Name, ast.Attribute))]
            written |= any(type(getattr(one, 'value', None)) is int
                           for one in (nodes if sums_count else [bound]))
    return names, written


def terms(node):
    """Return the parts of a sum or product, without what is inside of calls and indices."""
    if isinstance(node, ast.BinOp):
        return [*terms(node.left), *terms(node.right)]
    return [node]


@pytest.fixture(scope='module')
def found():
    """Return {file: lines that read a record by number} of both packages."""
    numbers, subscripts = {}, {}
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob('*.py')):
            tree = parsed(path)
            numbers[module_of(path)], subscripts[path] = numbered(tree), reads(tree)
    lines = {path.relative_to(ROOT).as_posix(): refused(one, numbers, numbers[module_of(path)])
             for path, one in subscripts.items()}
    return {name: where for name, where in lines.items() if where}


def test_no_record_is_read_by_number(found):
    assert found == {}


@pytest.mark.parametrize('line, is_refused', [
    ('out[P_GAIN]', True), ('st[S_HEAD + 2 * n]', True), ('log[:, layout.OUT_FORCE]', True),
    ('anything[S_TIME]', True), ('par[2]', True), ('self._inputs[0]', True),
    ('log[:, 4:6]', True), ('plant_out[3]', True), ('par[k + 1]', True), ('inputs[6:8]', True),
    ('log[:, S_TIME:S_HEAD + 1]', True), ('par.gain', False), ('REASONS[S_TIME]', False),
    ('table[HEAD_SIZE:]', False), ('pressure_pa[0]', False), ('log[tick]', False),
    ('out[k + 1:n + 1]', False), ('out[k + 1, j]', False), ('text[:P_RATE]', False),
    ('st[last(2)]', False), ('settings[NAME]', False)])
def test_what_counts_as_a_number(line, is_refused):
    tree = ast.parse(
        'from pam_sim.rollout import layout\nP_GAIN, P_RATE = range(2)\nHEAD_SIZE = 2\n'
        f'S_HEAD, S_TIME = 3, 4\nNAME = "gain"\n{line}\n')
    numbers = {'pam_sim.rollout.layout': {'OUT_FORCE'}}
    assert bool(refused(reads(tree), numbers, numbered(tree))) is is_refused
