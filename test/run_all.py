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
Run every test: the live ones that judge times, and beside them all others.

Live nodes wait more than they compute, and the others take what is left of the cores: they have
a low priority, so that a live process that wakes gets a core at once. Live tests that failed
while the machine stood still are run once more, with the machine to themselves.
"""

import contextlib
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile

from stall_watch import EXIT_STOOD_STILL, TIMED

ROOT = Path(__file__).resolve().parent.parent
# A cache of their own: the list of what failed last belongs to one run.
LIVE = ('-m', TIMED, '-o', 'cache_dir=.pytest_cache/live')
# File by file in this order, so that the long files do not come last.
OTHERS = ('-m', f'not ({TIMED})', '--numprocesses', 'auto', '--dist', 'loadfile',
          '--no-loadscope-reorder')
# A tenth of the time where a live process wants the core as well.
NICE = 10


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


def to_background():
    """Let other processes go first, as far as the system knows how."""
    os.nice(NICE)
    # Linux may share the cores between sessions first, and only then between their processes.
    with contextlib.suppress(OSError):
        Path('/proc/self/autogroup').write_text(str(NICE))


def main():
    """Run the tests and print what they say; return 1 if any failed."""
    with tempfile.TemporaryFile('w+') as said:
        code, others = ended(
            pytest(*LIVE, stdout=said, stderr=subprocess.STDOUT),
            pytest(*OTHERS, preexec_fn=to_background))
        said.seek(0)
        print('\nThe live tests that ran beside them:\n', said.read(), sep='', flush=True)
    if code == EXIT_STOOD_STILL:
        print('The machine stood still during the live tests that failed; these once more:',
              flush=True)
        code, = ended(pytest(*LIVE, '--last-failed'))
    return int(code != 0 or others != 0)


if __name__ == '__main__':
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit('stopped')
