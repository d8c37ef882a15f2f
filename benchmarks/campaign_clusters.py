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

"""Parts `clusters`, `losses` of `benchmarks/campaign.py`: processes, Dask, Ray on this machine."""

import contextlib
import dataclasses
import os
from pathlib import Path
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

from campaign_kills import content, listed, LONGEST_S, started
from campaign_stand_in import WAIT_S, work_on_list
from pam_actuation.campaign import Case, Settings
from pam_actuation.campaign.campaign import Task, work_and_keep
from pam_actuation.campaign.store import CASES
from pam_actuation.workers import Workers
from pam_actuation.workers.calls import call, packed
from pam_sim.errors import InputError
from pam_sim.files import UNFINISHED

ROOT = Path(__file__).resolve().parent.parent
PATHS = os.pathsep.join(map(str, (ROOT, ROOT / 'benchmarks', ROOT / 'test' / 'hidden')))
SIZES = (1, 2, 4, 8)
EMPTY = 200
CASE_S = 2.35      # processor time of a case of the part `page`
ROLLOUT_S = 0.004  # of a rollout of 20 s, docs/results/tuning_speed.md


def nothing(shared, item):
    """Return what was given: a task without work."""
    return item


def show(args):
    """Run the same campaign everywhere; print; return the exit code."""
    right, rows, reference = True, [], None
    places = [('processes', size) for size in SIZES] + [('Dask', size) for size in SIZES]
    if args.ray:
        places += [('Ray', size) for size in SIZES]
    for kind, size in places:
        with {'processes': contextlib.nullcontext, 'Dask': dask, 'Ray': ray_cluster}[kind](
                *(() if kind == 'processes' else (size,))) as address:
            out = emptied(args, f'on_{kind}_{size}')
            overhead_s = empty(size, address)
            campaign = work_on_list(listed(args), out, size, address)
        reference = reference or content(out)
        same = content(out) == reference
        right &= same
        rows.append((kind, size, campaign.seconds, overhead_s, same))
        print(f'{kind} {size}: {campaign.seconds:.1f} s, {same}', file=sys.stderr, flush=True)
    print(f'{args.cases} recordings. In place of `pam gap` stands work that waits '
          f'{WAIT_S:g} s; the rest is real. The time counts from an idle cluster to the last '
          'case, with the start of local processes.\n')
    print('| workers | number | wall clock [s] | cases per minute | efficiency | overhead per '
          'empty task [ms] | bytes |\n|---|---|---|---|---|---|---|')
    for kind, size, wall_s, overhead_s, same in rows:
        print(f'| {kind} | {size} | {wall_s:.1f} | {60 * args.cases / wall_s:.0f} | '
              f'{args.cases * WAIT_S / wall_s / size:.2f} | {1e3 * overhead_s:.2f} | '
              f'{"equal" if same else "differ"} |')
    print('\nEfficiency is the time waited in all, divided by wall clock and number of workers. '
          f'The machine has {os.cpu_count()} cores. '
          'Work that waits shows how tasks are handed to more workers than there are cores. It '
          'cannot show how work that computes shares memory, caches and the file system.')
    model(rows)
    return int(not right)


def losses(args):
    """Lose a worker and a scheduler, again and again; print; return the exit code."""
    alone = args.work / 'alone'
    shutil.rmtree(alone, ignore_errors=True)
    work_on_list(listed(args), alone, args.jobs)
    reference = content(alone)
    told = []
    for number in range(args.rounds):
        told.append([*lost_worker(args, reference), *lost_scheduler(args, reference)])
        print(f'{number + 1}: {told[-1]}', file=sys.stderr, flush=True)
    print(f'{args.cases} recordings, with the stand-in. {args.rounds} rounds. The loss comes '
          'when two cases are done.\n\n'
          '| lost, of a Dask cluster of two | ends with | bytes equal to those of local '
          'processes |\n|---|---|---|')
    for what, round_ in zip(told[0], zip(*told)):
        ends = sorted({one.ends for one in round_})
        print(f'| {what.lost} | {" or ".join(ends)} | '
              f'{sum(one.same for one in round_)} of {args.rounds} |')
    return int(not all(one.right for round_ in told for one in round_))


@dataclasses.dataclass
class Loss:
    """What was lost, what the campaign ended with, and whether both is right."""

    lost: str
    ends: str
    same: bool
    code_right: bool

    @property
    def right(self):
        """Return whether bytes and exit code are right."""
        return self.same and self.code_right


def empty(size, address):
    """Return the time of one task without work [s], once all is warm."""
    with Workers(size, address, processes=True) as workers:
        workers.map(nothing, 0, range(4 * size))
        began = time.perf_counter()
        workers.map(nothing, 0, range(EMPTY))
        return (time.perf_counter() - began) / EMPTY


def model(rows):
    """Print the number of cores up to which more of them are of use, from the overheads."""
    import cloudpickle
    task = Task('0' * 20, one_case())
    key, _ = packed((Settings('gap'), '/data/campaign/cases', '0' * 64))
    bytes_of = len(cloudpickle.dumps((call, work_and_keep, key, task)))
    whole_s, rollout_s = CASE_S, ROLLOUT_S
    print('\n### A model of the ceiling\n\nThe scheduler handles tasks one after the other, each '
          'in the time of an empty task. N workers do N tasks in the time of one. So more '
          'workers are of use up to task length divided by overhead. Half the efficiency is '
          'left there.\n\n| workers | overhead per task [ms] | tune: rollouts of '
          f'{1e3 * rollout_s:.0f} ms | campaign: cases of {whole_s:g} s |\n|---|---|---|---|')
    for kind in dict.fromkeys(row[0] for row in rows):
        least_s = min(row[3] for row in rows if row[0] == kind)
        print(f'| {kind} | {1e3 * least_s:.2f} | {rollout_s / least_s:.0f} cores | '
              f'{whole_s / least_s:.0f} cores |')
    print(f'\nA task of a campaign carries {bytes_of} bytes, and its result some hundred: a '
          'worker writes the files itself. Recordings are read where they lie. A generation of '
          '`pam tune` has as many tasks as points times loops: 24 × 3 by default, so beyond 72 '
          'cores only `--population` helps. The model leaves out the file system, which all '
          'workers share.')


def one_case():
    """Return a case as it travels."""
    return Case('/data/runs/rig_1/2026-03-01/check', 'rig_1', '2026-03-01', 20513.0)


@contextlib.contextmanager
def dask(size, port=None):
    """Give the address of a Dask scheduler with so many worker processes."""
    with contextlib.ExitStack() as stack:
        address, _ = stack.enter_context(dask_scheduler(port or free_port()))
        for _ in range(size):
            stack.enter_context(dask_worker(address))
        yield address


@contextlib.contextmanager
def dask_scheduler(port):
    """Give address and process of a scheduler."""
    with program('distributed.cli.dask_scheduler', '--host', '127.0.0.1', '--port', str(port),
                 '--no-dashboard', '--no-show') as process:
        yield f'tcp://127.0.0.1:{port}', process


@contextlib.contextmanager
def dask_worker(address):
    """Give the process of a worker that nobody starts again."""
    with tempfile.TemporaryDirectory() as folder, program(
            'distributed.cli.dask_worker', address, '--nthreads', '1', '--no-dashboard',
            '--no-nanny', '--local-directory', folder) as process:
        yield process


@contextlib.contextmanager
def program(module, *arguments):
    """Give the process of a module that is run until the end of the block."""
    process = subprocess.Popen(
        [sys.executable, '-m', module, *arguments], start_new_session=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        env={**os.environ, 'PYTHONPATH': PATHS})
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGTERM)
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


@contextlib.contextmanager
def ray_cluster(size):
    """Give the address of a Ray cluster with so many processors."""
    port, client = free_port(), 9000 + os.getpid() % 900
    with tempfile.TemporaryDirectory(dir='/tmp', prefix='ray', ignore_cleanup_errors=True) as \
            folder:
        process = subprocess.Popen(
            [str(Path(sys.executable).parent / 'ray'), 'start', '--head', '--block',
             '--node-ip-address=127.0.0.1', f'--num-cpus={size}',
             '--include-dashboard=false', '--disable-usage-stats',
             f'--port={port}', f'--ray-client-server-port={client}', f'--temp-dir={folder}'],
            start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            env={**os.environ, 'PYTHONPATH': PATHS})
        try:
            _until_it_answers(f'ray://127.0.0.1:{client}')
            yield f'ray://127.0.0.1:{client}'
        finally:
            process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(30)
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)


def _until_it_answers(address):
    """Wait for a Ray cluster: its port is open some time before it takes clients."""
    until = time.monotonic() + 120.0
    while True:
        try:
            with Workers(1, address):
                return
        except InputError:
            if time.monotonic() > until:
                raise
        time.sleep(1.0)


def free_port():
    """Return a port that nobody listens at."""
    with socket.socket() as one:
        one.bind(('127.0.0.1', 0))
        return one.getsockname()[1]


def lost_worker(args, reference):
    """Kill a worker in the middle; return what came of it."""
    out = emptied(args, 'lost_worker')
    with contextlib.ExitStack() as stack:
        address, _ = stack.enter_context(dask_scheduler(free_port()))
        first, _ = (stack.enter_context(dask_worker(address)) for _ in range(2))
        process = started(args, out, address)
        _until(out, 2, process)
        os.killpg(first.pid, signal.SIGKILL)        # it does not come back
        code = process.wait(LONGEST_S)
    return [Loss('a worker', f'exit code {code}', content(out) == reference, code == 0)]


def lost_scheduler(args, reference):
    """Kill the scheduler in the middle and start another one, or none; return what came of it."""
    out, port = emptied(args, 'lost_scheduler'), free_port()
    with contextlib.ExitStack() as stack:
        address, scheduler = stack.enter_context(dask_scheduler(port))
        for _ in range(2):
            stack.enter_context(dask_worker(address))
        process = started(args, out, address)
        _until(out, 2, process)
        os.killpg(scheduler.pid, signal.SIGKILL)
        scheduler.wait()
        time.sleep(5.0)
        stack.enter_context(dask(2, port))
        code = process.wait(LONGEST_S)
    again = Loss('the scheduler, started again 5 s later', f'exit code {code}',
                 content(out) == reference, code == 0)
    out = emptied(args, 'no_scheduler')
    with dask_scheduler(free_port()) as (address, scheduler), dask_worker(address):
        process = started(args, out, address)
        _until(out, 2, process)
        os.killpg(scheduler.pid, signal.SIGKILL)
        gone = process.wait(LONGEST_S)
    resumed = started(args, out).wait(LONGEST_S)
    return [again, Loss(
        'the scheduler for ever',
        f'exit code {gone}; the same command on this machine ends with {resumed}',
        content(out) == reference, gone == 1 and resumed == 0)]


def emptied(args, name):
    """Return the folder of a campaign that begins anew."""
    shutil.rmtree(args.work / name, ignore_errors=True)
    return args.work / name


def _until(folder, count, process):
    """Wait until so many cases are done."""
    until = time.monotonic() + LONGEST_S
    while time.monotonic() < until and process.poll() is None:
        cases = list((folder / CASES).glob('*'))
        if sum(not one.name.startswith(UNFINISHED) for one in cases) >= count:
            return
        time.sleep(0.05)
