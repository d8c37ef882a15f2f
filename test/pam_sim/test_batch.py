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

"""Batches: the bits of single runs, in order, with any number of workers."""

import itertools

from both_ways import compiled_and_not
import numpy as np
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.rollout.batch import (
    default_workers, Record, residual_sums, sample_batch, simulate_batch)
from pam_sim.rollout.sampling import Measured
import pytest

STEPS = 400
TIME_S = np.arange(STEPS) * 1e-3


def ppr_records():
    """Return records of different lengths and starts."""
    return [Record(3.0 + np.sin(9.0 * TIME_S[:n]), initial_pressure_pa=p, external_force_n=f)
            for n, p, f in ((STEPS, 200e3, None), (150, 400e3, 3.0), (STEPS, 101_325.0, -2.0))]


def rigs():
    """Return rigs that differ in numbers and effects."""
    rig = load_rig('dmsp_5_300_realistic')
    return [rig, rig.with_(parameters={'mass_kg': 4.0}), rig.with_(effects=['leakage'])]


def single(rig, record):
    """Return the Response of one run made by the rig itself."""
    return rig.simulate(
        record.valve_signal, external_force_n=record.external_force_n,
        contraction_m=record.contraction_m, initial_pressure_pa=record.initial_pressure_pa,
        dt_s=record.dt_s)


@pytest.mark.parametrize('workers', [1, 2, 5])
def test_a_batch_has_the_bits_of_single_runs(workers):
    pairs = list(itertools.product(rigs(), ppr_records()))
    found = simulate_batch(*zip(*pairs), workers=workers)
    assert len(found) == 9
    for response, (rig, record) in zip(found, pairs):
        assert np.array_equal(response.outputs, single(rig, record).outputs)


def test_hsv_and_driven_runs_mix_in_a_batch():
    hsv = load_rig('dmsp_5_300_hanging_mass', valve='hsv', fidelity='switching')
    driven = load_rig('dmsp_5_300_driven')
    duty = np.stack([np.full(STEPS, 0.3), np.zeros(STEPS)], axis=1)
    path = 0.01 * (1.0 - np.cos(5.0 * np.arange(STEPS + 1) * 1e-3))
    pairs = [(hsv, Record(duty)), (driven, Record(np.full(STEPS, 3.0), contraction_m=path)),
             (load_rig('dmsp_5_300_isometric'), Record(np.full(STEPS, 3.0)))]
    for response, (rig, record) in zip(simulate_batch(*zip(*pairs), workers=2), pairs):
        assert np.array_equal(response.outputs, single(rig, record).outputs)


def test_one_rig_goes_with_all_records_and_one_record_with_all_rigs():
    records, several = ppr_records(), rigs()
    by_record = simulate_batch(several[0], records)
    assert [len(r) for r in by_record] == [len(r.valve_signal) + 1 for r in records]
    by_rig = simulate_batch(several, records[0])
    assert np.array_equal(by_rig[1].force_n, single(several[1], records[0]).force_n)
    assert not np.array_equal(by_rig[1].force_n, by_rig[0].force_n)


def test_only_what_is_asked_for_is_kept():
    rig, record = rigs()[0], ppr_records()[0]
    whole = single(rig, record)
    response, = simulate_batch(rig, record, keep=('force_n', 'time_s'), every=7)
    assert response.outputs.shape == (STEPS // 7 + 1, 2)
    assert np.array_equal(response.force_n, whole.force_n[::7])
    assert np.array_equal(response.time_s, whole.time_s[::7])
    assert set(response.as_dict()) == {'force_n', 'time_s'}
    frame = response.to_dataframe()
    assert set(frame.columns) == {'force_n', 'time_s'} and len(frame) == len(response)
    assert np.array_equal(frame['force_n'], response.force_n)
    with pytest.raises(AttributeError, match='`pressure_pa` was not kept; kept: force_n, time_s'):
        response.pressure_pa
    few, = simulate_batch(rig, record, keep=('force_n',), every=7)
    assert repr(few) == f'Response({STEPS // 7 + 1} samples: force_n)'


def measured_signals():
    """Return samples off the grid of steps, the last at the very end."""
    time_s = np.concatenate([np.linspace(0.0, 0.149, 40), [0.15]])
    return [Measured('pressure_pa', time_s, np.full(41, 250e3), 1.0 / 300.0),
            Measured('contraction_m', time_s, np.linspace(0.0, 1e-3, 41), np.full(41, 1e5))]


def test_samples_are_linear_between_the_steps():
    for found, rig in zip(sample_batch(rigs(), ppr_records()[1], measured_signals()), rigs()):
        whole = single(rig, ppr_records()[1])
        for values, measured in zip(found, measured_signals()):
            wanted = np.interp(measured.time_s, whole.time_s, getattr(whole, measured.signal))
            np.testing.assert_allclose(values, wanted, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize('workers', [1, 3])
def test_residual_sums_are_those_of_the_samples(workers):
    records = ppr_records()
    sums = residual_sums(rigs(), records, measured_signals(), workers=workers)
    samples = sample_batch(rigs(), records, measured_signals())
    assert sums.shape == (3, 2)
    for row, found in zip(sums, samples):
        for total, values, m in zip(row, found, measured_signals()):
            np.testing.assert_allclose(
                total, np.sum((m.weight * (values - m.value)) ** 2), rtol=1e-12)
    assert np.array_equal(sums, residual_sums(rigs(), records, measured_signals(), workers=2))


def test_every_run_may_have_measurements_of_its_own():
    ours, theirs = measured_signals(), measured_signals()[:1]
    found = sample_batch(rigs()[0], ppr_records()[:2], [ours, theirs])
    assert [len(one) for one in found] == [2, 1]
    alone = sample_batch(rigs()[0], ppr_records()[0], theirs[0])        # one for all runs
    assert np.array_equal(alone[0][0], sample_batch(rigs()[0], ppr_records()[0], theirs)[0][0])


def test_a_mistake_names_its_run_whatever_the_workers():
    records = ppr_records() * 4
    for place in (5, 9):
        records[place] = Record(np.array([1.0, np.nan]))
    for workers in (1, 2, 4):
        with pytest.raises(InputError) as caught:
            simulate_batch(rigs()[0], records, workers=workers)
        assert caught.value.where == 'run 5: ppr_voltage'


def test_rigs_may_come_one_by_one_and_one_signal_by_its_name():
    record = ppr_records()[0]
    runs = simulate_batch((rig for rig in rigs()), record, keep='force_n')
    for run, rig in zip(runs, rigs(), strict=True):
        whole = simulate_batch(rig, record)[0]
        assert list(run.as_dict()) == ['force_n']
        assert (run.force_n == whole.force_n).all()


@pytest.mark.parametrize('make, words', [
    (lambda: simulate_batch(rigs(), ppr_records()[:2]), '3 rigs and 2 records'),
    (lambda: simulate_batch([], ppr_records()), '0 rigs'),
    (lambda: simulate_batch(rigs(), ppr_records(), keep=('speed',)), '`speed` is no signal'),
    (lambda: simulate_batch(rigs(), ppr_records(), every=0), 'every: is 0'),
    (lambda: simulate_batch(rigs(), [[4.0] * 10]),
     r'records: has \[4\.0, .*; a Record is needed for each run'),
    (lambda: simulate_batch({'heavy': rigs()[0]}, ppr_records()),
     "rigs: has 'heavy'; a Rig is needed for each run"),
    (lambda: simulate_batch(rigs(), ppr_records(), workers=0), 'workers: is 0'),
    (lambda: simulate_batch(rigs(), ppr_records(), every=1.5), 'every: is 1.5; a whole number'),
    (lambda: simulate_batch(rigs(), ppr_records(), workers=1.5),
     'workers: is 1.5; a whole number'),
    (lambda: residual_sums(rigs(), ppr_records(), []), 'measured: is empty'),
    (lambda: residual_sums(rigs(), ppr_records(), [measured_signals()]), '1 entries for 3 runs'),
    (lambda: residual_sums(rigs(), ppr_records(), [Measured('speed', [0.0], [0.0])]),
     'run 0: measured: `speed` is no signal'),
    (lambda: residual_sums(rigs(), ppr_records(), [Measured('force_n', [0.2], [0.0])]),
     r'run 1: force_n: `time_s` is 0.2; allowed 0 to 0.15 s'),
    (lambda: residual_sums(rigs(), ppr_records(), [Measured('force_n', [0.1], [0.0, 1.0])]),
     'equal ones are needed'),
    (lambda: residual_sums(rigs(), ppr_records(), [Measured('force_n', [0.1], [np.inf])]),
     'not finite'),
    (lambda: residual_sums(rigs(), ppr_records(), [Measured('force_n', [0.1], [1.0], [1, 2])]),
     '`weight` has shape'),
    (lambda: residual_sums(rigs(), ppr_records(), [*measured_signals(), measured_signals()]),
     'measured: has .*; give Measured for all runs, or a sequence of them for each'),
    (lambda: residual_sums(rigs(), ppr_records(), [3]), 'measured: has 3; give Measured for all'),
    (lambda: residual_sums(rigs(), ppr_records(), 3), 'measured: is 3; give a sequence'),
    (lambda: residual_sums(rigs(), ppr_records(), [Measured('force_n', 'x', [0.0])]),
     "run 0: force_n: `time_s` is no array of numbers: 'x'"),
    (lambda: residual_sums(rigs(), ppr_records(), [Measured('force_n', [0.1], [0.0], 'x')]),
     "run 0: force_n: `weight` is no array of numbers: 'x'"),
    (lambda: residual_sums(rigs(), Record([3.0], dt_s='x'), measured_signals()),
     "run 0: `dt_s` is 'x'; a number is needed"),
    (lambda: simulate_batch(rigs(), ppr_records(), keep=()), r'keep: is \(\); names of signals'),
    (lambda: simulate_batch(rigs(), ppr_records(), keep=3), 'keep: is 3; names of signals'),
])
def test_mistakes_are_refused_by_name(make, words):
    with pytest.raises(InputError, match=words):
        make()


def test_at_least_one_core_is_used():
    assert default_workers() >= 1


SCRIPT = """
import sys
import numpy as np
from pam_sim import load_rig
from pam_sim.rollout.batch import Record, residual_sums, simulate_batch
from pam_sim.rollout.sampling import Measured
rig = load_rig('dmsp_5_300_realistic')
records = [Record(np.full(60, v)) for v in (2.0, 3.0, 4.0)]
kept = simulate_batch(rig, records, workers=2, keep=('pressure_pa', 'force_n'))
sums = residual_sums(rig, records, [Measured('force_n', [0.0, 0.0123], [40.0, 41.0])])
np.save(sys.argv[1], np.concatenate([r.outputs.ravel() for r in kept] + [sums.ravel()]))
"""


def test_the_batch_is_the_same_with_the_compiler_off(tmp_path):
    compiled, interpreted = compiled_and_not(SCRIPT, tmp_path)
    assert np.array_equal(compiled, interpreted)
