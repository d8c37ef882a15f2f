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

"""Several runs in the same axes, each on the clock of its own experiment."""

from collections.abc import Callable
from typing import Any, TYPE_CHECKING

from pam_actuation.report import figures, signals
from pam_actuation.report.metrics import tracking_error
from pam_actuation.report.page import paragraph, plot, Section
from pam_sim.annotations import FloatArray
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_sim.run import Run

ROLES = ('measured', 'second', 'green', 'command', 'after')
MOST_POINTS = 1600           # of a trace
Read = Callable[..., tuple[FloatArray, FloatArray] | None]
_DASHES = (None, 'dash', 'dot')      # once the colours are used up


def overlaid(named: 'list[tuple[str, Run]]') -> Section | None:
    """
    Return the section that draws all runs into the same plots, None for a single run.

    Parameters
    ----------
    named : list of (title, pam_sim.run.Run)
        The runs; the reference is drawn from the first one.

    """
    if len(named) < 2:
        return None
    return together([
        ('contraction [mm]', lines(named, read_topic('contraction', 1e3))
         + _reference(named[0][1])),
        ('tracking error [mm]', lines(named, _error)),
        ('pressure [kPa gauge]', lines(named, read_topic('pressure', 1e-3, P_ATM_PA))),
        ('force [N]', lines(named, read_topic('force', 1.0)))])


def together(rows: list[tuple[str, list[dict[str, Any]]]]) -> Section | None:
    """Return the section of rows (axis, traces of all runs); None where all are empty."""
    rows = [(label, traces) for label, traces in rows if traces]
    if not rows:
        return None
    body = paragraph('Time counts from the first reference of each run, so runs of the same '
                     'experiment lie over each other.')
    return Section('overlaid', 'Runs laid over each other', body + plot(
        figures.stack(rows, 'time since the start of the experiment [s]'),
        'Drag to zoom, all rows follow; click a name to hide that run.'))


def lines(named: 'list[tuple[str, Run]]', read: Read) -> list[dict[str, Any]]:
    """Return a trace of each (title, run) for which ``read`` gives (time_s, value)."""
    traces = []
    for k, (title, run) in enumerate(named):
        pair = read(run)
        if pair is not None:
            time_s, value = pair
            traces.append(figures.line(
                time_s, value, title, ROLES[k % len(ROLES)], width=1.3, max_points=MOST_POINTS,
                dash=_DASHES[k // len(ROLES) % len(_DASHES)]))
    return traces


def read_topic(topic: str, factor: float, offset: float = 0.0, field: str | None = None) -> Read:
    """Return what reads (time_s, value) of a topic: its field less an offset, times a factor."""
    def read(run: 'Run') -> tuple[FloatArray, FloatArray] | None:
        pair = signals.series(run, topic, field)
        return None if pair is None else (pair[0], (pair[1] - offset) * factor)
    return read


def _error(run: 'Run') -> tuple[FloatArray, FloatArray] | None:
    tracked = tracking_error(run)
    return None if tracked is None else (tracked[0], tracked[1] * 1e3)


def _reference(run: 'Run') -> list[dict[str, Any]]:
    pair = signals.series(run, 'reference')
    return [] if pair is None else [figures.line(
        pair[0], pair[1] * 1e3, 'reference', 'reference', dash='dash', width=1.1,
        max_points=MOST_POINTS)]
