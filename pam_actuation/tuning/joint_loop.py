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
Closed-loop rollouts in joint mode: two muscles turn a limb, the angle is tracked.

The same compiled steps as in the controller, drivers and joint, as in ``closed_loop``.
"""

from collections.abc import Mapping, Sequence
import math
from typing import Any, TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from pam_actuation.control.modes.joint import COMMANDS, JOINT_INPUT
from pam_actuation.control.modes.tracked import JOINT
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.tuning.cost import tracking_cost
from pam_actuation.tuning.loop_checks import check_drivers, check_parts, check_wrapped
from pam_actuation.tuning.loop_parts import Driver, JOINT_READINGS, READINGS
from pam_actuation.tuning.loop_setup import (
    Course, DriverLaw, first_periodic_tick, fresh_rise, latency_steps,
    learning_mask, Learns, PHYSICS_S, sampled, sensor_noise, steps_per_tick)
from pam_actuation.tuning.mode_result import ModeResult
from pam_actuation.tuning.sampled_reference import SampledReference
from pam_sim.annotations import FloatArray
from pam_sim.declared import check_not_negative, check_whole
from pam_sim.errors import InputError
from pam_sim.records import fields, size_of, zeros
from pam_sim.sensors.encoder import ANGLE_NOISE_RAD, ANGLE_STEP_RAD

if TYPE_CHECKING:
    from pam_actuation.control.modes.joint import JointController
    from pam_actuation.drivers.config import DriverConfig
    from pam_actuation.experiments.experiment import Experiment
    from pam_sim.joint.rig import JointRig


class JointLoop:
    """
    A joint, an experiment in its angle and one realisation of the sensor noise.

    Parameters
    ----------
    joint : pam_sim.joint.JointRig
        The valves of its muscles decide on the driver laws, their sensors on the noise of
        pressures and forces.
    experiment : Experiment
        Domain ``joint_angle``.
    seed : int
        Seed of the sensor noise.
    rate_hz : float
        Controller rate; a whole number of milliseconds per period.
    latency_s : float, optional
        From the measurement to the new valve signals; as of ``closed_loop.MuscleLoop``.
    external_torque_n_m : callable or None
        Torque [N m] on the limb, flexion positive, as a function of time [s].
    angle_noise_rad, angle_step_rad : float
        Standard deviation and step of the measured angle.
    drivers : pair of DriverConfig, optional
        What the drivers of flexor and extensor know; by default the data sheets of the joint.
        Numbers a controller asks for come on top.
    preview_s : float
        How far ahead the controller is told the reference; without limit by default.
    slow_start : bool
        As of ``closed_loop.MuscleLoop``.

    Raises
    ------
    InputError
        The experiment is in something else, leaves the range of the joint, the rate does
        not fit, or a seed, latency, preview, noise, step or torque is not what is allowed.

    """

    def __init__(self, joint: 'JointRig', experiment: 'Experiment', seed: int = 0,
                 rate_hz: float = 200.0, latency_s: float | None = None,
                 external_torque_n_m: Course | None = None,
                 angle_noise_rad: float = ANGLE_NOISE_RAD, angle_step_rad: float = ANGLE_STEP_RAD,
                 drivers: 'Sequence[DriverConfig] | None' = None,
                 preview_s: float = math.inf, slow_start: bool = False) -> None:
        from pam_sim.joint.rig import JointRig
        check_parts(joint, JointRig, experiment, JOINT.topic)
        if drivers is not None:
            check_drivers(drivers, len(joint.muscles), 'drivers')
        check_not_negative(angle_noise_rad, 'angle_noise_rad', 'rad')
        check_not_negative(angle_step_rad, 'angle_step_rad', 'rad')
        experiment.check_reachable(joint)
        steps = steps_per_tick(rate_hz)
        check_whole(seed, 0, 'seed')
        self.joint, self.experiment, self.rate_hz = joint, experiment, rate_hz
        self.slow_start = slow_start
        self._reference = SampledReference(experiment, rate_hz, preview_s)
        self.ticks = self._reference.ticks
        sides = {'flexor': joint.flexor, 'extensor': joint.extensor}
        angle = np.random.default_rng((seed, len(sides))).standard_normal(self.ticks)
        self._noise = np.empty(self.ticks * size_of(JOINT_READINGS))
        self._quantum = zeros(JOINT_READINGS)
        noises, steps_of = self._noise.view(JOINT_READINGS), fields(self._quantum, JOINT_READINGS)
        noises['angle_rad'], steps_of.angle_rad = angle * angle_noise_rad, angle_step_rad
        for k, (side, rig) in enumerate(sides.items()):
            noise, step = sensor_noise(rig, self.ticks, (seed, k))
            for name in READINGS.names or ():
                noises[f'{side}_{name}'] = noise.view(READINGS)[name]
                steps_of[f'{side}_{name}'] = fields(step, READINGS)[name]
        self._torque = np.zeros(self.ticks)
        if external_torque_n_m is not None:
            self._torque[:] = sampled(external_torque_n_m, [
                k / rate_hz for k in range(self.ticks)], 'external_torque_n_m')
        self._arguments = (joint, experiment, seed, rate_hz, latency_s, external_torque_n_m,
                           angle_noise_rad, angle_step_rad, drivers, preview_s, slow_start)
        configs = drivers or [driver_config(rig) for rig in sides.values()]
        self._drivers = [DriverLaw(rig, config, rate_hz)
                         for rig, config in zip(sides.values(), configs)]
        self._plant = joint.plant(dt_s=PHYSICS_S)
        self._steps = steps, latency_steps(latency_s, steps)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle what it is made of: a cluster gets kilobytes, not the arrays."""
        return JointLoop, self._arguments

    def __repr__(self) -> str:
        """Return joint, experiment and rate in one line."""
        return (f'{type(self).__name__}({self.joint.name!r}, {self.experiment!r}, '
                f'{self.rate_hz:g} Hz)')

    @property
    def rig(self) -> 'JointRig':
        """The joint."""
        return self.joint

    @property
    def start_tick(self) -> int:
        """First tick of the periodic part, of the whole where there is none."""
        return first_periodic_tick(self.experiment, self.rate_hz)

    def _fresh_drivers(self, asked: Mapping[str, float] | None
                       ) -> tuple[tuple[Driver, ...], tuple[int, int, int]]:
        """Return the driver laws at their start, and ``timing`` as of ``rollouts.sense``."""
        laws, (every, *others) = zip(*(driver.fresh(asked) for driver in self._drivers))
        if any(other != every for other in others):
            raise InputError('flexor and extensor need valves of one kind and period',
                             f'joint {self.joint.name}')
        steps, latency = self._steps
        return laws, (steps, every, latency)

    def tracked(self, controller: 'JointController'
                ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return time [s], reference and error [degrees] of tracking the experiment."""
        run = self.run(controller)
        return run.time_s, np.degrees(run.reference), np.degrees(run.error)

    def cost(self, controller: 'JointController') -> float:
        """Return the cost [degrees] of tracking the experiment; the rules change in place."""
        angle_rad = self.run_raw(controller)['angle_rad']
        return tracking_cost(
            np.degrees(self._reference.values - angle_rad), self.start_tick)

    def run(self, controller: 'JointController', learn: Learns = True) -> ModeResult:
        """
        Track the experiment; the controller's rules change in place.

        Parameters
        ----------
        controller : JointController
            Round a self-organizing law. Starts as after ``pause``.
        learn : bool or callable
            Whether the rules may change, possibly as a function of time [s].

        Returns
        -------
        ModeResult
            In rad; signals ``flexor_pressure_pa``, ``flexor_command_pa``, ``flexor_force_n``
            and the same of the extensor.

        Raises
        ------
        InputError
            The controller is in another mode, of another kind, made for the other valve, or runs
            at another rate.

        """
        log = self.run_raw(controller, learn)
        return ModeResult(
            'rad', np.arange(self.ticks) / self.rate_hz, self._reference.values.copy(),
            log['angle_rad'],
            {name: log[name] for name in log.dtype.names or () if name != 'angle_rad'},
            self.experiment.cycles)

    def run_raw(self, controller: 'JointController', learn: Learns = True) -> npt.NDArray[np.void]:
        """Return a ``JOINT_LOG`` of ``joint_rollouts`` for every tick, shape (ticks,)."""
        check_wrapped(controller, JOINT, self.joint.valve, self.rate_hz)
        from pam_actuation.tuning import joint_rollouts      # brings the compiler with it
        controller.pause()
        # Copies: several threads may track the experiment at the same time.
        plant = tuple(tuple(array.copy() for array in part) for part in self._plant.arrays)
        log = np.empty(self.ticks * size_of(joint_rollouts.JOINT_LOG))
        (par, state), law = controller.compiled_arguments()
        raw = zeros(JOINT_INPUT)
        joint_rollouts.joint_rollout(
            self.ticks, (par, raw, controller.law.input_array), law, state, plant,
            tuple(driver.hsv for driver in self._drivers),
            *self._fresh_drivers(controller.driver),
            self._reference.rows(controller.lead_s), self._noise,
            self._quantum, self._torque,
            learning_mask(controller, learn, self.ticks, self.rate_hz),
            tuple(fresh_rise(self.slow_start, self.rate_hz) for _ in self._drivers), raw,
            zeros(COMMANDS), log)
        return log.view(joint_rollouts.JOINT_LOG)
