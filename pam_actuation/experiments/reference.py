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

"""Turn an experiment into reference messages on a clock."""

from pam_actuation.messages import Pressure, Reference, ReferenceTrajectory

POINT_NS = 20_000_000          # points of the trajectory, at most 20 ms apart on the wire
POINTS = 31                    # horizon 0.6 s; the wire asks for 0.5 s or more
TRAJECTORY_EVERY_NS = 100_000_000   # 10 Hz; the wire asks for 5 Hz or more


class ReferenceLoop:
    """
    The reference generator without ROS: one call per tick, messages out.

    The clock of the experiment starts with the first tick, so all times inside
    are differences of stamps.

    Parameters
    ----------
    experiment : Experiment
        What to ask for; domain ``pressure`` gives pressure commands instead.
    rate_hz : float
        Ticks per second, 100 by default.

    """

    def __init__(self, experiment, rate_hz=100.0):
        self.experiment = experiment
        self.rate_hz = float(rate_hz)
        self.start_ns = None
        self._next_trajectory_ns = 0

    def elapsed_s(self, now_ns):
        """Return seconds since the first tick."""
        return 0.0 if self.start_ns is None else (now_ns - self.start_ns) * 1e-9

    def finished(self, now_ns):
        """Return whether the experiment is over."""
        return self.start_ns is not None and self.elapsed_s(now_ns) >= self.experiment.duration_s

    def tick(self, now_ns):
        """
        Return the messages due now as a dict of short topic name to message.

        Domain ``contraction``: ``reference``, and every 0.1 s ``reference_trajectory``.
        Domain ``pressure``: ``pressure_command``.
        """
        if self.start_ns is None:
            self.start_ns = self._next_trajectory_ns = now_ns
        value, rate = self.experiment.at(self.elapsed_s(now_ns))
        if self.experiment.domain == 'pressure':
            return {'pressure_command': Pressure(now_ns, value)}
        out = {'reference': Reference(now_ns, value, rate)}
        if now_ns >= self._next_trajectory_ns:
            out['reference_trajectory'] = self.trajectory(now_ns)
            self._next_trajectory_ns += TRAJECTORY_EVERY_NS
        return out

    def trajectory(self, now_ns):
        """Return the next 0.6 s of the reference as one message."""
        offsets = tuple(k * POINT_NS for k in range(POINTS))
        points = [self.experiment.at(self.elapsed_s(now_ns + o)) for o in offsets]
        return ReferenceTrajectory(
            now_ns, offsets, tuple(p[0] for p in points), tuple(p[1] for p in points))
