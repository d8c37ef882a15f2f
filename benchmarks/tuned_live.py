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

Run ``python benchmarks/tuned_live.py``; it tunes from the untuned defaults, writes controller and
rule file as ``pam tune`` does, and runs both files in ``pam run``'s session (real nodes, real
time) and in the offline simulation, with the tuned table frozen and learning on. RMSE over the
whole cycles of the experiment, and in the last one, from the recorded measurements.
"""

import argparse
import os
import tempfile

from pam_actuation.bags.load import load_run
from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.report.metrics import run_metrics
from pam_actuation.rigging.session import run_experiment
from pam_actuation.tuning.tune import tune
from pam_sim import load_rig

RIG = 'dmsp_5_300_realistic'
SEARCHED = ('tuning_quarter_hz', 'tuning_half_hz', 'tuning_one_hz')
CHECK = 'tuning_check'


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
    """Return (RMSE over all cycles, of the last one) of a recording [mm]."""
    cycles = run_metrics(load_run(bag)).cycle_rmse_m * 1e3
    return float((cycles ** 2).mean() ** 0.5), float(cycles[-1])


def main():
    """Tune, run live and simulated, print the table as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--experiments', default='sine_half_hz,sine_quarter_hz_short')
    parser.add_argument('--valve', default='ppr,hsv', help='valves, by commas')
    parser.add_argument('--rollouts', type=int, default=3000)
    parser.add_argument('--jobs', type=int, default=-1)
    parser.add_argument('--domain-id', type=int, default=None, help='ROS domain')
    args = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for valve in args.valve.split(','):
            rig = load_rig(RIG, valve=valve)
            path = tuned_file(rig, folder, args.rollouts, args.jobs)
            for name in args.experiments.split(','):
                for learning in (False, True):
                    tag = os.path.join(folder, f'{name}_{valve}_{learning}')
                    live = run_experiment(
                        load_experiment(name), rig, load_controller(path, rig), valve,
                        f'{tag}_live', learning=learning, seed=1, domain_id=args.domain_id)
                    simulated = simulate_experiment(
                        load_experiment(name), rig, load_controller(path, rig), f'{tag}_sim',
                        seed=2, learning=learning)
                    if live.failure or live.findings:
                        print(f'{name} {valve}: {live.failure} {live.findings}', flush=True)
                    a, b = errors_mm(live.bag), errors_mm(simulated['bag'])
                    rows.append(
                        f'| {name} | {valve} | {"learning" if learning else "frozen"} '
                        f'| {a[0]:.3f} | {b[0]:.3f} | {a[0] / b[0]:.2f} '
                        f'| {a[1]:.3f} | {b[1]:.3f} | {a[1] / b[1]:.2f} |')
                    print(rows[-1], flush=True)
    print('\n| experiment | valve | tuned table | live, all cycles [mm] | simulated | ratio '
          '| live, last cycle [mm] | simulated | ratio |')
    print('|---|---|---|---|---|---|---|---|---|')
    print('\n'.join(rows))


if __name__ == '__main__':
    main()
