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
The table of topics: one row each, from which nodes, recorder, loader, bag checks and docs follow.

A row gives the content of the topic, and with it ROS type, plain message, bytes and columns of
arrays. It also gives publishers, subscribers, quality of service, and the checks of a bag. A topic
may be given by its short name (``pressure``) or in full (``/left_knee/flexor/pressure``); the last
part decides.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from pam_actuation import messages
from pam_actuation.topics.contents import (
    AnyJoints, Content, JOINT_STATE, NamedNumbers, Numbers, Numeric, Statuses, Text, Trajectory,
    Value)
from pam_actuation.topics.quality import Service, USUAL
from pam_sim.errors import InputError
from pam_sim.joint.parameters import SIDES
from pam_sim.valve import VALVES

# Where a topic lies: in the namespace of a muscle, in that of a joint, in that of the rig, which
# is a joint or a muscle alone, or at the root.
MUSCLE, JOINT, RIG, ROOT = 'muscle', 'joint', 'rig', 'root'
# How much a recording of a muscle is worth without it.
NEEDED, USED, EXTRA = 'needed', 'used', 'extra'
# What a number means that is missing or not finite: a fault to be told; that the one before it
# still counts, as a valve takes it; or nothing, since what is not asked for may be missing.
TOLD, KEPT, ALLOWED = 'told', 'kept', 'allowed'
# Values beside a position, in one message, that nobody may measure.
OFTEN_EMPTY = ('velocity_m_per_s', 'torque_n_m')

RECORDER = 'experiment_recorder'
EVERY_NODE = 'every node'
ONLOOKER = 'pam_view'           # the live page
MARKER = 'marker'
DIAGNOSTICS = '/diagnostics'    # in full


@dataclass(frozen=True)
class Topic:
    """
    One topic.

    Parameters
    ----------
    name : str
        The last part of its full name.
    content : Content
        What it carries.
    meaning : str
        In a few words, for the list of topics.
    published_by, consumed_by : tuple of str
        Nodes; the recorder, which listens to all of a muscle, is left out.
    place : {'muscle', 'joint', 'rig', 'root'}
        Where it lies.
    held : bool
        Whether a value counts until the next one; others are measured points of a curve.
    need : {'needed', 'used', 'extra'}
        How much a recording is worth without it.
    steady : bool
        Whether it comes at 100 Hz or more, so that a lower rate and gaps are told.
    missing : {'told', 'kept', 'allowed'}
        What a number that is not there means.
    optional : tuple of str
        Values that any message may leave empty, however many others tell them.
    stamped : bool
        Whether the header stamp tells when a message was measured or sent. Otherwise it may be
        zero: a trajectory begins then, now for zero, or nobody reads it.
    internals : bool
        Whether its numbers are internals of a node, which may be anything.
    drawn : bool
        Whether the layouts for other programs in ``config/layouts`` show it.
    valves : tuple of str
        Types of valve with which a rig has it.
    limits : dict of str to tuple of float
        Lowest and highest plausible number of a value, SI, where ``bags/plausibility.py`` does
        not know the value.
    service : Service
        Quality of service.

    """

    name: str
    content: Content
    meaning: str
    published_by: tuple[str, ...]
    consumed_by: tuple[str, ...]
    place: str = MUSCLE
    held: bool = False
    need: str = EXTRA
    steady: bool = False
    missing: str = TOLD
    optional: tuple[str, ...] = ()
    stamped: bool = True
    internals: bool = False
    drawn: bool = False
    valves: tuple[str, ...] = VALVES
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    service: Service = USUAL

    @property
    def type_name(self) -> str:
        """Return the ROS message type, such as ``sensor_msgs/msg/JointState``."""
        return self.content.type_name

    @property
    def numeric(self) -> Numeric | None:
        """Return the content if many messages of it are arrays, else None."""
        return self.content if isinstance(self.content, Numeric) else None

    @property
    def is_measured(self) -> bool:
        """Return whether its values come from sensors."""
        return 'hardware_sensors' in self.published_by

    def full_name(self, namespace: str) -> str:
        """Return the full name in a namespace such as ``/muscle``."""
        return f'/{self.name}' if self.place == ROOT else f'{namespace}/{self.name}'


SENSORS = ('plant_simulator', 'joint_simulator', 'hardware_sensors')
PLANTS = ('plant_simulator', 'joint_simulator')
LAWS = ('sofc_controller', 'pid_controller')
CONTROLLERS = (*LAWS, 'joint_controller')
REFERENCE = ('reference_generator',)
DRIVER = ('valve_driver',)

_PRESSURE = Numbers(
    'sensor_msgs/msg/FluidPressure', messages.Pressure, (Value('pressure_pa', 'fluid_pressure'),))
_FORCE = Numbers(
    'geometry_msgs/msg/WrenchStamped', messages.Force, (Value('force_n', 'wrench.force.x'),))
_TORQUE = Numbers(
    'geometry_msgs/msg/WrenchStamped', messages.Torque,
    (Value('torque_n_m', 'wrench.torque.y'),))
_MOTION = (Value('contraction_m', 'position'), Value('velocity_m_per_s', 'velocity'))
_SIGNAL = NamedNumbers(messages.ValveSignal, 'efforts', 'effort')

# Of messages at equal times those of an earlier row act first: measured, wanted, decided, acted.
TOPICS = (
    Topic('pressure', _PRESSURE, 'measured muscle pressure', SENSORS,
          (*CONTROLLERS, *DRIVER, *REFERENCE),
          need=NEEDED, steady=True, drawn=True),
    Topic('contraction', Numbers(JOINT_STATE, messages.Contraction, _MOTION),
          'measured contraction', SENSORS, (*LAWS, *DRIVER, *REFERENCE), need=NEEDED, steady=True,
          drawn=True),
    Topic('force', _FORCE, 'measured force', SENSORS, (*CONTROLLERS, *REFERENCE), need=USED,
          steady=True, drawn=True),
    Topic('supply_pressure', _PRESSURE, 'measured supply pressure', SENSORS, DRIVER, need=USED,
          drawn=True, valves=('hsv',)),
    Topic('external_force', _FORCE, 'disturbance on the simulated load', REFERENCE,
          ('plant_simulator',), drawn=True),
    Topic('reference', Numbers(
        JOINT_STATE, messages.Reference, _MOTION, (Value('force_n', 'effort'),)),
          'wanted contraction, now', REFERENCE, LAWS, held=True, need=USED, drawn=True,
          optional=('velocity_m_per_s',)),
    Topic('reference_trajectory', Trajectory(
        messages.ReferenceTrajectory, 'contraction_m', 'velocity_m_per_s', 'force_n'),
          'wanted contraction, known ahead', REFERENCE, LAWS),
    Topic('controller_state', NamedNumbers(messages.ControllerState, 'values', 'position'),
          'every internal of a controller tick', CONTROLLERS, (), held=True, internals=True,
          drawn=True),
    Topic('pressure_command', _PRESSURE, 'wanted muscle pressure', (*CONTROLLERS, *REFERENCE),
          DRIVER, held=True, need=USED, steady=True, drawn=True),
    Topic('valve_command', _SIGNAL, 'wanted raw valve signal', REFERENCE, DRIVER, held=True,
          missing=ALLOWED),
    Topic('valve_signal', _SIGNAL, 'what goes to the valve', (*DRIVER, 'valve_watchdog'),
          (*PLANTS, *DRIVER, 'valve_watchdog', *REFERENCE), held=True, need=NEEDED, steady=True,
          missing=KEPT, drawn=True),
    Topic('followed_pressure', _PRESSURE, 'what the driver makes of the command', DRIVER,
          CONTROLLERS, held=True, drawn=True),
    Topic(MARKER, Text(), 'a short text that a person set at an instant', (ONLOOKER,), (),
          place=RIG),
    Topic('diagnostics', Statuses(), 'health of every node', (EVERY_NODE,), (), place=ROOT),
    Topic('joint_state', Numbers(JOINT_STATE, messages.JointAngle, (
        Value('angle_rad', 'position'), Value('torque_n_m', 'effort'))),
          'measured angle, and torque of both tendons',
          ('joint_simulator', 'hardware_sensors'),
          ('joint_controller', 'joint_trajectory_server', *REFERENCE), place=JOINT,
          steady=True),
    Topic('external_torque', _TORQUE, 'disturbance on the simulated limb', (),
          ('joint_simulator',), place=JOINT),
    Topic('joint_reference', Numbers(JOINT_STATE, messages.AngleReference, (
        Value('angle_rad', 'position'), Value('rate_rad_per_s', 'velocity'))),
          'wanted angle, now', REFERENCE, ('joint_controller',), place=JOINT, held=True,
          optional=('rate_rad_per_s',)),
    Topic('joint_trajectory', AnyJoints(messages.AngleTrajectory, 'angle_rad', 'rate_rad_per_s'),
          'wanted angle, known ahead', (*REFERENCE, 'joint_trajectory_server'),
          ('joint_controller',), place=JOINT, stamped=False),
    Topic('joint_effort', NamedNumbers(messages.NamedEfforts, 'efforts', 'effort'),
          'wanted torque of both tendons', (), ('joint_controller',), place=JOINT, held=True),
    Topic('co_contraction', _PRESSURE, 'wanted mean pressure of both muscles', (),
          ('joint_controller',), place=JOINT, held=True, stamped=False),
)

BY_NAME = {topic.name: topic for topic in TOPICS}
# What a recording of a muscle holds.
RECORDED = {topic.name: topic for topic in TOPICS if topic.place != JOINT}
# What a loaded run can hold.
OF_A_RUN = {name: topic for name, topic in RECORDED.items() if topic.place == MUSCLE}
# What a recording of a joint holds, by name relative to the joint: its own topics, those of its
# controller, and what the nodes of a joint send in the namespace of each muscle.
_BELOW = tuple(name for name, topic in OF_A_RUN.items() if name != 'controller_state' and (
    {'joint_simulator', 'joint_controller', *DRIVER} & {*topic.published_by}))
RECORDED_OF_JOINT = {
    **{topic.name: topic for topic in TOPICS if topic.place == JOINT},
    **{name: BY_NAME[name] for name in ('controller_state', 'diagnostics', MARKER)},
    **{f'{side}/{name}': BY_NAME[name] for side in SIDES for name in _BELOW}}


def short_name(full_name: str) -> str:
    """Return the last part of the name of a topic, whatever topic it is."""
    return full_name.rsplit('/', 1)[-1]


def topic_of(name: str) -> Topic:
    """Return the row of a topic by short or full name; InputError if it is none of a rig."""
    topic = BY_NAME.get(short_name(name))
    if topic is None:
        raise InputError(
            f'no topic of a rig; known are {", ".join(BY_NAME)}', name)
    return topic
