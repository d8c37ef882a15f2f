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

"""Closed loops of pairs of rig and experiment, of muscles or of joints, within their reach."""

from collections.abc import Sequence
import math
from typing import TYPE_CHECKING

from pam_actuation.control.modes.tracked import tracked_by
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_actuation.tuning.joint_loop import JointLoop
from pam_sim.errors import InputError
from pam_sim.joint.rig import JointRig
from pam_sim.units import P_ATM_PA
from pam_sim.valve.reach import reach_gauge_pa

if TYPE_CHECKING:
    from pam_actuation.experiments.experiment import Experiment
    from pam_actuation.tuning.problem import Law, Loop
    from pam_sim.rig import Rig

_MARGIN_PA = 30e3         # of pressure above the static one: dry friction and acceleration


def reachable(rig: 'Rig | JointRig', experiment: 'Experiment', controller: 'Law') -> bool:
    """
    Return whether a rig can hold what an experiment asks for with some pressure to spare.

    A muscle is to hold the largest contraction, a joint both outermost angles. None gets more
    than its regulator or supply gives.
    """
    lowest, highest = experiment.chain.extremes()
    if isinstance(rig, JointRig):
        flexor_pa, extensor_pa = (
            _limit_pa(one, controller) - _MARGIN_PA for one in (rig.flexor, rig.extensor))
        return (rig.static_torque_n_m(highest, flexor_pa, P_ATM_PA) >= 0.0
                and rig.static_torque_n_m(lowest, P_ATM_PA, extensor_pa) <= 0.0)
    return float(rig.static_pressure_pa(highest)) + _MARGIN_PA <= _limit_pa(rig, controller)


def _limit_pa(muscle: 'Rig', controller: 'Law') -> float:
    """Return the highest pressure [Pa] that controller and valve give a muscle."""
    return P_ATM_PA + min(controller.settings['max_pressure_gauge_pa'],
                          reach_gauge_pa(muscle.valve, muscle.parameters))


def loops_of(rigs: 'Sequence[Rig | JointRig]', experiments: 'Sequence[Experiment]', seed: int,
             controller: 'Law', nominal: 'Rig | JointRig',
             preview_s: float = math.inf) -> 'tuple[list[Loop], int]':
    """
    Return the closed loops of all pairs that can be reached, and how many cannot.

    The valve drivers know the data sheet of the ``nominal`` rig, the controllers the reference
    ``preview_s`` ahead. Where the cost counts the start, that is the one of a real run.

    Raises
    ------
    InputError
        An experiment is not in what the controller tracks; no pair can be reached.

    """
    tracked = tracked_by(controller)
    for experiment in experiments:
        if experiment.domain != tracked.topic:
            raise InputError(f'experiment {experiment.name} is in {experiment.domain}; only '
                             f'{tracked.topic} can be tracked')
    pairs = [(rig, experiment) for rig in rigs for experiment in experiments]
    for rig, experiment in pairs:
        if isinstance(rig, JointRig):
            experiment.check_reachable(rig)
    kept = [(rig, experiment) for rig, experiment in pairs
            if reachable(rig, experiment, controller)]
    if not kept:
        raise InputError('no rig can reach any of the experiments', experiments[0].name)
    drivers = [driver_config(muscle) for muscle in nominal.muscles.values()]
    loops: 'list[Loop]' = [
        JointLoop(rig, experiment, seed, controller.rate_hz, drivers=drivers,
                  preview_s=preview_s, slow_start=experiment.cycles is None)
        if isinstance(rig, JointRig) else
        ClosedLoop(rig, experiment, seed, controller.rate_hz, driver=drivers[0],
                   preview_s=preview_s, slow_start=experiment.cycles is None)
        for rig, experiment in kept]
    return loops, len(pairs) - len(kept)
