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
How well dead time and lag from command to pressure are found within 10 s of movement.

Run ``python benchmarks/delay_estimate.py``, with ``--part`` for a part and ``--rigs`` for another
number. The self-organizing controllers track sines, a random motion, steps and a gait in closed
loop, sensor noise on. Their rigs differ from the nominal one in dead time (0 to 80 ms) and lag (10
to 150 ms). Gain and zero of the regulator are wrong by up to 5 % and 5 kPa. Every second pressure
sensor has a lag of up to 20 ms. Behind a regulator the estimate sees the command and the measured
pressure alone, behind on/off valves the duties, the measured pressure and the contraction.

- ``ppr``, ``hsv``: the rigs of this package. Wanted is the first order model that answers best to
  random steps, in open loop and without noise.
- ``command``: on/off valves. The estimate sees the command and the measured pressure alone.
- ``hidden``, ``hidden_hsv``: simulators of other equations, behind a regulator and on/off valves.
- ``change``: dead time and lag change after 30 s. When are the new ones found?
"""

import argparse
from pathlib import Path
import sys
import time

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.delay_estimate import DelayEstimator
from pam_actuation.control.pid import PidController
from pam_actuation.control.valve_delay import ValveDelayEstimator
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.experiments import load_experiment
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_actuation.tuning.loop_parts import WANTED
from pam_actuation.tuning.sampled_reference import SampledReference
from pam_sim import load_rig
from scipy.signal import lfilter

sys.path.append(str(Path(__file__).resolve().parent.parent / 'test' / 'hidden'))

import hidden_rig as hidden_rigs  # noqa: E402, I100
import results_page  # noqa: E402
import tracking  # noqa: E402
import truth_live  # noqa: E402
import truth_rig  # noqa: E402
import unrepeated  # noqa: E402

RIG = 'dmsp_5_300_realistic'
RATE_HZ, LATENCY_S = 200.0, 0.003
SEED = 2024
WINDOWS_S = {'from the start': (0.0, 13.0), 'later': (20.0, 30.0)}      # 3 s of rest and ramp
NOISE_PA, NOISE_M = 300.0, 1e-5
NEAR_S = 0.010
DELAYS_S, LAGS_S = np.arange(0.0, 0.1205, 1e-3), np.geomspace(0.003, 0.3, 40)
PARTS = ('ppr', 'hsv', 'command', 'hidden', 'hidden_hsv', 'change')


def motions():
    """Return {name: experiment}."""
    return {'sine 0.25 Hz': tracking.sine(0.25, 7), 'sine 0.5 Hz': tracking.sine(0.5, 14),
            'sine 1 Hz': tracking.sine(1.0, 27), 'random': unrepeated.random_motion(11, 30.0),
            'steps': tracking.steps(), 'gait': unrepeated.gait()}


def controllers(valve):
    """Return the names of the presets in the loop."""
    return f'sofc_model_{valve}', f'sofc_{valve}'


def drawn(nominal, random, with_lag):
    """Return (rig, lag of its pressure sensor [s])."""
    part = random.uniform(size=7)
    lag_s = 0.02 * part[5] if with_lag else 0.0
    changed = {'mass_kg': 4.0 + 1.5 * part[4]}
    if nominal.valve == 'ppr':
        changed |= {'T_m': 0.010 * 15.0 ** part[1], 'K_m': 1e5 * (0.95 + 0.1 * part[2]),
                    'ppr_zero_pa': 1e4 * (part[3] - 0.5)}
    else:
        changed |= {'C': nominal.parameters['C'] * (0.7 + 0.6 * part[1])}
    effects = [one for one in nominal.effects if one.name != 'valve_dead_time']
    effects.append({'name': 'valve_dead_time', 'parameters': {'delay_s': 0.08 * part[0]}})
    if with_lag:
        effects.append({'name': 'pressure_lag', 'parameters': {'time_constant_s': lag_s}})
    return nominal.with_(parameters=changed, effects=effects), lag_s


def behind(pressure_pa, lag_s, rate_hz=RATE_HZ):
    """Return a pressure behind the lag of a sensor."""
    keep = np.exp(-1.0 / (rate_hz * lag_s)) if lag_s > 0.0 else 0.0
    return lfilter([1.0 - keep], [1.0, -keep], pressure_pa, zi=[keep * pressure_pa[0]])[0]


def random_steps():
    """Return the experiment: random steps of contraction, 0.25 to 0.9 s apart."""
    random = np.random.default_rng(3)
    return load_experiment('name: steps\nsegments:\n' + ''.join(
        f'  - step: {{to_m: {random.uniform(0.006, 0.022):.5f}, '
        f'duration_s: {random.uniform(0.25, 0.9):.2f}}}\n' for _ in range(25)))


def wanted(rig, lag_s, nominal):
    """Return (dead time [s], lag [s]) of the model that answers best to random steps."""
    controller = PidController(
        load_controller(f'sofc_{rig.valve}', nominal).static_inverse,
        {'use_static_inverse': 1.0, 'proportional_pa_per_m': 0.0, 'integral_pa_per_m_s': 0.0,
         'derivative_pa_s_per_m': 0.0})
    run = ClosedLoop(rig, random_steps(), driver=driver_config(nominal),
                     latency_s=LATENCY_S).run(controller)
    fine = round(1000.0 / RATE_HZ)
    u, p = np.repeat(run.command_pa, fine), behind(run.pressure_pa, lag_s)
    best = None
    for lag in LAGS_S:
        keep = np.exp(-1e-3 / lag)
        output = lfilter([0.0, 1.0 - keep], [1.0, -keep], u - u[0])
        for delay in DELAYS_S:
            y = np.r_[np.zeros(round(1e3 * delay)), output][:u.size:fine]
            y -= y.mean()
            explained = (y @ p) ** 2 / (y @ y)
            if best is None or explained > best[0]:
                best = explained, delay, lag
    return best[1:]


def estimated(command_pa, pressure_pa):
    """Return (confident, dead time [s], lag [s], uncertainty [s]) of 10 s of movement."""
    estimator = DelayEstimator(RATE_HZ)
    sure = estimator.steps(command_pa, pressure_pa)
    found = estimator.estimate(unsure=True)
    return sure, found.delay_s, found.lag_s, found.uncertainty_s


def of_duties(run, measured, inside, random):
    """Return what ``estimated`` does, of the duties; the lag is NaN."""
    estimator = ValveDelayEstimator(RATE_HZ)
    contraction = run.contraction_m[inside] + NOISE_M * random.standard_normal(measured.size)
    estimator.steps(*run.signal[inside].T, measured, contraction)
    sure, found = estimator.estimate() is not None, estimator.estimate(unsure=True)
    return sure, found.delay_s, found.lag_s, found.uncertainty_s


def driver_wait_s(nominal):
    """Return how long a command waits for the driver on average, which takes one a period [s]."""
    return 0.5 * (nominal.parameters['pwm_period_s'] - 1.0 / RATE_HZ)


def of_rigs(valve, count, seed, duties):
    """
    Yield (controller, motion, window, estimate, wanted) on the rigs of this package.

    ``duties``: the estimate is that of the duties, otherwise that of the command.
    """
    random, other = np.random.default_rng(seed), np.random.default_rng((seed, 1))
    nominal = load_rig(RIG, valve=valve)
    for k in range(count):
        rig, lag_s = drawn(nominal, random, k % 2 == 1)
        want = wanted(rig, lag_s, nominal)
        for motion, experiment in motions().items():
            loop = ClosedLoop(rig, experiment, seed=k, driver=driver_config(nominal),
                              latency_s=LATENCY_S)
            for name in controllers(valve):
                run = loop.run(load_controller(name, nominal))
                measured = behind(run.pressure_pa, lag_s) + NOISE_PA * random.standard_normal(
                    run.time_s.size)
                for window, (first_s, last_s) in WINDOWS_S.items():
                    inside = slice(round(first_s * RATE_HZ), round(last_s * RATE_HZ))
                    if duties:
                        found = of_duties(run, measured[inside], inside, other)
                        wait_s = driver_wait_s(nominal)
                    else:
                        found, wait_s = estimated(run.command_pa[inside], measured[inside]), 0.0
                    yield name, motion, window, found, (want[0] - wait_s, want[1])


def hidden_rig(random):
    """Return (live rig, numbers): random, of other equations; dead time and lag stand in it."""
    part = random.uniform(size=10)
    numbers = {
        'delay': 0.08 * part[0], 't_m': 0.010 * 15.0 ** part[1],
        'k_m': 1e5 * (0.95 + 0.1 * part[2]),
        'play': 1e3 * part[3], 'vent_ratio': 1.0 + 0.4 * part[4], 'mass': 4.0 + 1.5 * part[5],
        'gain_map': 0.9 + 0.2 * part[6], 'loop': 1.0 + part[7], 'loop_400': 2.0 * part[8],
        'creep_1': 60.0, 'creep_t1': 1.0, 'creep_2': 60.0, 'creep_t2': 20.0}
    noise = random.standard_normal((100_000, 2))
    tick = iter(range(100_000))

    def readings(pressure, contraction, force):
        row = noise[next(tick)]
        return pressure + NOISE_PA * row[0], contraction + NOISE_M * row[1], force

    return truth_live.LiveRig(numbers, readings), numbers


def followed(live, controller, experiment, duration_s, at_tick=lambda k: None):
    """Return (command, measured pressure) [Pa] of the controller on a hidden rig."""
    want = SampledReference(experiment, RATE_HZ).rows(controller.lead_s).view(WANTED)
    count = min(round(duration_s * RATE_HZ), len(want))
    steps = round(1.0 / (RATE_HZ * live.dt_s))
    rows = np.empty((count, 2))
    for k in range(count):
        at_tick(k)
        now, measured = want[k], live.pressure_pa
        command = controller.step(
            live.contraction_m, now.reference, now.rate, now.lead, now.lead_rate,
            pressure_pa=measured)
        rows[k] = command, measured
        live.step(((command - truth_rig.ATM) / 1e5,), steps=steps)
    return rows.T


def of_hidden(count, seed):
    """Yield what ``of_rigs`` does, on hidden rigs behind a regulator."""
    random = np.random.default_rng(seed + 1)
    nominal = load_rig(RIG)
    for k in range(count):
        seed = random.integers(2 ** 32)
        for motion, experiment in motions().items():
            for name in controllers('ppr'):
                live, numbers = hidden_rig(np.random.default_rng(seed))
                command, measured = followed(
                    live, load_controller(name, nominal), experiment, 30.0)
                lag_s = 0.5 * numbers['t_m'] * (1.0 + numbers['vent_ratio'])
                for window, (first_s, last_s) in WINDOWS_S.items():
                    inside = slice(round(first_s * RATE_HZ), round(last_s * RATE_HZ))
                    yield (name, motion, window, estimated(command[inside], measured[inside]),
                           (numbers['delay'], lag_s))


def of_hidden_valves(count, seed):
    """Yield what ``of_rigs`` does of the duties, on hidden rigs; wanted is their dead time."""
    random = np.random.default_rng((seed, 2))
    nominal = load_rig(RIG, valve='hsv')
    for k in range(count):
        rig = hidden_rigs.hidden_rig('hsv', int(random.integers(2 ** 31)))
        rig.numbers['delay'] = 0.08 * random.uniform()
        for motion, experiment in motions().items():
            loop = hidden_rigs.hidden_loop(rig, experiment, seed=k, latency_s=LATENCY_S)
            for name in controllers('hsv'):
                run = loop.run(load_controller(name, nominal))
                measured = run.pressure_pa + NOISE_PA * random.standard_normal(run.time_s.size)
                for window, (first_s, last_s) in WINDOWS_S.items():
                    inside = slice(round(first_s * RATE_HZ), round(last_s * RATE_HZ))
                    yield (name, motion, window,
                           of_duties(run, measured[inside], inside, random),
                           (rig.numbers['delay'] + LATENCY_S, np.nan))


def percent(share):
    """Return a share as a whole number of percent, a dash for NaN."""
    return '–' if np.isnan(share) else f'{100.0 * share:.0f}'


def show(title, rows):
    """Print the shares of a row of (controller, motion, window, estimate, wanted)."""
    print(f'\n## {title}\n')
    print('| controller | motion | within 10 ms, from the start [%] | later [%] '
          '| sure, from the start [%] | later [%] | of these within 10 ms [%] '
          '| median error [ms] | of the lag [%] |')
    print('|---|---|' + '---|' * 7)
    found = {}
    for name, motion, window, estimate, want in rows:
        for key in ((name, motion), ('all', 'all')):
            found.setdefault(key, []).append((
                window == 'later', *estimate[:2], estimate[1] - want[0],
                estimate[2] / want[1] - 1.0))
    found['all', 'all'] = found.pop(('all', 'all'))         # last
    for (name, motion), values in found.items():
        late, sure, _, error_s, lag = np.transpose(values)
        late, sure, near = late > 0.5, sure > 0.5, np.abs(error_s) <= NEAR_S
        cells = [100.0 * near[~late].mean(), 100.0 * near[late].mean(), 100.0 * sure[~late].mean(),
                 100.0 * sure[late].mean(), 100.0 * near[sure].mean() if sure.any() else np.nan]
        print(f'| {name} | {motion} | ' + ' | '.join(f'{cell:.0f}' for cell in cells)
              + f' | {1e3 * np.median(np.abs(error_s)):.1f} '
              f'| {percent(np.median(np.abs(lag)))} |', flush=True)


def show_change(count, seed):
    """Print how long after a change of dead time and lag the new ones are found."""
    print('\n## Change after 30 s\n')
    print('| motion | found again within 10 ms, median [s] | slowest [s] | never in 60 s [%] '
          '| sure and wrong, longest [s] |')
    print('|---|' + '---|' * 4)
    nominal = load_rig(RIG)
    for motion in ('sine', 'random'):
        random = np.random.default_rng(seed + 2)
        experiment = (tracking.sine(0.5, 48) if motion == 'sine'
                      else unrepeated.random_motion(12, 90.0))
        times, wrong = [], []
        for _ in range(count):
            live, numbers = hidden_rig(random)
            other = 0.08 * random.uniform(), 0.010 * 15.0 ** random.uniform()

            def change(k, live=live, other=other):
                if k == round(30.0 * RATE_HZ):
                    live.change(delay=other[0], t_m=other[1])
            command, measured = followed(
                live, load_controller('sofc_model_ppr', nominal), experiment, 90.0, change)
            estimator, states = DelayEstimator(RATE_HZ), []
            for k in range(0, command.size, 20):
                sure = estimator.steps(command[k:k + 20], measured[k:k + 20])
                found = estimator.estimate(unsure=True)
                states.append((sure, found.delay_s if found else np.inf))
            sure, delay_s = np.transpose(states)[:, round(30.0 * RATE_HZ) // 20:]
            near = np.abs(delay_s - other[0]) <= NEAR_S
            last = np.flatnonzero(~near)[-1] + 1 if not near.all() else 0
            times.append(last * 20 / RATE_HZ if last < near.size else np.inf)
            wrong.append(np.sum((sure > 0.5) & ~near) * 20 / RATE_HZ)
        finite = np.array(times)[np.isfinite(times)]
        print(f'| {motion} | {np.median(times):.1f} | {finite.max():.1f} '
              f'| {100.0 * (1.0 - finite.size / count):.0f} | {max(wrong):.1f} |', flush=True)


def show_speed():
    """Print what a tick takes."""
    estimator, value = DelayEstimator(RATE_HZ), np.random.default_rng(0).normal(0.0, 1e4, 20_000)
    estimator.steps(value, value)
    began = time.perf_counter()
    estimator.steps(value, value)
    print(f'\nA tick of the estimator takes {(time.perf_counter() - began) / 0.02:.1f} us.')


def show_part(part, count, seed):
    """Print a part."""
    few, fewer = max(1, count // 4), max(1, count // 16)
    if part in ('ppr', 'hsv'):
        show(f'{count} random rigs, {part}', of_rigs(part, count, seed, part == 'hsv'))
    elif part == 'command':
        show(f'{count} random rigs, hsv, of the command alone', of_rigs('hsv', count, seed, False))
    elif part == 'hidden':
        show(f'{few} hidden rigs of other equations, ppr', of_hidden(few, seed))
    elif part == 'hidden_hsv':
        show(f'{fewer} hidden rigs of other equations, hsv', of_hidden_valves(fewer, seed))
    else:
        show_change(max(1, count // 5), seed)
        show_speed()


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--part', default=','.join(PARTS), help='tables, by commas')
    parser.add_argument('--rigs', type=int, default=100, help='number of random rigs')
    parser.add_argument('--seed', type=int, default=SEED, help='of rigs and noise')
    results_page.add_write(parser, 'delay_estimate')
    return parser


def main():
    """Print the tables, each part into its own of the page."""
    args = command_line().parse_args()
    parts = args.part.split(',')
    for part in parts:
        results_page.check(args, __file__, part)
    for part in parts:
        with results_page.printed(args, __file__, part):
            show_part(part, args.rigs, args.seed)


if __name__ == '__main__':
    main()
