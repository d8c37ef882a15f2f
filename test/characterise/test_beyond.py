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
"""What is said of the force at lengths that a force map does not hold."""

from pathlib import Path
import re

import numpy as np
import pam_sim
from pam_sim.characterise import characterise_table
from pam_sim.characterise.beyond import beyond, HELD, JUDGED
from pam_sim.characterise.dimensions import Dimensions
from pam_sim.characterise.tables import read_measured_table
from pam_sim.muscle.force_maps import ForceMap, read_force_map


def some(points, kept):
    """Return the ForceMap of some of the points."""
    return ForceMap(points.name, points.length_m, points.pressure_gauge_pa[kept],
                    points.strain[kept], points.force_n[kept], points.censored[kept])


def test_the_full_length_lies_within_the_bounds_that_shorter_lengths_give():
    points = read_force_map('dmsp_10_250')
    found = beyond(some(points, points.strain > 0.01), apart_from='dmsp_10_250_map')
    assert found.low_n < points.force_n.max() < found.high_n
    assert found.high_n - found.low_n > 0.2 * points.force_n.max()     # and they are wide


def test_a_map_that_holds_the_full_length_needs_no_bounds():
    assert beyond(read_force_map('dmsp_10_250')) is None


def test_characterise_says_that_the_full_length_was_not_measured(tmp_path):
    text = (Path(pam_sim.__file__).parent / 'muscle' / 'dmsp_20_300_force_map.csv').read_text()
    path = tmp_path / 'map.csv'
    path.write_text(text)
    result = characterise_table(read_measured_table(path), Dimensions(0.3, 0.02))
    said = [one for one in result.remarks if 'longest measured length is 296.0 mm' in one]
    assert len(said) == 1 and '300.0 mm is not known' in said[0]
    assert f'{JUDGED} such ranges that were tested, {HELD} held the measured force' in said[0]
    assert np.all(np.isfinite(result.surfaces.strain))


def test_what_is_said_of_tested_bounds_is_what_the_results_pages_show():
    pages = Path(__file__).resolve().parents[2] / 'docs' / 'results'
    rows = [tuple(map(int, row)) for name in ('real_records.md', 'held_lengths.md')
            for row in re.findall(r'^\| .+ \| [\d.]+ % \| [\d.]+ % \| (\d+) to (\d+) \| (\d+) \|$',
                                  (pages / name).read_text(encoding='utf-8'), re.MULTILINE)]
    assert len(rows) == JUDGED
    assert sum(low <= force <= high for low, high, force in rows) == HELD
