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

"""What may be tuned and between which bounds: a named box, logarithmic where apt."""

from collections.abc import Callable
from dataclasses import dataclass, replace
import math
from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.control.modes.tracked import JOINT, tracked_by
from pam_sim.annotations import FloatArray
from pam_sim.declared import check_kind
from pam_sim.errors import InputError

if TYPE_CHECKING:
    from pam_actuation.tuning.problem import Law


@dataclass(frozen=True)
class Axis:
    """One tuned setting; ``log``: searched on a logarithmic scale; ``whole``: an integer."""

    name: str
    lower: float
    upper: float
    log: bool = True
    whole: bool = False


# Those a controller does not have are left out, so that its settings may change.
SOFC_AXES = (
    Axis('lead_s', 0.0, 0.2, log=False),
    Axis('valve_lag_s', 0.0, 0.12, log=False),
    Axis('rate_feedforward_pa_s_per_m', 0.0, 4e5, log=False),
    Axis('acceleration_feedforward_pa_s2_per_m', 0.0, 8e4, log=False),
    Axis('credit_delay_s', 0.02, 0.25, log=False),
    Axis('credit_spread_s', 0.0, 0.06, log=False),
    Axis('learning_rate', 0.2, 5.0),
    Axis('feedback_learning_per_m_s', 50.0, 6e3),
    Axis('feedforward_learning', 0.02, 1.0),
    Axis('motion_learning', 0.05, 1.5),
    Axis('feedforward_leak_per_m_s', 0.0, 50.0, log=False),
    Axis('feedback_gain_pa', 1e2, 2e4),
    Axis('proportional_pa_per_m', 3e4, 3e6),
    Axis('integral_pa_per_m_s', 3e5, 4e7),
    Axis('derivative_pa_s_per_m', 3e3, 5e5),
    Axis('change_filter_s', 0.005, 0.06),
    Axis('direction_blend_m', 2e-4, 5e-3),
    Axis('index_tau_s', 0.001, 0.3),
    Axis('reference_knots', 13, 61, log=False, whole=True),
)
# Of a joint: a limb swings slowly, so its rules are credited later. Damping and proportional gain
# may come down to next to nothing, and the limb has an inertia of any size.
_OF_A_JOINT = {axis.name: axis for axis in (
    Axis('acceleration_feedforward_pa_s2_per_m', 0.0, 3e5, log=False),
    Axis('credit_delay_s', 0.02, 0.5, log=False),
    Axis('proportional_pa_per_m', 1e3, 3e6),
    Axis('derivative_pa_s_per_m', 1e2, 5e5))}
JOINT_AXES = tuple(_OF_A_JOINT.get(axis.name, axis) for axis in SOFC_AXES)
PID_AXES = (
    Axis('proportional_pa_per_m', 1e5, 3e7),
    Axis('integral_pa_per_m_s', 1e6, 6e8),
    Axis('derivative_pa_s_per_m', 1e3, 3e6),
    Axis('change_filter_s', 0.001, 0.06),
)
PID_INVERSE_AXES = PID_AXES + (Axis('lead_s', 0.0, 0.2, log=False),)
ILC_AXES = PID_INVERSE_AXES + (
    Axis('learning_pa_per_m', 1e5, 3e7),
    Axis('learning_lead_s', 0.0, 0.25, log=False),
    Axis('learning_filter_s', 0.005, 0.15),
)
LQI_AXES = (
    Axis('lead_s', 0.0, 0.2, log=False),
    Axis('reference_feedforward', 0.0, 1.0, log=False),
    Axis('integral_weight', 1e-2, 1e5),
    Axis('command_weight', 1e-5, 10.0),
    Axis('disturbance_pa', 1.0, 1e5),
)
# Of disturbance and noise only the ratio counts, so the noise stays. With a smaller weight of the
# changes or a faster disturbance, sines are tracked as well, but the command is so restless that a
# muscle comes back late from venting.
MPC_AXES = (
    Axis('lead_s', 0.0, 0.2, log=False),
    Axis('command_weight', 1e-5, 10.0),
    Axis('change_weight', 4.0, 1e3),
    Axis('disturbance_pa', 10.0, 3000.0),
)


def _of_sofc(controller: 'Law') -> tuple[Axis, ...]:
    from pam_actuation.control.sofc.settings import (
        INERTIA, LEAST_INERTIA_PA_S2_PER_M, predicted_gains, SCALING)
    learned = controller.rules is not None and controller.rules.has_learned()
    axes = JOINT_AXES if tracked_by(controller) == JOINT else SOFC_AXES
    if predicted_gains(controller.settings):
        axes = tuple(replace(axis, lower=LEAST_INERTIA_PA_S2_PER_M) if axis.name == INERTIA
                     else axis for axis in axes)
    return tuple(axis for axis in axes if axis.name in controller.settings
                 and not (learned and axis.name in SCALING))


def _of_pid(controller: 'Law') -> tuple[Axis, ...]:
    return PID_INVERSE_AXES if controller.settings['use_static_inverse'] else PID_AXES


AXES_OF: dict[str, Callable[['Law'], tuple[Axis, ...]]] = {
    'sofc': _of_sofc, 'pid': _of_pid, 'lqi': lambda controller: LQI_AXES,
    'ilc': lambda controller: ILC_AXES, 'mpc': lambda controller: MPC_AXES}


def default_axes(controller: 'Law') -> tuple[Axis, ...]:
    """
    Return the axes for a controller.

    Settings that give learned rules their meaning stay fixed once rules have been learned.

    Raises
    ------
    InputError
        Nobody stated axes for this law.

    """
    if controller.kind not in AXES_OF:
        raise InputError(f'there are no axes for a {controller.kind} controller; tuned are '
                         f'{", ".join(AXES_OF)}', 'controller')
    return AXES_OF[controller.kind](controller)


def to_unit(axes: tuple[Axis, ...], settings: dict[str, float]) -> FloatArray:
    """Return settings as a point of the unit cube, clipped into it."""
    point = []
    for axis in axes:
        value = min(max(settings[axis.name], axis.lower), axis.upper)
        if axis.log:
            point.append(math.log(value / axis.lower) / math.log(axis.upper / axis.lower))
        else:
            point.append((value - axis.lower) / (axis.upper - axis.lower))
    return np.array(point)


def from_unit(axes: tuple[Axis, ...], point: FloatArray) -> dict[str, float]:
    """Return the settings of a point of the unit cube, four significant digits."""
    settings = {}
    for axis, part in zip(axes, point):
        part = min(max(float(part), 0.0), 1.0)
        if axis.log:
            value = axis.lower * (axis.upper / axis.lower) ** part
        else:
            value = axis.lower + part * (axis.upper - axis.lower)
        settings[axis.name] = float(round(value)) if axis.whole else float(f'{value:.4g}')
    return settings


def check_axes(axes: tuple[Axis, ...], settings: dict[str, float]) -> None:
    """Raise InputError for no axes, a name twice, one that is no setting, or an empty range."""
    if not axes:
        raise InputError('nothing to tune: give one axis or more', 'axes')
    for k, axis in enumerate(axes):
        check_kind(axis, Axis, 'axes', 'space.Axis(NAME, LOWER, UPPER)')
        if axis.name in [one.name for one in axes[:k]]:
            raise InputError(f'cannot tune {axis.name} twice; give it one axis', 'axes')
        if axis.name == 'rate_hz':
            raise InputError('cannot tune rate_hz: closed loops run at the rate of the controller '
                             'that is given; tune one controller for each rate', 'axes')
        if axis.name not in settings:
            raise InputError(f'cannot tune {axis.name}: the controller has no such setting')
        if not -math.inf < axis.lower < axis.upper < math.inf or (axis.log and axis.lower <= 0.0):
            raise InputError(
                f'cannot tune {axis.name} between {axis.lower:g} and {axis.upper:g}')
