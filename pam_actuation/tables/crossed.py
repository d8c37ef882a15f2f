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

"""Columns of a file that were taken for one another: of another muscle, or of a command."""

from collections.abc import Iterator, Mapping

import numpy as np
from pam_actuation.tables.mapping import ColumnMap
from pam_actuation.tables.plausible import Doubt
from pam_actuation.tables.signals import BY_NAME, of_muscles
from pam_actuation.topics.table import topic_of
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.joint.parameters import SIDES

COMMANDS = ('pressure_command', 'ppr_voltage')      # a pressure follows them
LEAST_RISE_PA = 2e4                 # of a pressure that moves, and of one that is wanted
LAGS_S = np.arange(0.0, 0.51, 0.02)                 # of a valve behind its command
LEAST_EARLY_S, EARLY_LEFT = 0.05, 0.25              # before it; what that leaves of the rest
AGAINST, ALONG = -0.3, 0.7          # correlation of a pressure with a command
FEWEST = 50                         # values
MOST = 50_000                       # readings of a pressure that are compared, evenly chosen

Signals = Mapping[str, tuple[IntArray, FloatArray]]
# Stamps [ns] and values of a pressure [Pa], then those of a command.
Pair = tuple[IntArray, FloatArray, IntArray, FloatArray]


def crossed(signals: Signals, mapped: Mapping[str, ColumnMap]) -> list[Doubt]:
    """
    Return a doubt on each signal that seems to be another one.

    That is a measured signal that equals another signal of its quantity value by value, a
    pressure that falls where its command rises, and one that moves before its command.

    Parameters
    ----------
    signals : dict of str to tuple of ndarray
        Stamps [ns] and SI values by name of the signal, NaN where missing.
    mapped : dict of str to ColumnMap
        Where they come from.

    """
    equal = list(_equal_pairs(signals))
    said = [f'{_named(one, mapped)}: each value is that of {_named(other, mapped)}; is it '
            'measured, or the same column twice?' for one, other in equal]
    taken = {name for pair in equal for name in pair}
    return [Doubt(text) for text in (*said, *_against_command(signals, mapped, taken))]


def _named(name: str, mapped: Mapping[str, ColumnMap]) -> str:
    return f'{name} (column "{mapped[name].column}")'


def _equal_pairs(signals: Signals) -> Iterator[tuple[str, str]]:
    """Yield a measured signal and another one of its quantity with the same values."""
    names = [name for name in signals if not BY_NAME[name].is_rate]
    for place, one in enumerate(names):
        for other in names[place + 1:]:
            if BY_NAME[one].quantity != BY_NAME[other].quantity:
                continue
            measured = [name for name in (one, other)
                        if topic_of(BY_NAME[name].topic).is_measured]
            values = signals[one][1]
            if measured and np.isfinite(values).sum() >= FEWEST and np.ptp(
                    values[np.isfinite(values)]) > 0.0 and np.array_equal(
                    values, signals[other][1], equal_nan=True):
                yield measured[0], other if measured[0] == one else one


def _against_command(signals: Signals, mapped: Mapping[str, ColumnMap], taken: set[str]
                     ) -> Iterator[str]:
    """Yield a sentence on each pressure that falls where its command rises."""
    for place, names in of_muscles(signals).items():
        command = next((name for name in COMMANDS if name in names), '')
        pressure = f'{place}pressure'
        if not command or 'pressure' not in names or pressure in taken:
            continue
        pair = _pair(signals, pressure, f'{place}{command}')
        own = _correlation(pair)
        if pair is None or own is None:
            continue
        early_s = _early(pair, own)
        if early_s:
            yield (f'{_named(pressure, mapped)}: it moves {early_s:.2g} s before '
                   f'{_named(f"{place}{command}", mapped)}, its command; are their times of two '
                   'clocks, or is the command written late?')
            continue
        others = [f'{side}/{command}' for side in SIDES
                  if place and f'{side}/' != place and f'{side}/{command}' in signals]
        if others and own < -AGAINST and (
                _correlation(_pair(signals, pressure, others[0])) or 0.0) > ALONG:
            yield (f'{_named(pressure, mapped)}: it follows {_named(others[0], mapped)}, and not '
                   f'{_named(f"{place}{command}", mapped)}; are the columns exchanged?')
        elif own < AGAINST:
            yield (f'{_named(pressure, mapped)}: it falls where '
                   f'{_named(f"{place}{command}", mapped)} rises; are they of two muscles?')


def _early(pair: Pair, own: float) -> float:
    """
    Return how long a pressure moves before its command [s], 0 where it does not.

    The command that comes later tells much more of the pressure than those before.
    """
    found = {lag_s: _correlation(pair, np.array([-lag_s]))
             for lag_s in LAGS_S if lag_s >= LEAST_EARLY_S}
    early_s, best = max(((lag_s, one) for lag_s, one in found.items() if one is not None),
                        key=lambda pair: pair[1], default=(0.0, 0.0))
    is_early = best > ALONG and 1.0 - best**2 < EARLY_LEFT * (1.0 - max(own, 0.0)**2)
    return float(early_s) if is_early else 0.0


def _pair(signals: Signals, pressure: str, command: str) -> Pair | None:
    """Return a pressure and a command without what is missing; None where they tell nothing."""
    (stamp_ns, pressure_pa), (sent_ns, sent) = (
        (stamps[known], values[known]) for stamps, values in (signals[pressure], signals[command])
        for known in [np.isfinite(values)])
    if min(len(stamp_ns), len(sent_ns)) < FEWEST or np.ptp(pressure_pa) < LEAST_RISE_PA:
        return None
    every = -(-len(stamp_ns) // MOST)
    return stamp_ns[::every], pressure_pa[::every], sent_ns, sent


def _correlation(pair: Pair | None, lags_s: FloatArray = LAGS_S) -> float | None:
    """Return the largest correlation of a pressure with a command before; None where open."""
    if pair is None:
        return None
    stamp_ns, pressure_pa, sent_ns, sent = pair
    found = []
    for lag_s in lags_s:
        place = np.searchsorted(sent_ns, stamp_ns - int(1e9 * lag_s), side='right') - 1
        there = place >= 0
        held = sent[place[there]]
        if there.sum() >= FEWEST and np.ptp(held) > 0.0 and np.ptp(pressure_pa[there]) > 0.0:
            found.append(float(np.corrcoef(pressure_pa[there], held)[0, 1]))
    return max(found, default=None)
