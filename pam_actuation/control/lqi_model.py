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
A linear model of the muscle about one operating point, identified from a run.

From pressure command to contraction, deviations from the operating point::

    y[k] = -a_1 y[k-1] - ... - a_n y[k-n] + b_1 u[k-1-d] + ... + b_n u[k-n-d]

The method of Steiglitz and McBride (IEEE Trans. Automatic Control 10, 1965): repeated least
squares on filtered signals. It minimises the error of the simulated output, not that of one step,
so sensor noise does not look like damping. The delay is the one with which the simulated output
fits best. Both signals pass a high-pass first: creep and hysteresis drift, which no linear model
of low order explains, and the integral of the controller makes up for.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from pam_sim import load_rig
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.rig import Rig

if TYPE_CHECKING:
    from pam_sim.run import Run

# scipy.linalg and scipy.signal are imported where a model is identified or simulated: they take
# half of the time that a verb needs to start, and a controller of another law needs neither. So is
# the simulated run, which brings plant and driver: a live controller mostly has its model.

MAX_DELAY_S = 0.12
DRIFT_HZ = 1.0                 # corner of the high-pass
_ROUNDS = 12
_SHORTEST = 400                # samples
_LONGEST_POLE = 0.99999


@dataclass(frozen=True)
class LinearModel:
    """
    A discrete linear model with a delay.

    Attributes
    ----------
    rate_hz : float
    delay_ticks : int
        Ticks from a command to the first effect, beyond the one every discrete model has.
    denominator, numerator : tuple of float
        a_1..a_n and b_1..b_n [m/Pa].
    contraction_m, pressure_pa : float
        Operating point, absolute pressure.
    fit : float
        Share of the variance of the record, drift removed, that the simulated output explains.

    """

    rate_hz: float
    delay_ticks: int
    denominator: tuple[float, ...]
    numerator: tuple[float, ...]
    contraction_m: float
    pressure_pa: float
    fit: float = 1.0

    @property
    def gain_m_per_pa(self) -> float:
        """Contraction per pressure at rest."""
        return sum(self.numerator) / (1.0 + sum(self.denominator))

    def to_dict(self) -> dict[str, object]:
        """Return the model as plain data of a controller file."""
        return {'rate_hz': self.rate_hz, 'delay_ticks': self.delay_ticks,
                'denominator': list(self.denominator), 'numerator': list(self.numerator),
                'contraction_m': self.contraction_m, 'pressure_pa': self.pressure_pa}

    def simulate(self, command_pa: FloatArray) -> FloatArray:
        """Return the contraction [m] for commands [absolute Pa], from rest at the first one."""
        from scipy.signal import lfilter
        u = np.asarray(command_pa, dtype=float) - self.pressure_pa
        delayed = np.r_[np.full(1 + self.delay_ticks, u[0]), u][:u.size]
        rest = self.gain_m_per_pa * u[0]
        return self.contraction_m + rest + lfilter(
            self.numerator, np.r_[1.0, self.denominator], delayed - u[0])


def identify(command_pa: FloatArray, contraction_m: FloatArray | list[float], rate_hz: float,
             order: int = 3, max_delay_s: float = MAX_DELAY_S) -> LinearModel:
    """
    Return the linear model that explains a record best.

    Parameters
    ----------
    command_pa, contraction_m : array_like, shape (N,)
        Pressure command [absolute Pa] and contraction, one pair a tick; the command acts
        from its tick on. Begins near rest.
    rate_hz : float
        Of the ticks.
    order : int
        Of the model without its delay.
    max_delay_s : float
        Longest delay tried.

    Raises
    ------
    InputError
        Too short, nothing moves, or no stable model is found.

    """
    from scipy.signal import butter, lfilter
    u, y = np.asarray(command_pa, dtype=float), np.asarray(contraction_m, dtype=float)
    if u.size < _SHORTEST or u.shape != y.shape:
        raise InputError(
            f'{u.size} samples of command and {y.size} of contraction; identification needs '
            f'{_SHORTEST} or more of both')
    if not (np.isfinite(u).all() and np.isfinite(y).all()) or np.std(u) < 1e2 or np.std(y) < 1e-5:
        raise InputError('command or contraction do not move (0.1 kPa, 0.01 mm) or are not finite')
    centre_y, centre_u = float(np.mean(y)), float(np.mean(u))
    u, y = (lfilter(*butter(2, DRIFT_HZ, 'high', fs=rate_hz), one - one[0]) for one in (u, y))
    best = None
    for delay in range(int(max_delay_s * rate_hz) + 1):
        found = _steiglitz_mcbride(u, y, order, delay)
        if found is None:
            continue
        output = LinearModel(rate_hz, delay, *found, 0.0, 0.0).simulate(u)
        fit = 1.0 - float(np.var(y - output) / np.var(y))
        model = LinearModel(rate_hz, delay, *found, centre_y, centre_u, fit)
        if model.gain_m_per_pa > 0.0 and (best is None or fit > best.fit):
            best = model
    if best is None:
        raise InputError('no stable linear model explains the record')
    return best


def _steiglitz_mcbride(
        u: FloatArray, y: FloatArray, order: int,
        delay: int) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
    """Return (a, b) as tuples for one delay, None where the rounds run away."""
    from scipy.linalg import lstsq
    from scipy.signal import lfilter
    u = np.r_[np.zeros(delay), u][:u.size]
    filtered = np.ones(1)
    for _ in range(_ROUNDS):
        fu, fy = lfilter([1.0], filtered, u), lfilter([1.0], filtered, y)
        rows = np.column_stack(
            [-fy[order - i:fy.size - i] for i in range(1, order + 1)]
            + [fu[order - i:fu.size - i] for i in range(1, order + 1)])
        scale = np.sqrt(np.mean(rows ** 2, axis=0)) + 1e-300
        theta = lstsq(rows / scale, fy[order:], lapack_driver='gelsy')[0] / scale
        if not np.isfinite(theta).all():
            return None
        filtered = np.r_[1.0, theta[:order]]
        poles = np.roots(filtered)
        if np.max(np.abs(poles)) > _LONGEST_POLE:
            # Mirror what is unstable into the unit circle; the next round starts from there.
            outside = np.abs(poles) > _LONGEST_POLE
            poles[outside] = _LONGEST_POLE ** 2 / np.conj(poles[outside])
            filtered = np.real(np.poly(poles))
    if np.max(np.abs(np.roots(np.r_[1.0, theta[:order]]))) > _LONGEST_POLE:
        return None
    return tuple(theta[:order].tolist()), tuple(theta[order:].tolist())


def identify_on_rig(rig: Rig, rate_hz: float) -> LinearModel:
    """Return the linear model of a rig with a hanging mass, see ``identification_record``."""
    if rig.is_driven:
        raise InputError(f'load `{rig.load}` does not move with the pressure', rig.name)
    return _identified(rig.to_yaml(), rate_hz)


@lru_cache(maxsize=16)      # more than a second each; the same rig is asked for again and again
def _identified(rig_text: str, rate_hz: float) -> LinearModel:
    from pam_actuation.control.identification_run import identification_record
    return identify(*identification_record(load_rig(rig_text), rate_hz), rate_hz)


def identify_on_run(run: 'Run', rate_hz: float) -> LinearModel:
    """
    Return the linear model of a recording with ``pressure_command`` and ``contraction``.

    Raises
    ------
    InputError
        A topic is missing, or the recording does not move enough.

    """
    grid = run.on_grid(1.0 / rate_hz, topics=('pressure_command', 'contraction'))
    return identify(
        grid['pressure_command', 'pressure_pa'], grid['contraction', 'contraction_m'], rate_hz)
