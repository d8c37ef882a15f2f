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

"""Replay a recorded run: the controller tick by tick, the plant on the recorded valve signal."""

from dataclasses import dataclass, field
import os
import tempfile

import numpy as np

from pam_actuation.replay.controller import replay_controller
from pam_actuation.replay.plant import replay_plant
from pam_sim.errors import InputError


@dataclass
class Replay:
    """
    What a replay found.

    Parameters
    ----------
    controller : ReplayResult or None
        Recorded against replayed pressure commands; None without a recorded controller.
    controller_note : str
        Why there is no controller replay, or what it was given.
    plant : PlantReplay or None
        Recorded against simulated signals.
    plant_note : str
        Why there is no plant replay.
    counterfactual : bool
        True if another controller than the recorded one was asked for.

    """

    controller: object = None
    controller_note: str = ''
    plant: object = None
    plant_note: str = ''
    counterfactual: bool = False
    signals: dict = field(default_factory=dict)

    @property
    def unexpected_difference(self):
        """Whether the recorded controller was not reproduced to the bit."""
        return (self.controller is not None and not self.counterfactual
                and not self.controller.identical)

    def to_dict(self):
        """Return plain data for ``--json``."""
        out = {'counterfactual': self.counterfactual}
        if self.controller is not None:
            out['controller'] = {
                'ticks': int(len(self.controller.recorded_pa)),
                'identical': bool(self.controller.identical),
                'max_abs_difference_pa': float(self.controller.max_abs_difference_pa)}
        else:
            out['controller_note'] = self.controller_note
        if self.plant is not None:
            out['plant'] = self.plant.to_dict()
        else:
            out['plant_note'] = self.plant_note
        return out

    def text(self):
        """Return the same for people."""
        lines = []
        if self.controller is None:
            lines.append(f'controller: not replayed, {self.controller_note}')
        else:
            c = self.controller
            verdict = 'identical to the bit' if c.identical else (
                f'largest difference {1e-3 * c.max_abs_difference_pa:.6g} kPa')
            what = 'another tuning against the recorded commands' if self.counterfactual \
                else 'replayed against recorded commands'
            lines.append(f'controller: {len(c.recorded_pa)} ticks, {what}: {verdict}')
        if self.plant is None:
            lines.append(f'plant: not replayed, {self.plant_note}')
        else:
            lines.extend(self.plant.lines())
        return '\n'.join(lines)

    def save(self, path):
        """Write the replayed signals as .npz (written whole or not at all)."""
        arrays = {}
        if self.controller is not None:
            arrays['recorded_command_pa'] = np.asarray(self.controller.recorded_pa)
            arrays['replayed_command_pa'] = np.asarray(self.controller.replayed_pa)
        if self.plant is not None:
            arrays.update(self.plant.arrays())
        folder = os.path.dirname(os.path.abspath(path))
        if not os.path.isdir(folder):
            raise InputError('the folder does not exist', folder)
        handle, temporary = tempfile.mkstemp(dir=folder, suffix='.npz')
        os.close(handle)
        np.savez(temporary, **arrays)
        os.replace(temporary, path)


def replay_run(run, controller=None):
    """
    Step controller and plant offline on the recorded inputs.

    Parameters
    ----------
    run : pam_sim.run.Run
        A loaded bag.
    controller : str, optional
        Name or path of another controller: what would it have commanded?

    Returns
    -------
    Replay

    Raises
    ------
    InputError
        The bag has neither a controller nor a rig to replay; the other controller is unusable.

    """
    result = Replay(counterfactual=controller is not None)
    if 'controller_state' in run and (controller or run.metadata.get('controller')):
        result.controller = replay_controller(run, controller=controller)
    elif controller is not None:
        raise InputError('the bag has no controller_state to replay against', str(run.path))
    else:
        result.controller_note = 'the bag has no recorded controller'
    if run.metadata.get('rig') and 'valve_signal' in run:
        result.plant = replay_plant(run)
    else:
        result.plant_note = 'the bag does not say which rig it is, or has no valve_signal'
    if result.controller is None and result.plant is None:
        raise InputError(
            f'nothing to replay: {result.controller_note}; {result.plant_note}', str(run.path))
    return result
