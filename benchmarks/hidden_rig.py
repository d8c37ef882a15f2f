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
Rigs of the independent simulator under test/hidden, in the place of a rig of this package.

``hidden_rig(valve, seed)`` is ``dmsp_5_300_realistic`` in name, for controller and driver. What
moves has other equations, and its friction, valve and dead time are off by up to 30 %.
"""

from pathlib import Path
import sys

from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.tuning.foreign_plant import ForeignLoop
from pam_sim import load_rig
from pam_sim.rig import Rig

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / 'test' / 'hidden'))

import truth_live  # noqa: E402, I100
import truth_realistic  # noqa: E402

RIG = 'dmsp_5_300_realistic'


class OnHiddenRig(Rig):
    """A rig of this package in name; what moves is a hidden one with ``numbers``."""

    numbers = {}

    def plant(self, seed=0, dt_s=0.001, **initial):
        """Return the hidden rig at rest."""
        plant = truth_live.LiveRig(self.numbers, valve=self.valve)
        plant.rig = self
        return plant


def hiding(rig, numbers):
    """Return a rig that is another in name and a hidden one with these numbers in motion."""
    found = OnHiddenRig(**{name: getattr(rig, name) for name in Rig.__dataclass_fields__})
    object.__setattr__(found, 'numbers', numbers)
    return found


def hidden_rig(valve, seed):
    """Return the hidden rig of a seed; None: that with nothing off."""
    return hiding(load_rig(RIG, valve=valve), truth_realistic.realistic_numbers(valve, seed))


def hidden_loop(rig, experiment, **more):
    """Return the closed loop on a hidden rig, with the driver of the rig it is in name."""
    named = load_rig(RIG, valve=rig.valve)
    return ForeignLoop(rig.plant, named, experiment, driver=driver_config(named), **more)
