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

"""The numbers of an identification: those that are unknown, and those known to a deviation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math

from pam_sim.effects.registry import effect_parameter, get_effect
from pam_sim.effects.setting import EffectSetting
from pam_sim.errors import did_you_mean, InputError
from pam_sim.gap.data.health import LENGTH
from pam_sim.gap.data.noise import SMALLEST
from pam_sim.gap.subsystems.effects import acts_on
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.muscle.coefficients import PREFIX, stated_names
from pam_sim.rig import Rig
from pam_sim.sensors.zeros import ZEROS
from pam_sim.tolerance import UNKNOWN

# A range over more than this factor is one of scales: its middle is that of the logarithms.
SCALE_RATIO = 5.0
# A size that may be 0, as of a spring, is spread evenly up to here and by logarithms beyond.
SMALL_SHARE = 1e-3           # of its range
LARGEST_LOGARITHM = 50.0
ZERO_NAMES = tuple(p.name for p in ZEROS)
FARTHEST_SD = 6.0            # of a number with a prior


@dataclass(frozen=True)
class Number:
    """
    A number that is fitted.

    Parameters
    ----------
    name : str
        Of a parameter of the rig, or ``EFFECT.PARAMETER``.
    effect, parameter : str
        Where it stands: effect ('' for the rig itself) and parameter.
    unit : str
    start, lower, upper : float
        SI.
    sd : float
        Standard deviation of the prior, ``inf`` for an unknown one.
    subsystem : str
        Of a number of the measurement alone, such as a latency; '' for one of the rig.
    description : str
        For people.
    shape : bool
        Of an effect, with a prior for its logarithm; ``sd`` is that of the logarithm.

    """

    name: str
    effect: str
    parameter: str
    unit: str
    start: float
    lower: float
    upper: float
    sd: float = math.inf
    subsystem: str = ''
    description: str = ''
    shape: bool = False

    @property
    def unknown(self) -> bool:
        """Tell whether there is no prior but the range."""
        return math.isinf(self.sd)

    @property
    def of_law(self) -> bool:
        """Tell whether it is a coefficient of the force law."""
        return self.name.startswith(PREFIX)

    @property
    def is_scale(self) -> bool:
        """Tell whether it is fitted by its logarithm."""
        return self.unknown and self.lower > 0.0 and self.upper / self.lower > SCALE_RATIO

    @property
    def is_size(self) -> bool:
        """Tell whether it may be 0 or anything above, over a wide range."""
        return self.unknown and self.lower == 0.0

    @property
    def small(self) -> float:
        """Return what is small for a size, in its unit."""
        return SMALL_SHARE * self.upper

    @property
    def step(self) -> float:
        """Return what one unit of the coordinate is where it is the same everywhere."""
        return 0.05 * (self.upper - self.lower) if self.unknown else self.sd

    @property
    def zero_of(self) -> str:
        """Return the signal whose sensor has this zero; '' for other numbers."""
        return self.name.partition('_zero')[0] if self.name in ZERO_NAMES else ''

    @property
    def resolution(self) -> float:
        """Return what no sensor of such a rig resolves, of a zero; 0 for other numbers."""
        return SMALLEST[self.zero_of] if self.zero_of else 0.0

    def slope(self, value: float) -> float:
        """Return what one unit of the coordinate is at a value, in the number's unit."""
        if self.is_scale:
            return value
        if self.shape:
            return self.sd * value
        return math.hypot(value, self.small) if self.is_size else self.step

    def value(self, coordinate: float) -> float:
        """Return the value of a coordinate, within the range."""
        if self.is_scale:
            found = self.start * math.exp(min(coordinate, LARGEST_LOGARITHM))
        elif self.shape:
            found = self.start * math.exp(min(self.sd * coordinate, LARGEST_LOGARITHM))
        elif self.is_size:
            at = coordinate + math.asinh(self.start / self.small)
            found = self.small * math.sinh(max(min(at, LARGEST_LOGARITHM), 0.0))
        else:
            found = self.start + self.step * coordinate
        return min(max(found, self.lower), self.upper)

    def coordinate(self, value: float) -> float:
        """Return the coordinate of a value."""
        if self.is_scale:
            return math.log(value / self.start)
        if self.shape:
            return math.log(value / self.start) / self.sd
        if self.is_size:
            return math.asinh(value / self.small) - math.asinh(self.start / self.small)
        return (value - self.start) / self.step

    def bounds(self) -> tuple[float, float]:
        """Return the lowest and highest coordinate."""
        low, high = self.coordinate(self.lower), self.coordinate(self.upper)
        return (low, high) if self.unknown else (max(low, -FARTHEST_SD), min(high, FARTHEST_SD))

    def acts_in(self, problem: SubsystemProblem) -> bool:
        """Tell whether it changes what a subsystem gives."""
        if self.effect:
            return (acts_on(self.effect, problem.subsystem)
                    or get_effect(self.effect).fitting.sensor_signal == 'contraction')
        signal = self.zero_of
        if signal:
            return signal == 'pressure' or problem.subsystem != 'valve' and (
                signal == 'contraction' or signal in problem.signals)
        if self.name == LENGTH and all('contraction' in one.stamp_ns
                                       for one in problem.recordings):
            return False                # what was recorded counts
        return any(k.name == self.name for k in problem.known) and (
            not self.subsystem or self.subsystem == problem.subsystem)


def with_unknown(rig: Rig, names: Sequence[str] = ()) -> tuple[Rig, list[str], list[Number]]:
    """
    Return (rig in which they are unknown, names, unknown numbers): what is asked of a rig.

    Parameters
    ----------
    rig : pam_sim.Rig
        Its tolerances say what is unknown.
    names : sequence of str
        Further ones, as ``unknown_numbers`` takes them, or ``law`` for all on which the force
        depends. Those returned are single coefficients.

    Raises
    ------
    InputError
        There is no such number, or none is unknown.

    """
    single = [n for name in names for n in stated_names(rig.muscle.law, name, 'unknown number')]
    of_rig = {p.name for p in rig.number_list}
    rig = rig.with_(tolerance={name: UNKNOWN for name in single if name in of_rig})
    wanted = unknown_numbers(rig, single)
    if not wanted:
        raise InputError('no number is unknown: state `unknown` in `tolerance`, or name numbers',
                         rig.name)
    return rig, single, wanted


def unknown_numbers(rig: Rig, names: Sequence[str] = ()) -> list[Number]:
    """
    Return the unknown numbers of a rig, those its file says and those named.

    Parameters
    ----------
    rig : pam_sim.Rig
        Its tolerances say what is unknown, its values where the search begins.
    names : sequence of str
        A parameter of the rig, a coefficient ``law.NAME`` of its force law, or
        ``EFFECT.PARAMETER``.

    Raises
    ------
    InputError
        There is no such number.

    """
    parameters = {p.name: p for p in rig.number_list}
    found: dict[str, Number] = {}
    for name in (*rig.unknown, *names):
        if name in parameters:
            p = parameters[name]
            value = rig.number(name)
            # A rig refuses a length beyond the stroke of its muscle.
            upper = min(p.upper, rig.muscle.max_strain * rig.muscle.length_m) if (
                name == LENGTH) else p.upper
            found[name] = Number(name, '', name, p.unit, value if value > 0.0 or p.lower <= 0.0
                                 else p.default, p.lower, upper, description=p.description)
            continue
        if '.' not in name or name.startswith(PREFIX):
            raise InputError(
                f'`{name}` is no number of the rig{did_you_mean(name, parameters)}; allowed: '
                f'{", ".join(parameters)}, or EFFECT.PARAMETER', 'unknown number')
        found[name] = _of_effect(rig, name)
    return list(found.values())


def _of_effect(rig: Rig, name: str) -> Number:
    effect, p = effect_parameter(name, 'unknown number')
    here = rig.effect(effect.name)
    start = here.parameters.get(p.name, p.default) if here is not None else (
        max(0.0, p.lower) if p.name in effect.amplitude else p.default)
    return Number(name, effect.name, p.name, p.unit, float(start), p.lower, p.upper,
                  description=p.description)


def known_numbers_of(problems: Sequence[SubsystemProblem], unknown: Sequence[Number]
                     ) -> list[Number]:
    """Return the numbers with a prior that act in the subsystems, each once."""
    taken = {n.name for n in unknown}
    found: dict[str, Number] = {}
    for problem in problems:
        for k in problem.known:
            if k.name not in taken and not k.unknown:
                found.setdefault(k.name, Number(
                    k.name, '', k.name, k.unit, k.value, k.lower, k.upper, k.sd,
                    '' if k.of_rig else problem.subsystem))
    return list(found.values())


def with_values(rig: Rig, numbers: Sequence[Number], values: Mapping[str, float]) -> Rig:
    """Return the rig with the values of the numbers that stand in it."""
    parameters, effects = {}, {e.name: e for e in rig.effects}
    for n in numbers:
        if n.effect:
            here = effects.get(n.effect)
            kept = dict(here.parameters) if here is not None else {}
            effects[n.effect] = EffectSetting(n.effect, {**kept, n.parameter: values[n.name]})
        elif not n.subsystem:
            parameters[n.name] = values[n.name]
    return rig.with_(parameters=parameters, effects=list(effects.values()))
