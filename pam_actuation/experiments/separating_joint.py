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
Experiments of a joint that tell rivals of one of its muscles apart.

A joint is moved by its angle; nobody asks a single muscle of it for a pressure. So the pieces of
the menu are motions of the angle, with the controller that tracks it, and stay within the angles
that were recorded.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
import tempfile
from typing import Any

import numpy as np
from pam_actuation.bags.load import load_run, RecordedRun
from pam_actuation.control.config import load_controller
from pam_actuation.control.modes.files import joint_preset_for
from pam_actuation.experiments.experiment import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.namespaces import JOINT
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.joint import JointRig, load_rig_or_joint
from pam_sim.joint.parameters import SIDES
from pam_sim.located_yaml import dump_yaml
from pam_sim.rig import Rig
from pam_sim.run import Run

LOOPS = (1.0, 2.0 / 3.0, 1.0 / 3.0)    # of the range, one after the other at one speed
INSIDE = 0.9                 # of the angles that were recorded, or of the range of the joint
LEAST_RAD = 0.05             # a smaller recorded range tells nothing of where the joint may go
GRID = 2001                  # angles at which the contraction is looked up


@dataclass(frozen=True)
class InJoint:
    """
    One muscle of a joint, and how far the joint may be turned.

    Parameters
    ----------
    joint : JointRig
        The model of the joint.
    side : str
        ``flexor`` or ``extensor``.
    low_rad, high_rad : float
        Lowest and highest angle of an experiment.

    """

    joint: JointRig
    side: str
    low_rad: float
    high_rad: float

    @property
    def limit(self) -> str:
        """Return in a sentence how far the experiment goes."""
        return f'The angle goes from {self.low_rad:.2g} to {self.high_rad:.2g} rad.'

    def menu(self) -> dict[str, tuple[str, list[dict[str, dict[str, float]]]]]:
        """Return name -> (what it shows, segments); each piece begins at the lowest angle."""
        low, high = self.low_rad, self.high_rad
        span, band = high - low, {'low_rad': low, 'high_rad': high}
        middle = 0.5 * (low + high)
        return {
            'edges': ('sharp steps of the angle at random times show transport and speed', [
                {'random_steps': {**band, 'min_hold_s': 0.25, 'max_hold_s': 0.9,
                                  'duration_s': 16.0, 'seed': 7}}]),
            'loops': ('slow loops of three sizes show what depends on the path', [
                {'triangle': {'low_rad': low, 'high_rad': low + size * span,
                              'period_s': 9.0 * size, 'cycles': 1}} for size in LOOPS]),
            'bands': ('the same motion at two angles shows what grows with the pressure', [
                {'two_bands': {'low_center_rad': middle - 0.3 * span,
                               'high_center_rad': middle + 0.3 * span,
                               'amplitude_rad': 0.175 * span, 'frequency_hz': 0.5, 'cycles': 3,
                               'move_s': 1.5}}]),
            'speeds': ('the same path slowly and quickly shows what depends on speed', [
                {'triangle': {**band, 'period_s': 8.0, 'cycles': 1}},
                {'triangle': {**band, 'period_s': 1.6, 'cycles': 5}}]),
            'holds': ('long holds after steps of the angle show what drifts', [
                {'step': {'to_rad': high, 'duration_s': 7.0}},
                {'step': {'to_rad': low, 'duration_s': 7.0}}]),
            'frequencies': ('a multisine shows lags at every frequency', [
                {'step': {'to_rad': middle, 'duration_s': 1.0}},
                {'multisine': {'center_rad': middle, 'amplitude_rad': 0.4 * span, 'min_hz': 0.1,
                               'max_hz': 2.0, 'lines': 10, 'duration_s': 16.0, 'seed': 8}}])}

    def begin(self) -> dict[str, Any]:
        """Return domain, and what leads to the lowest angle before each piece."""
        return {'domain': 'joint_angle', 'low': {'step': {
            'to_rad': self.low_rad, 'duration_s': 1.5}}}

    def simulated(self, plain: Mapping[str, Any], truth: Rig) -> RecordedRun:
        """Return the simulated run of this muscle, in the joint that has it as ``truth``."""
        joint = self.joint.with_(valve=truth.valve)
        flexes = self.side == SIDES[0]
        joint = joint.with_(flexor=truth if flexes else None,
                            extensor=None if flexes else truth)
        controller = load_controller(
            joint_preset_for(joint, joint.valve), joint, accept_other_rig=True)
        with tempfile.TemporaryDirectory(prefix='pam_separating_') as folder:
            simulate_experiment(load_experiment(dump_yaml(dict(plain))), joint, controller,
                                Path(folder) / 'bag')
            return load_run(Path(folder) / 'bag', f'{JOINT}/{self.side}')


def in_joint(runs: Sequence[Run], joint: JointRig | None = None) -> InJoint | None:
    """
    Return which muscle of a joint recordings are of, None where they are of a single muscle.

    Parameters
    ----------
    runs : list of pam_sim.run.Run
        Of this muscle.
    joint : JointRig, optional
        The model; by default the joint that the first recording holds.

    """
    side = runs[0].namespace.rpartition('/')[2]
    if side not in SIDES:
        return None
    if joint is None:
        try:
            held = load_rig_or_joint(runs[0].metadata['rig'])
        except (InputError, KeyError):
            return None
        if not isinstance(held, JointRig):
            return None
        joint = held
    low_rad, high_rad = _angles(joint, side, [
        run['contraction'].values['contraction_m'] for run in runs if 'contraction' in run])
    middle, half = 0.5 * (low_rad + high_rad), 0.5 * INSIDE * (high_rad - low_rad)
    return InJoint(joint, side, round(middle - half, 3), round(middle + half, 3))


def _angles(joint: JointRig, side: str, contractions_m: Sequence[FloatArray]
            ) -> tuple[float, float]:
    """Return the angles at which a muscle has the contractions that were recorded."""
    angle_rad = np.linspace(*joint.range_rad, GRID)
    at_m = np.asarray(joint.contractions_m(angle_rad)[SIDES.index(side)])
    seen = [c[np.isfinite(c)] for c in contractions_m if np.isfinite(c).any()]
    if seen:
        inside = angle_rad[(at_m >= min(c.min() for c in seen))
                           & (at_m <= max(c.max() for c in seen))]
        if inside.size and inside[-1] - inside[0] >= LEAST_RAD:
            return float(inside[0]), float(inside[-1])
    return float(angle_rad[0]), float(angle_rad[-1])
