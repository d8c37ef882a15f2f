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

"""What a person marked while a run was recorded, with its times."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from pam_actuation.report import signals
from pam_actuation.report.page import Section, table

if TYPE_CHECKING:
    from pam_sim.run import Run


def markers_sections(runs: 'Sequence[tuple[str, Run]]') -> list[Section]:
    """Return the section with all markers of runs by title; an empty list where none was set."""
    rows = [(title, f'{time_s:.2f} s', text)
            for title, run in runs for time_s, text in signals.markers(run)]
    if not rows:
        return []
    return [Section('markers', 'Markers', table(('recording', 'time', 'marker'), rows))]
