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
The experiment that tells rivals apart, when a recording could not.

Every experiment of a small menu is simulated with the most likely rival as the truth. The others
are fitted to that simulated recording, with all parameters, and judged as `pam gap` will judge
them. Of the experiments that decide beyond doubt, the one that leaves the nearest of them farthest
off is the one to run (T-optimality: Atkinson and Fedorov, 1975, Biometrika 62(1)). One edge may
leave a rival far off and yet decide nothing: what time blocks agree on counts. A load cell is
asked for where none was there and the rivals stay together without it.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
import math
from pathlib import Path
import tempfile
from typing import Any, NamedTuple

import numpy as np

from pam_actuation.bags.load import load_run, RecordedRun
from pam_actuation.control.config import Controller
from pam_actuation.experiments.experiment import load_experiment
from pam_actuation.experiments.limits import highest_gauge_pa
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.experiments.separating_joint import InJoint, LOOPS
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.noise import sensor_floor
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.split import SELECT
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.select.comparison import gap, preference, share
from pam_sim.gap.subsystems.parallel import parallel_map
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.gap.subsystems.problems import subsystem_problems
from pam_sim.gap.subsystems.simulation import free_run
from pam_sim.located_yaml import dump_yaml
from pam_sim.rig import Rig
from pam_sim.run import Run
from pam_sim.units import P_ATM_PA

# Name -> what a piece shows, its segments as an experiment file has them.
Menu = dict[str, tuple[str, list[dict[str, dict[str, float]]]]]
Rival = tuple[str, Rig, Hypothesis, FloatArray]     # name, fitted model, hypothesis, parameters

HIGHEST_GAUGE_PA = 550e3     # of what a rig gives and recordings held; below the driver's limit
LOWEST_GAUGE_PA = 200e3      # a hanging mass of 5 kg has left its stop
NOISE = {'pressure': 300.0, 'contraction': 1e-5, 'force': 0.1}     # where nothing is recorded
SENSOR_NOISE = {'pressure': 'pressure_noise_pa', 'contraction': 'contraction_noise_m',
                'force': 'force_noise_n'}
PREFIX = 'tell_apart'
LEAST = 0.05                 # floors per sample; rivals that differ by less give the same signals
CLEAR = 1.0                  # floors per sample between rivals that need no further sensor
ALIKE = 1e-3                 # of normalised parameters: so near, two starts are one
SURE_T = 4.0                 # of a test on simulated data; the rig's own forms take a part of it
SURE_SHARE = 10.0 * CRITERIA.same_form_share


def lowest_gauge_pa(highest_pa: float) -> float:
    """Return the lowest pressure [Pa gauge] between moves up to a highest one."""
    return min(LOWEST_GAUGE_PA, 0.5 * highest_pa)


def within_reach(*rigs: Rig, recorded_pa: float = HIGHEST_GAUGE_PA) -> float:
    """
    Return the highest pressure [Pa gauge] that a proposed experiment asks for, in whole kPa.

    Parameters
    ----------
    rigs : pam_sim.Rig
        What is known of the rig. Driver, regulator and supply of each must give the pressure.
    recorded_pa : float
        The highest that recordings held, Pa gauge; nobody knows whether a muscle bears more.

    """
    return 1e3 * math.floor(1e-3 * min(
        HIGHEST_GAUGE_PA, recorded_pa, *(highest_gauge_pa(rig) for rig in rigs)))


def menu(valve: str, highest_pa: float = HIGHEST_GAUGE_PA) -> Menu:
    """
    Return name -> (what it shows, segments) of the menu for a valve; all begin at rest.

    No piece asks for more than ``highest_pa`` [Pa gauge].
    """
    low, high = P_ATM_PA + lowest_gauge_pa(highest_pa), P_ATM_PA + highest_pa
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    band = {'low_pa': low, 'high_pa': high}
    found: Menu = {
        'edges': ('sharp steps at random times show transport and speed', [
            {'random_steps': {**band, 'min_hold_s': 0.25, 'max_hold_s': 0.9,
                              'duration_s': 16.0, 'seed': 7}}]),
        'loops': ('slow loops of three sizes show what depends on the path', [
            {'triangle': {'low_pa': low, 'high_pa': low + size * (high - low),
                          'period_s': 9.0 * size, 'cycles': 1}} for size in LOOPS]),
        'bands': ('the same motion at a low and a high pressure shows what grows with it', [
            {'two_bands': {'low_center_pa': middle - 0.6 * half,
                           'high_center_pa': middle + 0.6 * half,
                           'amplitude_pa': 0.35 * half, 'frequency_hz': 0.5, 'cycles': 3,
                           'move_s': 1.5}}]),
        'speeds': ('the same path slowly and quickly shows what depends on speed', [
            {'triangle': {**band, 'period_s': 8.0, 'cycles': 1}},
            {'triangle': {**band, 'period_s': 1.2, 'cycles': 6}}]),
        'holds': ('long holds after steps show what drifts', [
            {'step': {'to_pa': high, 'duration_s': 7.0}},
            {'step': {'to_pa': low, 'duration_s': 7.0}}]),
        'frequencies': ('a multisine shows lags at every frequency', [
            {'multisine': {'center_pa': middle, 'amplitude_pa': 0.9 * half, 'min_hz': 0.1,
                           'max_hz': 4.0, 'lines': 12, 'duration_s': 16.0, 'seed': 8}}])}
    if valve == 'hsv':
        found['shut'] = ('with both valves shut only a leak changes the air in the muscle', [
            {'step': {'to_pa': high, 'duration_s': 3.0}}, {'decay': {'duration_s': 10.0}}])
    return found


def next_experiment(
        rig: Rig, rivals: Sequence[Rival], recorded: Collection[str],
        noise: Mapping[str, float],
        out_of_time: Callable[[], bool] = lambda: False,
        pieces: Collection[str] = (), may_add_cell: bool = True,
        recorded_pa: float = HIGHEST_GAUGE_PA,
        place: InJoint | None = None) -> dict[str, Any] | None:
    """
    Return the experiment that separates rivals best, as gap.json states it, or None.

    It is None where the rivals give the same signals in every experiment of the menu.

    Parameters
    ----------
    rig : pam_sim.Rig
        The given model.
    rivals : list of (str, pam_sim.Rig, Hypothesis, theta)
        Name, fitted model, hypothesis and its normalised parameters; the likeliest first.
    recorded : tuple of str
        Signals that were recorded.
    noise : dict of str -> float
        Standard deviation of the sensors, by signal.
    out_of_time : callable
        Returns whether to stop looking.
    pieces : sequence of str
        What of the menu is tried; all by default.
    may_add_cell : bool
        Whether a load cell that was not recorded may be asked for.
    recorded_pa : float
        The highest pressure that the recordings held, Pa gauge; the experiment stays below it.
    place : InJoint, optional
        The joint of which it is a muscle; the experiment is one of the joint then.

    """
    at = place or _Alone(rig.valve, within_reach(rig, rivals[0][1], recorded_pa=recorded_pa))
    known = at.menu()
    found = _tried(rig, rivals, {name: known[name] for name in pieces or known if name in known},
                   recorded, noise, out_of_time, may_add_cell, at)
    best = max(found, default=None)
    if best is None or best.sigma < LEAST:
        return None
    # The rig's own forms blur a part of what is told: the next best piece follows.
    others = [one for one in found if one.name != best.name and one.with_cell == best.with_cell]
    plain = _experiment(known, [best.name, *([max(others).name] if others else [])], at)
    needs = ['pressure', 'contraction', *(['force'] if best.with_cell else [])]
    names = [rival[0] for rival in rivals]
    text = (f'{plain["description"]}. Run with {names[0]} as the truth, the first part leaves '
            f'{" and ".join(names[1:])} off by {best.sigma:.2g} noise floors per sample after '
            f'refit. {at.limit}')
    if best.with_cell:
        text += ' It needs a load cell, which the recording does not have.'
    return {'name': plain['name'], 'why': text, 'separation_sigma': best.sigma,
            'needs': needs, 'experiment': {**plain, 'needs': needs}}


def cell_would_tell(rig: Rig, rivals: Sequence[Rival], noise: Mapping[str, float],
                    recorded_pa: float = HIGHEST_GAUGE_PA, place: InJoint | None = None) -> bool:
    """Return whether a load cell would tell rivals apart, by an experiment of the menu."""
    at = place or _Alone(rig.valve, within_reach(rig, rivals[0][1], recorded_pa=recorded_pa))
    return any(one.is_clear for piece in at.menu().items()
               for one in _tried(rig, rivals, dict([piece]), ('force',), noise, lambda: False,
                                 False, at))


@dataclass(frozen=True)
class _Alone:
    """A muscle of its own, and the highest pressure [Pa gauge] it may get."""

    valve: str
    highest_pa: float

    @property
    def limit(self) -> str:
        return f'The pressure rises to {1e-3 * self.highest_pa:.0f} kPa gauge at most.'

    def menu(self) -> Menu:
        return menu(self.valve, self.highest_pa)

    def begin(self) -> dict[str, Any]:
        return {'domain': 'pressure', 'low': {'step': {
            'to_pa': P_ATM_PA + lowest_gauge_pa(self.highest_pa), 'duration_s': 1.5}}}

    def simulated(self, plain: dict[str, Any], truth: Rig) -> RecordedRun:
        return simulated(plain, truth)


class _Tried(NamedTuple):
    """One piece of the menu, in the order of what is better."""

    is_clear: bool          # decides beyond doubt, without a further sensor
    certainty: float        # of that, 1 at most
    sigma: float            # noise floors per sample that the nearest rival is left off by
    name: str
    with_cell: bool


def _tried(rig: Rig, rivals: Sequence[Rival], pieces: Menu, recorded: Collection[str],
           noise: Mapping[str, float], out_of_time: Callable[[], bool], may_add_cell: bool,
           place: '_Alone | InJoint') -> list[_Tried]:
    """Return how well each piece separates the rivals; one that cannot run is left out."""
    truth = rivals[0][1].with_(sensors=_sensors(noise))
    runs: dict[str, RecordedRun] = {}
    found: list[_Tried] = []
    # A load cell that was not recorded is tried only where nothing is clear enough without it.
    for with_cell in (False, True) if may_add_cell and 'force' not in recorded else (False,):
        if any(one.is_clear for one in found):
            break
        for name in pieces:
            if out_of_time() and found:
                break
            try:
                if name not in runs:
                    runs[name] = place.simulated(_experiment(pieces, [name], place), truth)
                sigma, sure = separation(
                    runs[name], rig, rivals, with_cell or 'force' in recorded)
            except InputError:
                continue
            is_clear = not with_cell and sure >= 1.0 and sigma > CLEAR
            found.append(_Tried(is_clear, min(sure, 1.0), sigma, name, with_cell))
    return found


def not_played(valve: str, names: Collection[str]) -> tuple[str, ...]:
    """
    Return the pieces of the menu that experiments of this module have not shown yet.

    Parameters
    ----------
    valve : str
        ``ppr`` or ``hsv``.
    names : collection of str
        Names of experiments that were played; others than ours are passed over.

    """
    shown = {piece for name in names if name.startswith(f'{PREFIX}_')
             for piece in name.removeprefix(f'{PREFIX}_').split('_')}
    return tuple(piece for piece in menu(valve) if piece not in shown)


def _experiment(pieces: Menu, names: Sequence[str], place: '_Alone | InJoint') -> dict[str, Any]:
    """Return an experiment as plain data: rest, then pieces of the menu, each from below."""
    begin = place.begin()
    segments: list[dict[str, dict[str, float]]] = [{'rest': {'duration_s': 1.0}}]
    for name in names:
        segments += [begin['low'], *pieces[name][1]]
    text = '; '.join(pieces[name][0] for name in names)
    return {'name': '_'.join([PREFIX, *names]), 'domain': begin['domain'], 'segments': segments,
            'description': f'{text[0].upper()}{text[1:]}'}


def separation(run: Run, rig: Rig, rivals: Sequence[Rival],
               with_force: bool) -> tuple[float, float]:
    """
    Return how far the nearest rival stays off a run of the first, and how sure that decides.

    Parameters
    ----------
    run : pam_sim.run.Run
        What the first rival would record.
    rig : pam_sim.Rig
        The given model.
    rivals : list
        As of :func:`next_experiment`.
    with_force : bool
        Whether there is a load cell.

    Returns
    -------
    tuple of float
        Noise floors per sample (rms); the test between the two, and the share of the gap by
        which they differ, as parts of what is beyond doubt, whichever is less: 1 decides.

    """
    topics = {k: v for k, v in run.topics.items() if with_force or k != 'force'}
    recording = Recording(type(run)(topics, run.metadata, run.namespace, run.path), rig.valve,
                          rig.is_driven)
    apart = _apart(recording, [model for _, model, _, _ in rivals])
    if apart < LEAST:           # a refit brings them nearer still
        return apart, 0.0
    estimator = Estimator(rig, subsystem_problems(rig, [recording], certify_runs=0))
    first, *others = _fitted(estimator, rivals)
    for problem in estimator.problems:
        # As in the search: where the floor is careful, gaps would begin above what the truth left.
        s = problem.subsystem
        problem.level = min([problem.level] + [
            problem.chi2(f.errors[s], SELECT) for f in (first, *others)])
    nearest = decided = np.inf
    for other in others:
        # What the first leaves too, where no fit reaches the floor, is no difference.
        nearest = min(nearest, np.sqrt(sum(
            max(gap(c, other.errors[c.subsystem]) - gap(c, first.errors[c.subsystem]), 0.0)
            for c in estimator.problems)))
        decided = min(decided, max(_decided(estimator, c, first, other)
                                   for c in estimator.problems))
    return float(nearest), float(decided)


def _apart(recording: Recording, models: Sequence[Rig]) -> float:
    """Return how far the model nearest to the first is off it, in floors of the sensors (rms)."""
    first, *others = (free_run(model, recording) for model in models)
    floors = {s: sensor_floor(recording.time_s[s], recording.measured[s], s) for s in first}
    return min(math.sqrt(sum(float(np.mean(((other[s] - first[s]) / floor) ** 2))
                             for s, floor in floors.items())) for other in others)


def _fitted(estimator: Estimator, rivals: Sequence[Rival]) -> list[Fit]:
    """
    Return the best fit of every rival.

    Those with the same parameters begin alike: where a fit ends must not tell them apart.
    """
    def best(rival: Rival) -> Fit:
        hypothesis, starts = rival[2], list[FloatArray]()
        for _, _, like, theta in rivals:
            if _parameters(like) == _parameters(hypothesis) and not any(
                    np.allclose(theta, known, ALIKE, ALIKE) for known in starts):
                starts.append(theta)
        return min(parallel_map(lambda theta: estimator.fit(hypothesis, theta), starts),
                   key=estimator.cost)

    return parallel_map(best, rivals)


def _parameters(hypothesis: Hypothesis) -> list[tuple[str, ...]]:
    return [tuple(f.name for f in c.free) for c in hypothesis.effects]


def _decided(estimator: Estimator, problem: SubsystemProblem, first: Fit,
             other: Fit) -> float:
    s = problem.subsystem
    base = estimator.base.errors[s]
    t = np.nan_to_num(preference(problem, base, first.errors[s], other.errors[s]))
    apart = share(problem, base, first.errors[s]) - share(problem, base, other.errors[s])
    return min(t / SURE_T, apart / SURE_SHARE)


def identification_run(rig: Rig) -> RecordedRun:
    """Return a simulated run of the experiment ``pressure_identification`` with sensor noise."""
    return simulated(load_experiment('pressure_identification').to_dict(), sensors_for(rig)[1])


def sensors_for(rig: Rig) -> tuple[dict[str, float], Rig]:
    """Return (noise by signal, the rig with it): its own, else that of the realistic rig."""
    own = {s: rig.sensors.get(name, 0.0) for s, name in SENSOR_NOISE.items()}
    noise = {s: own[s] or NOISE[s] for s in NOISE}
    return noise, rig.with_(sensors=_sensors(noise))


def _sensors(noise: Mapping[str, float]) -> dict[str, float]:
    return {name: noise.get(s, NOISE[s]) for s, name in SENSOR_NOISE.items()}


def simulated(plain: dict[str, Any], rig: Rig,
              controller: Controller | None = None) -> RecordedRun:
    """Return the simulated run of an experiment, given as plain data."""
    with tempfile.TemporaryDirectory(prefix='pam_separating_') as folder:
        simulate_experiment(load_experiment(dump_yaml(plain)), rig, controller,
                            Path(folder) / 'bag')
        return load_run(Path(folder) / 'bag')
