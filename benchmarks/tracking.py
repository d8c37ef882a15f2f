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
How well controllers track on the realistic rig, both valves, noise on, seeds fixed.

Run ``python benchmarks/tracking.py`` for everything, or ``--part sine,step`` and
``--valve ppr`` and ``--controller sofc`` for a part of it. Offline, in compiled closed
loop; every error is that of the muscle (reference less true contraction, no sensor noise).

- ``sine``: +-10 mm about 14 mm, rules untaught at the start. Root mean square and largest error
  of the last of 20 cycles, and what of it repeats from cycle to cycle.
- ``step``: 10 mm up and down. Error at the end of the hold, overshoot, and the time from the step
  until the error stays within 0.1 mm. Shown are the first and the sixth step after sines. So is
  the share of the steps of eight seeds that are within 0.1 mm in time.
- ``gait``: knee flexion, ten strides at 0.8 Hz after ten at 0.5 Hz.
- ``rigs``: random rigs that differ from the data sheet, +-6 mm about 12 mm. All start from the
  rules taught on the nominal rig, beside the same rules frozen.
- ``change``: 1 kg more, and 15 % less supply of the on/off valves, in the middle of a run at
  0.5 Hz, rules taught.

The valve driver is told of the nominal rig throughout. With ``--hidden`` all runs are on rigs of
the independent simulator under test/hidden, which are off by up to 30 % and have other equations.
Rules then are taught there too, but for ``rigs``.
"""

import argparse
from dataclasses import dataclass
from typing import Callable

from hidden_rig import hidden_loop, hidden_rig, OnHiddenRig
import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.experiments import load_experiment
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_actuation.tuning.random_rigs import random_rigs
from pam_sim import load_rig
from pam_sim.units import GRAVITY_M_PER_S2
import results_page

RIG = 'dmsp_5_300_realistic'
FREQUENCIES_HZ = (0.1, 0.25, 0.5, 1.0)
CYCLES = 20
SEED = 3
TEACHING = ((0.1, 3), (1.0, 30), (0.25, 8), (0.5, 20))      # frequency and cycles, in order
HIDDEN_SEED, HIDDEN_RIGS = 821, 30
SETTLED_M = 1e-4
STEPS, STEP_HOLD_S, STEP_SEEDS = 6, 5.0, range(8)
IN_TIME_S = 0.6


@dataclass(frozen=True)
class Controller:
    """A row of the tables: a name and how to build it for a rig; ``learns``: it has rules."""

    name: str
    build: Callable
    learns: bool = False


def preset(name):
    """Return how to build the preset of a name, tuned for the valve of the rig."""
    return lambda rig: load_controller(name if rig.valve == 'ppr' else f'{name}_hsv', rig)


CONTROLLERS = (
    Controller('SOFC', lambda rig: load_controller(f'sofc_{rig.valve}', rig), learns=True),
    Controller('SOFC with model', lambda rig: load_controller(f'sofc_model_{rig.valve}', rig),
               learns=True),
    Controller('ILC, tuned', lambda rig: load_controller(f'ilc_{rig.valve}', rig)),
    Controller('MPC, tuned', lambda rig: load_controller(f'mpc_{rig.valve}', rig)),
    Controller('LQI, tuned', preset('lqi')),
    Controller('PID + inverse, tuned', preset('pid')),
    Controller('PID, tuned', preset('pid_plain')),
)


def sine(frequency_hz, cycles=CYCLES, center_m=0.014, amplitude_m=0.010):
    """Return the experiment: up to the lowest point, wait, then the sine."""
    return load_experiment(f"""
name: sine
segments:
  - rest: {{duration_s: 1.0}}
  - ramp: {{to_m: {center_m - amplitude_m}, duration_s: 2.0}}
  - hold: {{duration_s: 2.0}}
  - sine: {{center_m: {center_m}, amplitude_m: {amplitude_m}, frequency_hz: {frequency_hz},
           cycles: {cycles}}}
""")


def steps():
    """Return the experiment: 10 mm up and down, again and again."""
    segments = ''.join(
        f'  - step: {{to_m: {to_m}, duration_s: {STEP_HOLD_S}}}\n'
        for _ in range(STEPS) for to_m in (0.018, 0.008))
    return load_experiment(f"""
name: steps
segments:
  - rest: {{duration_s: 1.0}}
  - ramp: {{to_m: 0.008, duration_s: 2.0}}
  - hold: {{duration_s: 2.0}}
{segments}""")


def closed_loop(rig, experiment, seed=SEED, **more):
    """Return the closed loop with the driver of the nominal rig."""
    if isinstance(rig, OnHiddenRig):
        return hidden_loop(rig, experiment, seed=seed, **more)
    driver = driver_config(load_rig(RIG, valve=rig.valve))
    return ClosedLoop(rig, experiment, seed=seed, driver=driver, **more)


def chosen_rig(valve, hidden):
    """Return the rig of all tables but that of random rigs."""
    return hidden_rig(valve, HIDDEN_SEED) if hidden else load_rig(RIG, valve=valve)


def named(rig):
    """Return the valve of a rig, and whether that rig is a hidden one, for headings."""
    return f'{rig.valve}, a hidden rig' if isinstance(rig, OnHiddenRig) else rig.valve


def cycles_m(result):
    """Return the errors [m] of a run as one row per cycle."""
    start_s, period_s, count = result.cycle_s
    ticks = round(period_s / (result.time_s[1] - result.time_s[0]))
    start = round(start_s / (result.time_s[1] - result.time_s[0]))
    return result.error_m[start:start + count * ticks].reshape(count, ticks)


def rms_mm(error_m):
    """Return the root mean square of errors, mm."""
    return 1e3 * float(np.sqrt(np.mean(np.square(error_m))))


def taught(controller, rig, center_m, amplitude_m):
    """Let a controller with rules learn sines on a rig; return it."""
    for frequency_hz, cycles in TEACHING:
        closed_loop(rig, sine(frequency_hz, cycles, center_m, amplitude_m),
                    SEED + 1).run(controller)
    return controller


def show_sines(valve, controllers, hidden):
    """Print error per frequency and controller."""
    rig = chosen_rig(valve, hidden)
    loops = [closed_loop(rig, sine(f)) for f in FREQUENCIES_HZ]
    print(f'\n## Sine, {named(rig)}: '
          f'RMSE (largest error; part that repeats) of cycle {CYCLES} [mm]\n')
    print('| controller | ' + ' | '.join(f'{f:g} Hz' for f in FREQUENCIES_HZ) + ' |')
    print('|---|' + '---|' * len(FREQUENCIES_HZ))
    for one in controllers:
        cells = []
        for loop in loops:
            errors = cycles_m(loop.run(one.build(rig)))
            cells.append(f'{rms_mm(errors[-1]):.3f} ({1e3 * np.abs(errors[-1]).max():.2f}; '
                         f'{rms_mm(errors[-4:].mean(axis=0)):.3f})')
        print(f'| {one.name} | ' + ' | '.join(cells) + ' |', flush=True)


def step_figures(result, start_s, end_s, size_m):
    """Return (error at the end mm, overshoot %, settling s) of one step of a run."""
    inside = (result.time_s >= start_s) & (result.time_s < end_s)
    error_m = result.error_m[inside] * np.sign(size_m)
    time_s = result.time_s[inside] - start_s
    outside = np.flatnonzero(np.abs(error_m) > SETTLED_M)
    settled_s = time_s[outside[-1]] if outside.size else 0.0
    return (1e3 * abs(float(error_m[-200:].mean())),
            100.0 * max(0.0, -float(error_m.min())) / abs(size_m), settled_s)


def staircase_figures(result):
    """Return ``step_figures`` of every step of a run: (step, up or down, figure)."""
    starts_s = 5.0 + STEP_HOLD_S * np.arange(2 * STEPS)
    figures = [step_figures(result, start_s, start_s + STEP_HOLD_S, (0.01, -0.01)[k % 2])
               for k, start_s in enumerate(starts_s)]
    return np.reshape(figures, (STEPS, 2, 3))


def show_steps(valve, controllers, hidden):
    """Print what a step of 10 mm up and one down do, once and over several seeds."""
    rig = chosen_rig(valve, hidden)
    loops = [closed_loop(rig, steps(), seed) for seed in (SEED, *STEP_SEEDS)]
    shares = []
    print(f'\n## Step of 10 mm, {named(rig)}\n')
    print('| controller | step | up: end [mm] | overshoot [%] | settled [s] '
          '| down: end [mm] | overshoot [%] | settled [s] |')
    print('|---|' + '---|' * 7)
    for one in controllers:
        controller = one.build(rig)
        if one.learns:
            rules = taught(controller, rig, 0.014, 0.010).rules.copy()
        runs = []
        for loop in loops:
            if one.learns:
                controller.rules.assign(rules)
            runs.append(staircase_figures(loop.run(controller)))
        for number in (0, STEPS - 1):
            cells = [f'{figure:.3f}' for figure in runs[0][number].ravel()]
            print(f'| {one.name} | {number + 1} | ' + ' | '.join(cells) + ' |', flush=True)
        end_mm, overshoot, settled_s = np.reshape(runs[1:], (-1, 3)).T
        shares.append(
            f'| {one.name} | {settled_s.size} | {100.0 * np.mean(settled_s <= IN_TIME_S):.0f} '
            f'| {np.median(settled_s):.2f} | {settled_s.max():.2f} | {overshoot.max():.1f} '
            f'| {end_mm.max():.3f} |')
    print(f'\n{len(STEP_SEEDS)} seeds of the noise:\n\n| controller | steps '
          f'| settled within {IN_TIME_S:g} s [%] | median [s] | slowest [s] '
          '| largest overshoot [%] | largest end [mm] |')
    print('|---|' + '---|' * 6)
    print('\n'.join(shares), flush=True)


def show_gait(valve, controllers, hidden):
    """Print the error of the tenth stride of a knee at 0.8 Hz."""
    rig = chosen_rig(valve, hidden)
    experiment = load_experiment('knee_gait')
    loop = closed_loop(rig, experiment)
    stroke_m = np.ptp(loop.reference_m[round(6.0 * loop.rate_hz):])
    end = round((experiment.duration_s - 0.5) * loop.rate_hz)
    stride = round(loop.rate_hz / 0.8)
    print(f'\n## Knee gait at 0.8 Hz, {named(rig)}: stroke {stroke_m * 1e3:.1f} mm\n')
    print('| controller | first stride [mm] | tenth stride [mm] | of the stroke [%] |')
    print('|---|---|---|---|')
    for one in controllers:
        error_m = loop.run(one.build(rig)).error_m
        last = rms_mm(error_m[end - stride:end])
        first = rms_mm(error_m[end - 10 * stride:end - 9 * stride])
        print(f'| {one.name} | {first:.3f} | {last:.3f} | {0.1 * last / stroke_m:.2f} |',
              flush=True)


def show_random_rigs(valve, controllers, hidden, count, frequency_hz=0.5):
    """Print how the same taught rules fare on rigs they were not taught on."""
    nominal = load_rig(RIG, valve=valve)
    experiment = sine(frequency_hz, CYCLES, 0.012, 0.006)
    rigs = ([hidden_rig(valve, HIDDEN_SEED + 1 + k) for k in range(count)] if hidden
            else random_rigs(nominal, count, SEED))
    print(f'\n## {count} {"hidden" if hidden else "random"} rigs, {valve}: '
          f'RMSE of cycle {CYCLES} at {frequency_hz:g} Hz, +-6 mm about 12 mm\n')
    print('| controller | nominal [mm] | median | worst | median/nominal | worst/nominal '
          '| worst ratio to frozen rules | highest pressure [kPa] |')
    print('|---|' + '---|' * 7)
    for one in controllers:
        if not one.learns:
            continue
        teacher = taught(one.build(nominal), nominal, 0.012, 0.006)
        figures = []
        for k, rig in enumerate((nominal, *rigs)):
            loop = closed_loop(rig, experiment, SEED + k)
            ends = []
            for learn in (True, False):
                controller = one.build(nominal)
                controller.take_rules(teacher.rules)
                result = loop.run(controller, learn)
                ends.append(rms_mm(cycles_m(result)[-1]))
            figures.append((*ends, 1e-3 * (result.pressure_pa.max() - 101_325.0)))
        table = np.array(figures)
        learned, frozen = table[1:, 0], table[1:, 1]
        print(f'| {one.name} | {table[0, 0]:.3f} | {np.median(learned):.3f} | {learned.max():.3f} '
              f'| {np.median(learned) / table[0, 0]:.2f} | {learned.max() / table[0, 0]:.2f} '
              f'| {np.max(learned / frozen):.2f} | {table[:, 2].max():.0f} |', flush=True)


def changes(rig, begins_s):
    """Return the changes that begin at a time [s]; the model of a regulator has no supply."""
    found = {'1 kg more': {
        'external_force_n': lambda t: GRAVITY_M_PER_S2 if t >= begins_s else 0.0}}
    if rig.valve == 'hsv':
        supply_pa = rig.parameters['supply_pa']
        found['supply -15 %'] = {
            'supply_pa': lambda t: supply_pa * (0.85 if t >= begins_s else 1.0)}
    return found


def show_changes(valve, controllers, hidden):
    """Print the cycles after a change in the middle of the run."""
    rig = chosen_rig(valve, hidden)
    frequency_hz, cycles, change = 0.5, 30, 20
    cases = changes(rig, 5.0 + change / frequency_hz)
    print(f'\n## Change in cycle {change + 1} at {frequency_hz:g} Hz, +-6 mm about 12 mm, '
          f'{named(rig)}: RMSE per cycle [mm]\n')
    print('| controller | change | cycle before | 1 after | 2 | 3 | 4 | 5 | 6 | 10 |')
    print('|---|' + '---|' * 9)
    for one in controllers:
        for name, course in cases.items():
            loop = closed_loop(rig, sine(frequency_hz, cycles, 0.012, 0.006), **course)
            controller = one.build(rig)
            if one.learns:
                taught(controller, rig, 0.012, 0.006)
            error = 1e3 * loop.run(controller).cycle_rmse_m()
            cells = [f'{error[change + k]:.3f}' for k in (-1, 0, 1, 2, 3, 4, 5, 9)]
            print(f'| {one.name} | {name} | ' + ' | '.join(cells) + ' |', flush=True)


PARTS = ('sine', 'step', 'gait', 'rigs', 'change')


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--part', default=','.join(PARTS), help='tables, by commas')
    parser.add_argument('--valve', default='ppr,hsv', help='valves, by commas')
    parser.add_argument('--controller', default='', help='only those whose name has this in it')
    parser.add_argument('--rigs', type=int, default=0,
                        help=f'number of random rigs; default 200, of hidden ones {HIDDEN_RIGS}')
    parser.add_argument('--hidden', action='store_true',
                        help='on rigs of the independent simulator')
    results_page.add_write(parser, 'tracking')
    return parser


def show(args):
    """Print the tables that were asked for."""
    chosen = [one for one in CONTROLLERS if args.controller.lower() in one.name.lower()]
    for part in args.part.split(','):
        for valve in args.valve.split(','):
            if part == 'rigs':
                show_random_rigs(valve, chosen, args.hidden, args.rigs or (
                    HIDDEN_RIGS if args.hidden else 200))
            else:
                {'sine': show_sines, 'step': show_steps, 'gait': show_gait,
                 'change': show_changes}[part](valve, chosen, args.hidden)


def part_of_page(args):
    """Return the part of the page that a run writes: one for each choice of controllers."""
    return ' '.join(['hidden'] * args.hidden + args.controller.lower().split())


def main():
    """Print the tables."""
    args = command_line().parse_args()
    with results_page.printed(args, __file__, part_of_page(args)):
        show(args)


if __name__ == '__main__':
    main()
