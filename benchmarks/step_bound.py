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
How soon the steps of ``unrepeated.py`` could settle behind a regulator, at best.

Run ``python benchmarks/step_bound.py``, with ``--rigs`` for another number. The run of a
controller is played up to a step, on the same random rigs. From there on, the signal of the valve
is searched that keeps the muscle within 0.1 mm from a given time on. The search knows the rig and
its state, so what is left is the bound of valve, dead time, load and friction. It begins with the
signal of the controller and corrects it at 19 times, straight between them, by Levenberg and
Marquardt. Found is a lower bound of what is possible.
"""

import argparse

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.tuning.random_rigs import random_rigs
from pam_sim import load_rig
import results_page
from unrepeated import (
    closed_loop, RIG, RIG_SEED, RIGS, SETTLED_M, step_figures, STEP_HOLD_S, STEPS,
    steps_after_motion, STEPS_FROM_S)

VALVE, CONTROLLER = 'ppr', 'sofc_model_ppr'
RATE_HZ, STEPS_A_TICK, LATENCY = 200, 5, 3        # of 1 ms, as in the closed loops
FROM_S = (0.6, 0.45, 0.35)
TICKS = round(STEP_HOLD_S * RATE_HZ)
TIME_S = np.arange(TICKS) / RATE_HZ
CORRECTED_S = np.r_[np.arange(0.0, 0.651, 0.05), 0.8, 1.1, 1.6, 2.5, 3.7, 5.0]
COURSES = np.array([np.interp(TIME_S, CORRECTED_S, row) for row in np.eye(CORRECTED_S.size)])
TRIES, DAMPINGS, CHANGE_V = 6, 4, 0.02
TARGETS_M = (0.018, 0.008)


class Replay:
    """A rig that plays a recorded signal of its valve, and any other from where it is."""

    def __init__(self, rig):
        self._plant, self._before = rig.plant(0), 0.0
        self._limits = [rig.parameters[name] for name in ('ppr_lowest_v', 'ppr_highest_v')]

    def play(self, signal_v):
        """Advance by the signals of some ticks; return the contraction [m] at each."""
        found = np.empty(len(signal_v))
        for tick, signal in enumerate(np.clip(signal_v, *self._limits)):
            found[tick] = self._plant.contraction_m
            self._plant.step((self._before,), steps=LATENCY)
            self._plant.step((signal,), steps=STEPS_A_TICK - LATENCY)
            self._before = signal
        return found

    def tried(self, signal_v):
        """Return what ``play`` would, and stay."""
        state, before = self._plant.state.copy(), self._before
        found = self.play(signal_v)
        self._plant.state[:], self._before = state, before
        return found


def largest_error_m(replay, signal_v, target_m, from_s):
    """Return the least largest error [m] from a time after the step on that the search finds."""
    # All ticks of the first second, then every tenth: the rest is slow.
    seen = (from_s <= TIME_S) & ((TIME_S < 1.0) | (np.arange(TICKS) % 10 == 0))

    def errors_mm(change):
        return 1e3 * (replay.tried(signal_v + change @ COURSES)[seen] - target_m)

    change = np.zeros(CORRECTED_S.size)
    errors, damping = errors_mm(change), 1e-3
    for _ in range(TRIES):
        if np.abs(errors).max() < 500.0 * SETTLED_M:
            break
        slopes = np.column_stack([
            (errors_mm(change + CHANGE_V * one) - errors) / CHANGE_V
            for one in np.eye(change.size)])
        normal = slopes.T @ slopes
        for _ in range(DAMPINGS):
            part = damping * np.trace(normal) / change.size * np.eye(change.size)
            new = change - np.linalg.solve(normal + part, slopes.T @ errors)
            new_errors = errors_mm(new)
            if new_errors @ new_errors < errors @ errors:
                change, errors, damping = new, new_errors, damping / 4.0
                break
            damping *= 8.0
        else:
            break
    return 1e-3 * np.abs(errors).max()


def bounds(rig, number, controller):
    """Return (step, time) largest errors [m] at best, and the settling times [s] of the run."""
    run = closed_loop(rig, steps_after_motion(RIG_SEED + number), number, 0.0).run(controller)
    replay, signal_v = Replay(rig), run.signal[:, 0]
    begin = round(STEPS_FROM_S * RATE_HZ)
    played = replay.play(signal_v[:begin])
    if not np.array_equal(played, run.contraction_m[:begin]):
        raise RuntimeError('the recorded signal does not make the same motion')
    found = []
    for step in range(STEPS):
        signal = signal_v[begin + step * TICKS:begin + (step + 1) * TICKS]
        found.append([largest_error_m(replay, signal, TARGETS_M[step % 2], from_s)
                      for from_s in FROM_S])
        replay.play(signal)
    return np.array(found), np.array([settled_s for settled_s, _ in step_figures(run)])


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--rigs', type=int, default=RIGS, help='how many random rigs')
    results_page.add_write(parser, 'unrepeated')
    return parser


def main():
    """Print the table."""
    args = command_line().parse_args()
    nominal = load_rig(RIG, valve=VALVE)
    with results_page.printed(args, __file__):
        found = [bounds(rig, number, load_controller(CONTROLLER, nominal))
                 for number, rig in enumerate(random_rigs(nominal, args.rigs, seed=RIG_SEED))]
        errors_m, settled_s = (np.array(part) for part in zip(*found))
        print(f'\n## Steps of {args.rigs} random rigs, {VALVE}: at best and with a controller\n')
        print('| within 0.1 mm from | possible [%] | largest error at best, worst step [mm] '
              f'| {CONTROLLER} [%] |')
        print('|---|---|---|---|')
        for k, from_s in enumerate(FROM_S):
            possible = 100.0 * np.mean(errors_m[..., k] <= SETTLED_M)
            print(f'| {from_s:g} s | {possible:.0f} | {1e3 * errors_m[..., k].max():.2f} '
                  f'| {100.0 * np.mean(settled_s <= from_s):.0f} |', flush=True)


if __name__ == '__main__':
    main()
