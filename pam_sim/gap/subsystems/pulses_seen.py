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
from dataclasses import dataclass

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.gap.criteria import CRITERIA, Criteria
from pam_sim.gap.data.means import behind
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.split import TEST_BLOCK_S
from pam_sim.gap.subsystems.parallel import parallel_map
from pam_sim.gap.subsystems.simulation import free_run
from pam_sim.rig import Rig

SAMPLES = 1.9                # of the pressure in a period; rates scatter a little
# Numerics, in periods: delays of the mean, for nobody knows the dead time; steps of these delays
# and, within a period, of those of pulses; lags of a sensor or a line, which smooth pulses.
PERIODS, COARSE, FINE = 5.0, 0.2, 0.05
LAGS = 0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0
BEHIND_A_LAG = 0.1           # steps of the delays of pulses that a lag has smoothed


def shows_pulses(rig: Rig, recordings: Sequence[Recording], criteria: Criteria = CRITERIA
                 ) -> bool:
    """
    Return whether the pressure of recordings is nearer to single pulses than to their mean.

    Compared are changes from sample to sample, in which an error of slower parts hardly counts.
    With fewer than two samples in a period nothing is seen of a pulse. A lag of the sensor leaves
    little of it. There pulses must be nearer by ``certain_sd`` over blocks of the recording.
    """
    averaged, switching = rig.with_(fidelity='averaged'), rig.with_(fidelity='switching')
    period_s = rig.parameters['pwm_period_s']
    if any(SAMPLES * np.median(np.diff(r.time_s['pressure'])) > period_s for r in recordings):
        return False
    return all(_is_nearer(averaged, switching, r, period_s, criteria) for r in recordings)


def _is_nearer(averaged: Rig, switching: Rig, recording: Recording, period_s: float,
               criteria: Criteria) -> bool:
    """Return whether pulses are nearer than their mean, each with the delay that suits it best."""
    mean = _tried(averaged, recording, period_s, np.arange(0.0, PERIODS, COARSE))
    first = min(mean, key=lambda one: one.squares[0].mean())
    # What opens at once comes sooner than its mean, so it needs more delay; any phase is tried.
    single = min(one.squares[0].mean() for one in _tried(
        switching, recording, period_s, first.delay + np.arange(0.0, 1.0, FINE), LAGS[:1]))
    if single < (1.0 - criteria.close_share) * first.squares[0].mean():
        return True
    # A lag of the reading takes part of the delay over.
    delay = min(mean, key=lambda one: one.best().mean()).delay
    smooth, sharp = (min((one.best() for one in tried), key=np.mean) for tried in (
        mean, _tried(switching, recording, period_s, delay + np.arange(-1.0, 1.0, BEHIND_A_LAG))))
    blocks = [b.mean() for b in np.array_split(smooth - sharp, max(int(
        recording.grid_s[-1] / TEST_BLOCK_S), 2))]
    return bool(np.mean(blocks) * np.sqrt(len(blocks)) > criteria.certain_sd * np.std(blocks))


@dataclass(frozen=True)
class _Tried:
    """Squared changes of the error of a run with a delay [periods], one row for each lag."""

    delay: float
    squares: FloatArray

    def best(self) -> FloatArray:
        """Return those with the lag that suits the run best."""
        return self.squares[np.argmin(self.squares.mean(axis=1))]


def _tried(rig: Rig, recording: Recording, period_s: float, delays: FloatArray,
           lags: Sequence[float] = LAGS) -> list[_Tried]:
    """Return the squared changes of the error of free runs, pressure alone."""
    measured = recording.measured['pressure']
    step = float(np.median(np.diff(recording.time_s['pressure']))) / period_s

    def tried(delay: float) -> _Tried:
        run = free_run(rig, recording, period_s * delay, signals=('pressure',))['pressure']
        return _Tried(delay, np.array([
            np.diff(behind(run, lag / step, 1.0) - measured) ** 2 for lag in lags]))

    return parallel_map(tried, delays.tolist())
