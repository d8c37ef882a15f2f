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

"""What the gap depends on: binned maps as a second witness, residuals coloured by condition."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from pam_actuation.report import figures
from pam_actuation.report.page import paragraph, plot, table
from pam_actuation.report.sections.replay import SHOWN
from pam_sim.gap.report.fingerprint import CONDITIONS, conditions_of, MOTIONS

if TYPE_CHECKING:
    from pam_sim.annotations import FloatArray, IntArray
    from pam_sim.gap.result import GapResult, Trace

COLOURS = dict(zip(MOTIONS, ('simulated', 'residual', 'after')))
MOST_POINTS = 700            # of each colour


def witness_part(result: 'GapResult') -> str:
    """Return the table of what binned maps of the errors explain, before and after."""
    rows, closed = [], _closed(result)
    for subsystem, found in result.fingerprint.items():
        if subsystem in closed:
            continue
        factor, _, unit, _ = SHOWN[found['signal']]
        shares, left = found['explained'], found['explained_left']
        pair = max((n for n in shares if n not in (*CONDITIONS, 'constant')), key=shares.get)
        rest = '-' if found['rms_left'] is None else 'within the noise' if left is None else (
            f'{found["rms_left"] * factor:.3g} {unit}, {max(left, key=left.get)} '
            f'{100 * max(left.values()):.0f} %')
        rows.append([subsystem, f'{found["rms"] * factor:.3g} {unit}',
                     *(f'{100 * shares[n]:.0f} %' for n in ('constant', *CONDITIONS)),
                     f'{pair}: {100 * shares[pair]:.0f} %', rest])
    if not rows:
        return ''
    return '<h3>What the gap depends on</h3>' + table(
        ['subsystem', 'error', 'constant', *CONDITIONS, 'best pair', 'left by the final model'],
        rows) + paragraph(
        'A witness that knows no effect: errors of the calibrated model with all that was '
        'measured put in (pressure of the valve; balance of forces of muscle and load, while '
        'moving), averaged in bins of what was measured. Share of the squared errors beyond the '
        'noise that such a map explains on data it was not made from. Friction shows in '
        'direction, damping in rate, a wrong static map in pressure and contraction, what relaxes '
        'in the time since the last reversal.', 'note')


def _closed(result: 'GapResult') -> set[str]:
    """Return the subsystems that the page calls without a gap, where nothing is named."""
    if result.verdict != 'unknown':
        return set()
    found = {name for name, one in result.subsystems.items() if one.verdict == 'no_gap'}
    return found | ({'load'} if 'muscle' in found and 'load' not in result.subsystems else set())


def coloured_part(result: 'GapResult') -> str:
    """Return residuals of the proof over pressure and contraction, coloured by direction."""
    if not {'pressure', 'contraction'} <= set(_measured(result)):
        return ''
    body = '<h3>Residuals by condition</h3>'
    for abscissa in ('pressure', 'contraction'):
        unit, rows = SHOWN[abscissa][2], []
        for name, trace in result.traces.items():
            at, motion = _at(result, trace, name, abscissa)
            scale, _, own, _ = SHOWN[name]
            for text, model in (('calibrated', trace.refit), ('final', trace.after)):
                rows.append((f'{name} [{own}]<br>{text}', [
                    figures.points(at[motion == k], ((trace.measured - model) * scale)[
                        motion == k], label, COLOURS[label], MOST_POINTS)
                    for k, label in zip((-1, 0, 1), MOTIONS)], True))
        body += plot(figures.stack(rows, f'{abscissa} [{unit}]', row_px=120),
                     'Recorded minus simulated in free run, on the data of the proof.')
    return body


def _at(result: 'GapResult', trace: 'Trace', name: str, abscissa: str
        ) -> 'tuple[FloatArray, FloatArray]':
    """Return (abscissa as shown, -1, 0 or 1 by motion) at the stamps of a trace."""
    factor, offset, _, _ = SHOWN[abscissa]
    measured = _measured(result)
    recording = _Measured(measured)
    motion = conditions_of(recording, 'valve' if name == 'pressure' else 'muscle', (
        trace.stamp_ns - recording.start_ns) * 1e-9)['motion']
    value = np.interp(trace.stamp_ns, *measured[abscissa])
    return (value + offset) * factor, motion


def _measured(result: 'GapResult') -> 'dict[str, tuple[IntArray, FloatArray]]':
    """Return stamps [ns] and values of all measured signals."""
    return {s: (t.stamp_ns, t.measured) for s, t in result.traces.items()} | result.inputs


class _Measured:
    """What :func:`conditions_of` reads of a recording, from stamps [ns] and values by signal."""

    def __init__(self, signals: 'Mapping[str, tuple[IntArray, FloatArray]]') -> None:
        self.start_ns = min(int(stamp_ns[0]) for stamp_ns, _ in signals.values())
        self.time_s: Mapping[str, FloatArray] = {
            s: (stamp_ns - self.start_ns) * 1e-9 for s, (stamp_ns, _) in signals.items()}
        self.measured: Mapping[str, FloatArray] = {s: y for s, (_, y) in signals.items()}
        end = max(float(t[-1]) for t in self.time_s.values())
        self.grid_s = np.arange(0.0, end, 1e-3)
