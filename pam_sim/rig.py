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

"""The rig: muscle, valve, load, effects and sensors as one object that can be simulated."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, overload, TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from pam_sim.annotations import FloatArray, Number
from pam_sim.declared import check_mapping, shown
from pam_sim.effects.setting import EffectSetting, settings_of
from pam_sim.errors import InputError
from pam_sim.load import LOADS
from pam_sim.load.registry import has_force, load_force_n
from pam_sim.muscle.coefficients import coefficients, own_value, PREFIX, with_numbers
from pam_sim.muscle.muscle import get_muscle, LawChoice, Muscle, muscle_of
from pam_sim.parameters import check_given, check_parameters, Parameter
from pam_sim.rig_parameters import rig_parameters
from pam_sim.rig_text import rig_to_yaml
from pam_sim.sensors import SENSOR_PARAMETERS
from pam_sim.tolerance import prior_sd, Tolerance, tolerances, UNKNOWN
from pam_sim.units import GRAVITY_M_PER_S2, LOWEST_PA, P_ATM_PA
from pam_sim.valve import hsv, ppr, VALVES

if TYPE_CHECKING:
    from pam_sim.plant import Plant
    from pam_sim.response import Response

_HALVINGS = 52              # of the stroke, to the last bit


@dataclass(frozen=True)
class Rig:
    """
    A rig; made by :func:`pam_sim.load_rig`, changed by :meth:`with_`.

    Parameters
    ----------
    name : str
    load : str
        ``hanging_mass``, ``isometric``, ``driven``, or another of ``pam_sim.load.LOADS``.
    valve : str
        ``ppr`` or ``hsv``.
    fidelity : str
        HSV only: ``averaged`` or ``switching``.
    parameters : dict
        Every rig parameter, name -> value, SI.
    effects : list of EffectSetting
    sensors : dict
        Sensor settings, name -> value (see :class:`pam_sim.sensors.SensorChain`).
    tolerance : dict
        Parameter name -> how well it is known: a relative standard deviation, an
        ``AbsoluteSd``, or ``UNKNOWN`` (infinite). ``law.NAME``, where stated, is a coefficient
        of the force law.
    muscle : Muscle or str
        Dimensions and force law, or the name of a muscle; ``dmsp_5_300`` by default.

    """

    name: str
    load: str
    valve: str = 'ppr'
    fidelity: str = 'averaged'
    parameters: dict[str, float] = field(default_factory=dict)
    effects: list[EffectSetting] = field(default_factory=list)
    sensors: dict[str, float] = field(default_factory=dict)
    tolerance: dict[str, Tolerance] = field(default_factory=dict)
    muscle: Muscle = field(default_factory=lambda: get_muscle('dmsp_5_300'))

    def __post_init__(self) -> None:
        """Check the choices and fill in nominal numbers."""
        for value, choices, where in ((self.load, tuple(LOADS), 'load'),
                                      (self.valve, VALVES, 'valve'),
                                      (self.fidelity, hsv.FIDELITIES, 'fidelity')):
            if value not in choices:
                raise InputError(f'`{value}` is not known; allowed: {", ".join(choices)}', where)
        if not isinstance(self.name, str):
            raise InputError(f'is {shown(self.name)}; a text is needed', 'name')
        object.__setattr__(self, 'muscle', muscle_of(self.muscle))
        _ = self.muscle.least_volume_m3         # refused here where the law has no volume
        known = rig_parameters(self.load)
        check_mapping(self.parameters, 'parameters')
        _check_contraction(self.parameters, self.muscle)
        checked: dict[str, object] = {
            'parameters': check_parameters(known, self.parameters),
            'sensors': check_parameters(SENSOR_PARAMETERS, self.sensors, 'sensor setting'),
            'tolerance': tolerances(known, self.tolerance, self.law_list),
            'effects': settings_of(self.effects)}
        for name, ready in checked.items():
            object.__setattr__(self, name, ready)

    @property
    def parameter_list(self) -> tuple[Parameter, ...]:
        """Parameter descriptions (unit, bounds, nominal, tolerance) of this rig."""
        return rig_parameters(self.load)

    @property
    def law_list(self) -> tuple[Parameter, ...]:
        """Coefficients of the force law as parameters ``law.NAME``; none of a table."""
        return coefficients(self.muscle.law)

    @property
    def number_list(self) -> tuple[Parameter, ...]:
        """Parameters of the rig, then the coefficients of its force law."""
        return (*self.parameter_list, *self.law_list)

    def number(self, name: str) -> float:
        """Return the value of a parameter of the rig or of a coefficient ``law.NAME``."""
        return (own_value(self.muscle.law, name) if name.startswith(PREFIX)
                else self.parameters[name])

    @property
    def unknown(self) -> tuple[str, ...]:
        """Names of the parameters that are stated as unknown, in the order of model files."""
        return tuple(name for name, known in self.tolerance.items() if known == UNKNOWN)

    @property
    def unknown_of_law(self) -> tuple[str, ...]:
        """Those of ``unknown`` that are coefficients of the force law."""
        return tuple(name for name in self.unknown if name.startswith(PREFIX))

    def prior_sd(self, name: str) -> float:
        """
        Return the standard deviation with which a parameter is known, in its unit.

        That of an unknown one is half of its range, see :func:`pam_sim.tolerance.prior_sd`.
        A coefficient ``law.NAME`` is a parameter, too.

        Raises
        ------
        InputError
            Unknown name.

        """
        parameter = next((p for p in self.number_list if p.name == name), None)
        if parameter is None:
            raise InputError(f'unknown parameter `{name}`; allowed: '
                             + ', '.join(p.name for p in self.number_list), self.name)
        return prior_sd(parameter, self.number(name), self.tolerance[name])

    @property
    def is_driven(self) -> bool:
        """Whether the contraction is given, as at a held length or in a joint."""
        return not LOADS[self.load].MOVES_FREELY

    @property
    def signal_names(self) -> tuple[str, ...]:
        """Names of the valve signals, in order."""
        return ppr.SIGNAL_NAMES if self.valve == 'ppr' else hsv.SIGNAL_NAMES

    @property
    def signal_range(self) -> tuple[float, float, str]:
        """Smallest and largest value of a valve signal, and its unit."""
        return ppr.SIGNAL_RANGE if self.valve == 'ppr' else hsv.SIGNAL_RANGE

    def effect(self, name: str) -> EffectSetting | None:
        """Return the setting of an effect of this rig, or None."""
        return next((item for item in self.effects if item.name == name), None)

    def with_(self, parameters: dict[str, float] | None = None,
              effects: Sequence[EffectSetting | Mapping[str, Any] | str] | None = None,
              valve: str | None = None, fidelity: str | None = None, load: str | None = None,
              sensors: Mapping[str, float] | None = None, name: str | None = None,
              muscle: Muscle | str | None = None, law: LawChoice | str | None = None,
              tolerance: Mapping[str, Tolerance] | None = None,
              volume: str | None = None) -> 'Rig':
        """
        Return a changed copy.

        Parameters
        ----------
        parameters : dict, optional
            Numbers to change, the others stay; ``law.NAME`` is a coefficient of the force law.
        effects : list, optional
            The effects instead of the present ones (``EffectSetting``, dict or name).
        valve, fidelity, load, name : str, optional
            As of the class; parameters the new load does not have are dropped.
        sensors : dict, optional
            Sensor settings to change.
        muscle : str or Muscle, optional
            Another muscle.
        law : str or LawChoice, optional
            Another force law for the muscle; a name takes the set of the nearest bore.
        tolerance : dict, optional
            How well numbers are known, those to change.
        volume : str, optional
            Another volume of the muscle: ``bore`` or ``law``.

        Raises
        ------
        InputError
            Unknown name, value out of bounds, or something of another kind.

        """
        for given, where in ((parameters, 'parameters'), (sensors, 'sensors'),
                             (tolerance, 'tolerance')):
            if given is not None:
                check_mapping(given, where)
        if all(other is None for other in (sensors, muscle, law, tolerance, volume)) and all(
                other is None or other == own for other, own in (
                    (valve, self.valve), (fidelity, self.fidelity), (load, self.load),
                    (name, self.name))):
            return self._with_numbers(parameters or {}, effects)
        new_load = load or self.load
        chosen = self.muscle if muscle is None else muscle_of(muscle)
        if law is not None:
            chosen = chosen.with_law(law)
        if volume is not None:
            chosen = chosen.with_volume(volume)
        numbers, chosen = with_numbers(chosen, parameters or {})
        known = {p.name for p in rig_parameters(new_load)} if new_load in tuple(LOADS) else set()
        kept = {key: value for key, value in self.parameters.items() if key in known}
        if chosen.law.name == self.muscle.law.name:
            known_too = known | {key for key in self.tolerance if key.startswith(PREFIX)}
        else:
            known_too = known
        tolerated = {key: value for key, value in self.tolerance.items() if key in known_too}
        tolerated.update(tolerance or {})
        return replace(
            self, name=name or self.name, load=new_load, valve=valve or self.valve,
            fidelity=fidelity or self.fidelity, parameters={**kept, **numbers},
            effects=self.effects if effects is None else settings_of(effects, self.effects),
            tolerance=tolerated, sensors={**self.sensors, **(sensors or {})}, muscle=chosen)

    def _with_numbers(self, parameters: Mapping[str, float], effects: Sequence[
            EffectSetting | Mapping[str, Any] | str] | None) -> 'Rig':
        """
        Return a copy with other numbers or effects; arguments and errors as of ``with_``.

        A fit asks for one before every simulation, so only what changes is checked.
        """
        given, muscle = with_numbers(self.muscle, parameters)
        numbers = {**self.parameters, **check_given(rig_parameters(self.load), given)}
        _check_contraction(numbers, muscle)
        settings = list(self.effects) if effects is None else settings_of(effects, self.effects)
        changed = object.__new__(Rig)
        vars(changed).update(
            vars(self), parameters=numbers, effects=settings, muscle=muscle,
            sensors=dict(self.sensors), tolerance=dict(self.tolerance))
        return changed

    # -- statics ---------------------------------------------------------------------------
    @overload
    def static_pressure_pa(self, contraction_m: float, load_n: float | None = None) -> float:
        ...

    @overload
    def static_pressure_pa(self, contraction_m: FloatArray,
                           load_n: FloatArray | float | None = None) -> FloatArray:
        ...

    def static_pressure_pa(self, contraction_m: FloatArray | float,
                           load_n: FloatArray | float | None = None) -> FloatArray | float:
        """
        Return the absolute pressure [Pa] at which the muscle holds a contraction.

        The force map with its gain, no effects; never below atmospheric pressure, inf
        where no pressure suffices, NaN where a number given is NaN.

        Parameters
        ----------
        contraction_m : float or ndarray
            Contraction to hold, m.
        load_n : float or ndarray, optional
            Tension to hold, N; by default what the load asks for at rest.

        Raises
        ------
        InputError
            No ``load_n`` for a load without weight.

        """
        if load_n is None:
            load_n = self.tension_n(np.asarray(contraction_m, float))
        pressure = P_ATM_PA + self.muscle.law.law.holding_pressure_pa(
            np.asarray(load_n, float) / self.parameters['force_map_gain'],
            np.asarray(contraction_m, float) / self.muscle.length_m)
        return float(pressure) if np.ndim(pressure) == 0 else pressure

    @overload
    def static_contraction_m(self, pressure_pa: float, load_n: float | None = None) -> float:
        ...

    @overload
    def static_contraction_m(self, pressure_pa: FloatArray,
                             load_n: FloatArray | float | None = None) -> FloatArray:
        ...

    def static_contraction_m(self, pressure_pa: FloatArray | float,
                             load_n: FloatArray | float | None = None) -> FloatArray | float:
        """
        Return the contraction [m] at rest, 0 to the stroke, at an absolute pressure [Pa].

        The force map with its gain, no effects; scalars or arrays. NaN where a load is NaN.

        Raises
        ------
        InputError
            No ``load_n`` for a load without weight; a pressure that is NaN, or too low to be
            absolute and in Pa.

        """
        if not np.all(np.asarray(pressure_pa, float) >= LOWEST_PA):
            raise InputError(f'is {shown(pressure_pa)}; a pressure is absolute and in Pa, '
                             f'{LOWEST_PA:g} or more', 'pressure_pa')
        if load_n is None:
            if self.parameters.get('spring_n_per_m', 0.0) > 0.0 or has_force(LOADS[self.load]):
                return self._rest_against_load_m(pressure_pa)
            load_n = self.tension_n(0.0)
        strain = self.muscle.law.law.max_strain(
            np.maximum(np.asarray(pressure_pa, float) - P_ATM_PA, 0.0),
            np.asarray(load_n, float) / self.parameters['force_map_gain'])
        contraction = self.muscle.length_m * np.minimum(strain, self.muscle.max_strain)
        return float(contraction) if np.ndim(contraction) == 0 else contraction

    def tension_n(self, contraction_m: Number) -> Number:
        """
        Return the tension [N] that the load asks for at rest at a contraction [m].

        Weight, and what the spring beside it adds, or the own force of the load; scalar or
        array.

        Raises
        ------
        InputError
            A load without weight.

        """
        if 'mass_kg' not in self.parameters:
            raise InputError(f'load `{self.load}` has no weight; give load_n', self.name)
        if has_force(LOADS[self.load]):
            return load_force_n(LOADS[self.load], self.parameters, contraction_m,
                                0.0 * contraction_m)
        return (self.parameters['mass_kg'] * GRAVITY_M_PER_S2
                + self.parameters['spring_n_per_m'] * contraction_m)

    def force_at_start_n(self, contraction_m: float) -> float:
        """Return the force [N] that a free load asks for at rest; 0 of one that is held."""
        return 0.0 if self.is_driven else self.tension_n(contraction_m)

    def force_of_motion_n(self, contraction_m: FloatArray, velocity_m_per_s: FloatArray,
                          acceleration_m_per_s2: FloatArray) -> FloatArray:
        """
        Return the force [N] at the load cell that a motion of a free load asks for.

        Inertia, weight and spring of a hanging mass; inertia and own force of any other load.
        """
        mass_kg: float = self.parameters['mass_kg']
        if not has_force(LOADS[self.load]):
            return (mass_kg * (acceleration_m_per_s2 + GRAVITY_M_PER_S2)
                    + self.parameters['spring_n_per_m'] * contraction_m)
        return mass_kg * acceleration_m_per_s2 + load_force_n(
            LOADS[self.load], self.parameters, contraction_m, velocity_m_per_s)

    def load_stiffness_n_per_m(self, contraction_m: Number) -> Number | float:
        """Return by how much the force of a free load rises with contraction, N/m."""
        if not has_force(LOADS[self.load]):
            return self.parameters['spring_n_per_m']
        half = 1e-3 * self.muscle.stroke_m
        return (self.tension_n(contraction_m + half)
                - self.tension_n(contraction_m - half)) / (2.0 * half)

    def load_damping_n_s_per_m(self, contraction_m: float, speed_m_per_s: float) -> float:
        """Return by how much the force of a free load rises with speed, up to one, N s/m."""
        load = LOADS[self.load]
        if not has_force(load):
            return 0.0
        up, down = (load_force_n(load, self.parameters, contraction_m, speed)
                    for speed in (speed_m_per_s, -speed_m_per_s))
        return (up - down) / (2.0 * speed_m_per_s)

    def _rest_against_load_m(self, pressure_pa: FloatArray | float) -> FloatArray | float:
        """Return the contraction at rest where the load's force changes with it, by bisection."""
        given_pa = np.asarray(pressure_pa, float)
        low = np.zeros(given_pa.shape)
        high = low + self.muscle.stroke_m
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            beyond = self.static_contraction_m(given_pa, self.tension_n(middle)) > middle
            low, high = np.where(beyond, middle, low), np.where(beyond, high, middle)
        return float(low) if np.ndim(low) == 0 else low

    # -- dynamics --------------------------------------------------------------------------
    @property
    def muscles(self) -> dict[str, 'Rig']:
        """Return its one muscle by the place below its namespace: {'': the rig itself}."""
        return {'': self}

    def pack(self, dt_s: float = 0.001, initial_pressure_pa: float = P_ATM_PA,
             initial_contraction_m: float | None = None,
             initial_signal: npt.ArrayLike | None = None) -> tuple[FloatArray, FloatArray]:
        """
        Return (state, par), float64 arrays for the kernel (see pam_sim.rollout.layout).

        Parameters
        ----------
        dt_s : float
            Step, s; a switching HSV pair does several physics steps of 0.1 ms in it.
        initial_pressure_pa : float
            Absolute, Pa.
        initial_contraction_m : float, optional
            By default where the rig rests at that pressure.
        initial_signal : tuple of float, optional
            Valve signal before the start; by default PPR the voltage of that
            pressure, HSV both shut.

        Raises
        ------
        InputError
            A start value or step out of range.

        """
        from pam_sim.rollout.packing import pack_rig
        return pack_rig(self, dt_s, initial_pressure_pa, initial_contraction_m, initial_signal)

    def simulate(self, valve_signal: npt.ArrayLike, external_force_n: npt.ArrayLike | None = None,
                 contraction_m: npt.ArrayLike | None = None, initial_pressure_pa: float = P_ATM_PA,
                 dt_s: float = 0.001, initial_contraction_m: float | None = None,
                 initial_signal: npt.ArrayLike | None = None) -> 'Response':
        """
        Simulate with recorded or made-up inputs, each held from sample i to i + 1.

        Parameters
        ----------
        valve_signal : array_like, shape (N,) or (N, 2)
            PPR voltage [V], or HSV fill and vent duty [0..1].
        external_force_n : float or array_like, shape (N,), optional
            N, against contraction positive.
        contraction_m : float or array_like, shape (N + 1,) or (N,), optional
            Driven load: contraction at the samples, linear in between, m.
            Isometric load: one number instead of the model's.
        initial_pressure_pa : float
            Absolute, Pa.
        dt_s : float
            Step, s.
        initial_contraction_m, initial_signal
            As for :meth:`pack`.

        Returns
        -------
        Response

        Raises
        ------
        InputError
            Wrong shape, no numbers, one that is not finite or out of range, the contraction of a
            driven load missing, or a simulation that leaves what is physical.

        """
        from pam_sim.rollout.simulate import simulate_rig
        return simulate_rig(self, valve_signal, external_force_n, contraction_m, dt_s, {
            'initial_pressure_pa': initial_pressure_pa,
            'initial_contraction_m': initial_contraction_m, 'initial_signal': initial_signal})

    def plant(self, seed: int = 0, dt_s: float = 0.001, **initial: Any) -> 'Plant':
        """Return a live :class:`pam_sim.plant.Plant` of this rig."""
        from pam_sim.plant import Plant
        return Plant(self, seed, dt_s, **initial)

    # -- text ------------------------------------------------------------------------------
    def to_yaml(self) -> str:
        """Return a model file that :func:`pam_sim.load_rig` turns into an equal rig."""
        return rig_to_yaml(self)

    def volume_m3(self, contraction_m: Number, pressure_pa: Number | float = P_ATM_PA) -> Number:
        """
        Return muscle and dead volume [m^3] at a contraction [m]; scalars or arrays.

        The absolute pressure [Pa] counts where the volume of the law depends on it.
        """
        return self.parameters['V_dead'] + self.muscle.volume_m3(
            contraction_m, pressure_pa - P_ATM_PA)


def _check_contraction(numbers: Mapping[str, float], muscle: Muscle) -> None:
    """Refuse a contraction at rest beyond the stroke of the muscle."""
    held_m = numbers.get('contraction_m', 0.0)
    if held_m > muscle.stroke_m:
        raise InputError(
            f'`contraction_m` is {held_m:g}; allowed 0 to {muscle.stroke_m:g} m with muscle '
            f'{muscle.name}', 'parameters')
