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

"""The questions that describe a rig on a terminal: each with its default and its range."""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from pam_actuation.rig_files.description import Description
from pam_actuation.rig_files.numbers import FORMS, read_range, read_stated
from pam_sim.errors import did_you_mean, InputError
from pam_sim.load import LOADS
from pam_sim.muscle.muscle import DIMENSIONS, get_muscle, Muscle, muscle_names
from pam_sim.parameters import Parameter
from pam_sim.sensors import SENSOR_PARAMETERS
from pam_sim.valve import VALVES
from pam_sim.valve.regulator_presets import get_regulator, regulator_names

OWN = 'own'
SENSORS = ('pressure_noise_pa', 'contraction_noise_m', 'force_noise_n')
Ask = Callable[[str], str]
Tell = Callable[[str], None]
Answer = TypeVar('Answer')


def ask_description(ask: Ask, tell: Tell) -> Description:
    """
    Return what a person answers.

    A wrong answer is told with what is allowed, and the question comes again.

    Parameters
    ----------
    ask : callable
        Shows a text and returns the answer; empty for the default.
    tell : callable
        Shows a line.

    """
    tell(f'Enter takes the default. A number is {FORMS}.')
    found = Description()
    muscle = _choice(ask, tell, 'muscle', (*muscle_names(), OWN), 'dmsp_5_300')
    if muscle == OWN:
        for one, unit, factor in ((DIMENSIONS[0], 'mm', 1e-3), (DIMENSIONS[1], 'mm', 1e-3)):
            found.dimensions[one.name] = _again(ask, tell, (
                f'{one.description} {one.lower / factor:g} to {one.upper / factor:g} {unit} '
                f'[{one.default / factor:g}]: '), _scaled(one, factor))
    else:
        found.muscle = muscle
        _length(ask, tell, found, get_muscle(muscle))
    found.load = _choice(ask, tell, 'load', tuple(LOADS), found.load)
    for parameter in LOADS[found.load].PARAMETERS:
        _stated(ask, tell, found, parameter.name)
    found.valve = _choice(ask, tell, 'valve', VALVES, found.valve)
    if found.valve == 'ppr':
        _regulator(ask, tell, found)
        _stated(ask, tell, found, 'T_m')
    else:
        sizes = found.by_size()
        for name in ('C', 'V_dead', 'supply_pa'):
            _stated(ask, tell, found, name, sizes[name].value if name in sizes else None)
    for parameter in SENSOR_PARAMETERS:
        if parameter.name in SENSORS:
            value = _again(ask, tell, _question(parameter), _scaled(parameter, 1.0))
            if value != parameter.default:
                found.sensors[parameter.name] = value
    return found


def _length(ask: Ask, tell: Tell, found: Description, like: Muscle) -> None:
    """Ask for the length of a muscle of the list: it is sold in any length."""
    one = next(p for p in DIMENSIONS if p.name == 'length_m')
    length_m = _again(ask, tell, (
        f'{one.description} {1e3 * one.lower:g} to {1e3 * one.upper:g} mm '
        f'[{1e3 * like.length_m:g}]: '), _scaled(replace(one, default=like.length_m), 1e-3))
    if length_m != like.length_m:
        found.dimensions[one.name] = length_m


def _regulator(ask: Ask, tell: Tell, found: Description) -> None:
    name = _choice(ask, tell, 'regulator', (*regulator_names(), OWN), OWN)
    preset = None if name == OWN else get_regulator(name)
    found.regulator = None if preset is None else name
    if preset is None or preset.lowest_v is None:
        found.volts = _again(ask, tell, 'Range of the input, LOW:HIGH in V [0:6]: ',
                             lambda said: read_range(said or '0:6', 'input', 'V'))
    if preset is None:
        low, high = _again(ask, tell, 'Gauge pressure at these ends, LOW:HIGH in kPa [0:600]: ',
                           lambda said: read_range(said or '0:600', 'pressure', 'kPa'))
        found.gauge_pa = 1e3 * low, 1e3 * high


def _stated(ask: Ask, tell: Tell, found: Description, name: str,
            default: float | None = None) -> None:
    parameter = next(p for p in found.parameters if p.name == name)
    if default is not None:
        parameter = replace(parameter, default=default)

    def read(said: str) -> None:
        if said:
            found.numbers[name] = read_stated(said, parameter, name)
    _again(ask, tell, _question(parameter), read)


def _question(parameter: Parameter) -> str:
    return f'{parameter.description} {parameter.name}, {parameter.allowed} ' \
           f'[{parameter.default:g}]: '


def _scaled(parameter: Parameter, factor: float) -> Callable[[str], float]:
    def read(said: str) -> float:
        if not said:
            return float(parameter.default)
        try:
            value = float(said)
        except ValueError:
            raise InputError(f'`{said}` is not a number; allowed {parameter.allowed}') from None
        return parameter.check(round(value * factor, 12))
    return read


def _choice(ask: Ask, tell: Tell, what: str, allowed: tuple[str, ...], default: str) -> str:
    def read(said: str) -> str:
        if (said or default) not in allowed:
            raise InputError(f'`{said}` is not known{did_you_mean(said, allowed)}; allowed: '
                             f'{", ".join(allowed)}')
        return said or default
    return _again(ask, tell, f'{what.capitalize()}: {", ".join(allowed)} [{default}]: ', read)


def _again(ask: Ask, tell: Tell, question: str, read: Callable[[str], Answer]) -> Answer:
    """Ask until the answer can be read."""
    while True:
        said = ask(question).strip()         # an end of the answers ends the questions
        try:
            return read(said)
        except InputError as mistake:
            tell(f'  {mistake}')
