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

"""``pam export``: a bag as a table for other programs."""

import argparse
from typing import TYPE_CHECKING

from pam_actuation.cli.common import (
    add_overwrite_option, add_recover_option, add_topic_option, check_outputs, emit, EXIT_DONE,
    note_implausible)
from pam_actuation.cli.options import number, out_path, Parser, source

if TYPE_CHECKING:
    from pam_sim.run import Run

HELP = ('Write a bag as a table: CSV, Excel, MAT, Parquet, HDF5 or NumPy. All in SI, pressures '
        'absolute.')
EXAMPLE = 'pam export runs/first --out first.csv --rate 500'
SHORT_S = 0.1          # topics begin and end that far apart in every recording


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('bag', type=source, help='bag directory, or a lone .mcap file')
    parser.add_argument('--out', type=out_path, required=True, metavar='FILE',
                        help='the table; its ending says the kind: .csv .tsv .xlsx .mat '
                             '.parquet .h5 .npz')
    parser.add_argument(
        '--rate', type=number(0.1, 1e5, 'Hz'), default=None, metavar='HZ',
        help='rows at equal distances; default: one row for each stamp of any topic')
    parser.add_argument('--topics', type=source, default=None, metavar='A,B',
                        help='short names of topics, of a joint such as joint_state or '
                             'flexor/pressure (default: all that have numbers)')
    parser.add_argument('--namespace', type=source, default=None, metavar='NS',
                        help='which muscle or joint, if the bag has several')
    add_topic_option(parser)
    add_recover_option(parser)
    add_overwrite_option(parser)


def run(args: argparse.Namespace) -> int:
    """Write the table and say what is in it."""
    from pam_actuation.bags.load_joint import load_recording
    from pam_actuation.bags.oddities import recording_remarks
    from pam_actuation.tables.export import check_ending, write_table
    check_ending(args.out)
    check_outputs(args, args.out)
    loaded = load_recording(args.bag, args.namespace, args.recover, args.renamed)
    note_implausible(args, [loaded])
    topics = [name.strip() for name in args.topics.split(',')] if args.topics else None
    frame = loaded.to_dataframe(args.rate, topics)
    write_table(frame, args.out)
    columns = [str(name) for name in frame.columns]
    remarks = recording_remarks([loaded])
    remarks += _left_out(loaded, topics) if args.rate else []
    emit(args, {'table': args.out, 'rows': len(frame), 'columns': columns, 'remarks': remarks},
         '\n'.join([f'wrote {len(frame)} rows and {len(columns)} columns',
                    *(f'remark: {text}' for text in remarks), f'table: {args.out}',
                    f'columns: {", ".join(columns)}']))
    return EXIT_DONE


def _left_out(run: 'Run', topics: list[str] | None) -> list[str]:
    """Return a sentence on each end where rows are left out for one topic."""
    first, last = run.ends_of_table(topics)
    times_s = [run[name].time_s for name in topics or run.topics if name in run]
    begin_s, end_s = run[first].time_s.min(), run[last].time_s.max()
    latest_s = max(time_s.max() for time_s in times_s)
    remarks = []
    if begin_s - min(time_s.min() for time_s in times_s) > SHORT_S:
        remarks.append(f'{first} begins at {begin_s:.3f} s: the rows before are left out')
    if latest_s - end_s > SHORT_S:
        remarks.append(
            f'{last} ends at {end_s:.3f} s of {latest_s:.3f} s: the rows after are left out')
    return remarks
