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

"""The gap look: verdict, size and place on recordings whose truth is known."""

import json

from gap_runs import NOMINAL, nominal, recorded, voltages
import numpy as np
from pam_actuation.report.gap import free_run_overlay, write_gap
from pam_sim import load_rig
from pam_sim.gap import gap_first_look
from pam_sim.gap.first_look import in_fit_part
from pam_sim.gap.free_run import free_run, held_mean, Recording
from pam_sim.gap.result import SignalGap
import pytest


@pytest.fixture(scope='module')
def realistic():
    """Return (recording of the realistic rig, its gap to the nominal one)."""
    run = recorded(load_rig('dmsp_5_300_realistic'), voltages(16.0))
    return run, gap_first_look(run, nominal())


def shares(result, signal, condition='all'):
    return {w.subsystem: w.share_of_gap for w in result.where
            if w.signal == signal and w.condition == condition}


def test_noise_alone_is_no_gap():
    result = gap_first_look(recorded(nominal(), voltages(16.0)), nominal())
    assert result.verdict == 'no_gap'
    assert result.parameters == [] and result.unexplained_fraction == 0.0
    for signal in result.signals.values():
        assert signal.rmse_before < 1.1 * signal.noise_floor


def test_the_realistic_rig_has_a_gap_in_valve_and_muscle(realistic):
    _, result = realistic
    assert result.verdict == 'unknown'
    assert result.effects == [] and 'does not yet name effects' in result.reason
    for name in ('pressure', 'contraction', 'force'):
        assert result.signals[name].rmse_refit > 3.0 * result.signals[name].noise_floor
    assert shares(result, 'pressure') == {'valve': 1.0}
    contraction = shares(result, 'contraction')
    assert sum(contraction.values()) == pytest.approx(1.0)
    assert contraction['load'] < 0.1
    assert contraction['muscle'] > 0.2 and contraction['valve'] > 0.2


def test_shares_by_condition_add_up(realistic):
    _, result = realistic
    directions = [w.share_of_gap for w in result.where if w.signal == 'contraction'
                  and w.condition in ('contracting', 'extending', 'at rest')]
    assert sum(directions) == pytest.approx(1.0)
    bands = [w.share_of_gap for w in result.where if w.signal == 'contraction'
             and w.condition.endswith('kPa')]
    assert len(bands) == 3 and sum(bands) == pytest.approx(1.0)


def test_a_wrong_mass_is_a_parameter():
    run = recorded(nominal().with_(parameters={'mass_kg': 5.75}), voltages(16.0))
    result = gap_first_look(run, nominal())
    assert result.verdict == 'parameter'
    assert [p.name for p in result.parameters] == ['mass_kg']
    assert result.parameters[0].value == pytest.approx(5.75, rel=2e-3)
    low, high = result.parameters[0].ci95
    assert low < 5.75 < high
    assert shares(result, 'contraction')['load'] > 0.9
    assert load_rig(result.model_yaml).parameters['mass_kg'] == pytest.approx(5.75, rel=2e-3)


def test_a_small_error_within_tolerance_is_calibrated_silently():
    run = recorded(nominal().with_(parameters={'mass_kg': 5.15}), voltages(16.0))
    result = gap_first_look(run, nominal())
    assert result.verdict == 'no_gap'
    assert result.signals['contraction'].rmse_before > result.signals[
        'contraction'].noise_floor
    assert result.signals['contraction'].shrink_percent is None


def test_a_hair_of_latency_is_no_gap():
    run = recorded(nominal(), voltages(16.0))
    for topic in ('pressure', 'contraction', 'force'):
        run.topics[topic].stamp_ns += 1_500_000
    assert gap_first_look(run, nominal()).verdict == 'no_gap'


def test_the_hsv_pair_keeps_no_gap_in_a_closed_volume():
    rig = load_rig(NOMINAL, valve='hsv')
    t = np.arange(12_000) * 1e-3
    wave = 0.25 * np.cos(2 * np.pi * 0.3 * t)
    duty = np.column_stack([np.clip(wave, 0, 1), np.clip(-1.1 * wave, 0, 1)])
    duty[:1500] = (0.3, 0.0)
    run = recorded(rig, duty, rate_hz=100, initial_pressure_pa=101_325.0)
    assert gap_first_look(run, rig).verdict == 'no_gap'


def test_without_a_load_cell_the_gap_is_still_measured():
    run = recorded(load_rig('dmsp_5_300_realistic'), voltages(12.0),
                   topics=('pressure', 'contraction'))
    result = gap_first_look(run, nominal())
    assert result.verdict == 'unknown' and set(result.signals) == {'pressure', 'contraction'}
    assert any('load cell' in remark for remark in result.remarks)


@pytest.mark.parametrize('spoil, word', [
    (lambda run: run.topics.pop('valve_signal'), 'no input'),
    (lambda run: run.topics.pop('contraction'), 'no contraction'),
    (lambda run: run.topics['pressure'].values['pressure_pa'].__setitem__(5, np.nan), 'finite'),
    (lambda run: run.topics['contraction'].values['contraction_m'].fill(0.01), 'hardly moves'),
    (lambda run: run.topics['valve_signal'].values['ppr_voltage'].fill(6.0), 'at its limit'),
    (lambda run: run.topics['pressure'].stamp_ns.__iadd__(12 * 10**9), 'are covered'),
])
def test_what_cannot_be_compared_is_refused_with_a_reason(spoil, word):
    run = recorded(nominal(), voltages(12.0))
    spoil(run)
    result = gap_first_look(run, nominal())
    assert result.verdict == 'refused' and word in result.reason
    json.dumps(result.to_dict(), allow_nan=False)


def test_another_valve_is_refused():
    run = recorded(nominal(), voltages(12.0))
    result = gap_first_look(run, load_rig(NOMINAL, valve='hsv'))
    assert result.verdict == 'refused' and 'hsv' in result.reason


def test_equal_inputs_give_equal_results(realistic):
    run, first = realistic
    second = gap_first_look(run, nominal()).to_dict()
    assert {**second, 'runtime_s': 0} == {**first.to_dict(), 'runtime_s': 0}


def test_a_free_run_of_the_true_model_follows_the_recording():
    run = recorded(nominal(), voltages(8.0), noise=0.0, jitter_s=0.0)
    recording = Recording(run, 'ppr')
    simulated = free_run(nominal(), recording)
    assert np.max(np.abs(simulated['contraction'] - recording.measured['contraction'])) < 2e-6
    assert np.max(np.abs(simulated['pressure'] - recording.measured['pressure'])) < 50.0


def test_mean_of_a_held_signal_is_exact_between_grid_points():
    grid = np.array([0.0, 1.0, 2.0, 3.0])
    mean = held_mean(np.array([0.25, 1.5]), np.array([2.0, 4.0]), grid)
    assert mean == pytest.approx([2.0, 3.0, 4.0])
    mean = held_mean(np.array([0.25]), np.array([2.0]), grid, before=0.0)
    assert mean == pytest.approx([1.5, 2.0, 2.0])


def test_fit_and_certify_blocks_cover_everything_once():
    part = in_fit_part(np.arange(0.0, 20.0, 0.5))
    assert part.mean() == pytest.approx(0.6)


def test_shrink_takes_the_noise_out():
    gap = SignalGap('m', 1.0, 9.0, np.hypot(4.0, 1.0), np.hypot(1.0, 1.0))
    assert gap.shrink_percent == pytest.approx(75.0)
    assert SignalGap('m', 1.0, 9.0, 0.9, 0.9).shrink_percent is None


def test_the_folder_holds_what_others_rely_on(realistic, tmp_path):
    run, _ = realistic
    result = write_gap([run], NOMINAL, tmp_path / 'gap', seconds=5.0)
    found = json.loads((tmp_path / 'gap' / 'gap.json').read_text())
    assert found['schema'] == 1 and found['verdict'] == result.verdict
    assert set(found) == {
        'schema', 'verdict', 'effects', 'parameters', 'ambiguity_set', 'next_experiment', 'where',
        'signals', 'unexplained_fraction', 'fingerprint', 'minimum_detectable', 'runtime_s',
        'simulations', 'reason'}
    assert set(found['signals']['pressure']) == {
        'unit', 'noise_floor', 'rmse_before', 'rmse_refit', 'rmse_after', 'shrink_percent'}
    assert load_rig(str(tmp_path / 'gap' / 'model.yaml')).valve == 'ppr'
    assert (tmp_path / 'gap' / 'report.html').stat().st_size > 1e6
    assert sorted(p.name for p in (tmp_path / 'gap').iterdir()) == [
        'compare.mcap', 'gap.json', 'model.yaml', 'report.html']


def test_the_comparison_opens_with_an_independent_reader(realistic, tmp_path):
    from mcap_ros2.reader import read_ros2_messages
    run, _ = realistic
    write_gap([run], NOMINAL, tmp_path, seconds=2.0)
    counts = {}
    for message in read_ros2_messages(str(tmp_path / 'compare.mcap')):
        counts[message.channel.topic] = counts.get(message.channel.topic, 0) + 1
    assert set(counts) == {
        f'/muscle/{folder}/{signal}' for signal in ('pressure', 'contraction', 'force')
        for folder in ('measured', 'simulated_before', 'simulated_refit', 'simulated_after',
                       'residual_before', 'residual_after')}
    assert len(set(counts.values())) <= 3


def test_an_overlay_of_the_true_model_stays_near(realistic):
    run, _ = realistic
    overlays = {o.signal: o for o in free_run_overlay(run, load_rig('dmsp_5_300_realistic'))}
    contraction = overlays['contraction']
    assert np.sqrt(np.mean((contraction.recorded - contraction.simulated) ** 2)) < 1e-4
