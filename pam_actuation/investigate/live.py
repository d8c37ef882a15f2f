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

"""Recordings on live nodes, of a simulated or a real rig; a person allows each motion."""

from pathlib import Path
import tempfile
import time
from typing import Any, TYPE_CHECKING

from pam_actuation.bags.ending import FINISHED, PLAYING
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.experiments.limits import reach_remarks
from pam_actuation.hardware.files import hardware_file
from pam_actuation.investigate.motion import Ask, limit_of, Motion
from pam_actuation.investigate.recorder import Declined, Progress, Recorder, RecordingFailed
from pam_actuation.investigate.simulated import controller_for
from pam_actuation.messages import LEVEL_ERROR
from pam_actuation.namespaces import MUSCLE
from pam_actuation.rigging import layouts
from pam_sim.errors import InputError
from pam_sim.files import write_text
from pam_sim.units import gauge_kpa, P_ATM_PA

if TYPE_CHECKING:
    from pam_actuation.experiments.experiment import Experiment
    from pam_actuation.rigging.supervisor import Supervisor
    from pam_sim.rig import Rig

OVERDUE_S = 5.0               # the reference may finish this much late


class LiveRecorder(Recorder):
    """
    Asks a person, then plays an experiment on live nodes.

    Parameters
    ----------
    rig : pam_sim.Rig
        What the nodes are told: the simulated rig, or the model of the real one.
    ask : callable
        Takes a Motion; whether it is allowed.
    hardware : str
        Name in config/hardware or a file of hardware; 'topics' for a program of your own; ''
        for a simulated rig.
    domain_id : int, optional
        ROS domain; by default a free one for a simulated rig, that of the environment for a
        real one.

    Raises
    ------
    InputError
        No such file of hardware.

    """

    is_live = True

    def __init__(self, rig: 'Rig', ask: Ask, hardware: str = '',
                 domain_id: int | None = None) -> None:
        self._rig, self._ask, self._domain_id = rig, ask, domain_id
        self._file = hardware_file(hardware) if hardware else ''
        # That word starts a watchdog in place of sensors; its file does not.
        self._hardware = hardware if hardware == layouts.TOPICS else self._file
        self.valve = rig.valve

    def check(self, experiment: 'Experiment') -> None:
        """Raise InputError where the rig cannot do an experiment, or its driver would cut it."""
        experiment.check_reachable(self._rig)
        limit_pa = self.motion(experiment).limit_gauge_pa
        if experiment.domain == 'pressure' and \
                experiment.chain.extremes()[1] - P_ATM_PA > limit_pa + 1e-6:
            raise InputError(
                f'asks for {gauge_kpa(experiment.chain.extremes()[1]):.0f} kPa gauge; the driver '
                f'allows 0 to {limit_pa * 1e-3:.0f} kPa', f'experiment "{experiment.name}"')

    def motion(self, experiment: 'Experiment', why: str = '') -> Motion:
        """Return what a person is asked before an experiment."""
        limit = driver_config(self._rig).safety.max_pressure_gauge_pa
        if self._file:
            limit = min(limit_of(self._file, limit), limit)
        return Motion(experiment, limit, self.valve, bool(self._file), why,
                      reach_remarks(experiment, self._rig))

    def record(self, experiment: 'Experiment', bag: Path, seed: int, why: str,
               progress: Progress) -> None:
        """Ask, play and record; arguments and errors as of :meth:`Recorder.record`."""
        self.check(experiment)
        if not self._ask(self.motion(experiment, why)):
            raise Declined(f'"{experiment.name}" was not allowed; nothing moved')
        if self._file:
            self._on_hardware(experiment, bag, progress)
        else:
            self._on_simulated_nodes(experiment, bag, seed, progress)

    def to_dict(self) -> dict[str, Any]:
        """Return what records, as plain data."""
        if self._file:
            return {'how': 'hardware', 'rig': self._rig.to_yaml(),
                    'hardware': Path(self._file).read_text(encoding='utf-8')}
        return {'how': 'live', 'rig': self._rig.to_yaml()}

    def _on_simulated_nodes(self, experiment: 'Experiment', bag: Path, seed: int,
                            progress: Progress) -> None:
        from pam_actuation.rigging.session import run_experiment
        result = run_experiment(
            experiment, self._rig, controller_for(experiment, self._rig), self.valve, bag,
            seed=seed, domain_id=self._domain_id,
            progress=lambda done, whole: progress(done / whole))
        if result.stopped:
            raise KeyboardInterrupt
        if result.failure or not result.bag:
            raise RecordingFailed(result.failure or 'nothing was recorded')
        if not result.complete:
            lost = result.missing
            raise RecordingFailed(f'{lost} messages were not recorded')

    def _on_hardware(self, experiment: 'Experiment', bag: Path, progress: Progress) -> None:
        """Bring the nodes of a real rig up, wait for the end of the experiment, vent."""
        from pam_actuation.interrupts import undisturbed
        from pam_actuation.rigging.supervisor import Supervisor
        from pam_actuation.rigging.transitions import SessionFailed, termination_as_interrupt
        with tempfile.TemporaryDirectory(prefix='pam_investigate_') as folder:
            model = write_text(Path(folder) / 'model.yaml', self._rig.to_yaml())
            played = write_text(Path(folder) / 'experiment.yaml', experiment.to_yaml())
            nodes = layouts.rig(
                rig=str(model), valve=self.valve, hardware=self._hardware, experiment=str(played),
                record=str(bag.absolute()))
            failure = ''
            with termination_as_interrupt(), Supervisor(nodes, self._domain_id) as supervisor:
                try:
                    supervisor.start()
                    failure = _watched(supervisor, experiment.duration_s, progress)
                except SessionFailed as error:
                    failure = str(error)
                finally:
                    with undisturbed():
                        problems = supervisor.finish(failure)
        if failure or problems:
            raise RecordingFailed('; '.join(filter(None, [failure, *problems])))


def _watched(supervisor: 'Supervisor', length_s: float, progress: Progress) -> str:
    """Return when the reference is at its end or the driver vents; why it failed, '' if not."""
    reference, driver = f'{MUSCLE}/reference_generator', f'{MUSCLE}/valve_driver'
    began = time.monotonic()

    def vented() -> str:
        level, message = supervisor.status(driver)
        return f'{driver}: {message}' if level >= LEVEL_ERROR else ''

    def over() -> bool:
        progress(min((time.monotonic() - began) / length_s, 1.0))
        said = supervisor.status(reference)[1]
        return said.startswith(FINISHED) or bool(vented()) and said.startswith(PLAYING)

    supervisor.watch(length_s + OVERDUE_S, until=over)
    if supervisor.status(reference)[1].startswith(FINISHED):
        return ''
    return vented() or f'the reference did not finish within {length_s + OVERDUE_S:.0f} s'
