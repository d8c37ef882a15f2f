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

"""Signals over time: contraction, error, pressure, force and valve, zooming together."""

from typing import Any, TYPE_CHECKING

import numpy as np

from pam_actuation.report import figures, signals
from pam_actuation.report.metrics import force_error, tracking_error
from pam_actuation.report.page import plot, Section
from pam_sim.annotations import FloatArray
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_sim.run import Run


def time_plots(run: 'Run', key: str = 'signals', title: str = 'Signals over time',
               max_points: int = 2400) -> Section:
    """
    Return the section with all signals of one run.

    Rows whose topics are not in the run are left out.
    """
    rows = [row for row in (
        _contraction(run, max_points), _error(run, max_points), _pressure(run, max_points),
        _force(run, max_points), _valve(run, max_points)) if row]
    if not rows:
        return Section(key, title, '<p>This recording holds no signal of the rig.</p>')
    figure = figures.with_markers(
        figures.stack(rows, 'time since the start of the experiment [s]'), signals.markers(run))
    return Section(key, title, plot(
        figure, 'Drag to zoom, all rows follow; double click to go back.'))


def _mm(pair: tuple[FloatArray, FloatArray]) -> tuple[FloatArray, FloatArray]:
    return pair[0], pair[1] * 1e3


def _kpa(pair: tuple[FloatArray, FloatArray]) -> tuple[FloatArray, FloatArray]:
    return pair[0], (pair[1] - P_ATM_PA) * 1e-3


def _contraction(run: 'Run', points: int) -> tuple[str, list[dict[str, Any]]] | None:
    traces = []
    reference, measured = signals.series(run, 'reference'), signals.series(run, 'contraction')
    if measured is not None:
        traces.append(figures.line(*_mm(measured), 'contraction', 'measured',
                                   max_points=points))
    if reference is not None:
        traces.append(figures.line(*_mm(reference), 'reference', 'reference', dash='dash',
                                   width=1.3, max_points=points))
    return ('contraction [mm]', traces) if traces else None


def _error(run: 'Run', points: int) -> tuple[str, list[dict[str, Any]]] | None:
    tracked, pulled = tracking_error(run), force_error(run)
    if pulled is not None:
        time_s, error_n = pulled
        return 'force error [N]', [figures.line(
            time_s, error_n, 'reference − force', 'residual', width=1.1, max_points=points)]
    if tracked is None:
        return None
    time_s, error_mm = _mm(tracked)
    return 'tracking error [mm]', [figures.line(
        time_s, error_mm, 'reference − contraction', 'residual', width=1.1, max_points=points)]


def _pressure(run: 'Run', points: int) -> tuple[str, list[dict[str, Any]]] | None:
    traces = []
    for topic, name, role, dash in (('pressure', 'pressure', 'measured', None),
                                    ('pressure_command', 'command', 'command', 'dot')):
        pair = signals.series(run, topic)
        if pair is not None:
            traces.append(figures.line(*_kpa(pair), name, role, dash=dash, max_points=points))
    return ('pressure [kPa gauge]', traces) if traces else None


def _force(run: 'Run', points: int) -> tuple[str, list[dict[str, Any]]] | None:
    traces = []
    for topic, name, role, dash in (('force', 'load cell', 'measured', None),
                                    ('external_force', 'external force', 'second', None),
                                    ('reference', 'reference', 'reference', 'dash')):
        pair = signals.series(run, topic, 'force_n')
        if pair is not None:
            traces.append(figures.line(
                *pair, name, role, dash=dash, width=1.2, max_points=points))
    return ('force [N]', traces) if traces else None


def _valve(run: 'Run', points: int) -> tuple[str, list[dict[str, Any]]] | None:
    """Return what went to the valve, and what was asked for where signals were commanded."""
    volts = _both(run, 'ppr_voltage', 'voltage', 'green', 1.0, points)
    if volts:
        return 'valve voltage [V]', volts
    duties = (_both(run, 'fill_duty', 'fill', 'green', 1.0, points)
              + _both(run, 'vent_duty', 'vent', 'second', -1.0, points))
    return ('duty [–], vent downwards', duties) if duties else None


def _both(run: 'Run', field: str, name: str, role: str, sign: float,
          points: int) -> list[dict[str, Any]]:
    """Return the traces of one signal as sent and, if there are commands, as commanded."""
    traces = []
    for topic, title, colour, dash in (('valve_signal', name, role, None),
                                       ('valve_command', f'{name}, commanded', 'command', 'dot')):
        pair = signals.series(run, topic, field)
        if pair is not None:
            traces.append(figures.line(
                pair[0], sign * np.asarray(pair[1]), title, colour, held=True, dash=dash,
                width=1.2, max_points=points))
    return traces
