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
difference between time blocks if that is larger. The second is what latency and skew of the
measurement absorbed, since it may belong to the effect. The third is the form: no formulation is
exactly that of the muscle. It is the spread over formulations of the same effect that explain
about as much, and the rest of the gap. Results state quantities that mean the same in all
formulations.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.effects.registry import get_effect
from pam_sim.gap.fit.candidate import Candidate
from pam_sim.gap.fit.hypothesis import Fit, Precision
from pam_sim.gap.select.rival import NamedEffect, Rival
from pam_sim.rig import Rig

NORMAL_95 = 1.96
AS_GOOD = 2.0                # times the rest of the best formulation, plus what follows
AS_GOOD_SHARE = 0.01
FORM = 1.5                   # times the amplitude of what is left, relative to the gap
HELD = 1.5                   # times what latency and skew took up
LEAST = 0.03                 # relative; no formulation is worth less
NUMERICS = 0.002             # relative, of step and interpolation

# An entry of gap.json, and what an effect reports: name -> (value, unit).
Entry = dict[str, Any]
Report = dict[str, tuple[float, str]]


def effect_numbers(rig: Rig, found: Fit, place: int, precision: Precision, named: NamedEffect,
                   rest: float) -> tuple[dict[str, Entry], dict[str, Entry]]:
    """
    Return (parameters, equivalent) of one effect of a fit as entries of gap.json.

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

    Returns
    -------
    tuple of dict
        Name -> ``{'value', 'unit', 'ci95'}``; the fitted parameters, and what the
        effect reports.

    """
    candidate = found.hypothesis.effects[place]
    theta, rows = found.theta_of(place), found.hypothesis.rows(place)
    spreads = [c[rows, rows] for c in (precision.likelihood, precision.blocks)]
    held = precision.held[rows]
    effect = get_effect(candidate.effect)
    units = {p.name: p.unit for p in effect.parameters}
    parameters = {}
    for j, f in enumerate(candidate.free):
        half = half_width(precision, rows.start + j, theta[j])
        low, high = sorted((f.value(theta[j] - half), f.value(theta[j] + half)))
        parameters[f.name] = _entry(f.value(theta[j]), units[f.name], low, high)
    equivalent = {}
    spread = _formulation_spread(rig, candidate, named)
    moved = [_along_axes(candidate, theta, own, rig) for own in spreads]
    shifted = _report(candidate, held, rig)
    # What is left may be the effect's own: a formulation that is a little off.
    off = FORM * np.sqrt(max(rest, 0.0))
    scaled = [f in candidate.amplitudes or not candidate.amplitudes for f in candidate.free]
    push = np.where(scaled, [off if f.shape else off * t
                             for f, t in zip(candidate.free, theta)], 0.0)
    off = [_report(candidate, theta + sign * push, rig) for sign in (-1.0, 1.0)]
    for name, (value, unit) in _report(candidate, theta, rig).items():
        extra = (spread.get(name, 0.0) ** 2 + (LEAST * value) ** 2
                 + (HELD * (shifted[name][0] - value)) ** 2)
        down, up = (np.sqrt(extra + _pushed([off], name, value, sign) + max(
            _pushed(axes, name, value, sign) for axes in moved)) for sign in (-1.0, 1.0))
        equivalent[name] = _entry(value, unit, value - down, value + up)
    return parameters, equivalent


def half_width(precision: Precision, place: int, value: float) -> float:
    """Return half the 95 % interval of one normalised number, what has no form left out."""
    variance = max(c[place, place] for c in (precision.likelihood, precision.blocks))
    return float(np.hypot(NORMAL_95 * np.sqrt(variance), HELD * (precision.held[place] - value)))


def _pushed(pairs: Sequence[Sequence[Report]], name: str, value: float, sign: float) -> float:
    """Return the squared change of a quantity one way; each pair pushes one way or both."""
    shifts = np.array([[report[name][0] - value for report in pair] for pair in pairs])
    return float(np.sum(np.max(sign * shifts, axis=1).clip(0.0) ** 2))


def _along_axes(candidate: Candidate, theta: FloatArray, covariance: FloatArray, rig: Rig
                ) -> list[list[Report]]:
    """Return what the effect reports at both ends of every axis of the 95 % ellipsoid."""
    size, axes = np.linalg.eigh(covariance)
    found = []
    for variance, axis in zip(size, axes.T):
        step = NORMAL_95 * np.sqrt(max(variance, 0.0)) * axis
        found.append([_report(candidate, theta + sign * step, rig) for sign in (-1.0, 1.0)])
    return found


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


def _entry(value: float, unit: str, low: float, high: float) -> Entry:
    return {'value': float(value), 'unit': unit, 'ci95': [float(low), float(high)]}
