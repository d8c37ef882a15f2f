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
What a node offers, found by configuring it: parameters, topics, services.

The pages of the nodes and the access policy are made from this, so that they say what the
code does. Nothing is activated and nothing sent.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
import importlib
import inspect
from typing import Any, Self

from pam_actuation.nodes.managed import ManagedNode
from pam_actuation.nodes.ros_messages import type_of
from pam_actuation.rigging.client import local_context
from pam_actuation.rigging.domain import DomainLock
from pam_actuation.topics.table import DIAGNOSTICS, topic_of
from pam_sim.parameters import Parameter
import rclpy
from rclpy import parameter as ros

NAMESPACE = '/ns'       # any: what lies below it is relative
KINDS = ('publishes', 'subscribes', 'serves')
OF_EVERY_NODE = (DIAGNOSTICS, '/parameter_events', '/rosout')
# Node to the sets of parameters that, beside the defaults, bring other topics or services.
VARIANTS: dict[str, tuple[dict[str, Any], ...]] = {
    'plant_simulator': ({'valve_type': 'hsv'}, {'use_sim_time': True}),
    'hardware_sensors': ({'place': 'joint'},),
    'valve_driver': (
        {'accept_valve_command': True},
        {'valve_type': 'hsv', 'hsv.correct_by_contraction': 0.8}),
    'valve_watchdog': (),
    'sofc_controller': (), 'pid_controller': ({'controller': 'ilc_ppr'},),
    'reference_generator': (
        {'experiment': 'disturbance'}, {'experiment': 'pressure_identification'},
        {'experiment': 'voltage_steps'}, {'experiment': 'joint_sine'},
        {'await_measurement_s': 1.0},
        *({'await_measurement_s': 1.0, 'experiment': experiment} for experiment in (
            'pressure_identification', 'joint_sine'))),
    'experiment_recorder': ({'rig': 'joint_dmsp_5_300'},),
    'joint_simulator': ({'valve_type': 'hsv'},),
    'joint_controller': (), 'joint_trajectory_server': ()}
NEEDED: dict[str, dict[str, Any]] = {'hardware_sensors': {'backend': 'dummy'}}
# Node to the topics it sends only where a device is wired to it, each with the parameter.
WIRED = {'hardware_sensors': {'supply_pressure': 'supply_pressure.channel:=1'}}


@dataclass(frozen=True)
class NodeInterface:
    """
    What one node offers.

    ``publishes``, ``subscribes`` and ``serves`` map a name, relative to the node's namespace or
    with ``~/`` to the node, to its type. Those of every node are left out. ``settings`` are
    those that its controller files know, ``live`` the names of the parameters that may change
    while it runs.
    """

    name: str
    description: str
    parameters: tuple[Parameter, ...]
    publishes: dict[str, str]
    subscribes: dict[str, str]
    serves: dict[str, str]
    settings: tuple[Parameter, ...] = ()
    live: tuple[str, ...] = ()


def node_class(name: str) -> type[ManagedNode]:
    """Return the class of a node by the name of its executable."""
    module = importlib.import_module(f'pam_actuation.nodes.{name}')
    return next(one for one in vars(module).values()
                if inspect.isclass(one) and issubclass(one, ManagedNode) and one.NAME == name)


class Inspector:
    """A context manager: nodes are made and configured in a ROS domain of its own."""

    def __enter__(self) -> Self:
        """Open the domain."""
        self._lock = DomainLock()
        self._context = local_context(self._lock.domain_id)
        return self

    def __exit__(self, *_: object) -> None:
        """Leave the domain."""
        rclpy.try_shutdown(context=self._context)
        self._lock.release()

    def interface(self, name: str, parameters: Mapping[str, Any] | None = None,
                  namespace: str = NAMESPACE) -> NodeInterface:
        """
        Return the NodeInterface of a node with some parameters.

        Raises
        ------
        InputError
            It could not be configured.

        """
        kind = node_class(name)
        node = kind(
            context=self._context, namespace=namespace, enable_rosout=False,
            parameter_overrides=[ros.Parameter(key, value=value) for key, value in {
                **NEEDED.get(name, {}), **(parameters or {})}.items()])
        try:
            node.trigger_configure()
            if node.input_error is not None:
                raise node.input_error
            return NodeInterface(
                name, inspect.getdoc(kind) or '', kind.PARAMETERS,
                _by_name(namespace, ((one.topic_name, one.msg_type) for one in node.publishers)),
                _by_name(namespace, (
                    (one.topic_name, one.msg_type) for one in node.subscriptions)),
                _by_name(namespace, ((one.srv_name, one.srv_type) for one in node.services
                                     if one.srv_name.startswith('~/'))),
                kind.controller_settings(), kind.LIVE)
        finally:
            node.destroy_node()

    def whole_interface(self, name: str) -> tuple[NodeInterface, dict[str, str]]:
        """
        Return (NodeInterface, notes): everything a node can offer.

        ``notes`` maps the names that come with certain parameters only to these, as
        ``experiment:=voltage_steps``.
        """
        base = self.interface(name)
        notes: dict[str, str] = {}
        whole: dict[str, Any] = {kind: dict(getattr(base, kind)) for kind in KINDS}
        for parameters in VARIANTS[name]:
            variant = self.interface(name, parameters)
            words = ' '.join(f'{key}:={str(value).lower()}' for key, value in parameters.items())
            for kind, known in whole.items():
                for key, type_name in getattr(variant, kind).items():
                    if key not in known:
                        known[key], notes[key] = type_name, words
        for topic, words in WIRED.get(name, {}).items():
            whole['publishes'][topic], notes[topic] = topic_of(topic).type_name, words
        return replace(base, **whole), notes


def _by_name(namespace: str, items: Iterable[tuple[str, Any]]) -> dict[str, str]:
    """Return name, as relative as can be, to type name; what every node has is left out."""
    found = {}
    for name, kind in items:
        if name not in OF_EVERY_NODE:
            found[name.removeprefix(f'{namespace}/')] = type_of(kind)
    return found
