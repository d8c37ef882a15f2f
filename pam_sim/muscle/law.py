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

"""What every muscle law has in common: parameters, named sets, ranges, static inverses."""

from collections.abc import Mapping
from dataclasses import dataclass, field
import math
from typing import Any
import warnings

import numpy as np
from numpy.typing import ArrayLike
from pam_sim.annotations import BoolArray, FloatArray
from pam_sim.compiled import Compiled
from pam_sim.errors import InputError
from pam_sim.muscle.over_points import over_points
from pam_sim.muscle.rules import check_rules, MAX_STRAIN, MIN_STRAIN
from pam_sim.parameters import check_parameters, Parameter
from pam_sim.records import record, values_of

OUTSIDE = ('warn', 'refuse', 'allow')
_AIR_PRESSURES = 61
BORE_FITS = 1.5              # factor between the bores of a muscle and of a set that fits it


class ExtrapolationWarning(UserWarning):
    """A law was asked outside the range in which its numbers are known."""


@dataclass(frozen=True)
class Validity:
    """
    Range in which the numbers of a set are known.

    Parameters
    ----------
    pressure_gauge_pa, strain : tuple of float
        Lower and upper end, inclusive: Pa, and share of the length at rest.

    """

    pressure_gauge_pa: tuple[float, float] = (0.0, 600e3)
    strain: tuple[float, float] = (0.0, 0.25)


@dataclass(frozen=True)
class ParameterSet:
    """
    Named numbers of one muscle.

    Parameters
    ----------
    values : dict
        Parameter name to SI value.
    rests_on : str
        Where the numbers come from and how far to trust them.
    validity : Validity
    bore_m : float
        Bore of the muscle whose force they give; 0 where nobody says.

    """

    values: dict[str, float] = field(default_factory=dict)
    rests_on: str = ''
    validity: Validity = Validity()
    bore_m: float = 0.0


class MuscleLaw:
    """
    Static force of a muscle against gauge pressure and contraction.

    A subclass states the class attributes; ``tension_n`` of its file is the formula.

    Parameters
    ----------
    values : mapping, optional
        Parameters that differ from the set; SI.
    muscle : str, optional
        Name of a parameter set; the first one by default.
    where : str
        Place for error messages.

    Attributes
    ----------
    NAME, EQUATION, FORMULA, SOURCE : str
        Name, number in the chapter, formula as text, paper.
    PARAMETERS : tuple of Parameter
    SETS : dict
        Set name to ParameterSet.
    CLAIMS : tuple of int
        Which of ``rules.RULES`` the law claims.
    PACKED : numpy.dtype
        Record ``par`` of the compiled formula; by default of the parameters, by their names.
    COMPILED : callable
        ``tension_n(gauge_pa, strain, par)`` of the file, for arrays as for a rig.
    COMPILED_DAMPER : callable or None
        For a law with a damper,
        ``damper_force_n(velocity_m_per_s, gauge_pa, strain, par)`` of the file; compiled, not
        clipped, with the values of :meth:`pack` in the record ``par``.
    COMPILED_VOLUME : callable or None
        For a law with a volume of its own, ``volume_m3(gauge_pa, strain, par)`` of the file: the
        inner volume [m^3].
    EXTRAPOLATES : bool
        Whether the formula goes on outside its range; else a rollout flags it.

    Raises
    ------
    InputError
        Unknown set or parameter, value out of bounds, or numbers that break a
        claimed rule.

    """

    NAME = ''
    EQUATION = ''
    FORMULA = ''
    SOURCE = ''
    PARAMETERS: tuple[Parameter, ...] = ()
    SETS: dict[str, ParameterSet] = {'default': ParameterSet()}
    CLAIMS: tuple[int, ...] = ()
    # Put here by the registry from the law's file.
    COMPILED: Compiled[..., float]
    COMPILED_DAMPER: Compiled[..., float] | None = None
    COMPILED_VOLUME: Compiled[..., float] | None = None
    EXTRAPOLATES = True
    PACKED = record()

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Let the record of a law that states none hold its parameters."""
        super().__init_subclass__(**kwargs)
        if 'PACKED' not in vars(cls):
            cls.PACKED = record(*(parameter.name for parameter in cls.PARAMETERS))

    def __init__(self, values: Mapping[str, float] | None = None, muscle: str | None = None,
                 where: str = '') -> None:
        muscle = next(iter(self.SETS)) if muscle is None else muscle
        if muscle not in self.SETS:
            raise InputError(f'law `{self.NAME}` has no set `{muscle}`; '
                             f'allowed: {", ".join(self.SETS)}', where)
        self.muscle = muscle
        self.validity = self.SETS[muscle].validity
        own = {} if values is None else values
        check_parameters(self.PARAMETERS, own, f'parameter of `{self.NAME}`', where)
        self.values = check_parameters(
            self.PARAMETERS, {**self.SETS[muscle].values, **own}, f'parameter of set `{muscle}`',
            where)
        self._check(where)

    @classmethod
    def set_for(cls, bore_m: float, where: str = '') -> str:
        """
        Return the name of the set whose bore is nearest to that of a muscle.

        The first one of a law none of whose sets states a bore.

        Raises
        ------
        InputError
            No set is of a bore that fits.

        """
        bores = {name: one.bore_m for name, one in cls.SETS.items() if one.bore_m > 0.0}
        if not bores:
            return next(iter(cls.SETS))
        nearest = min(bores, key=lambda name: abs(math.log(bores[name] / bore_m)))
        if abs(math.log(bores[nearest] / bore_m)) > math.log(BORE_FITS):
            known = ', '.join(f'{name} ({1e3 * bore:g} mm)' for name, bore in bores.items())
            raise InputError(f'law `{cls.NAME}` has no set of numbers for a bore of '
                             f'{1e3 * bore_m:g} mm; name the one to start from with `set`: '
                             f'{known}', where)
        return nearest

    def _check(self, where: str) -> None:
        """Raise InputError where the parameters together make no muscle; the rules are tried."""
        if hasattr(type(self), 'COMPILED'):     # not before its file is read
            check_rules(self, where)

    def _tension_n(self, pressure: FloatArray, strain: FloatArray) -> FloatArray:
        """Return the formula's value [N], negative where the muscle would push."""
        return self._over_points(type(self).COMPILED, pressure, strain)

    def _over_points(self, formula: Compiled[..., float], pressure: FloatArray,
                     strain: FloatArray) -> FloatArray:
        pressure, strain = np.broadcast_arrays(pressure, strain)
        found = np.empty(pressure.size)
        over_points(formula, type(self).PACKED)(
            pressure.astype(float).ravel(), strain.astype(float).ravel(), self._packed_values(),
            found)
        return found.reshape(pressure.shape)

    def _packed_values(self) -> FloatArray:
        return values_of(self.PACKED, self.pack())

    def pack(self) -> Mapping[str, Any]:
        """Return what the record ``PACKED`` holds, by name."""
        return self.values

    def outside(self, pressure_gauge_pa: ArrayLike, strain: ArrayLike) -> BoolArray:
        """Return True where the point is outside the range of the numbers; arrays broadcast."""
        low_p, high_p = self.validity.pressure_gauge_pa
        low_e, high_e = self.validity.strain
        pressure, contraction = np.asarray(pressure_gauge_pa, float), np.asarray(strain, float)
        beyond: BoolArray = (
            (pressure < low_p * (1 - 1e-9)) | (pressure > high_p * (1 + 1e-9))
            | (contraction < low_e - 1e-9) | (contraction > high_e + 1e-9))
        return beyond

    def _judged(self, pressure_gauge_pa: ArrayLike, strain: ArrayLike,
                outside: str) -> tuple[FloatArray, FloatArray]:
        pressure = np.asarray(pressure_gauge_pa, dtype=float)
        contraction = np.asarray(strain, dtype=float)
        if outside not in OUTSIDE:
            raise InputError(f'is {outside!r}; allowed: {", ".join(OUTSIDE)}', 'outside')
        if not np.all(np.isfinite(pressure)) or np.any(pressure < 0.0):
            raise InputError('gauge pressure must be finite and not negative',
                             'pressure_gauge_pa')
        if not np.all((contraction >= MIN_STRAIN) & (contraction <= MAX_STRAIN)):
            raise InputError(
                f'contraction must be a number from {MIN_STRAIN} to {MAX_STRAIN}', 'strain')
        beyond = np.zeros((), bool) if outside == 'allow' else self.outside(
            pressure, contraction)
        if np.any(beyond):
            low_p, high_p = self.validity.pressure_gauge_pa
            low_e, high_e = self.validity.strain
            text = (f'law `{self.NAME}` ({self.muscle}) is known from {low_p / 1e3:g} to '
                    f'{high_p / 1e3:g} kPa and from {100 * low_e:g} to {100 * high_e:g} % '
                    f'contraction; {np.count_nonzero(beyond)} point(s) lie outside')
            if outside == 'refuse':
                raise InputError(text, 'force_n')
            warnings.warn(text, ExtrapolationWarning, stacklevel=3)
        return pressure, contraction

    def outside_table_text(self) -> str:
        """Return the end of a sentence on what lies outside the table, with its range."""
        low_pa, high_pa = self.validity.pressure_gauge_pa
        return (f'outside the table of law `{self.NAME}`, {low_pa / 1e3:g} to {high_pa / 1e3:g} '
                f'kPa and up to {100.0 * self.validity.strain[1]:.3g} % contraction; its edge was '
                'used')

    def formula_n(self, pressure_gauge_pa: ArrayLike, strain: ArrayLike) -> FloatArray:
        """Return the unclipped value [N] of the formula, for fits; checked, never warned."""
        return self._tension_n(*self._judged(pressure_gauge_pa, strain, 'allow'))

    def force_n(self, pressure_gauge_pa: ArrayLike, strain: ArrayLike,
                outside: str = 'warn') -> FloatArray:
        """
        Return the static tension [N], never negative; arrays broadcast.

        Parameters
        ----------
        pressure_gauge_pa : float or ndarray
            Gauge pressure, Pa.
        strain : float or ndarray
            Contraction over length at rest.
        outside : str
            ``warn``, ``refuse`` or ``allow`` points outside ``validity``.

        Raises
        ------
        InputError
            Not finite, negative pressure, impossible contraction, or a point
            outside the range with ``outside='refuse'``.

        """
        force = self._tension_n(*self._judged(pressure_gauge_pa, strain, outside))
        return np.maximum(0.0, force)[()]

    def volume_m3(self, pressure_gauge_pa: ArrayLike, strain: ArrayLike) -> FloatArray:
        """
        Return the law's own inner volume [m^3]; checked, never warned; arrays broadcast.

        Raises
        ------
        InputError
            The law has none, or as of ``force_n``.

        """
        formula = type(self).COMPILED_VOLUME
        if formula is None:
            raise InputError(f'law `{self.NAME}` has no volume of its own')
        return self._over_points(
            formula, *self._judged(pressure_gauge_pa, strain, 'allow'))[()]

    def air_grid_pa(self) -> FloatArray:
        """Return gauge pressures [Pa], rising, at which the law's own volume is looked at."""
        return np.linspace(*self.validity.pressure_gauge_pa, _AIR_PRESSURES)

    def max_strain(self, pressure_gauge_pa: ArrayLike, load_n: ArrayLike = 0.0) -> FloatArray:
        """
        Return the contraction at which the tension has fallen to a load; arrays broadcast.

        Bisection on the formula, from rest to full contraction; 0 where the
        load is not lifted, NaN where it is NaN. Points outside the range are not flagged here.
        """
        pressure, load = np.broadcast_arrays(
            np.asarray(pressure_gauge_pa, float), np.asarray(load_n, float))
        low, high = np.zeros(pressure.shape), np.full(pressure.shape, MAX_STRAIN)
        lifted = self.formula_n(pressure, low) > load       # all that follows is as sound
        for _ in range(52):
            middle = np.asarray(0.5 * (low + high))
            pulls = self._tension_n(pressure, middle) > load
            low, high = np.where(pulls, middle, low), np.where(pulls, high, middle)
        found = np.where(lifted, 0.5 * (low + high), 0.0)
        return np.where(np.isnan(load), np.nan, found)[()]

    def holding_pressure_pa(self, force_n: ArrayLike, strain: ArrayLike,
                            upper_pa: float = 2e6) -> FloatArray:
        """
        Return the gauge pressure [Pa] that gives a tension; arrays broadcast.

        Bisection, by rule 2; 0 where no pressure is needed, inf where
        ``upper_pa`` does not suffice, NaN where one is given. Points outside the range are not
        flagged.

        Parameters
        ----------
        force_n : float or ndarray
            Tension to hold, N.
        strain : float or ndarray
            Contraction over length at rest.
        upper_pa : float
            Largest gauge pressure tried, Pa.

        """
        force, contraction = np.broadcast_arrays(
            np.asarray(force_n, float), np.asarray(strain, float))
        unknown = np.isnan(force) | np.isnan(contraction)
        contraction = np.where(unknown, 0.0, contraction)
        low, high = np.zeros(force.shape), np.full(force.shape, float(upper_pa))
        holds_alone = self.formula_n(low, contraction) >= force
        self._judged(high, contraction, 'allow')        # all between is as sound
        for _ in range(52):
            middle = np.asarray(0.5 * (low + high))
            short = self._tension_n(middle, contraction) < force
            low, high = np.where(short, middle, low), np.where(short, high, middle)
        found = np.where(self._tension_n(high, contraction) < force, np.inf, 0.5 * (low + high))
        found = np.where(holds_alone, 0.0, found)
        return np.where(unknown, np.nan, found)[()]
