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

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from pam_actuation.report.page import paragraph, Section, signed, table
from pam_sim.annotations import FloatArray

if TYPE_CHECKING:
    from pam_actuation.report.joint_page import JointMetrics
    from pam_actuation.report.metrics import RunMetrics

AIR_DENSITY = 1.185          # kg/m^3 at the reference atmosphere of ISO 8778


def metrics(named: 'Sequence[tuple[str, RunMetrics]]', key: str = 'metrics',
            title: str = 'Figures of merit') -> Section:
    """
    Return the table of metrics.

    Parameters
    ----------
    named : list of (title, RunMetrics)
        One column each.
    key, title : str
        Anchor and heading.

    """
    found: list[tuple[str, list[str | int | None]]] = [
        ('Tracking RMSE', _mm(m.rmse_m for _, m in named)),
        ('Largest error', _mm(m.max_error_m for _, m in named)),
        ('Mean error (reference − contraction)', [
            None if m.mean_error_m is None else f'{signed(m.mean_error_m * 1e3, 3)} mm'
            for _, m in named]),
        ('RMSE of the first cycle', _mm(_cycle(m, 0) for _, m in named)),
        ('RMSE of the last cycle', _mm(_cycle(m, -1) for _, m in named)),
        ('Last cycle against the first', [_change(m) for _, m in named]),
        ('Force tracking RMSE', _n(m.rmse_n for _, m in named)),
        ('Largest force error', _n(m.max_error_n for _, m in named)),
        ('Force RMSE of the first cycle', _n(value_at(m.cycle_rmse_n, 0) for _, m in named)),
        ('Force RMSE of the last cycle', _n(value_at(m.cycle_rmse_n, -1) for _, m in named)),
        ('Cycles', [len(m.cycle_rmse_m) or len(m.cycle_rmse_n) or None for _, m in named]),
        ('Settling into 5 % after a step', [_settling(m) for _, m in named]),
        ('Overshoot of steps', _mm(max((s.overshoot_m for s in m.steps), default=None)
                                   for _, m in named)),
        ('Valve at its upper limit', [_percent(m.saturation_high) for _, m in named]),
        ('Valve at its lower limit', [_percent(m.saturation_low) for _, m in named]),
        ('Vented for missing or old input', [interrupted_text(m) for _, m in named]),
        ('Air filled into the muscle', [_air(m.air_use_kg) for _, m in named]),
        ('Air through the fill valve', [_air(m.air_fed_kg) for _, m in named]),
        ('From command to pressure', [None if m.path is None else m.path.text()
                                      for _, m in named]),
        ('Controller loop', [_loop(m, 'pressure_command') for _, m in named]),
        ('Driver loop', [_loop(m, 'valve_signal') for _, m in named]),
    ]
    rows = [[name, *cells] for name, cells in found if any(c is not None for c in cells)]
    body = table([''] + [name for name, _ in named], rows)
    if any(m.air_use_kg is not None for _, m in named):
        body += paragraph(
            'Air is the sum of all increases of the air mass in the muscle, from measured '
            'pressure and the volume of the model; litres at the reference atmosphere. What '
            'leaks or a regulator bleeds is not in it.'
            + (' Air through the fill valve is the flow that its data sheet gives for the '
               'recorded duty and pressures, leaks included.'
               if any(m.air_fed_kg is not None for _, m in named) else ''), 'note')
    return Section(key, title, body)


def _mm(values: Iterable[float | None]) -> list[str | int | None]:
    return [None if v is None else f'{v * 1e3:.3f} mm' for v in values]


def _n(values: Iterable[float | None]) -> list[str | int | None]:
    return [None if v is None else f'{v:.3f} N' for v in values]


def _percent(value: float | None) -> str | None:
    return None if value is None else f'{100.0 * value:.1f} % of the messages'


def _cycle(m: 'RunMetrics', index: int) -> float | None:
    return value_at(m.cycle_rmse_m, index)


def value_at(values: FloatArray, index: int) -> float | None:
    """Return one of the values, None of no values."""
    return float(values[index]) if len(values) else None


def _change(m: 'RunMetrics') -> str | None:
    if len(m.cycle_rmse_m) < 2:
        return None
    return f'{signed(100.0 * (m.cycle_rmse_m[-1] / m.cycle_rmse_m[0] - 1.0))} %'


def _settling(m: 'RunMetrics') -> str | None:
    if not m.steps:
        return None
    return ', '.join('not settled' if s.settling_s is None else f'{s.settling_s:.2f} s'
                     for s in m.steps)


def interrupted_text(m: 'RunMetrics | JointMetrics') -> str | None:
    """Return in words how often and how long a run was vented; None where it does not tell."""
    if m.interruptions is None:
        return None
    count, seconds = m.interruptions
    return 'never' if not count else f'{count} times, {seconds:.2f} s in all'


def _air(value: float | None) -> str | None:
    if value is None:
        return None
    return f'{value * 1e3:.2f} g ({value / AIR_DENSITY * 1e3:.2f} l)'


def _loop(m: 'RunMetrics', topic: str) -> str | None:
    """Return period, jitter and late share of one loop; None if it was not recorded."""
    timing = next((t for t in m.timing if t.topic == topic), None)
    if timing is None:
        return None
    return (f'{timing.median_s * 1e3:.2f} ms, jitter {timing.jitter_s * 1e3:.2f} ms, '
            f'{100 * timing.late_share:.2f} % late')
