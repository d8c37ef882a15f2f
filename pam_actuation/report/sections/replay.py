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

"""Simulated against recorded, and the bit-exact replay of the controller."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pam_actuation.report import figures
from pam_actuation.report.errors import rmse
from pam_actuation.report.page import paragraph, plot, Section, table
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_actuation.replay.controller import ReplayResult

# SI to what people read: factor, offset, unit, row title.
SHOWN = {'pressure': (1e-3, -P_ATM_PA, 'kPa', 'pressure [kPa gauge]'),
         'pressure_command': (1e-3, -P_ATM_PA, 'kPa', 'command [kPa gauge]'),
         'contraction': (1e3, 0.0, 'mm', 'contraction [mm]'),
         'force': (1.0, 0.0, 'N', 'force [N]')}


@dataclass(frozen=True)
class Overlay:
    """One signal recorded and simulated at the same instants, SI units."""

    signal: str
    time_s: np.ndarray
    recorded: np.ndarray
    simulated: np.ndarray


def overlays(signals: list[Overlay], key: str, remark: str, max_points: int) -> Section:
    """
    Return the section that lays simulated signals over recorded ones, with residuals.

    Parameters
    ----------
    signals : list of Overlay
        Signals named as topics.
    key, remark : str
        Anchor, and a sentence above.
    max_points : int
        Most points per trace.

    """
    rows: list[figures.Row] = []
    facts = []
    for one in signals:
        factor, offset, unit, label = SHOWN.get(one.signal, (1.0, 0.0, '', one.signal))
        recorded = (one.recorded + offset) * factor
        simulated = (one.simulated + offset) * factor
        residual = recorded - simulated
        rows.append((label, [
            figures.line(one.time_s, recorded, 'recorded', 'measured', max_points=max_points),
            figures.line(one.time_s, simulated, 'simulated', 'simulated', dash='dash',
                         width=1.3, max_points=max_points)]))
        rows.append((f'residual [{unit}]', [figures.line(
            one.time_s, residual, 'recorded − simulated', 'residual', width=1.0,
            max_points=max_points)], True))
        spread = float(np.max(recorded) - np.min(recorded))
        facts.append([one.signal, f'{rmse(residual):.4g} {unit}',
                      f'{np.max(np.abs(residual)):.4g} {unit}', f'{spread:.4g} {unit}'])
    body = paragraph(remark) + table(
        ['signal', 'RMS difference', 'largest difference', 'range recorded'], facts)
    return Section(key, 'Simulated against recorded', body + plot(
        figures.stack(rows, 'time since the start of the experiment [s]', row_px=170)))


def controller_replays(named: 'list[tuple[str, ReplayResult]]', key: str) -> Section:
    """
    Return the table of controller replays.

    Parameters
    ----------
    named : list of (title, result)
        ``result`` has ``identical``, ``max_abs_difference_pa`` and ``recorded_pa``.
    key : str
        Anchor.

    """
    rows = [[name, len(r.recorded_pa), 'yes' if r.identical else 'no',
             f'{r.max_abs_difference_pa:.3g} Pa'] for name, r in named]
    body = paragraph(
        'The same controller class was stepped on the recorded inputs, tick by tick. Equal '
        'to the bit means that the recording explains the commands completely.')
    body += table(['run', 'ticks', 'commands equal to the bit', 'largest difference'], rows)
    return Section(key, 'Controller replayed offline', body)
