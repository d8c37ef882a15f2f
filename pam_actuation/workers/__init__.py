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
Where independent tasks run: threads or processes of this machine, or a cluster that exists.

``Workers`` is the one way. Results come in the order of the items and do not depend on who
computed them. A Dask scheduler is named by its address (``tcp://host:8786``), a Ray cluster
likewise (``ray://host:10001``); both libraries are optional.
"""

from pam_actuation.workers.errors import ClusterLost, WorkerLost
from pam_actuation.workers.workers import Workers

__all__ = ['ClusterLost', 'WorkerLost', 'Workers']
