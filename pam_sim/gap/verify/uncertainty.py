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
How well the numbers of a named effect are known.

There are three sources. The first is the tempered likelihood around the solution, or the
difference between time blocks if that is larger. It is more where a number may go farther before
the errors rise, all others fitted again. The second is what latency and skew of the measurement
absorbed, since it may belong to the effect. A pure delay is known no better than that latency. The
third is the form: no formulation is exactly that of the muscle. It is the spread over formulations
of the same effect that explain about as much, and the rest of the gap. Results state quantities
that mean the same in all formulations.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import product
import math
from typing import Any

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.effects.registry import get_effect
from pam_sim.gap.fit.candidate import Candidate
from pam_sim.gap.fit.hypothesis import Fit, Precision
from pam_sim.gap.fit.profile import NORMAL_95
from pam_sim.gap.select.rival import NamedEffect, Rival
from pam_sim.gap.verify.together import known_together
from pam_sim.rig import Rig

AS_GOOD = 2.0                # times the rest of the best formulation, plus what follows
AS_GOOD_SHARE = 0.01
FORM = 1.5                   # times the amplitude of what is left, relative to the gap
HELD = 1.5                   # times what latency and skew took up
LEAST = 0.03                 # relative; no formulation is worth less
NUMERICS = 0.002             # relative, of step and interpolation
STEP = 1e-4                  # of a slope of what is reported, in coordinates

# An entry of gap.json, and what an effect reports: name -> (value, unit).
Entry = dict[str, Any]
Report = dict[str, tuple[float, str]]
Told = Callable[[FloatArray], Report]


def effect_numbers(rig: Rig, found: Fit, place: int, precision: Precision, named: NamedEffect,
                   rest: float, late_sd_s: float = 0.0) -> dict[str, Any]:
    """
    Return what gap.json says of the numbers of one effect of a fit.

    Parameters
    ----------
    rig : pam_sim.Rig
        The final model.
    found : Fit
        The final fit.
    place : int
        Which effect of its hypothesis.
    precision : Precision
        Of the same fit.
    named : NamedEffect
        With the fits in other formulations.
    rest : float
        Share of the squared gap of its subsystem that the model leaves.
    late_sd_s : float
        How well the latency of the recordings is known, s. A pure delay is known no better.

    Returns
    -------
    dict
        ``parameters``, the fitted ones, and ``equivalent``, what the effect reports: name ->
        ``{'value', 'unit', 'ci95'}``, with one interval for what is in both. ``together``: what
        is known of the quantities of ``equivalent`` that are not known alone, as formulas.

    """
    candidate = found.hypothesis.effects[place]
    theta, rows = found.theta_of(place), found.hypothesis.rows(place)
    spreads = [c[rows, rows] for c in (precision.likelihood, precision.blocks)]
    ends = precision.ends[rows, :, rows]
    held = precision.held[rows]
    late = _late(candidate, late_sd_s)
    # What is left may be the effect's own: a formulation that is a little off.
    off = off_by(rest)
    scaled = [f in candidate.amplitudes or not candidate.amplitudes for f in candidate.free]
    push = np.where(scaled, [off if f.shape else off * t
                             for f, t in zip(candidate.free, theta)], 0.0)

    def entries(told: Told, spread: Mapping[str, float]) -> dict[str, Entry]:
        pairs = [[[told(end) for end in pair]] for pair in ends]
        moved = [_along_axes(told, theta, own) for own in spreads] + pairs + [
            [[told(theta + late), told(theta - late)]]]
        shifted = told(held)
        formed = [told(theta + sign * push) for sign in (-1.0, 1.0)]
        limits = [told(np.array(corner)) for corner in product(*(
            [f.coordinate(f.lower), f.coordinate(f.upper)] for f in candidate.free))]
        made = {}
        for name, (value, unit) in told(theta).items():
            extra = (spread.get(name, 0.0) ** 2 + (LEAST * value) ** 2
                     + (HELD * (shifted[name][0] - value)) ** 2)
            down, up = (math.sqrt(extra + _pushed([formed], name, value, sign) + max(
                _pushed(axes, name, value, sign) for axes in moved)) for sign in (-1.0, 1.0))
            allowed = [value, *(one[name][0] for one in limits if math.isfinite(one[name][0]))]
            made[name] = {'value': float(value), 'unit': unit, 'ci95': [
                float(max(value - down, min(allowed))), float(min(value + up, max(allowed)))]}
        return made

    def reported(at: FloatArray) -> Report:
        return _report(candidate, at, rig)

    units = {p.name: p.unit for p in get_effect(candidate.effect).parameters}
    equivalent = entries(reported, _formulation_spread(rig, candidate, named))
    parameters = entries(lambda at: {
        f.name: (f.value(t), units[f.name]) for f, t in zip(candidate.free, at)}, {})
    # Another formulation may mean something else by the same name.
    parameters |= {name: one for name, one in equivalent.items() if name in parameters
                   and math.isclose(one['value'], parameters[name]['value'])}
    usual = reported(theta)
    slopes = _slopes(reported, candidate, theta)
    return {'parameters': parameters, 'equivalent': equivalent, 'together': [
        one.text() for one in known_together(
            usual, slopes, spreads,
            np.array([[[value for value, _ in reported(end).values()] for end in pair]
                      for pair in ends]), LEAST)]}


def half_width(precision: Precision, place: int, value: float) -> float:
    """Return half the 95 % interval of one normalised number, what has no form left out."""
    variance = max(c[place, place] for c in (precision.likelihood, precision.blocks))
    return float(np.hypot(NORMAL_95 * np.sqrt(variance), HELD * (precision.held[place] - value)))


def off_by(rest: float) -> float:
    """Return by which share a number may be off where that share of a squared gap is left."""
    return FORM * math.sqrt(max(rest, 0.0))


def _late(candidate: Candidate, late_sd_s: float) -> FloatArray:
    """
    Return by how much a latency that is known so well may move the parameters of an effect.

    Slopes do not tell it: a delay between two steps of the simulation also blurs the command.
    """
    fitting = get_effect(candidate.effect).fitting
    return np.array([NORMAL_95 * late_sd_s / f.typical if (
        fitting.pure_delay and f.name == fitting.delay) else 0.0 for f in candidate.free])


def _pushed(pairs: Sequence[Sequence[Report]], name: str, value: float, sign: float) -> float:
    """Return the squared change of a quantity one way; each pair pushes one way or both."""
    shifts = np.array([[report[name][0] - value for report in pair] for pair in pairs])
    return float(np.sum(np.max(sign * shifts, axis=1).clip(0.0) ** 2))


def _along_axes(told: Told, theta: FloatArray, covariance: FloatArray) -> list[list[Report]]:
    """Return what is told at both ends of every axis of the 95 % ellipsoid."""
    size, axes = np.linalg.eigh(covariance)
    found = []
    for variance, axis in zip(size, axes.T):
        step = NORMAL_95 * np.sqrt(max(variance, 0.0)) * axis
        found.append([told(theta + sign * step) for sign in (-1.0, 1.0)])
    return found


def _slopes(told: Told, candidate: Candidate, theta: FloatArray) -> FloatArray:
    """Return the derivatives of what is told, one column a parameter, within their ranges."""
    columns = []
    for j, f in enumerate(candidate.free):
        step = STEP if theta[j] + STEP <= f.coordinate(f.upper) else -STEP
        moved = theta + step * (np.arange(theta.size) == j)
        columns.append([(value - usual) / step for (value, _), (usual, _) in zip(
            told(moved).values(), told(theta).values())])
    return np.array(columns).T


def _report(candidate: Candidate, theta: FloatArray, rig: Rig) -> Report:
    """Return what the effect reports at normalised parameters: name -> (value, unit)."""
    effect = get_effect(candidate.effect)
    values = {f.name: f.value(t) for f, t in zip(candidate.free, theta)}
    return effect.report(effect.values(candidate.setting(values)['parameters']), rig)


def _formulation_spread(rig: Rig, candidate: Candidate, named: NamedEffect) -> dict[str, float]:
    """Return by quantity how far formulations that explain about as much are from this one."""
    s = named.subsystem
    best = max((r.share.get(s, 0.0) for r in named.formulations), default=0.0)
    limit = AS_GOOD * (1.0 - best) + AS_GOOD_SHARE
    spread: dict[str, float] = {}
    mine = next((r for r in named.formulations if candidate in r.found.hypothesis.effects), None)
    if mine is None:
        return spread
    reference = _reported_in(mine, candidate, rig)
    for r in named.formulations:
        other = r.found.hypothesis.effects[-1]
        if 1.0 - r.share.get(s, 0.0) > limit or other == candidate:
            continue
        for name, value in _reported_in(r, other, rig).items():
            if name in reference:
                spread[name] = max(spread.get(name, 0.0), abs(value - reference[name]))
    return spread


def _reported_in(rival: Rival, candidate: Candidate, rig: Rig) -> dict[str, float]:
    theta = rival.found.theta_of(rival.found.hypothesis.effects.index(candidate))
    return {name: value for name, (value, _) in _report(candidate, theta, rig).items()}
