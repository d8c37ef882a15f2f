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
A sensor that is late: the load moves as in the model, and its force or motion is told later.

Each topic may be late by a skew that the fit takes out. A slow amplifier, a camera, or stamps of
another clock are late by more. That is no effect of the library, and what is left looks like a
gap.
"""

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray
from pam_sim.gap.criteria import Criteria
from pam_sim.gap.subsystems.known import of_run, SKEW_MAX_S
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.gap.verify.own_runs import OwnRuns
from pam_sim.rig import Rig

MOST_S, STEP_S = 0.1, 5e-4   # of what is tried, early and late
MOST_CAMERA_S = 0.25
SENTENCE = ('The load moves as in the model, but its force is about {:.0f} ms {}: that explains '
            '{:.0f} % of the squared gap in force. Look at the filter of the load cell and at its '
            'time stamps. `pam import` takes a known delay off a column with `late_s`.')

OF_MOTION = ('The load moves as in the model, but its contraction is about {:.0f} ms {}: that '
             'explains {:.0f} % of the squared gap in contraction. Look at the delay of its '
             'sensor, such as a camera, and at its time stamps. `pam import` takes a known delay '
             'off a column with `late_s`.')


def late_force(runs: OwnRuns, criteria: Criteria) -> str:
    """
    Return what is said where the force alone errs, and most of that is a shift in time.

    Parameters
    ----------
    runs : OwnRuns
        On the certify data.
    criteria : Criteria
        Decision thresholds.

    Returns
    -------
    str
        Empty where the motion errs as well, or the force otherwise.

    """
    gaps = runs.gaps.get('muscle', {})
    if 'force' not in gaps or 'contraction' not in gaps or (
            gaps['contraction'].rmse_refit > criteria.floor_error
            * gaps['contraction'].noise_floor) or (
            gaps['force'].rmse_refit <= criteria.floor_error * gaps['force'].noise_floor):
        return ''
    problem, rig, known = _muscle_of(runs)
    skew = np.array([k.name == of_run('force_skew', 0) for k in problem.known])
    chosen = runs.chosen(problem, 'force')
    error = problem.errors(rig, np.where(skew, 0.0, known))[chosen] * problem.floor['force']
    time_s, measured = problem.time_s[chosen], problem.measured[chosen]
    late_s, share = shift_of(time_s, measured + error, measured, problem.floor['force'])
    if abs(late_s) <= SKEW_MAX_S or share <= criteria.greater_part:
        return ''
    return _said(SENTENCE, late_s, share)


def late_contraction(runs: OwnRuns, criteria: Criteria) -> str:
    """
    Return what is said where a shift in time explains what the motion is off.

    Calibration bends damping and the like for a shift, so the given model is looked at as well.

    Parameters
    ----------
    runs : OwnRuns
        On the certify data.
    criteria : Criteria
        Decision thresholds.

    Returns
    -------
    str
        Empty where the contraction is given, fits, or errs otherwise.

    """
    gap = runs.gaps.get('muscle', {}).get('contraction')
    if gap is None or gap.rmse_refit <= criteria.floor_error * gap.noise_floor:
        return ''
    problem, rig, known = _muscle_of(runs)
    chosen, floor = runs.chosen(problem, 'contraction'), problem.floor['contraction']
    # The motion between stretches that are judged is needed to shift it.
    own = (problem.signal == problem.signals.index('contraction')) & (problem.run == 0)
    time_s, measured = problem.time_s[own], problem.measured[own]
    late_s, share = max((shift_of(
        time_s, measured + problem.errors(one, numbers)[own] * floor, measured, floor,
        MOST_CAMERA_S, chosen[own]) for one, numbers in (
            (rig, known), (runs.validation.estimator.rig, np.zeros(len(known))))),
        key=lambda found: found[1])
    if abs(late_s) <= 2.0 * SKEW_MAX_S or share <= criteria.named_share:
        return ''
    return _said(OF_MOTION, late_s, share)


def _muscle_of(runs: OwnRuns) -> tuple[SubsystemProblem, Rig, FloatArray]:
    """Return the problem of muscle and load with the calibrated rig and its numbers."""
    return next(one for one in runs.at(runs.validation.base) if one[0].subsystem == 'muscle')


def _said(sentence: str, late_s: float, share: float) -> str:
    return sentence.format(1e3 * abs(late_s), 'late' if late_s > 0.0 else 'early', 100.0 * share)


def shift_of(time_s: FloatArray, simulated: FloatArray, measured: FloatArray,
             floor: float = 0.0, most_s: float = MOST_S, judged: BoolArray | None = None
             ) -> tuple[float, float]:
    """
    Return by how much [s] a measurement is late, and which share of the squared gap that explains.

    Parameters
    ----------
    time_s : numpy.ndarray, shape (N,)
        Instants.
    simulated, measured : numpy.ndarray, shape (N,)
        A signal of a model, and the same measured.
    floor : float
        Noise floor of the signal, in its unit.
    most_s : float
        The largest shift that is tried, early and late [s].
    judged : numpy.ndarray of bool, shape (N,), optional
        Which of them count; all by default.

    """
    chosen = slice(None) if judged is None else judged
    most = round(most_s / STEP_S)
    shifts_s = STEP_S * np.arange(-most, most + 1)
    left = np.array([np.mean((np.interp(
        time_s[chosen] - shift_s, time_s, simulated) - measured[chosen]) ** 2)
        for shift_s in shifts_s])
    place, whole = int(np.argmin(left)), float(left[most]) - floor ** 2
    return float(shifts_s[place]), min(
        float(left[most] - left[place]) / whole, 1.0) if whole > 0.0 else 0.0
