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
"""A term without a name: found, proved, written as an effect file that simulates the same."""

from dataclasses import replace
import json
import os
import re
import subprocess
import sys

from gap_runs import assert_form, nominal, recorded, voltages
from pam_actuation.report.gap import save_gap
from pam_sim.effects.unnamed import terms
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.propose.library import Factor, library, NOTHING, STAND_INS, Term
from pam_sim.gap.propose.proposal import (
    EFFECT_FILE, MODEL_FILE, NO_TIME, NONE, propose)
from pam_sim.gap.propose.ranges import ranges_of
from pam_sim.gap.propose.search import candidate_of, ends_of
from pam_sim.gap.propose.writing import EffectText
from pam_sim.gap.result import GapResult
from pam_sim.gap.share import Share
from pam_sim.gap.subsystems.problems import subsystem_problems
from pam_sim.gap.verify.validation import Validation
import pytest
import yaml

DRAG_N = -3.0                # at 50 mm/s
DRAG = {'name': 'muscle_term', 'parameters': {
    'first_of_1': DRAG_N, 'kind_1_of_1': terms.SIGNED_SQUARE, 'input_1_of_1': 2.0}}
# Simulates each pair of effects, one of a file and its stand-in; prints how far they are apart.
SCRIPT = """
import json, sys
import numpy as np
from pam_sim import load_rig
from pam_sim.effects.registry import get_effect
for name, valve, effects in json.load(open(sys.argv[1])):
    rig = load_rig('dmsp_5_300_hanging_mass', valve=valve)
    signal = np.linspace(4.0, 5.0, 40)
    if valve == 'hsv':
        signal = np.column_stack([np.abs(np.sin(signal * 9.0)), np.abs(np.sin(signal * 7.0))])
    one, other, none = (
        rig.with_(effects=chosen).simulate(signal, initial_pressure_pa=501325.0).outputs
        for chosen in (effects[:1], effects[1:], []))
    same, acts = np.allclose(one, other, 1e-6, 1e-9), not np.allclose(one, none, 1e-9)
    effect = get_effect(effects[0]['name'])
    # What a second look states of it.
    sizes = effect.report(effect.values(effects[0]['parameters']), rig)
    print(name, same, acts, list(sizes) == list(effect.amplitude))
"""
RANGES = {'p': (1e4, 5e5), 'x': (1e-4, 0.02), 'v': (-0.2, 0.2), 't': (0.005, 60.0),
          'F': (1.0, 90.0), 's': (1e5, 6e5), 'e': (-1e5, 1e5), 'a': (0.0, 1.0), 'b': (0.0, 1.0)}
# By stand-in: channel, factors (kind, input, shape), and amplitude in the unit of the channel.
FORMS = [
    ('muscle_term', 0, (terms.STOP, 1, 2e-4), (terms.SIGN, 2, 3e-3), 2.0),
    ('muscle_term', 0, (terms.PASSING, 0, 0.02), (terms.LINEAR, 3, 1.0), 500.0),
    ('muscle_term', 1, (terms.SIZE, 2, 1.0), None, 3.0),
    ('load_term', 0, (terms.SINE, 0, 4e-3), None, 2.0),
    ('load_term', 0, (terms.ABOVE, 0, 2e-3), (terms.SQUARE, 1, 1.0), 900.0),
    ('set_point_term', 0, (terms.CUBE, 0, 1.0), (terms.LINEAR, 4, 1.0), 1e7),
    ('set_point_term', 0, (terms.PASSING, 0, 0.2), None, 1e5),
    ('set_point_term', 1, (terms.LINEAR, 1, 1.0), None, 0.3),
    ('set_point_term', 2, (terms.SWING, 1, 0.2), None, 0.5),
    ('flow_term', 0, (terms.LINEAR, 0, 1.0), None, 3.0),
    ('flow_term', 1, (terms.LINEAR, 2, 1.0), None, -0.3),
    ('flow_term', 2, (terms.SIGNED_SQUARE, 3, 1.0), None, -0.3),
    ('contraction_reading_term', 0, (terms.SINE, 1, 3e-3), None, 1e-4),
    ('force_reading_term', 0, (terms.STOP, 2, 0.5), None, 1.0)]


def asked(rig, where=(), **options):
    """Return the result of a look for a term in a recording of a rig, held to be `unknown`."""
    recording = Recording(recorded(rig, voltages(12.0)), 'ppr')
    estimator = Estimator(nominal(), subsystem_problems(nominal(), [recording], True, 0, CRITERIA))
    result = GapResult('unknown', '', where=list(where), model_yaml=nominal().to_yaml())
    base = estimator.base
    propose(result, Validation(recording, False, estimator, base, base), **options)
    return result


@pytest.fixture(scope='module')
def drag():
    """Return the result for a rig with drag that no effect of the library has."""
    return asked(nominal().with_(effects=[DRAG]), [
        Share('sensor', 'contraction', 'all', 1.0, 0.5)])


def test_the_missing_term_is_found_and_says_what_it_is(drag):
    found = drag.proposal
    assert (found.subsystem, found.file) == ('muscle', 'proposed_effect.py')
    assert found.explained > 0.9 and set(found.ranges) == {'v'}
    sentence, beside = drag.remarks[-2:]
    assert 'Unnamed, its form found from data; it holds for v' in sentence
    # What is told first was judged without the term.
    assert beside.startswith('The term acts in the muscle, the place above is another one.')
    assert '\n    v (speed of contraction) ' in found.text
    assert_form(drag)


def written(number, effect, channel, one, two, size):
    """Return (text of an effect file, its entry in a model, that of its stand-in, valve)."""
    stand_in = next(s for s in STAND_INS if s.effect == effect)
    term = Term(stand_in.channels[channel], Factor(*one), Factor(*two) if two else NOTHING)
    values = {'first_of_1': size, 'second_of_1': 0.5 * size, 'shape_1_of_1': one[2]}
    values = {f.name: values[f.name] for f in term.free(1)}
    text = EffectText(stand_in, [term], values, RANGES, 1.0, f'term_{number}')
    trial = candidate_of(stand_in, [term], ends_of(stand_in, RANGES)).setting(values)
    return text.text(), {'name': text.name, 'parameters': text.values()}, trial, stand_in.valves


def test_a_proposal_of_an_earlier_result_goes_unless_it_is_used(drag, tmp_path):
    run, files = recorded(nominal(), voltages(2.0)), {EFFECT_FILE, MODEL_FILE}
    # As of a model with the effect in it, which cannot be loaded here.
    used = replace(drag, proposal=None, model_yaml=f'{drag.model_yaml}# proposed_effect\n')
    for result, left in ((drag, files), (used, files), (replace(drag, proposal=None), set())):
        save_gap(result, [run], tmp_path)
        assert files & set(os.listdir(tmp_path)) == left


@pytest.mark.parametrize('stand_in', STAND_INS, ids=lambda s: s.effect)
def test_every_term_that_may_be_found_can_be_written(stand_in):
    of_range = {one.symbol: RANGES[one.symbol] for one in stand_in.inputs}
    first = Term(stand_in.channels[0], Factor(terms.LINEAR))
    forms = {}
    for beside in ((), (first,)):
        for term in library(stand_in, of_range, (2.0,), bool(beside)):
            form = term.channel, term.one.kind, term.one.of, term.two.kind, term.two.of
            forms[(*beside, *form)] = (*beside, term)
    for found in forms.values():
        values = {f.name: f.typical for k, term in enumerate(found, 1) for f in term.free(k)}
        effect = EffectText(stand_in, found, values, RANGES, 1.0, 'term')
        text = effect.text()
        compile(text, 'term.py', 'exec')
        turns = any(term.channel.least < 0.0 for term in found)
        assert turns == bool(re.search(r'Parameter\(.*, -[0-9.e+-]+, [0-9.e+-]+, d', text))
        assert all(f'\n    {one.symbol} ({one.meaning}) ' in text for one in effect.inputs)
        for term in found:
            assert f'{term.channel.symbol} -> ' in effect.equation or len(found) == 1


def test_files_load_and_simulate_as_the_terms_that_were_tried(drag, tmp_path):
    found = drag.proposal
    (tmp_path / found.file).write_text(found.text)
    pairs = [('drag', 'ppr', [yaml.safe_load(found.model_yaml)['effects'][0], found.trial])]
    for number, form in enumerate(FORMS):
        text, entry, trial, valves = written(number, *form)
        (tmp_path / f'term_{number}.py').write_text(text)
        pairs.append((form[0] + str(number), valves[0], [entry, trial]))
    (tmp_path / 'pairs.json').write_text(json.dumps(pairs, default=float))
    answer = subprocess.run(
        [sys.executable, '-c', SCRIPT, str(tmp_path / 'pairs.json')],
        capture_output=True, text=True,
        env={**os.environ, 'PAM_EFFECTS_PATH': str(tmp_path), 'NUMBA_DISABLE_JIT': '1',
             'PYTHONPATH': os.pathsep.join(sys.path), 'PAM_CACHE_DIR': str(tmp_path / 'cache')})
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout.split('\n')[:-1] == [f'{name} True True True' for name, *_ in pairs]


def test_noise_alone_has_no_term():
    result = asked(nominal())
    assert result.proposal is None and result.remarks == [NONE]


def test_a_search_that_was_cut_short_says_so():
    result = asked(nominal().with_(effects=[DRAG]), out_of_time=lambda: True)
    assert result.proposal is None and result.remarks == [NO_TIME]


def test_the_range_of_a_set_point_is_that_of_the_regulator():
    """One of 2 to 8 V for 5 to 455 kPa, commanded beyond both ends."""
    rig = nominal().with_(parameters={
        'K_m': 75e3, 'ppr_lowest_v': 2.0, 'ppr_highest_v': 8.0, 'ppr_zero_pa': 5e3})
    command = 1.5 * voltages(8.0)
    command[4000:4500], command[7000:] = 9.0, 1.0
    recording = Recording(recorded(rig, command), 'ppr')
    estimator = Estimator(rig, subsystem_problems(rig, [recording], True, 0, CRITERIA))
    found = ranges_of([recording], estimator, estimator.base)
    assert found['s'] == pytest.approx((5e3, 455e3), rel=0.01)
    low, high = found['e']
    assert -455e3 < low < 0.0 < high < 455e3
