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

Two sources: the tempered likelihood around the solution, and the spread over the
formulations of the same name that explain about as much; no formulation is the
muscle's own. Results state quantities that mean the same in all of them.
"""

import numpy as np
from pam_sim.effects.registry import get_effect

NORMAL_95 = 1.96
AS_GOOD = 2.0                # times the rest of the best formulation, plus what follows
AS_GOOD_SHARE = 0.01
FORM = 1.5                   # times the amplitude of what is left, relative to the gap
NUMERICS = 0.002             # relative, of step and interpolation


def effect_numbers(rig, found, place, covariance, named, rest):
    """
    Return (parameters, equivalent) of one effect of a fit as entries of gap.json.

    Parameters
    ----------
    rig : pam_sim.Rig
        The final model.
    found : Found
        The final fit.
    place : int
        Which effect of its hypothesis.
    covariance : numpy.ndarray
        As of ``Problem.covariance``.
    named : Named
        With the fits in other formulations.
    rest : float
        Share of the squared gap of its cut that the model leaves.

    Returns
    -------
    tuple of dict
        Name -> ``{'value', 'unit', 'ci95'}``; the fitted parameters, and what the
        effect reports.

    """
    candidate = found.hypothesis.effects[place]
    theta, rows = found.theta_of(place), found.hypothesis.rows(place)
    own = covariance[rows, rows]
    effect = get_effect(candidate.effect)
    units = {p.name: p.unit for p in effect.parameters}
    parameters = {}
    for j, f in enumerate(candidate.free):
        half = NORMAL_95 * float(np.sqrt(own[j, j]))
        low, high = sorted((f.value(theta[j] - half), f.value(theta[j] + half)))
        parameters[f.name] = _entry(f.value(theta[j]), units[f.name], low, high)
    equivalent = {}
    spread = _formulation_spread(rig, candidate, named)
    moved = _along_axes(candidate, theta, own, rig)
    # What is left may be the effect's own: a formulation that is a little off.
    off = FORM * np.sqrt(max(rest, 0.0))
    scaled = [f in candidate.amplitudes or not candidate.amplitudes for f in candidate.free]
    push = np.where(scaled, [off if f.shape else off * t
                             for f, t in zip(candidate.free, theta)], 0.0)
    moved.append([_report(candidate, theta + sign * push, rig) for sign in (-1.0, 1.0)])
    for name, (value, unit) in _report(candidate, theta, rig).items():
        shifts = np.array([[report[name][0] - value for report in pair] for pair in moved])
        extra = spread.get(name, 0.0) ** 2 + (NUMERICS * value) ** 2
        # Each axis of the ellipsoid pushes one way or both; what is not linear is kept.
        down, up = (float(np.sqrt(np.sum(np.max(sign * shifts, axis=1).clip(0.0) ** 2) + extra))
                    for sign in (-1.0, 1.0))
        equivalent[name] = _entry(value, unit, value - down, value + up)
    return parameters, equivalent


def _along_axes(candidate, theta, covariance, rig):
    """Return what the effect reports at both ends of every axis of the 95 % ellipsoid."""
    size, axes = np.linalg.eigh(covariance)
    found = []
    for variance, axis in zip(size, axes.T):
        step = NORMAL_95 * np.sqrt(max(variance, 0.0)) * axis
        found.append([_report(candidate, theta + sign * step, rig) for sign in (-1.0, 1.0)])
    return found


def _report(candidate, theta, rig):
    """Return what the effect reports at normalised parameters: name -> (value, unit)."""
    effect = get_effect(candidate.effect)
    values = {f.name: f.value(t) for f, t in zip(candidate.free, theta)}
    return effect.report(effect.values(candidate.setting(values)['parameters']), rig)


def _formulation_spread(rig, candidate, named):
    """Return by quantity how far formulations that explain about as much are from this one."""
    s = named.subsystem
    best = max((r.share.get(s, 0.0) for r in named.formulations), default=0.0)
    limit = AS_GOOD * (1.0 - best) + AS_GOOD_SHARE
    spread = {}
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


def _reported_in(rival, candidate, rig):
    theta = rival.found.theta_of(rival.found.hypothesis.effects.index(candidate))
    return {name: value for name, (value, _) in _report(candidate, theta, rig).items()}


def _entry(value, unit, low, high):
    return {'value': float(value), 'unit': unit, 'ci95': [float(low), float(high)]}
