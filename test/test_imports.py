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

"""Which module imports which: no circle, and no arrow that points up."""

import ast
from pathlib import Path
import re

import pytest
from source_trees import parsed, statements_in

ROOT = Path(__file__).resolve().parent.parent
# From the bottom: a room imports from its own row and from those above it in this table.
LAYERS = (
    ('messages', 'topics', 'namespaces', 'resources', 'interrupts', 'exit_timer', 'kept_folders',
     'parallel', 'priority', 'random_levels', 'ros_log', 'ros_missing', 'slow_rise', 'transport',
     'control', 'disturbance', 'drivers', 'held_signal', 'loops', 'bags', 'hardware',
     'plant_loop', 'workers'),
    ('experiments', 'replay', 'tuning', 'valves', 'rules', 'tables', 'rig_files'),
    ('report', 'models', 'view'),
    ('campaign',),
    ('rigging',),
    ('investigate',),
    ('nodes',),
    ('cli', 'demo', 'warm_up'))
# What studies a rig or lists all there is; the physics below knows none of it.
ABOVE_THE_PHYSICS = ('identify', 'characterise', 'gap', 'catalogue')


def modules():
    """Return {name: file} of all modules of both packages."""
    return {
        '.'.join(path.relative_to(ROOT).with_suffix('').parts).removesuffix('.__init__'): path
        for top in ('pam_sim', 'pam_actuation') for path in sorted((ROOT / top).rglob('*.py'))}


def imported(tree, known):
    """
    Return (at the top, within functions): the modules that one module imports.

    What stands below ``if TYPE_CHECKING:`` is never run, so it closes no circle.
    """
    at_top, within = set(), set()
    waiting = [(tree, at_top)]
    while waiting:
        node, found = waiting.pop()
        names = []
        if isinstance(node, ast.If) and getattr(node.test, 'id', '') == 'TYPE_CHECKING':
            continue
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [full if (full := f'{node.module}.{alias.name}') in known else node.module
                     for alias in node.names]
        found.update(name for name in names if name in known)
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            found = within
        waiting += [(child, found) for child in statements_in(node)]
    return at_top, within


@pytest.fixture(scope='module')
def imports():
    """Return {module: (modules it imports at the top, those its functions import)}."""
    known = modules()
    return {name: imported(parsed(path), known) for name, path in known.items()}


@pytest.fixture(scope='module')
def at_top(imports):
    """Return {module: modules imported when it is imported}."""
    return {name: found[0] for name, found in imports.items()}


@pytest.fixture(scope='module')
def anywhere(imports):
    """Return {module: modules imported when it is imported, or by one of its functions}."""
    return {name: found[0] | found[1] for name, found in imports.items()}


def reached(graph, start):
    """Return the modules that one reaches, over others too."""
    seen, waiting = set(), [start]
    while waiting:
        for one in graph[waiting.pop()] - seen:
            seen.add(one)
            waiting.append(one)
    return seen


def circles(graph):
    """Return the sets of modules that reach each other."""
    reach = {name: reached(graph, name) for name in graph}
    found = []
    for name in graph:
        circle = {other for other in reach[name] if name in reach[other]}
        if circle and circle not in found:
            found.append(circle)
    return found


def layer_of(module):
    """Return the layer of a module of pam_actuation, counted from the bottom."""
    room = module.split('.')[1]
    return next(number for number, rooms in enumerate(LAYERS) if room in rooms)


def test_circles_are_found():
    assert circles({'a': {'b'}, 'b': {'c'}, 'c': {'b', 'd'}, 'd': set()}) == [{'b', 'c'}]
    tree = ast.parse('from p import a, x\ndef f():\n    import p.b\n')
    assert imported(tree, {'p': 0, 'p.a': 0, 'p.b': 0}) == ({'p', 'p.a'}, {'p.b'})


def test_no_modules_import_each_other_in_a_circle(at_top):
    assert circles(at_top) == []


def test_no_modules_reach_each_other_through_an_import_in_a_function(anywhere):
    assert circles(anywhere) == []


def test_every_room_has_a_layer():
    rooms = {path.stem for path in (ROOT / 'pam_actuation').iterdir()
             if path.suffix == '.py' or (path / '__init__.py').is_file()} - {'__init__'}
    assert sorted(room for rooms in LAYERS for room in rooms) == sorted(rooms)


def test_arrows_between_rooms_point_down(anywhere):
    up = {(name, other) for name, others in anywhere.items() for other in others
          if name.startswith('pam_actuation.') and other.startswith('pam_actuation.')
          and layer_of(other) > layer_of(name)}
    assert sorted(up) == []


def test_control_laws_bring_neither_plant_nor_driver(at_top):
    """A live controller simulates a rig only where its file brings no model to a linear law."""
    beside = {'pam_actuation.plant_loop', 'pam_actuation.drivers.loop', 'pam_actuation.loops.bus'}
    assert beside <= set(at_top)
    assert reached(at_top, 'pam_actuation.control.laws') & beside == set()


def test_the_physics_does_not_know_what_studies_it(anywhere):
    above = tuple(f'pam_sim.{room}' for room in ABOVE_THE_PHYSICS)
    found = {(name, other) for name, others in anywhere.items() for other in others
             if name.startswith('pam_sim.') and not name.startswith(above)
             and other.startswith(above)}
    assert sorted(found) == []


def walks():
    """Return {title: (number of files it states, names of their modules)} of the architecture."""
    text = (ROOT / 'docs/architecture.md').read_text(encoding='utf-8')
    text = text.partition('## Three walks')[2].partition('\n## ')[0]
    found = {}
    for walk in re.split(r'^\*\*(?=From )', text, flags=re.M)[1:]:
        title, count = re.match(r'(.*)\*\* \((\d+) files\)', walk).groups()
        places = ('', 'pam_actuation/', 'pam_sim/gap/' if 'verdict' in title else 'pam_actuation/')
        files = {next(path for place in places if (path := ROOT / f'{place}{name}').is_file())
                 for name in re.findall(r'`([\w/]+\.py)`', walk)}
        found[title] = int(count), {
            '.'.join(path.relative_to(ROOT).with_suffix('').parts) for path in files}
    return found


def test_a_walk_states_how_many_files_it_passes():
    assert len(walks()) == 3
    for title, (count, names) in walks().items():
        assert count == len(names), title


def test_the_files_of_a_walk_are_joined_by_imports(anywhere):
    """A file that the others no longer import, nor it them, has left the walk."""
    def all_of(name):       # what a package hands on counts as imported
        return set().union(*(anywhere[other] if f'{other}.py' not in files else {other}
                             for other in anywhere[name])) | anywhere[name]

    files = {f'{name}.py' for name in anywhere
             if (ROOT / f'{name.replace(".", "/")}.py').is_file()}
    for title, (_, names) in walks().items():
        joined = {name: set() for name in names}
        for name in names:
            for other in all_of(name) & names:
                joined[name].add(other)
                joined[other].add(name)
        seen, waiting = set(), [min(names)]
        while waiting:
            name = waiting.pop()
            waiting += joined[name] - seen
            seen.add(name)
        assert names - seen == set(), title
