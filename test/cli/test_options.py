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

"""Options of every verb: values that are not allowed are told with range, in one sentence."""

import argparse

from pam_actuation.cli.main import build_parser, main
from pam_actuation.cli.options import count, number, out_path, source
from pam_actuation.cli.overview import VERBS
import pytest

# What each verb needs before an option is looked at.
NEEDS = {'run': ['short_sine'], 'simulate': ['short_sine'], 'up': ['rig'], 'replay': ['bag'],
         'characterise': ['--out', 'folder'], 'report': ['bag'], 'info': ['bag'],
         'campaign': ['runs', '--out', 'folder'], 'investigate': ['--out', 'folder'],
         'valves': ['compare'], 'rules': ['sofc_ppr'],
         'import': ['table.csv'], 'export': ['bag', '--out', 'table.csv'], 'rig': ['new'],
         'param': ['list', 'valve_driver']}
WRONG_NUMBERS = {
    'number': ('-5', 'nan', 'inf', 'five', '3,5', '', '1e999'),
    'count': ('-5', 'nan', '2.5', 'five', '3,5', '', '99999999999999999999x')}
# Range of every number an option takes, as a user reads it.
NUMBERS = {
    ('run', '--seed'): '0 to 4294967295', ('run', '--domain-id'): '0 to 232',
    ('simulate', '--seed'): '0 to 4294967295', ('simulate', '--preview'): '0 to 10 s',
    ('up', '--domain-id'): '0 to 232', ('up', '--realtime-priority'): '0 to 96',
    ('up', '--seconds'): '0 s or more', ('up', '--seed'): '0 to 4294967292',
    **{(verb, option): allowed for verb in ('status', 'estop', 'reset', 'param')
       for option, allowed in (('--domain-id', '0 to 232'), ('--wait', '0.1 to 60 s'))},
    ('import', '--rate'): '0.1 to 1000000 Hz', ('import', '--every'): '1 to 1000000',
    ('import', '--resample'): '1 to 10000 Hz', ('import', '--part'): '1 to 1000000',
    ('import', '--from'): '0 s or more', ('import', '--to'): '0 s or more',
    ('export', '--rate'): '0.1 to 100000 Hz',
    ('rig', '--length-mm'): '20 to 9000 mm', ('rig', '--bore-mm'): '1 to 100 mm',
    ('rig', '--angle-deg'): '6 to 51 degrees', ('rig', '--max-strain'): '0.05 to 0.5',
    ('tune', '--rollouts'): '10 or more', ('tune', '--randomise'): '0 to 1000',
    ('tune', '--patience'): '0 or more', ('tune', '--jobs'): '1 to 1024, or -1 for one a core',
    ('tune', '--population'): '5 to 10000, or 0 for after the budget',
    ('tune', '--seed'): '0 to 4294967295', ('tune', '--preview'): '0 to 10',
    ('characterise', '--seed'): '0 to 4294967295', ('characterise', '--jobs'): '1 to 64',
    ('characterise', '--load-n'): '0 to 10000 N',
    ('characterise', '--load-step-n'): '0.01 to 1000 N',
    ('characterise', '--held-mm'): '0 to 5000 mm',
    ('characterise', '--length-m'): '0.01 to 20 m',
    ('characterise', '--bore-m'): '0.0001 to 0.2 m',
    ('characterise', '--dead-volume-m3'): '0 to 1 m^3',
    ('characterise', '--angle-deg'): '6 to 51 degrees',
    ('identify', '--added-kg'): '0 to 500 kg', ('identify', '--seed'): '0 to 4294967295',
    ('gap', '--seconds'): '1 s or more', ('gap', '--materiality'): '0.01 to 1000',
    ('investigate', '--rounds'): '1 to 50', ('investigate', '--minutes'): '0 min or more',
    ('investigate', '--materiality'): '0.01 to 1000',
    ('investigate', '--domain-id'): '0 to 232', ('investigate', '--seed'): '0 to 4294967295',
    ('campaign', '--seconds'): '1 s or more', ('campaign', '--materiality'): '0.01 to 1000',
    ('campaign', '--seed'): '0 to 4294967295',
    ('campaign', '--jobs'): '1 to 1024, or -1 for one a core',
    ('valves', '--seed'): '0 to 4294967295', ('valves', '--hold'): '2 to 3600 s',
    ('rules', '--top'): '0 or more',
    ('experiments', '--period'): '0.02 to 3600 s', ('experiments', '--cycles'): '1 to 1000',
    ('experiments', '--lowpass'): '0.1 to 20 Hz', ('experiments', '--rate'): '0.1 to 1000000 Hz',
    ('experiments', '--from'): '0 s or more', ('experiments', '--to'): '0 s or more',
    ('view', '--domain-id'): '0 to 232', ('view', '--port'): '0 to 65535'}


def _options():
    """Return (verb, action) of every option and argument of every verb."""
    verbs = next(action for action in build_parser()._actions
                 if isinstance(action, argparse._SubParsersAction))
    return [(verb, action) for verb in VERBS for action in verbs.choices[verb]._actions]


def _kind(action):
    return getattr(action.type, '__qualname__', '').partition('.')[0]


def test_every_number_of_every_verb_has_a_range():
    numbers = {(verb, action.option_strings[0]) for verb, action in _options()
               if _kind(action) in WRONG_NUMBERS}
    assert numbers == set(NUMBERS), 'NUMBERS above has each option with its range'
    assert not [action.dest for _, action in _options() if action.type in (int, float)]


def test_what_is_written_or_read_is_never_an_empty_name():
    words = {action.dest for _, action in _options() if action.metavar in (
        'DIR', 'FILE', 'FILE.yaml', 'NAME|FILE', 'FILE|BAG|CONTROLLER', 'BAG|TABLE', 'RIG', 'RUN')
        and _kind(action) not in ('out_path', 'source')}
    assert not words


def test_wrong_numbers_are_told_with_range_and_exit_code_2(capsys):
    kinds = {(verb, action.option_strings[0]): _kind(action) for verb, action in _options()
             if action.option_strings}
    for (verb, option), allowed in NUMBERS.items():
        for text in WRONG_NUMBERS[kinds[verb, option]]:
            assert main([verb, *NEEDS.get(verb, ()), option, text]) == 2, (verb, option, text)
            said = capsys.readouterr().err
            assert said.startswith(f'pam {verb}: {option}: ') and said.count('\n') == 1, said
            assert said.endswith(f'allowed is {allowed}\n'), said
            assert ('decimal point' in said) == (text == '3,5'), said


def test_empty_and_impossible_paths_are_told(capsys):
    for arguments in (['simulate', 'short_sine', '--out', ''], ['report', 'bag', '--out', ' '],
                      ['rules', 'sofc_ppr', '--html', ''], ['tune', '--out', ''],
                      ['gap', 'bag', '--out', ''], ['gap', '', '--out', 'gap'], ['info', ''],
                      ['simulate', '', '--out', 'x'], ['replay', 'bag', '--set', '']):
        assert main(arguments) == 2, arguments
        said = capsys.readouterr().err
        assert 'is empty' in said and said.count('\n') == 1, said
    assert main(['simulate', 'short_sine', '--out', 300 * 'x']) == 2
    assert '300 bytes' in capsys.readouterr().err


def test_only_names_of_the_library_are_tried(capsys):
    """A stand-in for a term without a name is none: nothing would be tried."""
    for words in (['gap', 'bag', '--out', 'x'], ['gap', 'short_sine', '--plan'],
                  ['campaign', 'runs', '--out', 'x'], ['investigate', '--out', 'x']):
        for name in ('muscle_term', 'creep,', 'creepp'):
            assert main([*words, '--effects', name]) == 2, words
            said = capsys.readouterr().err
            assert said.startswith(f'pam {words[0]}: --effects: unknown effect `'), said
            assert ' creep, ' in said and said.count('\n') == 1, said


def test_allowed_values_are_read():
    assert number(0.0, 5.0, 's')('5') == 5.0 and number()('-1e3') == -1000.0
    assert count(1, 64, {-1: 'one a core'})('-1') == -1 and count(0)('7') == 7
    assert out_path('runs/ä b') == 'runs/ä b' and source('x.yaml') == 'x.yaml'
    with pytest.raises(argparse.ArgumentTypeError, match='at most 3 mm'):
        number(None, 3.0, 'mm')('4')


def test_every_verb_that_reads_a_bag_lets_one_rig_of_several_be_chosen():
    has = {verb: [option for of, action in _options() if of == verb
                  for option in action.option_strings] for verb in VERBS}
    lacking = [verb for verb, options in has.items()
               if '--topic' in options and '--namespace' not in options]
    assert [verb for verb in has if '--topic' in has[verb]] and lacking == []
