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
Run every test: the live ones that judge times one after the other, and beside them all others.

The live nodes of one test take about half of two cores, and the other tests take the rest. Those
have a low priority: a live process that wakes gets a core at once. Live tests that failed
among all others are run once more, with the machine to themselves. Both times are printed.
"""

import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile

from pam_actuation.priority import give_way
from stall_watch import EXIT_CROWDED, NAMES_A_LIVE_TEST, TIMED

ROOT = Path(__file__).resolve().parent.parent
# One process more than cores: some of these tests wait as well. File by file in this order, so
# that the long files do not come last.
# They wait for cores as well, so that their limit is for what never ends.
OTHERS = ('-m', f'not ({TIMED})', '--numprocesses', str(1 + (os.cpu_count() or 1)),
          '--dist', 'loadfile', '--no-loadscope-reorder', '-o', 'timeout=900')
TESTS_FAILED = 1            # exit code of pytest


def live_tests():
    """Return the arguments of pytest for the live tests; only their files are collected."""
    files = [path.relative_to(ROOT).as_posix()
             for path in sorted((ROOT / 'test').rglob('test_*.py'))
             if NAMES_A_LIVE_TEST.search(path.read_text(encoding='utf-8'))]
    # A cache of its own: the list of what failed last belongs to one run.
    return ('-m', TIMED, '-o', 'cache_dir=.pytest_cache/live', *files)


def pytest(*arguments, **options):
    """Start pytest with these arguments, in a session of its own."""
    return subprocess.Popen(
        [sys.executable, '-m', 'pytest', *arguments], cwd=ROOT, start_new_session=True, **options)


def ended(*processes):
    """Wait for the processes and return their exit codes; whoever stops this stops them."""
    try:
        return [process.wait() for process in processes]
    except KeyboardInterrupt:
        for process in processes:
            process.send_signal(signal.SIGINT)
            process.wait()
        raise


def main():
    """Run the tests and print what they say; return 1 if any failed."""
    live_arguments = live_tests()
    with tempfile.TemporaryFile('w+') as said:
        live, others = ended(
            pytest(*live_arguments, stdout=said, stderr=subprocess.STDOUT),
            pytest(*OTHERS, preexec_fn=give_way))
        said.seek(0)
        print('\nThe live tests that ran beside them:\n', said.read(), sep='', flush=True)
    if live == TESTS_FAILED:
        print('Live tests failed beside all others; these once more:', flush=True)
        live, = ended(pytest(*live_arguments, '--last-failed'))
    if others == EXIT_CROWDED:
        print('Of the tests of low priority only live ones failed; these once more:', flush=True)
        others, = ended(pytest('-m', 'shared', '--last-failed'))
    return int(any((live, others)))


if __name__ == '__main__':
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit('stopped')
