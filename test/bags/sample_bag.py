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

"""Bags that the tests of this folder read: made here, small, deterministic."""

import math

from pam_actuation import messages
from pam_actuation.bags.writer import BagWriter
from pam_actuation.topics.codec import encode
from pam_actuation.topics.contents import Numbers
from pam_actuation.topics.table import RECORDED

START_NS = 1_790_000_000_123_456_789
STEP_NS = 5_000_000
METADATA = {
    'experiment_name': 'sine', 'valve': 'ppr', 'seed': '7', 'software_version': '0.1.0',
    'experiment': 'name: sine\nphases:\n- hold: {at_m: 0.01}\n', 'units': 'SI'}


def example_messages(i=0, valve='ppr'):
    """Return short name to one plain message of every topic, number ``i`` of a run."""
    return {**{name: plain_numbers(topic, i) for name, topic in RECORDED.items()
               if isinstance(topic.content, Numbers)}, **messages_of_a_rig(i, valve)}


def plain_numbers(topic, i=0):
    """Return a plain message, number ``i`` of a run, of a topic that carries numbers."""
    values = topic.content.values
    return topic.content.message(START_NS + i * STEP_NS, *(
        sum(topic.limits.get(value.name, (0.0, 1.0))) / 2 for value in values))


def messages_of_a_rig(i, valve):
    """Return short name to plain messages that hang together."""
    stamp_ns = START_NS + i * STEP_NS
    phase = 0.05 * i
    signal = (('ppr_voltage',), (2.0 + 0.1 * math.sin(phase),))
    if valve == 'hsv':
        signal = (('fill_duty', 'vent_duty'), (0.25, 0.5 * abs(math.sin(phase))))
    return {
        'reference': messages.Reference(stamp_ns, 0.014, 0.001 * i),
        'reference_trajectory': messages.ReferenceTrajectory(
            stamp_ns, (0, 20_000_000, 1_000_000_001), (0.014, 0.015, 0.016), (0.0, 0.1, -0.1)),
        'pressure_command': messages.Pressure(stamp_ns, 3.0e5 + i),
        'followed_pressure': messages.Pressure(stamp_ns, 2.9e5 + i),
        'valve_signal': messages.ValveSignal(stamp_ns, *signal),
        'valve_command': messages.ValveSignal(stamp_ns, *signal),
        'pressure': messages.Pressure(stamp_ns, 2.9e5 + 1e3 * math.sin(phase)),
        'supply_pressure': messages.Pressure(stamp_ns, 8.0e5),
        'contraction': messages.Contraction(stamp_ns, 0.014 + 1e-3 * math.sin(phase), 0.002),
        'force': messages.Force(stamp_ns, 49.0 + math.cos(phase)),
        'external_force': messages.Force(stamp_ns, -0.5),
        'controller_state': messages.ControllerState(
            stamp_ns, ('tick', 'error_m', 'learning'), (float(i), 1e-4, 1.0)),
        'marker': messages.Marker(stamp_ns, f'mark {i}', '/pam_view_1'),
        'diagnostics': (
            messages.Status(
                stamp_ns, 0, '/muscle/valve_driver', 'tracking',
                (('published./muscle/valve_signal', str(i + 1)), ('rate_hz', '200.0'))),),
    }


def full_name(short, namespace='/muscle'):
    """Return the full topic name."""
    return RECORDED[short].full_name(namespace)


def write_bag(directory, count=50, namespaces=('/muscle',), leave_out=(), valve='ppr',
              metadata=METADATA, change=None):
    """
    Write a bag of ``count`` messages per topic and return its directory.

    ``change(short, i, message)`` may return another message, or None to leave it out.
    """
    with BagWriter(directory, metadata) as writer:
        for namespace in namespaces:
            for short, topic in RECORDED.items():
                if short not in leave_out:
                    writer.add_topic(topic.full_name(namespace), topic.type_name)
        for i in range(count):
            for namespace in namespaces:
                for short, message in example_messages(i, valve).items():
                    if change is not None:
                        message = change(short, i, message)
                    if short in leave_out or message is None:
                        continue
                    received_ns = START_NS + i * STEP_NS + 400_000
                    writer.write(
                        full_name(short, namespace), encode(short, message), received_ns,
                        received_ns - 300_000)
    return directory
