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

"""Whether the values of a mapped column can be what the user says, with the fix in words."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from pam_actuation.bags.oddities import silent_remarks
from pam_actuation.bags.plausibility import (
    GAUGE_HINT, Implausible, SHARE_HINT, Size, value_findings)
from pam_actuation.bags.sensor_faults import course_remarks
from pam_actuation.tables.converter import converter_end
from pam_actuation.tables.guess import is_thin_air
from pam_actuation.tables.lengths import LEAST_KEPT
from pam_actuation.tables.mapping import ColumnMap
from pam_actuation.tables.parts import kind_of_pressure
from pam_actuation.tables.signals import BY_NAME, of_muscles, Signal
from pam_actuation.tables.units import (
    ABSOLUTE, ANGLE, DUTY, FORCE, GAUGE, LENGTH, names_of, of_output, PRESSURE, si_unit,
    unit_of_text)
from pam_actuation.tables.words import unit_in, words_of
from pam_actuation.topics.table import topic_of
from pam_sim.annotations import BoolArray, FloatArray, IntArray
from pam_sim.muscle.geometry import MOST_STRAIN
from pam_sim.units import EMPTY_PA, P_ATM_PA

LONGEST_STROKE = 0.5                 # of the length at rest: no muscle moves by more
FAR = 20.0                           # times the range of the others: no value of the rig
MUCH_PA, LITTLE = 2e5, 0.01         # a free muscle shortens by more of its length
MUCH_N = 8e3                         # the strongest muscle on sale pulls 6 kN
PUSH_N = 2.0                         # more than the zero of a load cell is off
SMALL_GAUGE_PA = 20e3                # no muscle moves below
FILLED_PA, TURNED_ROUND = 1e5, 0.5   # gauge; correlation of pressure and contraction
# Numbers by which programs say that there is none.
STAND_INS = {-9999.0, -999.0, -99.0, -99999.0, 9999.0, 99999.0, 999999.0, -32768.0, 32767.0,
             65535.0, 4294967295.0, 2147483647.0, -2147483648.0}
HUGE = 1e30
# Below, another unit is likely.
LEAST_MOVE = {PRESSURE: 200.0, LENGTH: 5e-5, FORCE: 0.2, ANGLE: 2e-3}
NEAR_ATMOSPHERE_PA = 5e3
MOST_SHARE = 1.0 + 1e-6              # of a column that holds 0 to 1
FEWEST_EMPTY = 3                     # values of an empty muscle
MOST_DROPPED = 0.1                   # of the values; more zeros are no sensor that drops out
DROP_STEPS = 1.5                     # times the largest other step: into a zero and out of it
FEWEST_HELD = 100                    # values of a muscle that is held
KEPT_SHARE = 0.03                    # of the length: more than friction and creep keep


@dataclass(frozen=True)
class Doubt:
    """A sentence on a signal; with ``is_wrong`` the values cannot be what the mapping says."""

    sentence: str
    is_wrong: bool = False


def doubts(signals: Mapping[str, tuple[IntArray, FloatArray]], mapped: Mapping[str, ColumnMap],
           size: Size) -> list[Doubt]:
    """
    Return what is doubtful in the signals of a recording.

    Parameters
    ----------
    signals : dict of str to tuple of ndarray
        Stamps [ns] and SI values by name of the signal, NaN where missing.
    mapped : dict of str to ColumnMap
        Where they come from.
    size : Size
        Of the muscle, for its largest contraction.

    """
    found, whole = [], dict(signals)
    heard: dict[str, IntArray] = {}
    for name, (stamp_ns, column) in signals.items():
        signal, finite = BY_NAME[name], column[np.isfinite(column)]
        said = f'{name} (column "{mapped[name].column}" in {mapped[name].unit.name})'
        if not len(finite):
            found.append(Doubt(f'{said} holds no number', True))
            continue
        heard[signal.topic] = stamp_ns[np.isfinite(column)]
        dropped = _dropped(mapped[name], column)
        if dropped.any():
            found.append(Doubt(
                f'{said}: {int(dropped.sum())} of {len(column)} values are 0, and the signal '
                'jumps there or back; if the sensor drops out, write '
                f'{replace(mapped[name], missing=0.0).option(name)}'))
            finite = column[np.isfinite(column) & ~dropped]
            whole[name] = stamp_ns, np.where(dropped, np.nan, column)
        of_values = _of_values(signal, mapped[name], finite, size)
        found += [Doubt(f'{said}: {one.sentence}', one.is_wrong) for one in of_values]
        if topic_of(signal.topic).is_measured and not any(one.is_wrong for one in of_values):
            found += [Doubt(f'{said}: {text.rstrip(".")}')
                      for text in course_remarks(signal.field, *whole[name])]
    found += [Doubt(text.rstrip('.')) for text in silent_remarks(heard)]
    for place, names in of_muscles(signals).items():
        if {'pressure', 'contraction'} <= names:
            own = {name: whole[f'{place}{name}'] for name in names}
            read = {name: mapped[f'{place}{name}'] for name in names}
            # A zero would make a held length 0.
            doubt = None if held_at_m(own['contraction'][1], size) is not None else (
                _held(place, own, read, size) or _zero(place, own, read, size))
            found += [doubt] if doubt is not None else []
    return found


def missing_values(signals: Mapping[str, tuple[IntArray, FloatArray]],
                   mapped: Mapping[str, ColumnMap]) -> list[Doubt]:
    """Return a doubt on each signal with missing values; parameters are those of ``doubts``."""
    counts = {name: (int((~np.isfinite(column)).sum()), len(column))
              for name, (_, column) in signals.items()}
    return [Doubt(f'{name} (column "{mapped[name].column}" in {mapped[name].unit.name}): '
                  f'{lost} of {rows} values are missing and were left out')
            for name, (lost, rows) in counts.items() if 0 < lost < rows]


def _dropped(mapped: ColumnMap, column: FloatArray) -> BoolArray:
    """Return where a sensor drops out: zeros for a while, a long step from all other values."""
    raw = _raw(mapped, column)
    is_zero = np.abs(raw) < 1e-9 * max(1.0, abs(mapped.zero))
    others = np.flatnonzero(np.isfinite(raw) & ~is_zero)
    if not len(others):
        return is_zero & False
    if mapped.zero == 0.0:                                  # a rig may begin and end at rest
        is_zero[:others[0]] = is_zero[others[-1]:] = False
    at_edge = is_zero[1:] != is_zero[:-1]
    steps = np.abs(np.diff(raw))
    usual = steps[~at_edge & np.isfinite(steps)].max(initial=0.0)
    is_apart = at_edge.any() and raw[others].min() * raw[others].max() > 0.0 and (
        np.nanmin(steps[at_edge]) > DROP_STEPS * usual)
    return is_zero & bool(is_apart and is_zero.mean() <= MOST_DROPPED)


def held_at_m(contraction_m: FloatArray, size: Size) -> float | None:
    """
    Return the contraction at which a muscle is held [m], None where it moves.

    It is held where noise alone moves the contraction. Where the rig holds its muscle, the
    frame may give way.

    Parameters
    ----------
    contraction_m : ndarray
        NaN where missing.
    size : Size
        Of the muscle.

    """
    finite = contraction_m[np.isfinite(contraction_m)]
    if len(finite) < FEWEST_HELD or np.ptp(finite) >= LITTLE * size.length_m:
        return None
    is_noise = 0.0 < np.var(finite) < np.var(np.diff(finite))
    return float(np.median(finite)) if is_noise or size.is_held else None


def _held(place: str, signals: Mapping[str, tuple[IntArray, FloatArray]],
          mapped: Mapping[str, ColumnMap], size: Size) -> Doubt | None:
    """Return a doubt on a muscle that hardly moves under much pressure, None without."""
    both = [signals[name][1] for name in ('pressure', 'contraction')]
    if not all(np.isfinite(column).any() for column in both):
        return None
    risen_pa, moved_m = (float(np.nanmax(column) - np.nanmin(column)) for column in both)
    if risen_pa < MUCH_PA or not LEAST_MOVE[LENGTH] <= moved_m < LITTLE * size.length_m:
        return None
    one = mapped['contraction']
    return Doubt(
        f'{place}contraction (column "{one.column}" in {one.unit.name}): it moves by '
        f'{1e3 * moved_m:.3g} mm only while the pressure moves by {1e-3 * risen_pa:.0f} kPa; is '
        'the unit right, or is the muscle held?')


def _zero(place: str, signals: Mapping[str, tuple[IntArray, FloatArray]],
          mapped: Mapping[str, ColumnMap], size: Size) -> Doubt | None:
    """
    Return a doubt on a contraction that an empty muscle keeps, None without.

    It is certain where the contraction falls as the pressure rises, unless the rig gives it.
    """
    (own_ns, pressure_pa), (stamp_ns, contraction_m) = signals['pressure'], signals['contraction']
    known = np.isfinite(pressure_pa)
    if not known.any():
        return None
    # Each signal has times of its own, in a bag and in files that are read together.
    pressure_pa = np.interp(stamp_ns, own_ns[known], pressure_pa[known], np.inf, np.inf)
    empty = contraction_m[(pressure_pa < P_ATM_PA + EMPTY_PA) & np.isfinite(contraction_m)]
    if len(empty) < FEWEST_EMPTY:
        return None
    at_rest_m, one = float(np.median(empty)), mapped['contraction']
    if at_rest_m < KEPT_SHARE * size.length_m:
        return None
    said = f'{place}contraction (column "{one.column}" in {one.unit.name}): it is '
    said += f'{1e3 * at_rest_m:.3g} mm while the muscle is empty'
    zero = replace(one, zero=float(f'{float(_raw(one, np.array([at_rest_m]))[0]):.4g}'))
    filled_m = _when_filled_m(pressure_pa, contraction_m)
    if not size.is_held and at_rest_m - filled_m > KEPT_SHARE * size.length_m:
        zero = replace(zero, gain=-zero.gain)
        return Doubt(f'{said}, and falls to {1e3 * filled_m:.3g} mm under pressure, which '
                     'shortens a muscle; if it counts the other way, write '
                     f'{zero.option(f"{place}contraction")}', True)
    return Doubt(f'{said}; is the zero off? Then write {zero.option(f"{place}contraction")}')


def _when_filled_m(pressure_pa: FloatArray, contraction_m: FloatArray) -> float:
    """
    Return the median contraction above half of the largest gauge pressure [m].

    Parameters
    ----------
    pressure_pa : ndarray
        Absolute, shape (rows,); not finite where it is not known.
    contraction_m : ndarray
        At the same times; NaN where missing.

    Returns
    -------
    float
        NaN where no muscle moves by the pressure, or the contraction does not follow it down.

    """
    both = np.isfinite(pressure_pa) & np.isfinite(contraction_m)
    gauge_pa, moved_m = pressure_pa[both] - P_ATM_PA, contraction_m[both]
    if not len(gauge_pa) or gauge_pa.max() < FILLED_PA or not np.ptp(moved_m) or (
            float(np.corrcoef(gauge_pa, moved_m)[0, 1]) > -TURNED_ROUND):
        return float('nan')
    return float(np.median(moved_m[gauge_pa > 0.5 * gauge_pa.max()]))


def _of_values(signal: Signal, mapped: ColumnMap, finite: FloatArray, size: Size
               ) -> list[Doubt]:
    """Return the doubts on one signal by itself; the first that is certain stands alone."""
    wrong = value_findings('', signal.field, finite, lambda: size)
    certain = _apart(mapped, finite) or _impossible(signal, mapped, finite, size, wrong)
    if certain is not None:
        return [certain]
    # What the stated unit rules out.
    no_hint = SHARE_HINT if mapped.unit.factor != 1.0 else ''
    no_gauge = GAUGE_HINT if mapped.unit.name.endswith(GAUGE) else ''
    found = [Doubt(one.sentence.partition(': ')[2].removesuffix(no_hint).removesuffix(
        no_gauge).rstrip('.') + _longer(signal, finite, size)
                   + _thin_air(signal, mapped, finite)) for one in wrong]
    if finite.min() == finite.max() and not signal.is_rate:
        return [*found, Doubt(f'the value never changes ({_shown(signal, float(finite.min()))}): '
                              'is the sensor connected?')]
    looks = (_hardly_moves, _pulls_much, _pushes, _moves_no_muscle, _gauge_or_absolute,
             _other_unit, _is_a_share, _at_the_end)
    return [*found, *(Doubt(said) for look in looks
                      if (said := look(signal, mapped, finite, size)))]


def _impossible(signal: Signal, mapped: ColumnMap, finite: FloatArray, size: Size,
                wrong: Sequence[Implausible]) -> Doubt | None:
    """Return a doubt on values that no rig or no muscle has, None without."""
    low, high = float(finite.min()), float(finite.max())
    if any(one.unusable for one in wrong) or signal.quantity == LENGTH and (
            high - low > LONGEST_STROKE * size.length_m):
        return Doubt(f'{_shown(signal, low)} to {_shown(signal, high)}, which no rig has'
                     f'{_fix(signal, mapped, finite, size)}{_longer(signal, finite, size)}'
                     f'{_thin_air(signal, mapped, finite)}', True)
    turned = _turned(signal, mapped, finite, size) if (
        wrong and signal.quantity == LENGTH) else ''
    if turned:
        return Doubt(f'{_shown(signal, low)} to {_shown(signal, high)}, which no muscle '
                     f'shortens by; {turned}{_longer(signal, finite, size)}', True)
    return None


def _moves_too_little(signal: Signal, finite: FloatArray) -> bool:
    least = LEAST_MOVE.get(signal.quantity)
    return least is not None and float(finite.max()) - float(finite.min()) < least


# Each of these returns what is doubtful in the values of a signal, '' without.

def _hardly_moves(signal: Signal, mapped: ColumnMap, finite: FloatArray, size: Size) -> str:
    if not _moves_too_little(signal, finite):
        return ''
    moved = float(finite.max()) - float(finite.min())
    return (f'it moves by {_shown(signal, moved, difference=True)} only'
            f'{_fix(signal, mapped, finite, size)}')


def _pulls_much(signal: Signal, mapped: ColumnMap, finite: FloatArray, size: Size) -> str:
    most = max(float(finite.max()), -float(finite.min()))
    if signal.quantity != FORCE or most <= MUCH_N:
        return ''
    return (f'it reaches {_shown(signal, most)}, more than a muscle pulls'
            f'{_fix(signal, mapped, finite, size)}')


def _pushes(signal: Signal, mapped: ColumnMap, finite: FloatArray, size: Size) -> str:
    low, high = float(finite.min()), float(finite.max())
    if signal.name.rpartition('/')[2] != 'force' or not (
            float(np.median(finite)) < -PUSH_N and -low > FAR * high):
        return ''
    other = replace(mapped, gain=-mapped.gain)
    return (f'it is negative nearly throughout, down to {_shown(signal, low)}, and a pull is '
            f'positive; if it counts the other way, write {other.option(signal.name)}')


def _moves_no_muscle(signal: Signal, mapped: ColumnMap, finite: FloatArray, size: Size) -> str:
    high = float(finite.max())
    if _moves_too_little(signal, finite) or not _is_too_low(signal, high):
        return ''
    return (f'it reaches {_shown(signal, high)} only, at which no muscle moves'
            f'{_fix(signal, mapped, finite, size)}')


def _is_too_low(signal: Signal, highest: float) -> bool:
    """Return whether a pressure reaches atmosphere, and no muscle moves by it."""
    return signal.quantity == PRESSURE and P_ATM_PA < highest < P_ATM_PA + SMALL_GAUGE_PA


def _gauge_or_absolute(signal: Signal, mapped: ColumnMap, finite: FloatArray, size: Size) -> str:
    """Ask about a gauge pressure that ends where an absolute one does when vented."""
    if signal.quantity != PRESSURE or not mapped.unit.name.endswith(GAUGE) or (
            abs(float(finite.min()) - 2.0 * P_ATM_PA) >= NEAR_ATMOSPHERE_PA):
        return ''
    return ('it falls to 1 atmosphere gauge and never below: is it absolute? '
            f'Then write {mapped.unit.name.replace(GAUGE, ABSOLUTE)}')


def _other_unit(signal: Signal, mapped: ColumnMap, finite: FloatArray, size: Size) -> str:
    said = against(unit_in(mapped.column), mapped, signal.quantity)
    if not said and signal.quantity == PRESSURE:
        kind = kind_of_pressure(words_of(mapped.column))            # `Absolutdruck [bar]`
        said = '' if mapped.unit.name.endswith(kind) else kind
    return f'the name of the column says {said}' if said else ''


def _is_a_share(signal: Signal, mapped: ColumnMap, finite: FloatArray, size: Size) -> str:
    """Ask about a duty in % that is never more than 1, with which no valve opens."""
    share, raw = unit_of_text('1', DUTY), _raw(mapped, finite)
    if signal.quantity != DUTY or share is None or mapped.unit.name == share.name or (
            mapped.gain != 1.0 or mapped.zero != 0.0 or float(raw.max()) > MOST_SHARE):
        return ''
    return (f'it reaches {float(raw.max()):.3g} % only, at which no valve opens: is it a '
            f'share of 1? Then write {replace(mapped, unit=share).option(signal.name)}')


def _at_the_end(signal: Signal, mapped: ColumnMap, finite: FloatArray, size: Size) -> str:
    return converter_end(_raw(mapped, finite), mapped.zero) if mapped.gain != 1.0 else ''


def against(text: str, mapped: ColumnMap, quantity: str) -> str:
    """
    Return what a unit in the file says against the one that was stated, '' where they agree.

    Parameters
    ----------
    text : str
        The unit as the file writes it; '' without one.
    mapped : ColumnMap
        With a gain it holds what a sensor puts out, of which the file need not say the unit.
    quantity : str
        Of the signal.

    """
    if not text or mapped.gain != 1.0:
        return ''
    if output := of_output(text, quantity):
        return f'{text}; {output}'
    said, unit = unit_of_text(text, quantity), mapped.unit
    if said is None or said.factor == unit.factor and (
            not said.is_complete or said.offset == unit.offset):
        return ''
    return said.name


def _raw(mapped: ColumnMap, values: FloatArray) -> FloatArray:
    """Return SI values as they stand in the column."""
    return (values - mapped.unit.offset) / mapped.unit.factor / mapped.gain + mapped.zero


def _apart(mapped: ColumnMap, finite: FloatArray) -> Doubt | None:
    """Return a doubt on a number far from all others that stands for none, None without."""
    for extreme in (float(finite.min()), float(finite.max())):
        is_it = finite == extreme
        others = finite[~is_it]
        if 2 * is_it.sum() > len(finite) or len(others) < 10:
            continue
        span = float(others.max() - others.min())
        if float(np.abs(others - extreme).min()) <= FAR * max(span, 1e-12):
            continue
        raw = float(_raw(mapped, np.array([extreme]))[0])
        near = min(STAND_INS, key=lambda one: abs(one - raw))
        if abs(raw) > HUGE or abs(near - raw) <= 1e-6 * abs(near):
            shown = f'{raw:.10g}' if abs(raw) > HUGE else f'{near:.10g}'
            return Doubt(f'{int(is_it.sum())} values are {shown}, far from all others; if '
                         f'it stands for a missing value, add --missing {shown}', True)
    return None


def _turned(signal: Signal, mapped: ColumnMap, finite: FloatArray, size: Size) -> str:
    """Return how to read a length that is no contraction, '' where most values can be one."""
    middle, low, high = (float(one) for one in (
        np.median(finite), finite.min(), finite.max()))
    if 0.0 <= middle <= size.most_m:
        return ''
    sign = replace(mapped, gain=-mapped.gain)
    # Nobody stated how long the muscle is: it may be longer than the usual one.
    longer = size if size.known_by else size._replace(max_strain=MOST_STRAIN)
    if not value_findings('', signal.field, -finite, lambda: longer):
        return f'if it counts the other way, write {sign.option(signal.name)}'
    zero, least = (float(f'{one:.6g}') for one in _raw(mapped, np.array([high, low])))
    ways = []
    if low >= LEAST_KEPT * high:
        way = replace(mapped, zero=zero, gain=-mapped.gain)
        ways.append(f'if it is the length of the muscle, write {way.option(signal.name)}, with '
                    'its length at rest')
    if high - low <= size.most_m:
        ways.append('if only the zero is off, '
                    f'{replace(mapped, zero=least).option(signal.name)}')
    return '; '.join(ways) or 'look for the unit, zero and gain of the column'


def _longer(signal: Signal, finite: FloatArray, size: Size) -> str:
    """Return what helps where a length is judged by a muscle that nobody stated."""
    if signal.quantity != LENGTH or size.known_by == 'length' or finite.max() <= size.stroke_m:
        return ''
    return ('; if it is right, state `max_strain` under `muscle` in the file of the rig'
            if size.known_by else '; if the muscle is longer, name the file of its rig with --rig')


def _thin_air(signal: Signal, mapped: ColumnMap, finite: FloatArray) -> str:
    """Return how an absolute pressure measured high above the sea is read, '' for another."""
    unit = mapped.unit
    gauge = unit_of_text(unit.name.replace(ABSOLUTE, GAUGE), PRESSURE)
    if signal.quantity != PRESSURE or not unit.name.endswith(ABSOLUTE) or gauge is None or (
            not is_thin_air(finite, si_unit(PRESSURE))):
        return ''
    vented = float(f'{float(_raw(mapped, finite).min()):.4g}')
    way = replace(mapped, unit=gauge, zero=vented)
    return ('; if it reads that of a vented muscle high above the sea, write '
            f'{way.option(signal.name)}')


def _fix(signal: Signal, mapped: ColumnMap, finite: FloatArray, size: Size) -> str:
    """Return the unit in which the values would be plausible, with the option to write."""
    raw = (finite - mapped.unit.offset) / mapped.unit.factor
    fitting = []
    for name in names_of(signal.quantity):
        unit = unit_of_text(name, signal.quantity)
        if unit is None or name == mapped.unit.name:
            continue
        values = unit.to_si(raw)
        moved = float(values.max() - values.min())
        if not value_findings('', signal.field, values, lambda: size) and (
                moved >= 10.0 * LEAST_MOVE.get(signal.quantity, 0.0)) and (
                not _is_too_low(signal, float(values.max()))):
            fitting.append(replace(mapped, unit=unit))
    usual = [one for one in fitting if not one.unit.name.startswith(
        ('hPa', 'mbar', 'atm', 'mmHg', 'kgf/cm2', 'um', 'gf', 'cm'))] or fitting
    if not usual:
        return '; look for the unit, zero and gain of the column'
    return '; plausible would be ' + ' or '.join(one.option(signal.name) for one in usual[:3])


def _shown(signal: Signal, value: float, difference: bool = False) -> str:
    if signal.quantity == PRESSURE:
        return f'{1e-3 * value:.4g} kPa' if difference else (
            f'{1e-3 * (value - P_ATM_PA):.4g} kPa gauge')
    if signal.quantity == LENGTH:
        return f'{1e3 * value:.4g} mm'
    unit = {FORCE: 'N', ANGLE: 'rad', 'voltage': 'V'}.get(signal.quantity, '')
    return f'{value:.4g} {unit}'.strip()
