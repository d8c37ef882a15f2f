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

"""The sensors of a real rig on ROS, of a muscle or of a joint, stamped when read."""

from collections.abc import Sequence
import sys
from typing import Any

from pam_actuation.drivers.parameter import node_parameter
from pam_actuation.hardware.back_ends import close_sensors
from pam_actuation.hardware.back_ends import open_sensors
from pam_actuation.hardware.back_ends import parameters_of
from pam_actuation.hardware.back_ends import SENSOR_INPUTS
from pam_actuation.hardware.sensor_input import MUSCLE, NewReadings, PLACE, TOPICS
from pam_actuation.hardware.sysfs import DeviceError
from pam_actuation.nodes.diagnostics import ERROR, Values
from pam_actuation.nodes.diagnostics import OK
from pam_actuation.nodes.diagnostics import WARN
from pam_actuation.nodes.managed import ManagedNode
from pam_actuation.nodes.runner import run
from pam_actuation.topics.table import topic_of
from pam_sim.errors import InputError

WAITED = (', and no sensor was read meanwhile: read must not wait, so read a slow device in a '
          'thread')
BEHIND = ', so all are sent less often: read a slow device in a thread, or lower publish_rate_hz'


class HardwareSensors(ManagedNode):
    """
    Publish the readings of the sensors of a real rig, in place of ``plant_simulator``.

    Of a joint, one runs in the namespace of each muscle, and one with ``place:=joint`` in that of
    the joint, which publishes its angle. If a sensor does not answer, nothing is sent. Its
    subscribers notice the silence, and the driver vents.
    """

    NAME = 'hardware_sensors'
    REALTIME_RANK = 2
    PARAMETERS = (
        node_parameter('backend', 'iio_adc', 'What the sensors hang on.',
                       choices=tuple(SENSOR_INPUTS)),
        node_parameter('place', MUSCLE, 'What is measured: pressures, contraction and force of a '
                       'muscle, or the angle of a joint.', choices=tuple(TOPICS)),
        node_parameter('publish_rate_hz', 250.0, 'Rate of the measurements [Hz].', 100.0, 1000.0),
        *parameters_of(SENSOR_INPUTS),
    )

    sensors: Any = None         # of the back end, once configured
    failures = 0
    _readings: NewReadings | None = None        # once active

    def check(self) -> None:
        """Refuse to stamp what is measured with a time that may stand still."""
        if self.uses_simulated_time and self.value('backend') != 'dummy':
            raise InputError('real sensors are not read in simulated time', 'use_sim_time')

    def setup(self) -> None:
        """Open the sensors, create the publishers of those connected."""
        self.sensors = open_sensors(self.value('backend'), {
            parameter.name: self.value(parameter.name)
            for parameter in parameters_of(SENSOR_INPUTS)} | {PLACE: self.value(PLACE)})
        for topic in self.sensors.topics:
            self.add_publisher(topic)

    def teardown(self) -> None:
        """Let go of the sensors."""
        sensors, self.sensors = self.sensors, None
        problem = sensors and close_sensors(sensors)
        if problem:
            self.get_logger().warning(f'the sensors were not closed: {problem}')

    def start(self) -> None:
        """Read at a steady rate."""
        self._readings = NewReadings(self.sensors, self.now_ns())
        self.add_loop(1.0 / self.value('publish_rate_hz'))

    def diagnostic_values(self) -> Values:
        """Add how often a sensor did not answer, was no number, jumped, or made the node wait."""
        seen = () if self._readings is None else (
            ('jumps', self._readings.jumps), ('not_finite', self._readings.not_finite),
            ('long_reads', self._readings.waits.count))
        return (*super().diagnostic_values(), ('read_failures', self.failures), *seen)

    def tick(self) -> None:
        """Read each sensor and send what is new."""
        problem = ''
        assert self._readings is not None
        for topic in self.sensors.topics:
            now_ns = self.now_ns()
            try:
                new = self._readings.take(topic, now_ns)
            except DeviceError as error:
                self.failures += 1
                what = error.problem if error.where == topic else error     # said already
                problem = problem or f'{topic} is not measured: {what}'
            else:
                if new is not None:
                    value, stamp_ns = new
                    self.send(topic, topic_of(topic).content.message(stamp_ns, value))
        now_ns = self.now_ns()
        readings = self._readings
        problem = problem or readings.no_number(now_ns) or readings.another_clock(now_ns)
        # A sensor may seem silent because the back end waits for another one.
        waited = readings.waits.says and f'{readings.waits.says}{WAITED}'
        behind = readings.waits.behind(
            1.0 / self.value('publish_rate_hz'), len(self.sensors.topics), 'read all sensors')
        if behind and not waited:
            waited = f'{behind}{BEHIND}'
        seen = readings.jump(now_ns) or readings.was_no_number(now_ns)
        told = [waited, problem or seen or ('' if waited else readings.slow)]
        if any(told):
            self.diagnostics.update(
                ERROR if problem else WARN, '; '.join(text for text in told if text))
        else:
            self.diagnostics.update(OK, f'measuring {", ".join(self.sensors.topics)}')


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return its exit code."""
    return run(HardwareSensors, args)


if __name__ == '__main__':
    sys.exit(main())
