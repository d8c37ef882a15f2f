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
Remember simulations and fits of `pam gap`, to search one case many times.

Searches with other thresholds repeat most fits of the usual one with the same inputs.
``remembered`` keeps their results while one case is searched. A key holds every input: the bytes
of all arrays, and the recordings by identity. So a remembered answer is the computed one to the
bit. ``python benchmarks/criteria_ablation.py --check`` compares both.
"""

from collections import OrderedDict
from contextlib import contextmanager
import hashlib
import threading
from unittest import mock

import numpy as np

from pam_sim.gap import workflow
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.gap.verify import model, validation

MOST_BYTES = 2 << 30


class Memory:
    """Results by the digest of their inputs; those not used for longest are dropped."""

    def __init__(self, most_bytes=MOST_BYTES):
        self.most_bytes, self.bytes, self.lock = most_bytes, 0, threading.RLock()
        self.found, self.digests, self.recordings = OrderedDict(), {}, {}
        self.hits = self.misses = 0

    def recall(self, key, compute):
        """Return what is remembered under a key, or else compute it."""
        with self.lock:
            if key in self.found:
                self.hits += 1
                self.found.move_to_end(key)
                return self.found[key][0]
        self.misses += 1
        result = compute()
        with self.lock:
            size = size_of(result)
            if key not in self.found:
                self.found[key] = (result, size)
                self.bytes += size
            while self.bytes > self.most_bytes:
                self.bytes -= self.found.popitem(last=False)[1][1]
        return result

    def digest(self, array):
        """Return the digest of an array, taken once as long as it lives here."""
        with self.lock:
            kept = self.digests.get(id(array))
            if kept is None:
                data = np.ascontiguousarray(array)
                kept = (array, hashlib.blake2b(
                    data.view(np.uint8).data, digest_size=16).digest() + str(
                        (data.shape, data.dtype)).encode())
                if len(self.digests) > 100:      # each keeps its array alive
                    self.digests.clear()
                self.digests[id(array)] = kept
            return kept[1]

    def arrays(self, by_name):
        """Return the digests of arrays by name."""
        return tuple((name, self.digest(array)) for name, array in sorted(by_name.items()))

    def fit(self, fit):
        """Return a key of all that a fit holds."""
        return (fit.hypothesis, np.asarray(fit.theta, float).tobytes(), self.arrays(fit.known_z),
                self.arrays(fit.errors), self.arrays(fit.temper))


def size_of(result):
    """Return about how many bytes a result takes."""
    if isinstance(result, np.ndarray):
        return result.nbytes
    if isinstance(result, Fit):
        return sum(a.nbytes for d in (result.known_z, result.errors, result.temper)
                   for a in d.values())
    if isinstance(result, tuple):
        return sum(map(size_of, result))
    return sum(map(size_of, result.values())) if isinstance(result, dict) else 1000


def rig_key(rig):
    """Return a key of all numbers of a rig."""
    return (rig.name, rig.load, rig.valve, rig.fidelity, tuple(sorted(rig.parameters.items())),
            tuple((e.name, tuple(sorted(e.parameters.items()))) for e in rig.effects),
            tuple(sorted(rig.sensors.items())), tuple(sorted(rig.tolerance.items())),
            repr(rig.muscle))


def copy_of(fit):
    """Return a fit whose dictionaries and parameters are its own."""
    return Fit(fit.hypothesis, np.array(fit.theta), dict(fit.known_z), dict(fit.errors),
               dict(fit.temper))


@contextmanager
def remembered(memory):
    """Let the workflow remember what it simulates and fits within the block."""
    errors, floors, fit = SubsystemProblem.errors, SubsystemProblem._floors, Estimator.fit
    fit_base, free_run = Estimator.fit_base, model.free_run

    def problem_key(problem):
        # Nothing here depends on the parts of the data that the recordings are split into.
        return problem.subsystem, tuple(map(id, problem.recordings)), problem.part.size

    def errors_of(problem, rig, known_z):
        key = 'errors', problem_key(problem), rig_key(rig), known_z.tobytes()
        return memory.recall(key, lambda: errors(problem, rig, known_z))

    def floors_of(problem, rig, seed):
        key = 'floors', problem_key(problem), rig_key(rig), seed
        return dict(memory.recall(key, lambda: floors(problem, rig, seed)))

    def estimator_key(estimator):
        return (tuple(map(problem_key, estimator.problems)), rig_key(estimator.rig),
                memory.arrays(estimator.slopes), estimator.use, float(estimator.box))

    def base_of(estimator):
        def fitted():
            return fit_base(estimator), dict(estimator.slopes)
        found, slopes = memory.recall(('base', estimator_key(estimator)), fitted)
        estimator.slopes = dict(slopes)
        return copy_of(found)

    def fit_of(estimator, hypothesis, theta=(), near=None, hold=False, whole=True, **rounds):
        key = ('fit', estimator_key(estimator), memory.fit(estimator.base), hypothesis,
               np.asarray(theta, float).tobytes(), near is None or near is estimator.base,
               None if near is None else memory.fit(near), hold, whole, tuple(rounds.items()))
        return copy_of(memory.recall(key, lambda: fit(
            estimator, hypothesis, theta, near, hold, whole, **rounds)))

    def run_of(rig, recording, delay_s=0.0, stamp_shift_s=None, start_error_pa=0.0, late_s=None):
        key = ('run', rig_key(rig), id(recording), float(delay_s),
               None if stamp_shift_s is None else memory.digest(stamp_shift_s),
               float(start_error_pa), tuple(sorted((late_s or {}).items())))
        return dict(memory.recall(key, lambda: free_run(
            rig, recording, delay_s, stamp_shift_s, start_error_pa, late_s)))

    def recording_of(run, valve, driven):
        key = id(run), valve, driven
        if key not in memory.recordings:
            memory.recordings[key] = run, Recording(run, valve, driven)
        return memory.recordings[key][1]

    with mock.patch.object(SubsystemProblem, 'errors', errors_of), \
            mock.patch.object(SubsystemProblem, '_floors', floors_of), \
            mock.patch.object(Estimator, 'fit', fit_of), \
            mock.patch.object(Estimator, 'fit_base', base_of), \
            mock.patch.object(model, 'free_run', run_of), \
            mock.patch.object(validation, 'free_run', run_of), \
            mock.patch.object(workflow, 'Recording', recording_of):
        yield memory
