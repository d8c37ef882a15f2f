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

"""Part `kills` of `benchmarks/campaign.py`: a campaign killed at random moments."""

import hashlib
import os
from pathlib import Path
import random
import shutil
import signal
import subprocess
import sys
import time

from campaign_stand_in import WAIT_S
from pam_actuation.campaign.store import CASES, TIMES
from pam_actuation.kept_folders import LOCK
from pam_sim.files import UNFINISHED

ROOT = Path(__file__).resolve().parent.parent
LONGEST_S = 600.0


def listed(args, cases=None):
    """Write the list of the first recordings of each rig; return its path."""
    cases = cases or args.cases
    bags = sorted(args.work.glob('lab/rig_*/*/check'), key=lambda path: path.parts[-2::-1])
    if len(bags) < cases:
        raise SystemExit(f'{args.work} has {len(bags)} recordings: run the part page first')
    path = args.work / f'first_{cases}.txt'
    path.write_text('\n'.join(os.path.relpath(bag, args.work) for bag in bags[:cases]),
                    encoding='utf-8')
    return path


def content(folder):
    """Return one digest of all files of a campaign, times aside."""
    digest = hashlib.sha256()
    for path in sorted(Path(folder).rglob('*')):
        if path.is_file() and path.name not in (TIMES, LOCK):
            digest.update(str(path.relative_to(folder)).encode() + b'\0' + path.read_bytes())
    return digest.hexdigest()


def started(args, out, *address):
    """Start a campaign of the stand-in, with its workers in a process group of its own."""
    program = ROOT / 'benchmarks' / 'campaign_stand_in.py'
    return subprocess.Popen(
        [sys.executable, str(program), str(listed(args)), str(out), str(args.jobs), *address],
        cwd=ROOT, start_new_session=True, stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, 'PYTHONPATH': f'{ROOT}:{ROOT / "benchmarks"}'})


def show(args):
    """Run undisturbed and killed; print; return the exit code."""
    moments = random.Random(args.seed)
    whole, killed = args.work / 'whole', args.work / 'killed'
    for folder in (whole, killed):
        shutil.rmtree(folder, ignore_errors=True)
    started(args, whole).wait(LONGEST_S)
    lost, at_start, kept = [], 0, 0
    for number in range(args.kills):
        left = begun(killed)
        process = started(args, killed)
        # As long as it takes to load, and then any moment of some cases.
        _until_it_works(killed, process, left)
        time.sleep(moments.uniform(0.0, 8.0 * WAIT_S))
        if process.poll() is not None:
            raise SystemExit(f'all cases were done after {number} of {args.kills} kills; '
                             'give more --cases')
        if number % 2:
            os.killpg(process.pid, signal.SIGKILL)      # as when the power fails
        else:
            process.kill()                              # the workers end by themselves
        process.wait()
        _until_workers_ended(process.pid)
        unfinished = len(begun(killed))
        done = len(list((killed / CASES).iterdir())) - unfinished
        lost.append(unfinished)
        at_start += done == kept
        kept = done
    process = started(args, killed)
    process.wait(LONGEST_S)
    same = content(whole) == content(killed)
    worked = len((killed / TIMES).read_text(encoding='utf-8').splitlines())
    print(f'{args.cases} recordings, {args.jobs} workers, {args.kills} kills with SIGKILL, in '
          'turn of the campaign alone and of all its processes. In place of `pam gap` stands '
          f'work that reads the recording, waits {WAIT_S:g} s and writes four files; store, '
          'workers, table and page are the real ones.\n')
    print('| | |\n|---|---|')
    print(f'| bytes at the end | {"equal" if same else "differ"} |')
    print(f'| cases lost by a kill, at most | {max(lost)} of {args.jobs} workers |')
    print(f'| cases lost by a kill, mean | {sum(lost) / len(lost):.2f} |')
    print(f'| cases in the folder twice | {kept_twice(killed)} |')
    print(f'| kills before another case was done | {at_start} of {args.kills} |')
    print(f'| cases whose end was told to the campaign | {worked} of {args.cases}; the others '
          'were kept by workers whose campaign had been killed |')
    return int(not same or max(lost) > args.jobs)


def kept_twice(folder):
    """Return how many cases were told as done more than once."""
    keys = [line.split(',')[0] for line in
            (folder / TIMES).read_text(encoding='utf-8').splitlines()]
    return len(keys) - len(set(keys))


def begun(folder):
    """Return the names of the folders of cases that were begun and not ended."""
    return {path.name for path in (folder / CASES).glob(f'{UNFINISHED}*')}


def _until_it_works(folder, process, left):
    """Wait until another case is begun than those ``left``, or the campaign has ended."""
    until = time.monotonic() + LONGEST_S
    while process.poll() is None and time.monotonic() < until:
        if begun(folder) - left:
            return
        time.sleep(0.02)


def _until_workers_ended(group):
    """Wait until no process of a group is left."""
    until = time.monotonic() + LONGEST_S
    while time.monotonic() < until:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return
        time.sleep(0.1)
