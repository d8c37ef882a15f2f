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

"""What a fit to recordings needs to know of an effect; declared in the file of the effect."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
import math

from pam_sim.declared import check_fields
from pam_sim.valve import VALVES

# What comes this late in quick motion is not a multiple of what comes a little late.
DELAY_STARTS_S = (0.01, 0.002)
# What a sensor measures, and what an effect can do to it.
SENSOR_SIGNALS = ('pressure', 'contraction', 'force')
SENSOR_CHANGES = ('bias', 'gain', 'lag')
OTHER_CHANGE = 'other'              # none of them: `pam gap` does not take it out of a reading
_MAX_LOGARITHM = 50.0


@dataclass(frozen=True)
class FreeParameter:
    """
    A parameter of an effect that is fitted.

    Parameters
    ----------
    name : str
    typical : float
        Typical size; start of the screening.
    lower, upper : float
        Range that keeps the meaning of the effect.
    shape : bool
        Fitted on a logarithmic scale, from several starts.
    starts : tuple of float
        Values the screening tries; ``typical`` by default.
    ends : tuple of str
        Of ``lower`` and ``upper`` those at which a shape turns the effect into another one.
    valves : tuple of str
        Types of valve with which it is fitted.

    """

    name: str
    typical: float
    lower: float
    upper: float
    shape: bool = False
    starts: tuple[float, ...] = ()
    ends: tuple[str, ...] = ('lower', 'upper')
    valves: tuple[str, ...] = VALVES

    def __post_init__(self) -> None:
        """Refuse what is no text, number or tuple where one is needed."""
        check_fields(self, f'free parameter `{self.name}`')

    def value(self, coordinate: float) -> float:
        """Return the value of a normalised coordinate, kept within the range."""
        value = self.typical * (
            math.exp(min(coordinate, _MAX_LOGARITHM)) if self.shape else coordinate)
        return min(max(value, self.lower), self.upper)

    def coordinate(self, value: float) -> float:
        """Return the normalised coordinate of a value."""
        return math.log(value / self.typical) if self.shape else value / self.typical


@dataclass(frozen=True)
class Fitting:
    """
    How an effect is fitted, and with which others it can be confused.

    Parameters
    ----------
    free : tuple of FreeParameter
        What is fitted. By default every amplitude, from its nominal size over its whole range.
        Ranges are narrower than those of a model file: at its extremes one effect turns into
        another, and a name would mean nothing.
    refinement : bool
        It contains another formulation of its name and adds little, so it is tried after that.
    limits : tuple of str
        Simpler look-alikes that it contains. One that explains as much is named instead.
    together : tuple of str
        Formulations that usually come with it. All are tried at once where neither one effect
        nor two explain a subsystem.
    remembers : bool
        Its force depends on the past, so that a loop stays open. At one speed of motion all
        such effects look alike, and they are a set.
    same_as : str
        Parameter of the model that does the same.
    same_without_force : str
        Parameter of the model that does the same to all signals but a measured force.
    same_without_command : str
        Parameter of the model that does the same where no command of a valve is recorded.
    delay : str
        Parameter by which the effect is late as a whole, as behind the filter of a sensor.
    pure_delay : bool
        Whether ``delay`` delays the command of the valve and changes nothing else, so that no
        recording tells it from a latency of all sensors.
    edges : tuple of str
        Parameters by which rising and falling edges are late, each by its own.
    sensor_signal, sensor_change : str
        Of an effect of a sensor: the reading it changes, and how: ``bias``, ``gain``, ``lag``
        or ``other``.
    sensor_parameter : str
        Parameter that is the bias, the gain error or the lag; the amplitude by default.
    reservoir : tuple of str
        Of a supply that empties: parameters that are its volume [m³], which is fitted first, and
        band [Pa] and flow [kg/s] of its compressor.
    is_limit : callable, optional
        ``is_limit(values) -> bool``: whether values make it a limit although no shape is at
        the end of its range.

    """

    free: tuple[FreeParameter, ...] = ()
    refinement: bool = False
    limits: tuple[str, ...] = ()
    together: tuple[str, ...] = ()
    remembers: bool = False
    same_as: str = ''
    same_without_force: str = ''
    same_without_command: str = ''
    delay: str = ''
    pure_delay: bool = False
    edges: tuple[str, ...] = ()
    sensor_signal: str = ''
    sensor_change: str = ''
    sensor_parameter: str = ''
    reservoir: tuple[str, ...] = ()
    is_limit: Callable[[Mapping[str, float]], bool] | None = None

    def __post_init__(self) -> None:
        """Refuse what is no text or tuple where one is needed."""
        check_fields(self, 'fitting')
