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
How large a hidden effect is: what it moves, in standard deviations of the sensors, after refit.

The numbers of the rig without the effect are fitted to the noise-free fit run, by regularised
least squares. The prior deviations are those of a data sheet, and a shared latency is a nuisance.
The gap is the error left on the certify run: its rms in standard deviations of the sensor, of the
signal where that is largest. Two refits are made. With full weights the numbers go where the
data draw them. Tempered, by misfit and memory of the residual, they stay nearer to the data
sheet, and what they could have taken up counts as gap. Like any model of the rig, that without
the effect starts at the pressure that is read at first.
"""

import numpy as np
import truth_effects as effects
import truth_run as runs
import truth_sensors as sensors

PRIOR = 0.02
SUPPLY_PRIOR = 0.005
LATENCY_SD_S = 1e-3
EVERY = 25                    # rows of 0.2 ms: compared at 200 Hz
FURTHER, GOOD_PART = 6, 0.8    # most further steps, and what one must leave at most to go on
SETTLED = 0.01                # squares of a sample [sigma] below which there is no gap
ROUNDS = {'plain': 1, 'tempered': 5}         # the first is at full weight


def gap_in_sigma(numbers, without, chain, fit, certify, valve, start=None, replay=runs.replay,
                 latency_sd_s=LATENCY_SD_S):
    """
    Return {refit: {signal: gap in sigma}} of the certify run.

    Parameters
    ----------
    numbers : dict
        Numbers of the true rig.
    without : dict
        The same rig without its effects.
    chain : Chain
        Sensors of the true rig; only what effects change in them is used.
    fit, certify : Truth
        The runs.
    valve : {'ppr', 'hsv'}
        Valve.
    start : dict, optional
        Numbers as the data sheet has them, the centre of the prior; nominal by default.
    replay : callable
        As of ``truth_run.replay``.
    latency_sd_s : float
        Prior deviation of the latency.

    """
    names = [effects.PARAMETERS[p][0] for p in effects.PARAMETERS_OF[valve]]
    nominal = {effects.PARAMETERS[p][0]: effects.PARAMETERS[p][1]
               for p in effects.PARAMETERS_OF[valve]} | dict(start or {})
    if valve == 'hsv':
        names.append('supply')
        nominal.setdefault('supply', effects.PARAMETERS['supply_pa'][1])
    sd = np.array([nominal[n] * (SUPPLY_PRIOR if n == 'supply' else PRIOR) for n in names])
    signals = ['pressure', 'contraction'] + (['force'] if chain.with_force else [])
    target = _scaled(fit.rows, chain, signals)
    plain = sensors.Chain(effects=chain.effects)
    neutral = sensors.Chain(noise=chain.noise)

    def model(theta, run):
        changed = without | {
            n: nominal[n] + s * z for n, s, z in zip(names, sd, theta)}
        first_pa = float(sensors.readings(run.rows[:1], plain)['pressure'][0])
        return _scaled(replay(changed, valve, run, first_pa), neutral, signals)

    # The prior is about the data sheet; the fit starts at the true numbers.
    theta = np.array([(without.get(n, nominal[n]) - nominal[n]) / s
                      for n, s in zip(names, sd)])
    base = model(theta, fit)

    def slopes_at(at, values):
        found = {s: np.empty((values[s].size, len(names) + 1)) for s in signals}
        for k in range(len(names)):
            moved = at.copy()
            moved[k] += 0.3
            for s, other in model(moved, fit).items():
                found[s][:, k] = (other - values[s]) / 0.3
        for s in signals:
            found[s][:, -1] = -np.gradient(values[s], EVERY * sensors.ROW_S) * latency_sd_s
        return found

    slopes = slopes_at(theta, base)
    prior = np.concatenate([theta, [0.0]])
    left = {s: target[s] - base[s] for s in signals}
    found = {}
    for refit, rounds in ROUNDS.items():
        step = _fitted(left, slopes, prior, rounds)
        if rounds == 1:
            step = _settled(step, model, theta, fit, target, slopes, slopes_at, prior,
                            latency_sd_s)
        end = model(theta + step[:-1], certify)
        truth = _scaled(certify.rows, chain, signals)
        found[refit] = {s: float(np.sqrt(np.mean(
            (truth[s] - _late(end[s], step, latency_sd_s)) ** 2))) for s in signals}
    return found


def _late(values, step, latency_sd_s):
    """Return a signal later by the latency of a step."""
    return values - np.gradient(values, EVERY * sensors.ROW_S) * step[-1] * latency_sd_s


def _settled(step, model, theta, fit, target, slopes, slopes_at, prior, latency_sd_s):
    """
    Return a step of full weight, taken further while that lowers the squares by a good part.

    The slopes are those of the start, and a misfit of hundreds of sigma takes numbers far. Behind
    on/off valves the pressure adds up every flow, and two numbers of the valve do nearly the same.
    There the first step may end far from the least squares, and the rest would count as a gap.
    """
    def reached(at):
        values = model(theta + at[:-1], fit)
        with np.errstate(all='ignore'):
            off = {s: target[s] - _late(values[s], at, latency_sd_s) for s in target}
            squares = sum(float(np.sum(v**2)) for v in off.values())
        return values, off, squares + float(np.sum((prior + at) ** 2))

    values, off, squares = reached(step)
    while not np.isfinite(squares):             # no rig has such numbers
        step = 0.5 * step
        values, off, squares = reached(step)
    enough = SETTLED * sum(v.size for v in target.values())
    for round_ in range(FURTHER):
        if round_:
            slopes = slopes_at(theta + step[:-1], values)
        further = step + _fitted(off, slopes, prior + step, 1)
        other, rest, less = reached(further)
        falls = less < squares
        if falls:
            step, values, off, before, squares = further, other, rest, squares, less
        # The first round has the old slopes: that it ends tells nothing.
        if squares < enough or round_ and not (falls and squares < GOOD_PART * before):
            break
    return step


def _fitted(left, slopes, prior, rounds):
    """Return the step of the numbers and of the latency [prior deviations]."""
    step = np.zeros(prior.size)
    for round_ in range(rounds):
        matrix, right = np.eye(prior.size), -prior
        for s, values in left.items():
            # From full weight: a low one keeps the misfit that made it, and is its own reason.
            weight = 1.0 / tempering(values - slopes[s] @ step) if round_ else 1.0
            matrix = matrix + weight * slopes[s].T @ slopes[s]
            right = right + weight * slopes[s].T @ values
        step = np.linalg.solve(matrix, right)
    return step


def tempering(residual):
    """Return by what the weight of a residual [sigma] with unit noise is divided."""
    square = float(np.mean(residual**2))
    centred = residual - residual.mean()
    size = 2 * centred.size
    power = np.abs(np.fft.rfft(centred, size)) ** 2
    memory = np.fft.irfft(power, size)[:centred.size]
    if memory[0] <= 1e-12 * centred.size:
        return 1.0
    memory = memory / memory[0]
    negative = np.flatnonzero(memory < 0.0)
    long = 1.0 + 2.0 * memory[1:negative[0] if negative.size else None].sum()
    share = square / (1.0 + square)
    return (1.0 + square) * (1.0 + share * (long - 1.0))


def _scaled(rows, chain, signals):
    """Return {signal: noise-free readings in sigma at 200 Hz}; the shared filter is left out."""
    plain = sensors.Chain(effects=chain.effects)
    clean = sensors.readings(rows, plain)
    return {s: clean[s][::EVERY] / (sensors.SIGMA[s] * chain.noise) for s in signals}
