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

"""Fit a muscle law to a measured force map, and judge how well it describes the map."""

from dataclasses import dataclass

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.muscle.force_maps import ForceMap, LENGTH_M, read_force_map
from pam_sim.muscle.law import MuscleLaw, Validity
from pam_sim.muscle.laws.chou_hannaford import ANGLE_RAD
from pam_sim.muscle.registry import get_law
from scipy.optimize import least_squares

# What static points can tell; the rest of a law's parameters stay as they are.
FREE = {
    'chou_hannaford': ('diameter_m', 'braid_angle_rad'),
    'tondu_lopez': ('diameter_m', 'k0', 'k_rise', 'k_pressure_pa'),
    'sarosi': ('a1_n_per_pa', 'a2_n', 'a3', 'a4_n_per_pa', 'a5_n_per_pa', 'a6_n'),
    'repperger': ('f0_n', 'f1_n_per_pa', 'k0_n_per_m', 'k1_n_per_m_pa', 'k2_n_per_m_pa',
                  'k_x_n_per_m2'),
    'situm_herceg': ('k_p_n_per_pa_m', 'shortest_length_m'),
    'inoue_pair': ('a', 'b'),
}

# label -> (law, set to start from, values held). With k free the braid angle is not told
# apart from it by static points, so there it is held at the maker's 28.6 degrees.
CASES = {
    'chou_hannaford': ('chou_hannaford', None, {}),
    'inoue_pair (one muscle)': ('inoue_pair', None, {}),
    'situm_herceg': ('situm_herceg', None, {}),
    'tondu_lopez, constant k': ('tondu_lopez', 'dmsp_10_constant_k', {
        'k_rise': 0.0, 'k_pressure_pa': 235e3, 'braid_angle_rad': ANGLE_RAD}),
    'tondu_lopez, k(p)': ('tondu_lopez', 'dmsp_5', {'braid_angle_rad': ANGLE_RAD}),
    'repperger, K(p)': ('repperger', 'two_slopes', {'k_x_n_per_m2': 0.0}),
    'repperger, K(p, x)': ('repperger', 'two_slopes', {}),
    'sarosi': ('sarosi', None, {}),
}


@dataclass(frozen=True)
class Fit:
    """
    A law fitted to a map.

    Parameters
    ----------
    law : MuscleLaw
        Holds the fitted values; a law whose claimed rules they break is refused.
    rmse_n, max_error_n : float
        Over the points with a measured force.
    false_force_n : float
        Largest force the law gives where the muscle did not pull.
    rmse_percent : float
        RMSE in percent of the largest force of the map.
    count, censored : int
        Number of measured points and of points without force.

    """

    law: MuscleLaw
    rmse_n: float
    max_error_n: float
    false_force_n: float
    rmse_percent: float
    count: int
    censored: int


def residuals_n(formula_n: FloatArray, points: ForceMap) -> FloatArray:
    """Return formula minus measurement [N]; where nothing was measured only what is above zero."""
    return np.where(points.censored, np.maximum(0.0, formula_n), formula_n - points.force_n)


def judge(law: MuscleLaw, points: ForceMap) -> Fit:
    """Return the Fit figures of a law as it stands, without fitting."""
    force = np.maximum(0.0, law.formula_n(points.pressure_gauge_pa, points.strain))
    error = (force - points.force_n)[~points.censored]
    rmse = float(np.sqrt(np.mean(error ** 2)))
    return Fit(law, rmse, float(np.abs(error).max()),
               float(force[points.censored].max(initial=0.0)),
               100.0 * rmse / float(points.force_n.max()), error.size,
               int(points.censored.sum()))


def fit_law(name: str, points: ForceMap, muscle: str | None = None,
            fixed: dict[str, float] | None = None) -> Fit:
    """
    Return the Fit of a law to a map: bounded least squares, deterministic.

    Parameters
    ----------
    name : str
        Law with an entry in ``FREE``.
    points : ForceMap
        What to fit to.
    muscle : str, optional
        Set to start from.
    fixed : dict, optional
        Values to hold, e.g. ``{'k_rise': 0.0}`` for a constant k.

    Raises
    ------
    InputError
        Nothing to fit, or the fitted values make no muscle.

    """
    kind = get_law(name)
    if name not in FREE:
        raise InputError(f'law `{name}` has no parameters to fit; it goes through its table')
    fixed = dict(fixed or {})
    bounds = {parameter.name: parameter for parameter in kind.PARAMETERS}
    if 'length_m' in bounds:
        fixed.setdefault('length_m', points.length_m)
    names = [key for key in FREE[name] if key not in fixed]
    start = {**kind(None, muscle).values, **fixed}
    if 'shortest_length_m' in names:      # keep the start between no and full length
        start['shortest_length_m'] = 0.8 * points.length_m
    law = UncheckedLaw(kind, start, muscle)
    lower = np.array([bounds[key].lower for key in names])
    upper = np.array([bounds[key].upper for key in names])
    first = np.clip([start[key] for key in names], lower, upper)
    scale = np.maximum(np.abs(first), 1e-3 * (upper - lower))

    def errors(scaled: FloatArray) -> FloatArray:
        law.values.update(zip(names, scaled * scale))
        return residuals_n(law.tension_n(points), points)

    inner = np.clip(first / scale, lower / scale, upper / scale)
    done = least_squares(errors, inner, bounds=(lower / scale, upper / scale),
                         x_scale='jac', max_nfev=2000, xtol=1e-12, ftol=1e-12)
    fitted = dict(zip(names, np.clip(done.x * scale, lower, upper).tolist()))
    return checked(kind({**fixed, **fitted}, muscle), points)


def checked(law: MuscleLaw, points: ForceMap) -> Fit:
    """Return the Fit of a fitted law, valid where there are points; InputError if no muscle."""
    law.validity = Validity(
        (float(points.pressure_gauge_pa.min()), float(points.pressure_gauge_pa.max())),
        (float(points.strain.min()), float(points.strain.max())))
    law._check(f'fit to {points.name}')
    return judge(law, points)


def fit_table() -> dict[str, dict[str, Fit]]:
    """Return {map name: {label of CASES: Fit}} for both measured maps; under a second."""
    return {name: {label: fit_law(law, read_force_map(name), muscle, fixed)
                   for label, (law, muscle, fixed) in CASES.items()} for name in LENGTH_M}


class UncheckedLaw:
    """A law whose values may change under way; only the end result must be a muscle."""

    def __init__(self, kind: type[MuscleLaw], values: dict[str, float],
                 muscle: str | None) -> None:
        self._law: MuscleLaw = kind.__new__(kind)
        self._law.validity = kind.SETS[muscle or next(iter(kind.SETS))].validity
        self.values = self._law.values = dict(values)

    def tension_n(self, points: ForceMap) -> FloatArray:
        """Return the value of the formula at points [N]."""
        return self._law._tension_n(points.pressure_gauge_pa, points.strain)
