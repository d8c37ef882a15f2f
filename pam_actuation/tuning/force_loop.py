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
Closed-loop rollouts in force mode: the force of an isometric or driven muscle is tracked.

The same compiled steps as in the live nodes, as in ``closed_loop``.
"""

from typing import Any, TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from pam_actuation.control.modes.force import FORCE_INPUT
from pam_actuation.control.modes.tracked import FORCE
from pam_actuation.tuning.closed_loop import MuscleLoop
from pam_actuation.tuning.cost import tracking_cost
from pam_actuation.tuning.loop_checks import check_parts, check_wrapped
from pam_actuation.tuning.loop_setup import Course, fresh_rise, learning_mask, Learns
from pam_actuation.tuning.mode_result import ModeResult
from pam_sim.declared import shown
from pam_sim.errors import InputError
from pam_sim.load import LOADS
from pam_sim.records import size_of, zeros

if TYPE_CHECKING:
    from pam_actuation.control.modes.force import ForceController
    from pam_actuation.experiments.experiment import Experiment
    from pam_sim.rig import Rig


class ForceLoop(MuscleLoop):
    """
    A rig with prescribed contraction, an experiment in force and one realisation of noise.

    Parameters
    ----------
    rig : pam_sim.rig.Rig
        Load ``isometric`` or ``driven``.
    experiment : Experiment
        Domain ``force``.
    contraction_m : float or callable, optional
        Contraction [m], possibly as a function of time [s] (driven load only); by default
        what an isometric rig states, 0 for a driven one.
    **others
        ``seed``, ``rate_hz``, ``latency_s``, ``driver``, ``preview_s``, ``slow_start`` of
        ``ClosedLoop``; its supply and force would act on nothing here.

    Raises
    ------
    InputError
        As of ``ClosedLoop``; a load that moves freely; a moving isometric load; a contraction
        beyond the stroke; a course of the supply or of an external force.

    """

    DOMAIN = FORCE.topic

    def __init__(self, rig: 'Rig', experiment: 'Experiment',
                 contraction_m: Course | float | None = None, **others: Any) -> None:
        from pam_sim.rig import Rig
        check_parts(rig, Rig, experiment, self.DOMAIN)
        if LOADS[rig.load].MOVES_FREELY:
            raise InputError(
                f'load `{rig.load}` of {rig.name} moves freely; a force can be tracked on a load '
                'whose contraction is prescribed', 'rig')
        for name in ('supply_pa', 'external_force_n'):
            if others.get(name) is not None:
                raise InputError(
                    'acts on nothing in a loop that tracks a force; leave it out', name)
        self._made_of = (rig, experiment, contraction_m, others)
        super().__init__(rig, experiment, **others)
        if contraction_m is None:
            contraction_m = rig.parameters.get('contraction_m', 0.0)
        if callable(contraction_m) and rig.load != 'driven':
            raise InputError(f'load `{rig.load}` of {rig.name} does not move', 'contraction_m')
        times_s = np.arange(self.ticks + 1) / self.rate_hz
        way = [contraction_m(t) if callable(contraction_m) else contraction_m for t in times_s]
        try:
            self._way_m = np.array(way, dtype=float)
        except (TypeError, ValueError):
            self._way_m = np.empty(0)
        if self._way_m.shape != times_s.shape:
            raise InputError(f'is {shown(way[0])} at 0 s; a number is needed, or a function of '
                             'the time [s] that returns one', 'contraction_m')
        stroke_m = rig.muscle.stroke_m
        if not ((self._way_m >= 0.0) & (self._way_m <= stroke_m)).all():
            raise InputError(f'leaves 0 to {stroke_m:g} m, the stroke of {rig.muscle.name}',
                             'contraction_m')
        self._start_m = float(self._way_m[0])
        self._state, self._par = rig.pack(initial_contraction_m=self._start_m)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle what it is made of."""
        return _made_of, self._made_of

    def cost(self, controller: 'ForceController') -> float:
        """Return the cost [N] of tracking the experiment; the rules change in place."""
        force_n = self.run_raw(controller)['force_n']
        return tracking_cost(self._reference.values - force_n, self.start_tick)

    def run(self, controller: 'ForceController', learn: Learns = True) -> ModeResult:
        """
        Track the experiment; the controller's rules change in place.

        Parameters
        ----------
        controller : ForceController
            Round a self-organizing law. Starts as after ``pause``.
        learn : bool or callable
            Whether the rules may change, possibly as a function of time [s].

        Returns
        -------
        ModeResult
            In N; signals ``contraction_m``, ``pressure_pa``, ``command_pa``.

        Raises
        ------
        InputError
            The controller is in another mode, of another kind, made for the other valve, or runs
            at another rate.

        """
        log = self.run_raw(controller, learn)
        return ModeResult(
            'n', np.arange(self.ticks) / self.rate_hz, self._reference.values.copy(),
            log['force_n'],
            {name: log[name] for name in ('contraction_m', 'pressure_pa', 'command_pa')},
            self.experiment.cycles)

    def run_raw(self, controller: 'ForceController', learn: Learns = True) -> npt.NDArray[np.void]:
        """Return a ``FORCE_LOG`` of ``force_rollouts`` for every tick, shape (ticks,)."""
        check_wrapped(controller, FORCE, self.rig.valve, self.rate_hz)
        from pam_actuation.tuning import force_rollouts      # brings the compiler with it
        controller.pause()
        log = np.empty(self.ticks * size_of(force_rollouts.FORCE_LOG))
        mode, law = controller.compiled_arguments()
        raw = zeros(FORCE_INPUT)
        force_rollouts.force_rollout(
            self.ticks, (*mode, raw, controller.static_inverse, controller.law.input_array), law,
            self._fresh_plant(self._start_m), self.hsv, *self._fresh_driver(controller.driver),
            self._reference.rows(controller.lead_s), self._noise, self._quantum, self._way_m,
            learning_mask(controller, learn, self.ticks, self.rate_hz),
            fresh_rise(self.slow_start, self.rate_hz), raw, log)
        return log.view(force_rollouts.FORCE_LOG)


def _made_of(rig: 'Rig', experiment: 'Experiment', contraction_m: Course | float | None,
             others: dict[str, Any]) -> 'ForceLoop':
    return ForceLoop(rig, experiment, contraction_m, **others)
