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

"""What an effect file declares."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TYPE_CHECKING

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.effects.declaration import check_declaration
from pam_sim.effects.fitting import Fitting, FreeParameter
from pam_sim.errors import InputError
from pam_sim.parameters import check_parameters, Parameter
from pam_sim.plugins import file_of_user, raise_with_file
from pam_sim.records import put, put_some, record
from pam_sim.valve import VALVES

if TYPE_CHECKING:
    from pam_sim.rig import Rig


class Numbers(NamedTuple):
    """
    The rig's numbers an effect may need to pack its parameters.

    Parameters
    ----------
    dt_s, substep_s : float
        Step and physics step.
    valve : str
        ``ppr`` or ``hsv``.
    fidelity : str
        ``averaged`` or ``switching``.
    parameters : dict
        Name to value of the rig.
    signal : tuple of float
        Valve signal before the start.
    pressure_pa, contraction_m, force_n : float
        State at the start, pressure absolute.
    muscle : Muscle
        Dimensions and force law.

    """

    dt_s: float
    substep_s: float
    valve: str
    fidelity: str
    parameters: Mapping[str, float]
    signal: tuple[float, ...] = (0.0, 0.0)
    pressure_pa: float = 0.0
    contraction_m: float = 0.0
    force_n: float = 0.0
    muscle: Any = None


@dataclass(frozen=True)
class Reported:
    """
    A quantity a result states for an effect; ``function(values, rig)`` computes it.

    ``valves`` are the types of valve for which it means something.
    """

    name: str
    unit: str
    function: Callable[[Mapping[str, float], Any], float]
    valves: tuple[str, ...] = VALVES


# Numbers of an effect from its parameters and those of the rig.
Packing = Callable[[Mapping[str, float], Numbers], Mapping[str, Any]]


def _as_they_are(values: Mapping[str, float], numbers: Numbers) -> Mapping[str, float]:
    return values


def _at_zero(values: Mapping[str, float], numbers: Numbers) -> dict[str, float]:
    return {}


def _size_of(parameter: Parameter) -> float:
    """Return a size from which a fit begins, within the range."""
    size: float = abs(parameter.default) or 1e-3 * max(abs(parameter.lower), abs(parameter.upper))
    return size if size <= parameter.upper else -size


def _check_start(effect: 'Effect') -> None:
    """Refuse a state that is a pressure and would begin in a vacuum."""
    names = () if effect.states is None else effect.states.names or ()
    for name in names if effect.initial is _at_zero else ():
        if name.endswith('_pa'):
            raise InputError(
                f'effect `{effect.name}` has the state `{name}` and no `initial`, so it would '
                f'begin at 0 Pa, in a vacuum; write initial=lambda values, numbers: '
                f"{{'{name}': numbers.pressure_pa}}, or what else it is at the start")


_BY_PARAMETERS = np.dtype([])     # stands for the record of the parameters


@dataclass(frozen=True)
class Effect:
    """
    One named addition to the nominal rig.

    Parameters
    ----------
    name, family, subsystem : str
        ``subsystem`` is one of :data:`pam_sim.effects.declaration.SUBSYSTEMS`.
    sentence : str
        What it is, for people.
    opposite : str
        What it is where its first amplitude is negative; by default the same.
    source : str
        Where the equation comes from.
    equation : str
        What it adds to the nominal rig, one line of plain text.
    variant_of : str
        Name of the effect of which this is another formulation; results name that one.
    relative_of : tuple of str
        Names this one could be taken for. Results do not name it, but hold those names against it.
    parameters : tuple of Parameter
        Nominal values are typical sizes, used where a model file gives none.
    amplitude : tuple of str
        Parameters that switch it: all zero means the effect is not there.
    reported : tuple of Reported
        By default the amplitudes.
    states : numpy.dtype, optional
        Record of its states, ``record('anchor_m')``; none by default.
    packed : numpy.dtype, optional
        Record that its hooks read as ``par``; by default of the parameters, by their names.
    pack : callable
        ``pack(values, numbers) -> dict``: what ``packed`` holds, by name.
    initial : callable
        ``initial(values, numbers) -> dict``: states at the start, by name; others are zero.
    valves : tuple of str
        Valve types it can act with.
    order : int
        Effects of one hook are applied by rising order, then name.
    active : callable, optional
        ``active(values, numbers) -> bool``; by default any amplitude not zero.
    fitting : Fitting
        What a fit to recordings needs: ranges, starts, look-alikes.

    """

    name: str
    family: str
    subsystem: str
    sentence: str
    source: str
    parameters: tuple[Parameter, ...]
    amplitude: tuple[str, ...]
    reported: tuple[Reported, ...] = ()
    equation: str = ''
    opposite: str = ''
    variant_of: str = ''
    relative_of: tuple[str, ...] = ()
    states: np.dtype[Any] | None = None
    packed: np.dtype[Any] = field(default_factory=lambda: _BY_PARAMETERS)
    pack: Packing = _as_they_are
    initial: Packing = _at_zero
    valves: tuple[str, ...] = VALVES
    order: int = 50
    active: Callable[[Mapping[str, float], Numbers], bool] | None = None
    fitting: Fitting = Fitting()
    hooks: dict[str, Callable[..., Any]] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        """
        Fill in the record of the packed values and check the declaration.

        Raises
        ------
        InputError
            A name that numpy uses, a pressure that would begin in a vacuum, or what
            :mod:`pam_sim.effects.declaration` refuses: unknown words, no amplitude, what is no
            parameter, a range that cannot be fitted.

        """
        check_declaration(self)
        _check_start(self)
        record(self.name)       # all effects stand in one record
        if self.packed is _BY_PARAMETERS:
            object.__setattr__(self, 'packed', record(*(p.name for p in self.parameters)))

    @property
    def sensor_parameter(self) -> str:
        """Return the parameter that is the bias, the gain error or the lag of a sensor."""
        return self.fitting.sensor_parameter or self.amplitude[0]

    def sentence_for(self, values: Mapping[str, float]) -> str:
        """Return what it is, for people, with these parameters; some may be left out."""
        return self.opposite if self.opposite and values.get(
            self.amplitude[0], 0.0) < 0.0 else self.sentence

    def free_parameters(self, valve: str) -> tuple[FreeParameter, ...]:
        """Return what is fitted with a type of valve; by default every amplitude."""
        declared = tuple(free for free in self.fitting.free if valve in free.valves)
        return declared or tuple(
            FreeParameter(p.name, _size_of(p), p.lower, p.upper)
            for p in self.parameters if p.name in self.amplitude)

    def values(self, given: Mapping[str, Any] | Iterable[tuple[str, Any]] = (),
               where: str = '') -> dict[str, float]:
        """Return all parameter values, checked; nominal where not given (see Parameter)."""
        return check_parameters(
            self.parameters, given if isinstance(given, Mapping) else dict(given),
            f'parameter of effect `{self.name}`', where)

    def is_active(self, values: Mapping[str, float], numbers: Numbers) -> bool:
        """Return whether the effect acts with these values on this rig."""
        if numbers.valve not in self.valves:
            return False
        if self.active is not None:
            return bool(self.active(values, numbers))
        return any(values[name] != 0.0 for name in self.amplitude)

    def pack_into(self, values: Mapping[str, float], numbers: Numbers, par: FloatArray, place: int,
                  state: FloatArray, state_place: int) -> bool:
        """
        Write packed parameters and initial states, if the effect acts.

        Parameters
        ----------
        values : dict
            All parameters of the effect.
        numbers : Numbers
            Of the rig.
        par, state : ndarray of float64
            Arrays that hold its records, ``packed`` and ``states``.
        place, state_place : int
            Numbers before its records in them.

        Returns
        -------
        bool
            Whether it acts.

        """
        if not self.is_active(values, numbers):
            return False
        put(par, self.packed, self.pack(values, numbers), place)
        if self.states is not None:
            put_some(state, self.states, self.initial(values, numbers), state_place)
        return True

    def report(self, values: Mapping[str, float],
               rig: 'Rig | None') -> dict[str, tuple[float, str]]:
        """
        Return reported name -> (value, unit) for a rig; all of them without one.

        Where nothing is declared, the amplitudes tell the size.

        Raises
        ------
        InputError
            A function of a file of the user fails.

        """
        found = {}
        for item in self.reported:
            if rig is not None and rig.valve not in item.valves:
                continue
            try:
                found[item.name] = float(item.function(values, rig)), item.unit
            except Exception as error:      # whatever the functions of somebody else raise
                raise_with_file(file_of_user(item.function),
                                f'`{item.name}` that effect `{self.name}` reports fails', error)
                raise
        return found or {p.name: (float(values[p.name]), p.unit) for p in self.parameters
                         if p.name in self.amplitude}
