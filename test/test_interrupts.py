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
"""Test where an interruption is raised, where it waits, and where it is too late."""

import os
from pathlib import Path
import subprocess
import sys

ROOT = Path(__file__).resolve().parent.parent
BEGIN = 'import os, signal, time; from pam_actuation import interrupts\n' \
    'def ask(): os.kill(os.getpid(), signal.SIGINT)\n'
WORK = BEGIN + """
def main():
    interrupts.Worker()
    try:
        work()
        time.sleep(2.0)
        print('not interrupted')
    except KeyboardInterrupt:
        print('interrupted')
"""


def run(code, folder):
    """Return (exit code, output, errors) of a program."""
    done = subprocess.run(
        [sys.executable, '-c', code], cwd=folder, capture_output=True, text=True, timeout=30,
        env={**os.environ, 'PYTHONPATH': f'{folder}{os.pathsep}{ROOT}'})
    return done.returncode, done.stdout.split('\n')[:-1], done.stderr


def test_before_the_work_the_process_ends_at_once(tmp_path):
    for begin, code in (("interrupts.leave_at_once('pam')", 130),
                        ("interrupts.leave_at_once('node', 0, interrupts.ENDING)", 0)):
        name = begin.split("'")[1]
        assert run(BEGIN + begin + '\ntry:\n    ask()\nfinally:\n    print("late")', tmp_path) == (
            code, [], f'{name}: stopped by SIGINT\n')


def test_an_import_is_not_torn(tmp_path):
    (tmp_path / 'slow.py').write_text(
        'import os, signal, time\nos.kill(os.getpid(), signal.SIGINT)\ntime.sleep(0.1)\n'
        'print("imported")\n')
    code = WORK + 'def work():\n    import slow\n    print("and after it")\n    time.sleep(1.0)\n'
    assert run(code + 'main()', tmp_path) == (
        0, ['imported', 'and after it', 'interrupted'], '')


def test_what_falls_into_a_callback_is_raised_again(tmp_path):
    code = WORK + """
import weakref
class Something: pass
def work():
    it = Something()
    reference = weakref.ref(it, lambda _: ask())        # cannot hand on an exception
    del it
"""
    assert run(code + 'main()', tmp_path) == (0, ['interrupted'], '')


def test_a_destructor_is_not_torn(tmp_path):
    code = WORK + """
class Owner:
    def __del__(self):
        ask()
        time.sleep(0.1)
        print('closed')
def work():
    it = Owner()
    del it
"""
    assert run(code + 'main()', tmp_path) == (0, ['closed', 'interrupted'], '')


def test_impatience_does_not_disturb_the_end(tmp_path):
    code = WORK + """
def work():
    try:
        ask()
        time.sleep(1.0)
    finally:
        for _ in range(3):
            ask()
        with interrupts.undisturbed():
            time.sleep(1.1)
            ask()
            time.sleep(0.01)
        print('cleaned up')
main()
interrupts.ignore()
ask()
interrupts.end_interrupted()
"""
    assert run(code, tmp_path) == (130, ['cleaned up', 'interrupted'], '')


def test_what_may_hang_is_closed_once_the_result_is_told(tmp_path):
    code = BEGIN + """
def close(text): interrupts.closing.close(lambda: print(text, flush=True))
close('at once')
interrupts.closing.wait()
if not os.fork():
    close('in a child')
    os._exit(0)
os.wait()
close('before the next')
interrupts.closing.now()
close('last')
print('result', flush=True)
interrupts.closing.end(0)
close('at once')
"""
    assert run(code, tmp_path) == (
        0, ['at once', 'in a child', 'before the next', 'result', 'last', 'at once'], '')


def test_what_hangs_at_the_end_changes_no_exit_code(tmp_path):
    """It hangs with the lock of the interpreter held: first as it is closed, then after that."""
    hangs = 'lambda: ctypes.PyDLL(None).sleep(600)'
    begin = ('import atexit, ctypes\n' + BEGIN
             + 'interrupts.LEAVE_S = 0.5\ninterrupts.closing.wait()\n')
    for end in (f'interrupts.closing.close({hangs})',
                f'atexit.register({hangs}); interrupts.closing.close(int)'):
        code = f'{begin}{end}\nprint("result", flush=True)\ninterrupts.closing.end(1)\n'
        assert run(code, tmp_path) == (1, ['result'], '')


def test_what_was_asked_too_late_does_not_end_the_process(tmp_path):
    """The interpreter gives SIGALRM its deadly default back while it ends."""
    code = BEGIN + """
interrupts.AGAIN_S = 0.2        # surely after main(), on a busy machine as well
class Owner:
    def __del__(self):
        ask()
        print('closed')
class Last:
    def __del__(self, sleep=time.sleep):
        sleep(0.4)
last = Last()
def main():
    interrupts.Worker()
    Owner()
    interrupts.ignore()
main()
"""
    assert run(code, tmp_path) == (0, ['closed'], '')


def test_processes_of_joblib_do_not_hear_ctrl_c(tmp_path):
    """The trackers that joblib starts first let signals through to the workers again."""
    (tmp_path / 'asks.py').write_text(
        'import signal\n'
        'def blocked(_):\n'
        '    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ())\n')
    code, output, errors = run(
        'import asks, joblib; from pam_actuation.parallel import in_processes\n'
        'print(*in_processes(2, (joblib.delayed(asks.blocked)(k) for k in range(4))))', tmp_path)
    assert (code, output, errors) == (0, ['True True True True'], '')


def test_trackers_of_joblib_do_not_warn_of_what_is_tidied_up_already(tmp_path):
    code, output, errors = run(
        'import joblib\nfrom pathlib import Path\n'
        'from joblib.externals.loky.backend import resource_tracker\n'
        'from pam_actuation.parallel import in_processes\n'
        'list(in_processes(2, (joblib.delayed(abs)(k) for k in range(4))))\n'
        'resource_tracker.register("/nowhere/at/all", "folder")\n', tmp_path)
    assert (code, output, errors) == (0, [], '')


def test_a_verb_says_that_it_was_stopped_from_its_first_moment_on(tmp_path):
    """The signal comes as soon as the handler is there, or while the verb says its last words."""
    for moment in ("""
class Asked(interrupts.Worker):
    def __init__(self):
        super().__init__()
        ask()
interrupts.Worker = Asked
""", """
from pam_actuation.cli import options
told = options.complain
def interrupted(*words):
    ask()
    return told(*words)
options.complain = interrupted
interrupts.ONE_REQUEST_S = 0.0
import pam_actuation.cli.models as models
models.run = lambda args: ask()
"""):
        code = BEGIN + moment + (
            'import sys; sys.argv[1:] = ["models"]\n'
            'from pam_actuation.cli.main import main; sys.exit(main())')
        assert run(code, tmp_path) == (130, [], 'pam models: stopped\n'), moment
