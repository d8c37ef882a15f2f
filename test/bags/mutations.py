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
Bags with something wrong in them, thousands of kinds, and what may come of reading one.

Run ``python test/bags/mutations.py --cases 10000``: every case is made from a seed, so that
``--first SEED --cases 1`` repeats it. Whatever is wrong, ``pam info`` and ``load_run`` must
answer within the limits of time and memory with what is right in the bag, or with one sentence
(exit code 2). Of bags with checksums every message that is read must be one that was written.
"""

import argparse
from collections import Counter
import contextlib
import functools
import io
import json
from pathlib import Path
import random
import resource
import shutil
import signal
import tempfile
import traceback

from mutated_bytes import mutate_bytes, mutate_metadata, mutate_records
import numpy as np
from pam_actuation.bags import layout
from pam_actuation.bags.load import load_run
from pam_actuation.cli.common import EXIT_BAD_INPUT
from pam_actuation.cli.main import build_parser
from pam_sim.errors import InputError
from rosbags.rosbag2 import CompressionMode, StoragePlugin
from sample_bag import write_bag
from sample_foreign import write_mcap, write_with_rosbags

COUNT = 30
LIMIT_S = 5.0
LIMIT_BYTES = 512 * 1024**2
MAX_SENTENCE = 2000
# Bags whose every message is under a checksum.
CHECKED = ('recorded', 'lz4')
FORMS = {
    'recorded': lambda path: write_bag(path, COUNT),
    'lz4': lambda path: write_mcap(path, COUNT, 'lz4', chunk_size=4000),
    'plain chunks': lambda path: write_mcap(path, COUNT, '', chunk_size=4000, enable_crcs=False),
    'no chunks': lambda path: write_mcap(path, COUNT, '', use_chunking=False),
    'sqlite3': lambda path: write_with_rosbags(path, COUNT, StoragePlugin.SQLITE3),
    'compressed sqlite3': lambda path: write_with_rosbags(
        path, COUNT, StoragePlugin.SQLITE3, CompressionMode.FILE),
}
# The last two are read by rosbags, which takes its time over their metadata.
WEIGHTS = (4, 4, 4, 4, 1, 1)


class TimeLimit(BaseException):
    """A case took too long; not an Exception, so that no ``except`` takes it for a damage."""


class Mutations:
    """
    Sound bags in ``folder``, and cases made from them.

    Call ``check(seed)`` for each case; ``outcomes`` counts what came of them and
    ``findings`` keeps a text per case that did what it must not do.
    """

    def __init__(self, folder):
        self.folder = Path(folder)
        self.sound = {}
        self.outcomes = Counter()
        self.findings = []
        for name, make in FORMS.items():
            path = make(self.folder / name.replace(' ', '_'))
            self.sound[name] = (path, _messages(load_run(path)))
            pam_quietly(['info', str(path)])

    def check(self, seed):
        """Make the case of a seed, read it every way and note what came of it."""
        rng = random.Random(seed)
        form = rng.choices(list(FORMS), WEIGHTS)[0]
        case = self.folder / 'case'
        shutil.rmtree(case, ignore_errors=True)
        done = self._make(rng, form, case)
        known = self.sound[form][1] if form in CHECKED else None
        for reader in (check_info, check_load):
            recover = rng.random() < 0.5
            try:
                with limits():
                    outcome = reader(case, recover, known)
            except (Exception, TimeLimit):
                outcome = 'wrong'
                self.findings.append(
                    f'seed {seed} ({form}, {done}, {reader.__name__}, recover={recover}):\n'
                    + traceback.format_exc(limit=-6))
            self.outcomes[outcome] += 1

    def _make(self, rng, form, case):
        kind = rng.choices(('bytes', 'metadata', 'records'), (7, 2, 1))[0]
        if kind == 'records':
            write_bag(case, 5, metadata=mutate_records(rng))
            return kind
        shutil.copytree(self.sound[form][0], case)
        files = sorted(path for path in case.iterdir() if path.name != layout.METADATA_FILE)
        metadata = case / layout.METADATA_FILE
        if kind == 'metadata' and metadata.exists():
            metadata.write_bytes(mutate_metadata(rng, metadata.read_bytes()))
            return kind
        file = rng.choice(files)
        file.write_bytes(mutate_bytes(rng, file.read_bytes()))
        return f'{kind} of {file.name}'


@contextlib.contextmanager
def limits():
    """Raise TimeLimit or MemoryError in the body where it takes too much."""
    def stop(*_):
        raise TimeLimit(f'took more than {LIMIT_S} s')

    pages = int(Path('/proc/self/statm').read_text().split()[0])
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    before = signal.signal(signal.SIGALRM, stop)
    resource.setrlimit(
        resource.RLIMIT_AS, (pages * resource.getpagesize() + LIMIT_BYTES, hard))
    signal.setitimer(signal.ITIMER_REAL, LIMIT_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


@functools.lru_cache(maxsize=1)
def _parser():
    return build_parser()


def pam_quietly(arguments):
    """Return (exit code, stdout, stderr) of ``pam``, called in this process."""
    args = _parser().parse_args(arguments)
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = args.call(args)
        except InputError as mistake:
            return EXIT_BAD_INPUT, out.getvalue(), str(mistake)
    return code, out.getvalue(), err.getvalue()


def check_info(path, recover, _):
    """Call ``pam info`` as text and as JSON; AssertionError where it misbehaves."""
    code, out, err = pam_quietly(['info', str(path)] + ['--recover'] * recover)
    if code == EXIT_BAD_INPUT:
        assert not out, out
        assert_sentence(err)
        return 'refused'
    assert code in (0, 1) and out and not err, (code, out, err)
    _, document, _ = pam_quietly(['info', str(path), '--json'] + ['--recover'] * recover)
    assert json.loads(document)['path'] == str(path)
    return 'read'


def check_load(path, recover, known):
    """Call ``load_run``; AssertionError for a message that nobody wrote."""
    try:
        run = load_run(path, recover=recover)
    except InputError as mistake:
        assert_sentence(str(mistake))
        return 'refused'
    found = _messages(run)
    if known is not None:
        assert found <= known, f'not in the sound bag: {sorted(found - known)[:3]}'
    for one in run.topics.values():
        assert all(len(column) == len(one) for column in one.values.values())
        assert (np.diff(one.stamp_ns) >= 0).all()
    return 'read' if not run.remarks else 'read with remarks'


def assert_sentence(text):
    """Check that an answer is one sentence of bearable length."""
    assert text and '\n' not in text and len(text) < MAX_SENTENCE, repr(text[:3000])


def _messages(run):
    """Return the messages of a run as a set of (topic, stamp, values)."""
    return {
        (short, int(stamp_ns), *map(float, values))
        for short, one in run.topics.items()
        for stamp_ns, *values in zip(one.stamp_ns, *one.values.values())}


def main():
    """Run the cases and print what came of them; exit code 1 where one misbehaved."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--cases', type=int, default=10_000)
    parser.add_argument('--first', type=int, default=0, help='seed of the first case')
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        mutations = Mutations(folder)
        for seed in range(args.first, args.first + args.cases):
            mutations.check(seed)
    for finding in mutations.findings[:20]:
        print(finding)
    print(f'{args.cases} bags, each read two ways: ' + ', '.join(
        f'{number} {outcome}' for outcome, number in sorted(mutations.outcomes.items())))
    return 1 if mutations.findings else 0


if __name__ == '__main__':
    raise SystemExit(main())
