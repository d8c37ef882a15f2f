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
What the live page costs a rig: ticks late or missed, processor, frames per second.

    python benchmarks/view_load.py --seconds 20 --rounds 3

Plant at 1 kHz, controller at 500 Hz, all nodes and the recorder live, all in one run. Phases take
turns, so that each has its share of what else the machine does. Four phases are: no viewer, one
page in a real browser, 20 pages, and 20 pages beside one that never reads. In the last one a
viewer is killed (SIGKILL) and started again. With ``--alone`` viewer and pages have a nice value
of -15, as on a machine that has nothing else to do. They get no real-time priority: Linux stops
all such processes of a core for 50 ms a second if they use it up. Behind a regulator the driver
ticks with each command, more often than once in its own period, so none of its ticks counts as
missed. Counted are its ticks that come more than 1.5 periods after the one before. Late ticks of
the driver and missed ones of the controller are judged. Exit code 1 if a share of theirs, in a
phase with the viewer, is over 0.1 % beyond the worst round without.
"""

import argparse
import asyncio
from collections import defaultdict
import json
import os
from pathlib import Path
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time

from pam_actuation.rigging import session
from pam_actuation.rigging.plan import make_plan, PLANT
from pam_actuation.rigging.processes import node_environment
from recording_load import CONTROLLER_HZ, experiment_text, fast_controller, PLANT_HZ
import results_page
from tornado.websocket import websocket_connect

sys.path.append(str(Path(__file__).resolve().parents[1] / 'test' / 'view'))
from browser import Browser, find_chromium  # noqa: E402, I100

WITHOUT, BROWSER, MANY, DEAF, KILLED = (
    'no viewer', 'one page in Chromium', '20 pages', '20 pages, one more never reads',
    'viewer killed again and again')
# Of each loop what is counted; a driver that ticks with each command misses none of its period.
LOOPS = {'valve_driver': 'loop.overruns', 'sofc_controller': 'loop.missed', PLANT: 'loop.missed'}
JUDGED = 'valve_driver', 'sofc_controller'
PAGES, WINDOW_S = 20, 10
KILL_EVERY_S = 4.0
SETTLE_S = 4.0              # of the viewer and its pages, before a phase counts
ANSWER_S = 60.0             # of a browser, on a busy machine
ALLOWED = 0.001
NICENESS = -15
BEFORE_OTHERS = ('nice', '-n', str(NICENESS))
TICKS_PER_S = os.sysconf('SC_CLK_TCK')


def cpu_s(pid):
    """Return the processor time of a process and all below it [s]."""
    total, waiting = 0.0, [pid]
    while waiting:
        one = waiting.pop()
        try:
            fields = Path(f'/proc/{one}/stat').read_text().rsplit(')', 1)[1].split()
            waiting += map(int, Path(f'/proc/{one}/task/{one}/children').read_text().split())
        except OSError:
            continue
        total += (int(fields[11]) + int(fields[12])) / TICKS_PER_S
    return total


def be_pages(port, count, deaf):
    """Be some pages until SIGTERM, and one that never reads; print the pictures each got."""
    got = [0] * count
    ask = json.dumps({'do': 'watch', 'view': '', 'window_s': WINDOW_S})

    async def page(number):
        connection = await websocket_connect(f'ws://localhost:{port}/socket')
        await connection.write_message(ask)
        while (message := await connection.read_message()) is not None:
            got[number] += isinstance(message, bytes)

    async def main():
        ended = asyncio.Event()
        asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, ended.set)
        tasks = [asyncio.ensure_future(page(number)) for number in range(count)]
        never = [never_reading(port) for _ in range(deaf)]
        await asyncio.sleep(SETTLE_S / 2)
        got[:], begin = [0] * count, time.monotonic()
        await ended.wait()
        print(json.dumps({'rates': [one / (time.monotonic() - begin) for one in got],
                          'deaf_were_let_go': sum(map(is_closed, never))}))
        for task in tasks:
            task.cancel()

    asyncio.run(main())


def never_reading(port):
    """Return a connection that asks for the page and reads nothing."""
    one = socket.create_connection(('localhost', port))
    one.sendall((f'GET /socket HTTP/1.1\r\nHost: localhost:{port}\r\nUpgrade: websocket\r\n'
                 'Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n'
                 'Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n').encode())
    ask = b'{"do":"watch","window_s":10}'
    one.sendall(bytes([0x81, 0x80 | len(ask), 0, 0, 0, 0]) + ask)
    return one


def is_closed(connection):
    """Tell whether the other end has closed a connection of which nothing was read."""
    connection.setblocking(False)
    try:
        while connection.recv(1 << 20):
            pass
        return True
    except BlockingIOError:
        return False
    except OSError:
        return True


class Viewer:
    """A viewer process of a domain."""

    def __init__(self, environment, domain_id, before):
        self._process = subprocess.Popen(
            [*before, sys.executable, '-m', 'pam_actuation.cli.main', 'view', '--json',
             '--port', '0', '--domain-id', str(domain_id)],
            env=environment, stdout=subprocess.PIPE, text=True, start_new_session=True)
        self.pid = self._process.pid
        self.port = int(json.loads(self._process.stdout.readline())['url'].split(':')[2][:-1])
        for thread in Path(f'/proc/{self.pid}/task').iterdir() if before else ():
            os.setpriority(os.PRIO_PROCESS, int(thread.name), NICENESS)     # it lowers its own

    def end(self, number=signal.SIGINT):
        """End it by a signal."""
        self._process.send_signal(number)
        self._process.wait(10.0)
        self._process.stdout.close()


class Director:
    """Goes through the phases in a thread while the rig runs; ``rows`` is what was found."""

    def __init__(self, rig, environment, args, folder):
        self._rig, self._environment, self._args = rig, environment, args
        self._folder = Path(folder)
        self._before = BEFORE_OTHERS if args.alone else ()
        self.rows = defaultdict(list)
        self.problem = self.browser = None
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        phases = [WITHOUT, *([BROWSER] if find_chromium() else []), MANY, DEAF, KILLED]
        try:
            time.sleep(5.0)
            for number in range(self._args.rounds):
                for phase in phases:
                    self._phase(phase, number)
        except Exception as error:
            self.problem = error
            if self.browser:
                self.browser.close()

    def _counts(self):
        """Return of each loop (ticks that ran, ticks late or missed) by the last status."""
        statuses = self._rig.group.started.statuses
        values = {name: statuses[f'{self._rig.namespace}/{name}'][2] for name in LOOPS}
        return {name: (int(one['loop.ticks']), int(one[LOOPS[name]]))
                for name, one in values.items()}

    def _phase(self, phase, number):
        viewer = pages = None
        row = {'kills': 0}
        if phase != WITHOUT:
            viewer = Viewer(self._environment, self._rig.domain_id, self._before)
        if phase in (MANY, DEAF):
            pages = subprocess.Popen(
                [*self._before, sys.executable, __file__, '--pages', str(PAGES),
                 '--port', str(viewer.port), '--deaf', str(int(phase == DEAF))],
                stdout=subprocess.PIPE, text=True)
        browser = None
        if phase == BROWSER:
            browser = self.browser = Browser(
                self._folder / f'chromium{number}', self._before, ANSWER_S)
            browser.size(1280, 900)
            browser.go_to(f'http://localhost:{viewer.port}/')
            browser.wait_for('page.time !== null', ANSWER_S)
        time.sleep(SETTLE_S)
        before, begin = self._counts(), time.monotonic()
        used = cpu_s(viewer.pid) if viewer else 0.0
        drawn = browser.run('page.drawn') if browser else 0
        drawing = cpu_s(browser.pid) if browser else 0.0
        end = begin + self._args.seconds
        while (left := end - time.monotonic()) > 0.0:
            if phase != KILLED:
                time.sleep(left)
                continue
            time.sleep(min(KILL_EVERY_S, left))
            viewer.end(signal.SIGKILL)
            row['kills'] += 1
            viewer = Viewer(self._environment, self._rig.domain_id, self._before)
        after, span_s = self._counts(), time.monotonic() - begin
        row['loops'] = {name: (after[name][0] - before[name][0], after[name][1] - before[name][1])
                        for name in LOOPS}
        if viewer and phase != KILLED:
            row['cpu'] = (cpu_s(viewer.pid) - used) / span_s
        if browser:
            row['rates'] = [(browser.run('page.drawn') - drawn) / span_s]
            row['page_cpu'] = (cpu_s(browser.pid) - drawing) / span_s
            browser.close()
            self.browser = None
        if pages:
            pages.terminate()
            row.update(json.loads(pages.communicate(timeout=20.0)[0]))
        if viewer:
            viewer.end()
        self.rows[phase].append(row)

    def wait(self):
        """Wait for the end; raise what went wrong."""
        self._thread.join()
        if self.problem:
            raise self.problem


def measure(args, folder):
    """Return the rows of all phases, and what the session says."""
    seconds = 5 * args.rounds * (args.seconds + 15.0) + 30.0
    controller = Path(folder) / 'controller.yaml'
    controller.write_text(fast_controller(CONTROLLER_HZ))
    plan = make_plan(experiment_text(seconds), 'dmsp_5_300_realistic', str(controller), 'ppr',
                     str(Path(folder) / 'bag'))
    plan.parameters[PLANT]['publish_rate_hz'] = PLANT_HZ
    try:
        with session.RigSession(plan) as rig:
            rig.start()
            director = Director(rig, node_environment(rig.domain_id, plan.folder), args, folder)
            while director._thread.is_alive():
                rig.group.started.spin(0.1)
                ended = rig.group.ended()
                if ended:
                    raise SystemExit(rig.processes[ended].how_it_ended())
            director.wait()
            rig.finish()
    finally:
        plan.remove()
    return director.rows


def share(name, ticks, counted):
    """Return which share of the ticks of a loop were late, or did not run (of those due)."""
    due = ticks + counted if LOOPS[name] == 'loop.missed' else ticks
    return counted / max(due, 1)


def middle_of(numbers, form, end=max):
    """Return the median and the worst number as text."""
    numbers = list(numbers)
    if not numbers:
        return '–'
    return f'{form.format(statistics.median(numbers))} ({form.format(end(numbers))})'


def judge(rows, args):
    """Print the table; return whether the bars are met."""
    print(f'{args.rounds} rounds of {args.seconds:g} s a phase; the median of the rounds, and the '
          f'worst in brackets. Load average at the end: {os.getloadavg()[1]:.1f}.\n')
    print('| phase | driver: ticks late | controller: ticks missed | plant: ticks missed '
          '| viewer, cores | frames/s of the slowest page | browser, cores |')
    print('|---|---|---|---|---|---|---|')
    worst, good = {}, True
    for phase, found in rows.items():
        shares = {name: [share(name, *one['loops'][name]) for one in found] for name in LOOPS}
        if phase == WITHOUT:
            worst = {name: max(values) for name, values in shares.items()}
        good &= all(max(shares[name]) <= worst[name] + ALLOWED for name in JUDGED)
        cells = [middle_of(shares[name], '{:.3%}') for name in LOOPS]
        cells.append(middle_of((one['cpu'] for one in found if 'cpu' in one), '{:.2f}'))
        cells.append(middle_of(
            (min(one['rates']) for one in found if 'rates' in one), '{:.1f}', min))
        cells.append(middle_of((one['page_cpu'] for one in found if 'page_cpu' in one), '{:.2f}'))
        print(f'| {phase} | {" | ".join(cells)} |')
    killed = sum(one['kills'] for one in rows[KILLED])
    gone = sum(one['deaf_were_let_go'] for one in rows[DEAF])
    print(f'\nThe viewer was killed {killed} times. Of the {len(rows[DEAF])} pages that never '
          f'read, {gone} were let go before the phase was over.')
    return good


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--seconds', type=float, default=20.0, help='of a phase')
    parser.add_argument('--rounds', type=int, default=3)
    parser.add_argument('--alone', action='store_true',
                        help='viewer and pages go before all else but the nodes')
    parser.add_argument('--pages', type=int, help=argparse.SUPPRESS)
    parser.add_argument('--deaf', type=int, default=0, help=argparse.SUPPRESS)
    parser.add_argument('--port', type=int, help=argparse.SUPPRESS)
    results_page.add_write(parser, 'view')
    return parser


def main():
    """Measure and judge."""
    args = command_line().parse_args()
    if args.pages:
        be_pages(args.port, args.pages, args.deaf)
        return 0
    with results_page.printed(args, __file__):
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            rows = measure(args, folder)
        return 0 if judge(rows, args) else 1


if __name__ == '__main__':
    sys.exit(main())
