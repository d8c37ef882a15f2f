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
Step a joint's controller offline on the inputs a recording says it used, and compare.

As ``controller`` for a single muscle. ``controller_state`` of a joint holds the values of all
inputs of a tick, the angle with its stamp; so a live recording is reproduced to the bit as well.
"""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.bags.load_joint import MEASURED
from pam_actuation.control.joint_law import ADDED_NAMES, CO_CONTRACTION, JointLaw, PROVES
from pam_actuation.control.tick import (
    AGES, Effort, HELD_BACK, join_stamp, LIMIT, reference_names, TickCore, TickInputs)
from pam_actuation.drivers.recorded import as_recorded, nearly_in
from pam_actuation.replay.chain import ChainReplay
from pam_actuation.replay.controller import check_complete, columns_of
from pam_actuation.replay.difference import same_bits
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.errors import InputError
from pam_sim.joint.parameters import SIDES

if TYPE_CHECKING:
    from pam_actuation.control.modes.joint import JointController
    from pam_sim.joint import JointRig
    from pam_sim.run import Run

COMMANDS = tuple(f'{side}/pressure_command' for side in SIDES)


@dataclass(frozen=True)
class JointControllerReplay:
    """
    Outcome of a replay of a joint's controller.

    Parameters
    ----------
    commands : ChainReplay
        Both commands, recorded and replayed, of every tick whose command was recorded.
    differing : dict of str to int
        Numbers of ``controller_state`` that differ, with the number of ticks.
    stamp_ns : numpy.ndarray
        All ticks, int64.
    states : dict of str to numpy.ndarray
        The replayed numbers of ``controller_state`` by name, of all ticks.

    """

    commands: ChainReplay
    differing: dict[str, int]
    stamp_ns: IntArray = field(repr=False)
    states: dict[str, FloatArray] = field(repr=False)


def states_suffice(run: 'Run') -> bool:
    """Return whether ``controller_state`` of a recording holds all inputs of its ticks."""
    states = run.topics.get('controller_state')
    return states is not None and set(ADDED_NAMES) <= set(states.values)


def replay_joint_controller(run: 'Run', controller: 'JointController',
                            joint: 'JointRig') -> JointControllerReplay:
    """
    Replay the controller of a joint's recording.

    Parameters
    ----------
    run : pam_sim.run.Run
        One for which ``states_suffice``.
    controller : JointController
        The recorded one, or another; it is stepped.
    joint : pam_sim.joint.JointRig
        The recorded one.

    Returns
    -------
    JointControllerReplay

    Raises
    ------
    InputError
        The recording does not begin with the first tick, lacks ticks or an angle that was used,
        or the rules were exchanged on the way.

    """
    states = run.require('controller_state')
    columns, path = columns_of(states), str(run.path)
    order = np.argsort(columns['tick'], kind='stable')
    check_complete(columns, order, path)
    angles = run.require(MEASURED)
    angle_at = dict(zip(angles.stamp_ns.tolist(), angles.values['angle_rad'].tolist()))
    sent_at = {topic: dict(zip(run.topics[topic].stamp_ns.tolist(),
                               run.topics[topic].values['pressure_pa'].tolist()))
               for topic in COMMANDS if topic in run}
    nearly_pa = nearly_in(as_recorded(run.metadata, run.path))
    core = TickCore(JointLaw(controller, joint), nearly_pa=nearly_pa)
    compared = [(name, columns[name], core.names.index(name))
                for name in core.names if name in columns]
    differing: dict[str, int] = {}
    replayed = np.empty((len(order), len(COMMANDS)))
    kept = np.empty((len(order), len(core.names)))
    for place, row in enumerate(order.tolist()):
        commands_pa, values = core.run(_inputs(columns, row, angle_at, path))
        replayed[place], kept[place] = commands_pa, values
        for name, column, index in compared:
            if not same_bits(column[row], values[index]):
                differing[name] = differing.get(name, 0) + 1
    stamp_ns = states.stamp_ns[order]
    stamps, recorded, computed = {}, {}, {}
    for topic, column in zip(COMMANDS, replayed.T):
        name, at = f'{topic}.pressure_pa', sent_at.get(topic, {})
        known = np.array([stamp in at for stamp in stamp_ns.tolist()])      # else it was lost
        stamps[name], computed[name] = stamp_ns[known], column[known]
        recorded[name] = np.array([at[stamp] for stamp in stamp_ns[known].tolist()])
    return JointControllerReplay(
        ChainReplay(joint.name, stamps, recorded, computed, run.start_ns), differing, stamp_ns,
        dict(zip(core.names, kept.T)))


def _inputs(columns: dict[str, FloatArray], row: int, angle_at: dict[int, float],
            path: str) -> TickInputs:
    """Return the ``TickInputs`` of one recorded tick, the angle taken from its topic."""
    def numbers(*names: str) -> tuple[float, ...]:
        return tuple(float(columns[name][row]) for name in names)

    angle_ns, effort_ns = (
        join_stamp(columns[f'{name}_stamp_sec'][row], columns[f'{name}_stamp_nanosec'][row])
        for name in (MEASURED, 'joint_effort'))
    (angle_rad,) = numbers('angle_rad')
    if angle_ns >= 0:
        if angle_ns not in angle_at:
            raise InputError(
                f'the {MEASURED} message of stamp {angle_ns} ns that controller tick '
                f'{int(columns["tick"][row])} used is not in the recording', path)
        angle_rad = angle_at[angle_ns]
    reason, learning, restarted, elapsed_s, held_back, follows, torque_n_m, co_contraction_pa = (
        numbers('input_reason', 'learning', 'restarted', 'elapsed_s', HELD_BACK,
                'follows_torque', 'wanted_torque_n_m', CO_CONTRACTION))
    reference, rate, lead_reference, lead_rate = numbers(*reference_names('rad'))
    age_s, pressure_age_s = numbers(*AGES)
    return TickInputs(
        int(reason), bool(learning), bool(restarted), (angle_ns,), angle_rad, reference, rate,
        lead_reference, lead_rate, elapsed_s,
        pressures_pa=numbers(*(f'{side}_pressure_pa' for side in SIDES)),
        forces_n=numbers(*(f'{side}_force_n' for side in SIDES)), held_back=held_back,
        proves=[bool(proof) for proof in numbers(*PROVES)],
        ages_s=(age_s, pressure_age_s), effort=Effort(bool(follows), effort_ns, torque_n_m),
        co_contraction_pa=co_contraction_pa, limit_pa=float(columns[LIMIT][row]))
