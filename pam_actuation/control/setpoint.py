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
What is asked of one muscle: a contraction or a force, from what was published.

The loop calls it before every tick; for a joint ``joint_setpoint`` takes its place.
"""

from collections.abc import Callable
import math
from typing import Any, Protocol

from pam_actuation.control import reference_buffer, tick as codes
from pam_actuation.control.modes.tracked import Tracked
from pam_actuation.control.reference_buffer import ReferenceBuffer
from pam_actuation.control.tick import Effort

REFERENCE_REASONS = {
    reference_buffer.NONE: codes.NO_REFERENCE, reference_buffer.FRESH: codes.OK,
    reference_buffer.HELD: codes.REFERENCE_HELD, reference_buffer.LOST: codes.REFERENCE_LOST,
    reference_buffer.DROPPED: codes.REFERENCE_DROPPED}


class Setpoint(Protocol):
    """What is asked of a controller."""

    references: ReferenceBuffer
    effort: Effort          # torque asked for, and whether it counts in this tick
    changed: bool           # whether the law follows another quantity than in the tick before
    co_contraction_pa: float    # asked for, absolute; NaN where it is not

    def takes(self) -> dict[str, Callable[[Any], object]]:
        """Return what takes each topic."""

    def forget(self) -> None:
        """Forget all that was asked for."""

    def begin(self, now_ns: int, measured: float) -> None:
        """Begin a tick: let what arrived count; ``measured`` is the newest measurement."""

    def reason(self, now_ns: int) -> int:
        """Return the code for what is asked for, one of ``codes.RUNNING`` if there is any."""

    def stamps(self, now_ns: int) -> tuple[int, ...]:
        """Return the stamps of reference and trajectory, -1 for one that does not count."""

    @property
    def refused(self) -> int:
        """Return the number of references and trajectories that were not usable."""

    @property
    def refusals(self) -> tuple[str, ...]:
        """Return by kind why the newest messages were not usable, '' for none."""

    def values(self) -> tuple[tuple[str, object], ...]:
        """Return what the diagnostics tell of it."""


class MuscleSetpoint:
    """
    What is asked of one muscle.

    Parameters
    ----------
    tracked : Tracked
        Contraction or force.
    allowed : tuple of float
        Lowest and highest value; a message that asks for more is refused.

    """

    def __init__(self, tracked: Tracked, allowed: tuple[float, float]) -> None:
        self.references = ReferenceBuffer(tracked, allowed)
        self.effort, self.changed, self.co_contraction_pa = Effort(), False, math.nan

    def takes(self) -> dict[str, Callable[[Any], object]]:
        """Return what takes each topic; an unusable message is ignored and counted."""
        return {'reference_trajectory': self.references.set_trajectory,
                'reference': self.references.set_reference}

    def forget(self) -> None:
        """Forget all that was asked for."""
        self.references.clear()

    def begin(self, now_ns: int, measured: float) -> None:
        """Begin a tick: what is stamped too far ahead, or too old, is refused."""
        self.references.judge(now_ns)

    def reason(self, now_ns: int) -> int:
        """Return the code for what is asked for, one of ``codes.RUNNING`` if there is any."""
        return REFERENCE_REASONS[self.references.state(now_ns)]

    def stamps(self, now_ns: int) -> tuple[int, ...]:
        """Return the stamps of reference and trajectory, -1 for one that does not count."""
        reference, trajectory = self.references.reference, self.references.counting(now_ns)
        if trajectory is not None:
            return -1, trajectory.stamp_ns
        return -1 if reference is None else reference.stamp_ns, -1

    @property
    def refused(self) -> int:
        """Return the number of references and trajectories that were not usable."""
        return self.references.refused

    @property
    def refusals(self) -> tuple[str, ...]:
        """Return why the newest of them was not usable, '' for none."""
        return (self.references.refusal,)

    def values(self) -> tuple[tuple[str, object], ...]:
        """Return what the diagnostics tell of it."""
        return (('references.refused', self.refused),
                ('references.refusal', self.references.refusal))
