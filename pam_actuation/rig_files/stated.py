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

"""What a rig or a joint states: in lines for a person, and as plain data for programs."""

from collections.abc import Mapping, Sequence
import math
from typing import Any

from pam_sim.effects.registry import effects
from pam_sim.joint.parameters import PARAMETERS as OF_JOINT
from pam_sim.joint.rig import JointRig
from pam_sim.parameters import Parameter
from pam_sim.rig import Rig
from pam_sim.rig_text import rig_title
from pam_sim.sensors import SENSOR_PARAMETERS, ZEROS
from pam_sim.units import behind_number, gauge_kpa
from pam_sim.valve import hsv, ppr


def stated(rig: Rig | JointRig) -> dict[str, Any]:
    """
    Return what a rig or a joint states, as plain data in SI.

    A joint has ``range_rad``, ``numbers`` and for each muscle the same as a rig.
    """
    if isinstance(rig, JointRig):
        return {'rig': rig.name, 'load': rig.load, 'valve': rig.valve,
                'range_rad': list(rig.range_rad),
                'numbers': [{'name': p.name, 'unit': p.unit, 'value': rig.parameters[p.name]}
                            for p in OF_JOINT],
                'muscles': {place.rstrip('/'): stated(one) for place, one in rig.muscles.items()}}
    return {'rig': rig.name, 'load': rig.load, 'valve': rig.valve,
            'muscle': {'bore_m': rig.muscle.bore_m, 'length_m': rig.muscle.length_m},
            **numbers(rig),
            'exact': [{'name': p.name, 'unit': p.unit, 'value': rig.number(p.name)}
                      for p in _exact(rig)],
            'effects': {one.name: one.parameters for one in rig.effects},
            'sensors': {p.name: rig.sensors[p.name] for p in _of_sensors(rig)}}


def stated_text(rig: Rig | JointRig) -> list[str]:
    """Return the same in lines; the first one is the title."""
    if not isinstance(rig, JointRig):
        return [rig_title(rig), *_muscle_text(rig)]
    low, high = map(math.degrees, rig.range_rad)
    lines = [rig_title(rig), f'joint that moves from {low:.4g} to {high:.4g} degrees']
    lines += [f'  {p.name}: {rig.parameters[p.name]:.6g}{behind_number(p.unit)}'
              for p in OF_JOINT]
    for place, muscle in rig.muscles.items():
        first, *more = _muscle_text(muscle)
        lines += [f'{place.rstrip("/")}: {first}', *more]
    return lines


def numbers(rig: Rig) -> dict[str, Any]:
    """Return the numbers that are not exact, as plain data: ``unknown`` and ``about``."""
    return {'unknown': list(rig.unknown), 'about': [
        {'name': p.name, 'unit': p.unit, 'value': rig.number(p.name),
         'sd': rig.prior_sd(p.name)} for p in _inexact(rig)]}


def numbers_text(rig: Rig) -> list[str]:
    """Return a line on each number that is not exact."""
    lines = [f'  {p.name}: unknown, {p.allowed}' for p in rig.number_list
             if p.name in rig.unknown]
    return lines + [
        f'  {p.name}: {rig.number(p.name):.6g} ± {_short(rig.prior_sd(p.name))}'
        f'{behind_number(p.unit)}{_as_gauge(rig, p.name)}' for p in _inexact(rig)]


def _muscle_text(rig: Rig) -> list[str]:
    """Return size, load and valve of a rig, then its numbers, effects and sensors."""
    size = f'muscle of {1e3 * rig.muscle.bore_m:.4g} mm by {1e3 * rig.muscle.length_m:.4g} mm'
    exact = [f'  {p.name}: {rig.number(p.name):.6g}{behind_number(p.unit)}'
             f'{_as_gauge(rig, p.name)}, exact' for p in _exact(rig)]
    acting = [f'  effect {one.name}: {_said(effects()[one.name].parameters, one.parameters)}'
              for one in rig.effects]
    added = _of_sensors(rig)
    return [f'{size}, load {rig.load}, valve {rig.valve}', *numbers_text(rig), *exact, *acting,
            *([f'  sensors: {_said(added, rig.sensors)}'] if added else [])]


def _said(parameters: Sequence[Parameter], values: Mapping[str, float]) -> str:
    """Return numbers with their units, in one line."""
    return ', '.join(f'{p.name} {values[p.name]:.6g}{behind_number(p.unit)}' for p in parameters)


def _of_sensors(rig: Rig) -> list[Parameter]:
    """Return the settings of the sensors that are not nominal."""
    return [p for p in SENSOR_PARAMETERS if rig.sensors[p.name] != p.default]


def _as_gauge(rig: Rig, name: str) -> str:
    """Return the supply pressure once more as people read it; '' for another number."""
    return '' if name != 'supply_pa' else (
        f' absolute ({gauge_kpa(rig.number(name)):.4g} kPa gauge)')


def _short(sd: float) -> str:
    """Return a standard deviation in three digits, without a power of ten where it is large."""
    text = f'{sd:.3g}'
    return f'{float(text):.0f}' if 'e+' in text else text


def _of_this_valve(rig: Rig) -> list[Parameter]:
    """Return the parameters of a rig without those of the other kind of valve."""
    other = {p.name for p in (hsv if rig.valve == 'ppr' else ppr).PARAMETERS}
    return [p for p in rig.number_list if p.name not in other]


def _inexact(rig: Rig) -> list[Parameter]:
    """Return the parameters of rig and valve that are neither unknown nor exact."""
    return [p for p in _of_this_valve(rig) if p.name in rig.tolerance
            and p.name not in rig.unknown and rig.prior_sd(p.name) > 0.0]


def _exact(rig: Rig) -> list[Parameter]:
    """Return the exact numbers of muscle, load and valve."""
    known = {p.name for p in (*_inexact(rig), *ZEROS, *rig.law_list)}
    return [p for p in _of_this_valve(rig) if p.name not in known and p.name not in rig.unknown]
