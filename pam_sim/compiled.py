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
How the small numerical functions of the package are compiled.

numpy error model: a division by zero gives inf as in NumPy instead of a check
on every division. No fastmath: compiled and interpreted results stay equal.
"""

from numba import njit

# Without reference counting: none of these functions makes an array, and counting
# the ones handed through cost more than the physics.
compiled = njit(error_model='numpy', nogil=True, _nrt=False)
# For the few functions on the path of every step: no call is left of them.
inlined = njit(error_model='numpy', nogil=True, _nrt=False, forceinline=True)


def interpreted(function):
    """Return the Python function behind a compiled one: for a single call, not worth compiling."""
    return getattr(function, 'py_func', function)
