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
Plan a measurement: which effects protocols could tell apart on a rig, and the best 60 s.

Pieces of some seconds, each made to show one kind of effect, are simulated once. Every choice of
them that fits into a minute is judged by the smallest sizes at which it would show and name the
effects (:mod:`pam_sim.gap.plan`). The best one becomes an experiment, is simulated as a whole and
judged again.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import combinations
from typing import Any

from pam_actuation.control.config import load_controller
from pam_actuation.control.modes.files import preset_for
from pam_actuation.experiments.experiment import Experiment, load_experiment
from pam_actuation.experiments.separating import (
    HIGHEST_GAUGE_PA, lowest_gauge_pa, sensors_for, simulated, within_reach)
from pam_sim.errors import InputError
from pam_sim.gap.data.health import check_for
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.signals import READABLE
from pam_sim.gap.plan.outlook import in_proportion, least_factors, Outlook, outlooks, score
from pam_sim.gap.plan.sensitivity import Sensitivities
from pam_sim.located_yaml import dump_yaml
from pam_sim.rig import Rig
from pam_sim.units import behind_number, P_ATM_PA

Segments = list[dict[str, dict[str, float]]]      # as an experiment file has them

LONGEST_S = 60.0
START_S, BETWEEN_S = 2.5, 1.0
NAME = 'planned_60s'


@dataclass
class Planned:
    """
    One protocol as judged.

    Parameters
    ----------
    name : str
    duration_s : float
    outlooks : list of pam_sim.gap.plan.Outlook
    score : float
        See :func:`pam_sim.gap.plan.score`.
    experiment : dict
        As :func:`load_experiment` reads it.

    """

    name: str
    duration_s: float
    outlooks: list[Outlook]
    score: float
    experiment: dict[str, Any]

    def to_dict(self, rig: Rig) -> dict[str, Any]:
        """Return it as plain data; pairs are (effect, what can stand in for it)."""
        return {'name': self.name, 'duration_s': self.duration_s, 'score': self.score,
                'effects': [o.to_dict(rig) for o in self.outlooks],
                'inseparable_pairs': self.pairs(), 'experiment': self.experiment}

    def pairs(self) -> list[list[str]]:
        """Return the pairs that cannot be told apart: [effect, what can stand in for it]."""
        return [[o.name, rival] for o in self.outlooks for rival in o.inseparable]

    def text(self, rig: Rig) -> str:
        """Return a table for people."""
        lines = [f'{self.name} ({self.duration_s:.0f} s), score {self.score:.2f}']
        rows = [('effect', 'shows from', 'named from', 'looks like')]
        for o in self.outlooks:
            entry = o.to_dict(rig)
            rows.append((o.name, _shown(entry['visible_from']), _shown(entry['named_from']),
                         ', '.join(n for n, _ in o.rivals[:3]) or '-'))
        widths = [max(len(row[k]) for row in rows) for k in range(3)]
        lines += ['  ' + '  '.join([*(c.ljust(w) for c, w in zip(row, widths)), row[3]])
                  for row in rows]
        hidden = [o.name for o in self.outlooks if o.visible is None]
        if hidden:
            lines.append('  shows at no size within its range: ' + ', '.join(hidden))
        pairs = [' ~ '.join(pair) for pair in self.pairs()]
        lines.append('  cannot be told apart: ' + (', '.join(pairs) or 'none'))
        return '\n'.join(lines)


@dataclass
class Plan:
    """
    Protocols as asked for and the best of the candidates, which comes last.

    ``remarks`` tell which of the names asked for are not looked at, and why.
    """

    rig: Rig
    signals: tuple[str, ...]
    noise: dict[str, float]
    materiality: float
    protocols: list[Planned]
    tried: int
    remarks: list[str] = field(default_factory=list)

    @property
    def best(self) -> Planned:
        """Return the best protocol of the candidate set."""
        return self.protocols[-1]

    def to_dict(self) -> dict[str, Any]:
        """Return the plan as plain data."""
        return {'schema': 1, 'rig': self.rig.name, 'valve': self.rig.valve,
                'signals': list(self.signals), 'noise': self.noise,
                'materiality': self.materiality, 'candidates': self.tried,
                'remarks': self.remarks,
                'protocols': [p.to_dict(self.rig) for p in self.protocols],
                'best': self.best.name}

    def text(self) -> str:
        """Return the plan for people."""
        noise = ', '.join(f'{s} {self.noise[s] * READABLE[s][0]:.3g} {READABLE[s][1]}'
                          for s in self.signals)
        return '\n'.join([
            f'{self.rig.name}, {self.rig.valve}; sensors: {noise}. Sizes at which an effect moves '
            f'some signal by {self.materiality:g} noise floors (rms), numbers calibrated, and at '
            'which no rival can stand in for it.',
            *self.remarks, *(p.text(self.rig) for p in self.protocols),
            f'{self.best.name} is the best of {self.tried} protocols of at most '
            f'{LONGEST_S:g} s.'])


def plan(rig: Rig, experiments: Sequence[Experiment] = (), with_force: bool = True,
         materiality: float = 1.0, only: Sequence[str] | None = None,
         progress: Callable[[float], object] = lambda done: None) -> Plan:
    """
    Judge protocols on a rig before anything is measured, and make the best of 60 s.

    Parameters
    ----------
    rig : pam_sim.Rig
        The model; sensor noise it does not state is that of the realistic rig.
    experiments : sequence of Experiment
        Protocols to judge.
    with_force : bool
        Whether the rig has a load cell.
    materiality : float
        Noise floors (rms) an effect must move some signal by.
    only : sequence of str, optional
        Effects to tell from each other; all by default.
    progress : callable, optional
        Told the share that is done.

    Returns
    -------
    Plan

    Raises
    ------
    InputError
        An experiment that this rig cannot do, or one that nothing can be read from; none of the
        names can be tried.

    """
    noise, noisy = sensors_for(rig)
    steps, done = len(experiments) + len(pieces(rig.valve)) + 1, [0]

    def looked(plain: dict[str, Any]) -> Sensitivities:
        found = sensitivities(plain, noisy, with_force, only)
        done[0] += 1
        progress(done[0] / steps)
        return found

    judged = [_judged(e.to_dict(), _some(looked(e.to_dict())), materiality)
              for e in experiments]
    looks, refused = {}, ''
    for name, segments in pieces(rig.valve, within_reach(rig)).items():
        try:
            looks[name] = looked(_experiment([name], segments, rig, with_force))
        except InputError as error:
            refused = str(error)       # a piece that this rig cannot do
    if not looks:
        raise InputError(f'can do none of the candidate protocols; of the last one: {refused}',
                         rig.name)
    first = _some(next(iter(looks.values())))
    chosen, tried = _best(looks, rig.valve, materiality)
    plain = _experiment(chosen, _joined(chosen, rig), rig, with_force)
    judged.append(_judged(plain, looked(plain), materiality))
    progress(1.0)
    return Plan(rig, first.signals, {s: noise[s] for s in first.signals}, materiality, judged,
                tried, first.left_out)


def _best(looks: Mapping[str, Sensitivities], valve: str,
          floors: float) -> tuple[list[str], int]:
    """Return (pieces of the best choice, how many choices there are)."""
    factors, _ = least_factors(list(looks.values()), floors)
    inners = {n: piece.inner(factors) for n, piece in looks.items()}
    found = choices(inners, valve)
    ranked = []
    for names in found:
        parts = [inners[n] for n in names]
        ranked.append(score(in_proportion(sum(parts[1:], parts[0]), factors, floors)))
    return found[ranked.index(max(ranked))], len(found)


def pieces(valve: str, highest_pa: float = HIGHEST_GAUGE_PA) -> dict[str, Segments]:
    """Return name -> segments of the pieces that protocols are made of, up to a gauge pressure."""
    low, high = P_ATM_PA + lowest_gauge_pa(highest_pa), P_ATM_PA + highest_pa
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    band = {'low_pa': low, 'high_pa': high}
    found: dict[str, Segments] = {
        'edges': [{'random_steps': {**band, 'min_hold_s': 0.25, 'max_hold_s': 0.9,
                                    'duration_s': 10.0, 'seed': 7}}],
        'edges_long': [{'random_steps': {**band, 'min_hold_s': 0.6, 'max_hold_s': 2.5,
                                         'duration_s': 20.0, 'seed': 9}}],
        'loops': [{'triangle_loops': {**band, 'depth_pa': 0.15 * half, 'loops': 2,
                                      'period_s': 10.0, 'cycles': 1}}],
        'bands': [{'two_bands': {'low_center_pa': middle - 0.6 * half,
                                 'high_center_pa': middle + 0.6 * half,
                                 'amplitude_pa': 0.35 * half, 'frequency_hz': 0.5, 'cycles': 2,
                                 'move_s': 1.0}}],
        'slow': [{'triangle': {**band, 'period_s': 8.0, 'cycles': 1}}],
        'quick': [{'triangle': {**band, 'period_s': 1.2, 'cycles': 6}}],
        'holds': [{'step': {'to_pa': high, 'duration_s': 6.0}},
                  {'step': {'to_pa': low, 'duration_s': 6.0}}],
        'frequencies': [{'multisine': {'center_pa': middle, 'amplitude_pa': 0.9 * half,
                                       'min_hz': 0.1, 'max_hz': 4.0, 'lines': 12,
                                       'duration_s': 10.0, 'seed': 8}}]}
    if valve == 'hsv':
        found['shut'] = [{'step': {'to_pa': high, 'duration_s': 2.0}},
                         {'decay': {'duration_s': 8.0}}]
    return found


def choices(names: Collection[str], valve: str) -> list[list[str]]:
    """Return the choices of pieces that fit and to which no further piece could be added."""
    fitting = [set(c) for size in range(1, len(names) + 1) for c in combinations(names, size)
               if length_of(c, valve) <= LONGEST_S]
    return [[n for n in names if n in c] for c in fitting
            if not any(c < other for other in fitting)]


def length_of(names: Iterable[str], valve: str) -> float:
    """Return how long [s] the protocol of these pieces lasts."""
    return START_S + sum(_length(n, valve) + BETWEEN_S for n in names)


@lru_cache(maxsize=None)
def _length(name: str, valve: str) -> float:
    segments = pieces(valve)[name]
    return load_experiment(dump_yaml(_plain('piece', '', segments, ()))).duration_s


def _joined(names: Iterable[str], rig: Rig) -> Segments:
    highest_pa = within_reach(rig)
    low = P_ATM_PA + lowest_gauge_pa(highest_pa)
    found: Segments = []
    for name in names:
        found += [*pieces(rig.valve, highest_pa)[name],
                  {'ramp': {'to_pa': low, 'duration_s': BETWEEN_S}}]
    return found


def _experiment(names: Iterable[str], segments: Segments, rig: Rig,
                with_force: bool) -> dict[str, Any]:
    needs = ['pressure', *([] if rig.is_driven else ['contraction']),
             *(['force'] if with_force else [])]
    start: Segments = [
        {'rest': {'duration_s': 1.0}},
        {'ramp': {'to_pa': P_ATM_PA + lowest_gauge_pa(within_reach(rig)),
                  'duration_s': START_S - 1.0}}]
    return _plain(NAME, f'Planned for {rig.name} with {rig.valve}: {", ".join(names)}',
                  start + segments, needs)


def _plain(name: str, description: str, segments: Segments,
           needs: Iterable[str]) -> dict[str, Any]:
    return {'name': name, 'description': description, 'domain': 'pressure',
            'needs': list(needs), 'segments': segments}


def sensitivities(plain: dict[str, Any], rig: Rig, with_force: bool = True,
                  only: Sequence[str] | None = None) -> Sensitivities:
    """Return the Sensitivities of a protocol, given as plain data, on a rig with its sensors."""
    experiment = load_experiment(dump_yaml(plain))
    controller = None
    if experiment.tracked:
        controller = load_controller(preset_for(experiment, rig), rig)
    run = simulated(plain, rig, controller)
    if not with_force:
        run.topics.pop('force', None)
    problems = check_for(run, rig).problems
    if problems:
        raise InputError(f'nothing can be read from it: {"; ".join(problems)}', experiment.name)
    return Sensitivities(rig, Recording(run, rig.valve, rig.is_driven), only)


def _judged(plain: dict[str, Any], looks: Sensitivities, materiality: float) -> Planned:
    found = outlooks(looks, materiality)
    return Planned(plain['name'], load_experiment(dump_yaml(plain)).duration_s, found,
                   score(o.factors for o in found), plain)


def _some(looks: Sensitivities) -> Sensitivities:
    """Return what is given, if any effect can be tried there."""
    if not looks.pool:
        raise InputError(' '.join(looks.left_out).rstrip('.'), looks.rig.name)
    return looks


def _shown(size: dict[str, Any] | None) -> str:
    if size is None:
        return 'no size'
    values = size['equivalent'] or size['parameters']
    name, quantity = next((pair for pair in values.items() if pair[1]['value'] != 0.0),
                          next(iter(values.items())))
    return f'{name} {quantity["value"]:.3g}{behind_number(quantity["unit"])}'
