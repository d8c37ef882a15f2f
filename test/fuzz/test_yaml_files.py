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

"""A sample of wrong YAML files: loaded, or refused with file and line, and never anything else."""

from pam_sim import yaml_nodes
from pam_sim.errors import InputError
from pam_sim.located_yaml import _parsed, dump_yaml, load_yaml, Located, MAX_BYTES
import pytest
import yaml
from yaml_mutations import BOMB, mutated, outcome, run, sources


def test_wrong_files_are_loaded_or_refused_with_file_and_line():
    outcomes, bad = run(500)
    assert bad == []
    assert outcomes['refused'] > 300 and outcomes['loaded'] > 20


def test_the_same_number_is_the_same_file():
    found = sources()
    assert [mutated(k, found)[1] for k in range(40)] == [mutated(k, found)[1] for k in range(40)]


def test_every_file_loads_before_it_is_made_wrong(tmp_path):
    path = tmp_path / 'right.yaml'
    for name, text, load in sources():
        path.write_text(text, encoding='utf-8')
        assert outcome(path, load) == 'loaded', name


def test_what_is_neither_is_noticed(tmp_path):
    def fails(path):
        raise KeyError('x')

    def vague(path):
        raise InputError('is wrong', 'somewhere')

    assert outcome(tmp_path / 'a.yaml', fails).startswith('traceback: ')
    assert outcome(tmp_path / 'a.yaml', vague).startswith('refused without file and line')


@pytest.mark.parametrize(('text', 'words'), [
    (BOMB, '50000 values'),
    ('a: &x [*x]\n', '50 levels'),
    ('a: 1\nb: ' + '[' * 100_000 + '\n', ':2: .*nested deeper than 50'),
    ('a: 1\nb: ' + '9' * 5000 + '\n', ':2: .*5000 digits'),
    ('a: 1\nb: !!float x\n', ':2: .*does not fit its tag'),
    ('a: 1\nb: !!timestamp x\n', ':2: .*does not fit its tag'),
    ('a: 1\nb: "\\ud800"\n', ':2: .*not text'),
    ('a: 1\nb: "\\0"\n', ':2: .*not text'),
    ('a: 1\nb: \x01\n', ':2: .*not text'),
    ('a: 1\nb: *unknown\n', ':2: .*undefined alias'),
    ('a: 1\nb: !!python/object:os.system x\n', ':2: .*constructor'),
    ('a: 1\n' + 'b' * MAX_BYTES, 'larger than'),
    ('\n', ':1: is empty')])
def test_single_traps(text, words):
    with pytest.raises(InputError, match=f'<text>.*{words}'):
        load_yaml(text)


def test_an_endless_file_is_not_read_to_its_end():
    with pytest.raises(InputError, match='larger than'):
        load_yaml('/dev/zero')


def test_bytes_that_are_no_text_have_a_line(tmp_path):
    path = tmp_path / 'a.yaml'
    path.write_bytes(b'a: 1\nb: 2\nc: \xff\n')
    with pytest.raises(InputError, match=r'a\.yaml:3: is not a text file'):
        load_yaml(path)


def test_a_text_read_twice_is_not_shared():
    text = 'a: 1\nb: [1, {c: [2, 3]}]\n'
    first = load_yaml(text)
    first['b'][1]['c'].append(4)
    first['b'].clear()
    again = load_yaml(text, name='again')
    assert load_yaml(text).plain() == again.plain() == {'a': 1, 'b': [1, {'c': [2, 3]}]}
    assert again['b'][1].where('c') == 'again:2' and first.where('b') == '<text>:2'


def read_in(way, text, monkeypatch):
    """Return the values and their lines as they are read in one way, or the sentence."""
    monkeypatch.setattr(yaml_nodes, '_quick_loader', way)
    try:
        return with_lines(_parsed.__wrapped__(text, 'file'))
    except InputError as error:
        return str(error)


def with_lines(value):
    if isinstance(value, Located):
        return {key: (value.where(key), with_lines(one)) for key, one in value.items()}
    if isinstance(value, list):
        return [(value.where(k), with_lines(one)) for k, one in enumerate(value)]
    return repr(value)


def test_what_is_read_fast_is_the_same(monkeypatch):
    found, quick = sources(), yaml_nodes._quick_loader
    texts = [made.decode(errors='replace')
             for _, made, _ in (mutated(k, found) for k in range(120))]
    texts += ['a:\t1', 'a: \t', 'a: {b: ?c}', 'a: {b?c: 1}', 'a: !{b: 1}', '{a: !0.1, b: 1}',
              'a: 1\n\ufeff', 'a: 1\r\nb: "\x85"', 'a: # µ°\n- {b: é}', 'a: >\n b\n\n c', '',
              'a: 3,5', 'a: "3,5"', "a: [{b: 3,5}, '3,5']"]
    for text in texts:
        assert read_in(quick, text, monkeypatch) == read_in(
            yaml_nodes.Loader, text, monkeypatch), text


@pytest.mark.parametrize('tree', [
    *({'text': text, 'texts': [text, {'a': [text]}]} for text in (
        '', 'null', '1e5', "it's #1", ' x', 'a: b', 'µm', 'two\nlines', '\x85', 'word ' * 60,
        "'" + 'x y' * 60, 'é "x" ' * 30)),
    {'': 1}, {'k' * 130: 1}, {'key ' * 40: [1]}, {1: {2.5: None}},
    {'a': [], 'b': {}, 'c': [[1.5, -2], [True]], 'd': float('nan'), 'e': 1e-9}])
def test_what_is_written_fast_has_the_same_bytes(tree):
    assert dump_yaml(tree) == yaml.safe_dump(
        tree, sort_keys=False, default_flow_style=False, allow_unicode=True, width=99)
