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

"""
Recordings of a simulated laboratory for `benchmarks/campaign.py`: eight rigs, 25 days.

Every rig has its own dry friction, which scatters by 2 % from day to day. On rig 1 a leak
begins on day 11. On rig 2 friction doubles from day 5 to day 25. On rig 4 the zero of the
pressure sensor drifts from day 8 on. Nothing else changes.
"""

from datetime import date, timedelta

import numpy as np
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_sim import load_rig
from pam_sim.located_yaml import dump_yaml

MODEL = 'dmsp_5_300_hanging_mass'
RIGS, DAYS = 8, 25
FIRST_DAY = date(2026, 3, 1)
LEAK_RIG, LEAK_DAY, LEAK = 1, 11, 8e-13             # m3/(s Pa)
FRICTION_RIG, FRICTION_DAY, FRICTION_N = 2, 5, 2.0
DRIFT_RIG, DRIFT_DAY, DRIFT_PA = 4, 8, 700.0        # a day
SCATTER = 0.02
# What the page must say: rig, name, shape, day.
TRUTH = [('rig_1', 'leakage', 'step', LEAK_DAY),
         ('rig_2', 'coulomb_friction', 'ramp', FRICTION_DAY),
         ('rig_4', 'pressure_bias', 'ramp', DRIFT_DAY)]
EXPERIMENT = """
name: daily_check
description: Ten seconds of random steps, on every rig every day
domain: pressure
segments:
  - rest: {duration_s: 0.5}
  - random_steps: {low_pa: 351325.0, high_pa: 651325.0, min_hold_s: 0.25, max_hold_s: 0.8,
                   duration_s: 9.5, seed: 3}
"""
SENSORS = {'pressure_noise_pa': 300.0, 'contraction_noise_m': 1e-5, 'force_noise_n': 0.1,
           'stamp_jitter_s': 5e-5}


def rig_on(number, day):
    """Return what stands in the laboratory as this rig on this day, both counted from 1."""
    random = np.random.default_rng([number, day])
    friction_n = 1.0 + 0.2 * number
    if number == FRICTION_RIG:
        friction_n = FRICTION_N * (1.0 + max(day - FRICTION_DAY, 0) / (DAYS - FRICTION_DAY))
    effects = {'coulomb_friction': {
        'force_n': float(friction_n * (1.0 + SCATTER * random.standard_normal()))}}
    if number == LEAK_RIG and day >= LEAK_DAY:
        effects['leakage'] = {'conductance_m3_per_s_pa': LEAK}
    if number == DRIFT_RIG and day > DRIFT_DAY:
        effects['pressure_bias'] = {'bias_pa': DRIFT_PA * (day - DRIFT_DAY)}
    return load_rig(dump_yaml({
        'rig': MODEL, 'valve': 'hsv' if number % 2 else 'ppr', 'sensors': SENSORS,
        'effects': [{'name': name, 'parameters': parameters}
                    for name, parameters in effects.items()]}))


def record(folder, number, day):
    """Record a rig on a day below a folder, unless that was done."""
    out = folder / f'rig_{number}' / (FIRST_DAY + timedelta(days=day - 1)).isoformat() / 'check'
    if not (out / 'metadata.yaml').exists():
        simulate_experiment(load_experiment(EXPERIMENT), rig_on(number, day), None, out,
                            seed=1000 * number + day, overwrite=True)


def record_task(folder, task):
    """Record; the function that workers are given."""
    record(folder, *task)
