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
Credit delay from a recording: how long after a command the muscle moves.

The changes of command and contraction are correlated over a range of delays, block by block.
Changes rather than values, for a slow motion alike in both says nothing about the delay. The
largest correlation is at the delay of most of the response: dead time, lag of the valve and swing
of the load together. This is what the credit delay means. Where blocks disagree the delay is
uncertain, and the credit is to be spread.
"""

from dataclasses import dataclass

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError

LONGEST_S = 0.4
_BLOCK_S = 5.0
_SMOOTH_S = 0.03          # moving mean over both, against the noise of the sensor
_LEAST_CORRELATION = 0.3
_LEAST_BLOCKS = 2


@dataclass(frozen=True)
class CreditEstimate:
    """
    Delay between command and answer, with its uncertainty.

    Attributes
    ----------
    delay_s : float
        For the setting ``credit_delay_s``.
    spread_s : float
        For ``credit_spread_s``: standard deviation of the blocks, at least one period.
    correlation : float
        Median over the blocks of the largest correlation, 0...1.
    blocks : int
        Blocks that moved enough to tell.

    """

    delay_s: float
    spread_s: float
    correlation: float
    blocks: int


def estimate_credit(command_pa: FloatArray, answer: FloatArray, rate_hz: float,
                    where: str = 'recording') -> CreditEstimate | None:
    """
    Estimate credit delay and spread from recorded command and answer.

    Parameters
    ----------
    command_pa : array_like, shape (N,)
        Commanded pressure at equidistant times.
    answer : array_like, shape (N,)
        Contraction [m], or pressure [Pa] for the part of the delay that is the valve's.
    rate_hz : float
        Samples per second of both.
    where : str
        Place named in errors.

    Raises
    ------
    InputError
        Shapes differ, a value is not finite, or too little of the recording moves.

    """
    command, answer = np.asarray(command_pa, float), np.asarray(answer, float)
    if command.ndim != 1 or command.shape != answer.shape:
        raise InputError(
            f'command and answer have shapes {command.shape} and {answer.shape}; both must be '
            'one equal row of samples', where)
    if not (np.isfinite(command).all() and np.isfinite(answer).all()):
        raise InputError('command or answer holds values that are not finite', where)
    width = max(1, round(_SMOOTH_S * rate_hz))
    kernel = np.ones(width) / width
    changes = [np.diff(np.convolve(row, kernel, 'valid')) for row in (command, answer)]
    longest = round(LONGEST_S * rate_hz)
    size = round(_BLOCK_S * rate_hz)
    found = []
    for start in range(0, len(changes[0]) - size - longest + 1, size):
        peak = _peak(changes[0][start:start + size], changes[1][start:start + size + longest],
                     longest)
        if peak is not None:
            found.append(peak)
    if len(found) < _LEAST_BLOCKS:
        raise InputError(
            f'only {len(found)} of the blocks of {_BLOCK_S:g} s move enough to tell the delay; '
            f'{_LEAST_BLOCKS} are needed', where)
    delays, correlations = np.array(found).T
    return CreditEstimate(
        float(np.median(delays)) / rate_hz,
        max(float(np.std(delays)), 1.0) / rate_hz, float(np.median(correlations)), len(found))


def _peak(command: FloatArray, answer: FloatArray, longest: int) -> tuple[float, float] | None:
    """Return (delay in samples, correlation) where a block fits best, None where nothing does."""
    size = len(command)
    command = command - command.mean()
    power = np.sum(command ** 2)
    if not power > 0.0:
        return None
    values = np.empty(longest + 1)
    for lag in range(longest + 1):
        part = answer[lag:lag + size] - answer[lag:lag + size].mean()
        norm = np.sqrt(power * np.sum(part ** 2))
        values[lag] = np.sum(command * part) / norm if norm > 0.0 else 0.0
    best = int(np.argmax(values))
    if values[best] < _LEAST_CORRELATION or best == longest:
        return None
    if best == 0:
        return 0.0, values[0]
    before, at, after = values[best - 1:best + 2]
    bend = before - 2.0 * at + after
    return best + (0.5 * (before - after) / bend if bend < 0.0 else 0.0), at
