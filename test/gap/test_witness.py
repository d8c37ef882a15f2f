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

"""What a pressure leaves is real where the force shows it, else noise of its sensor."""

from gap_runs import nominal, recorded, voltages
import numpy as np
from pam_sim.gap import find_gap, verdict as verdict_module
from pam_sim.run import Run, Series
import pytest

WITH_FORCE = ('pressure', 'contraction', 'force')


def pulsating(topics=WITH_FORCE, ripple_v=0.02):
    """Return a recording whose pressure pulsates at 6 Hz, without a command that asks for it."""
    wanted = voltages(12.0)
    time_s = 1e-3 * np.arange(len(wanted))
    moved = wanted + ripple_v * np.sin(2.0 * np.pi * 6.0 * time_s).reshape(
        wanted.shape[:1] + (1,) * (wanted.ndim - 1))
    run = recorded(nominal(), moved, topics=topics)
    return Run({**run.topics, 'valve_signal': recorded(
        nominal(), wanted, topics=topics).topics['valve_signal']}, {}, '/muscle', 'simulated')


def humming(topics=WITH_FORCE, sd_pa=600.0):
    """Return a recording of which the pressure sensor swings as much, and the pressure not."""
    run = recorded(nominal(), voltages(12.0), topics=topics)
    own = run.topics['pressure']
    swing = np.sqrt(2.0) * sd_pa * np.sin(2.0 * np.pi * 6.0 * 1e-9 * own.stamp_ns)
    return Run({**run.topics, 'pressure': Series(own.stamp_ns, {
        'pressure_pa': own['pressure_pa'] + swing})}, {}, '/muscle', 'simulated')


@pytest.mark.parametrize('run, topics, witness', [
    (pulsating, WITH_FORCE, 'force'), (pulsating, WITH_FORCE[:2], ''),
    (humming, WITH_FORCE, '')])
def test_what_another_sensor_shows_of_the_pressure_is_no_noise(monkeypatch, run, topics, witness):
    monkeypatch.setattr(verdict_module, '_is_left', lambda *given: False)
    monkeypatch.setattr(verdict_module, 'notices', lambda runs: [])
    result = find_gap(run(topics), nominal(), effects=['coulomb_friction'], unnamed=())
    assert [one.witness for one in result.noticed] == ([witness] if witness else [])
    assert result.verdict == ('unknown' if witness else 'no_gap')
    assert (f'shows in the {witness} as well' in result.reason) == bool(witness)
