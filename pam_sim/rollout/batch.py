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
Many simulations at once: parameter sets on records, on all cores.

The compiled rollout holds no lock, so threads share the work. Each takes the next run when it has
done one, and reuses one buffer. Memory therefore grows with what is kept, not with what is
simulated. A run does not depend on the others: results equal those of ``Rig.simulate`` to the bit,
in order, with any number of workers.
"""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
import os
import threading
from typing import Any, TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from pam_sim.annotations import FloatArray
from pam_sim.declared import check_whole, number_of, shown
from pam_sim.errors import InputError
from pam_sim.records import size_of
from pam_sim.response import COLUMNS, Response
from pam_sim.rollout import kernel
from pam_sim.rollout.layout import OUTPUT
from pam_sim.rollout.sampling import Measured, Placed
from pam_sim.rollout.simulate import check_outputs, prepare
from pam_sim.short_repr import short_repr
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_sim.rig import Rig


@short_repr
@dataclass(frozen=True, eq=False)
class Record:
    """
    What one simulation is given; fields as the arguments of ``Rig.simulate``.

    Parameters
    ----------
    valve_signal : array_like, shape (N,) or (N, 2)
        PPR voltage [V], or HSV fill and vent duty [0..1].
    external_force_n, contraction_m, initial_contraction_m, initial_signal : optional
    initial_pressure_pa : float
        Absolute, Pa.
    dt_s : float
        Step, s.

    """

    valve_signal: ArrayLike
    external_force_n: ArrayLike | None = None
    contraction_m: ArrayLike | None = None
    initial_pressure_pa: float = P_ATM_PA
    dt_s: float = 0.001
    initial_contraction_m: float | None = None
    initial_signal: ArrayLike | None = None

    def prepare(self, rig: 'Rig') -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return (state, par, inputs) of the rollout with a rig."""
        return prepare(rig, self.valve_signal, self.external_force_n, self.contraction_m,
                       self.dt_s, {'initial_pressure_pa': self.initial_pressure_pa,
                                   'initial_contraction_m': self.initial_contraction_m,
                                   'initial_signal': self.initial_signal})


# Returns function(shared, item) of every item, in order; as ``pam_actuation.workers.Workers.map``.
Spread = Callable[[Callable[[Any, Any], Any], Any, list[Any]], list[Any]]
TASK_RUNS = 8       # runs of a task that leaves this process
# For all runs the same signals, or a sequence of signals for each.
AllMeasured = Measured | Sequence[Measured] | Sequence[Sequence[Measured]]


def simulate_batch(rigs: 'Rig | list[Rig] | tuple[Rig, ...]',
                   records: Record | list[Record] | tuple[Record, ...], workers: int | None = None,
                   keep: str | Sequence[str] | None = None, every: int = 1,
                   spread: Spread | None = None) -> list[Response]:
    """
    Simulate many runs.

    Parameters
    ----------
    rigs : Rig or sequence of Rig
        The parameter sets.
    records : Record or sequence of Record
        Rigs and records of equal number go in pairs; one of either goes with all of
        the other. For every rig on every record, pair them with ``itertools.product``.
    workers : int, optional
        Threads; by default one per core this process may use.
    keep : str or sequence of str, optional
        Signals of the Response to keep, for instance ``('pressure_pa', 'force_n')``;
        all by default.
    every : int
        Keep the start and each so many steps after it.
    spread : callable, optional
        Runs tasks elsewhere, such as ``Workers(cluster='tcp://host:8786').map`` within its
        block. Rigs travel once, a task is a few runs. The bits stay the same.

    Returns
    -------
    list of Response
        One per run, in order.

    Raises
    ------
    InputError
        As of ``Rig.simulate``, with the number of the run, counted from 0; numbers of
        rigs and records that do not fit, or something else in place of one; an unknown
        signal; ``every`` or ``workers`` that is no whole number from 1 on.

    """
    keep = (keep,) if isinstance(keep, str) else keep
    if keep is not None and not (isinstance(keep, Iterable) and (keep := tuple(keep))):
        raise InputError(f'is {shown(keep)}; names of signals are needed', 'keep')
    names = tuple(COLUMNS) if keep is None else keep
    for name in names:
        if name not in COLUMNS:
            raise InputError(f'`{name}` is no signal; allowed: {", ".join(COLUMNS)}', 'keep')
    check_whole(every, 1, 'every')
    places = {name: place for place, name in enumerate(names)}
    if spread is not None:
        pairs = _pairs(rigs, records)
        starts = list(range(0, len(pairs), TASK_RUNS))
        return [one for some in spread(_some, (pairs, keep, every), starts) for one in some]

    def kept(index: int, outputs: FloatArray) -> Response:
        rows = outputs[::every]
        if keep is None:
            return Response(rows.copy())
        chosen = np.empty((len(names), len(rows)))
        for place, name in enumerate(names):
            chosen[place] = rows[:, COLUMNS[name]]
        return Response(chosen.T, places)

    return _run_all(_pairs(rigs, records), kept, workers)


def _some(given: 'tuple[list[tuple[Rig, Record]], Sequence[str] | None, int]',
          start: int) -> list[Response]:
    """Simulate a few of many runs, the task of ``simulate_batch`` elsewhere."""
    pairs, keep, every = given
    few = pairs[start:start + TASK_RUNS]
    responses = []
    for number, (rig, record) in enumerate(few, start):
        try:
            responses += simulate_batch(rig, record, 1, keep, every)
        except InputError as error:
            place = error.where.removeprefix('run 0').removeprefix(': ')
            raise _of_run(number, InputError(error.problem, place)) from None
    return responses


def sample_batch(rigs: 'Rig | list[Rig]', records: Record | list[Record],
                 measured: AllMeasured,
                 workers: int | None = None) -> list[tuple[FloatArray, ...]]:
    """
    Simulate many runs and return only the simulated values at the measured instants.

    Parameters
    ----------
    rigs, records, workers
        As of :func:`simulate_batch`.
    measured : Measured, sequence of Measured, or sequence of such sequences
        What every run is compared with, or one sequence per run.

    Returns
    -------
    list of tuple of numpy.ndarray
        Per run one array per ``Measured``, linear between the steps.

    Raises
    ------
    InputError
        As of :func:`simulate_batch`; an instant outside the record; ``measured`` of another
        form.

    """
    pairs = _pairs(rigs, records)
    places = _placed(measured, pairs)

    def sampled(index: int, outputs: FloatArray) -> tuple[FloatArray, ...]:
        return tuple(place.sample(outputs) for place in places[index])

    return _run_all(pairs, sampled, workers)


def residual_sums(rigs: 'list[Rig]', records: list[Record],
                  measured: AllMeasured,
                  workers: int | None = None) -> FloatArray:
    """
    Simulate many runs and return only the weighted sums of squared residuals.

    Arguments and errors as of :func:`sample_batch`.

    Returns
    -------
    numpy.ndarray, shape (runs, signals)
        Sum of (weight (simulated - measured))^2 of every ``Measured``.

    """
    pairs = _pairs(rigs, records)
    places = _placed(measured, pairs)

    def summed(index: int, outputs: FloatArray) -> list[float]:
        return [place.residual_sum(outputs) for place in places[index]]

    return np.array(_run_all(pairs, summed, workers))


def default_workers() -> int:
    """
    Return PAM_THREADS of the environment, by default the cores this process may use.

    Raises
    ------
    InputError
        It is no whole number from 1 on.

    """
    given = os.environ.get('PAM_THREADS', '')
    if given:
        if not given.isdecimal() or int(given) < 1:
            raise InputError(f'is {given!r}; a whole number, 1 or more, is needed', 'PAM_THREADS')
        return int(given)
    if hasattr(os, 'sched_getaffinity'):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _pairs(
        rigs: 'Rig | list[Rig] | tuple[Rig, ...]',
        records: Record | list[Record] | tuple[Record, ...]) -> 'list[tuple[Rig, Record]]':
    """Return the (rig, record) of every run."""
    from pam_sim.rig import Rig
    rigs = list(rigs) if isinstance(rigs, Iterable) else [rigs]
    records = list(records) if isinstance(records, Iterable) else [records]
    for given, kind, name in ((rigs, Rig, 'rigs'), (records, Record, 'records')):
        for one in given:
            if not isinstance(one, kind):
                raise InputError(
                    f'has {shown(one)}; a {kind.__name__} is needed for each run', name)
    count = max(len(rigs), len(records))
    if min(len(rigs), len(records)) == 0 or {len(rigs), len(records)} - {1, count}:
        raise InputError(f'{len(rigs)} rigs and {len(records)} records; equal numbers or one of '
                         'either expected', 'batch')
    return list(zip(rigs * (count // len(rigs)), records * (count // len(records))))


def _placed(measured: AllMeasured, pairs: 'list[tuple[Rig, Record]]') -> list[list[Placed]]:
    """Return per run the measured signals with their places between the steps."""
    if isinstance(measured, Measured):
        measured = [measured]
    if not isinstance(measured, Sequence):
        raise InputError(f'is {shown(measured)}; give a sequence of Measured', 'measured')
    if not measured:
        raise InputError('is empty; at least one signal is needed', 'measured')
    same = [one for one in measured if isinstance(one, Measured)]
    each = [one for one in measured if not isinstance(one, Measured)]
    for one in each:
        if same or not (isinstance(one, Sequence)
                        and all(isinstance(signal, Measured) for signal in one)):
            raise InputError(f'has {shown(one)}; give Measured for all runs, or a sequence of '
                             'them for each', 'measured')
    of_runs: Sequence[Sequence[Measured]] = [same] * len(pairs) if same else each
    if len(of_runs) != len(pairs):
        raise InputError(f'has {len(of_runs)} entries for {len(pairs)} runs', 'measured')
    known: dict[tuple[int, int, float], list[Placed]] = {}
    placed = []
    for index, ((_, record), signals) in enumerate(zip(pairs, of_runs)):
        try:
            key = (id(signals), len(np.atleast_1d(np.asarray(record.valve_signal))),
                   number_of(record.dt_s, 'dt_s'))
            if key not in known:
                known[key] = [Placed(one, *key[1:]) for one in signals]
        except InputError as error:
            raise _of_run(index, error) from None
        placed.append(known[key])
    return placed


def _run_all(pairs: 'list[tuple[Rig, Record]]', finish: Callable[[int, FloatArray], Any],
             workers: int | None) -> list[Any]:
    """Return ``finish(index, outputs)`` of every run, in order."""
    workers = default_workers() if workers is None else workers
    check_whole(workers, 1, 'workers')
    workers = min(workers, len(pairs))
    results: list[Any] = [None] * len(pairs)
    errors: dict[int, InputError] = {}
    stop = threading.Event()
    queue = iter(range(len(pairs)))     # taking the next is atomic

    def work() -> None:
        buffer = np.empty((0, size_of(OUTPUT)))
        for index in queue:
            # A run before the first mistake is still made: it may hold an earlier one.
            if stop.is_set() or index > min(tuple(errors), default=index):
                return
            rig, record = pairs[index]
            try:
                state, par, inputs = record.prepare(rig)
                if len(buffer) <= len(inputs):
                    buffer = np.empty((len(inputs) + 1, size_of(OUTPUT)))
                outputs = buffer[:len(inputs) + 1]
                check_outputs(rig, outputs, kernel.entries_for(par).rollout(
                    state, par, inputs, outputs))
                results[index] = finish(index, outputs)
            except InputError as error:
                errors[index] = error

    if workers == 1:
        work()
    else:
        with ThreadPoolExecutor(workers) as pool:
            try:
                for done in [pool.submit(work) for _ in range(workers)]:
                    done.result()
            finally:
                stop.set()
    if errors:
        first = min(errors)
        raise _of_run(first, errors[first])
    return results


def _of_run(index: int, error: InputError) -> InputError:
    """Return the error with the number of its run."""
    return InputError(error.problem, f'run {index}: {error.where}' if error.where
                      else f'run {index}')
