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
Figures as plain plotly dictionaries: axes with units, colours by role, light arrays.

A colour is written ``@role`` and becomes a real one in the page, so that the
same figure fits the light and the dark page. The roles keep one meaning all
over a page and come from the Okabe-Ito palette, which colour-blind readers can
tell apart.
"""

from collections.abc import Iterable, Sequence
import html
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pam_actuation.report.decimate import decimate_min_max, decimate_steps
from pam_sim.annotations import FloatArray

ROW_PX = 210                 # height of one row of a stack of plots
LEGEND_PX = 30               # room above a row for its legend
BOTTOM_PX = 52
BINS = 80                    # of a histogram
# Contracting / extending rules and other signed maps: one scale, white at zero.
DIVERGING = [[0.0, '#2166ac'], [0.25, '#92c5de'], [0.5, '#f7f7f7'], [0.75, '#fdb863'],
             [1.0, '#b35806']]


Trace = dict[str, Any]      # of plotly
# Title of an axis, traces; True as third: spikes are cut off.
Row = tuple[str, list[Trace]] | tuple[str, list[Trace], bool]


def rounded(values: ArrayLike, digits: int = 5) -> list[int | float | None]:
    """Return a list of floats with so many significant digits; NaN and infinity become None."""
    numbers = np.asarray(values, dtype=float).ravel().tolist()
    # One text for all of them costs half as much as one text each.
    texts = f'%.{digits}g ' * len(numbers) % tuple(numbers)
    return [None if not math.isfinite(value) else int(value)
            if abs(value) < 1e15 and value.is_integer() else value
            for value in map(float, texts.split())]


def line(x: ArrayLike, y: ArrayLike, name: str, role: str, held: bool = False,
         dash: str | None = None, width: float = 1.6, max_points: int = 2400) -> dict[str, Any]:
    """
    Return one line trace, thinned without losing extremes.

    Parameters
    ----------
    x, y : array_like
        Abscissa and value in the units of the axes.
    name, role : str
        Legend text and colour role.
    held : bool
        Draw as steps (zero order hold).
    dash : str, optional
        Plotly dash style.
    width : float
        Line width [px].
    max_points : int
        Most points kept.

    """
    kept_x, kept_y = (decimate_steps if held else decimate_min_max)(x, y, max_points)
    style: dict[str, Any] = {'color': f'@{role}', 'width': width}
    if held:
        style['shape'] = 'hv'
    if dash:
        style['dash'] = dash
    return {'type': 'scatter', 'mode': 'lines', 'name': name, 'line': style,
            'x': rounded(kept_x, 7), 'y': rounded(kept_y)}


def points(x: Sequence[float] | FloatArray, y: Sequence[float] | FloatArray, name: str,
           role: str, max_points: int = 700) -> Trace:
    """Return one trace of points, every so-manieth kept; arguments as of :func:`line`."""
    every = max(int(math.ceil(len(x) / max_points)), 1)
    return {'type': 'scatter', 'mode': 'markers', 'name': name,
            'marker': {'color': f'@{role}', 'size': 3, 'opacity': 0.6},
            'x': rounded(x[::every]), 'y': rounded(y[::every])}


def spikes_aside(traces: list[dict[str, Any]]) -> tuple[float, float, str] | None:
    """
    Return (low, high, text) of an axis that short spikes do not stretch, None where none do.

    The axis holds the middle nine tenths of all values with room beyond them. ``text`` says
    which values lie outside, for the reader.
    """
    values = np.array([v for one in traces for v in one['y'] if v is not None], dtype=float)
    if values.size < 20:
        return None
    low, high = np.percentile(values, [5.0, 95.0])
    room = 0.75 * (high - low)
    low, high = low - room, high + room
    outside = [end for end, beyond in ((values.min(), values.min() < low - room),
                                       (values.max(), values.max() > high + room)) if beyond]
    if not outside or not room > 0.0:
        return None
    return float(low), float(high), 'spikes to {} are cut off; a double click shows them'.format(
        ' and '.join(f'{end:.3g}' for end in outside))


def stack(
        rows: Sequence[Row],
        x_title: str, row_px: int = ROW_PX) -> dict[str, Any]:
    """
    Return a figure of plots one below the other whose x axes zoom together.

    Parameters
    ----------
    rows : list of (y_title, traces) or (y_title, traces, True)
        From top to bottom. Each row has its own legend in its own strip above the
        plot, so that legends never cover data. With True, short spikes do not stretch the
        axis, and the plot says so.
    x_title : str
        Title of the common x axis.
    row_px : int
        Height of a row.

    """
    n = len(rows)
    inner = n * (row_px + LEGEND_PX)
    height = inner + BOTTOM_PX
    layout: dict[str, Any] = {
        'height': height, 'margin': {'l': 78, 'r': 14, 't': 4, 'b': BOTTOM_PX}, 'hovermode': 'x'}
    data: list[Trace] = []
    for k, row in enumerate(rows):
        title, traces = row[0], row[1]
        suffix = '' if k == 0 else str(k + 1)
        top = 1.0 - (k * (row_px + LEGEND_PX) + LEGEND_PX) / inner
        bottom = max(top - row_px / inner, 0.0)
        # A free axis needs an anchor of its own; matches='x' links the zoom.
        layout['xaxis' + suffix] = {
            'anchor': 'y' + suffix, 'showticklabels': k == n - 1,
            'title': {'text': x_title} if k == n - 1 else None}
        if k:
            layout['xaxis' + suffix]['matches'] = 'x'
        layout['yaxis' + suffix] = {'domain': [bottom, top], 'title': {'text': title},
                                    'anchor': 'x' + suffix}
        limits = spikes_aside(traces) if len(row) == 3 and row[2] else None
        if limits is not None:
            layout['yaxis' + suffix]['range'] = rounded(limits[:2])
            layout.setdefault('annotations', []).append({
                'text': limits[2], 'x': 1.0, 'xref': 'paper', 'xanchor': 'right', 'y': top,
                'yref': 'paper', 'yanchor': 'top', 'showarrow': False, 'font': {'size': 11}})
        legend = 'legend' + suffix
        layout[legend] = {'orientation': 'h', 'x': 0, 'xanchor': 'left', 'y': top,
                          'yanchor': 'bottom'}
        for trace in traces:
            data.append(dict(trace, xaxis='x' + suffix, yaxis='y' + suffix, legend=legend,
                             showlegend=len(traces) > 1))
    return {'data': data, 'layout': layout}


def with_markers(figure: dict[str, Any], markers: Sequence[tuple[float, str]]) -> dict[str, Any]:
    """
    Return a figure of :func:`stack` with a vertical line and a text at each marker.

    Parameters
    ----------
    figure : dict
        Changed in place.
    markers : list of (time_s, text)
        On the x axis of the stack.

    """
    if not markers:
        return figure
    layout = figure['layout']
    layout['shapes'] = [
        {'type': 'line', 'xref': 'x', 'yref': 'paper', 'x0': round(time_s, 4),
         'x1': round(time_s, 4), 'y0': 0, 'y1': 1,
         'line': {'color': '@residual', 'width': 1, 'dash': 'dot'}} for time_s, _ in markers]
    layout['annotations'] = [*layout.get('annotations', []), *(
        {'text': html.escape(text), 'x': round(time_s, 4), 'xref': 'x', 'xanchor': 'left',
         'y': 1.0, 'yref': 'paper', 'yanchor': 'top', 'showarrow': False, 'font': {'size': 11}}
        for time_s, text in markers)]
    return figure


def bars(categories: Iterable[object],
         groups: Sequence[tuple[str, ArrayLike, str]], x_title: str,
         y_title: str) -> dict[str, Any]:
    """
    Return a grouped bar chart.

    Parameters
    ----------
    categories : list
        Labels on the x axis.
    groups : list of (name, values, role)
        One bar per category and group.
    x_title, y_title : str
        Axis titles with units.

    """
    data = [{'type': 'bar', 'name': name, 'x': list(categories), 'y': rounded(values),
             'marker': {'color': f'@{role}'}, 'showlegend': len(groups) > 1}
            for name, values, role in groups]
    return {'data': data, 'layout': {
        'height': 300, 'barmode': 'group', 'bargap': 0.25, 'hovermode': 'x',
        'margin': {'l': 78, 'r': 14, 't': 34, 'b': BOTTOM_PX},
        'legend': {'orientation': 'h', 'x': 0, 'y': 1.02, 'yanchor': 'bottom'},
        'xaxis': {'title': {'text': x_title}, 'type': 'category', 'automargin': True},
        'yaxis': {'title': {'text': y_title}, 'rangemode': 'tozero'}}}


def histogram(groups: list[tuple[str, FloatArray, str]], x_title: str, y_title: str
              ) -> dict[str, Any]:
    """
    Return histograms over one common set of bins, counted here to keep the page light.

    The bins lie between the 0.1 % and 99.9 % quantiles; the rest goes into the outer ones.

    Parameters
    ----------
    groups : list of (name, values, role)
        Samples in the unit of the x axis.
    x_title, y_title : str
        Axis titles with units.

    """
    everything = np.concatenate([np.asarray(v, dtype=float) for _, v, _ in groups])
    low, high = np.percentile(everything, [0.1, 99.9])
    if high <= low:
        low, high = low - 0.5 * abs(low) - 1e-9, high + 0.5 * abs(high) + 1e-9
    edges = np.linspace(low, high, BINS + 1)
    centre = 0.5 * (edges[1:] + edges[:-1])
    data = []
    for name, values, role in groups:
        count, _ = np.histogram(np.clip(values, low, high), edges)
        data.append({'type': 'scatter', 'mode': 'lines', 'name': name, 'x': rounded(centre),
                     'y': rounded(count), 'fill': 'tozeroy', 'fillcolor': f'@{role}+fill',
                     'line': {'color': f'@{role}', 'shape': 'hvh', 'width': 1.4},
                     'showlegend': len(groups) > 1})
    return {'data': data, 'layout': {
        'height': 280, 'margin': {'l': 78, 'r': 14, 't': 34, 'b': BOTTOM_PX},
        'legend': {'orientation': 'h', 'x': 0, 'y': 1.02, 'yanchor': 'bottom'},
        'xaxis': {'title': {'text': x_title}},
        'yaxis': {'title': {'text': y_title}, 'rangemode': 'tozero'}}}


def heat_maps(maps: list[tuple[str, FloatArray, FloatArray, FloatArray]], x_title: str,
              y_title: str, z_title: str, limit: float) -> dict[str, Any]:
    """
    Return heat maps in one row with one colour scale, symmetric about zero.

    Parameters
    ----------
    maps : list of (title, x, y, z)
        ``z`` has shape (len(y), len(x)).
    x_title, y_title, z_title : str
        Titles with units; ``z_title`` stands at the colour bar.
    limit : float
        The scale runs from -limit to limit in every map.

    """
    n = len(maps)
    gap = 0.05 if n > 2 else 0.09
    width = (1.0 - gap * (n - 1)) / n
    layout: dict[str, Any] = {
        'height': 340, 'margin': {'l': 62, 'r': 10, 't': 34, 'b': BOTTOM_PX},
        'annotations': []}
    data = []
    for k, (title, x, y, z) in enumerate(maps):
        suffix = '' if k == 0 else str(k + 1)
        left = k * (width + gap)
        data.append({
            'type': 'heatmap', 'x': rounded(x, 4), 'y': rounded(y, 4),
            'z': [rounded(row, 3) for row in np.asarray(z)], 'zmin': -limit, 'zmax': limit,
            'colorscale': DIVERGING, 'showscale': k == n - 1, 'xgap': 1, 'ygap': 1,
            'xaxis': 'x' + suffix, 'yaxis': 'y' + suffix,
            'hovertemplate': '%{y} / %{x}: %{z}<extra></extra>',
            'colorbar': {'title': {'text': z_title, 'side': 'right'}, 'thickness': 12}})
        layout['xaxis' + suffix] = {'domain': [left, left + width], 'anchor': 'y' + suffix,
                                    'title': {'text': x_title}, 'showgrid': False}
        layout['yaxis' + suffix] = {'anchor': 'x' + suffix, 'showgrid': False,
                                    'title': {'text': y_title} if k == 0 else None}
        layout['annotations'].append({
            'text': title, 'x': left + 0.5 * width, 'y': 1.0, 'xref': 'paper',
            'yref': 'paper', 'xanchor': 'center', 'yanchor': 'bottom', 'showarrow': False})
    return {'data': data, 'layout': layout}
