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

"""Recordings of a simulated rig, without ROS: the rig stands for the truth."""

from pathlib import Path
from typing import Any, TYPE_CHECKING

from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.investigate.recorder import Progress, Recorder

if TYPE_CHECKING:
    from pam_actuation.control.config import Controller
    from pam_actuation.experiments.experiment import Experiment
    from pam_sim.rig import Rig


def controller_for(experiment: 'Experiment', rig: 'Rig') -> 'Controller | None':
    """Return the preset that tracks an experiment on a rig; None where none is needed."""
    if not experiment.asks_for_motion:
        return None
    from pam_actuation.control.config import load_controller
    from pam_actuation.control.modes.files import preset_for
    return load_controller(preset_for(experiment, rig), rig, accept_other_rig=True)


class SimulatedRecorder(Recorder):
    """
    Simulates a rig in place of a real one.

    Parameters
    ----------
    rig : pam_sim.Rig
        What stands for the truth. The look for the gap is not told of it.

    """

    def __init__(self, rig: 'Rig') -> None:
        self._rig = rig
        self.valve = rig.valve

    def check(self, experiment: 'Experiment') -> None:
        """Raise InputError where the rig cannot do an experiment."""
        experiment.check_reachable(self._rig)

    def record(self, experiment: 'Experiment', bag: Path, seed: int, why: str,
               progress: Progress) -> None:
        """Simulate an experiment; arguments and errors as of :meth:`Recorder.record`."""
        length_s = experiment.duration_s
        simulate_experiment(
            experiment, self._rig, controller_for(experiment, self._rig), bag, seed=seed,
            progress=lambda done_s: progress(done_s / length_s))

    def to_dict(self) -> dict[str, Any]:
        """Return what records, as plain data."""
        return {'how': 'simulated', 'rig': self._rig.to_yaml()}
