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
Named effects, one file each; being in this folder is being registered.

A file defines ``EFFECT = Effect(...)`` and, under the names of
:mod:`pam_sim.rollout.hooks`, the small compiled functions by which it acts. They take the
arguments they name and read their numbers by name::

    @compiled
    def muscle_force(force_n, contraction_m, par):
        return force_n - par.stiffness_n_per_m * contraction_m

Further folders can be named in the environment variable ``PAM_EFFECTS_PATH``.
"""
