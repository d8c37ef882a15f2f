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

"""The page of a tuning: what was searched, what came out, how the recordings judge it."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from pam_actuation.report import figures
from pam_actuation.report.page import paragraph, plot, render, Section, table
from pam_actuation.report.pages import FOOTER
from pam_actuation.report.sections.provenance import provenance
from pam_actuation.report.sections.rules import rules
from pam_actuation.report.sections.tuning import tuning_section
from pam_actuation.tuning.problem import rebuild
from pam_actuation.tuning.tune import SHOWN_UNIT
from pam_sim.files import StrPath, write_text
from pam_sim.joint.parameters import SIDES
from pam_sim.rig_text import rig_title

if TYPE_CHECKING:
    from pam_actuation.experiments.experiment import Experiment
    from pam_actuation.tuning.recording import RecordingCheck
    from pam_actuation.tuning.tune import TuneResult
    from pam_sim.joint.rig import JointRig
    from pam_sim.rig import Rig
    from pam_sim.run import Run

LEAD = ('Settings and initial rules of the controller were searched on a model, in closed-loop '
        'rollouts of the compiled live code. The cost of a run is the root mean square error of '
        'its last 30 %, plus a quarter of that of the whole and a tenth of the worst late error, '
        'in {unit}. It counts from the first periodic part on, without one from the start.')


def tuning_report(out_path: StrPath, result: 'TuneResult',
                  recordings: 'Sequence[RecordingCheck]', rig: 'Rig | JointRig',
                  experiments: 'Sequence[Experiment]', runs: 'Sequence[Run]') -> None:
    """
    Write the page of a tuning.

    Parameters
    ----------
    out_path : path
        File to write, atomically.
    result : TuneResult
        What ``tune`` returned.
    recordings : list of RecordingCheck
        What the bags say, may be empty.
    rig : Rig or JointRig
        The model tuned on.
    experiments : list of Experiment
        Those of the search.
    runs : list of pam_sim.run.Run
        The bags, may be empty.

    """
    start, problem = result.start, result.problem
    assert start is not None and problem is not None      # a result of ``tune`` has both
    sections = [tuning_section(result), _tracking(result)]
    if recordings:
        sections.append(_recordings(recordings))
    after = result.controller.rules
    if after is not None:
        untaught = rebuild(start, result.controller.settings).rules
        sections.append(rules(untaught, after, title='The initial rules'))
    sections.append(Section('setup', 'Set-up', table([], [
        ['model', rig_title(rig)], ['valve', rig.valve.upper()],
        ['controller', result.controller.kind],
        ['experiments', ', '.join(one.name for one in experiments)],
        ['closed loops of the search', len(problem.loops)]], 'facts')))
    if runs:
        sections.append(provenance([(str(run.path), run) for run in runs]))
    shown = SHOWN_UNIT[result.unit]
    numbers = [
        (f'{result.held_out_before:.3f}{shown}', 'held-out cost before', '', ''),
        (f'{result.held_out_after:.3f}{shown}', 'held-out cost after', '', 'good')
        if result.improved else
        (f'{result.held_out_found:.3f}{shown}', 'held-out cost of what was dropped', '', 'bad'),
        (f'{result.rollouts:,}', 'rollouts', result.ended, '')]
    lead = LEAD.format(unit='mm' if result.unit == 'mm' else 'degrees')
    write_text(out_path, render('pam_actuation: offline tuning', lead, sections, numbers, FOOTER))


def _tracking(result: 'TuneResult') -> Section:
    """Return the section with the error on one held-out run, before and after."""
    check, start = result.check, result.start
    assert check is not None and start is not None        # a result of ``tune`` has both
    loop = check.loops[0]
    lines, unit = [], SHOWN_UNIT[result.unit].strip()
    for name, controller, role in (('before', start, 'before'),
                                   ('after', result.controller, 'after')):
        time_s, reference, error = loop.tracked(rebuild(controller, {}))
        lines.append(figures.line(time_s, error, name, role))
    wanted = figures.line(time_s, reference, 'wanted', 'second')
    searched = {one.experiment.name for one in result.problem.loops} if result.problem else set()
    heading = 'A run that was not searched' if loop.experiment.name not in searched else (
        'The searched motion with other noise')
    return Section('tracking', heading, paragraph(
        f'Experiment {loop.experiment.name} on the model, with sensor noise of its own.') + plot(
            figures.stack([(f'reference [{unit}]', [wanted]), (f'error [{unit}]', lines)],
                          'time [s]')))


def _recordings(recordings: 'Sequence[RecordingCheck]') -> Section:
    body = ''
    for one in recordings:
        body += ''.join(paragraph(text) for text in one.lines())
        check = one.counterfactual
        if check is not None:
            recorded, tuned = (np.atleast_2d(pa) * 1e-3 for pa in (
                check.recorded_pa, check.tuned_pa))
            names = [''] if len(recorded) == 1 else [f'{side} ' for side in SIDES]
            body += plot(figures.stack([(f'{name}command [kPa]', [
                figures.line(check.time_s, before, 'recorded', 'before'),
                figures.line(check.time_s, after, 'tuned', 'after')])
                for name, before, after in zip(names, recorded, tuned)],
                'time [s]', row_px=240), f'Absolute pressure commands, {one.bag}')
    return Section('recordings', 'What the recordings say', body)
