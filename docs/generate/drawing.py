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

"""How the figures of the explanation look, and how they are written: the same bytes each time."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure

BLUE, ORANGE, GREEN, RED, GREY = '#1f5fa8', '#d97706', '#15803d', '#b91c1c', '#6b7280'
PALETTE = ('#9ecae1', '#6baed6', '#4292c6', '#2171b5', '#08519c', '#08306b')
_STYLE = {
    'svg.hashsalt': 'pam_actuation', 'svg.fonttype': 'none', 'font.family': 'sans-serif',
    'font.sans-serif': ['DejaVu Sans', 'Arial', 'sans-serif'], 'font.size': 9.0,
    'axes.grid': True, 'grid.color': '#e5e7eb', 'grid.linewidth': 0.6, 'axes.axisbelow': True,
    'axes.spines.top': False, 'axes.spines.right': False, 'lines.linewidth': 1.4,
    'legend.frameon': False, 'legend.fontsize': 8.0, 'axes.titlesize': 9.5,
    'path.simplify_threshold': 0.3}


@contextmanager
def drawn(path: Path, columns: int = 1, height_in: float = 2.9, rows: int = 1,
          **options: Any) -> Iterator[Any]:
    """
    Yield the axes of a figure, and write it as SVG.

    Parameters
    ----------
    path : Path
        Target.
    columns, rows : int
        Axes beside and below each other.
    height_in : float
        Height in inches; the width is 7.2.
    **options
        For ``Figure.subplots``.

    """
    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=(7.2, height_in), layout='constrained')
        yield figure.subplots(rows, columns, **options)
        figure.savefig(path, metadata={'Date': None, 'Creator': None})
