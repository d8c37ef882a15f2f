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
Measure two versions in turn: rollout, ticks, tuning, loading, starts of verbs and of a node.

::

    git clone . /tmp/before && git -C /tmp/before checkout COMMIT && make -C /tmp/before env
    python benchmarks/old_against_new.py /tmp/before .
    python benchmarks/old_against_new.py /tmp/before . --only tuning --pairs 15

Each folder holds a checkout with its environment ``.venv``. Every figure is processor time of a
fresh process of either version, the two in turn, so that both meet the same machine. Printed are
the shortest time of each and the median of the ratios; below 1 the new version is faster. A
snippet uses only what both versions have; one that does not run in either is left out and told.
"""

import argparse
import os
from pathlib import Path
import statistics
import subprocess
import sys
import tempfile

# Prints the least processor time [s] of a call, of several.
BEST = """
import time
def best(call, repeats=20):
    call()
    spans = []
    for _ in range(repeats):
        begin = time.process_time()
        call()
        spans.append(time.process_time() - begin)
    print(min(spans))
"""
ROLLOUT = BEST + """
import numpy as np
from pam_sim import load_rig
rig = load_rig({rig!r})
signal = 3.5 + 1.5 * np.sin(np.arange(20_000) * 3e-3)
best(lambda: rig.simulate(signal))
"""
PLANT = BEST + """
from pam_sim import load_rig
plant = load_rig('dmsp_5_300_realistic').plant()
best(lambda: [plant.step((3.0,), 0.0) for _ in range(5000)])
"""
LAW = BEST + """
from pam_actuation.control.config import load_controller
from pam_sim import load_rig
law = load_controller({controller!r}, load_rig('dmsp_5_300_realistic'))
best(lambda: [law.step(0.02, 0.021, 0.0, 0.022, 0.0, pressure_pa=3e5) for _ in range(5000)])
"""
DRIVER = BEST + """
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.loop import DriverLoop
from pam_actuation.messages import Pressure
from pam_sim import load_rig
rig = load_rig('dmsp_5_300_realistic', valve={valve!r})
driver = DriverLoop(rig.valve, driver_config(rig))
# What a node calls; of the version whose node made the texts of the status at each tick: tick.
act = getattr(driver, 'act', driver.tick)
now = [1_000_000_000]
def tick():
    now[0] += round(1e9 * driver.period_s)
    driver.on_command(Pressure(now[0], 3e5))
    driver.on_pressure(Pressure(now[0], 2.9e5))
    act(now[0])
best(lambda: [tick() for _ in range(1000)])
"""
TUNING = BEST + """
from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.tuning.{module} import {loop}
from pam_sim import load_rig
rig = load_rig({rig!r})
loop = {loop}(rig, load_experiment({experiment!r}), seed=1)
controller = load_controller({controller!r}, rig)
best(lambda: [loop.run_raw(controller) for _ in range(5)])
"""
LOADING = BEST + """
from pam_actuation.bags.load import load_run
best(lambda: load_run({bag!r}), 8)
"""
NODE = """
import os, time
import rclpy
from pam_actuation.nodes.{module} import {node}
rclpy.init()
node = {node}()
node.trigger_configure()
node.trigger_activate()
print(time.process_time(), flush=True)
os._exit(0)
"""
VERBS = (('--help',), ('simulate', 'short_sine', '--overwrite'),
         ('simulate', 'short_sine', '--valve', 'hsv', '--overwrite'), ('valves', 'compare'))


def snippets(bag):
    """Return label -> Python text that prints seconds."""
    contraction = {'module': 'closed_loop', 'loop': 'ClosedLoop', 'rig': 'dmsp_5_300_realistic',
                   'experiment': 'tuning_half_hz'}
    force = {'module': 'force_loop', 'loop': 'ForceLoop', 'experiment': 'force_sine',
             'rig': 'dmsp_5_300_isometric_realistic', 'controller': 'sofc_force_ppr'}
    return {
        'rollout, nominal': ROLLOUT.format(rig='dmsp_5_300_hanging_mass'),
        'rollout, realistic': ROLLOUT.format(rig='dmsp_5_300_realistic'),
        'step of the live plant': PLANT,
        **{f'tick of {name}': LAW.format(controller=name)
           for name in ('pid', 'lqi', 'sofc_ppr')},
        **{f'tick of the driver, {valve}': DRIVER.format(valve=valve)
           for valve in ('ppr', 'hsv')},
        **{f'tuning of {name}': TUNING.format(controller=name, **contraction)
           for name in ('pid', 'lqi', 'sofc_ppr')},
        'tuning in force': TUNING.format(**force),
        'loading a bag': LOADING.format(bag=bag),
        'start of valve_driver': NODE.format(module='valve_driver', node='ValveDriver'),
        'start of plant_simulator': NODE.format(module='plant_simulator', node='PlantSimulator'),
    }


def seconds_of_snippet(folder, text, work):
    """Return the seconds that a snippet prints, None where it does not run."""
    done = subprocess.run([folder / '.venv/bin/python', '-c', text], cwd=work,
                          capture_output=True, text=True)
    return float(done.stdout.split()[-1]) if done.returncode == 0 and done.stdout else None


def seconds_of_verb(folder, arguments, work):
    """Return the processor time [s] of a verb of ``pam`` as a process, None where it failed."""
    process = subprocess.Popen([folder / '.venv/bin/pam', *arguments], cwd=work,
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return used.ru_utime + used.ru_stime if process.returncode == 0 else None


def print_row(label, measure, folders, pairs):
    """Measure both versions in turn; print one row of the table."""
    first = [measure(folder) for folder in folders]         # fills the caches
    if None in first:
        print(f'| {label} | does not run in {folders[first.index(None)]} | | |', flush=True)
        return
    rows = []
    for k in range(pairs):
        order = (0, 1) if k % 2 == 0 else (1, 0)
        found = {place: measure(folders[place]) for place in order}
        rows.append((found[0], found[1]))
    old, new = map(min, zip(*rows))
    ratio = statistics.median(after / before for before, after in rows)
    print(f'| {label} | {1e3 * old:.2f} | {1e3 * new:.2f} | {ratio:.2f} |', flush=True)


def main():
    """Print the table as Markdown."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('old', type=Path, help='checkout with .venv')
    parser.add_argument('new', type=Path, help='the other one')
    parser.add_argument('--pairs', type=int, default=7, help='of processes for each row')
    parser.add_argument('--only', default='', metavar='TEXT', help='rows with this text')
    args = parser.parse_args()
    folders = [args.old.resolve(), args.new.resolve()]
    os.environ.pop('PYTHONDONTWRITEBYTECODE', None)
    os.environ['OPENBLAS_NUM_THREADS'] = '1'
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    with tempfile.TemporaryDirectory() as work:
        bag = Path(work) / 'bag'
        made = seconds_of_verb(folders[0], ('simulate', 'sine_quarter_hz', '--out', bag), work)
        if made is None:
            sys.exit(f'{folders[0]}: `pam simulate` fails')
        print('| what | old, ms | new, ms | new / old |')
        print('|---|---|---|---|')
        for label, text in snippets(str(bag)).items():
            if args.only in label:
                print_row(label, lambda folder, text=text: seconds_of_snippet(
                    folder, text, work), folders, args.pairs)
        for verb in VERBS:
            label = f'pam {" ".join(verb)}'
            if args.only in label:
                print_row(label, lambda folder, verb=verb: seconds_of_verb(
                    folder, verb, work), folders, args.pairs)


if __name__ == '__main__':
    main()
