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
Faults at random moments on live nodes, and what became of them: the table of the safety page.

    python benchmarks/fault_table.py --times 50 --valve hsv

Recorder, plant, driver, watchdog, controller and reference run as processes over DDS while
one fault after the other strikes. Each outcome is a line of ``--out``; started again with the
same file, it goes on where it was. ``--print`` only prints the table. The seed fixes order and
moments.
"""

import argparse
from dataclasses import dataclass
import json
from pathlib import Path
import random
import shutil
import signal
import statistics
import sys
import tempfile
import time

from fault_rig import FaultRig
from pam_actuation.bags.load import load_run
from pam_actuation.bags.recover import recover_bag
from pam_actuation.drivers.safety import SafetyLimits
from pam_actuation.rigging.transitions import termination_as_interrupt
from pam_sim.errors import InputError
import results_page
from tqdm import tqdm

LIMIT_PA = SafetyLimits().max_pressure_gauge_pa
ALLOWED_PA = 1.02 * LIMIT_PA
ALLOWED_S = 0.3
ALL = 'all'                   # of the trials, in a cell of the table
LOST_S = 1.0                 # of a recording, when its recorder is killed
RESTART_S = 60.0             # a busy machine starts a node in many seconds
START_S = 120.0
SETTLE_S, MOMENTS_S = 0.2, 1.0
LOOK_S, SHORTEST_S = 0.05, 0.5
DRIVER, CONTROLLER, PLANT = 'valve_driver', 'sofc_controller', 'plant_simulator'
RECORDER, REFERENCE, WATCHDOG = 'experiment_recorder', 'reference_generator', 'valve_watchdog'


@dataclass(frozen=True)
class Case:
    """
    One row: what strikes, who says what about it, and what then is on the wire.

    ``lasts_s`` is how long the fault lasts at most; it is ended once its outcome is known.
    ``strike`` is ``kill`` or ``stop`` of the node ``target``, else how the sensor ``target`` is
    spoiled. ``safe`` is ``signal`` (vents), ``command`` (atmosphere is commanded) or '' (goes on).
    """

    title: str
    strike: str
    target: str
    teller: str = ''
    words: str = ''
    safe: str = 'signal'
    lasts_s: float = 1.0


NO_COMMAND, NO_PRESSURE = 'no valid pressure command', 'no valid measured pressure'
SILENT, PAUSED = 'fell silent|ended with the signal that vents', 'itself was stopped'
VENTED_REFERENCE = 'asks for the atmosphere'
CASES = {
    'kill_controller': Case('SIGKILL of the controller', 'kill', CONTROLLER, DRIVER, NO_COMMAND),
    'kill_driver': Case('SIGKILL of the driver', 'kill', DRIVER, WATCHDOG, SILENT),
    'kill_plant': Case('SIGKILL of the plant (all sensors)', 'kill', PLANT, DRIVER, NO_PRESSURE),
    'kill_recorder': Case('SIGKILL of the recorder', 'kill', RECORDER, safe=''),
    'kill_reference': Case('SIGKILL of the reference', 'kill', REFERENCE, CONTROLLER,
                           VENTED_REFERENCE, 'command', 4.0),
    'stop_controller': Case('SIGSTOP of the controller', 'stop', CONTROLLER, DRIVER, NO_COMMAND),
    'stop_driver': Case('SIGSTOP of the driver', 'stop', DRIVER, WATCHDOG, SILENT),
    'stop_plant': Case('SIGSTOP of the plant', 'stop', PLANT, DRIVER, NO_PRESSURE),
    'stop_recorder': Case('SIGSTOP of the recorder', 'stop', RECORDER, safe=''),
    'stop_reference': Case('SIGSTOP of the reference', 'stop', REFERENCE, CONTROLLER,
                           VENTED_REFERENCE, 'command', 4.0),
    'pressure_nan': Case('pressure NaN', 'nan', 'pressure', DRIVER, NO_PRESSURE),
    'pressure_frozen': Case('pressure frozen', 'frozen', 'pressure', DRIVER, 'stands still',
                            lasts_s=3.0),
    'pressure_absurd': Case('pressure out of range', 'absurd', 'pressure', DRIVER, NO_PRESSURE),
    'pressure_delayed': Case('pressure delayed by 0.4 s', 'delayed', 'pressure', DRIVER,
                             NO_PRESSURE),
    'pressure_travelling': Case('pressure stamped 1 s ahead and 1 s back in turn', 'travelling',
                                'pressure', DRIVER, NO_PRESSURE),
    'contraction_nan': Case('contraction NaN', 'nan', 'contraction', CONTROLLER,
                            'not a finite number', 'command'),
    'contraction_frozen': Case('contraction frozen', 'frozen', 'contraction', CONTROLLER,
                               'stands still', 'command', 3.0),
    'contraction_absurd': Case('contraction out of range', 'absurd', 'contraction', CONTROLLER,
                               'outside what the muscle can do', 'command'),
    'contraction_delayed': Case('contraction delayed by 0.4 s', 'delayed', 'contraction',
                                CONTROLLER, 'older than', 'command'),
    'contraction_travelling': Case('contraction stamped 1 s ahead and 1 s back in turn',
                                   'travelling', 'contraction', CONTROLLER, 'ahead|older than',
                                   'command'),
    'flood': Case('command flood: a second publisher, 2000 messages/s', 'flood',
                  'pressure_command', DRIVER, 'two publishers'),
    'supply_low': Case('supply loss (HSV)', 'low', 'supply_pressure', DRIVER, 'supply of', ''),
}
# A regulator closes its own loop: a frozen reading is a warning there.
FOR_PPR = {'pressure_frozen': Case('pressure frozen', 'frozen', 'pressure', DRIVER,
                                   'stands still', '', 3.0)}


def cases_of(valve):
    """Return key to Case of the rows for a valve; a regulator has no measured supply."""
    if valve == 'hsv':
        return dict(CASES)
    return {**{key: case for key, case in CASES.items() if key != 'supply_low'}, **FOR_PPR}


def strike(rig, case):
    """Let the fault happen; return the time just before [ns]."""
    onset_ns = time.time_ns()
    if case.strike == 'kill':
        rig.signal(case.target, signal.SIGKILL)
    elif case.strike == 'stop':
        rig.signal(case.target, signal.SIGSTOP)
    else:
        rig.spoil(case.target, case.strike)
    return onset_ns


def undo(rig, case):
    """End the fault: start what was killed, continue what was stopped, spoil no more."""
    if case.strike == 'kill':
        rig.processes[case.target].wait(5.0)
        rig.start(case.target)
    elif case.strike == 'stop':
        rig.signal(case.target, signal.SIGCONT)
    else:
        rig.spoil(case.target, 'none')


def play(rig, case, moment_s):
    """
    Let one fault strike, end it, and judge what was heard.

    Returns
    -------
    dict
        ``told``, ``safe_ok``, ``limit_ok``, ``restarted`` as booleans, ``onset_to_safe_s``,
        ``detection_to_safe_s``, ``highest_gauge_pa``, and stamps for the check of the bag.

    """
    witness, bag = rig.witness, rig.bag
    witness.listen(moment_s)
    witness.forget()
    onset_ns = strike(rig, case)
    told_ns = safe_ns = None
    for k in range(round(case.lasts_s / LOOK_S)):
        witness.listen(LOOK_S)
        if case.teller and told_ns is None:
            said = witness.first_said(case.teller, case.words, onset_ns)
            told_ns = said.stamp_ns if said else None
        if case.safe and safe_ns is None:
            safe_ns = (witness.safe_since if case.safe == 'signal' else
                       witness.atmosphere_since)(onset_ns)
        if told_ns and safe_ns and (k + 1) * LOOK_S >= SHORTEST_S:
            break
    undo(rig, case)
    restarted = rig.wait_until_sound(RESTART_S)
    if case.strike == 'stop' and case.target == DRIVER:
        told_ns = told_ns and witness.first_said(DRIVER, PAUSED, onset_ns) and told_ns
    detected_ns = told_ns if told_ns is not None else onset_ns
    late_s = None if safe_ns is None else max(safe_ns - detected_ns, 0) * 1e-9
    highest_pa = witness.highest_gauge_pa()
    return {
        'told': told_ns is not None if case.teller else None,
        'safe_ok': late_s is not None and late_s <= ALLOWED_S if case.safe else None,
        'onset_to_safe_s': None if safe_ns is None else (safe_ns - onset_ns) * 1e-9,
        'detection_to_safe_s': late_s, 'highest_gauge_pa': highest_pa,
        'limit_ok': highest_pa <= ALLOWED_PA, 'restarted': restarted,
        'bag': str(bag), 'onset_ns': onset_ns, 'safe_ns': safe_ns,
        'said': [f'{name}: {status.message}' for name, status in witness.said]}


def check_bag(outcomes, killed):
    """
    Enter into outcomes whether their bag holds what they were judged by.

    A bag whose recorder was killed is repaired first and may lack its last second.
    """
    path = outcomes[0]['bag']
    try:
        recovered = recover_bag(path)
        run = load_run(path)
    except InputError as error:
        for one in outcomes:
            one.update(recorded=False, why_not_recorded=str(error))
        return
    signals = {int(stamp) for stamp in run.topics['valve_signal'].stamp_ns}
    commands = {int(stamp) for stamp in run.topics['pressure_command'].stamp_ns}
    whole = killed or not recovered.changed
    last_ns = max(signals)
    for one in outcomes:
        end_ns = one['safe_ns'] or one['onset_ns']
        present = one['safe_ns'] in {None, one['onset_ns']} | signals | commands
        one['recorded'] = whole and (
            last_ns >= end_ns and present or killed and end_ns > last_ns >= end_ns - LOST_S * 1e9)


class Series:
    """
    Many faults on one valve, written down one by one.

    Parameters
    ----------
    arguments : argparse.Namespace
        ``valve``, ``times``, ``seed``, ``out``, ``only``.

    """

    SETTLES = ('kill_recorder',)        # cases after which the bag has ended

    def cases(self):
        """Return key to case of the rows."""
        return cases_of(self._arguments.valve)

    def play(self, rig, case, rng):
        """Let one case happen at a moment; return the outcome."""
        return play(rig, case, SETTLE_S + rng.uniform(0.0, MOMENTS_S))

    def __init__(self, arguments):
        self._arguments = arguments
        self._path = Path(arguments.out)
        self._folder = Path(tempfile.mkdtemp(prefix='fault_table_'))
        self._rigs = 0
        self._rig = None
        self._open = []             # outcomes whose bag is still being written
        self.outcomes = read_outcomes(self._path)

    def _left(self):
        """Return (key, number) of what is still to do, in an order fixed by the seed."""
        known = {(one['case'], one['number']) for one in self.outcomes
                 if one['valve'] == self._arguments.valve}
        wanted = self._arguments.only or list(self.cases())
        left = []
        for number in range(self._arguments.times):
            keys = [key for key in wanted if (key, number) not in known]
            random.Random(f'{self._arguments.seed} order {number}').shuffle(keys)
            left += [(key, number) for key in keys]
        return left

    def run(self):
        """Play all that is left."""
        valve, cases = self._arguments.valve, self.cases()
        left = self._left()
        try:
            for key, number in tqdm(left, unit='fault', disable=None):
                if self._rig is None:
                    self._start()
                rng = random.Random(f'{self._arguments.seed} {valve} {key} {number}')
                outcome = self.play(self._rig, cases[key], rng)
                outcome.update(valve=valve, case=key, number=number)
                self._open.append(outcome)
                if not outcome['restarted']:
                    self._end()
                elif key in self.SETTLES:
                    self._settle(killed=True)
        finally:
            self._end()
            shutil.rmtree(self._folder, ignore_errors=True)

    def _start(self):
        self._rig = FaultRig(self._arguments.valve, self._folder / f'rig_{self._rigs}')
        self._rigs += 1
        if not self._rig.wait_until_sound(START_S):
            said = {name: one.message for name, one in self._rig.witness.last.items()}
            raise RuntimeError(f'the rig did not come up: {said}')

    def _end(self):
        if self._rig is not None:
            self._rig.close()
            self._rig = None
        if self._open:
            self._settle(killed=False)

    def _settle(self, killed):
        """Check the bag that was finished and write its outcomes down."""
        check_bag(self._open, killed)
        with open(self._path, 'a', encoding='utf-8') as stream:
            for one in self._open:
                stream.write(json.dumps(one) + '\n')
        self.outcomes += self._open
        shutil.rmtree(self._open[0]['bag'], ignore_errors=True)
        self._open = []


def read_outcomes(path):
    """Return the outcomes of a file, [] if there is none."""
    if not path.is_file():
        return []
    return [json.loads(line) for line in path.read_text(encoding='utf-8').splitlines()]


def good(one):
    """Tell whether nothing about an outcome is wrong."""
    return all(one[name] in (True, None) for name in (
        'told', 'safe_ok', 'limit_ok', 'recorded', 'restarted'))


def table(outcomes, valve):
    """Return the Markdown table of a valve."""
    lines = [
        '| fault | times | then | after the fault, median / worst | after its detection, worst '
        '| highest pressure | reason published | bag holds it | sound again |',
        '|---|---|---|---|---|---|---|---|---|']
    what = {'signal': 'vents', 'command': 'atmosphere commanded', '': 'goes on'}
    for key, case in cases_of(valve).items():
        rows = [one for one in outcomes if one['valve'] == valve and one['case'] == key]
        if not rows:
            continue
        delays = [one['onset_to_safe_s'] for one in rows if one['onset_to_safe_s'] is not None]
        late = [one['detection_to_safe_s'] for one in rows
                if one['detection_to_safe_s'] is not None]
        counts = [_count(rows, name) for name in ('told', 'recorded', 'restarted')]
        done = _count(rows, 'safe_ok')
        done = f' ({done})' if case.safe and done != ALL else ''
        lines.append(
            f'| {case.title} | {len(rows)} | {what[case.safe]}{done} | '
            + (f'{statistics.median(delays) * 1e3:.0f} / {max(delays) * 1e3:.0f} ms'
               if delays and case.safe else '–')
            + (f' | {max(late) * 1e3:.0f} ms' if late and case.safe else ' | –')
            + f' | {max(one["highest_gauge_pa"] for one in rows) / 1e3:.0f} kPa | '
            + ' | '.join(counts) + ' |')
    return '\n'.join(lines)


def _count(rows, name):
    """Return how many of the rows have a property, '–' where it does not apply."""
    values = [one[name] for one in rows if one[name] is not None]
    if values and all(values):
        return ALL
    return f'{sum(values)} of {len(values)}' if values else '–'


def command_line():
    """Return the parser of the command line."""
    return series_parser(CASES, 'fault_table.jsonl', __doc__, 'faults')


def main():
    """Play, print the table; exit code 1 if anything was not as it must be."""
    return run_series(command_line(), __file__, Series, table)


def series_parser(keys, out, description, page, times=3):
    """Return the parser of a series of faults whose table is on a page of docs/results."""
    parser = argparse.ArgumentParser(description=description.split('\n')[1])
    parser.add_argument('--times', type=int, default=times, help='how often each fault strikes')
    parser.add_argument('--valve', choices=('ppr', 'hsv'), default='hsv')
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--out', default=out, help='one line per fault')
    parser.add_argument('--only', nargs='*', choices=keys, help='these faults only')
    parser.add_argument('--print', action='store_true', help='only print what there is')
    results_page.add_write(parser, page)
    return parser


def run_series(parser, program, series_class, table_of, is_good=good):
    """Play what the command line asks for, print the table; return the exit code."""
    arguments = parser.parse_args()
    if arguments.print and arguments.write:
        parser.error('--write needs a run of its own; --print shows an earlier one')
    valve = arguments.valve
    with results_page.printed(arguments, program, valve):
        if arguments.print:
            outcomes = read_outcomes(Path(arguments.out))
        else:
            series = series_class(arguments)
            before = sum(one['valve'] == valve for one in series.outcomes)
            with termination_as_interrupt():
                series.run()
            outcomes = series.outcomes
            if before:
                print(f'{before} outcomes are of earlier runs with the same `--out`.\n')
        outcomes = [one for one in outcomes if one['valve'] == valve]
        print(table_of(outcomes, valve))
    bad = [one for one in outcomes if not is_good(one)]
    for one in bad:
        print(f'not as it must be: {json.dumps(one)}', file=sys.stderr)
    return 1 if bad else 0


if __name__ == '__main__':
    sys.exit(main())
