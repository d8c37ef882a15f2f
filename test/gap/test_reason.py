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

"""The sentences of a gap result never say what its numbers contradict."""

import shlex
import time
from types import SimpleNamespace

from gap_runs import NOMINAL, nominal, recorded, voltages
import numpy as np
from pam_actuation.cli import gap as gap_verb
from pam_actuation.cli.main import main
from pam_actuation.report import gap as gap_report
from pam_actuation.report.gap import next_command
from pam_actuation.report.sections.gap import gap_section
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.gap import find_gap
from pam_sim.gap.report.reason import explain
from pam_sim.gap.result import Calibrated, GapResult, SignalGap, SubsystemVerdict
from pam_sim.gap.select.rival import NamedEffect
from pam_sim.gap.verify.notice import Notice
from pam_sim.gap.words import in_words
from pam_sim.run import Run, Series
import pytest

FORCE = SignalGap('N', 0.05, 0.5, 0.186, 0.197)
PRESSURE = SignalGap('Pa', 300.0, 9e3, 8e3, 400.0)
MASS = Calibrated('mass_kg', 'kg', 5.0, 5.75, (5.7, 5.8), 7.5)


def effect(name, quantity, unit):
    return {'name': name, 'family': 'f', 'subsystem': 'valve', 'confidence': 0.5,
            'equivalent': {quantity: {'value': 0.03, 'unit': unit, 'ci95': [0.02, 0.04]}},
            'parameters': {}, 'together': []}


EFFECTS = {'valve_dead_time': effect('valve_dead_time', 'delay_s', 's'),
           'hysteresis': effect('hysteresis', 'loop_half_width_at_400kpa_n', 'N')}


def said(verdict, signals, named=(), share=None, effects=(), parameters=(), complete=True,
         **more):
    """Return what is said of a result with these numbers."""
    result = GapResult(verdict, '', signals=signals, effects=[EFFECTS[e] for e in effects],
                       parameters=list(parameters), **more)
    result.ambiguity_set = list(dict.fromkeys(n for w in named for n in w.names))
    return explain(result, SimpleNamespace(
        named=list(named), share=share or {}, mistaken={}, complete=complete))


@pytest.mark.parametrize('name, words', [
    ('loop_half_width_at_400kpa_n', 'loop half width at 400 kPa'),
    ('force_at_50mm_per_s_n', 'force at 50 mm/s'), ('conductance_m3_per_s_pa', 'conductance'),
    ('loss_n_per_m2', 'loss'), ('damping_n_s_per_m', 'damping'), ('speed_m_per_s', 'speed'),
    ('gain_percent', 'gain percent'), ('force_at_500kpa_10mm', 'force at 500 kPa and 10 mm')])
def test_a_quantity_in_words_has_no_unit(name, words):
    assert in_words(name) == words


def test_no_gap_by_the_materiality_that_was_given_is_told_with_its_sizes():
    assert said('no_gap', {'pressure': PRESSURE}, is_slight=True) == (
        'The calibrated model misses 8 kPa of pressure. This is too small to matter by the '
        'materiality that was given.')
    assert 'within sensor noise' in said('no_gap', {'pressure': PRESSURE, 'force': FORCE})
    # A gap that calibration closes is told with what closed it.
    gain, mass = (Calibrated(*of) for of in (
        ('force_map_gain', '-', 1.0, 1.05, (1.04, 1.06), 2.5), ('mass_kg', 'kg', 5.0, 5.02, (
            5.01, 5.03), 0.2)))
    for signals in ({'pressure': PRESSURE, 'force': FORCE}, {'pressure': PRESSURE}):
        text = said('no_gap', signals, calibration=[mass, gain])
        assert ('tolerance. Calibration moved force_map_gain from 1 to 1.05 (+2.5 of its '
                'standard deviations).') in text
    slight = SubsystemVerdict('no_gap', (), 'force', FORCE, 1.0, is_slight=True)
    assert slight.text() == '0.191 N unexplained, too small to matter'


def test_a_search_that_was_cut_short_says_so_and_claims_nothing_of_what_was_not_tried():
    assert 'no known effect explains it' in said('unknown', {'pressure': PRESSURE})
    assert said('unknown', {'pressure': PRESSURE}, complete=False) == (
        'The calibrated model misses 8 kPa of pressure and none of the effects that were tried '
        'explains it.')
    # Of names that were asked for alone, others are not known to fail.
    result = GapResult('unknown', '', signals={'pressure': PRESSURE})
    assert explain(result, SimpleNamespace(named=[], share={}, mistaken={}, complete=True),
                   of_some=True) == ('The calibrated model misses 8 kPa of pressure and none of '
                                     'the effects that were asked for explains it.')
    run, limit = recorded(nominal(), voltages(6.0)), {'effects': ['creep'], 'unnamed': ()}
    whole = find_gap(run, nominal(), **limit)
    spent = find_gap(run, nominal(), seconds=100.0, spent_s=100.0, **limit)
    told = (' The search was cut short: its 100 s ran out before all was tried, and more time may '
            'change this answer.')
    assert spent.reason == whole.reason + told and spent.runtime_s > 100.0 > whole.runtime_s


def test_the_time_for_unknown_numbers_counts(monkeypatch):
    spent = []
    monkeypatch.setattr(gap_report, 'numbers_first', lambda runs, rig, *given: (
        rig, time.sleep(0.2), []))
    monkeypatch.setattr(gap_report, 'find_gap', lambda *given, spent_s, **more: (
        spent.append(spent_s), GapResult('no_gap', ''))[-1])
    gap_report.gap_of([recorded(nominal(), voltages(6.0))], nominal())
    assert 0.2 <= spent[0] < 5.0


def test_a_gap_of_the_proof_that_calibration_raises_is_told():
    text = said('unknown', {'contraction': SignalGap('m', 2e-5, 4e-5, 1.39e-3, 1.39e-3),
                            'force': FORCE})
    assert text.endswith(
        ' Calibration raises the gap in contraction of the proof from 0.04 to 1.39 mm: numbers '
        'bend for what is missing, or the recordings are not of one rig.')
    assert 'Calibration raises' not in said('unknown', {'force': FORCE})


def test_a_name_that_is_wrong_is_the_reason_why_nothing_is_named():
    outcome = SimpleNamespace(named=[], share={'muscle': 0.99}, complete=True,
                              mistaken={'coulomb_friction': 'smooth_friction'})
    text = explain(GapResult('unknown', '', signals={'force': FORCE}), outcome)
    assert 'explains 99 % in the muscle of the data that were searched, but its name' in text
    assert 'numbers far from' not in text
    assert text.endswith('Ask for that with `--effects smooth_friction`.')
    outcome.share['valve'] = 0.95
    assert 'numbers far from' in explain(
        GapResult('unknown', '', signals={'force': FORCE}), outcome)


def test_what_grows_rises_and_what_stays_stays():
    named = [NamedEffect('hysteresis', 'muscle', [], ('hysteresis',))]
    text = said('effects', {'force': FORCE, 'pressure': PRESSURE}, named, effects=['hysteresis'])
    assert 'the gap in force rises from 0.186 to 0.197 N' in text
    assert 'the gap in pressure falls from 8 to 0.4 kPa' in text
    same = SignalGap('N', 0.05, 0.5, 0.1861, 0.1859)
    assert 'the gap in force stays at 0.186 N' in said('effects', {'force': same}, named)
    # Calibration alone made it worse: what is added counts from the given model.
    for after, told in ((0.307e-3, 'falls'), (2.5e-3, 'rises')):
        bent = SignalGap('m', 2e-5, 2.06e-3, 3.71e-3, after)
        assert (f'the gap in contraction of the given model, which calibration alone raises to '
                f'3.71 mm, {told} from 2.06 to {1e3 * after:.3g} mm') in said(
                    'effects', {'contraction': bent}, named)
    # Where nothing stands out of the noise before either, that is told.
    hidden = SignalGap('N', 0.05, 0.05, 0.05, 0.04)
    assert 'With this every signal stays within its noise floor, as it does without.' in said(
        'effects', {'force': hidden}, named)
    # What was within noise and is no more is told as well.
    grown = SignalGap('N', 0.05, 0.05, 0.05, 0.5)
    assert 'rises from 0.05 to 0.5 N' in said('effects', {'force': grown}, named)


def test_no_pair_of_numbers_is_told_the_wrong_way():
    random = np.random.default_rng(4)
    for _ in range(300):
        floor, refit, after = 10.0 ** random.uniform(-2, 1, 3)
        text = said('parameter', {'force': SignalGap('N', floor, 1.0, refit, after)},
                    parameters=[MASS])
        words = text.rstrip('.').split()
        if 'from' in words:
            low, high = (float(words[k]) for k in (-4, -2))
            assert ('rises' in words) == (high > low) and ('falls' in words) == (high < low)
        else:
            assert 'stays' in words
            assert 'noise' in words or f'{refit:.3g}' == f'{after:.3g}' == words[-2]
        assert ('noise' in words) == (max(refit, after) <= 1.2 * floor)


def test_only_what_cannot_be_told_apart_is_listed_so():
    named = [NamedEffect('valve_dead_time', 'valve', [], ('valve_dead_time', 'tube_lag')),
             NamedEffect('hysteresis', 'muscle', [], ('hysteresis',))]
    text = said('ambiguous', {'pressure': PRESSURE}, named,
                effects=['valve_dead_time', 'hysteresis'], parameters=[MASS])
    assert text.startswith('These data cannot tell valve_dead_time and tube_lag apart. Likeliest:')
    likeliest, certain = text.split(' Certain: ')
    assert 'valve_dead_time: delay 0.03 s' in likeliest and 'hysteresis' not in likeliest
    assert 'hysteresis: loop' in certain and 'mass_kg = 5.75' in certain
    named[1] = NamedEffect('hysteresis', 'muscle', [], ('hysteresis', 'mass_kg'))
    text = said('ambiguous', {'pressure': PRESSURE}, named,
                effects=['valve_dead_time', 'hysteresis'])
    assert 'cannot tell valve_dead_time and tube_lag, nor hysteresis and mass_kg apart.' in text
    assert 'Certain' not in text


def test_unknown_is_never_explained():
    signals = {'pressure': PRESSURE}
    for share in ({'valve': 1.0}, {'valve': 0.97, 'muscle': 0.2}):
        text = said('unknown', signals, share=share)
        assert 'no known effect explains' not in text and '(explained' not in text
        assert 'does not hold' in text and 'nothing is named' in text
    text = said('unknown', signals, share={'valve': 0.42, 'muscle': -0.1})
    assert text == ('The calibrated model misses 8 kPa of pressure and no known effect explains '
                    'it: the best fit explains 42 % in the valve.')
    assert said('unknown', signals, share={'valve': -0.2}).endswith(
        'no known effect explains it.')


def test_unknown_tells_of_fits_only_where_the_gap_is():
    quiet, wide = (SubsystemVerdict(v, (), 'pressure', PRESSURE, 1.0)
                   for v in ('no_gap', 'unknown'))
    text = said('unknown', {'pressure': PRESSURE}, share={'valve': 0.3, 'muscle': 1.0},
                subsystems={'valve': wide, 'muscle': quiet})
    assert '100 %' not in text and 'explains 30 % in the valve.' in text
    still = SignalGap('Pa', 300.0, 310.0, 300.0, 300.0)
    text = said('unknown', {'pressure': still},
                noticed=[Notice('valve', 'pressure', 0.3, 0.2, 9.0)])
    assert 'little' not in text and text.startswith(
        'The calibrated model leaves a gap that its free run hides and no known effect')
    assert text.endswith('follow time or pressure by 9 deviations.')
    text = said('unknown', {'pressure': still}, noticed=[Notice('muscle', 'force', 0.9, 0.3)])
    assert text.endswith('Over 0.5 s the force errs 3.0 times as much as noise does.')


def test_a_wrong_number_is_a_sentence_of_its_own():
    text = said('parameter', {'pressure': PRESSURE}, parameters=[MASS])
    assert text == ('mass_kg = 5.75 kg instead of 5 kg (+15.0 %), 95 % 5.7 to 5.8. With this the '
                    'gap in pressure falls from 8 to 0.4 kPa.')
    gain = Calibrated('force_map_gain', '-', 1.0, 1.12, (1.11, 1.13), 6.0)
    text = said('parameter', {'pressure': PRESSURE}, parameters=[gain])
    assert text.startswith('force_map_gain = 1.12 instead of 1 (+12.0 %), 95 % 1.11 to 1.13. With')


@pytest.mark.parametrize('ratio_minus_1, sentence', [
    (-0.27, 'Venting is quicker than filling'), (0.4, 'Venting takes longer than filling')])
def test_the_sentence_on_venting_says_what_the_ratio_says(ratio_minus_1, sentence):
    vent = effect('vent_asymmetry', 'vent_to_fill_time_ratio', '-')
    vent['parameters'] = {'ratio_minus_1': {'value': ratio_minus_1, 'unit': '-', 'ci95': [0, 0]}}
    named = NamedEffect('vent_asymmetry', 'valve', [], ('vent_asymmetry',))
    found = GapResult('effects', '', signals={'pressure': PRESSURE}, effects=[vent])
    text = explain(found, SimpleNamespace(named=[named], share={}, mistaken={}, complete=True))
    assert text.startswith(f'{sentence} (vent_asymmetry: vent to fill time ratio 0.03, 95 % 0.02')
    assert '>0.03<' in gap_section(found).body


def test_a_number_without_a_unit_has_no_dash_behind_it():
    gain = Calibrated('force_map_gain', '-', 1.0, 1.1, (1.09, 1.11), 5.0)
    text = said('parameter', {'pressure': PRESSURE}, parameters=[gain])
    assert text.startswith(
        'force_map_gain = 1.1 instead of 1 (+10.0 %), 95 % 1.09 to 1.11. With this')
    vent = effect('vent_asymmetry', 'vent_to_fill_time_ratio', '-')
    found = GapResult('effects', '', signals={'pressure': PRESSURE}, effects=[vent],
                      calibration=[gain])
    found.reason = explain(found, SimpleNamespace(
        named=[NamedEffect('vent_asymmetry', 'valve', [], ('vent_asymmetry',))], share={},
        mistaken={}, complete=True))
    assert 'vent to fill time ratio 0.03, 95 % 0.02 to 0.04' in found.reason
    page = gap_section(found).body
    assert '0.03 -' not in page and '>0.03<' in page
    assert '1.1 -' not in page and '>1.1<' in page


def test_a_number_that_was_0_has_no_change_in_percent():
    spring = Calibrated('spring_n_per_m', 'N/m', 0.0, 400.0, (390.0, 410.0), 8.0)
    text = said('parameter', {'pressure': PRESSURE}, parameters=[spring])
    assert text.startswith('spring_n_per_m = 400 N/m instead of 0 N/m, 95 % 390 to 410. With this')


def test_the_page_of_doubtful_effects_says_likeliest():
    assert 'What is likeliest to be missing' in gap_section(
        GapResult('ambiguous', '', effects=[EFFECTS['hysteresis']])).body
    assert 'What is missing in the model' in gap_section(
        GapResult('effects', '', effects=[EFFECTS['hysteresis']])).body


def test_the_next_experiment_is_told_with_its_command():
    result = GapResult('ambiguous', '', model_yaml=load_rig(
        'dmsp_5_300_hanging_mass', valve='hsv').to_yaml())
    assert gap_verb._next_lines(result, 'runs/gap') == []
    result.next_experiment = {'name': 'next', 'why': 'It tells A from B.', 'experiment': {}}
    run = Run({}, {'seed': '1'}, '/muscle')
    told = gap_verb._next_lines(result, 'runs/my gap', [run])
    assert told == ['what to measure next: It tells A from B.',
                    "next: pam run 'runs/my gap/next_experiment.yaml' --rig "
                    "'runs/my gap/model.yaml'"]
    command = next_command('next_experiment.yaml', [run])
    assert command in gap_section(result, command=command).body


@pytest.mark.parametrize('verdict, load, told', [
    ('effects', 'hanging_mass', True), ('parameter', 'hanging_mass', True),
    ('no_gap', 'hanging_mass', True), ('unknown', 'hanging_mass', False),
    ('effects', 'driven', False), ('effects', 'isometric', False)])
def test_an_answer_is_followed_by_a_tuning_where_the_load_moves(verdict, load, told):
    result = GapResult(verdict, '', model_yaml=load_rig(f'dmsp_5_300_{load}').to_yaml())
    assert gap_verb._next_lines(result, 'my gap') == [
        "next: pam tune --model 'my gap/model.yaml' --out tuned.yaml"] * told


def test_a_proposed_term_is_told_with_the_command_that_uses_it(monkeypatch):
    result = GapResult('unknown', '')
    result.proposal = object()
    monkeypatch.delenv('PAM_EFFECTS_PATH', raising=False)
    assert gap_verb._next_lines(result, 'my gap') == [
        "the model with the term: PAM_EFFECTS_PATH='my gap' pam simulate sine_quarter_hz "
        "--rig 'my gap/proposed_model.yaml' --out runs/with_term"]
    monkeypatch.setenv('PAM_EFFECTS_PATH', 'effects')
    told, = gap_verb._next_lines(result, 'gap')
    assert 'PAM_EFFECTS_PATH=effects:gap pam' in told


@pytest.mark.parametrize('load', ['driven', 'isometric'])
def test_a_muscle_that_is_held_or_moved_is_simulated_in_pressure(load, tmp_path):
    model = load_rig(f'dmsp_5_300_{load}').to_yaml()
    (tmp_path / 'surrogate_model.yaml').write_text(model, encoding='utf-8')
    result = GapResult('unknown', '', model_yaml=model)
    result.proposal = result.surrogate = object()
    told = [line.partition('pam simulate ')[2]
            for line in gap_verb._next_lines(result, str(tmp_path))]
    assert [line.split()[0] for line in told] == ['pressure_identification'] * 2
    words = shlex.split(told[1])
    assert main(['simulate', *words[:-1], str(tmp_path / 'bag')]) == 0


def test_a_surrogate_is_told_with_the_command_that_simulates_it():
    result = GapResult('unknown', '', surrogate=object())
    assert gap_verb._next_lines(result, 'my gap') == [
        "the surrogate: pam simulate sine_quarter_hz --rig 'my gap/surrogate_model.yaml' "
        '--out runs/surrogate']


@pytest.fixture(scope='module')
def run():
    return recorded(nominal(), voltages(4.0))


def part(run, start, stop, every=1, topics=None):
    """Return a part of a recording, as a subsystem or filtered copy holds it."""
    return Run({topic: Series(series.stamp_ns[start:stop:every], {
        name: column[start:stop:every] for name, column in series.values.items()})
        for topic, series in run.topics.items() if topics is None or topic in topics},
        {}, '/other', 'copy')


def test_the_proof_may_not_be_on_searched_data(run):
    for copy in (run, part(run, 0, None), part(run, 100, 300), part(run, 0, None, 4),
                 part(run, 0, None, topics=('pressure', 'valve_signal'))):
        with pytest.raises(InputError) as found:
            find_gap([recorded(nominal(), voltages(4.0), seed=9), run], nominal(), copy)
        assert 'is the same recording as simulated (100 % of its messages' in str(found.value)
        assert str(found.value).startswith('--certify')


def test_without_a_recording_there_is_no_answer():
    with pytest.raises(InputError, match='at least one recording is needed'):
        find_gap([], nominal())


def test_one_recording_is_searched_once(run):
    another = recorded(nominal(), voltages(4.0), seed=9)
    for copy in (run, part(run, 0, None), part(run, 300, None), part(run, 0, None, 4)):
        for certify in (None, recorded(nominal(), voltages(4.0), seed=8)):
            with pytest.raises(InputError, match='is the same recording as simulated .*once'):
                find_gap([another, run, copy], nominal(), certify)
    with pytest.raises(InputError, match='copy: is the same recording'):
        find_gap([run, copy], nominal())


def test_another_run_of_the_same_clock_is_a_proof(run):
    # Simulations begin at one time: equal stamps alone say nothing.
    one, other = (recorded(nominal(), voltages(8.0), seed=seed, jitter_s=0.0) for seed in (2, 1))
    assert np.array_equal(one.topics['pressure'].stamp_ns, other.topics['pressure'].stamp_ns)
    assert find_gap(one, nominal(), other, effects=['leakage'], seconds=1.0).verdict == 'no_gap'


@pytest.mark.parametrize('verdict, implausible, code', [
    *((v, [], 0) for v in ('no_gap', 'parameter', 'effects', 'partial', 'ambiguous', 'unknown')),
    ('refused', [], 1), ('effects', ['pressure: it cannot be right.'], 1)])
def test_an_answer_ends_with_0_and_what_is_wrong_with_the_data_with_1(
        monkeypatch, tmp_path, capsys, verdict, implausible, code):
    run = SimpleNamespace(implausible=implausible, unusable=(), left_out=())
    monkeypatch.setattr('pam_actuation.report.joint_gap.load_run',
                        lambda path, namespace=None, topics=None: run)
    monkeypatch.setattr('pam_actuation.report.origin.origin', lambda *given: '')
    monkeypatch.setattr('pam_actuation.report.gap.write_gap',
                        lambda *given, **more: GapResult(verdict, 'Because.'))
    assert main(['gap', 'bag', '--model', NOMINAL, '--out', str(tmp_path / 'gap')]) == code
    said = capsys.readouterr().out
    assert f'{verdict}: Because.' in said and all(one in said for one in implausible)


def test_what_is_known_only_together_follows_the_quantities(monkeypatch):
    formula = 'close_time_s - open_time_s = 0.0003 ± 1e-05'
    monkeypatch.setitem(EFFECTS['hysteresis'], 'together', [formula])
    named = [NamedEffect('hysteresis', 'muscle', [], ('hysteresis',))]
    text = said('effects', {'force': FORCE}, named, effects=['hysteresis'])
    assert f'95 % 0.02 to 0.04; the data determine only {formula}). With this' in text
