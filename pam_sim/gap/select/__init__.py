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
Which effects are missing: candidates, ranking, forward selection, backward elimination.

``candidates`` lists what may be missing, and ``screening`` chooses those worth a fit.
``comparison`` decides which of two fits the held-out data prefer. ``rival``, ``rivals`` and
``ranking`` find the winner of a round. ``context`` holds the data of a search, and ``refit`` fits
with one effect left out or replaced. ``forward`` adds effects; ``rerank``, ``size``,
``plausibility`` and ``backward`` decide what stays. ``pairs`` tries two at once where that fails.
``search`` runs everything in order.
"""
