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
Tracking error of force mode, joint mode and a joint's torque on realistic rigs, noise on.

::

    python benchmarks/force_and_joint.py
    python benchmarks/force_and_joint.py --seeds 0 1 2 3 4 --json

Force: 20 to 80 N at 0.5 Hz. One load is isometric, held at 10 mm. The other is driven and moves
4 mm about 6 mm at 0.2 Hz; no reference tells the controller. Joint: 20 degrees to either side at
0.5 Hz, on the small joint, and on the knee with the shank of a person, bent by 57 degrees. Torque
has no rules to learn. Held by something heavy, it is 0.5 N m to either side at 0.5 Hz on the small
joint, and 10 N m on the knee. With the limb of the small joint free to swing, it is 0.15 N m.
Printed is the root mean square error of the first and of the last of 20 cycles (torque: 5). Rules
are untaught at the start; the worst of the seeds counts.
"""

import argparse
import json
import math
import sys

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.joint_offline import JointLoops
from pam_actuation.messages import NamedEfforts
from pam_actuation.tuning.force_loop import ForceLoop
from pam_actuation.tuning.joint_loop import JointLoop
from pam_sim import load_rig
from pam_sim.joint import load_joint
import results_page

HELD_M = 0.010
HELD_LIMB = {'limb_mass_kg': 0.0, 'inertia_kg_m2': 100.0}
TORQUE_CYCLES = 5
SETTLING_S = 4.0
FREQUENCY_HZ = 0.5


def driven_m(time_s):
    """Return the contraction [m] of the driven load."""
    return 0.006 + 0.004 * math.sin(2.0 * math.pi * 0.2 * time_s)


def force(valve, seed, driven):
    """Return the RMSE [N] of every cycle."""
    rig = load_rig('dmsp_5_300_isometric_realistic', valve=valve)
    rig = rig.with_(load='driven') if driven else rig.with_(parameters={'contraction_m': HELD_M})
    loop = ForceLoop(rig, load_experiment('force_sine'), seed=seed,
                     contraction_m=driven_m if driven else None)
    return loop.run(load_controller(f'sofc_force_{valve}', rig)).cycle_rmse()


def angle(joint, name, valve, seed):
    """Return the RMSE [deg] of every cycle; ``name`` is joint or knee."""
    joint = load_joint(joint).with_(valve=valve)
    loop = JointLoop(joint, load_experiment(f'{name}_sine'), seed=seed)
    result = loop.run(load_controller(f'sofc_{name}_{valve}', joint))
    return np.degrees(result.cycle_rmse())


def torque(joint, name, valve, seed, amplitude_n_m, parameters):
    """Return the RMSE [N m] of every cycle; efforts are sent at 100 Hz."""
    joint = load_joint(joint, valve=valve).with_(parameters=parameters)
    loops = JointLoops(joint, ControllerLoop(
        load_controller(f'sofc_{name}_{valve}', joint), joint), seed)
    ticks = round(loops.control.rate_hz / FREQUENCY_HZ)
    settling = round(loops.control.rate_hz * SETTLING_S)
    errors = np.empty(settling + TORQUE_CYCLES * ticks)
    for k in range(len(errors)):
        wanted_n_m = amplitude_n_m * math.sin(2.0 * math.pi * k / ticks)
        if k % 2 == 0:
            loops.control.take('joint_effort', NamedEfforts(loops.now_ns, (), (wanted_n_m,)))
        loops.tick()
        errors[k] = wanted_n_m - loops.plant.plant.torque_n_m
    return np.sqrt(np.mean(errors[settling:].reshape(TORQUE_CYCLES, ticks) ** 2, axis=1))


def rows(seeds):
    """Yield (name, valve, unit, limit, first and last cycle, the worst of the seeds)."""
    small, knee = 'joint_dmsp_5_300_realistic', 'knee_dmsp_20_300_realistic'
    cases = (('force, isometric', 'N', 1.0, lambda valve, seed: force(valve, seed, False)),
             ('force, driven', 'N', 1.0, lambda valve, seed: force(valve, seed, True)),
             ('joint angle', 'deg', 0.3, lambda valve, seed: angle(small, 'joint', valve, seed)),
             ('knee angle', 'deg', 0.3, lambda valve, seed: angle(knee, 'knee', valve, seed)),
             ('joint torque, held', 'N m', 0.05, lambda valve, seed: torque(
                 small, 'joint', valve, seed, 0.5, HELD_LIMB)),
             ('joint torque, free', 'N m', 0.06, lambda valve, seed: torque(
                 small, 'joint', valve, seed, 0.15, {})),
             ('knee torque, held', 'N m', 1.0, lambda valve, seed: torque(
                 knee, 'knee', valve, seed, 10.0, {**HELD_LIMB, 'hanging_angle_rad': 0.9})))
    for name, unit, limit, run in cases:
        for valve in ('ppr', 'hsv'):
            cycles = np.array([run(valve, seed) for seed in seeds])
            yield {'case': name, 'valve': valve, 'unit': unit, 'limit': limit,
                   'first': float(cycles[:, 0].max()), 'last': float(cycles[:, -1].max()),
                   'worst_of_last_five': float(cycles[:, -5:].max())}


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('--seeds', type=int, nargs='+', default=[0, 1, 2])
    parser.add_argument('--json', action='store_true', help='print the result as JSON')
    results_page.add_write(parser, 'force_and_joint')
    return parser


def show(found):
    """Print the rows as a table."""
    print('| controlled | valve | unit | first cycle | last | worst of the last five | limit |')
    print('|---|---|---|---|---|---|---|')
    for row in found:
        print(f'| {row["case"]} | {row["valve"].upper()} | {row["unit"]} | {row["first"]:.3f} '
              f'| {row["last"]:.3f} | {row["worst_of_last_five"]:.3f} | {row["limit"]:g} |')


def main():
    """Print the table; return 1 if a limit is not met."""
    args = command_line().parse_args()
    if args.json:
        found = list(rows(args.seeds))
        print(json.dumps({'seeds': args.seeds, 'rows': found}, indent=2))
    else:
        with results_page.printed(args, __file__):
            show(found := list(rows(args.seeds)))
    return int(any(row['last'] > row['limit'] for row in found))


if __name__ == '__main__':
    sys.exit(main())
