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
Least-squares fits of hypotheses to the subsystem problems.

A ``candidate`` is one formulation of an effect. A ``hypothesis`` is what a model may have beyond
the given one. The ``solver`` solves one least-squares problem, and the ``estimator`` fits
hypotheses with it. ``distance`` tells how far a fit is from no effect. ``parallel`` fits several
at once.
"""
