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
How well controllers track motions that never repeat and steps that nobody announced.

Run ``python benchmarks/unrepeated.py``, with ``--valve ppr`` and ``--controller sofc_ppr`` for a
part of it, ``--quick`` for one motion and two rigs. Offline, in compiled closed loop with sensor
noise; errors are those of the muscle. No seed of motion, noise or rigs was used for a search.
With ``--hidden`` the rigs are those of the independent simulator under test/hidden. The muscle has
other equations there. Its friction, valve and dead time are off by up to 30 %.

- ``random``: a sum of 40 sines of random phase from 0.02 to 1 Hz, at most 8 mm about 14 mm. It is
  told as it comes, or 0.3 s ahead. Root mean square error of the first 30 s, untaught, and from
  60 s on.
- ``rigs``: the same on random rigs a data sheet does not tell of. The driver knows the nominal
  rig.
- ``step``: 10 mm up and down on random rigs, after 60 s of the random motion. Nobody announces
  the steps.
- ``gait``: knee flexion whose cadence changes every five strides, from the third stride on.
"""

import argparse

from hidden_rig import hidden_loop, hidden_rig, OnHiddenRig
import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.experiments import load_experiment
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_actuation.tuning.random_rigs import random_rigs
from pam_sim import load_rig
import results_page

RIG = 'dmsp_5_300_realistic'
CONTROLLERS = {
    'ppr': ('sofc_model_ppr', 'sofc_ppr', 'mpc_random_ppr', 'lqi_random', 'pid_random',
            'pid_plain_random', 'mpc_ppr', 'ilc_ppr', 'lqi'),
    'hsv': ('sofc_model_hsv', 'sofc_hsv', 'mpc_random_hsv', 'lqi_random_hsv', 'pid_random_hsv',
            'pid_plain_random_hsv', 'mpc_hsv', 'ilc_hsv', 'lqi_hsv')}
SEEDS = range(501, 506)
RIGS, RIG_SEED = 30, 700
HIDDEN_RIGS, HIDDEN_SEED = 5, 811
BARS = (0.7, 0.4, 0.5, 0.25)      # of the best baseline: first 30 s and from 60 s; then ahead
DURATION_S = 100.0
BEGIN_S = 3.0                     # end of rest and ramp
IN_TIME_S = {'ppr': 0.6, 'hsv': 0.8}
SETTLED_M, STEP_M = 1e-4, 0.01
STEPS, STEP_HOLD_S, STEPS_FROM_S = 4, 5.0, 64.0
CADENCES_HZ = (0.6, 0.9, 0.7, 1.1, 0.8, 1.0)
LOW_M, HIGH_M = 0.006, 0.022


def random_motion(seed, duration_s=DURATION_S, then=''):
    """Return the experiment: up to the middle, then the motion, then further segments."""
    return load_experiment(f"""
name: random
segments:
  - rest: {{duration_s: 1.0}}
  - ramp: {{to_m: 0.014, duration_s: 2.0}}
  - multisine: {{center_m: 0.014, amplitude_m: 0.008, min_hz: 0.02, max_hz: 1.0, lines: 40,
                duration_s: {duration_s}, seed: {seed}}}
{then}""")


def steps_after_motion(seed):
    """Return the experiment: 60 s of random motion, then steps of 10 mm up and down."""
    steps = ''.join(f'  - step: {{to_m: {to_m}, duration_s: {STEP_HOLD_S}}}\n'
                    for _ in range(STEPS // 2) for to_m in (0.018, 0.008))
    ramp = '  - ramp: {to_m: 0.008, duration_s: 1.0}\n'
    return random_motion(seed, STEPS_FROM_S - 4.0, f'{ramp}{steps}')


def gait():
    """Return the experiment: a knee whose cadence changes every five strides."""
    strides = ''.join(
        f'  - knee_gait: {{low_m: {LOW_M}, high_m: {HIGH_M}, frequency_hz: {cadence_hz}, '
        'cycles: 5}\n'
        for cadence_hz in CADENCES_HZ)
    return load_experiment(f"""
name: gait
segments:
  - rest: {{duration_s: 1.0}}
  - ramp: {{to_m: 0.006, duration_s: 2.0}}
{strides}""")


def closed_loop(rig, experiment, seed, preview_s):
    """Return the closed loop with the driver of the nominal rig."""
    if isinstance(rig, OnHiddenRig):
        return hidden_loop(rig, experiment, seed=seed, preview_s=preview_s)
    return ClosedLoop(rig, experiment, seed=seed, preview_s=preview_s,
                      driver=driver_config(load_rig(RIG, valve=rig.valve)))


def errors_mm(result):
    """Return the root mean square errors [mm] of the first 30 s and from 60 s on."""
    return [1e3 * result.rmse_m(BEGIN_S, BEGIN_S + 30.0),
            1e3 * result.rmse_m(BEGIN_S + 60.0, BEGIN_S + DURATION_S)]


def step_figures(result, from_s=STEPS_FROM_S, settled=SETTLED_M, size=STEP_M):
    """
    Return (settling time [s], overshoot [%]) of every step of a run, up and down in turn.

    ``settled`` and ``size`` are in the unit of the errors.
    """
    figures = []
    for k in range(STEPS):
        start_s = from_s + k * STEP_HOLD_S
        inside = (result.time_s >= start_s) & (result.time_s < start_s + STEP_HOLD_S)
        error = result.error[inside] * (1 if k % 2 == 0 else -1)
        outside = np.flatnonzero(np.abs(error) > settled)
        settled_s = (result.time_s[inside] - start_s)[outside[-1]] if outside.size else 0.0
        figures.append((settled_s, max(0.0, -1e2 * float(error.min()) / size)))
    return figures


def show_random(valve, controllers, seeds, hidden):
    """Print the errors on the rig the controllers were made for, or on one hidden rig per seed."""
    rigs = [load_rig(RIG, valve=valve)] * len(seeds)
    if hidden:
        rigs = [hidden_rig(valve, HIDDEN_SEED + k) for k in range(len(seeds))]
    where = f', {len(rigs)} hidden rigs' if hidden else ''
    print(f'\n## Random motion, {valve}{where}: RMSE [mm], mean\n')
    print('| controller | not announced: first 30 s | from 60 s | 0.3 s ahead: first 30 s '
          '| from 60 s |')
    print('|---|' + '---|' * 4)
    found = {}
    for name in controllers:
        found[name] = np.ravel([np.mean([errors_mm(
            closed_loop(rig, random_motion(seed), seed, preview_s).run(load_controller(name, rig)))
            for rig, seed in zip(rigs, seeds)], axis=0) for preview_s in (0.0, 0.3)])
        print(f'| {name} | ' + ' | '.join(f'{cell:.3f}' for cell in found[name]) + ' |',
              flush=True)
    baselines = [cells for name, cells in found.items() if not name.startswith('sofc')]
    if not baselines:
        return
    best = np.min(baselines, axis=0)
    best[2:] = np.minimum(best[:2], best[2:])       # who is told ahead need not use it
    for name, cells in found.items():
        if name.startswith('sofc'):
            print(f'| {name}, ratio to the best baseline | '
                  + ' | '.join(f'{ratio:.2f}' for ratio in cells / best) + ' |')
    print('| wanted ratio | ' + ' | '.join(f'{bar:g}' for bar in BARS) + ' |', flush=True)


def show_rigs(valve, controllers, count, hidden):
    """Print errors and steps on random rigs, or hidden ones, nothing announced."""
    nominal = load_rig(RIG, valve=valve)
    rigs = ([hidden_rig(valve, HIDDEN_SEED + k) for k in range(count)] if hidden
            else random_rigs(nominal, count, seed=RIG_SEED))
    print(f'\n## {count} {"hidden" if hidden else "random"} rigs, {valve}: random motion [mm] '
          'and steps, not announced\n')
    print('| controller | first 30 s: median | worst | from 60 s: median | worst '
          f'| steps within {IN_TIME_S[valve]:g} s [%] | median [s] | largest overshoot [%] |')
    print('|---|' + '---|' * 7)
    for name in controllers:
        runs = [closed_loop(rig, random_motion(RIG_SEED + k), k, 0.0).run(
            load_controller(name, nominal)) for k, rig in enumerate(rigs)]
        first, late = np.transpose([errors_mm(run) for run in runs])
        settled_s, overshoot = np.transpose([
            figure for k, rig in enumerate(rigs) for figure in step_figures(closed_loop(
                rig, steps_after_motion(RIG_SEED + k), k, 0.0).run(
                    load_controller(name, nominal)))])
        print(f'| {name} | {np.median(first):.3f} | {first.max():.3f} | {np.median(late):.3f} '
              f'| {late.max():.3f} | {100.0 * np.mean(settled_s <= IN_TIME_S[valve]):.0f} '
              f'| {np.median(settled_s):.2f} | {overshoot.max():.1f} |', flush=True)


def show_gait(valve, controllers, hidden):
    """Print the error of a gait whose cadence changes."""
    rig = hidden_rig(valve, HIDDEN_SEED) if hidden else load_rig(RIG, valve=valve)
    experiment = gait()
    start_s = BEGIN_S + 2.0 / CADENCES_HZ[0]
    print(f'\n## Gait of changing cadence from the third stride on, {valve}'
          f'{", a hidden rig" if hidden else ""}\n')
    print('| controller | not announced [mm] | of the stroke [%] | 0.3 s ahead [mm] '
          '| of the stroke [%] |')
    print('|---|' + '---|' * 4)
    for name in controllers:
        cells = []
        for preview_s in (0.0, 0.3):
            result = closed_loop(rig, experiment, SEEDS[0], preview_s).run(
                load_controller(name, rig))
            error_mm = 1e3 * result.rmse_m(start_s, experiment.duration_s)
            cells += [f'{error_mm:.3f}', f'{0.1 * error_mm / (HIGH_M - LOW_M):.2f}']
        print(f'| {name} | ' + ' | '.join(cells) + ' |', flush=True)


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--valve', default='ppr,hsv', help='valves, by commas')
    parser.add_argument('--controller', default='', help='presets, by commas')
    parser.add_argument('--hidden', action='store_true',
                        help='on rigs of the independent simulator')
    parser.add_argument('--quick', action='store_true', help='one motion, two rigs')
    results_page.add_write(parser, 'unrepeated')
    return parser


def main():
    """Print the tables."""
    args = command_line().parse_args()
    rigs = HIDDEN_RIGS if args.hidden else RIGS
    with results_page.printed(args, __file__, 'hidden' * args.hidden):
        for valve in args.valve.split(','):
            controllers = CONTROLLERS[valve]
            if args.controller:
                controllers = args.controller.split(',')
            show_random(valve, controllers, SEEDS[:1] if args.quick else SEEDS, args.hidden)
            show_rigs(valve, controllers, 2 if args.quick else rigs, args.hidden)
            show_gait(valve, controllers, args.hidden)


if __name__ == '__main__':
    main()
