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

"""Numbers of a drawn SVG picture, free of where a version of matplotlib puts its axes."""

import re
import xml.etree.ElementTree as ElementTree

import numpy as np

SVG = '{http://www.w3.org/2000/svg}'
DRAWN = re.compile('(curve|points|bars)_[0-9]+|surface')


class Picture:
    """The named shapes and the words of an SVG text."""

    def __init__(self, text):
        self.groups = {group.get('id'): group
                       for group in ElementTree.fromstring(text).iter(f'{SVG}g')}

    def words(self):
        """Return all texts in the order they are drawn: titles, ticks, legend."""
        return [''.join(text.itertext()) for text in self.groups['figure_1'].iter(f'{SVG}text')]

    def shapes(self, name):
        """Return the shapes of an artist, each with its corners [pixel], shape (N, 2)."""
        group = self.groups[name]
        dots = [[(float(dot.get('x')), float(dot.get('y')))] for dot in group.iter(f'{SVG}use')]
        return [np.array(shape) for shape in dots or (
            [[float(number) for number in pair] for pair in re.findall(
                r'[ML] (\S+) (\S+)', path.get('d'))] for path in group.iter(f'{SVG}path'))]

    def all_points(self):
        """Return {artist: points} on a scale where all of them together span 0 to 1."""
        points = {name: np.concatenate(self.shapes(name))
                  for name in self.groups if DRAWN.fullmatch(name or '')}
        every = np.concatenate(list(points.values()))
        return {name: (one - every.min(axis=0)) / np.ptp(every, axis=0)
                for name, one in points.items()}

    def distance(self, other):
        """Return the largest distance of a point from that of another picture."""
        mine, theirs = self.all_points(), other.all_points()
        if {k: v.shape for k, v in mine.items()} != {k: v.shape for k, v in theirs.items()}:
            return np.inf
        return max(float(np.max(np.abs(mine[name] - theirs[name]))) for name in mine)

    def read_off(self, name):
        """Return the points of an artist in the units of the two axes."""
        points = np.concatenate(self.shapes(name))
        return np.stack([np.polyval(self._scale(axis), points[:, k])
                         for k, axis in enumerate('xy')], axis=-1)

    def _scale(self, axis):
        """Return the line from pixels to the numbers at the ticks."""
        ticks = [group for name, group in self.groups.items()
                 if (name or '').startswith(f'{axis}tick_')]
        places = [float(next(tick.iter(f'{SVG}use')).get(axis)) for tick in ticks]
        numbers = [float(''.join(next(tick.iter(f'{SVG}text')).itertext())) for tick in ticks]
        return np.polyfit(places, numbers, 1)
