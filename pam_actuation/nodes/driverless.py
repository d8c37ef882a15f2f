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

"""Valve drivers that should be there, since their rig runs, and are not heard."""

from collections.abc import Collection
from typing import TYPE_CHECKING

from pam_actuation.drivers.watchdog import RESTS, VENTS
from pam_actuation.rigging.plan import DRIVER, JOINT_PLANT, WATCHDOG
from pam_actuation.rigging.venting import MAY_HOLD
from pam_actuation.topics.table import SENSORS
from pam_sim.joint.parameters import SIDES

if TYPE_CHECKING:
    from pam_actuation.nodes.operator import Operator


def drivers_heard(operator: 'Operator') -> list[str]:
    """Return the full names of the valve drivers that sent a status, sorted."""
    serving = operator.serving('emergency_stop')
    return sorted(name for name in operator.statuses
                  if name in serving or name.endswith(f'/{DRIVER}'))


def unheard_drivers(operator: 'Operator', heard: Collection[str]) -> dict[str, str]:
    """
    Return full name of each driver that should be there, to what is known of its muscle.

    A plant, sensors or a watchdog in its namespace say that it should.

    Parameters
    ----------
    operator : Operator
        What it knows of the graph counts.
    heard : collection of str
        Full names of the drivers that are there.

    """
    served = {name.rpartition('/')[0] for name in heard}
    running = {*operator.nodes(), *operator.statuses}
    needed = {namespace for name in running for namespace in _muscles_of(name, running)}
    return {f'{namespace}/{DRIVER}': _known(operator, namespace)
            for namespace in sorted(needed - served)}


def _muscles_of(name: str, running: Collection[str]) -> list[str]:
    """Return the namespaces in which a node needs a driver; ``running`` are all full names."""
    namespace, _, kind = name.rpartition('/')
    if kind not in (*SENSORS, WATCHDOG):
        return []
    sides = [f'{namespace}/{side}' for side in SIDES]
    is_joint = kind == JOINT_PLANT or any(
        one.startswith(f'{side}/') for one in running for side in sides)
    return sides if is_joint else [namespace]


def _known(operator: 'Operator', namespace: str) -> str:
    """Return what is known of a muscle whose driver is not heard."""
    _, message, _ = operator.statuses.get(f'{namespace}/{WATCHDOG}', (0, '', {}))
    report = message and f'its watchdog reports: {message}'
    if message.startswith((VENTS, RESTS)):
        return report
    return '; '.join(filter(None, [report, MAY_HOLD]))
