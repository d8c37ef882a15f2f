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

"""Replay a recorded run: controller, driver and plant, each alone or chained."""

from dataclasses import dataclass, field
import os
from pathlib import Path
from typing import Any, TYPE_CHECKING

import numpy as np

from pam_actuation.bags.oddities import recording_remarks
from pam_actuation.replay.chain import ChainReplay, replay_chain
from pam_actuation.replay.controller import replay_controller, ReplayResult
from pam_actuation.replay.difference import Difference, difference
from pam_actuation.replay.driver import DriverReplay, replay_driver
from pam_actuation.replay.model import GIVE_MODEL, other_model, with_model
from pam_actuation.replay.plant import PlantReplay, replay_plant
from pam_actuation.replay.settings import check_given, preview_remark, valve_remark
from pam_sim.errors import InputError
from pam_sim.files import whole_file

if TYPE_CHECKING:
    from pam_actuation.bags.load import RecordedRun
    from pam_actuation.control.config import Controller
    from pam_sim.joint import JointRig
    from pam_sim.rig import Rig

PARTS = ('controller', 'driver', 'plant')


@dataclass
class Replay:
    """
    What a replay found; a part that was not asked for or not possible is None.

    Parameters
    ----------
    controller : ReplayResult or None
        Recorded against replayed pressure commands.
    driver : DriverReplay or None
        Recorded against replayed valve signals.
    plant : PlantReplay or None
        Recorded against simulated signals, free run on the recorded input.
    chain : ChainReplay or None
        The experiment repeated in a closed loop.
    notes : dict of str to str
        Why a part that was asked for is missing.
    counterfactual : bool
        True if another controller than the recorded one was asked for.
    start_ns : int
        First stamp of the recording; differences are placed in seconds after it.
    remarks : tuple of str
        Sentences on the recording itself, such as that it stopped early.

    """

    controller: ReplayResult | None = None
    driver: DriverReplay | None = None
    plant: PlantReplay | None = None
    chain: ChainReplay | None = None
    notes: dict[str, str] = field(default_factory=dict)
    counterfactual: bool = False
    start_ns: int = 0
    remarks: tuple[str, ...] = ()

    @property
    def unexpected_difference(self) -> bool:
        """Whether the recorded controller was not reproduced to the bit."""
        return (self.controller is not None and not self.counterfactual
                and not self.controller.identical)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for ``--json``."""
        out: dict[str, Any] = {
            'counterfactual': self.counterfactual, 'remarks': list(self.remarks)}
        if self.controller is not None:
            out['controller'] = {
                'ticks': int(len(self.controller.recorded_pa)),
                'identical': bool(self.controller.identical),
                'max_abs_difference_pa': float(self.controller.max_abs_difference_pa),
                'signals': [_of_commands(self.controller, self.start_ns).to_dict()],
                'differing_states': dict(self.controller.differing_states)}
        for name in ('driver', 'plant', 'chain'):
            part = getattr(self, name)
            if part is not None:
                out[name] = part.to_dict()
        out.update({f'{name}_note': note for name, note in self.notes.items()})
        return out

    def text(self) -> str:
        """Return the same for people."""
        lines = []
        if self.controller is not None:
            lines.extend(self._controller_lines(self.controller))
        for name in ('driver', 'plant', 'chain'):
            if getattr(self, name) is not None:
                lines.extend(getattr(self, name).lines())
        lines.extend(f'{name}: not replayed, {note}' for name, note in self.notes.items())
        lines.extend(f'remark: {text}' for text in self.remarks)
        return '\n'.join(lines)

    def _controller_lines(self, found: ReplayResult) -> list[str]:
        what = 'another tuning against the recorded commands' if self.counterfactual \
            else 'replayed against the recorded commands'
        lines = [f'controller: {found.ticks} ticks, {what}',
                 _of_commands(found, self.start_ns).line()]
        differing = found.differing_states
        if differing:
            lines.append('  internals that differ (ticks): ' + ', '.join(
                f'{name} ({n})' for name, n in differing.items()))
        elif not self.counterfactual:
            lines.append('  controller_state: every internal identical to the bit')
        return lines

    def save(self, path: Path | str) -> None:
        """Write the replayed signals as .npz, the same bytes each time, whole or not at all."""
        arrays: dict[str, Any] = {}
        if self.controller is not None:
            arrays['command_stamp_ns'] = np.asarray(self.controller.stamp_ns)
            arrays['recorded_command_pa'] = np.asarray(self.controller.recorded_pa)
            arrays['replayed_command_pa'] = np.asarray(self.controller.replayed_pa)
        for part in (self.driver, self.plant, self.chain):
            if part is not None:
                arrays.update(part.arrays())
        with whole_file(path, suffix='.npz', parents=False) as temporary:
            np.savez(temporary, **arrays)


def _of_commands(found: ReplayResult, start_ns: int) -> Difference:
    return difference('pressure_command', 'Pa', found.stamp_ns, found.recorded_pa,
                      found.replayed_pa, start_ns)


def replay_run(run: 'RecordedRun', controller: 'Controller | str | os.PathLike[str] | None' = None,
               only: str | None = None, chain: bool = False,
               model: 'Rig | JointRig | None' = None) -> Replay:
    """
    Step the parts of the rig offline on the recorded inputs.

    Parameters
    ----------
    run : pam_sim.run.Run
        A loaded bag.
    controller : optional
        Another controller (an object, or its name or path): what would it have commanded?
    only : {'controller', 'driver', 'plant'}, optional
        Replay this part alone; by default each of the three by itself.
    chain : bool
        Close the loop instead: controller, driver and plant from the recorded reference.
    model : Rig, optional
        Take the recording as one of this rig (``model_of``); by default the one it names.

    Returns
    -------
    Replay

    Raises
    ------
    InputError
        What was asked for cannot be replayed, or nothing can; the controller is unusable, or was
        loaded for the other valve.

    """
    if only is not None and only not in PARTS:
        raise InputError(f'is `{only}`; allowed: {", ".join(PARTS)}', 'only')
    check_given(run, controller, model)
    preview = () if chain else preview_remark(run, controller)
    result = Replay(counterfactual=controller is not None, start_ns=run.start_ns,
                    remarks=(*recording_remarks([run]), *other_model(run, model),
                             *valve_remark(controller), *preview))
    run = with_model(run, model)
    if chain:
        if not run.metadata.get('rig'):
            raise InputError(f'the recording does not say which rig it is; {GIVE_MODEL}',
                             str(run.path))
        result.chain = replay_chain(run, controller)
        return result
    wanted = PARTS if only is None else (only,)
    if controller is not None and 'controller' not in wanted:
        raise InputError(f'another controller changes nothing for the {only} alone', '--set')
    for name in wanted:
        why_not = _why_not(run, name, controller)
        if why_not:
            result.notes[name] = why_not
        elif name == 'controller':
            result.controller = replay_controller(run, controller)
        elif name == 'driver':
            _try_driver(run, result, only)
        else:
            result.plant = replay_plant(run)
    if controller is not None and result.controller is None:
        raise InputError('the bag has no controller_state to replay against', str(run.path))
    if all(getattr(result, name) is None for name in wanted):
        raise InputError('nothing to replay: ' + '; '.join(result.notes.values()), str(run.path))
    return result


def _why_not(run: 'RecordedRun', name: str,
             controller: 'Controller | str | os.PathLike[str] | None') -> str:
    """Return why a part cannot be replayed, '' if it can."""
    if name == 'controller':
        if 'controller_state' not in run or not (controller or run.metadata.get('controller')):
            return 'the bag has no recorded controller'
    elif name == 'driver':
        if 'valve_signal' not in run:
            return run.why_not('valve_signal')
        if not os.path.exists(run.path):
            return 'the run is not from a bag'
    elif not run.metadata.get('rig'):
        return f'the bag does not say which rig it is; {GIVE_MODEL}'
    elif 'valve_signal' not in run and not ('pressure' in run and 'contraction' in run):
        return 'the bag has neither a valve_signal nor pressure and contraction'
    return ''


def _try_driver(run: 'RecordedRun', result: Replay, only: str | None) -> None:
    """Replay the driver; beside other parts, a bag whose clocks disagree is only noted."""
    try:
        result.driver = replay_driver(run)
    except InputError as error:
        if only is not None:
            raise
        result.notes['driver'] = error.problem
