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

"""Real-time scheduling of a node, where the system allows it."""

import os


def ask_for_realtime(priority: int) -> str:
    """
    Let all threads of this process be scheduled first, round robin (Linux).

    Parameters
    ----------
    priority : int
        1 to 99; 0 changes nothing.

    Returns
    -------
    str
        Why it was not granted, '' if it was.

    """
    if priority == 0:
        return ''
    try:
        parameter = os.sched_param(priority)
        for thread in os.listdir('/proc/self/task'):
            os.sched_setscheduler(int(thread), os.SCHED_RR, parameter)
    except (AttributeError, OSError) as error:
        return getattr(error, 'strerror', None) or str(error)
    return ''
