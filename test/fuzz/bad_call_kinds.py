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
What can be wrong in a call of ``pam``: verbs with their arguments, and wrong values per kind.

Every value listed for a kind is a mistake wherever an argument of that kind stands. A call with
one of them has to end with exit code 2.
"""

from dataclasses import dataclass

LONG = 'x' * 300
RIG = 'dmsp_5_300_hanging_mass'
ABSENT = ('nothing_such', 'missing/deep/down', LONG, '', ' ', 'a\0b', 'two\nlines')
SPECIAL = ('pipe', 'socket', 'dangling', 'loop', '/dev/null', '/proc', '/')


@dataclass(frozen=True)
class Slot:
    """One argument: its flag ('' for a positional one), its kind, a value that is right."""

    flag: str
    kind: str
    good: str | None = None

    def arguments(self, value):
        """Return the words on the command line, none for a value that is None."""
        if value is None:
            return []
        return [f'{self.flag}={value}'] if self.flag else [value]


NUMBERS = ('nan', 'inf', '-inf', '1e999', '-1e999', '', 'abc', '3,5', '--5', '0x1f', '1 2', '½')
# Nothing writes here: not there, not a folder, not allowed, not possible.
NOWHERE = ('page.html/below', '/proc/new/one', '/dev/null/below', LONG, f'new/{LONG}', 'a\0b',
           '', ' ')
BAGS = ('binary.mcap', 'text.mcap', 'empty.mcap', 'cut.mcap', 'cut_bag', 'odd_bag', 'gone_bag',
        'empty_folder', 'folder', 'notes.txt', 'sqlite.db3', 'pipe.mcap', 'page.html/below',
        *ABSENT, *SPECIAL)
YAML = ('wrong_key.yaml', 'broken.yaml', 'list.yaml', 'empty.yaml', 'binary.yaml', 'notes.txt',
        'folder', 'pipe.yaml', 'bag/bag_0.mcap', 'page.html/below', *ABSENT, *SPECIAL)
VALUES = {
    'bag': BAGS,
    'experiment': ('evil.yaml', 'hidden.yaml', 'long_name.yaml', 'rig.yaml', *YAML),
    'rig': ('good.yaml', *YAML),
    'controller': ('good.yaml', 'rig.yaml', *YAML),
    'rules file': ('rules.json', 'binary.yaml', 'empty.yaml', 'folder', 'pipe.json', *ABSENT,
                   *SPECIAL),
    'rules': ('rules.json', 'binary.mcap', 'cut.mcap', 'folder', 'empty_folder', 'pipe.json',
              'pid', *ABSENT, *SPECIAL),
    'table': ('table.csv', 'pipe.csv', *BAGS),
    'foreign table': ('binary.mcap', 'folder', 'empty_folder', 'pipe.csv', 'page.html', *ABSENT,
                      *SPECIAL),
    'table to write': ('folder', '.', 'page.html', 'no/folder.xlsx', 'dangling', 'pipe', *NOWHERE),
    'map': ('pressure', 'presure=p:bar_abs', 'pressure=p:bar', 'pressure=p:bar_abs',
            'time=t:parsec', 'force=f:N:gain=0', '=', ''),
    'valve': ('xyz', '', 'PPR hsv', '-5', LONG),
    'new bag': ('.', '..', '../..', '/', '~', 'page.html', 'bag', 'many', 'folder',
                'link_folder', 'dangling', 'loop', 'pipe', 'socket', '/dev/null', *NOWHERE),
    'bag to replace': ('.', '..', '../..', '/', '~', 'page.html', 'many', 'folder',
                       'bag_and_more', 'bag_and_another', 'odd_bag', 'link_folder', 'dangling',
                       'loop', 'pipe', 'socket', '/dev/full', *NOWHERE),
    'page': ('page.html', 'folder', '.', '/', 'link.html', 'dangling', 'loop', 'pipe.html',
             'socket', '/dev/full', '/dev/null', 'new/', *NOWHERE),
    'rule file to write': ('kept.json', 'folder', '.', 'rules.txt', 'no/folder.json',
                           'pipe.json', *NOWHERE),
    'folder': ('page.html', 'results', 'pipe', 'dangling', 'loop', '/dev/null', *NOWHERE),
    'tuned file': ('tuned.yaml', 'folder', 'page.html', 'new.html', 'no/folder.yaml', *NOWHERE),
    'number': NUMBERS,
    'number above 0': (*NUMBERS, '-5', '-1e-9', '-1e300'),
    'count': (*NUMBERS, '-5', '1.5', '1e3', '-999999999999', '9' * 5000),
    'namespace in a bag': ('nothing', '/a/b/c', '//', LONG),
    'namespace to show': ('nothing', '/a/b/c', LONG),
    'namespace': ('a b', '1abc', '/ä', 'a-b', '/../x'),
    'choice': ('', 'nothing_such', 'RIG', '-5', LONG),
    'effects': ('nothing_such', 'coulomb_friction,nothing_such', '../x', LONG),
    'effect': ('nothing_such', '../x', LONG, ''),
    'entry': ('nothing_such', '../x', LONG, ''),
    'change': ('nothing_such', 'x=1', 'kp=abc', '=', '', 'list.yaml', 'folder'),
    'power': ('nothing=1', 'ppr_power_w=abc', 'ppr_power_w=nan', 'ppr_power_w=-5', '='),
    'domain': (*NUMBERS, '-5', '1.5', '1000', '9' * 30)}
RUN = (
    Slot('', 'experiment', 'good.yaml'), Slot('--rig', 'rig'), Slot('--valve', 'valve'),
    Slot('--controller', 'controller'), Slot('--rules', 'rules file'), Slot('--seed', 'count'))
BAG = Slot('', 'bag', 'bag')
INSIDE = Slot('--namespace', 'namespace in a bag')
LIVE = (Slot('--namespace', 'namespace'), Slot('--domain-id', 'domain'),
        Slot('--wait', 'number above 0', '0.1'))
# Arguments of every verb; several rows where an argument changes what others mean. The rows of
# run, tune, gap and characterise could do their work: a mistake must be seen before it.
VERBS = {
    'simulate': [
        (*RUN, Slot('--out', 'new bag', 'new')),
        (*RUN[:1], Slot('', 'fixed', '--overwrite'),
         Slot('--out', 'bag to replace', 'bag'))],
    'run': [
        (*RUN, Slot('--out', 'new bag', 'new'), Slot('--domain-id', 'domain'),
         Slot('--namespace', 'namespace')),
        (*RUN[:1], Slot('', 'fixed', '--overwrite'), Slot('--out', 'bag to replace', 'bag'))],
    'up': [
        (Slot('', 'choice', 'rig'), Slot('--valve', 'valve'), Slot('--domain-id', 'domain'),
         Slot('--realtime-priority', 'count'), Slot('--seconds', 'number above 0', '1'),
         Slot('--record', 'new bag'), Slot('--model', 'rig'),
         Slot('--experiment', 'experiment', 'good.yaml')),
        (Slot('', 'fixed', 'knee'), Slot('--policy', 'page', 'new.xml'))],
    'replay': [
        (BAG, INSIDE, Slot('--only', 'choice'), Slot('--out', 'page', 'new.npz'),
         Slot('--set', 'change'))],
    'tune': [
        (BAG, Slot('--rig', 'rig'), Slot('--valve', 'valve'),
         Slot('--experiment', 'experiment', 'good.yaml'), Slot('--rollouts', 'count'),
         Slot('--randomise', 'count'), Slot('--patience', 'count'), Slot('--jobs', 'count'),
         Slot('--seed', 'count'), Slot('--out', 'tuned file', 'new.yaml'))],
    'characterise': [
        (Slot('', 'table', 'bag'), Slot('--out', 'folder', 'new'), INSIDE,
         Slot('--seed', 'count'), Slot('--jobs', 'count'), Slot('--load-n', 'number above 0'),
         Slot('--load-step-n', 'number above 0'), Slot('--length-m', 'number above 0'),
         Slot('--bore-m', 'number above 0'), Slot('--dead-volume-m3', 'number above 0')),
        (Slot('--simulate', 'rig', RIG), Slot('--out', 'folder', 'new'))],
    'gap': [
        (BAG, Slot('--model', 'rig', RIG),
         Slot('--out', 'folder', 'new'), Slot('--certify', 'bag'), INSIDE,
         Slot('--effects', 'effects'), Slot('--seconds', 'number above 0'),
         Slot('--materiality', 'number above 0')),
        (Slot('', 'fixed', '--plan'), Slot('', 'experiment', 'good.yaml'),
         Slot('--model', 'rig', RIG), Slot('--out', 'folder', 'new')),
        (Slot('--explain', 'effect', 'coulomb_friction'), Slot('--model', 'rig', RIG))],
    'identify': [
        (BAG, Slot('--rig', 'rig', RIG), INSIDE, Slot('--seed', 'count'),
         Slot('--out', 'folder', 'new'))],
    'investigate': [
        (Slot('--rig', 'rig', RIG), Slot('--model', 'rig', RIG), Slot('--valve', 'valve'),
         Slot('--experiment', 'experiment', 'good.yaml'), Slot('--rounds', 'count'),
         Slot('--seed', 'count'), Slot('--out', 'folder', 'new'))],
    'report': [(BAG, BAG, INSIDE, Slot('--out', 'page', 'new.html'))],
    'info': [(BAG,)],
    'import': [
        (Slot('', 'foreign table', 'bag'), Slot('--out', 'new bag', 'new'),
         Slot('--map', 'map', 'pressure=/muscle/pressure.fluid_pressure:Pa_abs'),
         Slot('--rate', 'number above 0'), Slot('--every', 'count'), Slot('--rig', 'rig'),
         Slot('--from', 'number above 0'), Slot('--save-mapping', 'page', 'new.yaml'),
         Slot('--namespace', 'namespace'))],
    'export': [
        (BAG, INSIDE, Slot('--out', 'table to write', 'new.csv'),
         Slot('--rate', 'number above 0'), Slot('--topics', 'effects'))],
    'rig': [
        (Slot('', 'choice', 'new'), Slot('--out', 'page', 'new.yaml'),
         Slot('--length-mm', 'number above 0'), Slot('--bore-mm', 'number above 0'),
         Slot('--force-map', 'foreign table'))],
    'experiments': [(Slot('', 'experiment'),)],
    'models': [
        (Slot('', 'entry'), Slot('--html', 'page'), Slot('--markdown', 'page'))],
    'nodes': [(Slot('', 'entry'), Slot('--markdown', 'folder'))],
    'valves': [
        (Slot('', 'choice', 'compare'), Slot('--rig', 'rig'), Slot('--seed', 'count'),
         Slot('--hold', 'number above 0'), Slot('--html', 'page'), Slot('--power', 'power'))],
    'rules': [
        (Slot('', 'rules', 'sofc_ppr'), Slot('--against', 'rules'), Slot('--top', 'count'),
         Slot('--html', 'page', 'new.html'), Slot('--save', 'rule file to write', 'new.json'),
         Slot('--rig', 'rig'))],
    'status': [LIVE], 'estop': [LIVE], 'reset': [LIVE],
    'param': [(Slot('', 'choice', 'list'), Slot('', 'fixed', 'valve_driver'), *LIVE)],
    'view': [(BAG, Slot('--namespace', 'namespace to show'), Slot('--port', 'count'))],
    'campaign': [
        (Slot('', 'recordings', 'bag'), Slot('--out', 'folder', 'new'),
         Slot('--model', 'rig', RIG), Slot('--seed', 'count'), Slot('--jobs', 'count'))],
    'demo': [(Slot('--out', 'demo folder', 'new'),)]}
VALUES['recordings'] = ('empty_folder', 'gone_bag', *ABSENT)
VALUES['demo folder'] = (*VALUES['folder'], 'bag/bag_0.mcap')
# Wrong whatever the values are.
COMBINATIONS = (
    ('--nonsense',), ('nonsense',), ('--json',), ('--valve',),
    ('simulate',), ('simulate', 'good.yaml', 'good.yaml'), ('simulate', 'good.yaml', '--out'),
    ('run',), ('up',), ('up', 'knee', '--record', 'new'), ('up', 'exo', '--hardware', 'dummy'),
    ('info',), ('info', 'bag', 'bag'), ('report',), ('replay',), ('gap',), ('gap', 'bag'),
    ('replay', 'bag', '--only', 'driver', '--chain'), ('rules',), ('characterise',),
    ('replay', 'bag', '--only', 'plant', '--set', 'sofc_untuned'), ('valves',),
    ('characterise', 'bag'), ('characterise', '--out', 'new'),
    ('characterise', 'bag', '--simulate', RIG, '--out', 'new'),
    ('characterise', 'table.csv', 'table.csv', '--out', 'new'),
    ('models', '--html', 'new.html', '--markdown', 'new.html'),
    ('rules', 'sofc_ppr', '--html', 'new.json', '--save', 'new.json'),
    ('demo', 'bag'), ('tune', '--out', 'new.html', 'bag'))
