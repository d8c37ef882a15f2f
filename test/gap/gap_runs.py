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

"""Recordings made by simulation, with noise, for the tests of the gap look."""

import json

from jsonschema import Draft202012Validator
import numpy as np
from pam_sim import load_rig
from pam_sim.gap.report.schema import report_schema
from pam_sim.run import Run, Series

NOMINAL = 'dmsp_5_300_hanging_mass'
NOISE = {'pressure': ('pressure_pa', 300.0), 'contraction': ('contraction_m', 1e-5),
         'force': ('force_n', 0.1)}
NS = 1_000_000_000


def voltages(seconds=24.0, seed=3):
    """Return a PPR voltage per millisecond: rest, slow and quick moves, random steps."""
    random = np.random.default_rng(seed)
    t = np.arange(int(seconds * 1000)) * 1e-3
    u = 4.4 + 0.9 * np.sin(2 * np.pi * 0.25 * t) + 0.3 * np.sin(2 * np.pi * 0.9 * t)
    held = np.repeat(random.uniform(3.2, 5.6, t.size // 500 + 1), 500)[:t.size]
    return np.where(t < 1.0, 3.0, np.where(t > 0.6 * seconds, held, u))


def duties(seconds=8.0, seed=5, lasts_ms=(40, 120), openings=(0.25, 0.6)):
    """Return duties of both valves per millisecond: one of them for a while, then none."""
    random = np.random.default_rng(seed)
    found = np.zeros((int(1000 * seconds), 2))
    for start in range(500, len(found) - 300, 300):
        side = int(random.integers(2)) if 1500 < start else 0
        found[start:start + int(random.integers(*lasts_ms)), side] = random.uniform(*openings)
    return found


def recorded(rig, valve_signal, rate_hz=200, seed=0, noise=1.0, topics=tuple(NOISE),
             initial_pressure_pa=401_325.0, jitter_s=5e-5):
    """Return a Run of the rig's answer: noise as on the realistic rig, stamps jittered."""
    random = np.random.default_rng(seed)
    every = 1000 // rate_hz
    # The valve is commanded at the rate of the topics; it holds in between.
    held = np.repeat(valve_signal[::every], every, axis=0)[:len(valve_signal)]
    response = rig.simulate(held, initial_pressure_pa=initial_pressure_pa)
    stamp = 7 * NS + (np.arange(0, len(held), every) * 1_000_000).astype(np.int64)
    found = {}
    for topic in topics:
        field, sd = NOISE[topic]
        late = np.rint(jitter_s * 1e9 * random.standard_normal(stamp.size)).astype(np.int64)
        value = getattr(response, field)[:-1:every]
        found[topic] = Series(
            stamp + late, {field: value + noise * sd * random.standard_normal(stamp.size)})
    columns = held[::every].reshape(stamp.size, -1).T
    found['valve_signal'] = Series(stamp, dict(zip(rig.signal_names, columns)))
    return Run(found, {}, '/muscle', 'simulated')


def assert_form(result):
    """Hold what gap.json says of a result against its schema."""
    told = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    Draft202012Validator(report_schema()).validate(told)


def nominal():
    """Return the nominal rig with the PPR."""
    return load_rig(NOMINAL)
