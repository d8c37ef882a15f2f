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
Find the gap between a recording and a model: how large it is and where it sits.

The files in reading order: ``health`` (can these data be used), ``noise`` (what
sensors and stamps explain), ``free_run`` (the model on the recorded valve signal),
``nominal`` (calibrate the model's own numbers within their tolerance), ``locate``
(which subsystem, which condition), ``first_look`` (all of it in order, and the
verdict), ``result`` (what gap.json holds).
"""

from pam_sim.gap.first_look import gap_first_look
from pam_sim.gap.result import GapResult

__all__ = ['gap_first_look', 'GapResult']
