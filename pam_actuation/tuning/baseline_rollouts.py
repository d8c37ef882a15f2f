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
The compiled closed loop with further baselines; see ``rollouts``, whose loop this is.

Each is a unit of compiled code of its own: a change of one law compiles no other anew.
"""

from collections.abc import Callable
from typing import Any

from pam_actuation.control.ilc import ilc_step
from pam_actuation.control.mpc import mpc_step
from pam_actuation.tuning.rollouts import actuate, sense
from pam_sim.compiled import entry_point, source_key


def _of_ilc(key: int) -> Callable[..., None]:
    """Return the rollout of the ILC as a unit of compiled code, stored under ``key``."""
    @entry_point
    def ilc_rollout(ticks: int, controller: Any, *loop: Any) -> None:
        """Track a reference with the ILC; arguments as ``sofc_rollout``, of ``ilc_step``."""
        if key >= 0:        # always; makes the key part of what is stored
            for tick in range(ticks):
                sense(tick, *loop)
                actuate(tick, ilc_step(*controller), *loop)

    return ilc_rollout


def _of_mpc(key: int) -> Callable[..., None]:
    """Return the rollout of the MPC as a unit of compiled code, stored under ``key``."""
    @entry_point
    def mpc_rollout(ticks: int, controller: Any, *loop: Any) -> None:
        """Track a reference with the MPC; arguments as ``sofc_rollout``, of ``mpc_step``."""
        if key >= 0:
            for tick in range(ticks):
                sense(tick, *loop)
                actuate(tick, mpc_step(*controller), *loop)

    return mpc_rollout


ilc_rollout = _of_ilc(source_key(sense, actuate, ilc_step))
mpc_rollout = _of_mpc(source_key(sense, actuate, mpc_step))
