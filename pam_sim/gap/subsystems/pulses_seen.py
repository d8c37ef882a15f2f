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

"""Whether recordings show the single pulses of on/off valves, or their mean alone."""

from collections.abc import Sequence

import numpy as np
from pam_sim.gap.criteria import CRITERIA, Criteria
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.subsystems.simulation import free_run
from pam_sim.rig import Rig

SAMPLES = 1.9                # of the pressure in a period; rates scatter a little
PHASES = 10                  # numerics: delays tried over a period, for nobody knows the dead time


def shows_pulses(rig: Rig, recordings: Sequence[Recording], criteria: Criteria = CRITERIA
                 ) -> bool:
    """
    Return whether the pressure of recordings is nearer to single pulses than to their mean.

    Compared are changes from sample to sample, in which an error of slower parts hardly counts.
    With fewer than two samples in a period nothing is seen of a pulse.
    """
    averaged, switching = rig.with_(fidelity='averaged'), rig.with_(fidelity='switching')
    period_s = rig.parameters['pwm_period_s']
    if any(SAMPLES * np.median(np.diff(r.time_s['pressure'])) > period_s for r in recordings):
        return False
    least = 1.0 - criteria.close_share
    return all(min(_roughness(switching, r, d) for d in period_s * np.arange(PHASES) / PHASES)
               < least * _roughness(averaged, r, 0.0) for r in recordings)


def _roughness(rig: Rig, recording: Recording, delay_s: float) -> float:
    """Return the mean square of the changes of the error of a free run, pressure alone."""
    run = free_run(rig, recording, delay_s)['pressure']
    return float(np.mean(np.diff(run - recording.measured['pressure']) ** 2))
