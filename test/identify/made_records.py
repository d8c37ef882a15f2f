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

"""Recordings made of a rig in the computer, for tests of identification."""

import numpy as np
from pam_sim import load_rig
from pam_sim.run import Run, Series

STAIRS_PA = (50e3, 200e3, 400e3, 500e3, 300e3, 100e3, 0.0)
NOISE = {'pressure': ('pressure_pa', 500.0, 'Pa'), 'contraction': ('contraction_m', 2e-5, 'm'),
         'force': ('force_n', 0.2, 'N')}
RIG = load_rig('dmsp_5_300_hanging_mass')


def record(rig, gauge_pa=STAIRS_PA, hold_s=0.8, keep=('pressure', 'contraction', 'force'),
           command=True, zero_pa=0.0, seed=1, voltage=None, noise=1.0):
    """Return what the sensors of a rig behind a regulator record at 200 Hz."""
    if voltage is None:
        voltage = np.repeat(np.array(gauge_pa) / RIG.parameters['K_m'], int(1000 * hold_s))
    response = rig.simulate(voltage)
    random = np.random.default_rng(seed)
    stamp = (np.asarray(response.time_s)[::5] * 1e9).astype(np.int64)
    topics = {}
    for name in keep:
        key, sd, unit = NOISE[name]
        clean = np.array(getattr(response, key))[::5]
        clean += zero_pa if name == 'pressure' else 0.0
        read = clean + noise * sd * random.standard_normal(clean.size)
        topics[name] = Series(stamp, {key: read}, {key: unit})
    if command:
        topics['valve_signal'] = Series(
            stamp[:-1], {'ppr_voltage': voltage[::5][:stamp.size - 1]}, {'ppr_voltage': 'V'})
    return Run(topics=topics, path='bag')


def spring(stiffness_n_per_m):
    """Return a spring beside the mass, as an entry of a model file."""
    return {'name': 'parallel_spring', 'parameters': {'stiffness_n_per_m': stiffness_n_per_m}}


def inside(found, value):
    """Tell whether a value is in the interval of a number."""
    return found.interval.low <= value <= found.interval.high
