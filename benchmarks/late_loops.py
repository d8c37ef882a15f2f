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
What it costs when loops stand still for a moment, offline: stalls of random length.

Run ``python benchmarks/late_loops.py``. A sine of 1 Hz, +-10 mm about 14 mm, on a virtual clock.
From second 10 on, every 1.7 s, some of the loops stand still, all at the same time, and tick once
at the end. A stall costs the largest error within 1.2 s from its begin, over the way that the
reference can go meanwhile, which is its highest speed times the stall.
"""

import argparse

import command_age
import numpy as np
import results_page

HZ = 1.0
SPEED_MM_PER_S = 2.0 * np.pi * HZ * 10.0
FIRST_S, EVERY_S, WINDOW_S = 10.0, 1.7, 1.2
RATES_HZ = {'plant': 250, 'controller': 200, 'driver': {'ppr': 200, 'hsv': 100}, 'reference': 100}
LOOPS = (('plant',), ('controller',), ('driver',), ('controller', 'driver'), tuple(RATES_HZ))
LENGTHS_MS = ((20, 90), (100, 200))


def stalls(duration_s, lengths_ms, seed=1):
    """Return (begin, end) of each stall [ns since the start]."""
    draw, found, at_s = np.random.default_rng(seed), [], FIRST_S
    while at_s < duration_s - 2.0:
        begin_ns = int((at_s + draw.uniform(0.0, 0.5)) * 1e9)
        found.append((begin_ns, begin_ns + int(draw.uniform(*lengths_ms) * 1e6)))
        at_s += EVERY_S
    return found


def ticks_with(found, rate_hz, duration_s, lead_s):
    """Return when a loop ticks that stands still then."""
    def times():
        for k in range(-round(lead_s * rate_hz), round(duration_s * rate_hz) + 5):
            time_ns = k * round(1e9 / rate_hz)
            if not any(begin < time_ns < end for begin, end in found):
                yield time_ns

    return np.array(sorted({*times(), *(end for _, end in found)}))


def costs(valve, loops, lengths_ms):
    """Return (largest errors [mm], their ratios to the way, ticks that vented)."""
    experiment = command_age.sine(HZ)
    found = stalls(experiment.duration_s, lengths_ms)
    ticks = {}
    for loop in loops:
        rate_hz = RATES_HZ[loop]
        ticks[loop] = ticks_with(
            found, rate_hz[valve] if isinstance(rate_hz, dict) else rate_hz,
            experiment.duration_s, 0.0 if loop == 'reference' else 0.1)
    run = command_age.simulated(experiment, ticks, valve=valve)
    moved, asked = run.topics['contraction'], run.topics['reference']
    wanted = np.interp(moved.stamp_ns, asked.stamp_ns, asked.values['contraction_m'])
    error = 1e3 * np.abs(moved.values['contraction_m'] - wanted)
    at_ns = moved.stamp_ns - asked.stamp_ns[0]
    worst, ways = [], []
    for begin, end in found:
        worst.append(error[(at_ns > begin) & (at_ns < begin + WINDOW_S * 1e9)].max())
        ways.append(SPEED_MM_PER_S * (end - begin) * 1e-9)
    followed = run.topics['followed_pressure']
    moving = followed.stamp_ns - asked.stamp_ns[0] > FIRST_S * 1e9
    vented = int(np.sum(followed.values['pressure_pa'][moving] < 101_326.0))
    return np.array(worst), np.array(worst) / np.array(ways), vented


def show():
    """Print the table as Markdown."""
    print('| valve | who stands still | for [ms] | largest error [mm] | over the way, median '
          '| largest | vented |\n|---|---|---|---|---|---|---|')
    for valve in ('ppr', 'hsv'):
        for loops in LOOPS:
            for lengths_ms in LENGTHS_MS:
                worst, ratios, vented = costs(valve, loops, lengths_ms)
                print(f'| {valve.upper()} | {" and ".join(loops)} | '
                      f'{lengths_ms[0]}–{lengths_ms[1]} | {worst.max():.2f} | '
                      f'{np.median(ratios):.2f} | {ratios.max():.2f} | '
                      f'{"yes" if vented else "no"} |', flush=True)


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    results_page.add_write(parser, 'loop_timing')
    return parser


def main():
    """Run."""
    args = command_line().parse_args()
    with results_page.printed(args, __file__):
        show()


if __name__ == '__main__':
    main()
