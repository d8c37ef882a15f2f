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

"""What runs tell of valves and controller, beside their numbers."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from pam_actuation.bags.load_joint import load_recording
from pam_actuation.report.ahead import ahead, ahead_section
from pam_actuation.report.full_valves import full_valves, full_valves_section
from pam_actuation.report.page import Section
from pam_actuation.report.swinging import swinging, swinging_section
from pam_actuation.report.unlike import unlike_section

if TYPE_CHECKING:
    from pam_actuation.experiments.experiment import Experiment
    from pam_sim.run import Run


def tracked_remarks(bag: str, experiment: 'Experiment') -> list[str]:
    """Return sentences on valves too small, on swinging, and on a preview too long."""
    if not experiment.asks_for_motion:
        return []
    run = load_recording(bag)
    return [said for look in (full_valves, swinging, ahead) if (said := look(run))]


def tracked_sections(named: 'Sequence[tuple[str, Run]]') -> list[Section | None]:
    """Return the sections of a page on the same, by title, and on runs that do not compare."""
    return [full_valves_section(named), swinging_section(named), ahead_section(named),
            unlike_section(named)]
