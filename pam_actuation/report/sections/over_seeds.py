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

"""Figures of the same experiment with several seeds: mean and standard deviation."""

from collections.abc import Sequence
import math
from typing import Any, TYPE_CHECKING

import numpy as np

from pam_actuation.report.page import paragraph, Section, table
from pam_sim.errors import InputError
from pam_sim.located_yaml import load_yaml
from pam_sim.run import MEASURED_TOPICS

if TYPE_CHECKING:
    from pam_actuation.report.joint_page import JointMetrics
    from pam_actuation.report.metrics import RunMetrics
    from pam_sim.run import Run

    Measured = tuple[str, Run, RunMetrics | JointMetrics]

_SAME = ('experiment', 'experiment_name', 'rig', 'valve', 'controller', 'preview_s')
_MEASURED = (*MEASURED_TOPICS, 'joint_state')      # of a joint in the place of each muscle
_FIGURES = (
    ('Tracking RMSE', 'tracking_rmse_m', 1e3, 'mm'), ('Largest error', 'max_error_m', 1e3, 'mm'),
    ('Mean error (reference − contraction)', 'mean_error_m', 1e3, 'mm'),
    ('Force tracking RMSE', 'tracking_rmse_n', 1.0, 'N'),
    ('Largest force error', 'max_error_n', 1.0, 'N'),
    ('RMSE of each cycle', 'cycle_rmse_m', 1e3, 'mm'),
    ('Force RMSE of each cycle', 'cycle_rmse_n', 1.0, 'N'),
    ('Tracking RMSE', 'tracking_rmse_rad', math.degrees(1.0), '°'),
    ('Largest error', 'max_error_rad', math.degrees(1.0), '°'),
    ('RMSE of each cycle', 'cycle_rmse_rad', math.degrees(1.0), '°'),
    ('Mean pressure of both muscles', 'co_contraction_pa', 1e-3, 'kPa'),
    ('Settling of each step', 'settling_s', 1.0, 's'),
    ('Overshoot of each step', 'overshoot_m', 1e3, 'mm'),
    ('Overshoot of each step', 'overshoot_rad', math.degrees(1.0), '°'),
    ('Total variation of the command', 'command_variation_pa_per_s', 1e-3, 'kPa/s'),
    ('Air filled into the muscle', 'air_use_kg', 1e6, 'mg'),
    ('Air through the fill valve', 'air_fed_kg', 1e6, 'mg'))


def over_seeds(measured: 'Sequence[Measured]') -> dict[str, dict[str, Any]]:
    """
    Return mean and sample standard deviation over runs that differ in their seed alone.

    Parameters
    ----------
    measured : sequence of (title, Run, RunMetrics or JointMetrics)
        Runs of the same experiment, rig and controller belong together. Those whose rules
        learn are apart from those whose learning is frozen.

    Returns
    -------
    dict
        By controller and titles: ``runs``, ``seeds``, ``same`` where all measured the same to
        the bit, and for each figure that all of them have ``{mean, std}``, SI.

    """
    groups: dict[tuple[object, ...], list[Measured]] = {}
    for one in measured:
        texts = one[1].metadata or {}
        same = (*(texts.get(name, '') for name in _SAME), _learns(one[1]))
        groups.setdefault(same, []).append(one)
    found = {}
    for runs in groups.values():
        titles = [title for title, _, _ in runs]
        seeds = [(run.metadata or {}).get('seed', '') for _, run, _ in runs]
        if '' in seeds or len(set(seeds)) < 2:
            continue
        figures = [one.to_dict() for _, _, one in runs]
        found[f'{controller_kind(runs[0][1])}: {", ".join(titles)}'] = {
            'runs': titles, 'seeds': seeds, 'same': _measured_the_same([r for _, r, _ in runs]),
            **{name: spread for _, name, _, _ in _FIGURES
               if (spread := _spread([one.get(name) for one in figures])) is not None}}
    return found


def same_remarks(found: dict[str, dict[str, Any]]) -> list[str]:
    """Return a sentence on each group of ``over_seeds`` whose seeds change nothing."""
    return [f'{name}: the runs with seeds {", ".join(one["seeds"])} are the same to the bit, and '
            'their standard deviation of 0 tells nothing of noise. A seed changes nothing where '
            'the rig has no sensor noise: state it under `sensors` in the file of the rig.'
            for name, one in found.items() if one['same']]


def _measured_the_same(runs: 'Sequence[Run]') -> bool:
    """Return whether runs have the same values of all that was measured."""
    first, *others = [{topic: series.values for topic, series in run.topics.items()
                       if topic.rpartition('/')[2] in _MEASURED} for run in runs]
    return bool(first) and all(
        one.keys() == first.keys() and all(
            one[topic].keys() == values.keys() and all(
                np.array_equal(one[topic][name], column, equal_nan=True)
                for name, column in values.items())
            for topic, values in first.items())
        for one in others)


def _learns(run: 'Run') -> bool:
    """Return whether the controller of a run ever learned."""
    return 'controller_state' in run and bool(
        (run['controller_state'].values.get('learning', np.zeros(1)) == 1.0).any())


def controller_kind(run: 'Run') -> str:
    """Return the kind of the controller of a run."""
    try:
        return str(load_yaml(run.metadata['controller']).get('controller'))
    except (InputError, KeyError):
        return 'no controller'


def _spread(values: list[Any]) -> dict[str, Any] | None:
    """Return mean and standard deviation, of lists element by element; None if one lacks it."""
    try:
        numbers = np.array(values, dtype=float)
    except ValueError:                  # lists of different length
        return None
    if not numbers.size or not np.isfinite(numbers).all():
        return None
    return {'mean': numbers.mean(axis=0).tolist(),
            'std': numbers.std(axis=0, ddof=1).tolist()}


def seeds_section(found: dict[str, dict[str, Any]]) -> Section | None:
    """Return the table of what ``over_seeds`` found, None of nothing."""
    if not found:
        return None
    rows: list[list[str | None]] = [
        ['Seeds', *(', '.join(one['seeds']) for one in found.values())]]
    rows += [[name, *(_shown(one.get(figure), factor, unit) for one in found.values())]
             for name, figure, factor, unit in _FIGURES]
    body = table(['', *found], [row for row in rows if any(cell is not None for cell in row[1:])])
    remarks = ''.join(map(paragraph, same_remarks(found)))
    return Section('over-seeds', 'Over several seeds', paragraph(
        'Mean and standard deviation over runs of the same experiment, rig and controller, '
        'whose seeds differ. Runs with frozen rules are counted apart.') + body + remarks)


def _shown(spread: dict[str, Any] | None, factor: float, unit: str) -> str | None:
    if spread is None:
        return None
    pairs = zip(np.atleast_1d(spread['mean']), np.atleast_1d(spread['std']))
    return ', '.join(f'{factor * mean:.3f} ± {factor * std:.3f}' for mean, std in pairs) + (
        f' {unit}')
