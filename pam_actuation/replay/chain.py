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
Repeat a recorded experiment in simulation: controller, driver and plant in a closed loop.

Only the reference (or, in an experiment without a controller, the command), the disturbance
force and the moments of all ticks come from the recording; everything else is computed anew.
With the recording's own controller this is the experiment repeated, a simulated one to the
bit; with another controller it is the experiment as it would have gone with that one on the
model.
"""

from array import array
from dataclasses import dataclass

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.plant_loop import PlantLoop
from pam_actuation.replay.arrivals import arrivals, ORDER
from pam_actuation.replay.difference import difference
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.short_repr import short_repr

SENSORS = ('pressure', 'contraction', 'force', 'supply_pressure')
_UNITS = {'pressure_pa': 'Pa', 'contraction_m': 'm', 'force_n': 'N', 'ppr_voltage': 'V',
          'fill_duty': '1', 'vent_duty': '1'}
_FIELD = {'pressure': 'pressure_pa', 'supply_pressure': 'pressure_pa', 'force': 'force_n',
          'contraction': 'contraction_m', 'pressure_command': 'pressure_pa'}
# Readings of one sample arrive close together; those of older samples are forgotten.
_SAMPLES = 20_000


@short_repr
@dataclass(frozen=True)
class ChainReplay:
    """
    Recorded and repeated signals, message by message.

    ``stamp_ns``, ``recorded`` and ``replayed`` map ``topic.field`` to arrays of equal length,
    SI; ``rig`` is the name of the simulated rig, ``start_ns`` the first stamp of the run.
    """

    rig: str
    stamp_ns: dict
    recorded: dict
    replayed: dict
    start_ns: int

    @property
    def differences(self):
        """Return one Difference a signal."""
        return [difference(name, _UNITS[name.split('.')[1]], self.stamp_ns[name],
                           self.recorded[name], self.replayed[name], self.start_ns)
                for name in self.recorded]

    @property
    def identical(self):
        """Return whether every signal is equal to the bit."""
        return all(one.identical for one in self.differences)

    def to_dict(self):
        """Return plain data for ``--json``."""
        return {'rig': self.rig, 'identical': self.identical,
                'signals': [one.to_dict() for one in self.differences]}

    def lines(self):
        """Return the outcome for people."""
        what = f'controller, driver and {self.rig} in a closed loop on the recorded reference'
        if 'pressure_command.pressure_pa' not in self.recorded:
            what = f'driver and {self.rig} on the recorded commands'
        return [f'chain: {what}', *(one.line() for one in self.differences)]

    def arrays(self):
        """Return all arrays by name, for saving."""
        out = {}
        for name in self.recorded:
            key = 'chain_' + name.replace('.', '_')
            out[f'{key}_stamp_ns'] = self.stamp_ns[name]
            out[f'{key}_recorded'] = self.recorded[name]
            out[f'{key}_replayed'] = self.replayed[name]
        return out


class _Chain:
    """The loops of one repeated experiment, stepped from one recorded message to the next."""

    def __init__(self, rig, controller, seed):
        self.plant = PlantLoop(rig, seed=seed)
        self.driver = DriverLoop(rig.valve, driver_config(rig))
        self.control = None if controller is None else ControllerLoop(controller)
        self.samples = {}        # recorded stamp of a reading -> what the plant reads then
        self.command = None
        self.rows = {}

    def take(self, time_ns, topic, message):
        """Do what happened when this recorded message arrived."""
        if topic in SENSORS:
            self._sense(time_ns, topic, message)
        elif topic == 'external_force':
            self.plant.advance_to(message.stamp_ns)     # a force acts from its stamp on
            self.plant.set_external_force(message)
        elif topic in ('reference', 'reference_trajectory'):
            if self.control is not None:
                getattr(self.control, f'on_{topic}')(message)
        elif topic == 'controller_state':
            learning = dict(zip(message.names, message.values)).get('learning', 1.0)
            self.command, _ = self.control.tick(message.stamp_ns, bool(learning))
            self.driver.on_command(self.command)
        elif topic == 'pressure_command':
            self._command(message)
        elif topic == 'valve_command':
            self.driver.on_valve_command(message)
        else:
            self._drive(message)

    def _sense(self, time_ns, topic, message):
        # All readings of one sample carry one stamp.
        if message.stamp_ns not in self.samples:
            self.plant.advance_to(time_ns)
            self.samples[message.stamp_ns] = sample = self.plant.sample(time_ns)
            if len(self.samples) > _SAMPLES:
                del self.samples[next(iter(self.samples))]
            self.driver.on_pressure(sample['pressure'])
            if 'supply_pressure' in sample:
                self.driver.on_supply(sample['supply_pressure'])
            if self.control is not None:
                for name in ('pressure', 'contraction', 'force'):
                    getattr(self.control, f'on_{name}')(sample[name])
        simulated = self.samples[message.stamp_ns].get(topic)
        if simulated is not None:
            field = _FIELD[topic]
            self._note(f'{topic}.{field}', message.stamp_ns, getattr(message, field),
                       getattr(simulated, field))

    def _command(self, message):
        if self.control is None:
            self.driver.on_command(message)
        elif self.command is not None and self.command.stamp_ns == message.stamp_ns:
            self._note('pressure_command.pressure_pa', message.stamp_ns, message.pressure_pa,
                       self.command.pressure_pa)
        else:
            # No tick made it: the command to vent with which a controller ends.
            self.driver.on_command(message)

    def _drive(self, message):
        signal, _ = self.driver.tick(message.stamp_ns)
        self.plant.advance_to(message.stamp_ns)     # a signal acts from its stamp on
        self.plant.set_signal(signal)
        recorded = dict(zip(message.names, message.efforts))
        for name, effort in zip(signal.names, signal.efforts):
            self._note(f'valve_signal.{name}', message.stamp_ns, recorded.get(name, np.nan),
                       effort)

    def _note(self, name, stamp_ns, recorded, replayed):
        columns = self.rows.setdefault(name, (array('q'), array('d'), array('d')))
        for column, value in zip(columns, (stamp_ns, recorded, replayed)):
            column.append(value)


def replay_chain(run, controller=None):
    """
    Repeat the experiment of a recording in simulation.

    Parameters
    ----------
    run : pam_sim.run.Run
        A loaded bag that names its rig.
    controller : optional
        By default the recording's own. Another one (an object, or what ``load_controller``
        takes) answers how the experiment would have gone with it.

    Returns
    -------
    ChainReplay

    Raises
    ------
    InputError
        The bag does not say which rig it is, has no ``valve_signal``, or lacks the ticks and
        the reference of the controller.

    """
    text = run.metadata.get('rig')
    if not text:
        raise InputError('the recording does not say which rig it is', str(run.path))
    rig = load_rig(text)
    run.require('valve_signal')
    controller = _controller(run, rig, controller)
    seed = run.metadata.get('seed', '0')
    if not seed.isdigit():
        raise InputError(f'its seed `{seed}` is not a whole number', str(run.path))
    chain = _Chain(rig, controller, int(seed))
    for arrival in arrivals(run, ORDER):
        if arrival.topic != 'controller_state' or chain.control is not None:
            chain.take(*arrival)
    stamp_ns, recorded, replayed = (
        {name: np.array(columns[k]) for name, columns in chain.rows.items()} for k in range(3))
    return ChainReplay(rig.name, stamp_ns, recorded, replayed, run.start_ns)


def _controller(run, rig, controller):
    """Return the controller of the loop, None for an experiment without one."""
    own = run.metadata.get('controller')
    if controller is None and not own:
        return None
    run.require('controller_state')
    run.require('reference')
    if controller is None:      # what ran is repeated, whatever it was made for
        return load_controller(own, rig, accept_other_rig=True)
    return controller if hasattr(controller, 'step') else load_controller(controller, rig)
