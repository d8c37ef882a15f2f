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

"""The simulated run of a rig on which a linear model of it is identified, see ``lqi_model``."""

from typing import Any

import numpy as np
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.loops.bus import Bus
from pam_actuation.loops.wiring import attach, attach_plant, driver_tick
from pam_actuation.messages import Message, Pressure
from pam_actuation.plant_loop import PlantLoop
from pam_actuation.random_levels import RandomLevels
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.rig import Rig
from pam_sim.units import gauge_kpa, P_ATM_PA

MIDDLE_M = 0.014
_SEED = 0
# Rest, then random levels to both sides of the middle.
_REST_S, _EXCITATION_S, _LEFT_OUT_S = 3.0, 30.0, 2.0
_EXCITED_PA = 4e4
_HOLDS_S = 0.1, 0.8
_HIGHEST_PA = 1_300_000.0      # the most any experiment asks for


def identification_record(rig: Rig, rate_hz: float) -> tuple[FloatArray, FloatArray]:
    """
    Return (command [absolute Pa], measured contraction [m]) of a simulated run of a rig.

    The data are 30 s of random pressure steps about the pressure that holds ``MIDDLE_M``,
    through the driver law and with sensor noise. The first two seconds at rest are left out.

    Raises
    ------
    InputError
        No pressure that a muscle bears holds this contraction.

    """
    middle_pa = float(rig.static_pressure_pa(MIDDLE_M))
    swing_pa = min(_EXCITED_PA, 0.9 * (middle_pa - P_ATM_PA))
    if not P_ATM_PA < middle_pa <= _HIGHEST_PA - swing_pa:
        raise InputError(
            f'{MIDDLE_M:g} m needs {gauge_kpa(middle_pa):.0f} kPa; identification needs one '
            f'above 0 and below {gauge_kpa(_HIGHEST_PA - swing_pa):.0f} kPa', rig.name)
    levels = RandomLevels(
        middle_pa - swing_pa, middle_pa + swing_pa, *_HOLDS_S, _EXCITATION_S, _SEED)
    sent: dict[str, list[Any]] = {'pressure_command': [], 'contraction': []}

    def note(topic: str, message: Message, now_ns: int) -> None:
        if topic in sent:
            sent[topic].append(message)

    bus = Bus(on_sent=note)

    def send_command(now_ns: int) -> None:
        t_s = now_ns * 1e-9
        command_pa = middle_pa if t_s < _REST_S else levels.at(t_s - _REST_S)
        bus.send('pressure_command', Pressure(now_ns, command_pa), now_ns)

    driver = DriverLoop(rig.valve, driver_config(rig))
    attach(bus, driver)
    ticks = int((_REST_S + _EXCITATION_S) * rate_hz)
    times_ns = range(0, ticks * round(1e9 / rate_hz), round(1e9 / rate_hz))
    bus.add(attach_plant(bus, PlantLoop(rig, seed=_SEED)), times_ns)
    bus.add(send_command, times_ns)
    bus.add(driver_tick(bus, driver), times_ns[::_ticks_of_driver(rig, driver, rate_hz)])
    bus.run_until()
    first = int(_LEFT_OUT_S * rate_hz)
    return (np.array([one.pressure_pa for one in sent['pressure_command'][first:]]),
            np.array([one.contraction_m for one in sent['contraction'][first:]]))


def _ticks_of_driver(rig: Rig, driver: DriverLoop, rate_hz: float) -> int:
    """Return after how many ticks of the controller the driver ticks."""
    return max(1, round(driver.period_s * rate_hz)) if rig.valve == 'hsv' else 1
