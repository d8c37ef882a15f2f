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

"""Write the folder of ``pam identify``: rig, numbers, page and the next experiment."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from pam_actuation.report import figures
from pam_actuation.report.page import paragraph, plot, render, Section, table
from pam_actuation.report.pages import FOOTER
from pam_actuation.report.sections.provenance import provenance
from pam_sim.files import StrPath, whole_files, write_json, write_text
from pam_sim.gap.fit.profile import RISE_95
from pam_sim.identify.result import READABLE
from pam_sim.located_yaml import dump_yaml

if TYPE_CHECKING:
    from pam_sim.identify import Identification
    from pam_sim.identify.result import Found
    from pam_sim.run import Run

FILES = ('identify.json', 'rig.yaml', 'next_experiment.yaml', 'report.html')
HIGHEST = 4.0                # of the rise on the page, in thresholds


def save_identification(result: 'Identification', runs: 'Sequence[Run]', out_dir: StrPath
                        ) -> None:
    """
    Write the folder of a result.

    Parameters
    ----------
    result : pam_sim.identify.Identification
        What was found.
    runs : list of pam_sim.run.Run
        The recordings, for the provenance on the page.
    out_dir : path
        Made if it is not there.

    Raises
    ------
    InputError
        The folder cannot be written.

    """
    with whole_files(out_dir, FILES) as folder:
        write_json(folder / 'identify.json', result.to_dict())
        write_text(folder / 'rig.yaml', result.rig.to_yaml())
        if result.next_experiment is not None:
            write_text(folder / 'next_experiment.yaml',
                       dump_yaml(result.next_experiment['experiment']))
        write_text(folder / 'report.html', page(result, runs))


def page(result: 'Identification', runs: 'Sequence[Run]') -> str:
    """Return the page of a result as HTML."""
    known = len(result.wanted) - len(result.open_names)
    lead = f'{known} of {len(result.wanted)} unknown numbers are determined by these recordings.'
    body = table(('number', 'status', 'value', '95 % interval'),
                 [(one.number.name, one.verdict, *one.shown()) for one in result.found])
    body += ''.join(paragraph(f'Known together: {c.text()}.') for c in result.combinations)
    body += ''.join(paragraph(f'{remark.rstrip(".")}.', 'note') for remark in result.remarks)
    if result.next_experiment is not None:
        body += paragraph(f'What to measure next: {result.next_experiment["why"]}.')
    profiles = paragraph(
        'Each curve shows by how much the weighted squared error rises where the number is held '
        'and all others are fitted. The dashed line is the rise at the ends of the 95 % interval. '
        'Doubt about the formulation of an effect widens the interval beyond that.')
    profiles += ''.join(_profile(one) for one in result.found)
    left = table(('signal', 'error before, rms', 'error after, rms'), [
        (name, *(f'{READABLE.get(s["unit"], (1.0, ""))[0] * s[key]:.3g} '
                 f'{READABLE.get(s["unit"], (1.0, s["unit"]))[1]}'
                 for key in ('rmse_before', 'rmse_after')))
        for name, s in result.signals.items()])
    return render(f'Unknown numbers of {result.rig.name}', lead, [
        Section('numbers', 'Numbers', body), Section('profiles', 'Profile likelihoods', profiles),
        Section('errors', 'What is left', left),
        provenance([(f'recording {k}: {_kinds(result, run)}', run)
                    for k, run in enumerate(runs, 1)])],
        footer=FOOTER)


def _kinds(result: 'Identification', run: 'Run') -> str:
    """Return what the stretches of a recording tell of."""
    return ', '.join(dict.fromkeys(record['kind'] for record in result.records
                                   if record['path'] == (run.path or 'recording')))


def _profile(one: 'Found') -> str:
    """Return the plot of the profile of a number; nothing where few values were tried."""
    factor, unit = READABLE.get(one.number.unit, (1.0, one.number.unit))
    points = [(factor * v, r) for v, r in one.interval.points if r <= HIGHEST * RISE_95]
    if len(points) < 3:
        return ''
    x, rise = zip(*points)
    figure = figures.stack([('rise', [
        figures.line(x, rise, 'profile', 'measured'),
        figures.line((x[0], x[-1]), (RISE_95, RISE_95), '95 %', 'reference', dash='dash')])],
        f'{one.number.name} [{unit}]')
    return plot(figure, one.text())
