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

"""
What the valve driver does about each fault: the one table.

The supervisor names its reasons after these rows, the tests walk them, and the
documentation prints them (``fault_table_markdown``).
"""

from dataclasses import dataclass

from pam_actuation.drivers import limits, monitors, not_emptied, unmoved
from pam_actuation.drivers.monitors import AirMonitor, MOST_RELAPSES, RELAPSES_WITHIN_S
from pam_actuation.drivers.senders import CLEAR_S
from pam_sim.units import P_ATM_PA

VENT = 'vent'
HOLD = 'hold'
IGNORE = 'ignore'
CLAMP = 'clamp'
BY_HAND = 'shut the supply and open the dump valve'     # where nobody else is known to vent
# What a driver says of a device that refused the safe signal, as it works and as it ends.
MAY_NOT_BE_VENTED, NOT_VENTED = 'the device may not be vented', 'not vented'


@dataclass(frozen=True)
class Fault:
    """
    One row: what is wrong, how it is noticed, what the driver does, how it ends.

    ``reaction`` is one of vent, hold, ignore, clamp; ``latched`` faults stay until the
    service ``~/reset`` is called, the others end by themselves as ``resume`` says.
    """

    key: str
    title: str
    detection: str
    reaction: str
    latched: bool
    resume: str


_LIMITS = limits.SafetyLimits()
_HEARD_TWICE = f'a publisher (by its GID) is heard again after another one within {CLEAR_S:g} s'
_HELD = f'warning ends {monitors.WARNING_HOLD_S:g} s after the last such command'
_RAMP = 'then a slow rise from atmospheric pressure'

FAULT_TABLE = (
    Fault('emergency_stop', 'Emergency stop',
          'service ~/emergency_stop called', VENT, True, 'service ~/reset, ' + _RAMP),
    Fault('over_pressure', 'Over-pressure',
          f'one valid reading above {limits.TRIP_SHARE:g} times the pressure limit plus '
          f'{limits.TRIP_MARGIN_PA * 1e-3:g} kPa', VENT, True,
          'service ~/reset, refused while the reading is above the limit; ' + _RAMP),
    Fault('device_refuses', 'Valve device refuses its signal',
          'writing to the analog output or the PWM failed (hardware back ends)', VENT, True,
          'the safe signal is tried again with every tick; service ~/reset, refused while '
          'that fails; ' + _RAMP),
    Fault('signal_not_finite', 'Signal is not a number',
          'the driver calculated a voltage or duty that is not finite, or its model of the air '
          f'ran away {monitors.MOST_RESTARTS} times within {RELAPSES_WITHIN_S:g} s (HSV)',
          VENT, True, 'service ~/reset, ' + _RAMP),
    Fault('model_restarted', 'Model of the air ran away (HSV)',
          'a pressure or volume of the model is not finite (readings much later than the dead '
          'time, numbers of another rig)', IGNORE, False,
          'warning; both valves are shut for one period, then the model begins anew with the next '
          'reading'),
    Fault('no_command', 'No command yet',
          'no valid pressure_command since start or reset', VENT, False,
          'first valid command, ' + _RAMP),
    Fault('command_timeout', 'Command lost',
          f'newest valid pressure_command older than {_LIMITS.command_timeout_s:g} s (controller '
          'killed, stopped, cut off, or sending only invalid values)', VENT, False,
          'next valid command, ' + _RAMP),
    Fault('two_publishers', 'Two publishers on pressure_command',
          f'{_HEARD_TWICE}; or two or more commands in {_LIMITS.two_publishers_window_s:g} s '
          'with a stamp or publisher sequence number that goes backwards, or with equal stamps '
          'and different values, unless they are known to come from one publisher', VENT, False,
          f'no such command for {_LIMITS.two_publishers_clear_s:g} s, ' + _RAMP),
    Fault('command_clock', 'Stamps of a single publisher of commands do not rise',
          f'two or more commands in {_LIMITS.two_publishers_window_s:g} s with a stamp that goes '
          'backwards, or with equal stamps and different values, all from one writer (by its '
          'GID), whose clock may have been set back', VENT, False,
          f'no such command for {_LIMITS.two_publishers_clear_s:g} s, ' + _RAMP),
    Fault('second_driver', 'Second sender of valve_signal',
          'a message on valve_signal from a writer (by its GID) that is neither the driver nor, '
          'where it is the safe signal, its valve_watchdog; the watchdog looks for one as well',
          VENT, False, f'no such message for {CLEAR_S:g} s, ' + _RAMP),
    Fault('two_sensors', 'Two publishers on pressure',
          _HEARD_TWICE, VENT, False, f'no such message for {CLEAR_S:g} s, ' + _RAMP),
    Fault('second_publisher_seen', 'Second publisher on the graph',
          'beside the publisher of pressure_command that sends, the graph shows one that was '
          'never heard (one that was heard before has ended)', IGNORE, False,
          'warning ends with the second publisher'),
    Fault('command_out_of_order', 'Single command out of order',
          'stamp not newer than the last accepted one', IGNORE, False,
          'message dropped; the former command goes on until its time-out'),
    Fault('command_not_finite', 'Command NaN or infinite',
          'value is not a finite number', IGNORE, False,
          'message dropped; the former command goes on until its time-out'),
    Fault('command_stamp', 'Command too old or from the future',
          f'stamp older than {_LIMITS.command_timeout_s:g} s or more than '
          f'{_LIMITS.stamp_ahead_s:g} s ahead on arrival', IGNORE, False,
          'message dropped; the former command goes on until its time-out'),
    Fault('command_above_limit', 'Command above the pressure limit',
          'command above max_pressure_gauge_pa', CLAMP, False, _HELD),
    Fault('command_below_atmosphere', 'Command below the atmosphere',
          f'command below {P_ATM_PA * 1e-3:g} kPa absolute', CLAMP, False, _HELD),
    Fault('valve_command_at_limit', 'Valve command fills above the pressure limit (HSV)',
          'filling duty commanded and a valid reading at or above max_pressure_gauge_pa', CLAMP,
          False, 'the filling valve stays shut until the reading is below the limit'),
    Fault('valve_command_interrupted', 'Valve command interrupted (HSV)',
          'any fault of this table that vents, while another valve_command than venting is '
          'followed', VENT, True, 'service ~/reset, then the next command'),
    Fault('no_pressure', 'No measured pressure yet',
          f'no valid pressure in the first {_LIMITS.first_pressure_wait_s:g} s '
          '(first_pressure_wait_s); HSV: nothing on pressure since start; PPR: the same where '
          'somebody publishes it, as in another quality of service or type',
          VENT, False, 'first valid reading, ' + _RAMP),
    Fault('no_pressure_ppr', 'No measured pressure at all',
          f'PPR: nothing on pressure in the first {_LIMITS.first_pressure_wait_s:g} s, and '
          'nobody publishes it', IGNORE, False,
          'warning, over-pressure is not supervised; ends with the first valid reading'),
    Fault('pressure_timeout', 'Measured pressure lost',
          f'newest valid pressure older than {_LIMITS.measurement_timeout_s:g} s, or none in the '
          f'first {_LIMITS.first_pressure_wait_s:g} s although there are readings (sensor lost; '
          f'or only readings that are NaN, below {_LIMITS.lowest_plausible_gauge_pa * 1e-3:g} kPa '
          f'gauge, above {_LIMITS.highest_plausible_pa * 1e-3:g} kPa absolute, or stamped more '
          f'than {_LIMITS.stamp_ahead_s:g} s ahead)', VENT, False, 'next valid reading, ' + _RAMP),
    Fault('pressure_relapses', 'Measured pressure lost again and again',
          f'{MOST_RELAPSES} vents within {RELAPSES_WITHIN_S:g} s for readings that are NaN or not '
          'believable, as of a sensor with the wrong sign, or that do not rise (HSV)', VENT, True,
          'service ~/reset, ' + _RAMP),
    Fault('pressure_frozen', 'Measured pressure frozen (HSV)',
          f'reading unchanged to the last bit for {_LIMITS.frozen_after_s:g} s or longer while '
          f'the valve flow should have moved it by {_LIMITS.frozen_change_pa * 1e-3:g} kPa; '
          'where filling comes near the pressure limit less is enough, down to '
          f'{monitors.SHORTEST * _LIMITS.frozen_after_s:g} s and '
          f'{monitors.LEAST_CHANGE * _LIMITS.frozen_change_pa * 1e-3:g} kPa', VENT, False,
          'first reading that differs, ' + _RAMP),
    Fault('pressure_unmoved', 'Measured pressure does not follow (HSV)',
          f'smoothed reading rises by less than {unmoved.LEAST_SHARE * 100:g} % of what the valve '
          f'flow should have added, {unmoved.MISSED_PA * 1e-3:g} kPa or more within '
          f'{unmoved.WINDOW_S:g} s (sensor dead but noisy, no air supply, valve without effect)',
          VENT, False,
          f'after {unmoved.UNMOVED_VENTS_S:g} s of venting the pressure is tried again, ' + _RAMP),
    Fault('pressure_frozen_ppr', 'Measured pressure frozen (PPR)',
          'as above, from the lag of the regulator', IGNORE, False,
          'warning: the regulator closes its own loop; ends with a reading that differs'),
    Fault('air_missing', 'Measured pressure does not rise (PPR)',
          f'measured pressure more than {AirMonitor.MISSING_PA * 1e-3:g} kPa below all that was '
          f'commanded within lag and dead time, and falling for {AirMonitor.FALLS_S:g} s, or '
          f'below {AirMonitor.EMPTY_GAUGE_PA * 1e-3:g} kPa gauge for {AirMonitor.EMPTY_S:g} s',
          IGNORE, False,
          'warning that names sensor, air supply and gain; the pressure rises slowly from '
          'atmospheric pressure, as the air returns'),
    Fault('not_emptied', 'Muscle keeps its pressure',
          f'measured pressure at least {not_emptied.ABOVE_PA * 1e-3:g} kPa above what is followed '
          f'(HSV: while the vent is open), above {not_emptied.LEAST_GAUGE_PA * 1e-3:g} kPa gauge, '
          f'and not falling by {not_emptied.LEAST_FALL_PA * 1e-3:g} kPa within '
          f'{not_emptied.AFTER_S:g} s (valve stuck, vent blocked)', IGNORE, False,
          'error: shut the supply and open the dump valve; ends when the pressure falls'),
    Fault('supply_low', 'Supply loss',
          f'measured supply pressure less than {_LIMITS.supply_margin_pa * 1e-3:g} kPa above the '
          'command', IGNORE, False,
          'warning: the muscle keeps what it has and gets what there is; ends when the supply '
          'returns, then a slow rise from what is there'),
    Fault('supply_stale', 'Supply reading lost',
          f'supply pressure was measured and is now older than {_LIMITS.supply_timeout_s:g} s, or '
          'invalid', IGNORE, False,
          'warning: the nominal supply is assumed'),
    Fault('driver_paused', 'Driver stopped and continued',
          f'more than {_LIMITS.pause_s:g} s between two ticks of the driver, or deactivated in '
          'between', VENT, False, 'first command and reading stamped after the pause, ' + _RAMP),
    Fault('clock_ahead', 'Clock set ahead',
          f'more than {_LIMITS.pause_s:g} s between two ticks by the clock of the stamps, but not '
          'by the steady clock of the computer', VENT, False,
          'first command and reading on the new clock, ' + _RAMP),
    Fault('clock_back', 'Clock set back',
          'time of a tick before that of the former one', VENT, False,
          'first command and reading on the new clock, ' + _RAMP),
    Fault('driver_ends', 'Driver shut down by request or by an error of its own',
          'lifecycle deactivate, SIGINT, SIGTERM, exception', VENT, False,
          'start the driver again'),
    Fault('driver_killed', 'Driver killed, stopped or its computer lost',
          'not detectable by the driver: the valve holds its last signal', HOLD, False,
          'valve_watchdog, a process of its own, sends the safe valve_signal after '
          f'{limits.WATCHDOG_S:g} s of silence; behind a hardware back end another one vents the '
          f'device after {limits.DEVICE_WATCHDOG_S:g} s; with the computer lost only hardware '
          'can'),
    Fault('watchdog_vented', 'Driver silent for a moment, watchdog vented',
          'the safe signal of another node, valve_watchdog as a rule, heard by the driver, or a '
          'vent by the watchdog of its device: a busy machine kept it from sending', IGNORE, False,
          'warning; the driver goes on with a slow rise from atmospheric pressure, and not with a '
          'valve_command (HSV), which is interrupted'),
    Fault('reference_lost', 'Reference lost',
          'noticed by the controller, which then commands atmospheric pressure', IGNORE, False,
          'the driver follows the controller'),
)

FAULTS = {fault.key: fault for fault in FAULT_TABLE}


def fault_table_markdown() -> str:
    """Return the table as Markdown text, one row per fault."""
    lines = ['| fault | noticed by | reaction | latched | ends |', '|---|---|---|---|---|']
    for fault in FAULT_TABLE:
        latched = 'latched' if fault.latched else 'self-resuming'
        lines.append(f'| {fault.title} | {fault.detection} | {fault.reaction} | {latched} '
                     f'| {fault.resume} |')
    return '\n'.join(lines) + '\n'
