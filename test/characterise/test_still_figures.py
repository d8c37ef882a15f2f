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

"""Still figures: what is drawn is where the axes say, and the same each time."""

import subprocess
import sys

from drawn import Picture
import numpy as np
from pam_actuation.report.svg import Curve, line_chart, surface_chart
import pytest

X, Y = np.meshgrid(np.linspace(0.0, 150.0, 6), np.linspace(0.0, 600.0, 5))
Z = 1e-4 * Y * (160.0 - X)
TITLES = ('loading [N]', 'pressure [kPa]', 'contraction [%]')


def seen_from(turn_deg, tilt_deg):
    """Return the corners as an eye far away sees them (x right, y down), box 4 : 4 : 3."""
    u, v, w = X / 150.0, Y / 600.0, 0.75 * Z / Z.max()
    turn, tilt = np.radians(turn_deg), np.radians(tilt_deg)
    along = u * np.cos(turn) + v * np.sin(turn)
    return np.stack([v * np.cos(turn) - u * np.sin(turn),
                     along * np.sin(tilt) - w * np.cos(tilt)], axis=-1)


@pytest.mark.parametrize('turn_deg, tilt_deg', [(-125.0, 24.0), (-38.0, 24.0), (20.0, 60.0)])
def test_every_mesh_of_a_surface_is_where_the_eye_sees_it(turn_deg, tilt_deg):
    picture = Picture(surface_chart(X, Y, Z, TITLES, 'plane', turn_deg, tilt_deg))
    assert set(TITLES) < set(picture.words())
    drawn = np.array(picture.shapes('surface'))
    assert drawn.shape == (5 * 4, 4, 2)
    seen = seen_from(turn_deg, tilt_deg)
    meshes = 0.25 * (seen[:-1, :-1] + seen[1:, :-1] + seen[1:, 1:] + seen[:-1, 1:]).reshape(-1, 2)
    # One scale for both directions: the box keeps its shape.
    scale = np.ptp(drawn.reshape(-1, 2), axis=0) / np.ptp(seen.reshape(-1, 2), axis=0)
    assert scale[0] == pytest.approx(scale[1], rel=1e-4)
    centres = (drawn.mean(axis=1) - drawn.reshape(-1, 2).min(axis=0)) / scale \
        + seen.reshape(-1, 2).min(axis=0)
    apart = np.linalg.norm(centres[:, None] - meshes, axis=-1)
    assert np.max(np.min(apart, axis=0)) < 1e-4 and np.max(np.min(apart, axis=1)) < 1e-4


def test_what_is_not_known_of_a_surface_is_left_out():
    holed = Z.copy()
    holed[0, 0] = holed[2, 3] = np.nan
    text = surface_chart(X, Y, holed, TITLES, 'holed')
    assert 'nan' not in text.lower()
    corners = [len(shape) for shape in Picture(text).shapes('surface')]
    assert sorted(corners) == [3] * 5 + [4] * 15


def test_a_fine_grid_becomes_a_small_file():
    x, y = np.meshgrid(np.linspace(0.0, 150.0, 40), np.linspace(0.0, 600.0, 64))
    text = surface_chart(x, y, x * y, TITLES, 'fine')
    assert len(Picture(text).shapes('surface')) == 32 * 20 and len(text) < 300_000


def test_lines_dots_and_bars_are_read_off_the_axes():
    x = np.linspace(0.0, 20.0, 30)
    points = np.array([[2.0, 90.0, 0.5], [15.0, 40.0, 1.5]])
    text = line_chart([Curve('low', x, 50.0 - x), Curve('high & dry', x, 100.0 - x, points)],
                      'contraction [%]', 'force [N]', 'lines')
    picture = Picture(text)
    assert picture.words()[-2:] == ['high & dry', 'low']
    assert picture.read_off('curve_0') == pytest.approx(np.stack([x, 50.0 - x], 1), abs=1e-3)
    assert picture.read_off('points_1') == pytest.approx(points[:, :2], abs=1e-3)
    assert picture.read_off('bars_1')[:, 0] == pytest.approx([1.5, 2.5, 13.5, 16.5], abs=1e-3)


def test_the_same_figure_is_the_same_file_whatever_the_reader_has_set():
    import matplotlib
    first = surface_chart(X, Y, Z, TITLES, 'plane')
    with matplotlib.rc_context({'font.size': 30.0, 'axes.grid': False, 'svg.hashsalt': 'other'}):
        assert surface_chart(X, Y, Z, TITLES, 'plane') == first
    assert first != surface_chart(X, Y, 1.01 * Z * X, TITLES, 'plane')


def test_matplotlib_is_loaded_for_a_figure_only_and_without_a_display():
    code = ('import sys, pam_actuation.cli.main, pam_actuation.report.characterise as page;'
            'from pam_actuation.report.svg import Curve, line_chart;'
            'assert "matplotlib" not in sys.modules;'
            'line_chart([Curve("one", page.np.arange(3.0), page.np.arange(3.0))], "x", "y", "t");'
            'assert "matplotlib" in sys.modules and "matplotlib.pyplot" not in sys.modules')
    subprocess.run([sys.executable, '-c', code], check=True)
