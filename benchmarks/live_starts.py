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
Sines live over DDS, started again and again: what the phase of a start does to tracking.

Run ``python benchmarks/live_starts.py --valve hsv --starts 20``, with ``--controller NAME`` for
another preset of that valve. Each start is one session of new processes, so that the phases
between plant, controller and driver are drawn anew. It tracks 0.25, 0.5 and 1 Hz one after the
other, +-10 mm about 14 mm. The rules begin as they are after four simulations of the same
reference, and go on learning. The error is root mean square over the last cycles of each sine. It
is divided by that of the same classes with exact timing, the median of six seeds of sensor noise.
Those are simulated without and with the time that messages take.
With ``--hidden`` the plant is a node of the independent simulator under test/hidden, another rig
in every start. Rules are taught on the rig of this package then, and the exact timing is that of
each hidden rig.
Beside it stand ticks of the loops that came more than half a period late, and the ages of the
commands at the ticks of the driver.
"""

import argparse
import json
import os
import sys
import tempfile

import command_age
from hidden_plant_node import program
from hidden_rig import hidden_rig
import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.bags.source import read_bag
from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.rigging.session import run_experiment
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_sim import load_rig
from pam_sim.located_yaml import dump_yaml
import results_page

RIG = 'dmsp_5_300_realistic'
BEGIN_S = 1.5
SINES = {0.25: (2, 1), 0.5: (4, 2), 1.0: (7, 4)}      # frequency [Hz] to cycles, and last of them
LESSONS, SEEDS = 4, range(11, 17)
HIDDEN_SEED = 831
PERIODS_NS = {'controller_state': 5_000_000, 'pressure': 4_000_000}
DRIVER_NS = {'ppr': 5_000_000, 'hsv': 10_000_000}     # between two signals, at most


def experiment():
    """Return the experiment of one start."""
    return load_experiment(dump_yaml({
        'name': 'live_start', 'domain': 'contraction', 'segments': [
            {'rest': {'duration_s': 0.5}}, {'ramp': {'to_m': 0.004, 'duration_s': 1.0}},
            *({'sine': {'center_m': 0.014, 'amplitude_m': 0.010, 'frequency_hz': hz,
                        'cycles': cycles}} for hz, (cycles, _) in SINES.items())]}))


def errors_mm(run):
    """Return frequency to the error of the last cycles [mm]."""
    moved, asked = run.topics['contraction'], run.topics['reference']
    wanted = np.interp(moved.stamp_ns, asked.stamp_ns, asked.values['contraction_m'])
    error = 1e3 * (moved.values['contraction_m'] - wanted)
    at_s, end_s, errors = (moved.stamp_ns - asked.stamp_ns[0]) * 1e-9, BEGIN_S, {}
    for hz, (cycles, last) in SINES.items():
        end_s += cycles / hz
        inside = (at_s > end_s - last / hz) & (at_s <= end_s)
        errors[hz] = float(np.sqrt(np.mean(error[inside] ** 2)))
    return errors


def timing(run, bag, valve):
    """Return what the loops did: late ticks [%], ages of the commands [ms], longest gap [ms]."""
    late, longest_ms, way_ns = {}, 0.0, transport_ns(bag)
    for topic, period_ns in {**PERIODS_NS, 'valve_signal': DRIVER_NS[valve]}.items():
        gaps = np.diff(run.topics[topic].stamp_ns)
        late[topic] = 100.0 * float(np.mean(gaps > 1.5 * period_ns))
        longest_ms = max(longest_ms, float(gaps.max()) * 1e-6)
    at_s, newest, acts = command_age.ages_ms(run, way_ns)
    begin_s = (run.topics['reference'].stamp_ns[0] - run.start_ns) * 1e-9
    moving = (at_s > begin_s + BEGIN_S) & (at_s < begin_s + experiment().duration_s)
    newest, acts = newest[moving], acts[moving]
    return {'way_ns': way_ns, 'late': late, 'longest_ms': longest_ms,
            'newest_sd_ms': float(newest.std()), 'acts_sd_ms': float(acts.std()),
            'age_ms': float(np.median(acts))}


def transport_ns(bag):
    """Return the median time from the stamp of a command to its arrival at the recorder [ns]."""
    for name, topic in read_bag(bag).topics.items():
        if name.endswith('/pressure_command'):
            stamps = load_run(bag).topics['pressure_command'].stamp_ns
            return int(np.median(np.asarray(topic.log_time_ns) - stamps))
    return 0


def taught(rig, name, one):
    """Return a controller that learned the experiment in simulations with exact timing."""
    controller = load_controller(name, rig)
    for lesson in range(LESSONS):
        ClosedLoop(rig, one, seed=lesson).run(controller)
    return controller


def exactly(one, rig, name, rules, folder, way_ns, seeds=SEEDS):
    """Return frequency to the error with exact timing [mm], the median of all seeds."""
    errors = [errors_mm(load_run(simulate_experiment(
        one, rig, load_controller(name, rig, rules_file=rules),
        os.path.join(folder, 'exact'), seed=seed, transport_ns=way_ns, overwrite=True)['bag']))
        for seed in seeds]
    return {hz: float(np.median([row[hz] for row in errors])) for hz in SINES}


def bag_name(args, start):
    """Return the name of the bag of a start: runs of another kind have another one."""
    kinds = '_hidden' * args.hidden + '_ordinary' * args.ordinary
    return f'{args.controller}_{args.valve}{kinds}_{start}'


def part_of(args):
    """Return which part of the page holds the table of such runs."""
    part = args.valve if args.controller == f'sofc_{args.valve}' else args.controller
    return part + '_hidden' * args.hidden + '_ordinary' * args.ordinary


def started(args, one, rig, rules, folder):
    """Run all starts; return (errors, timing) of each."""
    rows = []
    for start in range(args.starts):
        bag = os.path.join(args.keep or folder, bag_name(args, start))
        if not os.path.exists(bag):
            controller = load_controller(args.controller, rig, rules_file=rules)
            result = run_experiment(one, rig, controller, args.valve, bag, seed=start,
                                    domain_id=args.domain_id, realtime=not args.ordinary,
                                    programs=args.hidden and {
                                        'plant_simulator': program(HIDDEN_SEED + start)})
            if result.failure or result.findings:
                print(f'start {start}: {result.failure} {result.findings}', file=sys.stderr)
        run = load_run(bag)
        rows.append((errors_mm(run), timing(run, bag, args.valve)))
        print(f'start {start}: {json.dumps(rows[-1])}', file=sys.stderr, flush=True)
    return rows


def show(args):
    """Print the tables as Markdown."""
    rig, one = load_rig(RIG, valve=args.valve), experiment()
    with tempfile.TemporaryDirectory() as folder:
        rules = os.path.join(folder, 'rules.json')
        taught(rig, args.controller, one).rules.save(rules)
        rows = started(args, one, rig, rules, folder)
        way_ns = int(np.median([row['way_ns'] for _, row in rows]))
        if args.hidden:
            rigs = [hidden_rig(args.valve, HIDDEN_SEED + start) for start in range(args.starts)]
            exact, with_way = ([exactly(one, other, args.controller, rules, folder, way)
                                for other in rigs] for way in (0, way_ns))
        else:
            exact, with_way = (
                [exactly(one, rig, args.controller, rules, folder, way)] * args.starts
                for way in (0, way_ns))
    print('| sine | exact timing [mm] | with the way of messages | live, median | worst '
          '| median ratio | worst ratio | with the way | worst |\n'
          '|---|---|---|---|---|---|---|---|---|')
    for hz in SINES:
        live = np.array([errors[hz] for errors, _ in rows])
        same, late = (np.array([errors[hz] for errors in found]) for found in (exact, with_way))
        print(f'| {hz:g} Hz | {np.median(same):.3f} | {np.median(late):.3f} | '
              f'{np.median(live):.3f} | {live.max():.3f} | '
              f'{np.median(live / same):.2f} | {np.max(live / same):.2f} | '
              f'{np.median(live / late):.2f} | {np.max(live / late):.2f} |')
    print(f'\n{len(rows)} starts; messages took {way_ns * 1e-6:.2f} ms. Load average at the end: '
          f'{os.getloadavg()[0]:.1f}.\n')
    print('| of a start | median | worst start |\n|---|---|---|')
    for key, words in (('newest_sd_ms', 'age of the newest command, standard deviation [ms]'),
                       ('acts_sd_ms', 'age of what acts, standard deviation [ms]'),
                       ('longest_ms', 'longest interval of any loop [ms]')):
        if key == 'acts_sd_ms' and args.valve == 'ppr':
            continue        # nothing waits there
        column = [row[key] for _, row in rows]
        print(f'| {words} | {np.median(column):.2f} | {max(column):.2f} |')
    for topic, words in (('pressure', 'plant'), ('controller_state', 'controller'),
                         ('valve_signal', 'driver')):
        column = [row['late'][topic] for _, row in rows]
        print(f'| ticks of the {words} more than half a period late [%] | '
              f'{np.median(column):.2f} | {max(column):.2f} |')


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--valve', default='hsv', choices=('ppr', 'hsv'))
    parser.add_argument('--controller', default=None, metavar='NAME',
                        help='preset; by default sofc_ppr or sofc_hsv')
    parser.add_argument('--starts', type=int, default=20)
    parser.add_argument('--hidden', action='store_true',
                        help='before plants of the independent simulator')
    parser.add_argument('--ordinary', action='store_true', help='without real-time priority')
    parser.add_argument('--domain-id', type=int, default=None, help='ROS domain')
    parser.add_argument('--keep', default=None, metavar='DIR',
                        help='keep the bags here; a live bag found there is not run again')
    results_page.add_write(parser, 'command_age')
    return parser


def main():
    """Run and compare."""
    args = command_line().parse_args()
    args.controller = args.controller or f'sofc_{args.valve}'
    with results_page.printed(args, __file__, part_of(args)):
        show(args)


if __name__ == '__main__':
    main()
