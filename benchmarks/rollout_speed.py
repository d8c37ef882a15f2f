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
Measure the rollout: per rig, on one core and on all, against MuJoCo, and the first call.

Run ``python benchmarks/rollout_speed.py``; it prints the tables of docs/results/speed.md.
The best of several runs counts: other work on the machine can only make a run slower. Install the
``bench`` extra for the comparison with MuJoCo.
"""

import argparse
import itertools
import subprocess
import sys
import time

import numpy as np
from pam_sim import load_rig
from pam_sim.effects.registry import effects
from pam_sim.records import size_of
from pam_sim.rollout import kernel
from pam_sim.rollout.batch import default_workers, Record, residual_sums, simulate_batch
from pam_sim.rollout.layout import OUTPUT
from pam_sim.rollout.sampling import Measured
from pam_sim.rollout.simulate import input_array
import results_page

STEPS = 10_000
STEP_S = 1e-3
REPEATS = 40
BATCH_RIGS, BATCH_RECORDS = 20, 10
BATCH_REPEATS = 12
FIRST_CALLS = 6
VALVES = (('PPR', 'ppr', 'averaged'), ('HSV averaged', 'hsv', 'averaged'),
          ('HSV switching', 'hsv', 'switching'))
# Effects whose nominal numbers are zero, switched on.
SIZES = {'valve_dead_zone': {
    'half_width_pa': 2e3, 'open_time_s': 1.7e-3, 'close_time_s': 2.0e-3}}
FRESH_PROCESS = '\n'.join((
    'from pam_sim import load_rig',
    'load_rig("dmsp_5_300_hanging_mass").simulate([3.0] * 1000)'))


def signal_for(rig, hertz=0.5):
    """Return a valve signal, shape (STEPS,) or (STEPS, 2)."""
    phase = np.arange(STEPS) * STEP_S * 2.0 * np.pi * hertz
    if rig.valve == 'ppr':
        return 3.5 + 1.5 * np.sin(phase)
    drive = 0.3 * np.sin(phase)
    return np.stack([np.clip(drive, 0.0, 1.0), np.clip(-drive, 0.0, 1.0)], axis=1)


def best_s(call, repeats):
    """Return the shortest time [s] of a call."""
    best = np.inf
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        best = min(best, time.perf_counter() - start)
    return best


def seconds_per_step(rig):
    """Return the time of one step [s] in the compiled rollout."""
    inputs, _ = input_array(rig, signal_for(rig))
    outputs = np.empty((STEPS + 1, size_of(OUTPUT)))
    start, par = rig.pack()
    return best_s(lambda: kernel.rollout(start.copy(), par, inputs, outputs), REPEATS) / STEPS


def rigs():
    """Return label -> rig: nominal, realistic, every effect at once."""
    nominal = load_rig('dmsp_5_300_hanging_mass')
    every = [{'name': name, 'parameters': SIZES.get(name, {})} for name in effects()]
    one_each = [item for item in every if not effects()[item['name']].variant_of]
    return {'nominal': nominal, 'realistic': load_rig('dmsp_5_300_realistic'),
            f'{len(one_each)} effects, no variants': nominal.with_(effects=one_each),
            f'all {len(every)} effects': nominal.with_(effects=every)}


def print_rigs():
    """Print the time per step of every rig and valve; return that of the nominal one [s]."""
    print('| rig | valve | ns per 1 ms step | times real time |')
    print('|---|---|---|---|')
    nominal_s = None
    for name, rig in rigs().items():
        for label, valve, fidelity in VALVES:
            step_s = seconds_per_step(rig.with_(valve=valve, fidelity=fidelity))
            nominal_s = nominal_s or step_s
            print(f'| {name} | {label} | {step_s * 1e9:.0f} | {STEP_S / step_s:,.0f} |')
    return nominal_s


def print_batch():
    """Print how a batch of parameter sets and records gains from a second core."""
    base = load_rig('dmsp_5_300_realistic')
    sets = [base.with_(parameters={'mass_kg': mass}) for mass in np.linspace(4.0, 6.0, BATCH_RIGS)]
    records = [Record(signal_for(base, hertz)) for hertz in np.linspace(0.2, 1.0, BATCH_RECORDS)]
    pairs = [list(one) for one in zip(*itertools.product(sets, records))]
    seconds = np.arange(0.0, 9.9, 0.005)
    measured = [Measured(name, seconds, np.zeros_like(seconds))
                for name in ('pressure_pa', 'contraction_m', 'force_n')]
    kept = ('pressure_pa', 'contraction_m', 'force_n')
    calls = {
        'all signals kept': lambda w: simulate_batch(*pairs, workers=w),
        'three signals at 100 Hz kept': lambda w: simulate_batch(
            *pairs, workers=w, keep=kept, every=10),
        'sums of squares only': lambda w: residual_sums(*pairs, measured, workers=w)}
    cores = default_workers()
    span_s = len(pairs[0]) * STEPS * STEP_S
    print(f'| batch of {len(pairs[0])} runs of {STEPS * STEP_S:.0f} s, realistic rig | 1 core, '
          f'times real time | {cores} cores | gain |')
    print('|---|---|---|---|')
    for label, call in calls.items():
        found = {1: np.inf, cores: np.inf}
        for _ in range(BATCH_REPEATS):          # in turn, so that both meet the same machine
            for workers in found:
                found[workers] = min(found[workers], best_s(lambda: call(workers), 1))
        print(f'| {label} | {span_s / found[1]:,.0f} | {span_s / found[cores]:,.0f} | '
              f'{found[1] / found[cores]:.2f} |')


def print_against_mujoco(nominal_s):
    """Print steps per second of MuJoCo's slide joint with a cylinder and of the nominal rig."""
    try:
        from mujoco_slide import seconds_per_step as mujoco_seconds
    except ImportError:
        print('MuJoCo is not installed (extra `bench`): no comparison.')
        return
    print('| one core, 1 ms steps | ns per step | steps per second |')
    print('|---|---|---|')
    loops = mujoco_seconds(STEPS // 10, REPEATS)
    for label, step_s in (*loops.items(), ('pam_sim, nominal rig, PPR', nominal_s)):
        print(f'| {label} | {step_s * 1e9:.0f} | {1.0 / step_s:,.0f} |')
    fastest = min(loops, key=loops.get)
    print(f'\n{loops[fastest] / nominal_s:.1f} times the steps per second of the faster: '
          f'{fastest}.')


def print_first_call():
    """Print how long a fresh process takes to load a rig and simulate 1 s, compiled before."""
    command = [sys.executable, '-c', FRESH_PROCESS]
    subprocess.run(command, check=True)         # fills the cache where it is empty
    seconds = best_s(lambda: subprocess.run(command, check=True), FIRST_CALLS)
    print(f'Fresh process, start of Python to end of a simulated second: {seconds:.2f} s.')


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    results_page.add_write(parser, 'speed')
    return parser


def main():
    """Print all tables."""
    args = command_line().parse_args()
    print(f'{results_page.machine()}\n')
    with results_page.printed(args, __file__):
        nominal_s = print_rigs()
        for table in (print_batch, lambda: print_against_mujoco(nominal_s), print_first_call):
            print(flush=True)
            table()


if __name__ == '__main__':
    main()
