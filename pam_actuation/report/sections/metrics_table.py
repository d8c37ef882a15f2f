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

"""The table of figures of merit, one column per run."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from pam_actuation.report.errors import by_part
from pam_actuation.report.page import paragraph, Section, signed, table
from pam_actuation.report.steps import settling_text
from pam_sim.annotations import FloatArray
from pam_sim.units import often, RHO_REFERENCE

if TYPE_CHECKING:
    from pam_actuation.report.errors import Cycles
    from pam_actuation.report.joint_page import JointMetrics
    from pam_actuation.report.metrics import RunMetrics


def metrics(named: 'Sequence[tuple[str, RunMetrics]]', key: str = 'metrics') -> Section:
    """
    Return the table of metrics.

    Parameters
    ----------
    named : list of (title, RunMetrics)
        One column each.
    key : str
        Anchor.

    """
    rows = [[name, *(cell(m) for _, m in named)] for name, cell in _ROWS]
    body = table([''] + [name for name, _ in named], [
        row for row in rows if any(cell is not None for cell in row[1:])])
    body += told_of_learning(named)
    if any(m.air_use_kg is not None for _, m in named):
        body += paragraph(
            'Air is the sum of all increases of the air mass in the muscle, from measured '
            'pressure and the volume of the model; litres at the reference atmosphere. What '
            'leaks or a regulator bleeds is not in it.'
            + (' Air through the fill valve is the flow that its data sheet gives for the '
               'recorded duty and pressures, leaks included.'
               if any(m.air_fed_kg is not None for _, m in named) else ''), 'note')
    return Section(key, 'Figures of merit', body)


def _mm(value: float | None) -> str | None:
    return None if value is None else f'{value * 1e3:.3f} mm'


def _n(value: float | None) -> str | None:
    return None if value is None else f'{value:.3f} N'


def _mean_error(m: 'RunMetrics') -> str | None:
    return None if m.mean_error_m is None else f'{signed(m.mean_error_m * 1e3, 3)} mm'


def _percent(value: float | None) -> str | None:
    return None if value is None else f'{100.0 * value:.1f} % of the messages'


def each_part(values: FloatArray, parts: 'Sequence[Cycles]',
              shown: Callable[[FloatArray], str | None]) -> str | None:
    """Return in words what ``shown`` says of the cycles of each part; None of no cycles."""
    said = [(hz, shown(cycles)) for hz, cycles in by_part(values, parts)]
    return ', '.join(f'{words} ({hz})' if hz else words for hz, words in said if words) or None


def _cycle(values: FloatArray, m: 'RunMetrics', index: int, unit: str) -> str | None:
    """Return one cycle of each part with its unit."""
    return each_part(values, m.cycle_parts, lambda cycles: f'{cycles[index]:.3f} {unit}')


def _change(m: 'RunMetrics') -> str | None:
    return each_part(m.cycle_rmse_m, m.cycle_parts, lambda cycles: None if len(cycles) < 2 else
                     f'{signed(100.0 * (cycles[-1] / cycles[0] - 1.0))} %')


def _count(m: 'RunMetrics') -> str | None:
    values = m.cycle_rmse_m if len(m.cycle_rmse_m) else m.cycle_rmse_n
    return each_part(values, m.cycle_parts, lambda cycles: str(len(cycles)))


def _variation(m: 'RunMetrics') -> str | None:
    variation = m.command_variation_pa_per_s
    return None if variation is None else f'{variation * 1e-3:.1f} kPa/s'


def _settling(m: 'RunMetrics') -> str | None:
    return settling_text([*(step.settling_s for step in m.steps),
                          *(step.settling_s for step in m.force_steps)])


def _overshoot(m: 'RunMetrics') -> str | None:
    """Return the largest overshoot; a run tracks a contraction or a force."""
    if m.force_steps and not m.steps:
        return _n(max(step.overshoot for step in m.force_steps))
    return _mm(max((step.overshoot for step in m.steps), default=None))


def interrupted_text(m: 'RunMetrics | JointMetrics') -> str | None:
    """Return in words how often and how long a run was vented; None where it does not tell."""
    if m.interruptions is None:
        return None
    count, seconds = m.interruptions
    return f'{often(count)}, {seconds:.2f} s in all' if count else often(0)


def rolled_back_text(m: 'RunMetrics | JointMetrics') -> str | None:
    """Return in words how often rules were taken back; None where it does not tell."""
    count = m.times_rolled_back
    return None if count is None else often(count)


def told_of_learning(named: 'Sequence[tuple[str, RunMetrics | JointMetrics]]') -> str:
    """Return the paragraphs on runs in which learning made the tracking worse."""
    return ''.join(paragraph(f'{title}: {said}.') for title, m in named
                   for said in m.learned_worse)


def _air(value: float | None) -> str | None:
    if value is None:
        return None
    return f'{value * 1e3:.3g} g ({value / RHO_REFERENCE * 1e3:.3g} l)'


def _loop(m: 'RunMetrics', topic: str) -> str | None:
    """Return period, jitter and late share of one loop; None if it was not recorded."""
    timing = next((t for t in m.timing if t.topic == topic), None)
    if timing is None:
        return None
    return (f'{timing.median_s * 1e3:.2f} ms, jitter {timing.jitter_s * 1e3:.2f} ms, '
            f'{100 * timing.late_share:.2f} % late')


# What a row is called, and its cell for one run; None where the run does not tell.
_ROWS: 'tuple[tuple[str, Callable[[RunMetrics], str | int | None]], ...]' = (
    ('Tracking RMSE', lambda m: _mm(m.rmse_m)),
    ('Largest error', lambda m: _mm(m.max_error_m)),
    ('Mean error (reference − contraction)', _mean_error),
    ('RMSE of the first cycle', lambda m: _cycle(m.cycle_rmse_m * 1e3, m, 0, 'mm')),
    ('RMSE of the last cycle', lambda m: _cycle(m.cycle_rmse_m * 1e3, m, -1, 'mm')),
    ('Last cycle against the first', _change),
    ('Force tracking RMSE', lambda m: _n(m.rmse_n)),
    ('Largest force error', lambda m: _n(m.max_error_n)),
    ('Force RMSE of the first cycle', lambda m: _cycle(m.cycle_rmse_n, m, 0, 'N')),
    ('Force RMSE of the last cycle', lambda m: _cycle(m.cycle_rmse_n, m, -1, 'N')),
    ('Cycles', _count),
    ('Settling into 5 % after a step', _settling),
    ('Overshoot of steps', _overshoot),
    ('Total variation of the command', _variation),
    ('Valve at its upper limit', lambda m: _percent(m.saturation_high)),
    ('Valve at its lower limit', lambda m: _percent(m.saturation_low)),
    ('Vented for missing or old input', interrupted_text),
    ('Rules rolled back', rolled_back_text),
    ('Air filled into the muscle', lambda m: _air(m.air_use_kg)),
    ('Air through the fill valve', lambda m: _air(m.air_fed_kg)),
    ('From command to pressure', lambda m: None if m.path is None else m.path.text()),
    ('Controller loop', lambda m: _loop(m, 'pressure_command')),
    ('Driver loop', lambda m: _loop(m, 'valve_signal')),
)
