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

"""An experiment ends where the clock is set under it, and the bag tells how far it came."""

import logging
from types import SimpleNamespace

import pytest

pytest.importorskip('rclpy')

from pam_actuation.bags.ending import EndWatch, ERROR                       # noqa: E402, I100
from pam_actuation.experiments import load_experiment                       # noqa: E402
from pam_actuation.experiments.reference import ReferenceLoop               # noqa: E402
from pam_actuation.messages import LEVEL_ERROR, START_NS, Status            # noqa: E402
from pam_actuation.nodes.reference_generator import ReferenceGenerator      # noqa: E402
from pam_actuation.nodes.timing import ClockSteps                           # noqa: E402

MS, S = 1_000_000, 1_000_000_000


class Generator(ReferenceGenerator):
    """A reference generator without ROS, on two clocks of the test."""

    awaited_inputs = ()
    failure = None

    def __init__(self, simulated=False):
        self.steady_ns, self.set_by_ns, self.sent, self.said = 7 * S, 0, [], []
        self.experiment = load_experiment('staircase')
        self.loop = ReferenceLoop(self.experiment, 100.0, 'ppr')
        self.loops = SimpleNamespace(time=SimpleNamespace(
            now_ns=lambda: self.now_ns() if simulated else self.steady_ns))
        self.simulated_time = self.loops.time if simulated else None
        self.diagnostics = SimpleNamespace(
            update=lambda level, message: self.said.append((level, message)))
        self.watch, self.exit_code = EndWatch('/muscle'), None
        self.start()

    def add_loop(self, period_s):
        pass

    def value(self, name):
        return 0.0

    def now_ns(self):
        return START_NS + self.steady_ns + self.set_by_ns

    def send(self, topic, plain):
        self.sent.append((topic, plain))

    def get_logger(self):
        return logging.getLogger('test')

    def fail(self, why, details=''):
        self.exit_code, self.failure = 1, why
        self.said.append((LEVEL_ERROR, why))

    def run(self, seconds):
        """Tick at 100 Hz until it ends; the recorder hears each status."""
        for _ in range(round(seconds * 100)):
            self.steady_ns += 10 * MS
            if self.exit_code is None:
                self.tick()
                level, message = self.said[-1]
                self.watch.hear([Status(
                    self.now_ns(), level, '/muscle/reference_generator', message,
                    (('elapsed_s', f'{self._played_s:.3f}'),))])


@pytest.mark.parametrize(('set_by_s', 'word'), [(33.5, 'ahead'), (20.0, 'ahead'), (-60.0, 'back')])
def test_a_clock_that_is_set_ends_the_experiment(set_by_s, word):
    node = Generator()
    node.run(3.0)
    node.set_by_ns = round(set_by_s * S)
    sent = len(node.sent)
    node.run(3.0)
    assert f'was set {word} by {abs(set_by_s):.1f} s' in node.failure
    assert len(node.sent) == sent
    ending = node.watch.ending(28.5)
    assert ending.ended == ERROR and ending.reached_s == pytest.approx(3.0, abs=0.02)


def test_an_experiment_on_a_clock_that_is_slewed_or_a_loop_that_stood_still_goes_on():
    node = Generator()
    for _ in range(29):
        node.run(1.0)
        node.set_by_ns += 1 * MS         # ntpd: 500 us/s at most
        node.steady_ns += 2 * MS
    node.run(1.0)
    assert node.failure is None
    node = Generator()
    node.run(3.0)
    node.steady_ns += 5 * S             # stopped and continued: both clocks went on
    node.run(25.0)
    assert node.failure is None


def test_a_simulated_time_that_begins_anew_ends_the_experiment():
    node = Generator(simulated=True)
    node.run(3.0)
    node.set_by_ns = -4 * S
    node.run(1.0)
    assert 'the simulated time began anew' in node.failure


def test_after_the_end_the_clock_may_be_set():
    node = Generator()
    node.run(29.0)
    node.set_by_ns = 60 * S
    node.run(1.0)
    assert node.failure is None and node.watch.ending(28.5).ended == 'complete'


def test_a_process_that_stood_still_between_two_readings_proves_no_step():
    clock = ClockSteps()
    assert clock.step_s(0, 10 * S, 0) == 0.0
    clock.begin(1 * S, 100 * S, 1 * S)
    assert clock.step_s(2 * S, 101 * S, 9 * S) == 0.0       # still after the reading
    assert clock.step_s(2 * S, 108 * S, 9 * S) == 0.0       # or before it
    assert clock.step_s(2 * S, 110 * S, 9 * S) == pytest.approx(2.0)
    assert clock.step_s(2 * S, 99 * S, 9 * S) == pytest.approx(-2.0)
