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

"""``pam campaign``: one question to many recordings, and what changed over rigs and days."""

import argparse
import os
import sys
from typing import Any, TYPE_CHECKING

from pam_actuation.cli.common import (
    add_seed_option, effect_names, emit, EXIT_DONE, EXIT_FINDING, progress)
from pam_actuation.cli.options import count, number, out_path, Parser, refuse_unused, source

if TYPE_CHECKING:
    from pam_actuation.campaign.campaign import Campaign
    from pam_actuation.campaign.cases import Case
    from pam_actuation.campaign.findings import Findings

HELP = ('Work on every recording of a folder or list, keep what each gave, and say what changed '
        'on which rig since which day.')
EXAMPLE = 'pam campaign runs --model dmsp_5_300_hanging_mass --out campaign'
# Options that would change nothing in this kind of work.
UNUSED = {
    'gap': ('unknown', 'seed'), 'identify': ('effects', 'seconds', 'materiality'),
    **dict.fromkeys(('replay', 'report'), (
        'model', 'effects', 'seconds', 'materiality', 'unknown', 'seed'))}


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('recordings', type=source,
                        help='folder with bags, RIG/DAY/BAG for instance; or a list: a text file '
                        'with a path a line, or CSV with path, rig, day, namespace, model')
    parser.add_argument('--out', type=out_path, required=True, metavar='DIR',
                        help='folder for the results; what is there already is not worked on '
                        'again')
    parser.add_argument('--work', choices=tuple(UNUSED), default='gap',
                        help='what is done with every recording (default: %(default)s)')
    parser.add_argument('--model', '--rig', dest='model', type=source, default=None,
                        metavar='NAME|FILE', help='model of gap and identify, where the list '
                        'names no other; that of a joint gives each muscle its own')
    parser.add_argument('--effects', type=source, default=None, metavar='A,B',
                        help='names that gap tries (default: all)')
    parser.add_argument('--seconds', type=number(1.0, None, 's'), default=3600.0, metavar='N',
                        help='time budget of gap for a recording (default: %(default)g); '
                        'results do not depend on the machine as long as it is enough')
    parser.add_argument('--materiality', type=number(0.01, 1000.0), default=1.0, metavar='S',
                        help='as of pam gap (default: %(default)g)')
    parser.add_argument('--unknown', type=source, nargs='+', default=[], metavar='NUMBER',
                        help='further unknown numbers of identify')
    add_seed_option(parser, 'seed of identify')
    parser.add_argument('--jobs', type=count(1, 1024, {-1: 'one a core'}), default=-1,
                        metavar='N', help='processes; -1 = one a core (default)')
    parser.add_argument('--cluster', type=source, default=None, metavar='ADDRESS',
                        help='run on a Dask scheduler (tcp://HOST:PORT) or a Ray cluster '
                        '(ray://HOST:PORT), whose workers see the same folders')
    parser.add_argument('--alert', action='store_true',
                        help='exit code 1 where something changed or stands out that the last '
                        'finished run into this folder did not tell; for a nightly job')


def run(args: argparse.Namespace) -> int:
    """Work on what is missing; write table, page and findings."""
    from pam_actuation.campaign import find_cases, run_campaign, Settings
    from pam_actuation.campaign.findings import find
    from pam_actuation.campaign.page import campaign_page
    from pam_actuation.campaign.results import PAGE, seen_before, write_results
    from pam_actuation.campaign.work import NEED_A_MODEL
    from pam_actuation.workers import ClusterLost
    refuse_unused(args, add_arguments, UNUSED[args.work], f'--work {args.work}')
    effects = tuple(effect_names(args))
    cases = find_cases(args.recordings, args.out, joints=args.work not in NEED_A_MODEL)
    settings = Settings(args.work, args.model or '', effects, args.seconds, args.materiality,
                        tuple(args.unknown), args.seed)
    done, lines_done = 0, []
    try:
        with progress(args, len(cases), ' cases', 'campaign') as bar:
            def moved(count: int) -> None:
                nonlocal done
                done = max(count, done)
                bar.update(done - bar.n)

            def case_done(case: 'Case', verdict: str) -> None:
                lines_done.append(f'{done} of {len(cases)}: {case.name}: {verdict}')
                if bar.disable and not args.json:       # a log file
                    print(lines_done.pop(), file=sys.stderr, flush=True)

            campaign = run_campaign(cases, settings, args.out, args.jobs, args.cluster, moved,
                                    case_done)
    except KeyboardInterrupt:
        if not args.json:
            print(''.join(f'{line}\n' for line in lines_done), end='', file=sys.stderr)
        raise KeyboardInterrupt(
            f'stopped; {done} of {len(cases)} cases are done and kept in {args.out}: give the '
            'same command again to go on') from None
    except ClusterLost as error:
        emit(args, {'schema': 1, 'error': str(error), 'out': args.out},
             f'{error}; what is done is kept: give the same command again to go on')
        return EXIT_FINDING
    before = seen_before(args.out)
    findings = find(campaign)
    remark = write_results(campaign, findings, args.out, campaign_page(campaign, findings))
    new = findings.new(before)
    lines = _lines(campaign, findings)
    if args.alert:
        lines += [f'alert: {one}' for one in new]
    emit(args, {
        'schema': 1, 'out': args.out, 'cases': len(campaign.rows),
        'worked_on': campaign.worked_on, 'seconds': campaign.seconds,
        'failed': [_told(row) for row in campaign.failed], 'changes': findings.sentences(),
        'odd': [{**_told(odd.row), 'why': odd.why} for odd in findings.odd], 'new': new,
        'remarks': [remark] if remark else []},
        '\n'.join([*lines, *([f'remark: {remark}'] if remark else []),
                   f'page: {os.path.join(args.out, PAGE)}']))
    found = bool(new) if args.alert else bool(campaign.failed)
    return EXIT_FINDING if found else EXIT_DONE


def _told(row: dict[str, Any]) -> dict[str, Any]:
    """Return what JSON tells of a case."""
    return {'rig': row['case'].rig, 'day': row['case'].day, 'path': row['case'].path,
            'reason': row['reason']}


def _lines(campaign: 'Campaign', findings: 'Findings') -> list[str]:
    """Return the result for people."""
    from pam_sim.units import counted
    lines = [f'{counted(len(campaign.rows), "recording")} of '
             f'{counted(len(campaign.rigs), "rig")}, {campaign.worked_on} worked on now in '
             f'{campaign.seconds:.1f} s, {len(campaign.failed)} failed']
    lines += [f'  {one}' for one in findings.sentences()]
    if not findings.changes:
        lines.append('  nothing changes over time')
    lines += [f'  stands out: {odd.row["case"].name}: {odd.why}' for odd in findings.odd[:10]]
    if len(findings.odd) > 10:
        lines.append(f'  and {len(findings.odd) - 10} more, see the page')
    return lines
