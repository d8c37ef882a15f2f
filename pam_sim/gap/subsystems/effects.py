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

"""Where effects act: in which subsystem, and on which reading of a sensor."""

from typing import Protocol, TypeVar

from pam_sim.annotations import FloatArray
from pam_sim.effects.fitting import SENSOR_CHANGES
from pam_sim.effects.registry import get_effect
from pam_sim.load import LOADS
from pam_sim.rig import Rig
from pam_sim.units import P_ATM_PA
from pam_sim.valve import hsv, ppr

_ZERO_OF = {'pressure': 'pressure_zero_pa', 'contraction': 'contraction_zero_m',
            'force': 'force_zero_n'}

Reading = TypeVar('Reading', float, FloatArray)
SensorChanges = tuple[float | None, ...]


class SubsystemNamed(Protocol):
    """Something of one subsystem."""

    subsystem: str


def true_value(signal: str, rig: Rig, value: Reading, rate: Reading) -> Reading:
    """
    Return what a reading means once the sensor effects of the rig are taken out.

    Parameters
    ----------
    signal : {'pressure', 'contraction'}
        Which reading.
    rig : pam_sim.Rig
        Its bias, gain and lag of that sensor count.
    value, rate : float or numpy.ndarray
        What is read, and how fast that changes [1/s].

    """
    return undone(signal, sensor_changes(signal, rig), value, rate)


def sensor_changes(signal: str, rig: Rig) -> SensorChanges:
    """
    Return (bias, gain error, lag in s) of the sensor of a signal, None where there is none.

    Several of one kind act as one, in the order of a simulation. Biases add up, and a later gain
    scales them. Gains multiply. Lags add up, which is exact for motion at a constant rate. The
    bias holds the zero of the sensor, a number of the rig, too. What is none of the three is not
    here.
    """
    found: dict[str, float] = {}
    known = [(get_effect(setting.name), setting.parameters) for setting in rig.effects]
    for effect, values in sorted(known, key=lambda one: (one[0].order, one[0].name)):
        change = effect.fitting.sensor_change
        if effect.fitting.sensor_signal != signal or change not in SENSOR_CHANGES or not values:
            continue
        value = values[effect.sensor_parameter]
        if change == 'gain' and 'bias' in found:
            found['bias'] *= 1.0 + value
        if change not in found:
            found[change] = value
        elif change == 'gain':
            found['gain'] += value + found['gain'] * value
        else:
            found[change] += value
    zero = rig.parameters[_ZERO_OF[signal]]
    if zero != 0.0:
        found['bias'] = found.get('bias', 0.0) + zero
    return tuple(found.get(change) for change in SENSOR_CHANGES)


def undone(signal: str, changes: SensorChanges, value: Reading, rate: Reading) -> Reading:
    """Return what a reading means, given the ``sensor_changes``; other arguments see above."""
    bias, gain_error, lag_s = changes
    zero = P_ATM_PA if signal == 'pressure' else 0.0
    if bias is not None:
        value = value - bias
    if gain_error is not None:
        value = zero + (value - zero) / (1.0 + gain_error)
    if lag_s is not None:
        value = value + lag_s * rate
    return value


def subsystem_of_number(name: str) -> str:
    """Return the subsystem of a number of a rig: ``valve``, ``load``, ``muscle``, ``sensor``."""
    if any(name == p.name for p in (*ppr.PARAMETERS, *hsv.PARAMETERS)):
        return 'valve'
    if name in _ZERO_OF.values():
        return 'sensor'
    of_load = {p.name for load in LOADS.values() for p in load.PARAMETERS}
    return 'load' if name in of_load else 'muscle'


def acts_on(effect: str, subsystem: str) -> bool:
    """Return whether an effect (by name) shows in a subsystem: ``valve`` or ``muscle``."""
    found = get_effect(effect)
    if found.subsystem != 'sensor':
        return (found.subsystem == 'valve') == (subsystem == 'valve')
    return found.fitting.sensor_signal == 'pressure' or subsystem != 'valve'


def shows(effect: str, problem: SubsystemNamed) -> bool:
    """
    Return whether an effect changes the errors of a subsystem.

    What is read of the contraction, the volume behind the valve is taken from, too.
    """
    return (acts_on(effect, problem.subsystem)
            or get_effect(effect).fitting.sensor_signal == 'contraction')
