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

"""What a simulation returns."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.rollout.layout import OUTPUT

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = {name: place for place, name in enumerate(OUTPUT.names or ())}


def brief_span(time_s: FloatArray) -> str:
    """Return the first and the last of some times as text."""
    return f'{time_s[0]:.6g} to {time_s[-1]:.6g} s' if len(time_s) else 'empty'


class Response:
    """
    Signals of a simulated run, each an ndarray of shape (N + 1,), row 0 the start.

    Of a batch only the signals and rows that were kept.

    Attributes
    ----------
    time_s : ndarray
        Seconds since the start.
    pressure_pa, contraction_m, force_n : ndarray
        Absolute pressure [Pa], contraction [m], load cell force [N] as the
        sensors read them: sensor effects included, noise not.
    true_pressure_pa, true_contraction_m, true_force_n : ndarray
        The same without sensor effects.
    velocity_m_per_s, acceleration_m_per_s2 : ndarray
        True motion of the load.
    air_mass_kg : ndarray
        Air in muscle and dead volume.
    supply_pa : ndarray
        Supply pressure, absolute.
    filled_kg, vented_kg : ndarray
        Air through the fill and the vent valve since the start; zero for the PPR.

    """

    def __init__(self, outputs: FloatArray, columns: Mapping[str, int] = COLUMNS) -> None:
        self.outputs = outputs
        self._columns = columns     # name -> column of what was kept

    def __len__(self) -> int:
        """Return the number of samples: N + 1, or those that were kept."""
        return len(self.outputs)

    def __repr__(self) -> str:
        """Return length and names in one line."""
        span = f', {brief_span(self.time_s)}' if 'time_s' in self._columns else ''
        return (f'{type(self).__name__}({len(self)} samples{span}: '
                f'{", ".join(self._columns)})')

    def __getattr__(self, name: str) -> FloatArray:
        """Return a signal by name."""
        if name != '_columns' and name in self._columns:
            return self.outputs[:, self._columns[name]]
        if name in COLUMNS:
            raise AttributeError(f'`{name}` was not kept; kept: {", ".join(self._columns)}')
        raise AttributeError(f'`{name}` is no signal; known: {", ".join(COLUMNS)}')

    def __dir__(self) -> list[str]:
        """List the signals too."""
        return [*super().__dir__(), *self._columns]

    def as_dict(self) -> dict[str, FloatArray]:
        """Return name -> ndarray of all signals."""
        return {name: np.ascontiguousarray(self.outputs[:, column])
                for name, column in self._columns.items()}

    def to_dataframe(self) -> 'pd.DataFrame':
        """Return all signals as one pandas table, a row for each sample, in SI."""
        import pandas as pd     # takes a second to load
        return pd.DataFrame(self.as_dict())
