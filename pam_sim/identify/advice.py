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

"""Which experiment would determine what the recordings leave open: predicted, not guessed."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
import math
from typing import Any

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.gap.data.noise import noise_sd
from pam_sim.gap.data.pressed import recorded_gauge_pa
from pam_sim.gap.data.signals import FIELD, UNIT
from pam_sim.gap.fit.profile import NORMAL_95
from pam_sim.gap.subsystems.simulation import pressure_driven
from pam_sim.identify.fit import NOWHERE, Weighted
from pam_sim.identify.judgement import is_narrow, UNDETERMINED
from pam_sim.identify.numbers import known_numbers_of, Number
from pam_sim.identify.profile import Interval
from pam_sim.identify.records import Offer, offer_of, problems_of
from pam_sim.rig import Rig
from pam_sim.run import Run, Series
from pam_sim.units import P_ATM_PA
from pam_sim.valve.ppr import voltage_v
from pam_sim.valve.reach import reach_gauge_pa

HIGH_PA, LOW_PA = 500e3, 50e3            # gauge
SAME_HEIGHT = 0.98           # of a pressure; an experiment this near to it goes no higher
RATE_HZ = 200.0
TYPICAL_NOISE = {'pressure': 500.0, 'contraction': 2e-5, 'force': 0.2}
# Neighbouring samples share their error; so many count as one.
MEMORY = 50.0


@dataclass(frozen=True)
class Proposal:
    """
    An experiment that might help.

    Parameters
    ----------
    name, why : str
    steps : list of (float, float)
        Gauge pressure [Pa] and duration [s].
    force : bool
        Whether a load cell is needed.
    added_kg : float
        To hang on the load.

    """

    name: str
    why: str
    steps: tuple[tuple[float, float], ...]
    force: bool = False
    added_kg: float = 0.0

    def experiment(self) -> dict[str, Any]:
        """Return it as an experiment in pressure for ``pam run``."""
        segments = [{'step': {'to_pa': P_ATM_PA + gauge, 'duration_s': duration}}
                    for gauge, duration in self.steps]
        return {'name': self.name, 'description': self.why, 'domain': 'pressure',
                'needs': ['pressure', 'contraction', *(['force'] if self.force else [])],
                'segments': segments}


def proposals(rig: Rig, has_force: bool, recorded_pa: float) -> list[Proposal]:
    """
    Return what could be measured on a rig, the least effort first.

    What goes above the highest pressure that was recorded, ``recorded_pa`` [Pa gauge], comes
    last and says so. Nothing goes above what the rig gives.
    """
    reach_pa = min(HIGH_PA, reach_gauge_pa(rig.valve, rig.parameters))
    within = _up_to(min(reach_pa, recorded_pa), rig, has_force)
    if recorded_pa >= SAME_HEIGHT * reach_pa:
        return within
    beyond = f' up to {1e-3 * reach_pa:.0f} kPa gauge; the recordings stayed below ' \
             f'{1e-3 * recorded_pa:.0f} kPa, so make sure that the rig bears it'
    return within + [replace(one, why=one.why + beyond)
                     for one in _up_to(reach_pa, rig, has_force)]


def _up_to(high_pa: float, rig: Rig, has_force: bool) -> list[Proposal]:
    """Return what could be measured on a rig up to a gauge pressure."""
    low_pa = min(LOW_PA, 0.25 * high_pa)
    up = [low_pa + k / 4 * (high_pa - low_pa) for k in range(5)]
    stairs = tuple((p, 1.5) for p in [*up, *up[-2::-1], 0.0])
    quick = tuple((p, d) for d in (0.6, 0.3) for p in (low_pa, high_pa, 0.5 * high_pa) * 4)
    found = [Proposal('stairs', 'a pressure that climbs and falls in steps', stairs),
             Proposal('quick_steps', 'quick steps of the pressure', quick)]
    if not has_force:
        found.append(Proposal('stairs_with_force', 'the same steps with a load cell', stairs,
                              True))
    if rig.load == 'hanging_mass':
        more = round(max(0.5, 0.4 * min(rig.parameters['mass_kg'], 10.0)), 1)
        found.append(Proposal(
            'stairs_with_more_mass', f'the same steps with {more:g} kg more on the load '
            f'(then: --added-kg)', stairs, has_force, more))
        if not has_force:
            found.append(Proposal(
                'stairs_with_more_mass_and_force', f'the same steps with {more:g} kg more on the '
                'load (then: --added-kg) and a load cell', stairs, True, more))
    return found


def where_open(numbers: Sequence[Number], intervals: Sequence[Interval], statuses: Sequence[str],
               x: FloatArray, information: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    Return coordinates and information from which an experiment can be predicted.

    The likeliest value may lie where the recording begins to depend on a number: a load that is
    just about to lift. There the curvature claims to know a number whose interval is wide. Such a
    number is put where it began, or at the end of its interval, and nothing is known of it.

    Parameters
    ----------
    numbers : list of Number
        The unknown ones.
    intervals : list of Interval
        Theirs.
    statuses : list of str
        Theirs, as of ``judge``.
    x : numpy.ndarray
        Coordinates of the solution, these numbers first.
    information : numpy.ndarray, shape (K, K)
        Of the unknown numbers, at the solution.

    """
    x, information = x.copy(), information.copy()
    covariance = np.linalg.inv(information + NOWHERE * np.eye(len(numbers)))
    for j, (n, interval) in enumerate(zip(numbers, intervals)):
        if statuses[j] == UNDETERMINED and _is_narrow_about(n, float(x[j]), covariance[j, j]):
            x[j] = n.coordinate(min(max(n.value(0.0), interval.low), interval.high))
            information[j] = information[:, j] = 0.0
    return x, information


def next_experiment(rig: Rig, wanted: Sequence[Number], acting: Sequence[Number],
                    information: FloatArray, offers: Sequence[Offer], has_force: bool,
                    progress: Callable[[float], object] = lambda done: None,
                    determined: Collection[str] = ()) -> dict[str, Any] | None:
    """
    Return the first experiment that determines all numbers, else the one that determines most.

    Parameters
    ----------
    rig : pam_sim.Rig
        With the numbers found.
    wanted, acting : list of Number
        All unknown ones, and those on which the recordings depend.
    information : numpy.ndarray, shape (K, K)
        Of the acting ones.
    offers : list of Offer
        The recordings.
    has_force : bool
        Whether there is a load cell.
    progress : callable
        Told the share that is done, 0 to 1.
    determined : iterable of str
        Names of the numbers that the recordings determine; no experiment is proposed for them.

    Returns
    -------
    dict or None
        ``name``, ``why``, ``determines``, ``experiment``, ``added_kg``, ``needs_force``.

    """
    whole = np.zeros((len(wanted), len(wanted)))
    places = [wanted.index(n) for n in acting]
    whole[np.ix_(places, places)] = information
    noise = _noise(offers)
    known_before = {*_narrow(rig, wanted, whole), *determined}
    best: tuple[int, Proposal, list[str]] | None = None
    offered = proposals(rig, has_force, recorded_gauge_pa(
        one.recording.measured['pressure'] for one in offers))
    for done, proposal in enumerate(offered):
        progress(done / len(offered))
        after = _narrow(rig, wanted, whole + _information(rig, wanted, proposal, noise))
        gained = [n for n in after if n not in known_before]
        if gained and (best is None or len(gained) > best[0]):
            best = (len(gained), proposal, gained)
        if len({*after, *determined}) == len(wanted):
            break
    if best is None:
        return None
    _, chosen, gained = best
    return {'name': chosen.name, 'why': f'{chosen.why}; it would determine {", ".join(gained)}',
            'determines': gained, 'experiment': chosen.experiment(),
            'added_kg': chosen.added_kg, 'needs_force': chosen.force}


def _narrow(rig: Rig, numbers: Sequence[Number], information: FloatArray) -> list[str]:
    """Return the names of the numbers whose predicted intervals are short."""
    covariance = np.linalg.inv(information + NOWHERE * np.eye(len(numbers)))
    found = []
    for j, n in enumerate(numbers):
        at = _value(rig, n)
        centre = n.coordinate(max(at, n.lower)) if not n.is_scale or at > 0.0 else 0.0
        if _is_narrow_about(n, centre, covariance[j, j]):
            found.append(n.name)
    return found


def _is_narrow_about(number: Number, centre: float, variance: float) -> bool:
    """Tell whether the interval that a variance of the coordinate predicts is short."""
    half = NORMAL_95 * math.sqrt(float(variance))
    return is_narrow(number, number.value(centre - half), number.value(centre + half))


def _value(rig: Rig, number: Number) -> float:
    if not number.effect:
        return rig.number(number.parameter)
    here = next((e for e in rig.effects if e.name == number.effect), None)
    return here.parameters[number.parameter] if here is not None else number.start


def _noise(offers: Sequence[Offer]) -> dict[str, float]:
    """Return the noise of each signal: as recorded, else a typical one."""
    found = dict(TYPICAL_NOISE)
    for one in offers:
        for s in dict.fromkeys(('pressure', *one.recording.signals)):
            found[s] = max(noise_sd(one.recording.measured[s]), 0.1 * TYPICAL_NOISE[s])
    return found


def _information(rig: Rig, numbers: Sequence[Number], proposal: Proposal,
                 noise: dict[str, float]) -> FloatArray:
    """Return what a simulated recording of the experiment would add."""
    try:
        offer = offer_of(_simulated(rig, proposal, noise), rig, proposal.added_kg)
    except InputError:          # it would lift nothing
        return np.zeros((len(numbers), len(numbers)))
    if rig.valve != 'ppr':
        # Its duties depend on the driver: only what muscle and load show is predicted.
        offer = Offer(offer.path, offer.recording, False, offer.mechanics, offer.kind,
                      offer.added_kg)
    problems = problems_of(rig, [offer])
    every = [*numbers, *known_numbers_of(problems, numbers)]
    weighted = Weighted(rig, problems, every, [
        np.full(len(p.signals), MEMORY) for p in problems])
    x = np.array([min(max(n.coordinate(max(_value(rig, n), n.lower)), lo), hi)
                  if n in numbers else 0.0 for n, lo, hi in zip(
                      every, weighted.low, weighted.high)])
    slopes = weighted.slopes(x)
    full = slopes.T @ slopes + NOWHERE * np.eye(x.size)
    count = len(numbers)
    own, cross, rest = full[:count, :count], full[:count, count:], full[count:, count:]
    return own - cross @ np.linalg.solve(rest, cross.T) if rest.size else own


def _simulated(rig: Rig, proposal: Proposal, noise: dict[str, float]) -> Run:
    """Return the experiment as a recording of the rig with noise."""
    ideal = rig if rig.valve == 'ppr' else pressure_driven(rig)
    voltage = np.concatenate([np.full(int(1000 * duration), voltage_v(gauge, ideal.parameters))
                              for gauge, duration in proposal.steps])
    if rig.load == 'hanging_mass' and proposal.added_kg:
        ideal = ideal.with_(parameters={
            'mass_kg': ideal.parameters['mass_kg'] + proposal.added_kg})
    response = ideal.simulate(
        voltage, contraction_m=np.zeros(voltage.size + 1) if rig.load == 'driven' else None)
    every = int(1000 / RATE_HZ)
    stamp = (np.asarray(response.time_s)[::every] * 1e9).astype(np.int64)
    random = np.random.default_rng(0)
    topics = {}
    for s in ('pressure', 'contraction', *(('force',) if proposal.force else ())):
        clean = np.asarray(getattr(response, FIELD[s]))[::every]
        topics[s] = Series(stamp, {FIELD[s]: clean + noise[s] * random.standard_normal(
            clean.size)}, {FIELD[s]: UNIT[s]})
    if rig.valve == 'ppr':
        topics['valve_signal'] = Series(
            stamp[:-1], {'ppr_voltage': voltage[::every][:stamp.size - 1]}, {'ppr_voltage': 'V'})
    return Run(topics=topics, path=proposal.name)
