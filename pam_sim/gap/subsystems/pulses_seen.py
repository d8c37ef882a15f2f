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
# Numerics, in periods: delays of the mean, for nobody knows the dead time; steps of these delays
# and, within a period, of those of pulses.
PERIODS, COARSE, FINE = 5.0, 0.2, 0.05


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
    return all(_is_nearer(averaged, switching, r, period_s, criteria) for r in recordings)


def _is_nearer(averaged: Rig, switching: Rig, recording: Recording, period_s: float,
               criteria: Criteria) -> bool:
    """Return whether pulses are nearer than their mean, each with the delay that suits it best."""
    mean, delay_s = min((_roughness(averaged, recording, d), d)
                        for d in period_s * np.arange(0.0, PERIODS, COARSE))
    # What opens at once comes sooner than its mean, so it needs more delay; any phase is tried.
    single = min(_roughness(switching, recording, delay_s + d)
                 for d in period_s * np.arange(0.0, 1.0, FINE))
    return single < (1.0 - criteria.close_share) * mean


def _roughness(rig: Rig, recording: Recording, delay_s: float) -> float:
    """Return the mean square of the changes of the error of a free run, pressure alone."""
    run = free_run(rig, recording, delay_s)['pressure']
    return float(np.mean(np.diff(run - recording.measured['pressure']) ** 2))
