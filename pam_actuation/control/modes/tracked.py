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

"""The quantity a controller tracks: its name, its unit, the topic that measures it."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Tracked:
    """
    One tracked quantity.

    Parameters
    ----------
    mode : str
        Name in controller files.
    unit : str
        Suffix of the reference in ``controller_state`` and of keys in experiment files.
    topic : str
        Topic with the measurement without which the controller cannot run; an experiment
        in this quantity has it as its domain.
    fastest : float
        Highest rate per second that is followed. It is a design value, beyond what any muscle or
        joint of this kind does: 20 rad/s cross the range of a joint in 0.1 s.

    """

    mode: str
    unit: str
    topic: str
    fastest: float


CONTRACTION = Tracked('contraction', 'm', 'contraction', 1.0)
FORCE = Tracked('force', 'n', 'force', 1e5)
JOINT = Tracked('joint', 'rad', 'joint_angle', 20.0)
TRACKED = {one.mode: one for one in (CONTRACTION, FORCE, JOINT)}


def tracked_by(controller: Any) -> Tracked:
    """Return what a controller tracks; a law by itself tracks contraction."""
    return getattr(controller, 'tracked', CONTRACTION)
