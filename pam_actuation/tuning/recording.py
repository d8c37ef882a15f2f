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
What a recording says about a tuning: is the model good enough, what would have been commanded.

Two checks. The model is run freely on the recorded valve signal; a tuning is worth no more than
the model it was made on. The tuned controller is stepped over the recorded inputs with frozen
rules. The muscle did not follow *its* commands, so the comparison shows how differently it acts,
not how well.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_actuation.bags.oddities import run_remarks
from pam_actuation.control.config import load_controller
from pam_actuation.control.modes.joint import JointController
from pam_actuation.control.tick import RUNNING
from pam_actuation.replay.controller import replay_controller
from pam_actuation.replay.joint import replay_joint
from pam_actuation.replay.joint_controller import (
    COMMANDS, replay_joint_controller, states_suffice)
from pam_actuation.replay.model import GIVE_MODEL, with_model
from pam_actuation.replay.plant import replay_plant
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.errors import InputError
from pam_sim.joint import load_joint
from pam_sim.joint.parameters import SIDES
from pam_sim.joint.rig import JointRig
from pam_sim.short_repr import short_repr

if TYPE_CHECKING:
    from pam_actuation.bags.load import RecordedRun
    from pam_actuation.control.compiled_controller import CompiledController
    from pam_actuation.replay.difference import Difference
    from pam_actuation.tuning.problem import Law
    from pam_sim.rig import Rig
    from pam_sim.run import Run

# Error of the free run as a share of the recorded range; design values.
TRUSTED_SHARE = 0.03
DOUBTFUL_SHARE = 0.10
# What of a replayed plant is judged, and the words for it: signal to name.
_OF_MUSCLE = {'pressure': 'pressure', 'contraction': 'contraction'}
_OF_JOINT = {'joint_state.angle_rad': 'angle', **{
    f'{side}/pressure.pressure_pa': f'pressure of the {side}' for side in SIDES}}
_SHOWN = {'pressure': (1e-3, 'kPa'), 'contraction': (1e3, 'mm'), 'angle': (180.0 / np.pi, '°')}


@dataclass(frozen=True)
class ModelCheck:
    """
    How a model's free run compares with a recording.

    ``share`` is the largest of pressure and contraction (of a joint: angle) errors, rms over
    recorded range. ``signal`` is the one it belongs to, ``rms`` its size in SI. Without
    ``valve_judged`` the measured pressure was the input.
    """

    signal: str
    share: float
    rms: float
    valve_judged: bool = True

    @property
    def verdict(self) -> str:
        """Return ``trusted``, ``doubtful`` or ``wrong``."""
        if self.share <= TRUSTED_SHARE:
            return 'trusted'
        return 'doubtful' if self.share <= DOUBTFUL_SHARE else 'wrong'

    def sentence(self) -> str:
        """Return the outcome as one sentence."""
        factor, unit = _SHOWN[self.signal.split()[0]]
        size = f'{self.rms * factor:.3g} {unit}'
        says = {
            'trusted': 'trustworthy for tuning',
            'doubtful': 'doubtful for tuning: tune on randomised rigs too, or correct the model '
                        'with pam gap first',
            'wrong': 'not trustworthy for tuning: correct it with pam gap first'}[self.verdict]
        alone = '' if self.valve_judged else (
            ' The recording has no command of the valve, so this says nothing of the valve.')
        return (f'The model misses the recorded {self.signal} by {size} rms, '
                f'{100 * self.share:.1f} % of its range: {says}.{alone}')

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {**asdict(self), 'verdict': self.verdict, 'sentence': self.sentence()}


@short_repr
@dataclass(frozen=True)
class Counterfactual:
    """
    Commands of the tuned controller on recorded inputs against the recorded commands.

    Differences [Pa] over the ticks with usable inputs; ``saturated`` and
    ``recorded_saturated`` are shares of ticks at a pressure limit. The arrays hold every tick,
    one row; of a joint two rows, flexor and extensor.
    """

    ticks: int
    rms_pa: float
    largest_pa: float
    at_s: float
    saturated: float
    recorded_saturated: float
    time_s: FloatArray = field(repr=False)
    recorded_pa: FloatArray = field(repr=False)
    tuned_pa: FloatArray = field(repr=False)

    def sentence(self) -> str:
        """Return the outcome as one sentence."""
        return (
            f'On the recorded inputs the tuned controller, rules frozen, would have commanded '
            f'{self.rms_pa * 1e-3:.2f} kPa rms otherwise than the recorded one (largest '
            f'{self.largest_pa * 1e-3:.1f} kPa at {self.at_s:.2f} s), at a limit in '
            f'{100 * self.saturated:.1f} % of {self.ticks} ticks (recorded: '
            f'{100 * self.recorded_saturated:.1f} %).')

    def to_dict(self) -> dict[str, float]:
        """Return plain data, without the arrays."""
        plain = {name: value for name, value in vars(self).items() if np.ndim(value) == 0}
        return {**plain, 'sentence': self.sentence()}


@dataclass(frozen=True)
class RecordingCheck:
    """Both checks of one bag; one that was not possible is None and ``notes`` says why."""

    bag: str
    model: ModelCheck | None = None
    counterfactual: Counterfactual | None = None
    notes: tuple[str, ...] = ()

    def lines(self) -> list[str]:
        """Return the outcome as sentences."""
        done = [one.sentence() for one in (self.model, self.counterfactual) if one is not None]
        return [f'{self.bag}: {text}' for text in (*done, *self.notes)]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {'bag': self.bag, 'notes': list(self.notes), **{
            name: None if one is None else one.to_dict() for name, one in (
                ('model', self.model), ('counterfactual', self.counterfactual))}}


def check_recordings(runs: 'Sequence[RecordedRun | Run]', rig: 'Rig | JointRig',
                     controller: 'Law') -> list[RecordingCheck]:
    """Return a RecordingCheck of every run for a model and a tuned controller."""
    checks = []
    for run in runs:
        notes = run_remarks(run)
        model, tuned = None, None
        try:
            model = check_model(run, rig)
        except InputError as error:
            notes.append(f'No model check: {error.problem}.')
        try:
            tuned = counterfactual_of_joint(run, controller, rig) if isinstance(
                controller, JointController) else counterfactual(run, controller)
        except InputError as error:
            notes.append(f'No counterfactual check: {error.problem}.')
        checks.append(RecordingCheck(str(run.path), model, tuned, tuple(notes)))
    return checks


def check_model(run: 'Run', rig: 'Rig | JointRig') -> ModelCheck:
    """
    Compare a model with a recording.

    Raises
    ------
    InputError
        The recording cannot be simulated with this rig (other valve, signals missing).

    """
    modelled = with_model(run, rig)
    differences: list[Difference]
    valve_judged = True
    if isinstance(rig, JointRig):
        _check_valves(run, rig)
        names = _OF_JOINT
        differences = replay_joint(modelled, only='plant').parts['plant'].differences
    else:
        replayed = replay_plant(modelled)
        names, differences = _OF_MUSCLE, replayed.differences
        valve_judged = 'pressure' in replayed.recorded
    worst = None
    for one in differences:
        if one.signal in names and one.span > 0.0:
            if worst is None or one.rms / one.span > worst.share:
                worst = ModelCheck(
                    names[one.signal], one.rms / one.span, one.rms, valve_judged)
    if worst is None:
        raise InputError('neither pressure nor contraction moves', str(run.path))
    return worst


def _check_valves(run: 'Run', joint: JointRig) -> None:
    """Raise InputError unless the recorded signals are those of the joint's valves."""
    for place, muscle in joint.muscles.items():
        signals = run.require(f'{place}valve_signal').values
        if set(signals) != set(muscle.signal_names):
            raise InputError(f'{place}valve_signal has {", ".join(signals)}; the valve of '
                             f'{joint.name} takes {", ".join(muscle.signal_names)}',
                             str(run.path))


def counterfactual(run: 'Run', controller: 'CompiledController') -> Counterfactual:
    """
    Step a controller over the inputs of a recording, its rules frozen.

    Parameters
    ----------
    run : pam_sim.run.Run
        With ``controller_state`` and what the ticks used.
    controller : object
        As ``load_controller`` gives it; not changed.

    Raises
    ------
    InputError
        The recording has no complete controller ticks.

    """
    fresh = load_controller(controller.to_yaml())
    fresh.freeze_learning = True
    again = replay_controller(run, fresh, keep_states=True)
    return _compared(run, again.states, again.stamp_ns, again.recorded_pa, again.replayed_pa)


def counterfactual_of_joint(run: 'Run', controller: JointController,
                            model: 'Rig | JointRig | None' = None) -> Counterfactual:
    """
    Step the controller of a joint over the inputs of a recording, its rules frozen.

    A recording that names no joint counts as one of ``model``.

    Raises
    ------
    InputError
        The recording has no complete controller ticks, or is of a version whose ticks do not
        hold all inputs.

    """
    run.require('controller_state')
    if not states_suffice(run):
        raise InputError('its controller_state does not hold all inputs of a tick',
                         str(run.path))
    own = run.metadata.get('rig')
    joint = load_joint(own) if own else model
    if not isinstance(joint, JointRig):
        raise InputError(f'the recording does not say which joint it is; {GIVE_MODEL}',
                         str(run.path))
    fresh = load_controller(controller.to_yaml(), joint, accept_other_rig=True)
    assert isinstance(fresh, JointController)
    fresh.freeze_learning = True
    again = replay_joint_controller(run, fresh, joint)
    commands, names = again.commands, [f'{topic}.pressure_pa' for topic in COMMANDS]
    for name in names:
        if len(commands.stamp_ns[name]) != len(again.stamp_ns):
            raise InputError(f'{len(again.stamp_ns) - len(commands.stamp_ns[name])} commands of '
                             f'{name.partition("/")[0]} are not in it', str(run.path))
    recorded, replayed = (np.array([which[name] for name in names])
                          for which in (commands.recorded, commands.replayed))
    return _compared(run, again.states, again.stamp_ns, recorded, replayed)


def _compared(run: 'Run', states: dict[str, FloatArray], stamp_ns: IntArray,
              recorded_pa: FloatArray, replayed_pa: FloatArray) -> Counterfactual:
    """Compare commands of all ticks, one row or that of each muscle."""
    used = np.isin(states['input_reason'], RUNNING)
    if not used.any():
        raise InputError('no controller tick had usable inputs', str(run.path))
    away = np.where(used, np.abs(replayed_pa - recorded_pa), 0.0)
    worst = int(np.argmax(away)) % len(stamp_ns)
    limited = (states['saturated_low'] > 0.5) | (states['saturated_high'] > 0.5)
    before = run.require('controller_state').values
    order = np.argsort(before['tick'], kind='stable')       # that of the replay
    recorded = sum((before[name][order] > 0.5 for name in (
        'saturated_low', 'saturated_high') if name in before), np.zeros(len(order)))
    return Counterfactual(
        int(used.sum()), float(np.sqrt(np.mean(away[..., used] ** 2))),
        float(away.max()), (int(stamp_ns[worst]) - run.start_ns) * 1e-9,
        float(np.mean(limited[used])), float(np.mean(recorded[used] > 0)),
        (stamp_ns - run.start_ns) * 1e-9, recorded_pa, replayed_pa)
