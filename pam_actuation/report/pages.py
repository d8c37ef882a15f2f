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

"""The page about one experiment or several runs of it."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TYPE_CHECKING

from pam_actuation.bags.facts import recorded_muscle
from pam_actuation.bags.oddities import recording_remarks
from pam_actuation.report.errors import by_part
from pam_actuation.report.metrics import run_metrics, RunMetrics
from pam_actuation.report.page import paragraph, render, Section, signed, table
from pam_actuation.report.sections.cycles import cycles
from pam_actuation.report.sections.markers import markers_sections
from pam_actuation.report.sections.metrics_table import metrics
from pam_actuation.report.sections.over_seeds import over_seeds, seeds_section
from pam_actuation.report.sections.overlaid import overlaid
from pam_actuation.report.sections.provenance import provenance
from pam_actuation.report.sections.signals_plot import time_plots
from pam_actuation.report.sections.timing import timing
from pam_actuation.report.tracked import tracked_sections
from pam_sim.errors import InputError
from pam_sim.files import StrPath, write_text

if TYPE_CHECKING:
    from pam_actuation.report.errors import Cycles
    from pam_sim.annotations import FloatArray
    from pam_sim.run import Run

FOOTER = ('Written by pam_actuation. Pressures are gauge, against 101.325 kPa. This page needs '
          'no network.')
# What stands beside the runs in ``pam report --json``.
TAKEN = ('report', 'remarks', 'over_seeds', 'implausible')


def recorded_metrics(run: 'Run') -> RunMetrics:
    """Return the figures of a run, with its rig or its side of a joint in the metadata."""
    return run_metrics(run, rig=recorded_muscle(run.metadata, run.namespace))


def bag_report(runs: 'Sequence[Run]', out_path: StrPath, titles: Sequence[str] | None = None,
               of: str = '') -> dict[str, dict[str, Any]]:
    """
    Write the HTML page of one or several runs: what was recorded.

    Parameters
    ----------
    runs : list of pam_sim.run.Run
        The recordings; the first one is the main one.
    out_path : path
        File to write, atomically.
    titles : list of str, optional
        Short name of every run.
    of : str
        Words in the head of the page that tell which bags it shows.

    Returns
    -------
    dict
        Main numbers of every run, plain data; ``over_seeds`` where seeds alone differ.

    Raises
    ------
    InputError
        No run was given.

    """
    return write_page(PageParts(
        'a pneumatic muscle on the rig', recorded_metrics, metrics, cycles, overlaid, time_plots,
        run_numbers, FOOTER), runs, titles or default_titles(runs), out_path, of)


class PageParts(NamedTuple):
    """
    What differs between the page of a muscle and that of a joint.

    ``measured`` takes a run, ``plots`` also the name and heading of a section. ``merits``,
    ``cycles`` and ``numbers`` take pairs of a title and what ``measured`` returned, ``overlaid``
    pairs of a title and a run.
    """

    what: str
    measured: Callable[[Any], Any]
    merits: Callable[[Any], Section | None]
    cycles: Callable[[Any], Section | None]
    overlaid: Callable[[Any], Section | None]
    plots: Callable[[Any, str, str], Section | None]
    numbers: Callable[[Any], Any]
    footer: str


def write_page(parts: PageParts, runs: 'Sequence[Run]', titles: Sequence[str], out_path: StrPath,
               of: str) -> dict[str, dict[str, Any]]:
    """Write a page of runs with a title each; others, result and errors as of ``bag_report``."""
    if not runs:
        raise InputError('a report needs at least one recording')
    titled = list(zip(titles, runs))
    named = [(title, parts.measured(run)) for title, run in titled]
    measured = [(*pair, found) for pair, (_, found) in zip(titled, named)]
    spread = over_seeds(measured)
    sections = [early_section(runs), implausible_section(titled), *tracked_sections(titled),
                parts.merits(named), seeds_section(spread), parts.cycles(named),
                parts.overlaid(titled)]
    for k, (title, run) in enumerate(titled):
        heading = 'Signals over time' + (f': {title}' if len(runs) > 1 else '')
        sections.append(parts.plots(run, f'signals-{k}', heading))
    sections += [*markers_sections(titled), timing(measured), provenance(titled)]
    name = (runs[0].metadata or {}).get('experiment_name') or 'Recording'
    write_text(out_path, render(
        f'Experiment {name}', f'Tracking of {parts.what}: what was asked, what it did, and how '
        'well.', [one for one in sections if one], parts.numbers(named), parts.footer, of))
    facts = {title: one.to_dict() for title, one in named}
    return {**facts, 'over_seeds': spread} if spread else facts


def early_section(runs: 'Sequence[Run]') -> Section | None:
    """Return the section that warns of runs that stopped early or are odd, None without any."""
    found = recording_remarks(runs)
    title = 'Remarks on the recordings' if any(
        getattr(run, 'remarks', ()) for run in runs) else 'Stopped early'
    return Section('ended', title, ''.join(map(paragraph, found))) if found else None


def implausible_section(runs: 'Sequence[tuple[str, Run]]') -> Section | None:
    """Return the section on values that cannot be right, None where there are none."""
    found = [(title, sentence) for title, run in runs
             for sentence in getattr(run, 'implausible', ())]
    if not found:
        return None
    return Section('implausible', 'What cannot be right in the data', paragraph(
        'Numbers and plots below rest on these values all the same.') + table(
            ['recording', 'what was read'], found))


def default_titles(runs: 'Sequence[Run]') -> list[str]:
    """Return a short distinct name of every run, from path or experiment; none of ``TAKEN``."""
    names: list[str] = []
    for k, run in enumerate(runs):
        name = str(run.path).rstrip('/').rsplit('/', 1)[-1] or (
            run.metadata or {}).get('experiment_name') or f'run {k + 1}'
        names.append(name if name not in (*TAKEN, *names) else f'{name} ({k + 1})')
    return names


def run_numbers(named: Sequence[tuple[str, RunMetrics]]) -> list[tuple[str, str, str, str]]:
    """Return the key numbers on top of a page for (title, RunMetrics) pairs."""
    numbers = []
    for title, m in named[:4]:
        if len(m.cycle_rmse_m) > 1:
            numbers += cycle_numbers(
                'Tracking RMSE', m.cycle_rmse_m * 1e3, m.cycle_parts, title, ' mm')
        elif m.rmse_m is not None:
            numbers.append((f'{m.rmse_m * 1e3:.2f} mm', 'Tracking RMSE', title, ''))
        if len(m.cycle_rmse_n) > 1:
            numbers += cycle_numbers('Force RMSE', m.cycle_rmse_n, m.cycle_parts, title, ' N')
        elif m.rmse_n is not None:
            numbers.append((f'{m.rmse_n:.2f} N', 'Force RMSE', title, ''))
        if m.max_error_m is not None and len(named) == 1:
            numbers.append((f'{m.max_error_m * 1e3:.2f} mm', 'Largest error', title, ''))
    return numbers


def cycle_numbers(what: str, values: 'FloatArray', parts: 'Sequence[Cycles]', title: str,
                  unit: str) -> list[tuple[str, str, str, str]]:
    """Return one key number for each part of a run: first and last cycle, in ``unit``."""
    numbers = []
    for hz, of_part in by_part(values, parts):
        first, last = of_part[0], of_part[-1]
        numbers.append((
            f'{first:.2f} → {last:.2f}{unit}',
            f'{what}, first → last cycle' + (f' of {hz}' if hz else ''),
            f'{title}: {signed(100 * (last / first - 1))} %', ''))
    return numbers
