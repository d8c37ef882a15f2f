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
Bounded nonlinear least squares for many errors and few numbers.

The trust-region reflective method of Branch, Coleman and Li (1999), with the radius met as
described by More (1977). It takes the same steps as ``scipy.optimize.least_squares(method='trf',
x_scale='jac')``. Two things cost less. The errors and their slopes are reduced to a triangle
(QR) once at each point, so that what follows is as large as the numbers are many. And slopes are
asked for only where another step is taken: a fit that has ended needs none.
"""

from collections.abc import Callable
import math
from typing import NamedTuple

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray

FLAT = 1e-8                  # scaled gradient from which on nothing is left to gain
NEAR_BOUND = 1e-10           # relative; the start stays so far from every bound
STEP_BACK = 0.995            # of the way to a bound
POOR, GOOD = 0.25, 0.75      # of the predicted fall: the radius shrinks below, may grow above
AT_RADIUS = 0.95             # of the radius: a step that may let it grow
RADIUS_TOLERANCE, RADIUS_STEPS = 0.01, 10
EPSILON = float(np.finfo(float).eps)


class _Model(NamedTuple):
    """
    The quadratic model at a point in scaled numbers, reduced to as many rows as numbers.

    ``triangle`` and ``bent`` are the slopes and the curvature that the bounds add, ``slope`` is
    the gradient. ``scale`` leads back to the numbers themselves.
    """

    triangle: FloatArray
    bent: FloatArray
    slope: FloatArray
    scale: FloatArray

    def value(self, step: FloatArray) -> float:
        """Return the change of the cost by a scaled step."""
        moved = self.triangle @ step
        return float(0.5 * (moved @ moved + (step * self.bent) @ step) + step @ self.slope)

    def along(self, step: FloatArray, before: FloatArray, least: float, most: float
              ) -> tuple[float, float]:
        """Return (length, change of the cost) of the best way along ``step`` after another."""
        moved, first = self.triangle @ step, self.triangle @ before
        a = 0.5 * float(moved @ moved + (step * self.bent) @ step)
        b = float(self.slope @ step + first @ moved + (before * self.bent) @ step)
        lengths = [least, most]
        if a != 0.0 and least < -0.5 * b / a < most:
            lengths.append(-0.5 * b / a)
        best = min(lengths, key=lambda t: t * (a * t + b))
        return best, best * (a * best + b) + self.value(before)


def minimised(residuals: Callable[[FloatArray], FloatArray],
              slopes: Callable[[FloatArray], FloatArray], start: FloatArray,
              low: FloatArray, high: FloatArray, cost_tolerance: float, step_tolerance: float,
              evaluations: int) -> FloatArray:
    """
    Return the numbers within bounds at which the sum of squares is least, near a start.

    Parameters
    ----------
    residuals, slopes : callable
        Errors at some numbers, and their derivatives, one column a number.
    start, low, high : numpy.ndarray
        Where to begin, and the bounds.
    cost_tolerance, step_tolerance : float
        A step that gains or moves less, relatively, is the last one.
    evaluations : int
        Of the errors, at most.

    """
    x = _inside(start, low, high)
    errors = residuals(x)
    cost = 0.5 * float(errors @ errors)
    made, alpha, radius = 1, 0.0, 0.0
    size = np.zeros(0)
    while made < evaluations:
        columns = slopes(x)
        rows = len(columns)
        reduced: FloatArray = np.asarray(
            np.linalg.qr(np.column_stack([columns, errors]), mode='r'))
        triangle, turned_errors = reduced[:, :-1], reduced[:, -1]
        gradient, sizes = triangle.T @ turned_errors, np.sqrt(np.sum(triangle ** 2, axis=0))
        room, turned = _room(x, gradient, low, high)
        if size.size:
            size = np.maximum(sizes, size)
        else:
            size = np.where(sizes == 0.0, 1.0, sizes)
            radius = float(np.linalg.norm(x * size / np.sqrt(
                np.where(turned != 0.0, room * size, room)))) or 1.0
        steepest = float(np.max(np.abs(gradient * room)))
        if steepest < FLAT:
            break
        room = np.where(turned != 0.0, room * size, room)
        scale = np.sqrt(room) / size
        bent = gradient * turned / size
        model = _Model(triangle * scale, bent, scale * gradient, scale)
        whole = np.vstack([model.triangle, np.diag(np.sqrt(bent))])
        left, singular, right = np.linalg.svd(whole, full_matrices=False)
        seen = left.T @ np.concatenate([turned_errors, np.zeros(x.size)])
        theta = max(STEP_BACK, 1.0 - steepest)
        fell, ended = -1.0, False
        while fell <= 0.0 and made < evaluations and not ended:
            wanted, alpha = _within_radius(singular, seen, right.T, radius, alpha, rows)
            scaled = _reflected(x, wanted, model, radius, low, high, theta)
            step = scale * scaled
            tried = _off_bounds(x + step, low, high)
            found = residuals(tried)
            made += 1
            length = float(np.linalg.norm(scaled))
            if not np.all(np.isfinite(found)):
                radius = POOR * length
                continue
            new_cost = 0.5 * float(found @ found)
            fell = cost - new_cost
            predicted = -model.value(scaled)
            ratio = fell / predicted if predicted > 0.0 else float(predicted == fell == 0.0)
            moved = float(np.linalg.norm(step))
            ended = (fell < cost_tolerance * cost and ratio > POOR) or moved < step_tolerance * (
                step_tolerance + float(np.linalg.norm(x)))
            if not ended:
                before = radius
                if ratio < POOR:
                    radius = POOR * length
                elif ratio > GOOD and length > AT_RADIUS * radius:
                    radius *= 2.0
                alpha *= before / radius
        if fell > 0.0:
            x, errors, cost = tried, found, new_cost
        if ended:
            break
    return x


def _within_radius(singular: FloatArray, seen: FloatArray, right: FloatArray, radius: float,
                   alpha: float, rows: int) -> tuple[FloatArray, float]:
    """
    Return (best step no longer than the radius, the damping that makes it so long).

    From the singular values, the errors in their directions and the directions. ``alpha`` is where
    the damping is looked for first; ``rows`` tells how many errors there were.
    """
    pull = singular * seen
    is_full = bool(singular[-1] > EPSILON * rows * singular[0])
    if is_full:
        step = -(right @ (seen / singular))
        if np.linalg.norm(step) <= radius:
            return step, 0.0

    def excess(damping: float) -> tuple[float, float]:
        """Return by how much the step is longer than the radius, and the slope of that."""
        weak = singular ** 2 + damping
        length = float(np.linalg.norm(pull / weak))
        return length - radius, -float(np.sum(pull ** 2 / weak ** 3)) / length

    most = float(np.linalg.norm(pull)) / radius
    least = 0.0
    if is_full:
        over, slope = excess(0.0)
        least = -over / slope
    elif alpha == 0.0:
        alpha = max(0.001 * most, math.sqrt(least * most))
    for _ in range(RADIUS_STEPS):
        if not least <= alpha <= most:
            alpha = max(0.001 * most, math.sqrt(least * most))
        over, slope = excess(alpha)
        if over < 0.0:
            most = alpha
        least = max(least, alpha - over / slope)
        alpha -= (over + radius) * over / (slope * radius)
        if abs(over) < RADIUS_TOLERANCE * radius:
            break
    step = -(right @ (pull / (singular * singular + alpha)))
    return step * (radius / float(np.linalg.norm(step))), alpha


def _reflected(x: FloatArray, wanted: FloatArray, model: _Model, radius: float,
               low: FloatArray, high: FloatArray, theta: float) -> FloatArray:
    """
    Return the scaled step to take: the wanted one where that stays within the bounds.

    Otherwise the best of three: up to the bound, reflected there, and along the gradient.
    """
    step = model.scale * wanted
    if np.all((x + step >= low) & (x + step <= high)):
        return wanted
    share, hit = _to_bound(x, step, low, high)
    at_bound = share * wanted
    mirrored = np.where(hit, -wanted, wanted)
    back = model.scale * mirrored
    to_radius = _to_radius(at_bound, mirrored, radius)
    to_next, _ = _to_bound(x + share * step, back, low, high)
    options: list[tuple[float, FloatArray]] = []
    longest = min(to_next, to_radius)
    if longest > 0.0:
        first = (1.0 - theta) * share / longest
        last = theta * to_next if longest == to_next else to_radius
        if first <= last:
            length, value = model.along(mirrored, at_bound, first, last)
            options.append((value, at_bound + length * mirrored))
    inner = theta * at_bound
    options.append((model.value(inner), inner))
    downhill = -model.slope
    to_radius = radius / float(np.linalg.norm(downhill))
    to_next, _ = _to_bound(x, model.scale * downhill, low, high)
    length, value = model.along(downhill, np.zeros_like(x), 0.0, (
        theta * to_next if to_next < to_radius else to_radius))
    options.append((value, length * downhill))
    return min(options, key=lambda option: option[0])[1]


def _to_bound(x: FloatArray, step: FloatArray, low: FloatArray, high: FloatArray
              ) -> tuple[float, BoolArray]:
    """Return how many times a step reaches the first bound, and which numbers are there then."""
    with np.errstate(all='ignore'):
        times = np.where(step != 0.0, np.maximum((low - x) / step, (high - x) / step), np.inf)
    least = float(np.min(times))
    return least, (times == least) & (step != 0.0)


def _to_radius(start: FloatArray, step: FloatArray, radius: float) -> float:
    """Return how many times a step leads from a start within the radius to it."""
    a, b = float(step @ step), float(start @ step)
    c = min(float(start @ start) - radius ** 2, 0.0)
    q = -(b + math.copysign(math.sqrt(b * b - a * c), b))
    return max(q / a, c / q) if q != 0.0 else 0.0


def _room(x: FloatArray, gradient: FloatArray, low: FloatArray, high: FloatArray
          ) -> tuple[FloatArray, FloatArray]:
    """Return (room to the bound downhill, 1 where there is none; its derivative)."""
    up, down = (gradient < 0.0) & np.isfinite(high), (gradient > 0.0) & np.isfinite(low)
    room = np.where(up, high - x, np.where(down, x - low, 1.0))
    return room, np.where(up, -1.0, np.where(down, 1.0, 0.0))


def _inside(x: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return a start that is on no bound."""
    from_low, from_high = (NEAR_BOUND * np.where(
        np.isfinite(end), np.maximum(1.0, np.abs(end)), 0.0) for end in (low, high))
    at_low = (x - low <= np.minimum(high - x, from_low)) & np.isfinite(low)
    at_high = (high - x <= np.minimum(x - low, from_high)) & np.isfinite(high)
    moved = np.array(x)
    moved[at_low], moved[at_high] = (low + from_low)[at_low], (high - from_high)[at_high]
    return _between(moved, low, high)


def _off_bounds(x: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the next number within, where one is on a bound or beyond."""
    moved = np.where(x >= high, np.nextafter(high, low), np.where(
        x <= low, np.nextafter(low, high), x))
    return _between(moved, low, high)


def _between(x: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the middle of a range that is too narrow for anything else."""
    outside = (x < low) | (x > high)
    x[outside] = 0.5 * (low + high)[outside]
    return x
