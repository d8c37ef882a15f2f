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
What the valve was told, where nobody recorded its signal: a pressure command, or nothing.

The pressure command of a regulator becomes its valve signal. Where a recording tells nothing of
the valve, muscle and load are compared alone.
"""

from collections.abc import Sequence
import copy

import numpy as np
from pam_sim.gap.data.signals import FIELD, recorded_valve, VALVE_FIELDS
from pam_sim.rig import Rig
from pam_sim.run import Run, Series
from pam_sim.units import P_ATM_PA
from pam_sim.valve.ppr import voltage_v

COMMAND = 'pressure_command'
TAKEN = ('The recording has no valve signal, so the pressure command is taken for the input of a '
         'pressure regulator, at {:.4g} kPa/V.')
UNUSED = ('Some of the recordings tell nothing of the valve, so its signal is not used in the '
          'others either.')


def commanded(runs: Sequence[Run], rig: Rig) -> tuple[list[Run], list[str]]:
    """
    Return (runs, remarks): each run without a valve signal gets that of its pressure command.

    The voltage is the one that gives the commanded pressure by the numbers of the model. What
    the true gain differs by thus shows as an error of ``K_m``. The runs given stay as they are.

    Parameters
    ----------
    runs : sequence of Run
        Recordings.
    rig : pam_sim.Rig
        The model. Behind on/off valves a pressure command is not used.

    """
    found = [_with_signal(run, rig) if is_commanded(run, rig.valve) else run for run in runs]
    taken = any(one is not run for one, run in zip(found, runs))
    return found, [TAKEN.format(1e-3 * rig.parameters['K_m'])] if taken else []


def all_commanded(runs: Sequence[Run], certify: Run | None, rig: Rig
                  ) -> tuple[list[Run], Run | None, list[str]]:
    """
    Return (runs, certify, remarks): the same for a question with or without a proof.

    All of them are driven alike: where one has no command of the valve, that of the others is
    left out.
    """
    every, remarks = commanded([*runs, *([certify] if certify is not None else [])], rig)
    has_signal = [bool(recorded_valve(run)) for run in every]
    if any(has_signal) and not all(has_signal):
        every, remarks = [_without_signal(run) for run in every], [UNUSED]
    return every[:len(runs)], None if certify is None else every[-1], remarks


def is_commanded(run: Run, valve: str) -> bool:
    """Return whether a pressure command is all that tells what a regulator was given."""
    return (valve == 'ppr' and 'valve_signal' not in run and COMMAND in run
            and FIELD['pressure'] in run.topics[COMMAND].values
            and run.metadata.get('valve') != 'hsv')


def _with_signal(run: Run, rig: Rig) -> Run:
    command = run.topics[COMMAND]
    name, = VALVE_FIELDS['ppr']
    volts = np.array([voltage_v(value - P_ATM_PA, rig.parameters)
                      for value in command.values[FIELD['pressure']].tolist()])
    found = copy.copy(run)
    found.topics = run.topics | {'valve_signal': Series(
        command.stamp_ns, {name: volts}, {name: 'V'}, command.start_ns)}
    return found


def _without_signal(run: Run) -> Run:
    found = copy.copy(run)
    found.topics = {name: series for name, series in run.topics.items()
                    if name not in ('valve_signal', COMMAND)}
    return found
