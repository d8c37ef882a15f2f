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

"""What a session starts: experiment, rig and controller as files the nodes can read."""

from dataclasses import dataclass
import json
import os
from pathlib import Path
import shutil
import tempfile
from typing import Any, TYPE_CHECKING

from pam_actuation.bags.metadata import experiment_metadata
from pam_actuation.bags.place import check_bag_target
from pam_actuation.namespaces import name_in, namespace_of, node_name_of
from pam_actuation.rigging.layouts import node_of_law
from pam_actuation.topics.table import RECORDED_OF_JOINT
from pam_sim.errors import InputError
from pam_sim.files import StrPath
from pam_sim.joint.rig import JointRig

if TYPE_CHECKING:
    from pam_actuation.control.config import Controller
    from pam_actuation.experiments.experiment import Experiment
    from pam_sim.rig import Rig

Parameters = dict[str, Any]      # of a node: name to value

RECORDER, PLANT, DRIVER, WATCHDOG, REFERENCE = (
    'experiment_recorder', 'plant_simulator', 'valve_driver', 'valve_watchdog',
    'reference_generator')
JOINT_PLANT, JOINT_CONTROLLER = 'joint_simulator', 'joint_controller'
REALTIME_PRIORITY = 1        # the lowest; where it is not allowed the nodes run without


@dataclass
class RigPlan:
    """
    The nodes of one session, each by its place below the namespace of the rig.

    ``parameters`` maps the place of a node, such as ``valve_driver`` or ``flexor/valve_driver``,
    to ROS parameters, in the order in which the nodes become active. ``controller_node`` is ''
    for an experiment without controller. A muscle has one of the ``drivers``, a joint two.
    Beside each driver a watchdog, a process of its own, vents when that driver falls silent.
    """

    experiment: 'Experiment'
    rig: 'Rig | JointRig'
    controller: 'Controller | None'
    controller_node: str
    parameters: dict[str, Parameters]
    folder: Path
    plant_node: str = PLANT
    drivers: tuple[str, ...] = (DRIVER,)

    @property
    def watchdogs(self) -> tuple[str, ...]:
        """Return the places of the watchdogs, in the order of the drivers."""
        return tuple(f'{place.removesuffix(DRIVER)}{WATCHDOG}' for place in self.drivers)

    @property
    def rig_file(self) -> Path:
        """Return the file in which the nodes read their rig."""
        return self.folder / 'rig.yaml'

    @property
    def controller_file(self) -> Path:
        """Return the file in which the nodes read their controller; there if there is one."""
        return self.folder / 'controller.yaml'

    def remove(self) -> None:
        """Delete the files made for the nodes."""
        shutil.rmtree(self.folder, ignore_errors=True)


def make_plan(experiment: 'StrPath | Experiment', rig: 'StrPath | Rig | JointRig',
              controller: 'StrPath | Controller | None' = None, valve: str | None = None,
              bag: StrPath | None = None, *, learning: bool = True, seed: int = 0,
              namespace: str = '/muscle', overwrite: bool = False, realtime: bool = True
              ) -> RigPlan:
    """
    Load experiment, rig and controller and write them down for the nodes.

    Loading here tells of the user's mistakes before anything is started.

    Parameters
    ----------
    experiment, rig, controller : str, path or object
        Name, path, or what ``load_experiment``, ``load_rig_or_joint``, ``load_controller``
        return. Without controller: the preset of the valve for what the experiment asks for.
    valve : str, optional
        'ppr' or 'hsv'; default: that of the rig.
    bag : path, optional
        Folder to record to; None: no recorder.
    learning : bool
        Whether the rules of the controller may change.
    seed : int
        Seed of the simulated sensors.
    namespace : str
        Namespace of the rig.
    overwrite : bool
        Replace an existing bag.
    realtime : bool
        Ask for real-time scheduling of the nodes.

    Raises
    ------
    InputError
        In any of the three, or the bag exists already.

    """
    from pam_actuation.control.config import load_controller
    from pam_actuation.control.modes.files import preset_for
    from pam_actuation.experiments import load_experiment
    from pam_actuation.experiments.limits import check_tracked
    from pam_sim.joint import load_rig_or_joint
    asked: Experiment = load_experiment(os.fspath(experiment)) if isinstance(
        experiment, (str, os.PathLike)) else experiment
    model = load_rig_or_joint(rig, valve) if isinstance(rig, (str, os.PathLike)) else rig
    if valve and valve != model.valve:
        model = model.with_(valve=valve)
    asked.check_reachable(model)
    law: Controller | None = None
    if asked.asks_for_motion:
        if controller is None or isinstance(controller, (str, os.PathLike)):
            law = load_controller(controller or preset_for(asked, model), model)
        else:
            law = controller
    check_tracked(asked, law)
    if bag is not None:
        if os.path.exists(bag) and not overwrite:
            raise InputError(
                'exists already; choose another folder or allow to replace it', str(bag))
        check_bag_target(bag, overwrite)
    folder = Path(tempfile.mkdtemp(prefix='pam_session_'))
    plan = RigPlan(asked, model, law, '', {}, folder)
    if isinstance(model, JointRig):
        plan.plant_node, plan.controller_node = JOINT_PLANT, JOINT_CONTROLLER
        plan.drivers = tuple(f'{place}{DRIVER}' for place in model.muscles)
    elif law is not None:
        plan.controller_node = node_of_law(law.kind)
    plan.parameters = _parameters(plan, bag, learning, seed, namespace, overwrite)
    if realtime:
        for parameters in plan.parameters.values():
            parameters['realtime_priority'] = REALTIME_PRIORITY
    return plan


def _parameters(plan: RigPlan, bag: StrPath | None, learning: bool, seed: int, namespace: str,
                overwrite: bool) -> dict[str, Parameters]:
    """Return the place of each node to its parameters and write the files they name."""
    from pam_actuation.drivers.recorded import driver_facts
    rig, controller = plan.rig, plan.controller
    rig_file = _write(plan.rig_file, rig.to_yaml())
    law_text = '' if controller is None else controller.to_yaml()
    nodes: dict[str, Parameters] = {}
    if bag is not None:
        metadata = experiment_metadata(
            plan.experiment, rig, law_text or None, rig.valve, seed, origin='live',
            learning=str(bool(learning)).lower(),
            controller_other_rig='' if controller is None else controller.other_rig,
            remarks='\n'.join(plan.experiment.remarks(rig.valve, rig, controller)),
            **driver_facts())
        nodes[RECORDER] = {
            'output': os.path.abspath(bag), 'overwrite': overwrite,
            'await_topics': _awaited(plan), 'notes_folder': str(plan.folder),
            'metadata_file': _write(plan.folder / 'metadata.json', json.dumps(metadata))}
        if isinstance(rig, JointRig):
            nodes[RECORDER]['topics'] = list(RECORDED_OF_JOINT)
    model = {'joint' if isinstance(rig, JointRig) else 'rig': rig_file}
    nodes[plan.plant_node] = {**model, 'valve_type': rig.valve, 'seed': seed}
    # Before the drivers: a watchdog takes the first sender it hears for its driver.
    nodes.update({watchdog: {'valve_type': rig.valve} for watchdog in plan.watchdogs})
    for driver, muscle in zip(plan.drivers, rig.muscles.values()):
        file = rig_file if muscle is rig else _write(
            plan.folder / f'{driver.replace("/", "_")}.yaml', muscle.to_yaml())
        nodes[driver] = {
            'valve_type': muscle.valve, 'rig': file,
            'accept_valve_command': plan.experiment.sends_valve_command(rig.valve)}
        if controller is not None and controller.driver:
            nodes[driver]['controller'] = str(plan.controller_file)
    if controller is not None:
        nodes[plan.controller_node] = {
            **model, 'valve_type': rig.valve,
            'accept_other_rig': bool(controller.other_rig),
            'controller': _write(plan.controller_file, law_text)}
        if controller.learns:
            nodes[plan.controller_node]['learning'] = learning
    nodes[REFERENCE] = {
        'valve_type': rig.valve,
        'experiment': _write(plan.folder / 'experiment.yaml', plan.experiment.to_yaml())}
    for parameters in nodes.values():
        parameters['autostart'] = False
        if isinstance(rig, JointRig):
            parameters['muscle'] = name_in(namespace_of(namespace))
        if bag is not None:
            parameters['await_subscriber'] = node_name_of(RECORDER, namespace_of(namespace))
    return nodes


def _awaited(plan: RigPlan) -> list[str]:
    """Return the topics without whose publishers the recorder does not begin."""
    from pam_actuation.experiments import ReferenceLoop
    valve = plan.rig.valve
    of_muscle = ['pressure', 'contraction', 'force', 'valve_signal']
    if valve == 'hsv':
        of_muscle.append('supply_pressure')
    if plan.controller is not None:
        of_muscle += ['pressure_command', 'followed_pressure']
    topics = [f'{place}{topic}' for place in plan.rig.muscles for topic in of_muscle]
    topics += ReferenceLoop(plan.experiment, valve=valve).topics
    if plan.controller is not None:
        topics.append('controller_state')
    if isinstance(plan.rig, JointRig):
        topics.append('joint_state')
    return topics


def _write(path: Path, text: str) -> str:
    path.write_text(text, encoding='utf-8')
    return str(path)
