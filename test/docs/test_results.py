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

"""Results: each page is written by benchmarks that exist and accept what the page says."""

import importlib
import os
from pathlib import Path
import re
import shlex
import subprocess
import sys
import time
from types import SimpleNamespace

import numpy as np
from pam_sim import load_rig
from pam_sim.errors import InputError
import pytest

ROOT = Path(__file__).resolve().parents[2]
BENCHMARKS = ROOT / 'benchmarks'
PAGES = sorted((ROOT / 'docs' / 'results').glob('*.md'))
MARKER = re.compile(r'^<!-- (begin|end): benchmarks/(\w+\.py(?: \w+)?) -->$', re.MULTILINE)
COMMAND = re.compile(r'^ {4}(?:\w+=\S+ )*python benchmarks/(\w+)\.py(.*)$', re.MULTILINE)
RECORDED = re.compile(
    r'^Run on \d{4}-\d\d-\d\d at commit [0-9a-f]{7,}( with changes)?\. Machine: ', re.MULTILINE)
UNKNOWN = 'Date and commit: not recorded.'


@pytest.fixture(scope='module', autouse=True)
def importable():
    """Let benchmarks be imported, and forget them afterwards with what they add to the path."""
    before, path = set(sys.modules), list(sys.path)
    sys.path.insert(0, str(BENCHMARKS))
    yield
    sys.path[:] = path
    for name in set(sys.modules) - before:
        if str(getattr(sys.modules[name], '__file__', '')).startswith((
                str(BENCHMARKS), str(ROOT / 'test' / 'hidden'))):
            del sys.modules[name]


@pytest.fixture
def helper():
    """Return the module that writes pages."""
    return importlib.import_module('results_page')


@pytest.fixture
def page(helper, monkeypatch, tmp_path):
    """Return a page with two parts in a folder of its own."""
    monkeypatch.setattr(helper, 'FOLDER', tmp_path)
    path = tmp_path / 'some.md'
    path.write_text(
        'By hand.\n\n<!-- begin: benchmarks/some.py -->\nold\n<!-- end: benchmarks/some.py -->\n\n'
        'Between.\n<!-- begin: benchmarks/some.py two -->\nold two\n'
        '<!-- end: benchmarks/some.py two -->\nAfter.\n', encoding='utf-8')
    return path


def parts_of(text):
    """Return name to content of the measured parts of a page."""
    marks = list(MARKER.finditer(text))
    assert [mark[1] for mark in marks] == ['begin', 'end'] * (len(marks) // 2)
    assert [mark[2] for mark in marks[::2]] == [mark[2] for mark in marks[1::2]]
    return {first[2]: text[first.end():last.start()]
            for first, last in zip(marks[::2], marks[1::2])}


def parsed(helper, *words):
    """Return what the parser of a benchmark with the page ``some`` makes of words."""
    import argparse
    parser = argparse.ArgumentParser()
    parser.add_argument('--json', action='store_true')
    helper.add_write(parser, 'some')
    return parser.parse_args(words)


@pytest.mark.parametrize('path', PAGES, ids=lambda path: path.stem)
def test_a_page_is_written_by_benchmarks_that_take_its_commands(path):
    text = path.read_text(encoding='utf-8')
    parts = parts_of(text)
    assert parts
    for name, content in parts.items():
        assert RECORDED.search(content) or UNKNOWN in content, name
        own = [words for stem, words in COMMAND.findall(content)
               if f'{stem}.py' == name.split()[0]]
        assert len(own) == 1, name
        module = importlib.import_module(name.split('.')[0])
        args = module.command_line().parse_args([*shlex.split(own[0]), '--write'])
        assert (args.write, args.page) == (True, path.stem)
    for stem, words in COMMAND.findall(text):
        module = importlib.import_module(stem)
        module.command_line().parse_args(shlex.split(words, comments=True))
    assert all((BENCHMARKS / name).is_file()
               for name in re.findall(r'benchmarks/(\w+\.py)', text))


def test_every_benchmark_that_writes_has_its_part():
    named = {name.split()[0] for path in PAGES
             for name in parts_of(path.read_text(encoding='utf-8'))}
    able = {path.name for path in BENCHMARKS.glob('*.py')
            if '\ndef command_line():' in path.read_text(encoding='utf-8')}
    assert able == named


def test_a_command_that_a_benchmark_does_not_take_is_refused(capsys):
    parser = importlib.import_module('tracking').command_line()
    with pytest.raises(SystemExit):
        parser.parse_args(['--colour', 'red'])
    assert '--colour' in capsys.readouterr().err


@pytest.mark.parametrize('valve, names', [
    ('ppr', ['1 kg more']), ('hsv', ['1 kg more', 'supply -15 %'])])
def test_a_supply_is_changed_only_where_the_model_has_one(valve, names):
    rig = load_rig('dmsp_5_300_realistic', valve=valve)
    assert [*importlib.import_module('tracking').changes(rig, 45.0)] == names


def test_help_runs_nothing():
    done = subprocess.run(
        [sys.executable, str(BENCHMARKS / 'baselines.py'), '--help'], capture_output=True,
        text=True, check=True)
    assert '--write' in done.stdout and '| controller |' not in done.stdout


def test_what_is_printed_replaces_its_part_alone(helper, page, capsys, monkeypatch):
    monkeypatch.setattr(sys, 'argv', ['some.py', '--write', '--seed', '7', '/tmp/data'])
    monkeypatch.setattr(helper, 'commit', lambda: 'abc1234')
    with helper.printed(parsed(helper, '--write'), '/any/some.py'):
        print('| a |\n|---|\n| 1 |')
    text = page.read_text(encoding='utf-8')
    assert capsys.readouterr().out == '| a |\n|---|\n| 1 |\n'
    assert text.startswith('By hand.\n\n') and text.endswith('\nAfter.\n')
    parts = parts_of(text)
    assert parts['some.py two'] == '\nold two\n'
    assert 'old' not in parts['some.py'] and '\n\n| a |\n|---|\n| 1 |\n' in parts['some.py']
    assert '    python benchmarks/some.py --seed 7 data\n' in parts['some.py']
    assert RECORDED.search(parts['some.py'])
    assert f'Run on {time.strftime("%Y")}' in parts['some.py']
    assert 'commit abc1234. ' in parts['some.py']


def test_without_the_option_nothing_is_written(helper, page):
    before = page.read_bytes()
    with helper.printed(parsed(helper), '/any/some.py'):
        print('new')
    assert page.read_bytes() == before


@pytest.mark.parametrize('error', [RuntimeError, KeyboardInterrupt, SystemExit])
def test_a_run_that_fails_leaves_the_page(helper, page, error):
    before = page.read_bytes()
    with pytest.raises(error), helper.printed(parsed(helper, '--write'), '/any/some.py'):
        print('half of a table')
        raise error
    assert page.read_bytes() == before


def test_the_page_is_replaced_in_one_step(helper, page, monkeypatch):
    """A write that fails keeps the old page whole and leaves no file beside it."""
    before = page.read_bytes()
    seen = []

    def refuse(source, target):
        seen.append((Path(source).parent, Path(target), Path(source).read_text(encoding='utf-8')))
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr(os, 'replace', refuse)
    with pytest.raises(InputError, match='No space left'):
        with helper.printed(parsed(helper, '--write'), '/any/some.py'):
            print('new')
    (folder, target, text), = seen
    assert (folder, target) == (page.parent, page)
    assert '\nnew\n' in text and text.endswith('After.\n')
    assert page.read_bytes() == before
    assert list(page.parent.iterdir()) == [page]


@pytest.mark.parametrize('program, part, words, said', [
    ('/any/other.py', '', ['--write'], 'begin: benchmarks/other.py'),
    ('/any/some.py', 'three', ['--write'], 'begin: benchmarks/some.py three'),
    ('/any/some.py', '', ['--write', '--json'], 'without --json')])
def test_what_cannot_be_written_is_told_before_the_work(
        helper, page, capsys, program, part, words, said):
    with pytest.raises(SystemExit) as raised:
        with helper.printed(parsed(helper, *words), program, part):
            pytest.fail('the work began')
    assert raised.value.code == 2
    error = capsys.readouterr().err
    assert said in error and error.count('\n') == 1


def test_a_missing_page_is_told(helper, page):
    page.unlink()
    with pytest.raises(InputError, match='is missing'):
        helper.replaced(page, 'benchmarks/some.py', '')


def test_the_commit_is_that_of_the_checkout(helper, tmp_path):
    def git(*words):
        subprocess.run(['git', '-c', 'user.name=a', '-c', 'user.email=a@b', *words],
                       cwd=tmp_path, check=True, capture_output=True)

    git('init', '-q')
    assert helper.commit(tmp_path) == 'unknown'
    (tmp_path / 'docs' / 'results').mkdir(parents=True)
    (tmp_path / 'docs' / 'results' / 'a.md').write_text('a')
    (tmp_path / 'code.py').write_text('a')
    git('add', '.')
    git('commit', '-q', '-m', 'first')
    found = helper.commit(tmp_path)
    assert re.fullmatch('[0-9a-f]{7,}', found)
    (tmp_path / 'docs' / 'results' / 'a.md').write_text('b')
    assert helper.commit(tmp_path) == found
    (tmp_path / 'code.py').write_text('b')
    assert helper.commit(tmp_path) == f'{found} with changes'


@pytest.mark.parametrize('returned, code', [(None, 0), (1, 1)])
def test_a_benchmark_with_one_table_prints_writes_and_returns(
        helper, page, monkeypatch, capsys, returned, code):
    import argparse
    parser = argparse.ArgumentParser()
    helper.add_write(parser, 'some')

    def show(args):
        print('| a table |')
        return returned
    for words in ([], ['--write']):
        before = page.read_text(encoding='utf-8')
        monkeypatch.setattr(sys, 'argv', ['some.py', *words])
        assert helper.run(parser, 'some.py', show) == code
        assert capsys.readouterr().out == '| a table |\n'
        assert (page.read_text(encoding='utf-8') != before) == bool(words)
    assert '| a table |\n\n<!-- end: benchmarks/some.py -->' in page.read_text(encoding='utf-8')


@pytest.mark.parametrize('late, share', [(70, 0.01), (0, 0.0)])
def test_the_load_of_the_page_counts_late_ticks_of_the_driver(late, share):
    """Behind a regulator it ticks with each command, so none is missed of its own period."""
    view = importlib.import_module('view_load')
    values = {'loop.ticks': '7000', 'loop.missed': '0', 'loop.overruns': str(late)}
    told = {f'/muscle/{name}': (0, '', values) for name in view.LOOPS}
    rig = SimpleNamespace(namespace='/muscle', group=SimpleNamespace(
        started=SimpleNamespace(statuses=told)))
    counts = view.Director._counts(SimpleNamespace(_rig=rig))
    assert view.share('valve_driver', *counts['valve_driver']) == pytest.approx(share)
    assert view.share('sofc_controller', *counts['sofc_controller']) == 0.0


def test_kept_starts_of_another_kind_are_other_bags_and_parts_of_the_page():
    """A start on a hidden rig, or without priority, was taken for one of the kind before."""
    starts = importlib.import_module('live_starts')
    kinds = [[], ['--hidden'], ['--ordinary'], ['--hidden', '--ordinary'], ['--valve', 'ppr'],
             ['--controller', 'sofc_model_hsv']]
    bags, parts = set(), set()
    for words in kinds:
        args = starts.command_line().parse_args(words)
        args.controller = args.controller or f'sofc_{args.valve}'
        bags.add(starts.bag_name(args, 0))
        parts.add(starts.part_of(args))
    assert len(bags) == len(parts) == len(kinds)
    assert {'hsv', 'ppr', 'hsv_hidden', 'hsv_ordinary'} < parts


@pytest.mark.parametrize('valve, late', [('ppr', 100.0), ('hsv', 0.0)])
def test_a_driver_is_late_by_the_period_of_its_valve(valve, late, monkeypatch):
    """Behind a regulator it sends every 5 ms: a gap of 10 ms is late there."""
    starts = importlib.import_module('live_starts')
    monkeypatch.setattr(starts, 'transport_ns', lambda bag: 0)
    monkeypatch.setattr(starts.command_age, 'ages_ms', lambda run, way_ns: (
        np.array([3.0]), np.array([2.0]), np.array([2.0])))
    stamps = {'valve_signal': 10_000_000, 'controller_state': 5_000_000, 'pressure': 4_000_000,
              'reference': 10_000_000}
    run = SimpleNamespace(start_ns=0, topics={
        name: SimpleNamespace(stamp_ns=np.arange(10) * period_ns)
        for name, period_ns in stamps.items()})
    found = starts.timing(run, 'bag', valve)['late']
    assert found == {'valve_signal': late, 'controller_state': 0.0, 'pressure': 0.0}


@pytest.mark.parametrize('best, told', [(0.5, '> 2'), (1.0, '0.00')])
def test_a_cost_that_the_search_did_not_reach_is_told_as_more(best, told, monkeypatch):
    """Where it was not reached, the table had the limit of the search as if it were measured."""
    waits = importlib.import_module('campaign_waits')
    for name in ('load_rig', 'load_controller', 'load_experiment'):
        monkeypatch.setattr(waits, name, lambda *_, **__: None)
    monkeypatch.setattr(waits, 'loops_of', lambda *_: ([], None))
    monkeypatch.setattr(waits, 'default_axes', lambda _: [None, None])
    monkeypatch.setattr(waits, 'from_unit', lambda axes, point: point)
    monkeypatch.setattr(waits, 'Problem', lambda *_: SimpleNamespace(cost=lambda point: 1.0))
    monkeypatch.setattr(waits.search, 'minimise', lambda *_: SimpleNamespace(cost=best))
    usual, other, needed = waits.quality('pid', 'ppr', 0)
    assert (usual, other) == (best, 1.0)
    assert waits.ratio_text(needed) == told


def test_a_campaign_that_names_more_than_was_put_in_is_not_right():
    """What stood beside a true name, or bore the same name, did not count."""
    campaign = importlib.import_module('campaign')

    def change(rig, name, shape, day):
        return SimpleNamespace(series=SimpleNamespace(rig=rig, name=name, time=np.arange(30.0)),
                               shape=shape, begin=day - 1)

    put_in = [[change(*one)] for one in campaign.lab.TRUTH]
    expected = [(shape, float(day)) for *_, shape, day in campaign.lab.TRUTH]
    assert campaign.compared(put_in, 0.0) == (expected, [])
    rig, name, shape, day = campaign.lab.TRUTH[0]
    put_in[0] += [change(rig, 'creep', 'step', day), change(rig, name, 'line', day)]
    rows, others = campaign.compared(put_in, 0.0)
    assert rows == expected and sorted(others) == [f'{rig} creep', f'{rig} {name}']
    rows, _ = campaign.compared(put_in[1:], 0.0)
    assert rows[0][0] == 'nothing' and rows[1:] == expected[1:]


@pytest.fixture
def recording(helper, monkeypatch, tmp_path):
    """Return the benchmark of the recorder, its page in a folder of its own, and what it found."""
    load = importlib.import_module('recording_load')
    monkeypatch.setattr(helper, 'FOLDER', tmp_path)
    page = tmp_path / 'recording.md'
    page.write_text('<!-- begin: benchmarks/recording_load.py -->\n| former |\n'
                    '<!-- end: benchmarks/recording_load.py -->\n', encoding='utf-8')
    found = {'failure': '', 'duration_s': 60.0, 'messages': 9, 'messages_per_s': 1, 'missing': 0,
             'lost': 0, 'dropped': 0, 'missed_at_start': 0, 'recorder_share_of_a_core': 0.1}
    monkeypatch.setattr(load, 'measure', lambda *_: found)
    monkeypatch.setattr(sys, 'argv', ['recording_load.py', '--write'])
    return load, page, found


def test_a_recording_that_fails_leaves_the_former_table(recording):
    load, page, found = recording
    found['failure'] = 'the plant ended early'
    with pytest.raises(SystemExit, match='the plant ended early'):
        load.main()
    assert '| former |' in page.read_text(encoding='utf-8')


@pytest.mark.parametrize('share, cell, code', [(0.1, '0.10', 0), (None, 'not known', 1)])
def test_a_recording_is_written_also_without_the_cost_of_its_recorder(
        recording, share, cell, code):
    load, page, found = recording
    found['recorder_share_of_a_core'] = share
    assert load.main() == code
    assert f'| 60.0 s | 9 | 1 | 0 | 0 | 0 | 0 | {cell} |' in page.read_text(encoding='utf-8')
