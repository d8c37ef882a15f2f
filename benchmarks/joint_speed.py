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
Measure the joint: nanoseconds per 1 ms step and how many times faster than real time.

Run ``python benchmarks/joint_speed.py``; the best of several runs counts, on one core.
"""

import time

import numpy as np
from pam_sim.joint import kernel, layout, load_joint
from pam_sim.joint.simulate import input_array
from pam_sim.records import size_of
from pam_sim.rollout import layout as muscle

STEPS = 10_000
REPEATS = 40


def signals_for(valve):
    """Return flexor and extensor signals of 0.5 Hz, opposite to each other."""
    drive = np.sin(np.arange(STEPS) * 1e-3 * np.pi)
    if valve == 'ppr':
        return 3.0 + drive, 3.0 - drive
    return tuple(np.stack([np.clip(d, 0.0, 1.0), np.clip(-d, 0.0, 1.0)], axis=1)
                 for d in (0.3 * drive, -0.3 * drive))


def seconds_per_step(joint, valve):
    """Return the shortest time of one step [s] over REPEATS rollouts."""
    inputs = input_array(joint, *signals_for(valve))
    rows = [np.empty((STEPS + 1, size_of(one))) for one in (
        layout.OUTPUT, muscle.OUTPUT, muscle.OUTPUT)]
    plant = joint.plant(initial_angle_rad=0.0)
    best = np.inf
    for _ in range(REPEATS):
        plant.reset()
        start = time.perf_counter()
        kernel.joint_rollout(inputs, *plant.arrays, *rows)
        best = min(best, time.perf_counter() - start)
    return best / STEPS


def main():
    """Print one line per valve and set of effects."""
    for effects in ([], ['hysteresis', 'creep', 'valve_dead_time']):
        for valve, fidelity in (('ppr', 'averaged'), ('hsv', 'averaged'), ('hsv', 'switching')):
            joint = load_joint('joint_dmsp_5_300', valve=valve, fidelity=fidelity)
            rig = joint.flexor.with_(effects=effects)
            step_s = seconds_per_step(joint.with_(flexor=rig, extensor=rig), valve)
            print(f'{"with effects" if effects else "nominal":13s} {valve} {fidelity:9s} '
                  f'{step_s * 1e9:7.0f} ns per step, {1e-3 / step_s:8.0f} x real time')


if __name__ == '__main__':
    main()
