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
Whether what is named holds on data that neither fit nor selection has seen.

``model`` (the rig of a fit), ``materiality`` (does it move a signal by enough), ``validation``
(free runs on the certify data), ``refutation`` (which names these contradict), ``spread`` (what
the doubt about the numbers leaves), ``uncertainty`` (how well the numbers are known).
"""
