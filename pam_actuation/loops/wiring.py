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
How the loops of the live nodes hang on a bus: what a tick sends, and who takes it.

A loop says with ``takes()`` which topics it takes. ``prefix`` is the namespace of a muscle within
a rig of several, such as ``flexor/``.
"""


def attach(bus, loop, prefix=''):
    """Have a loop take its topics."""
    for topic, take in loop.takes().items():
        bus.connect(f'{prefix}{topic}', take)


def attach_plant(bus, plant):
    """
    Have a ``PlantLoop`` or ``JointPlantLoop`` take its topics; return its tick, which measures.

    A message acts from its stamp on, where physics has not passed that yet.
    """
    def from_its_stamp(apply):
        def take(message):
            plant.advance_to(message.stamp_ns)
            apply(message)
        return take

    for topic, apply in plant.takes().items():
        bus.connect(topic, from_its_stamp(apply))

    def tick(now_ns):
        plant.advance_to(now_ns)
        for topic, message in plant.sample(now_ns).items():
            bus.send(topic, message, now_ns)

    return tick


def reference_tick(bus, reference):
    """Return the tick of a ``ReferenceLoop``."""
    def tick(now_ns):
        for topic, message in reference.tick(now_ns).items():
            bus.send(topic, message, now_ns)

    return tick


def controller_tick(bus, control, learning=True):
    """Return the tick of a ``ControllerLoop``."""
    def tick(now_ns):
        command, state = control.tick(now_ns, learning)
        bus.send('pressure_command', command, now_ns)
        bus.send('controller_state', state, now_ns)

    return tick


def driver_tick(bus, driver, prefix='', told=None):
    """Return the tick of a ``DriverLoop``; ``told(now_ns, status)`` hears its status."""
    def tick(now_ns):
        signal, status = driver.tick(now_ns)
        bus.send(f'{prefix}valve_signal', signal, now_ns)
        followed = driver.followed()
        if followed is not None:
            bus.send(f'{prefix}followed_pressure', followed, now_ns)
        if told is not None:
            told(now_ns, status)

    return tick
