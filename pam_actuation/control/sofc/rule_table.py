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
The two rule bases of the controller and their inference.

Feedback rules: ``feedback[d, i, j]`` is the singleton in [-1, 1] of the rule
"if moving in direction d and error is set i and change of error is set j".
Feed-forward rules: ``feedforward[d, k]`` [Pa] is the singleton of "if the
reference is near r_k and moves in direction d then add c_k". Directions: 0
contracting, 1 extending; a muscle with hysteresis needs different pressures on
the two branches. At small speed both are active in part.

Inference is product and weighted mean; degrees sum to 1, so the mean needs no
division (zero-order Sugeno form of the rule table of Procyk and Mamdani,
Automatica 15, 1979).
"""

from dataclasses import dataclass, field
import hashlib

import numpy as np
from pam_actuation.control.sofc.membership import SET_COUNT, SET_NAMES, SET_WORDS
from pam_sim.compiled import compiled

CONTRACTING, EXTENDING = 0, 1
DIRECTIONS = ('contracting', 'extending')


@compiled
def contracting_share(rate_m_per_s, blend_speed_m_per_s):
    """Return the degree 0..1 of direction 'contracting' at a rate of the reference [m/s]."""
    share = 0.5 + 0.5 * rate_m_per_s / blend_speed_m_per_s
    return min(max(share, 0.0), 1.0)


@compiled
def infer_feedback(table, share, i, wi, j, wj):
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
def infer_feedforward(table, share, k, wk):
    """Return the output of the feed-forward rules [Pa] at the active knots ``k, wk``."""
    return (share * ((1.0 - wk) * table[0, k] + wk * table[0, k + 1])
            + (1.0 - share) * ((1.0 - wk) * table[1, k] + wk * table[1, k + 1]))


def linear_feedback_table():
    """Return the initial feedback rules (2, 7, 7): the linear surface 0.5 (e + de)."""
    grid = np.linspace(-1.0, 1.0, SET_COUNT)
    surface = 0.5 * (grid[:, None] + grid[None, :])
    return np.stack([surface, surface])


@dataclass(frozen=True)
class Antecedent:
    """One input of a table of rules: ``words`` for sets with names, else ``knots`` in ``unit``."""

    name: str
    unit: str
    knots: np.ndarray
    words: tuple = ()


@dataclass(frozen=True)
class RuleTable:
    """
    One table of a rule base, self-describing.

    ``values``, ``initial`` and ``fired`` are the live arrays of the rule base, one axis per
    antecedent; ``scale`` turns a value into ``unit``, ``limit`` bounds its magnitude.
    """

    name: str
    antecedents: tuple
    values: np.ndarray
    initial: np.ndarray
    fired: np.ndarray
    limit: float
    scale: float
    unit: str


@dataclass
class RuleBase:
    """
    The rules of one controller, what they were at first, and how often they fired.

    Attributes
    ----------
    feedback, feedback_initial : numpy.ndarray
        (2, 7, 7) singletons in [-1, 1].
    feedforward, feedforward_initial : numpy.ndarray
        (2, K) singletons [Pa].
    feedback_fired, feedforward_fired : numpy.ndarray
        Sum of the firing strengths of each rule since the rules were loaded.
    scaling : dict of str -> float
        What the numbers mean: universes, gains, knots, sample time, rig identity. Rules
        fit only a controller of the same scaling.

    """

    NAMES = ('feedback', 'feedforward')

    feedback: np.ndarray
    feedforward: np.ndarray
    scaling: dict = field(default_factory=dict)
    feedback_initial: np.ndarray = None
    feedforward_initial: np.ndarray = None
    feedback_fired: np.ndarray = None
    feedforward_fired: np.ndarray = None

    def __post_init__(self):
        self.feedback = np.ascontiguousarray(self.feedback, dtype=float)
        self.feedforward = np.ascontiguousarray(self.feedforward, dtype=float)
        for name in ('feedback', 'feedforward'):
            value = getattr(self, name)
            for suffix, default in (('_initial', value.copy()), ('_fired', value * 0.0)):
                given = getattr(self, name + suffix)
                given = default if given is None else np.ascontiguousarray(given, dtype=float)
                setattr(self, name + suffix, given)

    def tables(self):
        """Return every table of rules with its antecedents, as ``RuleTable``."""
        scaling = self.scaling
        direction = Antecedent('direction', '', np.arange(2.0), DIRECTIONS)
        grid = np.linspace(-1.0, 1.0, SET_COUNT)
        error = Antecedent(
            'error', 'm', grid * scaling.get('error_universe_m', 1.0), SET_WORDS)
        change = Antecedent(
            'change of error', 'm/s', grid * scaling.get('change_universe_m_per_s', 1.0),
            SET_WORDS)
        limit_pa = scaling.get('feedforward_limit_pa', np.inf)
        span = (scaling.get('reference_lower_m', 0.0), scaling.get('reference_upper_m', 1.0))
        described = (
            ('feedback', (direction, error, change), 1.0, scaling.get('feedback_gain_pa', 1.0)),
            ('feedforward', (direction, Antecedent(
                'reference', 'm', np.linspace(*span, self.feedforward.shape[1]))), limit_pa, 1.0))
        return tuple(
            RuleTable(name, antecedents, getattr(self, name), getattr(self, name + '_initial'),
                      getattr(self, name + '_fired'), limit, scale, 'Pa')
            for name, antecedents, limit, scale in described)

    def copy(self):
        """Return an independent copy."""
        return RuleBase(
            self.feedback.copy(), self.feedforward.copy(), dict(self.scaling),
            self.feedback_initial.copy(), self.feedforward_initial.copy(),
            self.feedback_fired.copy(), self.feedforward_fired.copy())

    def assign(self, other):
        """Take over the numbers of another rule base of equal shape, in place."""
        for name in ('feedback', 'feedforward'):
            for suffix in ('', '_initial', '_fired'):
                getattr(self, name + suffix)[...] = getattr(other, name + suffix)

    def reset(self):
        """Return to the initial rules and forget how often they fired."""
        self.feedback[...] = self.feedback_initial
        self.feedforward[...] = self.feedforward_initial
        self.feedback_fired[...] = 0.0
        self.feedforward_fired[...] = 0.0

    def digest(self):
        """Return the sha256 of the rules as hexadecimal text."""
        total = hashlib.sha256()
        for value in (self.feedback, self.feedforward):
            total.update(str(value.shape).encode())
            total.update(value.astype('<f8').tobytes())
        return total.hexdigest()

    def knots_m(self):
        """Return the reference positions [m] the feed-forward rules stand for."""
        return np.linspace(
            self.scaling['reference_lower_m'], self.scaling['reference_upper_m'],
            self.feedforward.shape[1])

    def sentences(self, least_fired=1.0):
        """Return the rules that fired as sentences, most active first."""
        found = []
        unit = self.scaling.get('feedback_gain_pa', 1.0) * 1e-3
        for (d, i, j), fired in np.ndenumerate(self.feedback_fired):
            if fired >= least_fired:
                found.append((fired, (
                    f'if {DIRECTIONS[d]} and the error is {SET_WORDS[i]} and its change is '
                    f'{SET_WORDS[j]} then add {self.feedback[d, i, j] * unit:+.2f} kPa '
                    f'({SET_NAMES[i]}, {SET_NAMES[j]}; was '
                    f'{self.feedback_initial[d, i, j] * unit:+.2f} kPa)')))
        knots = self.knots_m() if 'reference_lower_m' in self.scaling else None
        for (d, k), fired in np.ndenumerate(self.feedforward_fired):
            if fired >= least_fired and knots is not None:
                found.append((fired, (
                    f'if {DIRECTIONS[d]} and the reference is near {knots[k] * 1e3:.1f} mm then '
                    f'add {self.feedforward[d, k] * 1e-3:+.2f} kPa (was '
                    f'{self.feedforward_initial[d, k] * 1e-3:+.2f} kPa)')))
        return [text for _, text in sorted(found, key=lambda item: -item[0])]

    def save(self, path):
        """Write the rules to a file atomically; see ``persistence.save_rules``."""
        from pam_actuation.control.sofc.persistence import save_rules
        save_rules(self, path)

    @classmethod
    def load(cls, path, expected=None):
        """Return the rules of a file, refused whole if they do not fit ``expected``."""
        from pam_actuation.control.sofc.persistence import load_rules
        return load_rules(path, expected)
