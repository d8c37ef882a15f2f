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
Whole rigs as lists of nodes: one muscle, a joint, both knees of an exoskeleton.

What the launch files of the same names describe, for those who start nodes without
``ros2 launch``.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any
import zlib

from pam_actuation.hardware.files import hardware_file
from pam_actuation.namespaces import JOINT, MUSCLE, name_in, namespace_of
from pam_actuation.resources import find_config
from pam_actuation.rigging.node_spec import NodeSpec
from pam_sim.joint.parameters import SIDES
from pam_sim.located_yaml import load_yaml

NO_CONTROLLER = 'none'      # one of the user's own sends the pressure commands
NO_EXPERIMENT = 'none'      # references come from elsewhere
SIMULATED = 'sim'           # no hardware
TOPICS = 'topics'           # sensors and valves are a program of the user's own
BY_SIGNAL = (SIMULATED, TOPICS)     # what follows valve_signal, on which a watchdog can vent
BY_SENSORS, BY_TOPIC = 'sensors', 'topic'       # who publishes the angle of a real joint
AWAITED_S = 150.0           # for the first measurement: others may compile for two minutes
KNEES = ('left_knee', 'right_knee')
_SEEDS = 1_000_000


def seed_in(namespace: str) -> int:
    """Return the seed of the simulated sensors in a namespace, 0 in that of the defaults."""
    if namespace in ('', MUSCLE, JOINT):
        return 0
    return 2 * (zlib.crc32(namespace.encode()) % _SEEDS)        # a joint takes two


def experiment_of(named: str, hardware: str, of_simulation: str) -> str:
    """
    Return the experiment that a launch file plays, '' for none.

    Where none is named, a simulated rig plays one of its own. Hardware waits for references:
    nothing moves there that was not asked for.

    Parameters
    ----------
    named : str
        Name or file; 'none': none, '': nothing was said.
    hardware : str
        As of ``rig``.
    of_simulation : str
        What a simulated rig plays.

    """
    named = named or (of_simulation if hardware == SIMULATED else NO_EXPERIMENT)
    return '' if named == NO_EXPERIMENT else named


def experiment_of_joint(named: str, hardware: str, joint: str) -> str:
    """
    Return the experiment that the launch file of a joint plays, '' for none.

    A simulated joint, a preset or a file, plays a sine for joints of its size.
    """
    from pam_actuation.control.modes.files import joint_size
    from pam_sim.joint import load_joint
    return experiment_of(named, hardware, f'{joint_size(load_joint(joint))}_sine')


def rig(namespace: str = '/muscle', rig: str = 'dmsp_5_300_realistic', valve: str = 'ppr',
        hardware: str = 'sim', controller: str = '', experiment: str = '', record: str = '',
        accept_other_rig: bool = False, overwrite: bool = False, name: str = '',
        seed: int | None = None) -> list[NodeSpec]:
    """
    Return the nodes of one muscle.

    Parameters
    ----------
    namespace : str
        Of all nodes.
    rig : str
        Rig preset, or path of a model file.
    valve : {'ppr', 'hsv'}
        Kind of valve.
    hardware : str
        ``sim``, ``topics``, another name in config/hardware, or a parameter file. With
        ``topics`` a program of your own publishes what is measured and follows
        ``valve_signal``.
    controller : str
        Controller preset or file; '' for the preset of valve and experiment, 'none' for no
        node: one of your own commands the pressure.
    experiment : str
        Name or file; '': none, references come from elsewhere. One in pressure or in raw
        valve signals speaks to the driver itself: there is no controller then.
    record : str
        Folder of the bag; '': no recorder.
    accept_other_rig : bool
        Take a controller file that was made for another rig.
    overwrite : bool
        Let the recorder replace the bag that is there.
    name : str
        Of the muscle, in its messages; '': the one of the nodes.
    seed : int, optional
        Of the simulated sensors; default: by the namespace.

    Raises
    ------
    InputError
        In the experiment, or where the rig cannot do it.

    """
    namespace = namespace_of(namespace)
    kind = {'valve_type': valve, **({'muscle': name} if name else {})}
    described = {**kind, 'rig': rig}
    seed = seed_in(namespace) if seed is None else seed
    law, raw = played(experiment, rig, valve, controller)
    driver = {**described, 'controller': law, **({'accept_valve_command': True} if raw else {})}
    accept = {'accept_other_rig': True} if accept_other_rig else {}
    nodes = [NodeSpec(controller_node(law), namespace, {
        **described, **accept, 'controller': law})] if law else []
    if hardware in BY_SIGNAL:
        if hardware == SIMULATED:
            nodes.append(NodeSpec('plant_simulator', namespace, {**described, 'seed': seed}))
        nodes += [NodeSpec('valve_watchdog', namespace, kind),
                  NodeSpec('valve_driver', namespace, driver)]
    else:
        file = hardware_file(hardware)
        nodes += [NodeSpec('hardware_sensors', namespace, {}, file),
                  NodeSpec('valve_driver', namespace, driver, file)]
    nodes += _reference(namespace, experiment, kind)
    if not record:
        return nodes
    return _recorded(nodes, namespace, {
        **described, **({'seed': seed} if hardware == SIMULATED else {}),
        'output': record, 'experiment': experiment, 'controller': law}, overwrite)


def controller_node(controller: str) -> str:
    """Return the node that runs a controller, given by preset or file."""
    return node_of_law(load_yaml(find_config('controllers', controller)).get('controller', str))


def node_of_law(kind: str | None) -> str:
    """Return the node that runs a control law: that of fixed gains runs all without rules."""
    return 'sofc_controller' if kind == 'sofc' else 'pid_controller'


def _recorded(nodes: list[NodeSpec], namespace: str, parameters: Mapping[str, Any],
              overwrite: bool) -> list[NodeSpec]:
    """Return nodes that wait for a recorder, and the recorder."""
    recorder = f'{namespace}/experiment_recorder'
    waiting = [replace(node, parameters={**node.parameters, 'await_subscriber': recorder})
               for node in nodes]
    return [*waiting, NodeSpec('experiment_recorder', namespace, {
        **parameters, **({'overwrite': True} if overwrite else {})})]


def played(experiment: str, rig: str, valve: str, controller: str = '',
           presets: Mapping[str, str] | None = None) -> tuple[str, bool]:
    """
    Return what an experiment needs: name of the controller, '' for none; raw valve signals.

    Parameters
    ----------
    experiment : str
        Name or file; '' for none: the controller follows references from elsewhere.
    rig, valve : str
        Model by name or file, and kind of valve.
    controller : str
        Preset or file; '' for the preset, 'none' for none.
    presets : dict, optional
        Preset by valve; default: that of the self-organizing controller.

    Raises
    ------
    InputError
        In the experiment, or where the rig cannot do it.

    """
    from pam_actuation.control.modes.files import preset_for, preset_without_experiment
    from pam_actuation.experiments import load_experiment
    from pam_sim import load_rig
    name = controller or (presets or {}).get(valve)
    if not experiment:
        if name == NO_CONTROLLER:
            return '', False
        return name or preset_without_experiment(load_rig(rig, valve=valve)), False
    wanted, model = load_experiment(experiment), load_rig(rig, valve=valve)
    wanted.check_reachable(model)
    if not wanted.tracked or name == NO_CONTROLLER:
        name = ''
    elif not name:
        name = preset_for(wanted, model)
    return name, wanted.sends_valve_command(valve)


def knee(namespace: str = '/knee', joint: str = 'joint_dmsp_5_300_realistic', valve: str = 'ppr',
         controller: str = '', experiment: str = '', seed: int | None = None,
         accept_other_rig: bool = False, record: str = '', hardware: str = SIMULATED,
         angle: str = BY_SENSORS, overwrite: bool = False, name: str = '') -> list[NodeSpec]:
    """
    Return the nodes of one joint.

    ``name`` is that in its messages and its URDF; '': by the namespace, as is the ``seed`` of
    the simulated sensors where none is given.

    ``controller`` is a preset or file, '' for the preset of valve and joint, 'none' for no node.
    ``record`` is the folder of the bag; '': no recorder. With ``overwrite`` it replaces the bag
    that is there. ``hardware`` is ``sim``, ``topics``, another name in config/hardware, or a
    parameter file, as of ``rig``.
    ``angle`` tells of hardware whether the angle is read by ``hardware_sensors`` ('sensors') or
    published by a program of your own ('topic').

    Raises
    ------
    InputError
        In the experiment, or where the joint cannot do it.

    """
    _check_joint(experiment, joint, valve)
    namespace = namespace_of(namespace)
    seed = seed_in(namespace) if seed is None else seed
    common = {'valve_type': valve, 'muscle': name or name_in(namespace)}
    of_joint = {**common, 'joint': joint}
    by_signal = hardware in BY_SIGNAL
    file = '' if by_signal else hardware_file(hardware)
    named = {'muscle': common['muscle']}
    nodes = []
    if hardware == SIMULATED:
        nodes.append(NodeSpec('joint_simulator', namespace, {**of_joint, 'seed': seed}))
    elif angle == BY_SENSORS and not by_signal:
        nodes.append(NodeSpec('hardware_sensors', namespace, {**named, 'place': 'joint'}, file))
    if controller != NO_CONTROLLER:
        nodes.append(NodeSpec('joint_controller', namespace, {
            **of_joint, **({'accept_other_rig': True} if accept_other_rig else {}),
            'controller': controller}))
    asking = {'controller': '' if controller == NO_CONTROLLER else controller}
    for side in SIDES:
        below = f'{namespace}/{side}'
        nodes += [NodeSpec('valve_driver', below,
                           {**common, **asking, 'rig': f'{joint}/{side}'}, file),
                  NodeSpec('valve_watchdog', below, common) if by_signal
                  else NodeSpec('hardware_sensors', below, named, file)]
    nodes += _reference(namespace, experiment, common)
    if not record:
        return nodes
    if not controller:
        from pam_actuation.control.modes.files import joint_preset_for
        from pam_sim.joint import load_joint
        controller = joint_preset_for(load_joint(joint, valve=valve), valve)
    return _recorded(nodes, namespace, {
        **common, **({'seed': seed} if hardware == SIMULATED else {}),
        'rig': joint, 'output': record, 'experiment': experiment,
        'controller': '' if controller == NO_CONTROLLER else controller}, overwrite)


def _check_joint(experiment: str, joint: str, valve: str) -> None:
    """Raise InputError where a joint cannot do a named experiment, before any node starts."""
    if experiment:
        from pam_actuation.experiments import load_experiment
        from pam_sim.joint import load_joint
        load_experiment(experiment).check_reachable(load_joint(joint, valve=valve))


def exo(namespace: str = '', record: str = '', seed: int | None = None,
        **options: Any) -> list[NodeSpec]:
    """
    Return the nodes of two knees below a namespace, ``left_knee`` and ``right_knee``.

    ``record`` is a folder that gets a bag of each; '': no recorder. ``seed`` is that of the left
    knee, 0 by default; the right one has it and two.
    """
    return [node for k, name in enumerate(KNEES)
            for node in knee(f'{namespace_of(namespace)}/{name}', seed=(seed or 0) + 2 * k,
                             record=record and f'{record}/{name}', **options)]


def _reference(namespace: str, experiment: str,
               parameters: Mapping[str, Any]) -> list[NodeSpec]:
    if not experiment:
        return []
    return [NodeSpec('reference_generator', namespace, {
        **parameters, 'experiment': experiment, 'await_receiver': True,
        'await_measurement_s': AWAITED_S})]
