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

"""How regular the loops ran."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pam_actuation.report import figures, signals
from pam_actuation.report.page import paragraph, plot, Section, table

if TYPE_CHECKING:
    from pam_actuation.report.joint_page import JointMetrics
    from pam_actuation.report.metrics import RunMetrics
    from pam_sim.run import Run

PLOTTED = (('pressure_command', 'controller', 'after'), ('valve_signal', 'driver', 'second'))


def timing(named: 'Sequence[tuple[str, Run, RunMetrics | JointMetrics]]',
           key: str = 'timing') -> Section:
    """
    Return the table of periods of every topic and the histogram of the loops.

    Parameters
    ----------
    named : list of (title, Run, RunMetrics)
        The runs; the histogram shows the first one.
    key : str
        Anchor.

    """
    rows = []
    for name, _, m in named:
        for t in m.timing:
            rows.append([f'{name}: {t.topic}' if len(named) > 1 else t.topic, t.count,
                         _rate(t.mean_s), f'{t.median_s * 1e3:.3f} ms',
                         f'{t.jitter_s * 1e3:.3f} ms', f'{t.p99_s * 1e3:.3f} ms',
                         f'{t.max_s * 1e3:.2f} ms', f'{100 * t.late_share:.2f} %'])
    body = paragraph(
        'Periods between header stamps. Jitter is the standard deviation of the period; late '
        'means longer than 1.5 periods.')
    body += table(['topic', 'messages', 'rate', 'median period', 'jitter', '99 %', 'longest',
                   'late'], rows)
    groups = []
    for topic, label, role in PLOTTED:
        stamps = signals.stamps_s(named[0][1], topic)
        if stamps is not None and stamps.size > 2:
            groups.append((label, np.diff(stamps) * 1e3, role))
    if groups:
        body += plot(figures.histogram(groups, 'period [ms]', 'count'),
                     f'Periods of the loops, {named[0][0]}; the outer 0.1 % are drawn in the '
                     'outermost bins.')
    return Section(key, 'Loop timing', body)


def _rate(period_s: float) -> str | None:
    """Return the rate of a mean period, None where the stamps of a topic never change."""
    return f'{1.0 / period_s:.1f} Hz' if period_s > 0.0 else None
