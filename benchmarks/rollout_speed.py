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
Measure the rollout: nanoseconds per 1 ms step and how many times faster than real time.

Run ``python benchmarks/rollout_speed.py``; the best of several runs counts, on one core.
"""

import time

import numpy as np
from pam_sim import load_rig
from pam_sim.rollout import kernel, layout
from pam_sim.rollout.simulate import input_array

STEPS = 10_000
REPEATS = 40


def signal_for(rig):
    """Return a valve signal of 0.5 Hz, shape (STEPS,) or (STEPS, 2)."""
    phase = np.arange(STEPS) * 1e-3 * np.pi
    if rig.valve == 'ppr':
        return 3.5 + 1.5 * np.sin(phase)
    drive = 0.3 * np.sin(phase)
    return np.stack([np.clip(drive, 0.0, 1.0), np.clip(-drive, 0.0, 1.0)], axis=1)


def seconds_per_step(rig):
    """Return the shortest time of one step [s] over REPEATS rollouts."""
    inputs, _ = input_array(rig, signal_for(rig))
    outputs = np.empty((STEPS + 1, layout.OUT_SIZE))
    best = np.inf
    for _ in range(REPEATS):
        state, par = rig.pack()
        start = time.perf_counter()
        kernel.rollout(state, par, inputs, outputs)
        best = min(best, time.perf_counter() - start)
    return best / STEPS


def main():
    """Print one line per rig."""
    for name in ('dmsp_5_300_hanging_mass', 'dmsp_5_300_realistic'):
        for valve, fidelity in (
                ('ppr', 'averaged'), ('hsv', 'averaged'), ('hsv', 'switching')):
            step_s = seconds_per_step(load_rig(name, valve=valve, fidelity=fidelity))
            print(f'{name:26s} {valve} {fidelity:9s} {step_s * 1e9:7.0f} ns per step, '
                  f'{1e-3 / step_s:8.0f} x real time')


if __name__ == '__main__':
    main()
