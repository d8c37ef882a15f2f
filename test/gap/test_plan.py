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

"""Planning before any data exist: least sizes, pairs that look alike, the best protocol."""

from dataclasses import replace
import json

from gap_runs import nominal, recorded, voltages
import numpy as np
from pam_actuation.cli.main import main
from pam_actuation.experiments import load_experiment, protocols
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.plan import look_alikes
from pam_sim.gap.plan.detectable import BEYOND_RANGE
from pam_sim.gap.plan.outlook import in_proportion, least_factors, outlooks, score
from pam_sim.gap.plan.sensitivity import Sensitivities
from pam_sim.gap.select.screening import screen
from pam_sim.gap.subsystems.problems import subsystem_problems
from pam_sim.located_yaml import dump_yaml
import pytest

NAMES = ('coulomb_friction', 'guide_friction', 'parallel_spring', 'flow_limit')


def sensitivities(topics=('pressure', 'contraction', 'force'), seconds=10.0, seed=3):
    run = recorded(nominal(), voltages(seconds, seed), topics=topics)
    return Sensitivities(nominal(), Recording(run, 'ppr'), NAMES)


@pytest.fixture(scope='module')
def with_cell():
    """Return the Sensitivities of a protocol with a load cell."""
    return sensitivities()


def test_friction_at_the_rail_needs_a_load_cell_to_be_told_from_the_muscles(with_cell):
    seen = {o.name: o for o in outlooks(with_cell)}
    assert seen['coulomb_friction'].inseparable == ()
    assert seen['coulomb_friction'].named is not None
    blind = {o.name: o for o in outlooks(sensitivities(('pressure', 'contraction')))}
    assert 'guide_friction' in blind['coulomb_friction'].inseparable
    assert blind['coulomb_friction'].named is None


def test_at_its_least_size_an_effect_moves_a_signal_by_one_floor(with_cell):
    # By a fit of the numbers with scipy, not by inner products.
    from scipy.optimize import lsq_linear
    o = next(o for o in outlooks(with_cell) if o.name == 'coulomb_friction')
    rig = nominal().with_(effects=[{'name': o.name, 'parameters': o.visible}])
    problem = next(c for c in subsystem_problems(nominal(), [Recording(
        recorded(nominal(), voltages(10.0)), 'ppr')], certify_runs=0)
        if c.subsystem == 'muscle')
    rows, zero = problem.part < 3, np.zeros(len(problem.known))
    base = problem.errors(nominal(), zero)
    slopes = np.column_stack([(problem.errors(nominal(), k.step * unit) - base) / k.step
                              for k, unit in zip(problem.known, np.eye(len(problem.known)))])[rows]
    change = (problem.errors(rig, zero) - base)[rows]
    fit = lsq_linear(np.vstack([slopes, np.eye(zero.size)]),
                     -np.append(change, zero), (-3.5, 3.5)).x
    left = change + slopes @ fit
    worst = max(np.sqrt(np.mean(left[problem.signal[rows] == s] ** 2))
                for s in range(len(problem.signals)))
    assert worst == pytest.approx(1.0, rel=0.15)


def test_protocols_join_by_adding_their_inner_products(with_cell):
    factors, seen = least_factors([with_cell])
    assert seen['coulomb_friction'] == pytest.approx(1.0, rel=0.1)
    first = with_cell.inner(factors)
    both = first + first
    assert both.samples['force'] == 2 * first.samples['force']
    # The same again: no better by rms, but that the tolerance of the numbers hides less.
    friction = first.names.index('coulomb_friction')
    once, twice = (in_proportion(i, factors)[friction] for i in (first, both))
    assert twice == pytest.approx(once, rel=0.1)


def test_a_protocol_that_shows_more_scores_higher():
    assert score([(0.1, 0.2), (1.0, 1.0)]) > score([(0.1, 0.5), (1.0, 1.0)])
    assert score([(np.inf, np.inf)]) == 0.0


def test_candidates_fill_a_minute_and_none_could_take_in_more():
    for valve, extra in (('ppr', set()), ('hsv', {'shut'})):
        parts = protocols.pieces(valve)
        assert extra <= set(parts)
        choices = protocols.choices(parts, valve)
        lengths = [protocols.length_of(names, valve) for names in choices]
        assert len(choices) > 20 and max(lengths) <= protocols.LONGEST_S
        assert min(lengths) > 0.7 * protocols.LONGEST_S


def short_experiment(folder):
    """Write an experiment of some seconds into a folder; return its path."""
    path = folder / 'short.yaml'
    path.write_text(dump_yaml({'name': 'short', 'domain': 'pressure', 'segments': [
        {'rest': {'duration_s': 1.0}}, *protocols.pieces('ppr')['quick']]}))
    return str(path)


def test_a_name_that_cannot_be_tried_is_told_and_alone_refused(tmp_path, capsys):
    run = recorded(nominal(), voltages(4.0), topics=('pressure', 'contraction'))
    recording = Recording(run, 'ppr')
    told = '`thermal` was asked for and is not tried: it acts with valve hsv, the model has ppr'
    assert Sensitivities(nominal(), recording, ['thermal', 'creep']).left_out == [f'{told}.']
    assert main(['gap', '--plan', short_experiment(tmp_path), '--effects', 'thermal']) == 2
    assert capsys.readouterr().err.endswith(f'{nominal().name}: {told}\n')


@pytest.mark.parametrize('words, told', [
    (['--valve', 'hsv', '--out', 'g'], '--valve: does not go with a recording'),
    (['--no-force', '--out', 'g'], '--no-force: does not go with a recording'),
    (['--plan', '--certify', 'other'], '--certify: does not go with --plan'),
    (['--plan', '--topic', 'pressure=/p'], '--topic: does not go with --plan'),
    (['--plan', '--explain', 'creep'], '--plan: does not go with --explain'),
    (['--explain', 'creep', '--out', 'g'], '--out: does not go with --explain'),
    (['--explain', 'creep', '--overwrite'], '--overwrite: does not go with --explain'),
    (['second', '--explain', 'creep'], '--explain: takes one bag, 2 were given')])
def test_an_option_of_another_question_is_refused(words, told, capsys):
    assert main(['gap', 'bag', *words]) == 2
    assert capsys.readouterr().err == f'pam gap: {told}\n'


def test_an_explanation_gives_no_size_beyond_the_range(monkeypatch, capsys):
    monkeypatch.setattr(look_alikes, 'screen', lambda *of: [
        replace(one, seen=1e-3 * one.seen) for one in screen(*of)])
    assert main(['gap', '--explain', 'coulomb_friction', '--json']) == 0
    said = json.loads(capsys.readouterr().out)
    assert said['least'] is None and said['why'] == BEYOND_RANGE
    assert main(['gap', '--explain', 'coulomb_friction']) == 0
    assert f'no smallest size: {BEYOND_RANGE}\n' in capsys.readouterr().out


def test_the_verb_writes_an_experiment_that_runs(monkeypatch, tmp_path, capsys):
    short, whole = short_experiment(tmp_path), protocols.pieces('ppr')
    monkeypatch.setattr(protocols, 'pieces', lambda *of: {'slow': whole['slow']})
    done = main(['gap', '--plan', short, '--model', 'dmsp_5_300_hanging_mass',
                 '--effects', 'coulomb_friction,viscous_damping', '--out', str(tmp_path),
                 '--json'])
    said = json.loads(capsys.readouterr().out)
    assert done == 0 and said == json.loads((tmp_path / 'plan.json').read_text())
    assert [p['name'] for p in said['protocols']] == ['short', protocols.NAME]
    friction = next(e for e in said['protocols'][-1]['effects'] if e['name'].startswith('coul'))
    assert friction['visible_from']['equivalent']['force_n']['unit'] == 'N'
    assert 0.0 < friction['visible_from']['parameters']['force_n']['value'] < 1.0
    planned = load_experiment(str(tmp_path / 'experiment.yaml'))
    assert planned.domain == 'pressure' and planned.duration_s <= protocols.LONGEST_S
    assert planned.needs == ('pressure', 'contraction', 'force')
