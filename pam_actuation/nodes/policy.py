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
The access policy of some nodes, for the security tools of ROS 2 (SROS2, policy 0.2.0).

Least rights: each node may publish, subscribe and serve what it does with exactly its
parameters, and nothing else. One enclave per node, named after it; one more for an operator,
who reads the diagnostics and calls the services the nodes offer, the emergency stop first of all.
Another one is for the live page (``pam view``): it reads what it draws, sets markers, and may
stop and reset.
"""

from collections.abc import Iterable
import xml.etree.ElementTree as ElementTree

from pam_actuation.namespaces import outermost
from pam_actuation.nodes.interfaces import Inspector, OF_EVERY_NODE
from pam_actuation.rigging.client import NAME
from pam_actuation.rigging.node_spec import NodeSpec
from pam_actuation.topics.table import DIAGNOSTICS, MARKER, short_name
from pam_actuation.view.plots import KEPT
from pam_actuation.view.requests import ACTIONS

PARAMETER_SERVICES = (
    'describe_parameters', 'get_parameter_types', 'get_parameters', 'list_parameters',
    'set_parameters', 'set_parameters_atomically', 'get_type_description')
LIFECYCLE_SERVICES = (
    'change_state', 'get_state', 'get_available_states', 'get_available_transitions',
    'get_transition_graph')
OPERATOR, PAGE = 'operator', 'pam_view'
SENT_BY_EVERY_NODE = (*OF_EVERY_NODE, '~/transition_event')


def policy(nodes: Iterable[NodeSpec]) -> str:
    """
    Return the text of the policy of a list of NodeSpec.

    Raises
    ------
    InputError
        A node cannot be configured with its parameters.

    """
    root = ElementTree.Element('policy', version='0.2.0')
    root.append(ElementTree.Comment(
        ' Made from the code, as docs/guides/security.md says; do not edit. '))
    enclaves = ElementTree.SubElement(root, 'enclaves')
    offered: list[str] = []
    drawn: dict[str, None] = {}
    nodes = list(nodes)
    with Inspector() as inspector:
        for node in nodes:
            # What only matters once it runs is left out: it may not exist here.
            given = {key: value for key, value in node.parameters.items()
                     if key not in ('output', 'await_subscriber')}
            interface = inspector.interface(node.name, given, node.namespace)
            profile = _profile(enclaves, node.namespace, node.name)
            offered += [service.replace('~', f'{node.namespace}/{node.name}')
                        for service in interface.serves]
            drawn |= dict.fromkeys(
                name if name.startswith('/') else f'{node.namespace}/{name}'
                for name in interface.publishes if short_name(name) in KEPT)
            _allow(profile, 'topic', 'publish', (*interface.publishes, *SENT_BY_EVERY_NODE))
            _allow(profile, 'topic', 'subscribe', (
                *interface.subscribes, '/clock', '/parameter_events'))
            _allow(profile, 'service', 'reply', (
                *interface.serves, *(f'~/{one}' for one in PARAMETER_SERVICES),
                *(f'~/{one}' for one in LIFECYCLE_SERVICES)))
    session = _profile(enclaves, '/', NAME)
    _allow(session, 'topic', 'subscribe', (DIAGNOSTICS,))
    _allow(session, 'service', 'request', [
        f'{node.namespace}/{node.name}/change_state' for node in nodes])
    operator = _profile(enclaves, '/', OPERATOR)
    _allow(operator, 'topic', 'subscribe', (DIAGNOSTICS,))
    _allow(operator, 'service', 'request', offered)
    page = _profile(enclaves, '/', PAGE)
    marked = [f'{place}/{MARKER}'
              for place in outermost(sorted({node.namespace for node in nodes}))]
    _allow(page, 'topic', 'publish', marked)
    _allow(page, 'topic', 'subscribe', (DIAGNOSTICS, *drawn, *marked))
    _allow(page, 'service', 'request', [
        one for one in offered if short_name(one) in ACTIONS])
    ElementTree.indent(root)
    return ('<?xml version="1.0" encoding="UTF-8"?>\n'
            + ElementTree.tostring(root, encoding='unicode') + '\n')


def _profile(enclaves: ElementTree.Element, namespace: str, name: str) -> ElementTree.Element:
    """Add an enclave with one node; return the node's profile."""
    enclave = ElementTree.SubElement(
        enclaves, 'enclave', path=f'{namespace.rstrip("/")}/{name}')
    profiles = ElementTree.SubElement(enclave, 'profiles')
    return ElementTree.SubElement(profiles, 'profile', ns=namespace, node=name)


def _allow(profile: ElementTree.Element, kind: str, right: str, names: Iterable[str]) -> None:
    """Allow a right to topics or services, ``kind`` is the word for one of them."""
    allowed = ElementTree.SubElement(profile, f'{kind}s', {right: 'ALLOW'})
    for name in names:
        ElementTree.SubElement(allowed, kind).text = name
