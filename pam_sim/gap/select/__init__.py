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

``candidates`` (what may be missing), ``screening`` (which of them are worth a fit),
``comparison`` (which of two fits the held-out data prefer), ``rival``, ``ranking`` (which rival
wins), ``context`` (what a search stands on), ``rivals`` (those of a round), ``refit`` (with one
effect left out or replaced), ``forward``, ``rerank``, ``size``, ``plausibility`` and
``backward`` (what stays), ``pairs`` (two at once, where that fails), ``search`` (all of it in
order).
"""
