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

"""The page of the demo: several experiments, tuning and the gap together."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, TYPE_CHECKING

from pam_actuation.report.metrics import RunMetrics
from pam_actuation.report.page import (
    paragraph, render, Section, signed, table)
from pam_actuation.report.pages import FOOTER, recorded_metrics
from pam_actuation.report.sections.cycles import cycles
from pam_actuation.report.sections.gap import gap_section
from pam_actuation.report.sections.metrics_table import metrics
from pam_actuation.report.sections.provenance import provenance
from pam_actuation.report.sections.replay import controller_replays, Overlay, overlays
from pam_actuation.report.sections.rules import rules
from pam_actuation.report.sections.signals_plot import time_plots
from pam_actuation.report.sections.timing import timing
from pam_actuation.report.sections.tuning import tuning_section
from pam_sim.files import StrPath, write_text

if TYPE_CHECKING:
    from pam_actuation.control.sofc.rule_table import RuleBase
    from pam_actuation.replay.controller import ReplayResult
    from pam_actuation.tuning.tune import TuneResult
    from pam_sim.gap import GapResult
    from pam_sim.run import Run

Number = tuple[str, str, str, str]      # key number on top of a page: value, what, remark, mood

LEAD = ('A pneumatic muscle lifts a mass along a sine while a self-organizing fuzzy controller '
        'rewrites its own rules. Every part of the rig ran as its own process and talked over '
        'DDS; everything below was computed from the recorded bags.')
POINTS = 1600                # per trace: a demo page holds many traces


@dataclass
class DemoPart:
    """
    One experiment of the demo.

    Attributes
    ----------
    title, text : str
        Heading, and one paragraph that says plainly what was done and what to see.
    runs : list of (title, Run)
        The first is shown in full; further ones (rules frozen) are compared with it.
    rules_before, rules_after : RuleBase or None
        Rules of the first run.
    overlay : list of Overlay
        Simulated against recorded, first run.
    replays : list of (title, result)
        Controller replays.

    """

    title: str
    text: str
    runs: 'list[tuple[str, Run]]'
    rules_before: 'RuleBase | None' = None
    rules_after: 'RuleBase | None' = None
    overlay: list[Overlay] = field(default_factory=list)
    replays: 'list[tuple[str, ReplayResult]]' = field(default_factory=list)


def demo_report(out_path: StrPath, parts: Sequence[DemoPart],
                tuning: 'TuneResult | dict[str, Any] | None' = None,
                gap: 'GapResult | None' = None,
                checks: Sequence[Sequence[str]] | None = None,
                notes: Iterable[str] = ()) -> dict[str, dict[str, Any]]:
    """
    Write the page of the demo.

    Parameters
    ----------
    out_path : path
        File to write, atomically.
    parts : list of DemoPart
        Experiments in the order of the page.
    tuning : object or dict, optional
        See ``tuning_section``.
    gap : pam_sim.gap.GapResult, optional
        Gap between model and recording.
    checks : list of (bag, check, outcome), optional
        What independent readers said about the bags.
    notes : iterable of str
        Sentences on top of the page, for example findings.

    Returns
    -------
    dict
        Main numbers of every run by title, plain data, SI.

    """
    sections: list[Section | None] = []
    numbers: list[Number] = []
    facts: dict[str, dict[str, Any]] = {}
    everything: list[tuple[str, Run]] = []
    for index, part in enumerate(parts):
        measured = [(title, run, recorded_metrics(run)) for title, run in part.runs]
        everything += part.runs
        numbers += part_numbers([(title, m) for title, _, m in measured])
        facts.update({title: m.to_dict() for title, _, m in measured})
        sections += _part(index, part, measured)
    if checks:
        sections.append(Section('bags', 'The recordings, read by others', paragraph(
            'The bags were opened with readers that this project did not write.')
            + table(['bag', 'check', 'outcome'], checks)))
    if tuning is not None or gap is not None:
        sections.append(_after_the_run(tuning, gap))
    if tuning is not None:
        sections.append(tuning_section(tuning))
    if gap is not None:
        sections.append(gap_section(gap, max_points=POINTS))
        numbers += gap_numbers(gap)
    sections.append(Section('provenance-group', 'Provenance', '', group=True))
    sections.append(provenance(everything))
    lead = ' '.join([LEAD, *notes])
    write_text(out_path, render('pam_actuation: the rig at work', lead,
                                [s for s in sections if s], numbers, FOOTER))
    return facts


def _part(index: int, part: DemoPart, measured: 'Sequence[tuple[str, Run, RunMetrics]]'
          ) -> list[Section | None]:
    """Return the sections of one experiment."""
    tag = f'part{index + 1}'
    named = [(title, m) for title, _, m in measured]
    sections: list[Section | None] = [
        Section(tag, part.title, paragraph(part.text), group=True),
        cycles(named, f'{tag}-cycles', remark=cycle_sentence(named)),
        metrics(named, f'{tag}-metrics'),
        time_plots(part.runs[0][1], f'{tag}-signals',
                   f'Signals over time: {part.runs[0][0]}', POINTS)]
    if part.rules_after is not None:
        sections.append(rules(part.rules_before, part.rules_after, f'{tag}-rules'))
    if part.overlay:
        sections.append(overlays(
            part.overlay, f'{tag}-overlays', max_points=POINTS, remark=(
                'The model the rig simulator runs, stepped offline on the recorded valve '
                'signal alone, laid over what was recorded.')))
    if part.replays:
        sections.append(controller_replays(part.replays, f'{tag}-replay'))
    sections.append(timing(measured, f'{tag}-timing'))
    return sections


def _after_the_run(tuning: object, gap: object) -> Section:
    said = []
    if tuning is not None:
        said.append('the controller was tuned on the model of the rig')
    if gap is not None:
        said.append('the recording was held against the simplest model, to see how much that '
                    'model misses and in which part of the rig')
    return Section('offline', 'From the bag, offline', paragraph(
        'With the recordings alone, and without the rig, ' + ', and '.join(said) + '.'),
        group=True)


def cycle_sentence(named: Sequence[tuple[str, RunMetrics]]) -> str:
    """Return one sentence on first and last cycle of every (title, RunMetrics)."""
    parts = []
    for title, m in named:
        if len(m.cycle_rmse_m) > 1:
            first, last = m.cycle_rmse_m[0] * 1e3, m.cycle_rmse_m[-1] * 1e3
            parts.append(f'{title}: {first:.2f} mm in the first cycle, {last:.2f} mm in the '
                         f'last ({signed(100 * (last / first - 1))} %)')
    vented = [title for title, m in named if m.interruptions and m.interruptions[0]]
    if parts and vented:
        return '; '.join(parts) + (
            f'. The safe command interrupted {" and ".join(vented)}, because measurements came '
            'too late; its cycles are worse for it.')
    return '; '.join(parts) + '.' if parts else ''


def part_numbers(named: Sequence[tuple[str, RunMetrics]]) -> list[Number]:
    """Return the key numbers of (title, RunMetrics) pairs: RMSE of first and last cycle."""
    numbers = []
    for title, m in named:
        if len(m.cycle_rmse_m) > 1:
            first, last = m.cycle_rmse_m[0] * 1e3, m.cycle_rmse_m[-1] * 1e3
            mood = 'good' if last <= 0.5 * first else ''
            numbers.append((f'{first:.2f} → {last:.2f} mm', title,
                            f'tracking RMSE, first → last of {len(m.cycle_rmse_m)} cycles '
                            f'({signed(100 * (last / first - 1))} %)', mood))
        elif m.rmse_m is not None:
            numbers.append((f'{m.rmse_m * 1e3:.2f} mm', title, 'tracking RMSE', ''))
    return numbers


def gap_numbers(gap: 'GapResult') -> list[Number]:
    """Return the key number of a gap look: contraction, the signal people ask for first."""
    one = gap.signals.get('contraction')
    if one is None:
        return []
    return [(f'{one.rmse_before * 1e3:.2f} mm', 'Gap to the simplest model',
             f'contraction, free run; noise floor {one.noise_floor * 1e3:.3f} mm', '')]
