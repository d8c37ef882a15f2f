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

"""
What is done with one recording: its gap to a model, its numbers, its replay, or a report.

Each kind of work writes its files into a folder and returns what a table shows of it. Equal
recordings, models and settings give equal bytes: how long it took is kept elsewhere.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import json
from pathlib import Path
from typing import Any, TYPE_CHECKING

from pam_actuation.campaign.cases import Case
from pam_sim.errors import InputError
from pam_sim.files import write_text

if TYPE_CHECKING:
    from pam_actuation.bags.load import RecordedRun

SECONDS = 3600.0        # of search, so that a slow machine finds what a fast one finds
ROUNDING = 1e-9         # of the range of a signal; smaller differences count as none
PLOTLY = 'plotly.js'    # beside the page of the campaign, for all its reports


@dataclass(frozen=True)
class Settings:
    """
    What is asked of every recording.

    Parameters
    ----------
    work : str
        One of ``WORKS``.
    model : str
        Name of a preset, file or text of the model; '' where the work needs none.
    effects : tuple of str
        Names that ``gap`` tries; all by default.
    seconds : float
        Time budget of ``gap`` for a recording.
    materiality : float
        As of ``pam gap``.
    unknown : tuple of str
        Further unknown numbers of ``identify``.
    seed : int
        Of ``identify``.

    """

    work: str
    model: str = ''
    effects: tuple[str, ...] = ()
    seconds: float = SECONDS
    materiality: float = 1.0
    unknown: tuple[str, ...] = ()
    seed: int = 0


Found = dict[str, Any]


def size(name: str, kind: str, quantity: str, entry: dict[str, Any],
         nothing: float | None = 0.0) -> Found:
    """
    Return one size for the table.

    Parameters
    ----------
    name, kind, quantity : str
        Of an effect, a parameter or a signal: name, what it is, what was measured of it.
    entry : dict
        ``value``, ``unit`` and ``ci95``, as gap.json has them.
    nothing : float
        The value where nothing is found: zero of an effect, the given one of a parameter.

    """
    low, high = entry.get('ci95') or (None, None)
    return {'name': name, 'kind': kind, 'quantity': quantity, 'value': entry['value'],
            'low': low, 'high': high, 'unit': entry['unit'], 'nothing': nothing}


def gap(run: 'RecordedRun', model: str, settings: Settings, folder: Path) -> Found:
    """Find the gap between a recording and a model; files as of ``pam gap``."""
    from pam_actuation.report.gap import gap_of, save_gap
    result = gap_of([run], model, effects=settings.effects or None,
                    seconds=settings.seconds, materiality=settings.materiality)
    result.runtime_s = 0.0
    save_gap(result, [run], folder)
    share_plotly(folder / 'report.html')
    found = result.to_dict()
    sizes = [size(effect['name'], 'effect', quantity, entry) for effect in found['effects']
             for quantity, entry in (effect.get('equivalent') or effect['parameters']).items()]
    sizes += [size(one['name'], 'parameter', 'value', one, one['nominal'])
              for one in found['parameters']]
    return {'verdict': result.verdict, 'reason': result.reason, 'sizes': sizes,
            'ambiguous': found['ambiguity_set'] if result.verdict == 'ambiguous' else [],
            'least': found['minimum_detectable'], 'bad': result.verdict == 'refused',
            'calibrated': [size(one.name, 'parameter', 'value', one.to_dict(), one.nominal)
                           for one in result.calibration]}


def identify(run: 'RecordedRun', model: str, settings: Settings, folder: Path) -> Found:
    """Determine the unknown numbers of a rig from one recording; files as of the verb."""
    from pam_actuation.report.gap import model_for
    from pam_actuation.report.identify import save_identification
    from pam_sim.identify import identify as identified
    found = identified([run], model_for(run, model), list(settings.unknown), [], settings.seed)
    data = found.to_dict()
    save_identification(found, [run], folder)
    share_plotly(folder / 'report.html')
    open_names = found.open_names
    return {'verdict': 'incomplete' if found.incomplete else (
        'not determined' if open_names else 'determined'),
        'reason': f'not determined: {", ".join(open_names)}' if open_names else '',
        'sizes': [size(one['name'], 'number', 'value', one, None) for one in data['numbers']
                  if one['name'] not in open_names],
        'ambiguous': [], 'least': {}, 'bad': False}


def replay(run: 'RecordedRun', model: str, settings: Settings, folder: Path) -> Found:
    """Replay controller, driver and plant, each alone."""
    from pam_actuation.replay.compare import replay_run
    from pam_actuation.replay.joint import replay_joint
    from pam_actuation.replay.model import is_joint
    found = (replay_joint if is_joint(run) else replay_run)(run)
    data: dict[str, Any] = found.to_dict()
    write_text(folder / 'replay.json', json.dumps(data, indent=2, default=str) + '\n')
    write_text(folder / 'report.txt', found.text() + '\n')
    sizes = [size(f'{part}.{one["signal"]}', 'difference', 'rms', {
        'value': one['rms'] if one['rms'] > ROUNDING * one['span'] else 0.0,
        'unit': one['unit']})
        for part in ('controller', 'driver', 'plant') for one in data.get(part, {}).get(
            'signals', ())]
    differs = bool(found.unexpected_difference)
    return {'verdict': 'differs' if differs else 'replayed', 'reason': '', 'sizes': sizes,
            'ambiguous': [], 'least': {}, 'bad': differs}


def report(run: 'RecordedRun', model: str, settings: Settings, folder: Path) -> Found:
    """Write the page of one recording."""
    from pam_actuation.bags.load_joint import MEASURED
    from pam_actuation.report.joint_page import joint_report
    from pam_actuation.report.pages import bag_report
    summary = (joint_report if MEASURED in run else bag_report)([run], folder / 'report.html')
    share_plotly(folder / 'report.html')
    write_text(folder / 'report.json', json.dumps(summary, indent=2, default=str) + '\n')
    return {'verdict': 'implausible' if run.implausible else 'reported', 'reason': '',
            'sizes': [], 'ambiguous': [], 'least': {}, 'bad': False}


WORKS: dict[str, Callable[['RecordedRun', str, Settings, Path], Found]] = {
    'gap': gap, 'identify': identify, 'replay': replay, 'report': report}
NEED_A_MODEL = ('gap', 'identify')


def work_on(case: Case, settings: Settings, folder: Path) -> Found:
    """
    Do the work on one case, with its files in a folder; return what a table shows of it.

    Raises
    ------
    InputError
        The recording or the model cannot be used. ``identify`` takes no values that mean
        something else than they say, such as a wrong unit.

    """
    from pam_actuation.bags.load import load_run
    from pam_actuation.bags.load_joint import load_recording
    load = load_run if settings.work in NEED_A_MODEL else load_recording
    run = load(case.path, case.namespace)
    if settings.work == 'identify' and run.unusable:
        raise InputError(run.unusable[0].rstrip('.'), case.path)
    found = WORKS[settings.work](run, case.model or settings.model, settings, folder)
    return _with_what_is_wrong(found, (*run.left_out, *run.implausible))


def _with_what_is_wrong(found: Found, sentences: Sequence[str]) -> Found:
    """Return the row with what is wrong in the data as a part of its reason; it stands out."""
    reason = found['reason']
    new = [one for one in sentences if one.rstrip('.') not in reason]
    return {**found, 'reason': ' '.join([reason, *new]).strip(),
            'bad': found['bad'] or bool(sentences)}


def share_plotly(page: Path) -> None:
    """Let a page of a case take its plotting script from the folder of the campaign."""
    from pam_actuation.report.page import plotly_script
    text = page.read_text(encoding='utf-8')
    write_text(page, text.replace(
        f'<script>{plotly_script()}</script>', f'<script src="../../{PLOTLY}"></script>'))
