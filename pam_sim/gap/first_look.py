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

"""The first look: health, noise, free run, calibration, place, verdict."""

import time

import numpy as np
from pam_sim.gap.free_run import free_run, Recording
from pam_sim.gap.health import check_health
from pam_sim.gap.locate import locate
from pam_sim.gap.noise import noise_floor, STAMP_SD_S
from pam_sim.gap.nominal import calibrate, LATENCY_MAX_S, REFERENCE_PULL
from pam_sim.gap.result import GapResult, READABLE, SignalGap, Trace, UNIT

BLOCK_S = 2.0                # length of a time block, shorter in a short recording
PATTERN = (True, True, True, False, False)    # of the blocks: fit, fit, fit, certify, certify
INPUT_DRAWS = 4
# A gap smaller than this many noise floors, noise taken out, is not worth a cause.
MATERIAL = 0.5
LIMITS = 'This version locates and measures the gap and does not yet name effects.'


def gap_first_look(run, rig, seconds=20.0, seed=0):
    """
    Measure the gap between a recording and a model, and say where it sits.

    Parameters
    ----------
    run : pam_sim.run.Run
        The recording.
    rig : pam_sim.Rig
        The model.
    seconds : float
        Time budget of the calibration.
    seed : int
        Of the draws that carry stamp errors of the valve signal into the noise floor.

    Returns
    -------
    GapResult
        Verdict ``refused``, ``no_gap``, ``parameter`` or ``unknown``. Equal inputs give equal
        results, ``runtime_s`` aside, as long as the time budget is not used up.

    """
    started = time.perf_counter()
    health = check_health(run, rig.valve)
    if not health.usable:
        return GapResult('refused', _sentence(health.problems), remarks=health.remarks,
                         runtime_s=time.perf_counter() - started, model_yaml=rig.to_yaml())
    recording = Recording(run, rig.valve, driven=rig.load != 'hanging_mass')
    before = free_run(rig, recording)
    floor = floors(run, rig, recording, before, seed)
    block_s = min(BLOCK_S, recording.grid_s[-1] / (2 * len(PATTERN)))
    fit_part = {s: in_fit_part(recording.time_s[s], block_s) for s in recording.signals}
    fit = calibrate(rig, recording, floor, fit_part, seconds)
    refit = free_run(fit.rig, recording, fit.latency_s, start_error_pa=fit.start_error_pa)
    signals = {}
    for s in recording.signals:
        certify = ~fit_part[s]
        measured = recording.measured[s][certify]
        signals[s] = SignalGap(
            UNIT[s], floor[s], _rms(before[s][certify] - measured),
            _rms(refit[s][certify] - measured), _rms(refit[s][certify] - measured))
    result = GapResult('unknown', '', signals=signals, calibration=fit.numbers,
                       remarks=list(health.remarks),
                       simulations=fit.simulations + INPUT_DRAWS + 4)
    if not fit.complete:
        result.remarks.append('The time for the calibration ran out before it settled.')
    result.remarks.append(
        f'A latency of the measurement of {fit.latency_s * 1e3:.1f} ms, common to all signals, '
        f'was fitted beside the numbers (at most {LATENCY_MAX_S * 1e3:.0f} ms).')
    result.where = locate(rig, recording, before, floor)
    result.traces = {
        s: Trace(recording.stamp_ns[s], recording.measured[s], before[s], refit[s], refit[s])
        for s in recording.signals}
    result.model_yaml = fit.rig.to_yaml()
    decide(result)
    result.runtime_s = time.perf_counter() - started
    return result


def floors(run, rig, recording, simulated, seed):
    """
    Return the noise floor of every signal: sensor, stamps, and the input's stamps.

    The stamps of the valve signal are moved at random a few times; what that does
    to a free run is noise no model can explain.
    """
    random = np.random.default_rng(seed)
    squares = dict.fromkeys(recording.signals, 0.0)
    for _ in range(INPUT_DRAWS):
        moved = free_run(rig, recording,
                         stamp_shift_s=STAMP_SD_S * random.standard_normal(recording.messages))
        for s in recording.signals:
            squares[s] += float(np.mean((moved[s] - simulated[s]) ** 2)) / INPUT_DRAWS
    return {s: noise_floor(run, s, np.sqrt(squares[s])) for s in recording.signals}


def in_fit_part(time_s, block_s=BLOCK_S):
    """Return which samples are fitted; the other time blocks judge the result."""
    return np.array(PATTERN)[(np.asarray(time_s) // block_s).astype(int) % len(PATTERN)]


def decide(result):
    """Set verdict, reason, wrong numbers and the unexplained fraction of a result."""
    wrong = [c for c in result.calibration if abs(c.pull) > REFERENCE_PULL]
    left = {name: s for name, s in result.signals.items()
            if _beyond(s.rmse_refit, s.noise_floor) > MATERIAL}
    missed = {name: s for name, s in result.signals.items()
              if _beyond(s.rmse_before, s.noise_floor) > MATERIAL}
    if left:
        result.verdict, result.unexplained_fraction = 'unknown', 1.0
        result.reason = ' '.join([
            'The model misses ' + _sizes(left, 'rmse_before') + ' in a free run, '
            + _sizes(left, 'rmse_refit') + ' after its numbers were calibrated.',
            _places(result.where), _suspicious(wrong), LIMITS]).replace('  ', ' ')
    elif wrong:
        result.verdict = 'parameter'
        result.parameters = wrong
        result.ambiguity_set = [c.name for c in wrong]
        result.reason = (
            _numbers(wrong) + ' explains the gap, which falls to the noise floor with it.'
            if len(wrong) == 1 else
            _numbers(wrong) + ' together explain the gap, which falls to the noise floor with '
            'them; which of them is wrong needs a look at how well each was known.')
    else:
        result.verdict = 'no_gap'
        result.reason = (
            'The model follows the recording within sensor noise and stamps'
            + (', after small corrections within the tolerance of its numbers.' if missed
               else '.'))


def _beyond(value, floor):
    """Return the size of an rms beyond the noise floor, in noise floors."""
    return float(np.sqrt(max(value ** 2 - floor ** 2, 0.0)) / floor)


def _rms(values):
    return float(np.sqrt(np.mean(np.asarray(values) ** 2)))


def _sizes(signals, name):
    parts = []
    for signal, s in signals.items():
        factor, unit = READABLE[signal]
        parts.append(f'{getattr(s, name) * factor:.3g} {unit} of {signal}')
    return _join(parts)


def _places(where):
    parts = []
    for signal in ('contraction', 'pressure', 'force'):
        chosen = [w for w in where if w.signal == signal and w.condition == 'all']
        if chosen:
            main = max(chosen, key=lambda w: w.share_of_gap)
            parts.append(f'{100 * main.share_of_gap:.0f} % of the gap in {signal} comes from '
                         f'the {main.subsystem}')
    return _join(parts) + '.' if parts else ''


def _suspicious(wrong):
    if not wrong:
        return ''
    return (f'{_numbers(wrong)} moved beyond tolerance without closing the gap, so that is no '
            'proof of a wrong number.')


def _numbers(wrong):
    return _join([f'{c.name} = {c.value:.4g} {c.unit} instead of {c.nominal:.4g} {c.unit} '
                  f'({100 * (c.value / c.nominal - 1):+.1f} %)' for c in wrong])


def _join(parts):
    return parts[0] if len(parts) == 1 else ', '.join(parts[:-1]) + ' and ' + parts[-1]


def _sentence(parts):
    text = '; '.join(parts)
    return text[:1].upper() + text[1:] + '.'
