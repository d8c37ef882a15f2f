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
The rule tables of the controller and their inference.

Feedback rules: ``feedback[d, i, j]`` is the singleton in [-1, 1] of the rule
"if moving in direction d and error is set i and change of error is set j".
Feed-forward rules: ``feedforward[d, k]`` [Pa] is the singleton of "if the
reference is near r_k and moves in direction d then add c_k". Directions: 0
contracting, 1 extending; a muscle with hysteresis needs different pressures on
the two branches. Shortly after a reversal both are active in part. Motion rules:
``motion[m, n]`` [Pa] of "if the reference is near r_m and moves at about v_n then
add c_mn"; the rates are dense about zero, where the muscle turns round. Path rules, where there
are any: ``path[q, k]`` [Pa] of "if the contraction is near r_k and a path of length q led there
then add c_qk". After a path that extended the muscle, c_qk is taken off. Set 0 is any path.

Inference is product and weighted mean; degrees sum to 1, so the mean needs no division. This is
the zero-order Sugeno form of the rule table of Procyk and Mamdani (Automatica 15, 1979).
"""

from dataclasses import dataclass, field
import hashlib
import os
from typing import Any, TypeAlias

import numpy as np
from pam_actuation.control.sofc.membership import (
    SET_COUNT, SET_WORDS, signed_logarithmic_knots)
from pam_actuation.control.sofc.path_memory import path_widths_m
from pam_actuation.control.sofc.rule_text import NAMES, save_rules
from pam_actuation.control.sofc.words import FADING
from pam_sim.annotations import FloatArray
from pam_sim.compiled import compiled
from pam_sim.shared_memory import SharedMemory
from pam_sim.short_repr import short_repr

# Feedback, feed-forward, motion and path rules.
Tables: TypeAlias = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
CONTRACTING, EXTENDING = 0, 1
DIRECTIONS = ('contracting', 'extending')


@compiled
def layer(tables: Tables, k: int) -> Tables:
    """Return one layer of every table: values, initial values, counts or values kept."""
    feedback, feedforward, motion, path = tables
    return feedback[k], feedforward[k], motion[k], path[k]


@compiled
def contracting_share(share: float, way_m: float, blend_m: float) -> float:
    """
    Return the degree 0..1 of direction 'contracting' after a further way of the reference.

    Like the friction it stands for, it changes over a way after a reversal, not with time: a
    play operator. Standing still keeps the direction of before.
    """
    return min(max(share + way_m / blend_m, 0.0), 1.0)


@compiled
def infer_feedback(table: FloatArray, share: float, i: int, wi: float, j: int, wj: float) -> float:
    """
    Return the output of the feedback rules in [-1, 1].

    ``i, wi`` and ``j, wj`` are the active sets of error and change of error as
    ``membership.locate`` gives them, ``share`` the degree of 'contracting'.
    """
    up = ((1.0 - wi) * ((1.0 - wj) * table[0, i, j] + wj * table[0, i, j + 1])
          + wi * ((1.0 - wj) * table[0, i + 1, j] + wj * table[0, i + 1, j + 1]))
    down = ((1.0 - wi) * ((1.0 - wj) * table[1, i, j] + wj * table[1, i, j + 1])
            + wi * ((1.0 - wj) * table[1, i + 1, j] + wj * table[1, i + 1, j + 1]))
    return share * up + (1.0 - share) * down


@compiled
def infer_feedforward(table: FloatArray, share: float, k: int, wk: float) -> float:
    """Return the output of the feed-forward rules [Pa] at the active knots ``k, wk``."""
    return (share * ((1.0 - wk) * table[0, k] + wk * table[0, k + 1])
            + (1.0 - share) * ((1.0 - wk) * table[1, k] + wk * table[1, k + 1]))


@compiled
def infer_motion(table: FloatArray, m: int, wm: float, n: int, wn: float) -> float:
    """Return the output of the motion rules [Pa] at position knots m and rate knots n."""
    return ((1.0 - wm) * ((1.0 - wn) * table[m, n] + wn * table[m, n + 1])
            + wm * ((1.0 - wn) * table[m + 1, n] + wn * table[m + 1, n + 1]))


@compiled
def infer_path(table: FloatArray, path: FloatArray, k: int, wk: float) -> float:
    """Return the output of the path rules [Pa] for the degrees of a path at the knots k, wk."""
    total = 0.0
    for q in range(table.shape[0]):
        total += path[q] * ((1.0 - wk) * table[q, k] + wk * table[q, k + 1])
    return total


def linear_feedback_table() -> FloatArray:
    """Return the initial feedback rules (2, 7, 7): the linear surface 0.5 (e + de)."""
    grid = np.linspace(-1.0, 1.0, SET_COUNT)
    surface = 0.5 * (grid[:, None] + grid[None, :])
    return np.stack([surface, surface])


@short_repr
@dataclass(frozen=True)
class Antecedent:
    """One input of a table of rules: ``words`` for sets with names, else ``knots`` in ``unit``."""

    name: str
    unit: str
    knots: FloatArray
    words: tuple[str, ...] = ()


@short_repr
@dataclass(frozen=True)
class RuleTable:
    """
    One table of a rule base, self-describing.

    ``values``, ``initial`` and ``fired`` are the live arrays of the rule base, one axis per
    antecedent; ``scale`` turns a value into ``unit``, ``limit`` bounds its magnitude.
    """

    name: str
    antecedents: tuple[Antecedent, ...]
    values: FloatArray
    initial: FloatArray
    fired: FloatArray
    limit: float
    scale: float
    unit: str


# Entries of the scaling of rules that track something else than contraction: the unit, how
# much of it one metre of equivalent contraction is, the metres at its zero.
TRACKED_SCALING = ('tracked_unit', 'tracked_per_m', 'tracked_zero_m')
TRACKED_UNITS = ('N', 'rad')
_WAYS = {'N': ('rising', 'falling'), 'rad': ('flexing', 'extending')}


def _not_given() -> FloatArray:
    return np.empty(0)


@short_repr
@dataclass
class RuleBase(SharedMemory):
    """
    The rules of one controller, what they were at first, and how often they fired.

    Attributes
    ----------
    feedback, feedback_initial : numpy.ndarray
        (2, 7, 7) singletons in [-1, 1].
    feedforward, feedforward_initial : numpy.ndarray
        (2, K) singletons [Pa].
    motion, motion_initial : numpy.ndarray
        (M, N) singletons [Pa]; none that matter by default.
    path, path_initial : numpy.ndarray
        (Q, K) singletons [Pa]; (0, 0) where there are none.
    feedback_fired, feedforward_fired, motion_fired, path_fired : numpy.ndarray
        Sum of the firing strengths of each rule since the rules were loaded.
    scaling : dict of str -> float
        What the numbers mean: universes, gains, knots, sample time, rig identity. Rules
        fit only a controller of the same scaling.
    numbers, covariance : numpy.ndarray
        (N,) numbers of a model of the muscle [Pa], see ``muscle_model``, and (N, N) how well they
        are known [Pa^2], all zero: not at all. (0,) and (0, 0) where there is no such model.

    """

    NAMES = NAMES

    feedback: FloatArray
    feedforward: FloatArray
    scaling: dict[str, Any] = field(default_factory=dict)
    motion: FloatArray = field(default_factory=lambda: np.zeros((2, 2)))
    path: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    feedback_initial: FloatArray = field(default_factory=_not_given)
    feedforward_initial: FloatArray = field(default_factory=_not_given)
    motion_initial: FloatArray = field(default_factory=_not_given)
    path_initial: FloatArray = field(default_factory=_not_given)
    feedback_fired: FloatArray = field(default_factory=_not_given)
    feedforward_fired: FloatArray = field(default_factory=_not_given)
    motion_fired: FloatArray = field(default_factory=_not_given)
    path_fired: FloatArray = field(default_factory=_not_given)
    numbers: FloatArray = field(default_factory=_not_given)
    covariance: FloatArray = field(default_factory=lambda: np.empty((0, 0)))

    def __post_init__(self) -> None:
        for name in self.NAMES:
            value = np.ascontiguousarray(getattr(self, name), dtype=float)
            setattr(self, name, value)
            for suffix, default in (('_initial', value.copy()), ('_fired', value * 0.0)):
                given = getattr(self, name + suffix)
                given = np.ascontiguousarray(given, dtype=float) if given.size else default
                setattr(self, name + suffix, given)

    def tables(self) -> tuple[RuleTable, ...]:
        """
        Return every table of rules with its antecedents, as ``RuleTable``.

        Whoever lists, draws, saves or compares rules goes through these.
        """
        scaling = self.scaling
        # What is tracked per metre the law counts in, and the metres at its zero.
        unit, per_m = scaling.get('tracked_unit', 'm'), scaling.get('tracked_per_m', 1.0)
        zero_m = scaling.get('tracked_zero_m', 0.0)
        direction = Antecedent('direction', '', np.arange(2.0), _WAYS.get(unit, DIRECTIONS))
        grid = np.linspace(-1.0, 1.0, SET_COUNT) * per_m
        error = Antecedent(
            'error', unit, grid * scaling.get('error_universe_m', 1.0), SET_WORDS)
        change = Antecedent(
            'change of error', f'{unit}/s', grid * scaling.get('change_universe_m_per_s', 1.0),
            SET_WORDS)
        limit_pa = scaling.get('feedforward_limit_pa', np.inf)
        lower, upper = (per_m * (scaling.get(name, default) - zero_m) for name, default in (
            ('reference_lower_m', 0.0), ('reference_upper_m', 1.0)))
        rates = per_m * signed_logarithmic_knots(
            scaling.get('motion_rate_fine_m_per_s', 1.0),
            scaling.get('motion_rate_upper_m_per_s', 1.0), self.motion.shape[1])
        described: list[tuple[str, tuple[Antecedent, ...], float, float]] = [
            ('feedback', (direction, error, change), 1.0, scaling.get('feedback_gain_pa', 1.0)),
            ('feedforward', (direction, Antecedent(
                'reference', unit, np.linspace(
                    lower, upper, self.feedforward.shape[1]))), limit_pa, 1.0),
            ('motion', (
                Antecedent('reference', unit, np.linspace(
                    lower, upper, self.motion.shape[0])),
                Antecedent('rate of the reference', f'{unit}/s', rates)), limit_pa, 1.0)]
        if self.path.size:
            described.append(('path', (self._path_antecedent(unit, per_m), Antecedent(
                'contraction', unit, np.linspace(
                    lower, upper, self.path.shape[1]))), limit_pa, 1.0))
        return tuple(
            RuleTable(name, antecedents, getattr(self, name), getattr(self, name + '_initial'),
                      getattr(self, name + '_fired'), limit, scale, 'Pa')
            for name, antecedents, limit, scale in described)

    def _path_antecedent(self, unit: str, per_m: float) -> Antecedent:
        """Return the sets of the path."""
        sets = self.path.shape[0]
        fading = int(self.scaling.get('path_fading_sets', 0))
        words = ('any', *['play'] * (sets - 1 - fading), *[FADING] * fading) if fading else ()
        widths_m = path_widths_m({**self.scaling, 'path_sets': sets})
        return Antecedent('path', unit, per_m * widths_m, words)

    def arrays(self, suffix: str = '') -> Tables:
        """Return the arrays of all tables: values, or with '_initial', '_fired' those."""
        return tuple(getattr(self, name + suffix) for name in self.NAMES)

    def stacked(self) -> Tables:
        """
        Let the arrays of each table lie in one array; return these arrays.

        Their first axis is value, initial value, count of firing, and a copy of the value. A
        compiled step that takes them is called faster than with each array by itself.
        """
        feedback, feedforward, motion, path = (self._stack(name) for name in self.NAMES)
        return feedback, feedforward, motion, path

    def _stack(self, name: str) -> FloatArray:
        value = getattr(self, name)
        stack = np.stack(
            [value, getattr(self, name + '_initial'), getattr(self, name + '_fired'), value])
        for suffix, layer in zip(('', '_initial', '_fired'), stack):
            setattr(self, name + suffix, layer)
        return stack

    def copy(self) -> 'RuleBase':
        """Return an independent copy."""
        return RuleBase(scaling=dict(self.scaling), **{
            name + suffix: getattr(self, name + suffix).copy()
            for name in self.NAMES for suffix in ('', '_initial', '_fired')},
            numbers=self.numbers.copy(), covariance=self.covariance.copy())

    def assign(self, other: 'RuleBase') -> None:
        """
        Take over the numbers of another rule base of equal shape, in place.

        One that knows nothing of a model of the muscle leaves that as it is.
        """
        for suffix in ('', '_initial', '_fired'):
            for mine, theirs in zip(self.arrays(suffix), other.arrays(suffix)):
                mine[...] = theirs
        if self.numbers.size and np.any(other.covariance):
            self.numbers[...], self.covariance[...] = other.numbers, other.covariance

    def reset(self) -> None:
        """Return to the initial rules and forget how often they fired."""
        for values, initial, fired in zip(
                self.arrays(), self.arrays('_initial'), self.arrays('_fired')):
            values[...] = initial
            fired[...] = 0.0

    def has_learned(self) -> bool:
        """Return whether any rule, or what is known of the muscle, is not that of no teaching."""
        untaught = {'feedback': linear_feedback_table()}
        return bool(np.any(self.covariance)) or any(
            np.any(values != untaught.get(name, 0.0))
            for name, values in zip(self.NAMES, self.arrays()))

    def digest(self) -> str:
        """Return the sha256 of the rules as hexadecimal text."""
        total = hashlib.sha256()
        for value in self.arrays():
            if not value.size:        # no path rules: the digest of those without
                continue
            total.update(str(value.shape).encode())
            total.update(value.astype('<f8').tobytes())
        return total.hexdigest()

    def knots_m(self) -> FloatArray:
        """Return the reference positions [m] the feed-forward rules stand for."""
        return np.linspace(
            self.scaling['reference_lower_m'], self.scaling['reference_upper_m'],
            self.feedforward.shape[1])

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the rules to a file, whole or not at all; see ``rule_text.save_rules``."""
        save_rules(self, path)
