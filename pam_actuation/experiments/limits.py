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

"""What a rig can do of an experiment, asked before the first message is sent."""

from types import SimpleNamespace
from typing import Any, TYPE_CHECKING

from pam_actuation.control.modes.force_surface import highest_force_n
from pam_actuation.control.modes.tracked import tracked_by
from pam_actuation.drivers.for_rig import driver_config
from pam_sim.errors import InputError
from pam_sim.joint.rig import JointRig
from pam_sim.load import LOADS
from pam_sim.muscle.coefficients import PREFIX as OF_LAW
from pam_sim.units import P_ATM_PA
from pam_sim.valve.reach import reach_gauge_pa

if TYPE_CHECKING:
    from pam_actuation.control.compiled_controller import CompiledController
    from pam_actuation.control.modes.wrapped import WrappedLaw
    from pam_actuation.experiments.experiment import Experiment
    from pam_sim.rig import Rig

# Design values: of a contraction [m] that friction may take, and of jumps worth a word.
FRICTION_PA = 30e3
GAIN_SHARE = 0.02       # of the range of a regulator; a pressure beyond it is worth a word
LEAST_JUMP = {'contraction': 5e-4, 'force': 2.0, 'joint_angle': 0.02}
_SHOWN = {'contraction': (1e3, 'mm'), 'force': (1.0, 'N'), 'joint_angle': (1.0, 'rad')}
_VALVE_OF = {'ppr_voltage': 'ppr', 'hsv_duty': 'hsv'}


def check_rig(experiment: 'Experiment', rig: 'JointRig | Rig') -> None:
    """
    Raise InputError where an experiment asks for more than a rig can give.

    Contraction: the stroke of the muscle. Force: what the muscle gives at the highest pressure
    where its load holds it, and a load whose contraction is prescribed. Joint angle: a joint,
    and its range. Pressure: the limit of the driver and the supply of the valves; a regulator
    that ends below it stays at its end, which ``reach_remarks`` tells. Raw valve signal: the
    valve it is meant for, and the input range of a regulator. Disturbance: a load that moves
    freely, and no joint. Measured topics it needs.
    """
    place = f'experiment "{experiment.name}"'
    if experiment.domain == 'joint_angle' or isinstance(rig, JointRig):
        _check_joint(experiment, rig, place)
    elif experiment.domain == 'contraction':
        _check_stroke(experiment, rig, place)
    elif experiment.domain == 'force':
        _check_force(experiment, rig, place)
    elif experiment.domain == 'pressure':
        _check_pressure(experiment, rig, place)
    elif rig.valve != _VALVE_OF[experiment.domain]:
        raise InputError(
            f'its values are the raw signal {experiment.domain} of the valve type '
            f'{_VALVE_OF[experiment.domain]}, the rig {rig.name} has {rig.valve}; choose that '
            f'valve (--valve {_VALVE_OF[experiment.domain]}), or an experiment for this one',
            place)
    elif experiment.domain == 'ppr_voltage':
        _check_voltage(experiment, rig, place)
    if experiment.disturbance:
        _check_push(rig, place)
    if 'supply_pressure' in experiment.needs and rig.valve != 'hsv':
        raise InputError(
            f'it needs supply_pressure, which {rig.name} with valve {rig.valve} does not measure',
            place)


def check_tracked(
        experiment: 'Experiment',
        controller: 'CompiledController | WrappedLaw | None') -> None:
    """Raise InputError where an experiment is in one quantity, its controller in another."""
    if not experiment.asks_for_motion:
        return
    tracked = tracked_by(controller)
    if tracked.topic != experiment.domain:
        raise InputError(
            f'is in {experiment.domain}; the controller has `mode: {tracked.mode}`',
            f'experiment "{experiment.name}"')


def highest_gauge_pa(rig: 'Rig',
                     controller: 'CompiledController | SimpleNamespace | None' = None) -> float:
    """Return the highest pressure [Pa gauge] that driver, valve, supply and controller allow."""
    limits = [driver_config(rig).safety.max_pressure_gauge_pa,
              reach_gauge_pa(rig.valve, rig.parameters)]
    if controller is not None and 'max_pressure_gauge_pa' in controller.settings:
        limits.append(controller.settings['max_pressure_gauge_pa'])
    return min(limits)


def reach_remarks(experiment: 'Experiment', rig: 'JointRig | Rig | None',
                  controller: Any = None) -> tuple[str, ...]:
    """Return a sentence if an experiment asks for more than the rig holds at its limit."""
    if rig is None or isinstance(rig, JointRig):
        return ()
    if experiment.domain == 'pressure' and rig.valve == 'ppr':
        return _regulator_remarks(experiment, rig)
    if experiment.domain != 'contraction' or not LOADS[rig.load].MOVES_FREELY:
        return ()
    gauge_pa = highest_gauge_pa(rig, controller)
    worst_m = experiment.chain.extremes()[1]
    if rig.static_pressure_pa(worst_m) + FRICTION_PA <= P_ATM_PA + gauge_pa:
        return ()
    reach_m = float(rig.static_contraction_m(P_ATM_PA + gauge_pa))
    share = experiment.chain.share_above(reach_m)
    time = f'beyond that for {100 * share:.0f} % of the time' if share else 'too near to that'
    return (f'the reference asks for up to {1e3 * worst_m:.1f} mm; at {1e-3 * gauge_pa:.0f} kPa '
            f'gauge this rig holds {1e3 * reach_m:.1f} mm at most, less with friction; it is '
            f'{time}, where the error says nothing of the controller',)


def _regulator_remarks(experiment: 'Experiment', rig: 'Rig') -> tuple[str, ...]:
    highest, worst = highest_gauge_pa(rig), experiment.chain.extremes()[1] - P_ATM_PA
    if worst <= (1.0 + GAIN_SHARE) * highest:
        return ()
    share = experiment.chain.share_above(P_ATM_PA + highest)
    return (f'the experiment asks for up to {1e-3 * worst:.0f} kPa gauge; the regulator of this '
            f'rig ends at {1e-3 * highest:.0f} kPa and stays there for {100 * share:.0f} % of the '
            'time',)


def unknown_remarks(rig: 'JointRig | Rig | None') -> tuple[str, ...]:
    """
    Return a sentence if numbers of a model are unknown and nobody has found them yet.

    `pam identify` leaves a number unknown that the data tell only together with others. Such a
    number has another value than the nominal one.
    """
    if rig is None or isinstance(rig, JointRig) or not rig.unknown:
        return ()
    nominal = {one.name: one.default for one in rig.number_list}
    guessed = [name for name in rig.unknown if rig.number(name) == nominal[name]]
    names = [name for name in guessed if not name.startswith(OF_LAW)]
    if len(names) < len(guessed):
        names.append('the force law')
    return (f'the model has nominal values for what {rig.name} states as unknown '
            f'({", ".join(names)}); `pam identify BAG --rig FILE` finds them and writes a rig '
            'to go on with',) if names else ()


def jump_remarks(experiment: 'Experiment') -> tuple[str, ...]:
    """Return a sentence on every jump of a reference that no step asks for."""
    if experiment.domain not in LEAST_JUMP:
        return ()
    factor, unit = _SHOWN[experiment.domain]
    return tuple(
        f'the reference jumps from {factor * before:.4g} to {factor * after:.4g} {unit} at '
        f'{start:.4g} s, where `{name}` begins; ramp to its start first, or use `step` if a jump '
        'is meant'
        for start, name, before, after in experiment.chain.jumps(LEAST_JUMP[experiment.domain]))


def _check_stroke(experiment: 'Experiment', rig: 'Rig', place: str) -> None:
    stroke = rig.muscle.stroke_m
    worst = experiment.chain.extremes()[1]
    if worst > stroke:
        raise InputError(
            f'asks for {1e3 * worst:.1f} mm of contraction; {rig.name} allows 0 to '
            f'{1e3 * stroke:.1f} mm', place)


def _check_force(experiment: 'Experiment', rig: 'Rig', place: str) -> None:
    if LOADS[rig.load].MOVES_FREELY:
        raise InputError(
            f'asks for a force; the load `{rig.load}` of {rig.name} moves freely, a force can be '
            'tracked where the contraction is prescribed (isometric, driven), as of '
            'dmsp_5_300_isometric_realistic', place)
    highest = highest_force_n(
        rig, highest_gauge_pa(rig), rig.parameters.get('contraction_m', 0.0))
    worst = experiment.chain.extremes()[1]
    if worst > highest:
        raise InputError(
            f'asks for {worst:.1f} N; {rig.name} allows 0 to {highest:.1f} N', place)


def _check_joint(experiment: 'Experiment', joint: 'JointRig | Rig', place: str) -> None:
    if not isinstance(joint, JointRig):
        raise InputError(
            f'is in {experiment.domain}; {joint.name} is a single muscle; name a joint, such as '
            'joint_dmsp_5_300_realistic', place)
    if experiment.domain != 'joint_angle':
        raise InputError(
            f'is in {experiment.domain}; {joint.name} is a joint; name an experiment in '
            'joint_angle, such as joint_sine or knee_sine', place)
    lower, upper = joint.range_rad
    worst = experiment.chain.extremes()
    if worst[0] < lower or worst[1] > upper:
        raise InputError(
            f'asks for {worst[0]:.3f} to {worst[1]:.3f} rad; {joint.name} allows {lower:.3f} to '
            f'{upper:.3f} rad', place)


def _check_push(rig: 'JointRig | Rig', place: str) -> None:
    if isinstance(rig, JointRig):
        raise InputError(
            f'its `disturbance` is a force on a load; the joint {rig.name} takes torques only, '
            'on the topic external_torque', place)
    if 'mass_kg' not in rig.parameters:
        raise InputError(
            f'it pushes on the load, and the load `{rig.load}` of {rig.name} has no mass that '
            'could move', place)


def _check_pressure(experiment: 'Experiment', rig: 'Rig', place: str) -> None:
    highest = (highest_gauge_pa(rig) if rig.valve == 'hsv'
               else driver_config(rig).safety.max_pressure_gauge_pa)
    worst = experiment.chain.extremes()[1] - P_ATM_PA
    if worst > highest + 1e-6:
        raise InputError(
            f'asks for {1e-3 * worst:.1f} kPa gauge; {rig.name} allows 0 to '
            f'{1e-3 * highest:.1f} kPa (driver limit and supply)', place)


def _check_voltage(experiment: 'Experiment', rig: 'Rig', place: str) -> None:
    highest = rig.parameters['ppr_highest_v']
    worst = experiment.chain.extremes()[1]
    if worst > highest:
        raise InputError(
            f'asks for {worst:g} V; the regulator of {rig.name} allows 0 to {highest:g} V '
            '(ppr_highest_v)', place)
