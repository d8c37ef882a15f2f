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
What one controller tick is given: the record of its inputs.

All laws share it, so that the loop, the replay and the compiled closed loops need not know
which law they drive. Optional values are NaN.
"""

from collections.abc import Callable
import struct

from pam_sim.annotations import FloatArray
from pam_sim.records import record, size_of

# An older measurement is not used; after a longer gap, what is estimated of them begins anew.
MAX_AGE_S = 0.1
MAX_AGE_NS = round(MAX_AGE_S * 1e9)

INPUT = record(
    'contraction_m',                  # measured
    'reference_m',                    # wanted at the time of that measurement
    'reference_rate_m_per_s',
    'lead_reference_m',               # wanted ``lead_s`` from now: the preview
    'lead_rate_m_per_s',
    'learning',                       # 1 = the rules may change in this tick
    'elapsed_s',                      # between this and the former measurement, NaN = period
    'pressure_pa',                    # absolute, measured; NaN = not known
    'force_n',                        # measured; NaN = not known
    'held_back',                      # 0 = the driver follows the command; else see ``following``
    'age_s',                          # of the measurement: from its stamp to now
    'pressure_age_s',
)
_write: Callable[..., None] = struct.Struct(f'{size_of(INPUT)}d').pack_into


def write_inputs(
        inputs: FloatArray, contraction_m: float, reference_m: float,
        reference_rate_m_per_s: float, lead_reference_m: float, lead_rate_m_per_s: float,
        learning: float, elapsed_s: float, pressure_pa: float, force_n: float,
        held_back: float, age_s: float = 0.0, pressure_age_s: float = 0.0) -> None:
    """Write all fields of ``INPUT`` at once, much faster than one by one."""
    _write(inputs, 0, contraction_m, reference_m, reference_rate_m_per_s, lead_reference_m,
           lead_rate_m_per_s, learning, elapsed_s, pressure_pa, force_n, held_back,
           age_s, pressure_age_s)
