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
How Fast DDS, below ROS 2, moves the messages of a process: by UDP, not through shared memory.

Fast DDS guards each shared-memory port by a lock that lies in the shared memory itself. A process
that is killed or stopped while it holds the lock blocks all who send there for 1 s. The build of
Fast DDS fixes that time (``BOOST_INTERPROCESS_TIMEOUT_WHEN_LOCKING_DURATION_MS`` in its
``boostconfig.hpp``). A process that only starts may block them for a third of a second, until its
port looks healthy. One that replaces a killed one may never be heard (Fast DDS issues 5053, 5469).
Neither a dead node nor a listening one may block a driver; UDP has no such lock.

A reliable writer asks its readers from time to time what has arrived, by default every 3 s.
The answers free all messages of those 3 s at once, up to the depth of the publisher: for 0.5 ms
nobody else can send (1000 messages). The profiles let it ask every 0.2 s.
"""

from collections.abc import Mapping, MutableMapping
import os

from pam_actuation.resources import config_dir

PROFILES = 'FASTRTPS_DEFAULT_PROFILES_FILE'
TRANSPORTS = 'FASTDDS_BUILTIN_TRANSPORTS'
RANGE = 'ROS_AUTOMATIC_DISCOVERY_RANGE'
BY_PROFILE = 'SYSTEM_DEFAULT'        # the range that leaves transports and peers to the profile
FURTHER = ('SUBNET', BY_PROFILE, 'OFF')
LOCALHOST_ONLY = 'ROS_LOCALHOST_ONLY'
FAST_DDS = 'rmw_fastrtps'           # as the names of its implementations begin
LOOPBACK, NETWORK = 'fastdds_loopback.xml', 'fastdds_network.xml'


def prepare_middleware(environment: MutableMapping[str, str] = os.environ) -> None:
    """
    Set how participants that are created later in this process talk.

    Without a range of discovery they look at this machine only. With that range rmw_fastrtps adds
    shared memory, whatever transports are chosen. The profile therefore sets the range: it looks
    at this machine only as well, by UDP alone. A profile file of the user's own stays, with all
    that it leaves to Fast DDS, and so does his choice of transports. Other middleware keeps the
    range and ignores profile and transports.

    Parameters
    ----------
    environment : dict of str
        The variables, changed in place; default: those of this process.

    Raises
    ------
    InputError
        The profiles are missing: the installation is incomplete.

    """
    if not environment.get(RANGE):
        environment[RANGE] = 'LOCALHOST'
    ours = {name: str(config_dir() / 'middleware' / name) for name in (LOOPBACK, NETWORK)}
    if environment.get(PROFILES, ours[NETWORK]) not in ours.values() or _is_prepared(environment):
        return
    by_udp = environment.setdefault(TRANSPORTS, 'UDPv4') == 'UDPv4'
    # ROS takes what it does not know for LOCALHOST. Named peers are on other machines.
    this_machine_only = not environment.get('ROS_STATIC_PEERS') and (
        environment[RANGE] not in FURTHER or environment.get(LOCALHOST_ONLY) == '1')
    environment[PROFILES] = ours[LOOPBACK if by_udp and this_machine_only else NETWORK]
    if environment[PROFILES] == ours[LOOPBACK] and (
            environment.get('RMW_IMPLEMENTATION') or FAST_DDS).startswith(FAST_DDS):
        environment[RANGE] = BY_PROFILE
        environment.pop(LOCALHOST_ONLY, None)       # it would overrule the range


def _is_prepared(environment: Mapping[str, str]) -> bool:
    """Return whether the range was left to the profile for this machine."""
    return (environment.get(PROFILES, '').endswith(LOOPBACK)
            and environment.get(RANGE) == BY_PROFILE)


def unprepared(environment: Mapping[str, str]) -> dict[str, str]:
    """Return a copy of an environment in which ROS and Fast DDS take their own defaults."""
    left = {name: value for name, value in environment.items()
            if name not in (PROFILES, TRANSPORTS)}
    if _is_prepared(environment):
        left[RANGE] = 'LOCALHOST'
    return left
