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

"""The reference on ROS: what the muscle is asked to do, now and ahead."""

from collections.abc import Sequence
import itertools
import math
import sys
import time
from typing import Any

from pam_actuation.bags.ending import FINISHED
from pam_actuation.bags.ending import PLAYING
from pam_actuation.drivers.limits import SafetyLimits
from pam_actuation.drivers.parameter import node_parameter
from pam_actuation.messages import NOT_BEGUN
from pam_actuation.nodes.diagnostics import OK, Values, WARN
from pam_actuation.nodes.endpoints import PolledSubscription
from pam_actuation.nodes.managed import ManagedNode
from pam_actuation.nodes.runner import run
from pam_actuation.nodes.timing import ClockSteps
from pam_sim.errors import InputError
from pam_sim.joint.parameters import SIDES
from pam_sim.valve import VALVES

# Field of a measurement that has to be a finite number.
MEASURED = {'contraction': 'contraction_m', 'force': 'force_n', 'pressure': 'pressure_pa',
            'joint_state': 'angle_rad'}
OF_DOMAIN = {'contraction': ('contraction',), 'force': ('force',),
             'joint_angle': ('joint_state',)}
# As for the driver. A clock that is slewed takes the steady clock with it.
CLOCK_STEP_S = SafetyLimits().pause_s
TOLD_S = 3.0                # without a measurement: then it is told
UNTRACKED = 'pressure', 'contraction', 'force'      # of an experiment that tracks nothing


class ReferenceGenerator(ManagedNode):
    """
    Play one experiment; afterwards keep sending its last value.

    An experiment in pressure sends ``pressure_command``, one in the raw valve signal
    ``valve_command``. Both run without a controller. The disturbance of an experiment is sent
    on ``external_force``.
    """

    NAME = 'reference_generator'
    PARAMETERS = (
        node_parameter(
            'experiment', 'sine_quarter_hz', 'Experiment by name, or path of its file; a change '
            'counts when the node is configured again.'),
        node_parameter(
            'valve_type', 'ppr', 'Valve of the rig, for experiments that speak to it.',
            choices=VALVES),
        node_parameter('rate_hz', 100.0, 'Rate of the reference [Hz].', 50.0, 200.0),
        node_parameter(
            'await_receiver', False, 'Wait before the experiment starts until some node besides '
            'await_subscriber receives it.'),
        node_parameter(
            'await_measurement_s', 0.0, 'Wait after that, at most this long, until the '
            'experiment can be measured: what it tracks (without that any of pressure, '
            'contraction, force), and what the drivers send to their valves. The node ends '
            'with an error where the time is over [s]. 0: do not wait.', 0.0, 3600.0),
        node_parameter(
            'start_delay_s', 0.0, 'Wait after that before the experiment starts [s].', 0.0, 60.0),
        node_parameter(
            'exit_when_finished', False, 'End the process when the experiment is over.'),
    )

    LIVE = ('experiment',)

    loop: Any = None            # a ReferenceLoop, once configured
    begin_ns: int | None = None
    _lacks = ''                 # topics without which it does not begin, once that lasts
    _played_s = 0.0             # of the experiment, at the last tick

    def check(self) -> None:
        """Refuse to wait in lockstep, where everybody waits for the reference."""
        for name in ('start_delay_s', 'await_measurement_s'):
            if self.participants and self.value(name) > 0.0:
                raise InputError('0 is needed in lockstep', f'parameter {name}')

    def setup(self) -> None:
        """Load the experiment, create the topics of its domain."""
        from pam_actuation.experiments import load_experiment
        from pam_actuation.experiments.reference import ReferenceLoop
        self.experiment = load_experiment(self.value('experiment'))
        self.loop = ReferenceLoop(
            self.experiment, self.value('rate_hz'), self.value('valve_type'))
        for topic in self.loop.topics:
            self.add_publisher(topic)
        self.main_topic = self.publishers_counted[0].topic
        # One message of each of these groups is awaited.
        self.awaited_inputs: list[list[PolledSubscription]] = []
        if self.value('await_measurement_s'):
            domain = self.experiment.domain
            signals = [f'{side}/valve_signal' for side in SIDES] if (
                domain == 'joint_angle') else ['valve_signal']
            self.awaited_inputs = [[self.add_subscription(topic) for topic in group] for group in (
                OF_DOMAIN.get(domain, UNTRACKED), *([signal] for signal in signals))]

    def start(self) -> None:
        """Play from the beginning."""
        self.loop.start_ns = None
        self.begin_ns, self._lacks = None, ''
        self._received_s = self._played_s = 0.0
        self._clock_steps = ClockSteps()
        self.add_loop(1.0 / self.loop.rate_hz)

    def _received(self) -> bool:
        """Tell whether anybody is there to receive the experiment."""
        if not self.value('await_receiver'):
            return True
        expected = 1 if self.value('await_subscriber') else 0
        return self.count_subscribers(self.main_topic) > expected

    def _missing(self, now_ns: int) -> str:
        """Return the topics, '' for none, without which the experiment does not begin."""
        from pam_actuation.control.measurement import fresh

        for one in itertools.chain(*self.awaited_inputs):
            one.take()

        def heard(one: PolledSubscription) -> bool:
            field = MEASURED.get(one.topic.rsplit('/', 1)[-1])
            return fresh(one.newest, now_ns) and (
                field is None or math.isfinite(getattr(one.newest, field)))

        return ', '.join(' or '.join(one.topic for one in group) for group in self.awaited_inputs
                         if not any(heard(one) for one in group))

    def _may_begin(self, now_ns: int) -> bool:
        """Tell whether all is there; say what is not, and fail where that takes too long."""
        if not self._received():
            return False
        missing = self._missing(now_ns)
        self._received_s = self._received_s or time.monotonic()
        limit_s = self.value('await_measurement_s')
        waited_s = time.monotonic() - self._received_s
        self._lacks = missing if waited_s > TOLD_S else ''
        if missing and waited_s > limit_s:
            self.fail(f'the experiment did not begin: nothing valid came on {missing} for '
                      f'{limit_s:g} s')
        return not missing

    def tick(self) -> None:
        """Send what is due."""
        loops = self.loops.time
        clocks_ns = loops.now_ns(), self.now_ns(), loops.now_ns()
        now_ns = clocks_ns[1]
        if self.begin_ns is None and self._may_begin(now_ns):
            self.begin_ns = now_ns + round(self.value('start_delay_s') * 1e9)
            self._clock_steps.begin(*clocks_ns)
        if self._plays and self._clock_was_set(clocks_ns):
            return
        if self.exit_code is not None:
            return
        if self.begin_ns is None or now_ns < self.begin_ns:
            if self._lacks and self.begin_ns is None:
                self.diagnostics.update(WARN, f'{NOT_BEGUN} {self._lacks}')
            else:
                self.diagnostics.update(OK, 'waiting for the start')
            return
        for topic, plain in self.loop.tick(now_ns).items():
            self.send(topic, plain)
        self._played_s = self.loop.elapsed_s(now_ns)
        if not self.loop.finished(now_ns):
            self.diagnostics.update(OK, f'{PLAYING} {self.experiment.name}')
            return
        self.diagnostics.update(OK, f'{FINISHED} {self.experiment.name}')
        if self.value('exit_when_finished'):
            self.exit_code = 0

    @property
    def _plays(self) -> bool:
        return self.begin_ns is not None and self._played_s < self.experiment.duration_s

    def _clock_was_set(self, clocks_ns: tuple[int, int, int]) -> bool:
        """
        Fail where the clock of the stamps was set during the experiment; tell whether it was.

        An experiment is counted by its stamps: it would jump, or stand still.
        """
        step_s = self._clock_steps.step_s(*clocks_ns)
        if self.simulated_time is not None and self.loop.elapsed_s(clocks_ns[1]) < 0.0:
            self.fail('the experiment ends here: the simulated time began anew')
        elif abs(step_s) > CLOCK_STEP_S:
            self.fail(f'the experiment ends here: the clock of this computer was set '
                      f'{"ahead" if step_s > 0.0 else "back"} by {abs(step_s):.1f} s; let it '
                      f'settle (`timedatectl`, `chronyc tracking`) and record again')
        return self.exit_code is not None

    def safe_stop(self, why: str) -> None:
        """Take the disturbance off and, where it speaks to the valve, ask it to vent."""
        if self.loop is not None and self.begin_ns is not None:
            self.begin_ns = None
            for topic, plain in self.loop.safe_messages(self.now_ns()).items():
                self.send(topic, plain)

    def teardown(self) -> None:
        """Drop the experiment."""
        self.loop = None

    def diagnostic_values(self) -> Values:
        """Add how far the experiment is."""
        return (*super().diagnostic_values(), ('elapsed_s', f'{self._played_s:.3f}'))


def main(args: Sequence[str] | None = None) -> int:
    """Run the node; return its exit code."""
    return run(ReferenceGenerator, args)


if __name__ == '__main__':
    sys.exit(main())
