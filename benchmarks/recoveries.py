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
What happens after a vent: sensors lost and healed, controllers stopped, commands in any order.

    python benchmarks/recoveries.py --times 100 --valve hsv

Plant, driver, watchdog, controller and reference run as processes over DDS. The muscle is held at
8.9 mm; at random moments a sensor is lost or the controller stopped, for a random time, and comes
back. In a second series random orders of stop, continue, restart, emergency stop and command
patterns follow each other. The table states the largest excursion beyond the reference. It also
states the largest rise of the measured pressure over any 0.2 s after a vent. A vent is one of the
driver, or atmosphere commanded by the controller. The look at the rise ends when the driver has
followed commands under pressure for 1 s in all.
Each outcome is a line of ``--out``; started again with the same file, it goes on where it was.
``--print`` only prints the table.
"""

import json
import math
from pathlib import Path
import random
import shutil
import signal
import statistics
import sys
import tempfile
import time

from fault_rig import FaultRig
from fault_table import (
    DRIVER, read_outcomes, RECORDER, REFERENCE, RESTART_S, run_series, series_parser, START_S)
import numpy as np
from pam_actuation.messages import Pressure
from pam_actuation.topics.codec import Writer
from pam_sim.units import P_ATM_PA
from std_srvs.srv import Trigger
from tqdm import tqdm

HELD_M = 0.0089
HOLD = f"""
name: swing
domain: contraction
segments:
  - ramp: {{to_m: {HELD_M}, duration_s: 1.0}}
  - hold: {{duration_s: 3600.0}}
  - hold: {{duration_s: 3600.0}}
"""
HEARD = ('valve_signal', 'pressure_command', 'followed_pressure', 'true/pressure',
         'true/contraction')
CONTROLLERS = ('sofc_controller', 'pid_controller')
LOST = ('nan', 'silent', 'past', 'ahead')
SHORTEST_S, LONGEST_S, COMES_BACK_S = 0.12, 1.8, 3.0
WINDOW_S, ENDS = 0.2, 5             # of a rise; readings averaged at either end
FOLLOWED_S, UNDER_PRESSURE_PA = 1.0, P_ATM_PA + 20e3
ALLOWED_RISE_PA_PER_S, ALLOWED_M = 525e3, 1e-3
FULL_PA = P_ATM_PA + 600e3


class Rig(FaultRig):
    """A rig that holds its contraction or, without a controller, takes commands from here."""

    def __init__(self, valve, folder, controller):
        without = (RECORDER,) if controller else (RECORDER, REFERENCE, CONTROLLERS[0])
        super().__init__(
            valve, folder, controller or CONTROLLERS[0], HOLD, without, HEARD)
        self.controller = controller
        if not controller:
            self._publisher = self.witness.new_publisher('pressure_command')
            self._writer = Writer('pressure_command')

    def command(self, command_pa, duration_s):
        """Command a pressure (None: nothing) at 200 Hz and listen."""
        deadline = time.monotonic() + duration_s
        while time.monotonic() < deadline:
            if command_pa is not None:
                self._publisher.publish(self._writer.fill(Pressure(time.time_ns(), command_pa)))
            self.witness.listen(0.005)

    def call(self, service):
        """Call a service of the driver."""
        self.witness.call(Trigger, f'{DRIVER}/{service}')


def stop_and_continue(rig, rng):
    """Stop the controller for a while."""
    rig.signal(rig.controller, signal.SIGSTOP)
    rig.witness.listen(rng.uniform(SHORTEST_S, LONGEST_S))
    rig.signal(rig.controller, signal.SIGCONT)


def lose(topic):
    """Return what loses a sensor for a while."""
    def act(rig, rng):
        rig.spoil(topic, rng.choice(LOST))
        rig.witness.listen(rng.uniform(SHORTEST_S, LONGEST_S))
        rig.spoil(topic, 'none')
    return act


def restart(name):
    """Return what kills a node and starts it again."""
    def act(rig, rng):
        node = name or rig.controller
        rig.signal(node, signal.SIGKILL)
        rig.processes[node].wait(5.0)
        rig.witness.listen(rng.uniform(0.0, 0.5))
        rig.start(node)
        rig.wait_until_sound(RESTART_S)
    return act


def emergency_stop(rig, rng):
    """Stop by the service, and reset."""
    rig.call('emergency_stop')
    rig.witness.listen(rng.uniform(SHORTEST_S, LONGEST_S))
    rig.call('reset')


def any_order(rig, rng):
    """Do three things in a random order, with random pauses between them."""
    actions = [stop_and_continue, stop_and_continue, lose('pressure'), lose('contraction'),
               emergency_stop]
    for action in rng.sample(actions, 3):
        action(rig, rng)
        rig.witness.listen(rng.uniform(0.0, 1.2))


def any_restart(rig, rng):
    """Kill controller or driver, start it again, and stop the controller once more."""
    restart(rng.choice((None, DRIVER)))(rig, rng)
    rig.witness.listen(rng.uniform(0.0, 0.8))
    stop_and_continue(rig, rng)


def pattern(rig, rng):
    """Command steps, atmosphere, nothing and nonsense in a random order."""
    for _ in range(rng.randint(4, 9)):
        command_pa = rng.choice((
            P_ATM_PA, P_ATM_PA, FULL_PA, FULL_PA, P_ATM_PA + rng.uniform(0.0, 600e3), None,
            math.nan, P_ATM_PA - 5e3))
        rig.command(command_pa, rng.choice((0.01, 0.05, 0.2, 0.4, 0.8)))
    rig.command(None, rng.uniform(0.15, 0.5))
    rig.command(P_ATM_PA, rng.choice((0.01, 0.1, 1.5)))
    rig.command(FULL_PA, 0.8)


# key: (title, with a controller, what happens, whether the excursion counts)
CASES = {
    'pressure': ('pressure lost and back', True, lose('pressure'), True),
    'contraction': ('contraction lost and back', True, lose('contraction'), True),
    'stopped': ('controller stopped and continued', True, stop_and_continue, True),
    'orders': ('stops, losses, emergency stops in any order', True, any_order, True),
    'restarts': ('controller or driver killed and started again', True, any_restart, True),
    'patterns': ('commands in any order, nothing and nonsense among them', False, pattern, False)}
SHARE = {'pressure': 0.5, 'contraction': 0.5, 'stopped': 1.0, 'orders': 0.25, 'restarts': 0.1,
         'patterns': 0.65}


def largest_rise(heard, said):
    """
    Return the largest rise [Pa/s] of the measured pressure after vents, NaN without a vent.

    Parameters
    ----------
    heard : dict
        Topic to messages.
    said : list of (int, bool)
        Stamps of the driver's statuses, and whether it vented then.

    """
    stamps = np.array([one.stamp_ns for one in heard['true/pressure']])
    values = np.array([one.pressure_pa for one in heard['true/pressure']])
    order = np.argsort(stamps, kind='stable')
    stamps, values = stamps[order], values[order]
    if len(values) < 2 * ENDS:
        return math.nan
    # Averaged with their stamps: a plant that was late leaves a gap between readings.
    mean = np.full(ENDS, 1.0 / ENDS)
    smooth = np.convolve(values, mean, 'valid')
    times_s = np.convolve((stamps - stamps[0]) * 1e-9, mean, 'valid')
    to_s = times_s[times_s >= times_s[0] + WINDOW_S]
    before = np.interp(to_s - WINDOW_S, times_s, smooth)
    rise = (np.interp(to_s, times_s, smooth) - before) / WINDOW_S
    ends_ns = stamps[0] + (to_s * 1e9).astype(np.int64)
    begins_ns = ends_ns - round(WINDOW_S * 1e9)
    largest = math.nan
    for (from_ns, vented), (to_ns, _) in zip(said, [*said[1:], (2 ** 62, True)]):
        if vented:
            continue
        until_ns = min(_followed_until(heard, from_ns), to_ns)
        inside = (begins_ns >= from_ns) & (ends_ns <= until_ns)
        if inside.any():
            largest = np.nanmax([largest, rise[inside].max()])
    return float(largest)


def _followed_until(heard, from_ns):
    """Return when commands under pressure had been followed for 1 s in all since a time."""
    commands = sorted((one.stamp_ns, one.pressure_pa) for one in heard['pressure_command'])
    command_ns = np.array([stamp for stamp, _ in commands])
    total_s, before_ns = 0.0, None
    for one in sorted(heard['followed_pressure'], key=lambda one: one.stamp_ns):
        if one.stamp_ns < from_ns:
            continue
        if before_ns is not None and len(commands):
            place = np.searchsorted(command_ns, one.stamp_ns, 'right') - 1
            command_pa = commands[max(place, 0)][1]
            if command_pa > UNDER_PRESSURE_PA and abs(one.pressure_pa - command_pa) < 1e3:
                total_s += min((one.stamp_ns - before_ns) * 1e-9, 0.05)
        before_ns = one.stamp_ns
        if total_s >= FOLLOWED_S:
            return one.stamp_ns
    return 2 ** 62


def _with_atmosphere(said, commands):
    """Return (stamp, vented) with what a controller vents by commanding atmospheric pressure."""
    events = [(stamp, 0, vented) for stamp, vented in said]
    events += [(one.stamp_ns, 1, one.pressure_pa <= P_ATM_PA) for one in commands]
    state, merged = [said[0][1], False], []
    for stamp, which, vented in sorted(events):
        before, state[which] = any(state), vented
        if not merged or any(state) != before:
            merged.append((stamp, any(state)))
    return merged


def play(rig, case, rng):
    """Let one case happen; return the outcome."""
    _, with_controller, act, counts = CASES[case]
    witness = rig.witness
    if not with_controller:
        rig.command(P_ATM_PA, 0.3)
    witness.listen(0.2 + rng.uniform(0.0, 0.5))
    state = witness.last[DRIVER].values['state']
    witness.forget()
    said = [(time.time_ns(), state != 'ok')]
    act(rig, rng)
    if with_controller:
        witness.listen(COMES_BACK_S)
    said += [(status.stamp_ns, status.values['state'] != 'ok')
             for name, status in witness.said if name == DRIVER and 'state' in status.values]
    if with_controller:
        said = _with_atmosphere(said, witness.heard['pressure_command'])
    vents = sum(b and not a for (_, a), (_, b) in zip(said, said[1:]))
    # What it was before is no vent: only what follows one counts.
    first = next((k for k, (_, vented) in enumerate(said) if vented), None)
    contractions = [one.contraction_m for one in witness.heard['true/contraction']]
    outcome = {
        'vents': vents,
        'rise_pa_per_s': math.nan if first is None else largest_rise(
            witness.heard, said[first:]),
        'excursion_m': max(contractions) - HELD_M if counts else None,
        'highest_gauge_pa': witness.highest_gauge_pa()}
    if with_controller:
        outcome['restarted'] = rig.wait_until_sound(RESTART_S)
        if not outcome['restarted']:
            outcome['said'] = rig.what_nodes_say()
    return outcome


def good(one):
    """Tell whether nothing about an outcome is wrong."""
    return (not one['rise_pa_per_s'] > ALLOWED_RISE_PA_PER_S
            and (one['excursion_m'] is None or one['excursion_m'] <= ALLOWED_M)
            and one.get('restarted', True))


def table(outcomes, valve):
    """Return the Markdown table of a valve."""
    lines = ['| what happens | controller | times | vents | largest rise after a vent '
             '| beyond the reference, median / largest | highest pressure |',
             '|---|---|---|---|---|---|---|']
    for key, (title, with_controller, _, counts) in CASES.items():
        for controller in CONTROLLERS if with_controller else ('',):
            rows = [one for one in outcomes if one['valve'] == valve and one['case'] == key
                    and one['controller'] == controller]
            if not rows:
                continue
            rises = [one['rise_pa_per_s'] for one in rows
                     if one['rise_pa_per_s'] is not None and math.isfinite(one['rise_pa_per_s'])]
            beyond = [one['excursion_m'] * 1e3 for one in rows if counts]
            lines.append(
                f'| {title} | {f"`{controller}`" if controller else "none"} | {len(rows)} '
                f'| {sum(one["vents"] for one in rows)} '
                f'| {f"{max(rises) * 1e-3:.0f} kPa/s" if rises else "–"} '
                + (f'| {statistics.median(beyond):.2f} / {max(beyond):.2f} mm ' if beyond
                   else '| – ')
                + f'| {max(one["highest_gauge_pa"] for one in rows) * 1e-3:.0f} kPa |')
    return '\n'.join(lines)


class Series:
    """Many recoveries on one valve, written down one by one."""

    def __init__(self, arguments):
        self._arguments = arguments
        self._path = Path(arguments.out)
        self._folder = Path(tempfile.mkdtemp(prefix='recoveries_'))
        self._rigs = 0
        self.outcomes = read_outcomes(self._path)

    def run(self):
        """Play all that is left."""
        try:
            for controller in (*CONTROLLERS, ''):
                self._run(controller)
        finally:
            shutil.rmtree(self._folder, ignore_errors=True)

    def _run(self, controller):
        given = self._arguments
        left = []
        for key, (_, with_controller, _, _) in CASES.items():
            if with_controller != bool(controller) or (given.only and key not in given.only):
                continue
            known = {one['number'] for one in self.outcomes if (
                one['valve'], one['controller'], one['case']) == (given.valve, controller, key)}
            left += [(key, number) for number in range(round(given.times * SHARE[key]))
                     if number not in known]
        random.Random(f'{given.seed} order').shuffle(left)
        rig = None
        try:
            for key, number in tqdm(left, unit='fault', disable=None):
                if rig is None:
                    rig = Rig(given.valve, self._folder / f'rig_{self._rigs}', controller)
                    self._rigs += 1
                    self._come_up(rig)
                rng = random.Random(f'{given.seed} {given.valve} {controller} {key} {number}')
                outcome = play(rig, key, rng)
                outcome.update(valve=given.valve, controller=controller, case=key, number=number)
                with open(self._path, 'a', encoding='utf-8') as stream:
                    stream.write(json.dumps(outcome) + '\n')
                self.outcomes.append(outcome)
                if not outcome.get('restarted', True):
                    rig.close()
                    rig = None
        finally:
            if rig is not None:
                rig.close()

    @staticmethod
    def _come_up(rig):
        if not rig.controller:
            deadline = time.monotonic() + START_S
            while DRIVER not in rig.witness.last and time.monotonic() < deadline:
                rig.command(P_ATM_PA, 0.5)
            rig.command(P_ATM_PA, 3.0)
        elif not rig.wait_until_sound(START_S):
            raise RuntimeError(f'the rig did not come up: {rig.what_nodes_say()}')
        rig.witness.listen(3.0)


def command_line():
    """Return the parser of the command line."""
    return series_parser(CASES, 'recoveries.jsonl', __doc__, 'recoveries', times=10)


def main():
    """Play, print the table; exit code 1 if anything was not as it must be."""
    return run_series(command_line(), __file__, Series, table, good)


if __name__ == '__main__':
    sys.exit(main())
