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

"""The options of ``pam experiments`` that make an experiment of a column of a table."""

import argparse
from collections.abc import Collection
import math
from typing import TYPE_CHECKING

from pam_actuation.cli.common import add_overwrite_option, check_outputs
from pam_actuation.cli.options import count, number, out_path, Parser, source

if TYPE_CHECKING:
    from pam_actuation.experiments.from_table import Made
    from pam_actuation.tables.mapping import TableMapping
    from pam_actuation.tables.table import Table

EXAMPLE = '--map contraction=knee_deg --range 4:20 --period 1.2 --cycles 10'


def add_samples_options(parser: Parser) -> None:
    """Declare the options."""
    made = parser.add_argument_group('an experiment that follows a column of a table')
    made.add_argument('--samples', type=source, default=None, metavar='FILE',
                      help='table or bag, of any kind that pam import reads')
    made.add_argument('--map', action='append', default=[], metavar='SIGNAL=COLUMN:UNIT',
                      dest='maps',
                      help='what the column is: contraction, force, angle, pressure or '
                           'ppr_voltage; with --range no unit is needed. Also time="COLUMN:ms"')
    made.add_argument('--range', type=span, default=None, metavar='LOW:HIGH', dest='span',
                      help='what the smallest and the largest value become, in mm, N, deg, '
                           'kPa gauge or V; HIGH:LOW turns the motion round')
    made.add_argument('--period', type=number(0.02, 3600.0, 's'), default=None, metavar='S',
                      help='duration of the motion, which is stretched to it; rows without a '
                           'time are then at equal distances')
    made.add_argument('--cycles', type=count(1, 1000), default=1, metavar='N',
                      help='how often it is repeated; it must end where it begins')
    made.add_argument('--lowpass', type=number(0.1, 20.0, 'Hz'), default=None, metavar='HZ',
                      help='smooth it, without a delay; 6 is usual for human motion')
    made.add_argument('--rate', type=number(0.1, 1e6, 'Hz'), default=None, metavar='HZ',
                      help='rows a second, where no column is the time')
    made.add_argument('--from', type=number(0.0, None, 's'), default=0.0, metavar='S',
                      dest='begin_s', help='leave out what was before, in s after the start')
    made.add_argument('--to', type=number(0.0, None, 's'), default=float('inf'), metavar='S',
                      dest='end_s', help='leave out what comes later, in s after the start')
    made.add_argument('--missing', action='append', default=[], metavar='TEXT',
                      help='text that stands for a missing value; may be repeated')
    made.add_argument('--out', type=out_path, default=None, metavar='FILE',
                      help='file of the experiment (default: NAME.yaml of the table)')
    add_overwrite_option(made, 'the file that is there')
    parser.set_defaults(of_samples={
        action.option_strings[0]: (action.dest, action.default)
        for action in made._group_actions if action.dest != 'samples'})


def refuse_without_samples(args: argparse.Namespace) -> None:
    """Raise InputError where options say how to follow a table, and no table is given."""
    from pam_sim.errors import InputError
    given = [option for option, (name, usual) in args.of_samples.items()
             if getattr(args, name) != usual]
    if given:
        raise InputError('add --samples FILE, the table that is followed', given[0])


def span(text: str) -> tuple[float, float]:
    """Return the two numbers of LOW:HIGH; ArgumentTypeError where it is not that."""
    low, colon, high = text.partition(':')
    try:
        found = float(low), float(high)
    except ValueError:
        found = 0.0, 0.0
    if not colon or not all(map(math.isfinite, found)) or found[0] == found[1]:
        raise argparse.ArgumentTypeError(
            f'{text!r} is not LOW:HIGH, two different numbers such as 4:20')
    return found


def make(args: argparse.Namespace) -> 'tuple[str, Made]':
    """
    Write the experiment that follows a column; return its file and what became of it.

    Raises
    ------
    InputError
        As ``experiment_from``; a file that cannot be read or must not be replaced.

    """
    from pathlib import Path
    from pam_actuation.experiments.from_table import experiment_from, Motion
    from pam_actuation.tables.formats import read_tables
    from pam_sim.errors import InputError
    from pam_sim.files import check_name, write_text
    if args.name is not None:
        raise InputError(f'makes an experiment of a table, and {args.name} names one that is '
                         'there; leave one of them out', '--samples')
    out = args.out or Path(args.samples).name.partition('.')[0] + '.yaml'
    if Path(out).suffix not in ('.yaml', '.yml'):
        raise InputError(f'{out} must end with .yaml, as the file of an experiment does', '--out')
    name = check_name(Path(out).stem, 'the name of the experiment', '--out')
    check_outputs(args, out)
    tables = read_tables(args.samples)
    made = experiment_from(tables, _mapping(args, tables), name, Motion(
        args.begin_s, args.end_s, args.period, args.cycles, args.lowpass, args.span),
        args.missing)
    write_text(out, made.text)
    return out, made


def _mapping(args: argparse.Namespace, tables: 'Collection[Table]') -> 'TableMapping':
    """Return which column is followed, and which is the time."""
    from dataclasses import replace
    from pam_actuation.tables.mapping import ColumnMap, TableMapping
    from pam_actuation.tables.signals import signal_of
    from pam_actuation.tables.units import si_unit
    from pam_sim.errors import InputError
    own = [text for text in args.maps if not text.startswith('time=')]
    if not own:
        columns = ', '.join(f'"{name}"' for table in tables for name in table.columns)
        raise InputError(f'say what is followed, such as --map contraction="COLUMN:mm", or '
                         f'{EXAMPLE}; columns are {columns}', args.samples)
    mapping = TableMapping()
    if args.span is None:
        if ':' not in own[0]:
            raise InputError('the unit is missing: write SIGNAL="COLUMN:UNIT", or add '
                             '--range LOW:HIGH', f'--map {own[0]}')
        return mapping.with_options(args.maps, args.rate)
    mapping = mapping.with_options([text for text in args.maps if text not in own], args.rate)
    signals = {}
    for text in own:        # the range says what the values become, so a unit says nothing
        name, _, column = text.partition('=')
        if all(table.name_of(column) is None for table in tables):
            column = column.partition(':')[0]
        signals[name] = ColumnMap(column, si_unit(signal_of(name, f'--map {text}').quantity),
                                  where=f'--map {text}')
    return replace(mapping, signals=signals)
