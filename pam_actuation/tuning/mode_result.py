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

"""What a closed loop of force mode or joint mode returns."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pam_actuation.tuning.tracking_errors import Cycles, TrackingErrors
from pam_sim.annotations import FloatArray
from pam_sim.short_repr import short_repr

if TYPE_CHECKING:
    import pandas as pd


@short_repr
@dataclass
class ModeResult(TrackingErrors):
    """
    One tracked experiment, sampled at the controller's ticks; SI, pressures absolute.

    ``reference`` and ``value`` are in ``unit`` (``n`` or ``rad``); ``value`` is true, without
    sensor noise. ``signals`` holds further arrays by name. ``cycle_s`` is (start, period,
    count) of the periodic part or None.
    """

    unit: str
    time_s: FloatArray
    reference: FloatArray
    value: FloatArray
    signals: dict[str, FloatArray] = field(default_factory=dict)
    cycle_s: Cycles | None = None

    @property
    def error(self) -> FloatArray:
        """Return reference minus what was reached, in ``unit``."""
        return self.reference - self.value

    def to_dataframe(self) -> 'pd.DataFrame':
        """
        Return all signals as one pandas table, a row for each tick, in SI.

        Reference and value are called ``reference_n`` and ``value_n``, or ``_rad``.
        """
        import pandas as pd     # takes a second to load
        return pd.DataFrame({
            'time_s': self.time_s, f'reference_{self.unit}': self.reference,
            f'value_{self.unit}': self.value, **self.signals})
