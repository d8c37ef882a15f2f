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
What a term of the valve does to its pressure, to first order, from one simulation of the model.

A term changes the pressure a little in every step. In each further step the change decays. Behind
a regulator it does because the pressure follows the set point. Through an open valve it does
because the flow falls as the pressure nears that of the other side. A simulated run tells both, so
the response to many terms costs no further simulation. It is near enough to tell which terms are
worth one.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.compiled import entry_point
from pam_sim.effects.unnamed import flow_term, set_point_term, terms
from pam_sim.gap.data.recording import GRID_S
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.propose.factors import columns_of, EVERY
from pam_sim.gap.propose.library import Term
from pam_sim.gap.subsystems.known import of_run
from pam_sim.gap.subsystems.parallel import parallel_map
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.gap.subsystems.pulses import pulses_of
from pam_sim.response import Response
from pam_sim.rig import Rig
from pam_sim.units import P_ATM_PA

STEP_S = EVERY * GRID_S
SIMULATED = 16               # effort: so many terms that promise most are simulated
SIMULATED_ALIKE = 3          # of them with the same factors
NEAR_EQUAL_PA = 100.0        # pressures nearer than that count as that far apart


@dataclass(frozen=True)
class PressureResponse:
    """
    One simulated recording, every tenth step.

    Parameters
    ----------
    inputs : dict of str -> numpy.ndarray, shape (N,)
        By symbol what terms may depend on.
    time_s : numpy.ndarray, shape (N,)
        Since the start of the recording.
    kept : numpy.ndarray, shape (N,)
        Share of a change that is left after the step.
    pushed : dict of int -> numpy.ndarray, shape (N,)
        By channel what a term of 1 adds within the step: Pa, or kg of air.
    pressure : numpy.ndarray, shape (N,)
        Change of the pressure [Pa] by a change of 1.

    """

    inputs: dict[str, FloatArray]
    time_s: FloatArray
    kept: FloatArray
    pushed: dict[int, FloatArray]
    pressure: FloatArray

    def to(self, term: Term, symbols: Sequence[str], time_s: FloatArray) -> list[FloatArray]:
        """Return the changes of the pressure by a term of 1 at some instants; of a wave two."""
        found: list[FloatArray] = []
        for column in columns_of(term, self.inputs, self.time_s, symbols):
            change = np.empty_like(column)
            follow(self.kept, self.pushed[term.channel.number] * column, change)
            found.append(np.interp(time_s, self.time_s, self.pressure * change))
        return found


@entry_point
def follow(kept: FloatArray, pushed: FloatArray, change: FloatArray) -> None:
    """Fill ``change``, which loses a share in every step and is pushed."""
    now = 0.0
    for k in range(kept.size):
        change[k] = now
        now = kept[k] * now + pushed[k]


def responses_of(estimator: Estimator, problem: SubsystemProblem, now: Fit
                 ) -> list[PressureResponse]:
    """Return the PressureResponse of each recording of the valve's problem at a fit."""
    rig, numbers = problem.calibrated(
        estimator.with_effects(now.settings()), now.known_z[problem.subsystem])
    found = []
    for index, run in enumerate(problem.responses(rig, numbers)):
        if rig.valve == 'ppr':
            found.append(_regulated(rig, run))
        else:
            signal = problem.recordings[index].valve_signal(
                numbers[of_run('latency', index)], None, pulses_of(rig))
            found.append(_filled(rig, run, signal))
    return found


def _common(run: Response) -> tuple[dict[str, FloatArray], FloatArray]:
    count = (len(run) - 1) // EVERY
    time_s = STEP_S * np.arange(count)
    return {'p': _mean(run.true_pressure_pa[1:]) - P_ATM_PA,
            'x': _mean(run.true_contraction_m[1:]), 't': time_s}, time_s


def _regulated(rig: Rig, run: Response) -> PressureResponse:
    """Return the response behind a regulator: a first-order lag."""
    inputs, time_s = _common(run)
    kept = float(np.exp(-GRID_S / rig.parameters['T_m']))
    p = run.true_pressure_pa
    aim = _mean((p[1:] - kept * p[:-1]) / (1.0 - kept)) - P_ATM_PA
    inputs |= {'s': aim, 'e': aim - inputs['p']}
    left = np.full(time_s.size, kept ** EVERY)
    return PressureResponse(inputs, time_s, left, {
        set_point_term.AIM: 1.0 - left,
        set_point_term.QUICKNESS: STEP_S / rig.parameters['T_m'] * left * inputs['e']},
        np.ones(time_s.size))


def _filled(rig: Rig, run: Response, signal: FloatArray) -> PressureResponse:
    """Return the response behind on/off valves: a mass of air with flows in and out."""
    inputs, time_s = _common(run)
    p = inputs['p'] + P_ATM_PA
    inflow, outflow = (_mean(np.diff(flow)) / GRID_S for flow in (run.filled_kg, run.vented_kg))
    inputs |= {'a': _mean(signal[:, 0]), 'b': _mean(signal[:, 1])}
    critical, supply = rig.parameters['b'], _mean(run.supply_pa[1:])
    falls = inflow * _by_downstream(supply, p, critical) - outflow * _by_upstream(p, critical)
    per_kg = p / _mean(run.air_mass_kg[1:])
    return PressureResponse(inputs, time_s, np.exp(STEP_S * np.minimum(falls * per_kg, 0.0)), {
        flow_term.NET: np.full(time_s.size, STEP_S * flow_term.FLOW_SCALE),
        flow_term.FILL: STEP_S * inflow, flow_term.VENT: -STEP_S * outflow}, per_kg)


def _by_downstream(upstream: FloatArray, downstream: FloatArray, critical: float) -> FloatArray:
    """Return the relative change of a flow by its downstream pressure [1/Pa], ISO 6358."""
    drop = np.maximum(upstream - downstream, NEAR_EQUAL_PA)
    slope = 0.5 * (1.0 / ((1.0 - 2.0 * critical) * upstream + downstream) - 1.0 / drop)
    return np.where(downstream <= critical * upstream, 0.0, slope)


def _by_upstream(upstream: FloatArray, critical: float) -> FloatArray:
    """Return the same by its upstream pressure, into the atmosphere."""
    drop = np.maximum(upstream - P_ATM_PA, NEAR_EQUAL_PA)
    share = 1.0 - 2.0 * critical
    slope = 0.5 * (1.0 / drop + share / (share * upstream + P_ATM_PA))
    return np.where(P_ATM_PA <= critical * upstream, 1.0 / upstream, slope)


def _mean(values: FloatArray) -> FloatArray:
    """Return the means of every ten steps."""
    count = len(values) // EVERY
    found: FloatArray = values[:count * EVERY].reshape(count, EVERY).mean(axis=1)
    return found


def worth_a_run(library_terms: Sequence[Term], symbols: Sequence[str], problem: SubsystemProblem,
                runs: Sequence[PressureResponse], free: Callable[[FloatArray], FloatArray],
                left: FloatArray) -> list[Term]:
    """
    Return the terms whose response promises most, and those that have none: what swings.

    Parameters
    ----------
    library_terms : sequence of Term
        All there are.
    symbols : sequence of str
        Of their inputs.
    problem : SubsystemProblem
        The valve, whose errors they are to explain.
    runs : sequence of PressureResponse
        Of its recordings.
    free : callable
        ``free(change)``: a change of the pressure, weighted, less what numbers can do.
    left : numpy.ndarray
        The errors, likewise.

    """
    def rest(term: Term) -> float:
        by_run = [run.to(term, symbols, problem.time_s[problem.run == index])
                  for index, run in enumerate(runs)]
        matrix = np.column_stack([free(np.concatenate(c)) for c in zip(*by_run)])
        amounts, *_ = np.linalg.lstsq(matrix, -left, rcond=None)
        y = left + matrix @ amounts
        return float(y @ y)

    told = [term for term in library_terms if term.one.kind != terms.SWING]
    rests = dict(zip(told, parallel_map(rest, told)))
    kept: set[Term] = set()
    count: dict[object, int] = {}
    for term in sorted(told, key=lambda t: rests[t]):
        if count.get(term.factors, 0) < SIMULATED_ALIKE and len(kept) < SIMULATED:
            kept.add(term)
            count[term.factors] = count.get(term.factors, 0) + 1
    return [term for term in library_terms if term in kept or term not in rests]
