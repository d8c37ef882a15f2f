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
Replay the recording of a joint: controller, drivers and plant, each by itself or chained.

The controller alone is given the inputs that its states name (``joint_controller``): it is
reproduced to the bit, simulated or live. The other parts are the live loops on a bus. A part that
is replayed alone ticks at the recorded times and gets what had arrived by then. The messages of
the other parts come from the recording. A simulated bag is reproduced to the bit. Of a live one
it is not recorded when a message reached a driver or the plant. Near a tick a message may count
one tick early or late. So it is with the controller in recordings of versions whose
states lack some inputs.
"""

import copy
from dataclasses import dataclass, field
import os
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_actuation.bags.metadata import name_of
from pam_actuation.bags.oddities import recording_remarks
from pam_actuation.control.config import load_controller
from pam_actuation.control.modes.joint import JointController
from pam_actuation.drivers.recorded import as_recorded
from pam_actuation.replay.arrivals import recorded_topics_of_joint, RecordedTopic
from pam_actuation.replay.chain import ChainReplay, recorded_seed, RepeatedLoops, replay_chain
from pam_actuation.replay.controller import check_rate
from pam_actuation.replay.joint_controller import replay_joint_controller, states_suffice
from pam_actuation.replay.model import GIVE_MODEL, other_model, with_model
from pam_actuation.replay.settings import check_given, preview_remark, valve_remark
from pam_sim.errors import InputError
from pam_sim.files import whole_file
from pam_sim.joint import JointRig, load_joint
from pam_sim.rig import Rig
from pam_sim.run import Run

if TYPE_CHECKING:
    from pam_actuation.control.config import Controller

PARTS = ('controller', 'driver', 'plant')
_WORDS = {
    'controller': 'both commands from the inputs of its ticks',
    'driver': 'the signals of both drivers on the recorded commands and pressures',
    'plant': 'the joint on the recorded valve signals'}


@dataclass(frozen=True)
class JointReplay:
    """
    What a replay of a joint found.

    Parameters
    ----------
    parts : dict of str to ChainReplay
        Recorded and replayed signals of each part that was replayed, or of the ``chain``.
    internals : dict of str to int
        Numbers of ``controller_state`` that differ, with the number of ticks.
    counterfactual : bool
        True if another controller than the recorded one was asked for.
    exact : bool
        Whether a difference of the controller would be a mistake: all its inputs are recorded.
    notes : dict of str to str
        Why a part that was asked for is missing.
    remarks : tuple of str
        Sentences on the recording itself, such as that it stopped early.

    """

    parts: dict[str, ChainReplay]
    internals: dict[str, int] = field(default_factory=dict)
    counterfactual: bool = False
    exact: bool = True
    notes: dict[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()

    @property
    def unexpected_difference(self) -> bool:
        """Whether the recorded controller was not reproduced to the bit, although it should."""
        controller = self.parts.get('controller')
        return (controller is not None and self.exact and not self.counterfactual
                and not (controller.identical and not self.internals))

    def to_dict(self) -> dict[str, object]:
        """Return plain data for ``--json``."""
        out: dict[str, object] = {
            'counterfactual': self.counterfactual, 'remarks': list(self.remarks),
            **{name: part.to_dict() for name, part in self.parts.items()},
            **{f'{name}_note': note for name, note in self.notes.items()}}
        if 'controller' in self.parts:
            out['differing_states'] = dict(self.internals)
        return out

    def text(self) -> str:
        """Return the same for people."""
        lines = []
        for name, part in self.parts.items():
            first, *signals = part.lines()
            lines += [first if name == 'chain' else f'{name}: {_WORDS[name]}', *signals]
            if name == 'controller':
                lines.append(self._internals_line())
        lines += [f'{name}: not replayed, {note}' for name, note in self.notes.items()]
        return '\n'.join([*filter(None, lines), *(f'remark: {text}' for text in self.remarks)])

    def _internals_line(self) -> str:
        if self.internals:
            return '  internals that differ (ticks): ' + ', '.join(
                f'{name} ({n})' for name, n in self.internals.items())
        return '' if self.counterfactual else (
            '  controller_state: every internal identical to the bit')

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the replayed signals as .npz, whole or not at all."""
        arrays: dict[str, Any] = {}
        for name, part in self.parts.items():
            arrays.update({key.replace('chain_', f'{name}_', 1): column
                           for key, column in part.arrays().items()})
        with whole_file(path, suffix='.npz', parents=False) as temporary:
            np.savez(temporary, **arrays)


def replay_joint(run: Run, controller: 'Controller | str | os.PathLike[str] | None' = None,
                 only: str | None = None, chain: bool = False,
                 model: Rig | JointRig | None = None) -> JointReplay:
    """
    Step the parts of a joint offline on the recorded inputs.

    Parameters
    ----------
    run : RecordedRun
        Of a joint, from ``load_recording``.
    controller : optional
        Another controller (an object, or its name or path): what would it have commanded? Of an
        object a copy is stepped.
    only : {'controller', 'driver', 'plant'}, optional
        Replay this part alone; by default each of the three by itself.
    chain : bool
        Close the loop instead: all parts from the recorded reference.
    model : JointRig, optional
        Take the recording as one of this joint (``model_of``); by default the one it names.

    Raises
    ------
    InputError
        What was asked for cannot be replayed; the controller is unusable, was loaded for the
        other valve, or runs at another rate than the recorded ticks.

    """
    check_given(run, controller, model)
    path = str(run.path)
    other = other_model(run, model)     # another joint asks for other commands
    remarks = (*recording_remarks([run]), *other, *valve_remark(controller))
    run = with_model(run, model)
    if not run.metadata.get('rig'):
        raise InputError(f'the recording does not say which joint it is; {GIVE_MODEL}', path)
    joint = load_joint(run.metadata['rig'])
    if chain:
        return JointReplay({'chain': replay_chain(run, controller)},
                           counterfactual=controller is not None, remarks=remarks)
    wanted = PARTS if only is None else (only,)
    if controller is not None and 'controller' not in wanted:
        raise InputError(f'another controller changes nothing for the {only} alone', '--set')
    law = _law(run, joint, controller)
    if controller is not None and law is not None and 'controller_state' in run:
        check_rate(law, run['controller_state'], path)
    parts: dict[str, ChainReplay] = {}
    notes: dict[str, str] = {}
    internals: dict[str, int] = {}
    recorded: dict[str, RecordedTopic] = {}
    for name in wanted:
        if name == 'controller' and (law is None or 'controller_state' not in run):
            notes[name] = 'the bag has no recorded controller'
            continue
        if name == 'controller' and isinstance(law, JointController) and states_suffice(run):
            alone = replay_joint_controller(run, law, joint)
            parts[name], internals = alone.commands, alone.differing
            remarks += preview_remark(run, controller)
            continue
        loops = RepeatedLoops(joint, law, recorded_seed(run), name_of(run.metadata, run.namespace),
                              (name,), as_recorded(run.metadata, run.path))
        recorded = recorded or recorded_topics_of_joint(run)
        loops.run(recorded)
        parts[name] = ChainReplay(joint.name, *loops.signals(), run.start_ns)
        internals = loops.internals or internals
    if not parts:
        raise InputError('nothing to replay: ' + '; '.join(notes.values()), path)
    return JointReplay(
        parts, {} if controller is not None else internals, controller is not None,
        not other and (states_suffice(run) or run.metadata.get('origin') != 'live'), notes,
        remarks)


def _law(run: Run, joint: JointRig, controller: 'Controller | str | os.PathLike[str] | None'
         ) -> 'Controller | None':
    """Return the controller to replay, None where the recording has none."""
    if isinstance(controller, (str, os.PathLike)):
        return load_controller(controller, joint)
    own = run.metadata.get('controller')
    if controller is None and own:
        return load_controller(own, joint, accept_other_rig=True)
    return copy.deepcopy(controller)
