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

"""``pam import``: a table that another program wrote, as a bag."""

import argparse
from functools import partial
import sys
from typing import Any, TYPE_CHECKING

from pam_actuation.cli.common import (
    add_overwrite_option, emit, EXIT_DONE, EXIT_FINDING, progress, read_line)
from pam_actuation.cli.options import count, number, out_path, Parser, source

if TYPE_CHECKING:
    from pam_actuation.tables.guess import Guess
    from pam_actuation.tables.importer import Recording
    from pam_actuation.tables.questions import Question
    from pam_actuation.tables.table import Table

HELP = """Make a bag of a table measured elsewhere: CSV, Excel, LabVIEW, MAT, or a foreign bag.

Without --map the columns are found by name, unit and range; --preview shows how. What the file
cannot tell is asked for. Several files are one recording: the next part, or other signals.

docs/reference/files/mapping.md lists the signals, their units and the keys of a mapping file."""
RIG_FILE = 'my_rig.yaml'            # that pam rig new writes
_MOST_LEFT = 12                     # names of columns that are told
EXAMPLE = 'pam import run7.csv --map pressure="p_bar:bar_gauge" --out runs/run7'


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('files', type=source, nargs='+', metavar='FILE',
                        help='table, or the folder of a bag; several files are one recording')
    parser.add_argument('--out', type=out_path, default=None, metavar='DIR',
                        help='bag directory (default: runs/NAME of the first file)')
    parser.add_argument(
        '--map', action='append', default=[], metavar='SIGNAL=COLUMN:UNIT', dest='maps',
        help='what a column is, such as pressure="p_bar:bar_gauge", time="t:ms" or '
             'contraction="length:mm:zero=250:gain=-1"; a column is named, or numbered as #3; '
             'may be repeated')
    parser.add_argument('--mapping', type=source, default=None, metavar='FILE',
                        help='mapping file, as --save-mapping writes it; --map goes before it')
    parser.add_argument('--without', action='append', default=[], metavar='SIGNAL',
                        help='a signal of the mapping file that was not recorded this time; may '
                             'be repeated')
    parser.add_argument('--save-mapping', type=out_path, default=None, metavar='FILE',
                        help='write down how the columns were read, for the next file')
    parser.add_argument('--rate', type=number(0.1, 1e6, 'Hz'), default=None, metavar='HZ',
                        help='rows a second, where no column is the time')
    parser.add_argument('--preview', action='store_true',
                        help='show columns and what they are read as; write nothing')
    parser.add_argument('--every', type=count(1, 10**6), default=1, metavar='N',
                        help='keep one row of N')
    parser.add_argument('--resample', type=number(1.0, 1e4, 'Hz'), default=None, metavar='HZ',
                        help='take slow readings as straight between them, at this rate, with '
                             'noise of their resolution; for pam gap of a slow loop')
    parser.add_argument('--from', type=number(0.0, None, 's'), default=0.0, metavar='S',
                        dest='begin_s', help='leave out what was before, in s after the start')
    parser.add_argument('--to', type=number(0.0, None, 's'), default=float('inf'), metavar='S',
                        dest='end_s', help='leave out what comes later, in s after the start')
    parser.add_argument('--sort', action='store_true',
                        help='put rows in order whose time runs back')
    parser.add_argument('--part', type=count(1, 10**6), default=0, metavar='N',
                        help='take the Nth recording of a file in which the time begins anew, '
                             'or the Nth of several sheets with the same columns')
    parser.add_argument('--missing', action='append', default=[], metavar='TEXT',
                        help='text that stands for a missing value; may be repeated')
    parser.add_argument('--leave-out', action='append', default=[], metavar='COLUMN',
                        help='a column that is no signal, so that nothing is asked of it; may be '
                             'repeated')
    parser.add_argument('--accept', action='store_true',
                        help='take values that cannot be in the unit stated')
    parser.add_argument('--rig', type=source, default=None, metavar='NAME|FILE',
                        help='model of the rig that was measured, kept in the bag')
    parser.add_argument('--namespace', type=source, default=None, metavar='NS',
                        help='namespace in the bag (default: /muscle, of a joint /knee)')
    add_overwrite_option(parser, 'the bag that is there, once the new one is whole')


def run(args: argparse.Namespace) -> int:
    """Read, ask, check, write; say what to do next."""
    import os
    from pathlib import Path
    from pam_actuation.bags.plausibility import size_of_rig
    from pam_actuation.bags.place import check_bag_target
    from pam_actuation.cli.common import check_outputs
    from pam_actuation.tables.importer import digest_of, recording_of, write_bag
    from pam_actuation.tables.lengths import size_of_mapping
    from pam_actuation.tables.preview import may_be_signals, unread
    from pam_actuation.tables.repeats import without_repeats
    from pam_actuation.tables.resample import hint, resampled
    from pam_sim.errors import InputError
    from pam_sim.files import write_text
    from pam_sim.joint import load_rig_or_joint
    if args.preview and args.save_mapping:
        raise InputError('--preview writes nothing, so it keeps no mapping; leave one of them out',
                         f'--save-mapping {args.save_mapping}')
    model = load_rig_or_joint(args.rig) if args.rig else None
    rig: Any = getattr(model, 'flexor', model)      # of a joint: the lengths are checked by one
    out = args.out or os.path.join('runs', Path(args.files[0]).name.partition('.')[0])
    if not args.preview:
        check_bag_target(out, args.overwrite)
        check_outputs(args, args.save_mapping)
    tables, found = _understood(args)
    if args.preview:
        return _show(args, tables, found)
    recording = recording_of(
        tables, found.mapping, sort=args.sort, part=args.part, missing=args.missing,
        accept=args.accept, begin_s=args.begin_s, end_s=args.end_s,
        size=size_of_rig(rig) if rig is not None else size_of_mapping(found.mapping))
    recording = without_repeats(recording)
    if args.resample is not None:
        recording = resampled(recording, args.resample)
    elif said := hint(recording):
        recording.told.append(said)
    recording.sources = [(Path(file).name, digest_of(file)) for file in args.files]
    with progress(args, 1.0, '', 'writing') as bar:
        counts = write_bag(recording, out, rig=model, namespace=args.namespace or '',
                           overwrite=args.overwrite, progress=lambda s: bar.update(s - bar.n))
        bar.update(1.0 - bar.n)
    if args.save_mapping:
        write_text(args.save_mapping, found.mapping.to_yaml())
    _tell(args, recording, found, counts, out, unread(tables, found),
          may_be_signals(tables, found), _following(recording, out, args.rig, model))
    return EXIT_FINDING if recording.found else EXIT_DONE


def _understood(args: argparse.Namespace) -> 'tuple[list[Table], Guess]':
    """Return the tables and how they are read; InputError where that stays open."""
    from pam_actuation.tables.formats import read_tables
    from pam_actuation.tables.guess import as_stated, ask, guess
    from pam_actuation.tables.mapping import load_mapping, TableMapping
    from pam_actuation.tables.preview import how_to_begin, question_sentence
    from pam_actuation.tables.sheets import of_part
    from pam_sim.errors import InputError
    mapping = (load_mapping(args.mapping) if args.mapping else TableMapping()).with_options(
        args.maps, args.rate).without(args.without)
    # A mapping file says everything; otherwise all columns are looked at.
    wanted = [one.column for one in mapping.signals.values()] if args.mapping else None
    if not args.preview and (as_it_is := _as_it_is(args)):
        raise InputError(f'{as_it_is}. To import it all the same, say with --map which columns '
                         'are signals', args.files[0])
    tables = []
    with progress(args, float(len(args.files)), '', 'reading') as bar:
        for done, file in enumerate(args.files):
            tables += read_tables(file, args.every, wanted, partial(_move, bar, done))
    if len(args.files) == 1:
        tables, args.part = of_part(tables, args.part)
    # A file that is kept says everything.
    found = as_stated(mapping) if args.mapping else guess(
        tables, mapping, args.missing, args.leave_out)
    if found.questions and not args.preview:
        if sys.stdin.isatty() and sys.stdout.isatty() and not args.json:
            found = ask(found, _asked)
        else:
            raise InputError(question_sentence(found), args.files[0])
    if not (found.mapping.signals or found.questions or args.preview):
        raise InputError(
            'no column is known by its name; --preview shows columns and ranges. Then say which '
            f'are signals, such as {how_to_begin(tables, found)}', args.files[0])
    return tables, found


def _as_it_is(args: argparse.Namespace) -> str:
    """Return a sentence where nothing is said of the columns and no import is needed, else ''."""
    from pam_actuation.tables.own_bag import needs_no_import
    if len(args.files) > 1 or args.maps or args.mapping or args.leave_out:
        return ''
    return needs_no_import(args.files[0])


def _move(bar: Any, done: int, share: float) -> None:
    bar.update(done + share - bar.n)


def _asked(question: 'Question') -> str | None:
    """Ask a person; return the answer, None to leave the column out."""
    print(f'{question.text}\n  {question.choice()}; Enter leaves the column out')
    while said := read_line('> ').strip():
        refusal = question.refusal(said)
        if not refusal:
            return said
        print(f'  {refusal}')
    return None


def _show(args: argparse.Namespace, tables: 'list[Table]', found: 'Guess') -> int:
    from pam_actuation.tables.preview import (
        described, how_to_begin, may_be_signals, preview, questions_text, time_problems)
    as_it_is = _as_it_is(args)
    lines = [f'{args.files[0]}: {as_it_is}', ''] if as_it_is else []
    lines.append(preview(tables, found, args.missing))
    problems = time_problems(tables, found, args.sort, args.part)
    if problems:
        lines += ['', 'the time is not read yet:', *(f'    {one}' for one in problems)]
    if found.questions:
        lines += ['', 'the file does not tell:', questions_text(found)]
    if found.mapping.signals:
        lines += ['', 'mapping:', found.mapping.to_yaml().rstrip()]
    elif not found.questions:
        lines += ['', 'no column is known by its name: say which are signals, such as',
                  f'    {how_to_begin(tables, found)}']
    if (found.mapping.signals or found.questions) and (more := may_be_signals(tables, found)):
        lines += ['', 'not read, but by name and unit these may be signals:',
                  *(f'    {one}' for one in more)]
    payload = {
        'files': args.files, 'mapping': found.mapping.to_yaml(), 'time': problems,
        'questions': [{'signal': one.signal, 'column': one.column, 'text': one.text,
                       'answers': list(one.answers)} for one in found.questions],
        'columns': [list(table.columns) for table in tables], 'as_it_is': as_it_is,
        'tables': [{'source': table.source, 'topic': table.topic, 'rows': len(table),
                    'columns': described(table, found, args.missing)}
                   for table in tables] if args.json else []}
    emit(args, payload, '\n'.join(lines))
    return EXIT_DONE


def _following(recording: 'Recording', out: str, rig: str | None, model: Any) -> str:
    """Return the command that comes next: what a model of the rig makes of the recording."""
    import os
    import shlex
    known = recording.signals.keys()
    there = bool(rig) or os.path.isfile(RIG_FILE)
    out, file = shlex.quote(out), shlex.quote(rig or RIG_FILE)
    if recording.is_of_joint:
        return f'pam gap {out} --model {file} --out gap' if rig else f'pam report {out}'
    if 'pressure' not in known or not {'contraction', 'force'} & known:
        return f'pam report {out}'
    ways = [f'pam identify {out} --rig {file}', f'pam gap {out} --model {file} --out gap']
    if model is not None and not getattr(model, 'unknown', ()):     # nothing to be identified
        del ways[0]
    first = '' if there else f'pam rig new, which writes {file}; then '
    return first + ', or '.join(ways)


def _tell(args: argparse.Namespace, recording: 'Recording', found: 'Guess',
          counts: dict[str, int], out: str, left: list[str], likely: list[str],
          following: str) -> None:
    import numpy as np
    remarks = [one.sentence for one in recording.found]
    lines = [f'imported {recording.duration_s:.4g} s from {", ".join(args.files)}']
    lines += [f'  {text}' for text in recording.told]
    for name, one in recording.mapping.signals.items():
        _, values = recording.signals.get(name, ((), ()))
        lines.append(f'  {name}: column "{one.column}" in {one.reading} '
                     f'({found.told.get(name, "as stated")}), {np.isfinite(values).sum()} values')
    if left:
        lines.append('  not imported: ' + ', '.join(f'"{column}"' for column in left[:_MOST_LEFT])
                     + (f' and {len(left) - _MOST_LEFT} more' if len(left) > _MOST_LEFT else ''))
    if likely:
        lines.append(f'  not imported, but it may be a signal: {" or ".join(likely)}')
    if {'pressure', 'contraction'} <= set(found.mapping.signals) and not (
            recording.valve or 'pressure_command' in found.mapping.signals):
        lines.append('  no command of the valve: pam gap and pam identify compare muscle and '
                     'load, driven by the pressure')
    lines += [f'remark: {text}' for text in remarks]
    lines += [f'bag: {out}', f'next: {following}']
    payload: dict[str, Any] = {
        'bag': out, 'next': following, 'duration_s': recording.duration_s, 'messages': counts,
        'valve': recording.valve, 'remarks': remarks, 'not_imported': left,
        'mapping': found.mapping.to_yaml()}
    emit(args, payload, '\n'.join(lines))
