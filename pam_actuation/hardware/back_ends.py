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

"""All back ends by name, and how one is opened."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any, TYPE_CHECKING, TypeVar

from pam_actuation.hardware.device_watchdog import DeviceWatchdog
from pam_actuation.hardware.dummy import DummySensors, DummyValve
from pam_actuation.hardware.failures import device_error
from pam_actuation.hardware.iio_adc import IioAdc
from pam_actuation.hardware.iio_dac import IioDac
from pam_actuation.hardware.other_packages import SENSOR_GROUP, VALVE_GROUP, with_others
from pam_actuation.hardware.pwm_sysfs import PwmPair
from pam_actuation.hardware.sensor_input import MUSCLE, PLACE, SensorInput, TOPICS
from pam_actuation.hardware.sim import SimulatedValve
from pam_actuation.hardware.sysfs import DeviceError
from pam_actuation.hardware.valve_output import GuardedOutput, ValveOutput
from pam_sim.errors import InputError
from pam_sim.parameters import Parameter

if TYPE_CHECKING:
    from pam_actuation.drivers.config import DriverConfig

OWN_VALVE_OUTPUTS: dict[str, type[ValveOutput]] = {
    'sim': SimulatedValve, 'dummy': DummyValve, 'iio_dac': IioDac, 'pwm_sysfs': PwmPair}
OWN_SENSOR_INPUTS: dict[str, type[SensorInput]] = {'dummy': DummySensors, 'iio_adc': IioAdc}
NO_DEVICE = ('sim', 'dummy')        # behind these outputs
VALVE_OUTPUTS = with_others(OWN_VALVE_OUTPUTS, VALVE_GROUP, ValveOutput)
SENSOR_INPUTS = with_others(OWN_SENSOR_INPUTS, SENSOR_GROUP, SensorInput)

BackEnd = type[ValveOutput] | type[SensorInput]
Told = TypeVar('Told')


def parameters_of(back_ends: Mapping[str, BackEnd]) -> tuple[Parameter, ...]:
    """Return the parameters of several back ends, each once."""
    return tuple({parameter.name: parameter for back_end in back_ends.values()
                  for parameter in back_end.PARAMETERS}.values())


def open_valve(name: str, valve_type: str, values: dict[str, Any], config: 'DriverConfig',
               safe_efforts: tuple[float, ...], watchdog_s: float = 0.0) -> GuardedOutput:
    """
    Open the output a valve hangs on; it vents from then on.

    Parameters
    ----------
    name : str
        Key of ``VALVE_OUTPUTS``.
    valve_type : str
        ``ppr`` or ``hsv``.
    values : dict
        Parameters of the back ends by name.
    config : DriverConfig
        What the driver knows of the valve.
    safe_efforts : tuple of float
        The signal that vents.
    watchdog_s : float
        Silence of this process [s] from which another one vents the device; 0: none does.

    Raises
    ------
    InputError
        The back end does not drive that valve, or its device is not usable.

    """
    back_end = VALVE_OUTPUTS[name]
    if valve_type not in back_end.VALVE_TYPES:
        fitting = [key for key, one in VALVE_OUTPUTS.items() if valve_type in one.VALVE_TYPES]
        raise InputError(
            f'{name} does not drive a valve of type {valve_type}, choose '
            f'{" or ".join(fitting)}', 'parameter backend')

    def opened() -> GuardedOutput:
        device = back_end(values, config)
        device.safe_efforts = safe_efforts
        try:
            device.open()
            device.vent()
            writes = device.safe_writes() if watchdog_s else ()
            return GuardedOutput(device, DeviceWatchdog(writes, watchdog_s) if writes else None)
        except BaseException:
            with suppress(BaseException):
                device.close()
            device.release()
            raise
    return _tell(opened, back_end, values)


def open_sensors(name: str, values: dict[str, Any]) -> SensorInput:
    """
    Return the sensors of a back end, a key of ``SENSOR_INPUTS``.

    ``values`` are its parameters by name, and ``place``, where they sit.

    Raises
    ------
    InputError
        A device is not usable.

    """
    back_end = SENSOR_INPUTS[name]

    def opened() -> SensorInput:
        sensors = back_end(values)
        known, topics = TOPICS[values.get(PLACE, MUSCLE)], sensors.topics
        if isinstance(topics, str) or not topics or len({*topics} & {*known}) != len(topics):
            close_sensors(sensors)
            raise DeviceError(
                f'its topics are {topics!r}; needed is a tuple of names among {", ".join(known)}, '
                f'each once, such as ({known[0]!r},)', f'back end {back_end.__name__}')
        return sensors
    return _tell(opened, back_end, values)


def close_sensors(sensors: SensorInput) -> str:
    """Close the sensors of a back end; return what is wrong, '' if nothing."""
    try:
        sensors.close()
    except KeyboardInterrupt:
        raise
    except BaseException as error:      # of a back end of somebody else
        return str(device_error(error, type(sensors), sensors.values))
    return ''


def _tell(action: Callable[[], Told], back_end: BackEnd, values: Mapping[str, Any]) -> Told:
    """Return what an action returns; a device that is not usable is a mistake of the user."""
    try:
        return action()
    except KeyboardInterrupt:
        raise
    except BaseException as raised:
        error = device_error(raised, back_end, values)
        raise InputError(error.problem, error.where) from None
