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

"""What a run that was just recorded tells of valves and controller, beside its numbers."""

from typing import TYPE_CHECKING

from pam_actuation.bags.load_joint import load_recording
from pam_actuation.report.ahead import ahead
from pam_actuation.report.full_valves import full_valves
from pam_actuation.report.swinging import swinging

if TYPE_CHECKING:
    from pam_actuation.experiments.experiment import Experiment


def tracked_remarks(bag: str, experiment: 'Experiment') -> list[str]:
    """Return sentences on valves too small, on swinging, and on a preview too long."""
    if not experiment.asks_for_motion:
        return []
    run = load_recording(bag)
    return [said for look in (full_valves, swinging, ahead) if (said := look(run))]
