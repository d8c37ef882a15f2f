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
Small still figures as SVG text: lines over two axes, surfaces over three.

The pages of this project draw with plotly; these are for documents, where a
picture must stand by itself, without a script.
"""

from dataclasses import dataclass, field
import html

import numpy as np

WIDTH, HEIGHT = 720, 480
LEFT, RIGHT, TOP, BOTTOM = 84, 40, 16, 62       # room for numbers around a box
INK, SOFT, RULE, PAPER = '#1c2126', '#5c6670', '#d9dee3', '#ffffff'
# Viridis at nine equal steps: even in brightness, readable in grey and for the colour-blind.
SCALE = np.array([[68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141],
                  [39, 173, 129], [92, 200, 99], [170, 220, 50], [253, 231, 37]], dtype=float)


def colour(share):
    """Return the colour of a share from 0 to 1 on the scale, as ``#rrggbb``."""
    place = np.clip(share, 0.0, 1.0) * (len(SCALE) - 1)
    return '#' + ''.join(
        f'{int(round(np.interp(place, np.arange(len(SCALE)), part))):02x}' for part in SCALE.T)


def ticks(low, high, about=6):
    """Return round numbers from ``low`` to ``high``, about so many."""
    raw = (high - low) / max(about, 1)
    size = 10.0 ** np.floor(np.log10(raw))
    step = size * min((1.0, 2.0, 2.5, 5.0, 10.0), key=lambda k: abs(k * size - raw))
    first = np.ceil(low / step - 1e-9)
    return step * np.arange(first, np.floor(high / step + 1e-9) + 1) + 0.0


class Canvas:
    """Shapes of one SVG picture, in pixels from the top left corner."""

    def __init__(self, width=WIDTH, height=HEIGHT, title=''):
        self.width, self.height, self.title = width, height, title
        self.shapes = [f'<rect width="{width}" height="{height}" fill="{PAPER}"/>']

    def line(self, points, stroke=INK, width=1.0, dash=''):
        """Draw a line through points, shape (N, 2)."""
        pairs = ' '.join(f'{x:.1f},{y:.1f}' for x, y in points)
        dashes = f' stroke-dasharray="{dash}"' if dash else ''
        self.shapes.append(f'<polyline points="{pairs}" fill="none" stroke="{stroke}" '
                           f'stroke-width="{width:g}" stroke-linejoin="round"{dashes}/>')

    def area(self, points, fill, stroke='none', width=0.6):
        """Fill a polygon, shape (N, 2)."""
        pairs = ' '.join(f'{x:.1f},{y:.1f}' for x, y in points)
        self.shapes.append(f'<polygon points="{pairs}" fill="{fill}" stroke="{stroke}" '
                           f'stroke-width="{width:g}" stroke-linejoin="round"/>')

    def dot(self, x, y, fill, radius=2.4):
        """Draw a dot."""
        self.shapes.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:g}" fill="{fill}"/>')

    def text(self, x, y, words, anchor='middle', size=13, fill=INK, turn=0):
        """Write words at a point; ``turn`` in degrees clockwise."""
        turned = f' transform="rotate({turn} {x:.1f} {y:.1f})"' if turn else ''
        self.shapes.append(
            f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size:g}" '
            f'fill="{fill}"{turned}>{html.escape(str(words))}</text>')

    def to_svg(self):
        """Return the picture as SVG text."""
        body = '\n'.join(self.shapes)
        return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width} '
                f'{self.height}" width="{self.width}" height="{self.height}" role="img" '
                f'font-family="system-ui, Segoe UI, Roboto, Noto Sans, DejaVu Sans, sans-serif">'
                f'\n<title>{html.escape(self.title)}</title>\n{body}\n</svg>\n')


@dataclass
class Curve:
    """
    A line with a name, and measured points with their half widths along x.

    ``x``, ``y`` are arrays of the line; ``points`` has rows (x, y, half width).
    """

    name: str
    x: np.ndarray
    y: np.ndarray
    points: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))


def line_chart(curves, x_title, y_title, title):
    """
    Return the SVG text of curves over two axes, each named in a legend.

    Parameters
    ----------
    curves : list of Curve
        In the units of the axes; coloured along the scale in this order.
    x_title, y_title, title : str
        Axis titles with units; what the picture shows.

    """
    canvas = Canvas(title=title)
    left, right, top, bottom = 70, WIDTH - 130, 24, HEIGHT - 60
    x_high = max(float(np.max(curve.x)) for curve in curves) * 1.04
    y_high = max(float(np.max(curve.y)) for curve in curves) * 1.06

    def place(x, y):
        return np.stack([left + (right - left) * np.asarray(x) / x_high,
                         bottom - (bottom - top) * np.asarray(y) / y_high], axis=-1)

    for value in ticks(0.0, x_high, 8):
        x = place(value, 0.0)[0]
        canvas.line([(x, top), (x, bottom)], RULE)
        canvas.text(x, bottom + 18, f'{value:g}', fill=SOFT)
    for value in ticks(0.0, y_high, 8):
        y = place(0.0, value)[1]
        canvas.line([(left, y), (right, y)], RULE)
        canvas.text(left - 8, y + 4, f'{value:g}', 'end', fill=SOFT)
    canvas.line([(left, top), (left, bottom), (right, bottom)], SOFT)
    canvas.text(0.5 * (left + right), HEIGHT - 16, x_title)
    canvas.text(20, 0.5 * (top + bottom), y_title, turn=-90)
    for k, curve in enumerate(curves):
        ink = colour(0.92 * k / max(len(curves) - 1, 1))
        canvas.line(place(curve.x, curve.y), ink, 1.8)
        for x, y, half in curve.points:
            canvas.line(place(np.clip([x - half, x + half], 0.0, x_high), [y, y]), ink, 1.0)
            canvas.dot(*place(x, y), ink)
        # The legend reads from the highest curve down.
        at = top + 14 + 20 * (len(curves) - 1 - k)
        canvas.line([(right + 14, at - 4), (right + 36, at - 4)], ink, 2.4)
        canvas.text(right + 42, at, curve.name, 'start')
    return canvas.to_svg()


def surface_chart(x, y, z, titles, title, turn_deg=-125.0, tilt_deg=24.0):
    """
    Return the SVG text of a surface over three axes.

    Parameters
    ----------
    x, y, z : ndarray, shape (M, N)
        Corners of the surface's meshes, in the units of the axes.
    titles : tuple of str
        Titles of x, y and z with units.
    title : str
        What the picture shows.
    turn_deg, tilt_deg : float
        Where the eye stands: about the upright axis, and above the floor.

    """
    view = _View([x, y, z], np.radians(turn_deg), np.radians(tilt_deg))
    canvas = Canvas(title=title)
    view.draw_walls(canvas)
    x, y, z = np.broadcast_arrays(x, y, z)
    corners = np.stack([x, y, z], axis=-1)
    quads = np.stack([corners[:-1, :-1], corners[1:, :-1], corners[1:, 1:], corners[:-1, 1:]],
                     axis=-2).reshape(-1, 4, 3)
    quads = quads[np.all(np.isfinite(quads), axis=(1, 2))]
    flat, depth = view.place(quads)
    share = view.share(quads)[..., 2].mean(axis=1)
    for k in np.argsort(depth.mean(axis=1)):
        canvas.area(flat[k], colour(share[k]), '#00000055', 0.4)
    view.draw_axes(canvas, titles)
    return canvas.to_svg()


class _View:
    """An eye far away: places points of a box on the picture and draws the box."""

    def __init__(self, axes, turn, tilt):
        self.low = np.array([np.nanmin(axis) for axis in axes])
        self.high = np.array([np.nanmax(axis) for axis in axes])
        self.low = np.where(self.low < 0.25 * self.high, np.minimum(self.low, 0.0), self.low)
        self.turn, self.tilt = turn, tilt
        # The walls stand on the side away from the eye.
        self.far = (float(np.cos(turn) < 0.0), float(np.sin(turn) < 0.0))
        self.shift, self.scale = np.zeros(2), 1.0
        box = self.place_share([(a, b, c) for a in (0, 1) for b in (0, 1) for c in (0, 1)])[0]
        room = np.array([WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM])
        size = np.ptp(box, axis=0)
        self.scale = float(np.min(room / size))
        self.shift = (np.array([LEFT, TOP]) + 0.5 * (room - self.scale * size)
                      - self.scale * box.min(axis=0))

    def share(self, points):
        """Return points as shares of the box, 0 to 1."""
        return (np.asarray(points, dtype=float) - self.low) / (self.high - self.low)

    def place(self, points):
        """Return (picture points, depth), depth growing towards the eye."""
        return self.place_share(self.share(points))

    def place_share(self, share):
        """Return (picture points, depth) of shares of the box."""
        u, v, w = np.moveaxis(np.asarray(share, dtype=float) - 0.5, -1, 0)
        along = u * np.cos(self.turn) + v * np.sin(self.turn)
        across = -u * np.sin(self.turn) + v * np.cos(self.turn)
        upright = 0.75 * w * np.cos(self.tilt) - along * np.sin(self.tilt)
        depth = along * np.cos(self.tilt) + 0.75 * w * np.sin(self.tilt)
        return self.shift + self.scale * np.stack([across, -upright], axis=-1), depth

    def _line(self, canvas, a, b, ink, width=1.0):
        canvas.line(self.place_share(np.array([a, b]))[0], ink, width)

    def draw_walls(self, canvas):
        """Draw floor and back walls with their grids."""
        far_x, far_y = self.far
        back_x, back_y = far_x, far_y
        for axis in range(3):
            for value in self._ticks(axis):
                if axis == 0:
                    self._line(canvas, (value, 0, 0), (value, 1, 0), RULE)
                    self._line(canvas, (value, back_y, 0), (value, back_y, 1), RULE)
                elif axis == 1:
                    self._line(canvas, (0, value, 0), (1, value, 0), RULE)
                    self._line(canvas, (back_x, value, 0), (back_x, value, 1), RULE)
                else:
                    self._line(canvas, (0, back_y, value), (1, back_y, value), RULE)
                    self._line(canvas, (back_x, 0, value), (back_x, 1, value), RULE)
        for a, b in (((back_x, 0, 0), (back_x, 1, 0)), ((0, back_y, 0), (1, back_y, 0)),
                     ((back_x, back_y, 0), (back_x, back_y, 1))):
            self._line(canvas, a, b, SOFT)

    def _ticks(self, axis):
        """Return the places of the ticks of an axis as shares of the box."""
        values = ticks(self.low[axis], self.high[axis], 6)
        return (values - self.low[axis]) / (self.high[axis] - self.low[axis])

    def draw_axes(self, canvas, titles):
        """Draw the three axes in front with numbers and titles."""
        near_x, near_y = 1.0 - self.far[0], 1.0 - self.far[1]
        # The upright axis stands at the leftmost corner of the floor.
        corners = [(a, b) for a in (0.0, 1.0) for b in (0.0, 1.0)]
        left = min(corners, key=lambda c: self.place_share((*c, 0.0))[0][0])
        edges = (((0, near_y, 0), (1, near_y, 0)), ((near_x, 0, 0), (near_x, 1, 0)),
                 ((*left, 0), (*left, 1)))
        middle = self.place_share((0.5, 0.5, 0.0))[0]
        for axis, (start, end) in enumerate(edges):
            start, end = np.array(start, float), np.array(end, float)
            self._line(canvas, start, end, INK, 1.2)
            centre = self.place_share(0.5 * (start + end))[0]
            out = np.array([-1.0, 0.0]) if axis == 2 else centre - middle
            out = out / np.hypot(*out)
            anchor = 'end' if out[0] < -0.3 else 'start' if out[0] > 0.3 else 'middle'
            shares = self._ticks(axis)
            # The floor's number at the foot of the upright axis would meet those beside it.
            for share in shares[shares > 0.02] if axis == 2 else shares:
                at = self.place_share(start + share * (end - start))[0]
                canvas.line([at, at + 5 * out], INK)
                value = self.low[axis] + share * (self.high[axis] - self.low[axis])
                words = at + 11 * out
                canvas.text(words[0], words[1] + 4, f'{value:.6g}', anchor, 12, SOFT)
            if axis == 2:
                canvas.text(centre[0] - 50, centre[1], titles[2], turn=-90)
            else:
                slope = np.degrees(np.arctan2(*(self.place_share(end)[0]
                                                - self.place_share(start)[0])[::-1]))
                slope = (slope + 90.0) % 180.0 - 90.0
                at = centre + 46 * out
                canvas.text(at[0], at[1] + 4, titles[axis], turn=round(float(slope), 1))
