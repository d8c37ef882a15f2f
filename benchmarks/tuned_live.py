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
A tuned controller on the live nodes against the same in simulation.

Run ``python benchmarks/tuned_live.py``. It tunes from the untuned defaults and writes controller
and rule file as ``pam tune`` does. Both files then run on live nodes and in the simulation, with
the tuned rules frozen and with learning. Errors are RMSE of the recorded measurements, over all
cycles and over the last three. Of the simulation the table has the median over five seeds of the
sensor noise, and the largest.
"""

import argparse
import os
import sys
import tempfile

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.report.metrics import run_metrics
from pam_actuation.rigging.session import run_experiment
from pam_actuation.tuning.tune import tune
from pam_sim import load_rig
import results_page

RIG = 'dmsp_5_300_realistic'
SEARCHED = ('tuning_quarter_hz', 'tuning_half_hz', 'tuning_one_hz')
CHECK = 'tuning_check'
SEEDS = range(2, 7)             # of the simulations


def tuned_file(rig, folder, rollouts, jobs):
    """Tune from the defaults; return the path of the controller, its rules beside it."""
    result = tune(
        rig, load_controller('sofc_untuned', rig), [load_experiment(name) for name in SEARCHED],
        budget=rollouts, seed=1, jobs=jobs, held_out=load_experiment(CHECK))
    print(f'{rig.valve}: {result.text()}\n', flush=True)
    path = os.path.join(folder, f'tuned_{rig.valve}.yaml')
    result.save(path, os.path.join(folder, f'tuned_{rig.valve}_rules.json'))
    return path


def errors_mm(bag):
    """Return the RMSE over all cycles and over the last three of a recording [mm]."""
    squares = (run_metrics(load_run(bag)).cycle_rmse_m * 1e3) ** 2
    return np.sqrt([squares.mean(), squares[-3:].mean()])


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--experiments', default='sine_half_hz,sine_quarter_hz_short')
    parser.add_argument('--valve', default='ppr,hsv', help='valves, by commas')
    parser.add_argument('--rollouts', type=int, default=3000)
    parser.add_argument('--jobs', type=int, default=-1)
    parser.add_argument('--domain-id', type=int, default=None, help='ROS domain')
    results_page.add_write(parser, 'tuned_live')
    return parser


def show(args):
    """Print what was tuned, and one line per experiment, valve and way."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for valve in args.valve.split(','):
            rig = load_rig(RIG, valve=valve)
            path = tuned_file(rig, folder, args.rollouts, args.jobs)
            for name in args.experiments.split(','):
                for learning in (True, False):
                    tag = os.path.join(folder, f'{name}_{valve}_{learning}')
                    live = run_experiment(
                        load_experiment(name), rig, load_controller(path, rig), valve,
                        f'{tag}_live', learning=learning, seed=1, domain_id=args.domain_id)
                    simulated = np.array([errors_mm(simulate_experiment(
                        load_experiment(name), rig, load_controller(path, rig), f'{tag}_sim',
                        seed=seed, learning=learning, overwrite=True)['bag']) for seed in SEEDS])
                    if live.failure or live.findings:
                        print(f'{name} {valve}: {live.failure} {live.findings}', flush=True)
                    mid = np.median(simulated, axis=0)
                    rows.append(f'| {name} | {valve} | {"learning" if learning else "frozen"} ')
                    for k, error in enumerate(errors_mm(live.bag)):
                        rows[-1] += (f'| {error:.3f} | {mid[k]:.3f}, {simulated[:, k].max():.3f} '
                                     f'| {error / mid[k]:.2f} ')
                    rows[-1] += '|'
                    print(rows[-1], file=sys.stderr, flush=True)
    print('\n| experiment | valve | tuned table | live, all cycles [mm] | simulated | ratio '
          '| live, last three [mm] | simulated | ratio |')
    print('|---|---|---|---|---|---|---|---|---|')
    print('\n'.join(rows))


if __name__ == '__main__':
    sys.exit(results_page.run(command_line(), __file__, show))
