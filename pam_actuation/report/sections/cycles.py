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

"""Tracking error cycle by cycle, runs side by side."""

from typing import TYPE_CHECKING

from pam_actuation.report import figures
from pam_actuation.report.errors import by_part
from pam_actuation.report.page import paragraph, plot, Section

if TYPE_CHECKING:
    from pam_actuation.report.errors import Cycles
    from pam_actuation.report.metrics import RunMetrics
    from pam_sim.annotations import FloatArray

ROLES = ('after', 'frozen', 'second', 'green', 'command')


def cycles(named: 'list[tuple[str, RunMetrics]]', key: str = 'cycles',
           remark: str = '') -> Section | None:
    """
    Return the bar chart of the RMSE of every cycle, or None if no run has cycles.

    Parameters
    ----------
    named : list of (title, RunMetrics)
        Runs of the same experiment, for example with learning and frozen.
    key, remark : str
        Anchor, and a sentence above the chart.

    """
    return cycle_chart([(name, m.cycle_rmse_m * 1e3, m.cycle_parts) for name, m in named], 'mm',
                       key, remark)


def cycle_chart(named: 'list[tuple[str, FloatArray, tuple[Cycles, ...]]]', unit: str,
                key: str = 'cycles', remark: str = '') -> Section | None:
    """
    Return the bar chart of errors per cycle, or None if no run has cycles.

    Parameters
    ----------
    named : list of (title, ndarray, tuple of Cycles)
        The RMSE of every cycle of a run, and the parts of the experiment they belong to.
    unit : str
        Of the RMSE.
    key, remark : str
        As of ``cycles``.

    """
    tracked = [one for one in named if len(one[1])]
    if not tracked:
        return None
    _, longest, parts = max(tracked, key=lambda one: len(one[1]))
    frequencies = [hz for hz, values in by_part(longest, parts) for _ in values]
    labels = [f'{k} ({hz})' if hz else str(k) for k, hz in enumerate(frequencies, 1)]
    groups = [(name, values, ROLES[k % len(ROLES)])
              for k, (name, values, _) in enumerate(tracked)]
    figure = figures.bars(labels, groups, 'cycle', f'tracking RMSE [{unit}]')
    body = (paragraph(remark) if remark else '') + plot(figure)
    return Section(key, 'Tracking error per cycle', body)
