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

"""The page about one or several recordings of a joint: angle, both muscles, loops."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math
import os
from typing import Any

import numpy as np
from pam_actuation.report import errors, figures, metrics, signals
from pam_actuation.report.learning import learned_worse, times_rolled_back
from pam_actuation.report.page import plot, Section, table
from pam_actuation.report.pages import cycle_numbers, default_titles, PageParts, write_page
from pam_actuation.report.sections.cycles import cycle_chart
from pam_actuation.report.sections.metrics_table import (
    each_part, interrupted_text, rolled_back_text, told_of_learning)
from pam_actuation.report.sections.overlaid import lines, read_topic, together
from pam_actuation.report.steps import ANGLE, as_data, responses, settling_text, StepResponse
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.joint.parameters import SIDES
from pam_sim.run import Run
from pam_sim.units import P_ATM_PA

ROLES = {'flexor': 'after', 'extensor': 'second'}
FOOTER = ('Written by pam_actuation. Pressures are gauge, against 101.325 kPa; angles are '
          'positive in flexion. This page needs no network.')
_POINTS = 2400


@dataclass(frozen=True)
class JointMetrics:
    """
    Figures of merit of a recording of a joint, SI; None where it does not tell.

    ``cycle_rmse_rad`` has one number per complete cycle of the experiment, those of its
    ``cycle_parts`` one after another; ``co_contraction_pa`` is the mean gauge pressure of both
    muscles; ``interruptions`` are number and seconds of the stretches in which the controller
    vented for want of input; ``steps`` are in rad.
    """

    duration_s: float
    rmse_rad: float | None
    max_error_rad: float | None
    cycle_rmse_rad: FloatArray
    co_contraction_pa: float | None
    interruptions: tuple[int, float] | None
    timing: tuple[Any, ...]
    cycle_parts: tuple[errors.Cycles, ...] = ()
    times_rolled_back: int | None = None
    learned_worse: tuple[str, ...] = ()
    steps: tuple[StepResponse, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return the main numbers as plain data."""
        return {'duration_s': self.duration_s, 'tracking_rmse_rad': self.rmse_rad,
                'max_error_rad': self.max_error_rad,
                'cycle_rmse_rad': self.cycle_rmse_rad.tolist(),
                'cycle_parts': errors.parts_as_data(self.cycle_parts),
                'co_contraction_pa': self.co_contraction_pa,
                'interruptions': self.interruptions and self.interruptions[0],
                'times_rolled_back': self.times_rolled_back,
                'learned_worse': list(self.learned_worse),
                'settling_s': [step.settling_s for step in self.steps],
                'overshoot_rad': [step.overshoot for step in self.steps],
                'steps': as_data(self.steps, ANGLE),
                'loop_period_s': {one.topic: one.median_s for one in self.timing},
                'loop_jitter_s': {one.topic: one.jitter_s for one in self.timing}}


def angle_error(run: Run) -> tuple[FloatArray, FloatArray] | None:
    """
    Return (time_s, error_rad) with error = wanted - measured angle, or None.

    The reference is interpolated linearly to the stamps of the angle.
    """
    return errors.difference(signals.series(run, 'joint_reference', 'angle_rad'),
                             signals.series(run, 'joint_state', 'angle_rad'))


def joint_metrics(run: Run) -> JointMetrics:
    """Return the figures of merit of a recording of a joint."""
    error, parts = angle_error(run), errors.find_parts(run)
    pressures = [pair for side in SIDES
                 if (pair := signals.series(run, f'{side}/pressure')) is not None]
    cycles = errors.part_rmse(error, parts)
    return JointMetrics(
        signals.duration_s(run), None if error is None else errors.rmse(error[1]),
        None if error is None else float(np.max(np.abs(error[1]))), errors.joined(cycles),
        float(np.mean([pair[1].mean() for pair in pressures])) - P_ATM_PA if pressures else None,
        metrics.interruptions(run),
        tuple(found for topic in run.topics
              if (found := metrics.loop_timing(run, topic)) is not None),
        errors.counted(parts, cycles), times_rolled_back(run),
        learned_worse(run, np.degrees(errors.joined(cycles)), errors.counted(parts, cycles), '°'),
        responses(signals.series(run, 'joint_reference', 'angle_rad'), error, ANGLE))


def joint_report(runs: Sequence[Run], out_path: str | os.PathLike[str],
                 of: str = '') -> dict[str, dict[str, Any]]:
    """
    Write the HTML page of one or several recordings of a joint.

    Parameters
    ----------
    runs : sequence of RecordedRun
        From ``bags.load_joint.load_recording``.
    out_path : path
        File to write, atomically.
    of : str
        Words in the head of the page that tell which bags it shows.

    Returns
    -------
    dict
        Main numbers of every run, plain data; ``over_seeds`` where seeds alone differ.

    Raises
    ------
    InputError
        No run was given, or one of a single muscle.

    """
    for run in runs:
        if 'joint_state' not in run:
            raise InputError('is no recording of a joint; give it a page of its own',
                             str(run.path))
    return write_page(PageParts(
        'a joint of two pneumatic muscles', joint_metrics, _merits, _cycles, _overlaid, _plots,
        _key_numbers, FOOTER), runs, default_titles(runs), out_path, of)


def _cycles(named: Sequence[tuple[str, JointMetrics]]) -> Section | None:
    return cycle_chart([(title, np.degrees(one.cycle_rmse_rad), one.cycle_parts)
                        for title, one in named], '°')


def _merits(named: Sequence[tuple[str, JointMetrics]]) -> Section:
    def cells(read: Callable[[JointMetrics], str | None]) -> list[str | None]:
        return [read(one) for _, one in named]

    rows = [
        ('Tracking RMSE', cells(lambda m: _degrees(m.rmse_rad))),
        ('Largest error', cells(lambda m: _degrees(m.max_error_rad))),
        ('RMSE of the first cycle', cells(lambda m: each_part(
            m.cycle_rmse_rad, m.cycle_parts, lambda cycles: _degrees(cycles[0])))),
        ('RMSE of the last cycle', cells(lambda m: each_part(
            m.cycle_rmse_rad, m.cycle_parts, lambda cycles: _degrees(cycles[-1])))),
        ('Settling into 5 % after a step', cells(lambda m: settling_text(
            [step.settling_s for step in m.steps]))),
        ('Overshoot of steps', cells(lambda m: _degrees(
            max((step.overshoot for step in m.steps), default=None)))),
        ('Mean pressure of both muscles', cells(lambda m: (
            None if m.co_contraction_pa is None else f'{m.co_contraction_pa * 1e-3:.1f} kPa'))),
        ('Vented for missing or old input', cells(interrupted_text)),
        ('Rules rolled back', cells(rolled_back_text))]
    body = table(['', *(title for title, _ in named)],
                 [[name, *row] for name, row in rows if any(cell is not None for cell in row)])
    return Section('metrics', 'Figures of merit', body + told_of_learning(named))


def _key_numbers(named: Sequence[tuple[str, JointMetrics]]) -> list[tuple[str, str, str, str]]:
    numbers = []
    for title, one in named[:4]:
        if len(one.cycle_rmse_rad) > 1:
            numbers += cycle_numbers('Tracking RMSE', np.degrees(one.cycle_rmse_rad),
                                     one.cycle_parts, title, '°')
        elif one.rmse_rad is not None:
            numbers.append((str(_degrees(one.rmse_rad)), 'Tracking RMSE', title, ''))
    return numbers


def _degrees(angle_rad: float | None) -> str | None:
    return None if angle_rad is None else f'{np.degrees(angle_rad):.3f}°'


def _overlaid(named: list[tuple[str, Run]]) -> Section | None:
    """Return the section that draws all runs into the same plots, None for a single run."""
    if len(named) < 2:
        return None
    degrees = math.degrees(1.0)
    reference = signals.series(named[0][1], 'joint_reference', 'angle_rad')
    return together([
        ('angle [°]', lines(named, read_topic('joint_state', degrees, field='angle_rad'))
         + ([] if reference is None else [figures.line(
             reference[0], np.degrees(reference[1]), 'reference', 'reference', dash='dash',
             width=1.1, max_points=_POINTS)])),
        ('tracking error [°]', lines(named, lambda run: (
            None if (error := angle_error(run)) is None else (error[0], np.degrees(error[1]))))),
        *((f'{side} [kPa gauge]', lines(named, read_topic(f'{side}/pressure', 1e-3, P_ATM_PA)))
          for side in SIDES),
        *((f'{side} [N]', lines(named, read_topic(f'{side}/force', 1.0))) for side in SIDES)])


def _plots(run: Run, key: str, title: str) -> Section:
    """Return the section with angle, error, pressures, forces and valves of one run."""
    error = angle_error(run)
    rows = [
        ('angle [°]', _lines(run, np.degrees, (
            ('joint_state', 'angle_rad', 'angle', 'measured', None),
            ('joint_reference', 'angle_rad', 'reference', 'reference', 'dash')))),
        ('tracking error [°]', [] if error is None else [figures.line(
            error[0], np.degrees(error[1]), 'reference − angle', 'residual', width=1.1,
            max_points=_POINTS)]),
        ('pressure [kPa gauge]', _lines(run, lambda pa: (pa - P_ATM_PA) * 1e-3, (
            *((f'{side}/pressure', None, side, ROLES[side], None) for side in SIDES),
            *((f'{side}/pressure_command', None, f'{side} command', ROLES[side], 'dot')
              for side in SIDES)))),
        ('force [N]', _lines(run, np.asarray, tuple(
            (f'{side}/force', None, side, ROLES[side], None) for side in SIDES))),
        ('valve', _lines(run, np.asarray, tuple(
            (f'{side}/valve_signal', name, f'{side} {name}', ROLES[side], dash)
            for side in SIDES for name, dash in (
                ('ppr_voltage', None), ('fill_duty', None), ('vent_duty', 'dot')))))]
    shown = [(label, traces) for label, traces in rows if traces]
    return Section(key, title, plot(
        figures.with_markers(
            figures.stack(shown, 'time since the start of the experiment [s]'),
            signals.markers(run)),
        'Drag to zoom, all rows follow; double click to go back.'))


def _lines(run: Run, shown: Callable[[FloatArray], FloatArray],
           wanted: Sequence[tuple[str, str | None, str, str, str | None]]) -> list[Any]:
    """Return the traces of those of (topic, field, name, role, dash) that were recorded."""
    return [figures.line(pair[0], shown(pair[1]), name, role, dash=dash, width=1.3,
                         max_points=_POINTS)
            for topic, field, name, role, dash in wanted
            if (pair := signals.series(run, topic, field)) is not None]
