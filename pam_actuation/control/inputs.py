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
What one controller tick is given, as places in one vector.

All controllers share it, so that the loop, the replay and the compiled closed
loop need not know which controller they drive. Optional values are NaN.
"""

IN_CONTRACTION = 0        # m, measured
IN_REFERENCE = 1          # m, wanted at the time of that measurement
IN_REFERENCE_RATE = 2     # m/s
IN_LEAD_REFERENCE = 3     # m, wanted ``lead_s`` from now (the preview)
IN_LEAD_RATE = 4          # m/s
IN_LEARN = 5              # 1 = the rules may change in this tick
IN_ELAPSED = 6            # s between the measurements of this and the former tick, NaN = period
IN_PRESSURE = 7           # absolute Pa, measured; NaN = not known
IN_FORCE = 8              # N, measured; NaN = not known
IN_HELD_BACK = 9          # 0 = the driver follows the command; else see ``following``
INPUT_COUNT = 10
