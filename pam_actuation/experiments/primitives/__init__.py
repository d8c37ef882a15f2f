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
Building blocks of an experiment: signals with a duration, a value and a rate.

A primitive is made from the value the previous one ended with, so a chain of
them is continuous unless a jump is asked for. Values carry the unit of the
experiment's domain; rates are per second. A file in this folder is a primitive by
being here: its name is the name in experiment files, and it defines ``PRIMITIVE``, a
dataclass derived from ``base.Primitive``. Further folders can be named in the
environment variable ``PAM_PRIMITIVES_PATH``.
"""

from pam_actuation.experiments.primitives.base import Primitive
from pam_actuation.experiments.primitives.make import make_primitive, PRIMITIVES

__all__ = ['make_primitive', 'Primitive', 'PRIMITIVES']
