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
One question to many recordings: found, worked on one by one, kept, compared over rigs and days.

``find_cases`` lists the recordings, ``run_campaign`` works on them and keeps what each gave,
``series_of`` and ``changes_of`` say what changed when.
"""

from pam_actuation.campaign.campaign import Campaign, run_campaign
from pam_actuation.campaign.cases import Case, find_cases
from pam_actuation.campaign.work import Settings, WORKS

__all__ = ['Campaign', 'Case', 'find_cases', 'run_campaign', 'Settings', 'WORKS']
