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
Volumes: where the inner volume of a muscle comes from, a choice of the rig file.

Each is one file with ``volume_m3`` for Python and ``least_volume_m3``, which also refuses a muscle
that has no such volume. The step has them in :mod:`pam_sim.rollout.air`.
"""

from pam_sim.volume import bore, law

VOLUMES = {module.NAME: module for module in (bore, law)}
