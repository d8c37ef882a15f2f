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
Small still figures as SVG text: lines over two axes, surfaces over three, maps in colours.

The pages of this project draw with plotly. These figures are for documents, where a picture must
work without a script. matplotlib draws them; it is imported with the first figure, because that
takes a while.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
import io
import re
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_actuation.report.assets import COLOURS
from pam_sim.annotations import BoolArray, FloatArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIZE_IN = (7.5, 5.0)
MESHES = (32, 20)           # at most along a surface's rows and columns: files stay small
INK, SOFT, RULE = '#1c2126', '#5c6670', '#d9dee3'
DIVERGING = ('#2166ac', '#92c5de', '#f7f7f7', '#fdb863', '#b35806')    # as figures.DIVERGING
MOST_NUMBERS, MOST_LABELS = 60, 24
# On coloured cells, which keep their colours in a dark page; not INK and SOFT, which do not.
CELL_INK, CELL_SOFT = '#1b2025', '#5b6570'
# Text stays text; the fixed salt and the missing date make equal figures equal files.
STYLE = {
    'svg.fonttype': 'none', 'svg.hashsalt': 'pam_actuation', 'font.size': 10.0,
    'font.sans-serif': ['DejaVu Sans', 'sans-serif'], 'axes.labelcolor': INK,
    'axes.edgecolor': SOFT, 'xtick.color': SOFT, 'ytick.color': SOFT, 'axes.grid': True,
    'grid.color': RULE, 'axes.spines.top': False, 'axes.spines.right': False,
    'axes.axisbelow': True, 'legend.frameon': False}


@dataclass
class Curve:
    """
    A line with a name, and measured points with their half widths along x.

    ``x``, ``y`` are arrays of the line; ``points`` has rows (x, y, half width).
    """

    name: str
    x: FloatArray
    y: FloatArray
    points: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))


def line_chart(curves: Sequence[Curve], x_title: str, y_title: str, title: str,
               legend_share: float = 0.16) -> str:
    """
    Return the SVG text of curves over two axes, each named in a legend.

    Parameters
    ----------
    curves : list of Curve
        In the units of the axes; coloured along the scale in this order.
    x_title, y_title, title : str
        Axis titles with units; what the picture shows.
    legend_share : float
        Share of the width that the legend takes.

    """
    def draw(figure: 'Figure') -> None:
        from matplotlib import colormaps
        axes = figure.add_subplot(xlabel=x_title, ylabel=y_title)
        for k, curve in enumerate(curves):
            ink = colormaps['viridis'](0.92 * k / max(len(curves) - 1, 1))
            axes.plot(curve.x, curve.y, color=ink, label=curve.name, gid=f'curve_{k}')
            x, y, half = curve.points.T
            dots, _, (bars,) = axes.errorbar(x, y, xerr=half, fmt='o', markersize=3.0,
                                             elinewidth=1.0, color=ink)
            dots.set(gid=f'points_{k}', clip_on=False)
            bars.set_gid(f'bars_{k}')
        axes.set_xlim(_limits([curve.x for curve in curves], 1.04))
        axes.set_ylim(_limits([curve.y for curve in curves], 1.06))
        # The legend reads from the highest curve down.
        handles, names = axes.get_legend_handles_labels()
        axes.legend(handles[::-1], names[::-1], loc='upper left', bbox_to_anchor=(1.0, 1.0))
        figure.subplots_adjust(left=0.09, right=1.0 - legend_share, bottom=0.12, top=0.97)
    return _svg(draw, title)


def _limits(arrays: Sequence[FloatArray], room: float) -> tuple[float, float]:
    """Return the ends of an axis from zero over all values, with room beyond them."""
    lowest = min(float(np.min(array)) for array in arrays)
    highest = max(float(np.max(array)) for array in arrays)
    return room * min(lowest, 0.0), room * max(highest, 0.0) or 1.0


@dataclass
class HeatMap:
    """
    A named table of numbers to be coloured.

    ``values`` has shape (len(y_labels), len(x_labels)), the first row at the bottom;
    ``dotted``, of that shape, are the cells marked with a dot.
    """

    name: str
    x_labels: tuple[str, ...]
    y_labels: tuple[str, ...]
    values: FloatArray
    dotted: BoolArray


def heat_map_chart(maps: Sequence[HeatMap], titles: tuple[str, str, str], title: str) -> str:
    """
    Return the SVG text of maps side by side in one scale of colours, white at zero.

    Parameters
    ----------
    maps : list of HeatMap
        From left to right. Cells of small maps carry their number.
    titles : tuple of str
        Titles of x, y and the scale, with units.
    title : str
        What the picture shows.

    """
    def draw(figure: 'Figure') -> None:
        from matplotlib.colors import LinearSegmentedColormap
        figure.set_layout_engine('constrained')
        limit = max([float(np.max(np.abs(one.values))) for one in maps] + [1e-9])
        colours = LinearSegmentedColormap.from_list('signed', DIVERGING)
        row = figure.subplots(1, len(maps), squeeze=False)[0]
        for k, (axes, one) in enumerate(zip(row, maps)):
            image = axes.pcolormesh(one.values, cmap=colours, vmin=-limit, vmax=limit,
                                    edgecolors='white', linewidth=0.6)
            image.set_gid(f'map_{k}')
            axes.grid(False)
            axes.set(title=one.name, xlabel=titles[0], ylabel=titles[1] if k == 0 else '')
            for axis, labels in ((axes.xaxis, one.x_labels), (axes.yaxis, one.y_labels)):
                step = -(-len(labels) // MOST_LABELS)
                axis.set_ticks(np.arange(len(labels))[::step] + 0.5, labels[::step])
            axes.tick_params(axis='y', labelleft=k == 0)
            axes.tick_params(axis='x', labelrotation=90)
            for i, j in np.argwhere(one.dotted):
                axes.plot(j + 0.85, i + 0.85, '.', color=CELL_SOFT, markersize=2.0)
            if one.values.size <= MOST_NUMBERS:
                for (i, j), value in np.ndenumerate(one.values):
                    dark = abs(value) > 0.75 * limit
                    axes.text(j + 0.5, i + 0.5, f'{round(value, 1) + 0.0:.1f}', fontsize=7.0,
                              ha='center', va='center', color='white' if dark else CELL_INK)
        figure.colorbar(image, ax=list(row), label=titles[2], fraction=0.05, pad=0.02)
    return _svg(draw, title, (5.0 * len(maps), 4.6))


def surface_chart(x: FloatArray, y: FloatArray, z: FloatArray, titles: tuple[str, str, str],
                  title: str, turn_deg: float = -125.0, tilt_deg: float = 24.0) -> str:
    """
    Return the SVG text of a surface over three axes, coloured by height.

    Parameters
    ----------
    x, y, z : ndarray, shape (M, N)
        Corners of the surface's meshes, in the units of the axes; of a fine grid
        (see ``MESHES``) only every second, third, … line is drawn.
    titles : tuple of str
        Titles of x, y and z with units.
    title : str
        What the picture shows.
    turn_deg, tilt_deg : float
        Where the eye stands: about the upright axis, and above the floor.

    """
    def draw(figure: 'Figure') -> None:
        # An Axes3D, as the projection says.
        axes: Any = figure.add_axes((0.0, 0.03, 1.0, 1.0), projection='3d', azim=turn_deg,
                                    elev=tilt_deg, proj_type='ortho')
        axes.set_box_aspect((4.0, 4.0, 3.0), zoom=1.0)
        surface = axes.plot_surface(x, y, z, rcount=MESHES[0], ccount=MESHES[1], cmap='viridis',
                                    edgecolor=(0.0, 0.0, 0.0, 0.3), linewidth=0.3)
        surface.set_gid('surface')
        for name, values, words in zip('xyz', (x, y, z), titles):
            low, high = np.nanmin(values), np.nanmax(values)
            limits = (min(low, 0.0) if low < 0.25 * high else low, high)
            axes.set(**{f'{name}lim': limits, f'{name}label': words})
            axis = getattr(axes, f'{name}axis')
            axis.labelpad = 8.0
            axis.set_pane_color((1.0, 1.0, 1.0))
    return _svg(draw, title)


def in_page(picture: str) -> str:
    """
    Return a figure of this module as an element of a page, in the colours of the page.

    Without the white ground; ink, grid and edges are the variables of the style sheet, and
    lines become lighter on a dark page. The style of the file would reach the whole page: it
    becomes that of the element.
    """
    picture = picture[picture.index('<svg'):]
    picture = re.sub(r'<defs>\s*<style type="text/css">[^<]*</style>\s*</defs>', '', picture,
                     count=1)
    picture = picture.replace('<svg ', '<svg style="stroke-linejoin: round; stroke-linecap: butt; '
                              'fill: var(--text)" ', 1)
    picture = re.sub(r'(<path[^>]*style="[^"]*)fill: #ffffff', r'\1fill: none', picture)
    for fixed, variable in ((INK, 'text'), (SOFT, 'soft'), (RULE, 'rule')):
        picture = picture.replace(fixed, f'var(--{variable})')
    picture = picture.replace('stroke: #ffffff', 'stroke: var(--card)')
    return re.sub(
        r'stroke: (#(?!000000)[0-9a-f]{6})',
        r'stroke: \1; stroke: color-mix(in srgb, \1 var(--pure), white)', picture)


def as_image(picture: str) -> str:
    """
    Return a figure of this module as a file that is an image in a page.

    It has the colours of the page and follows it into the dark; ids and styles stay inside.
    """
    picture = in_page(picture)
    end = picture.index('>') + 1
    return f'{picture[:end]}<style>{COLOURS}</style>{picture[end:]}'


def _svg(draw: 'Callable[[Figure], None]', title: str,
         size_in: tuple[float, float] = SIZE_IN) -> str:
    """Return what a function draws on an empty figure as SVG text."""
    from matplotlib import style
    from matplotlib.figure import Figure
    # The defaults come first: the reader's own settings do not reach the file.
    with style.context(['default', STYLE]):
        figure = Figure(size_in)
        draw(figure)
        stream = io.StringIO()
        figure.savefig(stream, format='svg', metadata={'Date': None, 'Title': title})
    return stream.getvalue()
