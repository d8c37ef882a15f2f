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

# PYTHON_ARGCOMPLETE_OK
"""Entry point of ``pam``: finds the verbs, parses, runs, turns mistakes into exit code 2."""

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
import gc
import importlib
import io
import os
import re
import sys
from typing import Any, TYPE_CHECKING
import warnings

from pam_actuation import interrupts

if TYPE_CHECKING:
    from pam_actuation.cli.options import Parser

GC_THRESHOLD = 100_000, 20, 20
_OF_NO_TEXT = re.compile(r"[^\s'\"]*[\ud800-\udfff][^\s'\"]*")      # bytes that are no UTF-8


def build_parser(only: str | None = None) -> 'Parser':
    """Return the argument parser with one sub-parser per verb, or with that of one verb only."""
    from pam_actuation import __version__
    from pam_actuation.cli.options import Parser
    from pam_actuation.cli.overview import one_line, VERBS
    parser = Parser(
        prog='pam', description='Simulate, run, record, replay and tune a pneumatic muscle rig.',
        epilog='Start with "pam demo", or "pam simulate sine_quarter_hz --out runs/first".')
    parser.add_argument('--version', action='version', version=f'pam_actuation {__version__}')
    verbs = parser.add_subparsers(dest='verb', metavar='VERB', required=True)
    for name in VERBS if only is None else (only,):
        module = importlib.import_module(f'pam_actuation.cli.{name}')
        sub = verbs.add_parser(
            name, help=one_line(name), description=module.HELP,
            epilog=f'Example: {module.EXAMPLE}',
            formatter_class=argparse.RawDescriptionHelpFormatter)
        sub.add_argument(
            '--json', action='store_true', help='print the result as JSON, for programs')
        module.add_arguments(sub)
        sub.set_defaults(call=module.run)
    return parser


def main(argv: list[str] | None = None) -> int:
    """
    Run one verb.

    Parameters
    ----------
    argv : list of str, optional
        Arguments; default: those of the process, which is then ended by Ctrl-C or SIGTERM
        with exit code 130 and one line, whatever it is doing.

    Returns
    -------
    int
        0 done, 1 finding, 2 bad input, 130 interrupted.

    """
    if argv is not None:
        return _run_verb(argv)
    interrupts.leave_at_once('pam')
    interrupts.closing.wait()
    _print_all_characters(sys.stdout)
    # Modules are no garbage: to look for some while they are imported takes a tenth of the time.
    gc.set_threshold(*GC_THRESHOLD)
    code = interrupts.EXIT_FAILED       # of an error of this program
    try:
        try:
            code = _run_verb(None, interrupts.Worker)
        finally:
            interrupts.ignore()
    except KeyboardInterrupt:       # while the verb said its last words
        code = interrupts.EXIT_INTERRUPTED
    finally:
        interrupts.closing.end(code)    # the result is out
        gc.freeze()     # or the interpreter looks for garbage once more as it ends
    if code == interrupts.EXIT_INTERRUPTED:
        interrupts.end_interrupted()
    return code


def _run_verb(argv: list[str] | None, begin: Callable[[], object] = lambda: None) -> int:
    """Parse, call ``begin``, run the verb; return the exit code, 0 where nobody reads on."""
    try:
        code = _parsed_and_run(argv, begin)
        sys.stdout.flush()
        return code
    except BrokenPipeError:   # e.g. "pam info BAG | head"
        # The interpreter flushes once more as it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


def _parsed_and_run(argv: list[str] | None, begin: Callable[[], object]) -> int:
    # Here and not above: an early Ctrl-C finds main() at work, see interrupts.
    from pam_actuation.cli import completion
    from pam_actuation.cli.options import (
        complain, EXIT_BAD_INPUT, EXIT_DONE, EXIT_FINDING, EXIT_INTERRUPTED)
    from pam_actuation.cli.overview import overview, VERBS
    from pam_sim.compile_notice import tell_when_compiling
    from pam_sim.errors import InputError
    from pam_sim.files import reason, shown
    # BLAS threads only get in the way of small matrices and worker processes.
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    words = sys.argv[1:] if argv is None else argv
    if not words and not completion.asked():
        print(overview())
        return EXIT_DONE
    # The other verbs take longer to import than most verbs need for their work.
    named = words[0] if words and words[0] in VERBS and not completion.asked() else None
    try:
        parser = build_parser(named)
        completion.complete(parser)
        args = parser.parse_args(argv)
    except SystemExit as ended:     # --help, or an option that is not allowed
        return ended.code if isinstance(ended.code, int) else EXIT_BAD_INPUT
    try:
        begin()         # from here on Ctrl-C and SIGTERM are told below
        tell_when_compiling(lambda: print(
            f'pam {args.verb}: compiling the equations of this rig, once; up to two minutes',
            file=sys.stderr, flush=True))
        with _few_warnings(f'pam {args.verb}'):
            code = args.call(args)
        sys.stdout.flush()      # a full disk shows here, not when the interpreter ends
        # A verb that did its work on data that cannot be right has found something.
        return EXIT_FINDING if code == EXIT_DONE and getattr(args, 'implausible', ()) else code
    except InputError as mistake:
        return complain(
            ' '.join(str(mistake).split()), EXIT_BAD_INPUT, f'pam {args.verb}', args.json)
    except KeyboardInterrupt as stop:
        with interrupts.undisturbed():      # a late repetition would take the sentence away
            return complain(
                str(stop) or 'stopped', EXIT_INTERRUPTED, f'pam {args.verb}', args.json)
    except BrokenPipeError:
        raise
    except UnicodeEncodeError as error:     # nothing was written: texts are encoded whole
        name = _OF_NO_TEXT.search(error.object)
        if name is None:
            raise
        return complain(
            f'{name[0]!r}: the name has bytes that are no UTF-8, so no file can hold it; rename '
            'the file or folder', EXIT_BAD_INPUT, f'pam {args.verb}', args.json)
    except OSError as error:  # the file system refuses where nobody looked before
        place = f'{shown(str(error.filename))}: ' if error.filename else ''
        return complain(f'{place}{reason(error)}', EXIT_BAD_INPUT, f'pam {args.verb}', args.json)


def _print_all_characters(stream: Any) -> None:
    """Let a stream escape the characters that its encoding lacks, as standard error does."""
    if isinstance(stream, io.TextIOWrapper) and (
            stream.errors == 'strict' or stream.encoding.lower() != 'utf-8'):
        stream.reconfigure(errors='backslashreplace')


@contextmanager
def _few_warnings(verb: str) -> Iterator[None]:
    """
    Keep warnings of NumPy and SciPy from people: a result that is not finite is told as such.

    A force law that is used beyond its table warns at every simulation, each time of another
    share: the first one is told in a line. ``python -W`` and ``PYTHONWARNINGS`` show all.
    """
    with warnings.catch_warnings():
        if not sys.warnoptions:
            warnings.simplefilter('ignore', RuntimeWarning)
            usual, told = warnings.showwarning, False

            def show(message: Warning | str, category: type[Warning], *where: Any,
                     **more: Any) -> None:
                nonlocal told
                if category.__name__ != 'ExtrapolationWarning':
                    usual(message, category, *where, **more)
                elif not told:
                    told = True
                    print(f'{verb}: {message}', file=sys.stderr, flush=True)

            warnings.showwarning = show
        yield


if __name__ == '__main__':
    sys.exit(main())
