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
What the rules of a controller said where the muscle was: a surface that changes as they learn.

Rules are not on the wire, but what they put out at each tick is, with the place at which they did.
The newest output at each place of a grid shows the surface, as far as it was visited.
"""

from dataclasses import dataclass
from typing import Any, Final, TYPE_CHECKING

import numpy as np
from pam_actuation.view.store import SPAN_NS
from pam_sim.annotations import FloatArray, IntArray

if TYPE_CHECKING:
    from pam_actuation.view.history import History
    from pam_actuation.view.store import Store

TOPIC: Final = 'controller_state'
CELLS: Final = 24           # along each axis
SHARE: Final = 0.99         # of the places that an axis shows; a jump would stretch it
LEAST_MM: Final = 0.5


@dataclass(frozen=True)
class Surface:
    """
    One surface.

    Parameters
    ----------
    title : str
    x, y : str
        Values of ``controller_state`` that say where: of x in m, of y in m/s.
    x_label, y_label : str
        What the page calls them, in mm and mm/s.
    outputs : tuple of str
        Values whose sum is drawn, in kPa.
    both_ways : bool
        Whether x has both signs, so that 0 is in the middle.

    """

    title: str
    x: str
    y: str
    x_label: str
    y_label: str
    outputs: tuple[str, ...]
    both_ways: bool


SURFACES = (
    Surface('Feedback rules', 'error_m', 'change_of_error_m_per_s', 'error [mm]',
            'change of error [mm/s]', ('feedback_rules_pa',), True),
    Surface('Feed-forward and motion rules', 'lead_reference_m', 'lead_reference_m_per_s',
            'reference [mm]', 'its rate [mm/s]', ('feedforward_rules_pa', 'motion_rules_pa'),
            False),
)


def surfaces(store: 'Store', view: str, end_ns: int | None) -> list[dict[str, Any]]:
    """
    Return the surfaces of the last minute before a time.

    Parameters
    ----------
    store : Store
        What is known of the rigs.
    view : str
        Namespace; those below it are shown too.
    end_ns : int, optional
        Time [ns]; None: nothing is known.

    Returns
    -------
    list of dict
        ``title``, ``x`` and ``y`` with label and range, ``values`` [kPa]: rows of y from low to
        high, None where the muscle was not; ``now``: where it is, in cells.

    """
    found: list[dict[str, Any]] = []
    if end_ns is None:
        return found
    with store.lock:
        histories = {namespace: history for (namespace, topic), history
                     in sorted(store.histories.items()) if topic == TOPIC
                     and (not view or f'{namespace}/'.startswith(f'{view}/'))}
        for namespace, history in histories.items():
            begin, stop = np.searchsorted(history.times_ns, [end_ns - SPAN_NS, end_ns + 1])
            rows = slice(int(begin), int(stop))
            several = f' ({namespace})' if len(histories) > 1 else ''
            found += [{**shown, 'title': one.title + several} for one in SURFACES
                      if (shown := _surface(one, history, rows)) is not None]
    return found


def _surface(surface: Surface, history: 'History', rows: slice) -> dict[str, Any] | None:
    """Return one surface of some rows, None where the controller has no such rules."""
    x, y = 1e3 * history.values(surface.x)[rows], 1e3 * history.values(surface.y)[rows]
    output: FloatArray = 1e-3 * sum(
        (history.values(name)[rows] for name in surface.outputs), np.zeros(len(x)))
    known = np.isfinite(x) & np.isfinite(y) & np.isfinite(output)
    if not known.any():
        return None
    x, y, output = x[known], y[known], output[known]
    x_range, y_range = _range(x, surface.both_ways), _range(y, True)
    column, row = _cells(x, x_range), _cells(y, y_range)
    grid = np.full((CELLS, CELLS), np.nan)
    grid[row, column] = output              # of several at one place the last stays
    return {
        'x': {'label': surface.x_label, 'range': x_range},
        'y': {'label': surface.y_label, 'range': y_range}, 'cells': CELLS,
        'values': [None if np.isnan(value) else round(float(value), 2)
                   for value in grid.ravel()],
        'now': [int(column[-1]), int(row[-1])]}


def _range(values: FloatArray, both_ways: bool) -> tuple[float, float]:
    """Return a range that holds nearly all values and changes in steps only."""
    low, high = np.quantile(values, [(1.0 - SHARE) / 2.0, (1.0 + SHARE) / 2.0])
    if both_ways:
        most = _step_up(max(abs(low), abs(high), LEAST_MM))
        return -most, most
    return min(0.0, -_step_up(-low) if low < -LEAST_MM else 0.0), _step_up(max(high, LEAST_MM))


def _step_up(value: float) -> float:
    """Return the next of 1, 1.5, 2, 3, 5, 7 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step * power for step in (1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0)
                      if step * power >= value * (1.0 - 1e-9)))


def _cells(values: FloatArray, limits: tuple[float, float]) -> IntArray:
    """Return the cell of each value; those outside count to the outermost."""
    low, high = limits
    cells = np.floor((values - low) / (high - low) * CELLS).astype(np.int64)
    return np.clip(cells, 0, CELLS - 1)
