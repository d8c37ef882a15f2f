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

"""Sentences on what in a bag cannot be right, for people who look for the reason."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import NamedTuple, TYPE_CHECKING

import numpy as np

from pam_actuation.bags.rig_topics import side_of
from pam_actuation.bags.sensor_faults import course_remarks
from pam_actuation.topics.table import (
    BY_NAME, NEEDED, OF_A_RUN, OFTEN_EMPTY, RECORDED, RECORDED_OF_JOINT, short_name, Topic, USED)
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.muscle.geometry import MOST_STRAIN
from pam_sim.units import allowed_range, gauge_kpa, often, P_ATM_PA

if TYPE_CHECKING:
    from pam_actuation.bags.topic_info import TopicInfo
    from pam_sim.rig import Rig

SizeOf = Callable[[], 'Size']          # gives the size of the muscle, where that matters
# What judges the finite values of a column, their lowest and highest.
Check = Callable[[FloatArray, float, float, SizeOf], tuple[str, bool]]
MIN_RATE_HZ = 100.0
RATE_TOLERANCE = 0.98
GAP_LIMIT_S = 0.05                     # half of what makes a measurement invalid
FUTURE_LIMIT_NS = 20_000_000           # a measurement stamped further ahead is invalid
LATE_LIMIT_NS = 100_000_000            # and one older than this
ATMOSPHERE_MARGIN_PA = 5e3             # sensor offset and weather
MOST_ZERO_PA = 20e3                    # the zero of a sensor of 10 bar, 2 % of its range
MUSCLE_LENGTH_M = 0.300                # DMSP-5-300
MAX_CONTRACTION = 0.25                 # of the length, data sheet limit
CONTRACTION_MARGIN_M = 1e-3
MAX_GAUGE_PA = 800e3
MAX_VOLTAGE = 10.0
MEASURED = {'pressure_pa', 'contraction_m', 'force_n', 'angle_rad'}
LEAST_CHANGES, STEADY_SHARE = 100, 0.9        # of a sensor that is slower than its topic
LEAST_PA = 5e3                         # absolute: no rig has such a vacuum
MOST_PA = 1e7
LEAST_KPA = -200.0                     # gauge in kPa with noise; noise in Pa reaches further
MOST_SUPPLY_PA = 2e6                   # and no muscle is filled so far
_PRESSURE_UNITS = (
    (1.6, 'MPa', 'Multiply them by 1000000'), (16.0, 'bar', 'Multiply them by 100000'),
    (150.0, 'kPa or psi', 'Multiply kPa by 1000, psi by 6894.8'),
    (LEAST_PA, 'kPa', 'Multiply them by 1000'))
LEAST_LIMIT_M = 0.02                   # any muscle may shorten by this
MOST_M = 0.5                           # and none of the usual ones by this
MOST_N = 1e5
SHARE_HINT = ' A share of the length? Multiply it by the length then; the topic is in m.'
ZERO_HINT = (' If the muscle was as long as at rest then, the sensor has a zero: state '
             '`contraction_zero_m: unknown` under `tolerance` in the rig file.')
PSI_HINT = (' Is the unit right? psi that are taken for bar are 14.5 times too much, and kPa that '
            'are taken for psi 6.9 times.')
GAUGE_HINT = ' If it was not, is it gauge pressure? Add 101325 Pa then.'
# Of which only the times are looked at.
_WITHOUT_VALUES = {row.type_name for row in OF_A_RUN.values() if row.numeric is None}


@dataclass(frozen=True)
class Implausible:
    """A sentence on values that cannot be right; ``unusable`` values mean something else."""

    sentence: str
    unusable: bool = False


class Size(NamedTuple):
    """
    What tells how far a muscle may shorten.

    Parameters
    ----------
    length_m : float
        Length at rest.
    max_strain : float
        Largest contraction, as a fraction of it.
    known_by : {'', 'rig', 'length', 'any'}
        What says so: the rig, or the length alone; '' where it is taken for a DMSP-5-300, 'any'
        where no muscle on a rig shortens by more.
    simulated : bool
        Whether the values are of a simulation. A simulated muscle may be below the atmosphere.
    is_held : bool
        Whether the rig gives the contraction, as at a held length.

    """

    length_m: float = MUSCLE_LENGTH_M
    max_strain: float = MAX_CONTRACTION
    known_by: str = ''
    simulated: bool = False
    is_held: bool = False

    @property
    def stroke_m(self) -> float:
        """Return the largest contraction, m."""
        return self.max_strain * self.length_m

    @property
    def most_m(self) -> float:
        """Return what no muscle of this length shortens by, m."""
        return max(self.max_strain, MOST_STRAIN) * self.length_m

    @property
    def said(self) -> str:
        """Return where the largest contraction comes from, in words."""
        if self.known_by == 'any':
            return 'no muscle shortens by more'
        why = {'rig': ', by `max_strain` of its rig', 'length': ': none shortens by more'}
        return (f'{100.0 * self.max_strain:.3g} % of a {1e3 * self.length_m:.0f} mm muscle'
                f'{why.get(self.known_by, ", as no rig is stated")}')


def size_of_rig(rig: 'Rig') -> Size:
    """Return the size of the muscle of a rig."""
    return Size(rig.muscle.length_m, rig.muscle.max_strain, 'rig', is_held=rig.is_driven)


def recorded_size(metadata: Mapping[str, str]) -> Size:
    """
    Return the size of the muscle that a bag's rig tells, or what is known without one.

    The import of a table tells itself what is odd where no length is stated. So a bag of such a
    table may hold what any muscle shortens by.
    """
    from pam_sim import load_rig
    from pam_sim.errors import InputError
    origin = metadata.get('origin')
    try:
        size = size_of_rig(load_rig(metadata['rig']))
    except (InputError, KeyError):
        size = Size()
    size = size._replace(simulated='software_version' in metadata and not origin)
    if size.known_by or origin != 'imported':
        return size
    told = metadata.get('length_m')
    return Size(float(told or MOST_M / MOST_STRAIN), MOST_STRAIN, 'length' if told else 'any')


def topic_remarks(info: 'TopicInfo', stamp_ns: IntArray, received_ns: IntArray,
                  values: Mapping[str, FloatArray], size_of: SizeOf | None = None) -> list[str]:
    """
    Return sentences on one topic.

    Parameters
    ----------
    info : TopicInfo
        Its rate, gaps and stamp counts.
    stamp_ns, received_ns : ndarray of int64, shape (N,)
        Header stamps and receive times of its messages, by receive time.
    values : dict of str to ndarray
        SI values; empty for topics that are not a rig's.
    size_of : callable, optional
        As of ``value_findings``.

    """
    if not values and info.type_name not in _WITHOUT_VALUES:
        return []
    remarks = _time_remarks(info, stamp_ns, received_ns) + repeat_remarks(
        info.name, values, info.rate_hz)
    return remarks + [
        one.sentence for one in topic_findings(info.name, stamp_ns, values, size_of)]


def topic_findings(topic: str, stamp_ns: IntArray, values: Mapping[str, FloatArray],
                   size_of: SizeOf | None = None) -> list[Implausible]:
    """Return what cannot be right in the values of a topic, a list of Implausible."""
    row = BY_NAME.get(short_name(topic))
    # Internals may be undefined, such as the time since the tick before the first.
    if row is not None and row.internals:
        return []
    # A reference that asks for a force says nothing of a contraction.
    asks_force = topic.endswith('/reference') and 'force_n' in values
    findings = [found for name, column in values.items()
                if len(column) and (not asks_force or np.isfinite(column).any())
                for found in value_findings(topic, name, column, size_of)]
    if row is not None and row.is_measured and not any(one.unusable for one in findings):
        findings += [Implausible(f'{topic}: {text}') for name, column in values.items()
                     for text in course_remarks(name, stamp_ns, column)]
    return findings


def missing_topics(namespaces: Mapping[str, Collection[str]],
                   valve: str = '') -> tuple[list[str], list[str]]:
    """
    Return (remarks, notes): sentences on topics that are not there.

    A muscle of a joint has no reference of its own, and its contraction follows from the angle. A
    rig with a regulator has no supply pressure. They are not told as missing.

    Parameters
    ----------
    namespaces : mapping of str to collection of str
        The short names of the topics in each namespace.
    valve : {'', 'ppr', 'hsv'}
        Type of valve of the rig, empty where the bag does not say it.

    Returns
    -------
    remarks, notes : list of str
        Notes are harmless: topics that a rig need not have.

    """
    if not namespaces:
        return ['The bag has no messages on any topic of a muscle.'], []
    remarks, notes = [], []
    for namespace, present in sorted(namespaces.items()):
        if any(other.startswith(f'{namespace}/') for other in namespaces):
            continue        # a joint: its muscles have namespaces of their own
        expected = [row for row in _topics_of_muscle(namespace, namespaces)
                    if row.name not in present and (not valve or valve in row.valves)]
        needed, optional = ([row.name for row in expected if row.need == need]
                            for need in (NEEDED, USED))
        if 'valve_signal' in needed and 'pressure_command' in present and not valve:
            needed.remove('valve_signal')       # a regulator that takes pressures over a bus
            notes.append(f'{namespace or "/"} has no messages on valve_signal: pam gap and pam '
                         'identify take pressure_command for the input of a regulator.')
        if needed:
            remarks.append(
                f'{namespace or "/"} has no messages on {", ".join(needed)}: most analyses '
                'need them.')
        if optional:
            notes.append(f'{namespace or "/"} has no messages on {", ".join(optional)}.')
    return remarks, notes


def _topics_of_muscle(namespace: str, namespaces: Collection[str]) -> list[Topic]:
    """Return what a recording of a muscle can hold, alone or as one of the two of a joint."""
    side = side_of(namespace, namespaces)
    return [row for row in OF_A_RUN.values() if not side or (
        row.name != 'contraction' and f'{side}{row.name}' in RECORDED_OF_JOINT)]


def _time_remarks(info: 'TopicInfo', stamp_ns: IntArray, received_ns: IntArray) -> list[str]:
    remarks = []
    name, row = info.name, BY_NAME.get(short_name(info.name))
    steady = row is not None and row.steady
    if info.stamps_backward:
        remarks.append(f'{name}: the header stamp goes back {often(info.stamps_backward)}.')
    if info.stamps_repeated:
        remarks.append(f'{name}: {info.stamps_repeated} messages repeat a header stamp.')
    if steady and info.rate_hz is not None and info.rate_hz < (
            RATE_TOLERANCE * MIN_RATE_HZ):
        remarks.append(
            f'{name}: {info.rate_hz:.1f} Hz is below {MIN_RATE_HZ:.0f} Hz; pam gap takes 10 Hz '
            'and more, and sees less.')
    if info.gaps and steady and info.max_gap_s is not None and info.rate_hz is not None and (
            info.max_gap_s > GAP_LIMIT_S):
        remarks.append(
            f'{name}: {info.gaps} gaps, the longest {1e3 * info.max_gap_s:.0f} ms at '
            f'{info.rate_hz:.0f} Hz.')
    if len(stamp_ns):
        remarks += _clock_remarks(name, received_ns - stamp_ns)
    return remarks


def repeat_remarks(topic: str, values: Mapping[str, FloatArray],
                   rate_hz: float | None) -> list[str]:
    """
    Return a sentence on measured values that repeat: of a slow sensor that is sent too often.

    Changes come at a steady rate there. Those of a coarse encoder do as well at a steady speed,
    but all by one step.
    """
    remarks = []
    for column in (values[name] for name in MEASURED & values.keys()):
        at = np.flatnonzero(np.diff(column))
        if len(at) < LEAST_CHANGES or rate_hz is None:
            continue
        steps, held = np.abs(np.diff(column)[at]), np.diff(at)
        usual = np.median(held)
        if usual >= 2.0 and np.mean(held <= 2.0 * usual) > STEADY_SHARE and (
                np.median(steps) > 2.0 * steps.min()):
            remarks.append(
                f'{topic}: the value changes at {rate_hz / held.mean():.0f} Hz only, and each is '
                'sent several times. Send a value of a slow sensor once, stamped when it was '
                'measured.')
    return remarks


def _clock_remarks(name: str, delay_ns: IntArray) -> list[str]:
    ahead = int((delay_ns < -FUTURE_LIMIT_NS).sum())
    if ahead:
        return [
            f'{name}: {ahead} stamps lie in the future, up to '
            f'{-1e-9 * float(delay_ns.min()):.3g} s after the message was received.']
    usual_s = 1e-9 * float(np.median(delay_ns))
    if usual_s > 1e-9 * LATE_LIMIT_NS:
        return [
            f'{name}: stamps are usually {usual_s:.3g} s older than the receipt; sender and '
            'recorder have different clocks or the message was delayed.']
    return []


def value_findings(topic: str, name: str, column: FloatArray,
                   size_of: SizeOf | None = None) -> list[Implausible]:
    """
    Return what cannot be right in one column of values, a list of Implausible.

    Parameters
    ----------
    topic : str
        Full name, for the sentences.
    name : str
        Of the value, with its unit, such as ``pressure_pa``.
    column : ndarray
        As read, by log time or by stamp.
    size_of : callable, optional
        Gives the Size of the muscle; asked only where it matters.

    """
    finite = column[np.isfinite(column)]
    found = []
    bad = not_finite(topic, name, column)
    if bad:
        what = 'none' if not len(finite) else f'{len(finite)} of {len(column)}'
        found.append(Implausible(
            f'{topic}: {bad} values of {name} are not finite (nan or inf), {what} can be used; '
            'look for a sensor or converter that drops out.', not len(finite)))
    short = short_name(topic)
    check = _CHECKS.get((short, name)) or _CHECKS.get(name)
    limits = RECORDED[short].limits.get(name) if short in RECORDED else None
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    if len(finite) and limits is not None and not limits[0] <= low <= high <= limits[1]:
        found.append(Implausible(
            f'{topic}: {name} from {low:.4g} to {high:.4g} leaves '
            f'{allowed_range(*limits, name=name)}.'))
    if len(finite) and check is not None:
        sentence, unusable = check(finite, low, high, size_of or Size)
        if sentence:
            found.append(Implausible(f'{topic}: {sentence}', unusable))
    return found


def not_finite(topic: str, name: str, column: FloatArray) -> int:
    """
    Return how many values of a column are not finite, those not counted that may be left empty.

    Parameters are those of ``value_findings``.
    """
    row = BY_NAME.get(short_name(topic))
    if row is not None and name in row.optional:
        return int(np.isinf(column).sum())
    bad = int((~np.isfinite(column)).sum())
    return 0 if name in OFTEN_EMPTY and bad == len(column) else bad


def _unit(low: float, high: float, unit: str, likely: str, fix: str) -> tuple[str, bool]:
    """Return the sentence of a wrong unit; the numbers are told as they were read."""
    return (f'the values, {low:.4g} to {high:.4g}, cannot be {unit}: they are likely {likely}. '
            f'{fix}'), True


def _pressure(finite: FloatArray, low: float, high: float, size_of: SizeOf,
              is_supply: bool = False) -> tuple[str, bool]:
    """Return what is said of both ends; where one end tells of another unit, only that."""
    above = _above(finite, low, high, is_supply)
    below = _below(finite, low, high, size_of)
    if above[1] or below[1]:
        return above if above[1] else below
    return ' '.join(one for one, _ in (above, below) if one), False


def _above(finite: FloatArray, low: float, high: float, is_supply: bool) -> tuple[str, bool]:
    """Return what is said of pressures that are too high."""
    if high <= (MOST_SUPPLY_PA if is_supply else P_ATM_PA + MAX_GAUGE_PA):
        return '', False
    if float(np.median(finite)) > MOST_PA:
        return _unit(low, high, 'Pa', 'mPa, or Pa multiplied by 1000 once more',
                     'Divide them by 1000; the topic is absolute, in Pa.')
    if is_supply:
        return f'up to {gauge_kpa(high):.0f} kPa gauge, more than a supply has.{PSI_HINT}', False
    if float(np.quantile(finite, 0.99)) <= MOST_SUPPLY_PA:      # but for spikes
        return f'up to {gauge_kpa(high):.0f} kPa gauge, more than the muscle stands.', False
    return f'up to {gauge_kpa(high):.0f} kPa gauge, which no muscle stands.{PSI_HINT}', True


def _below(finite: FloatArray, low: float, high: float, size_of: SizeOf) -> tuple[str, bool]:
    """Return what is said of pressures that are too low."""
    if low >= P_ATM_PA - ATMOSPHERE_MARGIN_PA:
        return '', False
    usual = float(np.median(finite))
    # A spike must not hide the unit of the rest.
    largest = float(np.quantile(finite, 0.99))
    if 0.0 < largest < LEAST_PA and low > LEAST_KPA:
        likely, fix = next((text, fix) for limit, text, fix in _PRESSURE_UNITS
                           if largest < limit)
        return _unit(low, high, 'Pa absolute', likely,
                     f'{fix}, and add 101325 Pa if they are gauge; the topic is absolute, in Pa.')
    if size_of().simulated:
        return '', False        # absolute, by whoever wrote it
    below = int((finite < P_ATM_PA - ATMOSPHERE_MARGIN_PA).sum())
    # A muscle may be vented most of the time, and its sensor have a zero.
    if usual < P_ATM_PA and not (low >= P_ATM_PA - MOST_ZERO_PA and largest > P_ATM_PA):
        return (
            f'mostly below atmospheric pressure (median {1e-3 * usual:.1f} kPa): is it gauge '
            'pressure? Add 101325 Pa then; the topic is absolute, in Pa.'), True
    is_gauge = abs(float(np.quantile(finite, 0.01))) < ATMOSPHERE_MARGIN_PA
    hint = ('They are likely gauge pressure: add 101325 Pa.' if is_gauge else
            'No muscle is evacuated so far. Is it gauge pressure? Add 101325 Pa then; or did the '
            'sensor drop out?' if low < 0.5 * P_ATM_PA else
            'If the muscle was vented then, the sensor has a zero: state '
            '`pressure_zero_pa: unknown` under `tolerance` in the rig file.' + GAUGE_HINT)
    return (f'{below} values below atmospheric pressure, down to {gauge_kpa(low):.1f} kPa '
            f'gauge. {hint}'), is_gauge


def _supply(finite: FloatArray, low: float, high: float, size_of: SizeOf) -> tuple[str, bool]:
    return _pressure(finite, low, high, size_of, is_supply=True)


def _contraction(finite: FloatArray, low: float, high: float,
                 size_of: SizeOf) -> tuple[str, bool]:
    if low >= -CONTRACTION_MARGIN_M and high <= LEAST_LIMIT_M:
        return '', False
    size = size_of()
    if low >= -CONTRACTION_MARGIN_M and high <= size.stroke_m + CONTRACTION_MARGIN_M:
        return '', False
    largest = float(np.quantile(np.abs(finite), 0.99))
    if largest > MOST_M and largest > 2.0 * size.length_m:
        likely, factor = ('micrometres', 1e6) if largest > 1e3 else ('millimetres', 1e3)
        return _unit(low, high, 'metres', likely,
                     f'Divide them by {factor:g}; the topic is in m.')
    hint = ''
    if largest > (size.most_m if size.known_by else size.stroke_m) and high <= MOST_STRAIN:
        hint = SHARE_HINT
    elif low < -CONTRACTION_MARGIN_M and float(np.median(finite)) < -CONTRACTION_MARGIN_M:
        hint = ' Is the sign turned round, or the zero not set? Shortening is positive.'
    elif low < -CONTRACTION_MARGIN_M and high <= size.stroke_m + CONTRACTION_MARGIN_M:
        hint = ZERO_HINT
    return (f'contraction from {1e3 * low:.1f} to {1e3 * high:.1f} mm leaves 0 to '
            f'{1e3 * size.stroke_m:.0f} mm ({size.said}).{hint}'), False


def _force(finite: FloatArray, low: float, high: float, size_of: SizeOf) -> tuple[str, bool]:
    if max(-low, high) < MOST_N:
        return '', False
    return _unit(low, high, 'N', 'mN', 'Divide them by 1000; the topic is in N.')


def _duty(finite: FloatArray, low: float, high: float, size_of: SizeOf) -> tuple[str, bool]:
    if low >= 0.0 and high <= 1.0:
        return '', False
    if low >= 0.0 and 1.5 < high <= 100.0:
        return _unit(low, high, 'a duty of 0 to 1', 'per cent', 'Divide them by 100.')
    return f'a duty from {low:.3g} to {high:.3g} leaves 0 to 1.', False


def _voltage(finite: FloatArray, low: float, high: float, size_of: SizeOf) -> tuple[str, bool]:
    if low >= 0.0 and high <= MAX_VOLTAGE:
        return '', False
    if low >= 0.0 and 1e2 < high <= 1e3 * MAX_VOLTAGE:
        return _unit(low, high, 'volts', 'millivolts', 'Divide them by 1000.')
    return f'{low:.3g} to {high:.3g} V leaves 0 to 10 V.', False


_CHECKS: dict[str | tuple[str, str], Check] = {
    ('supply_pressure', 'pressure_pa'): _supply, 'pressure_pa': _pressure,
    'contraction_m': _contraction, 'force_n': _force, 'fill_duty': _duty, 'vent_duty': _duty,
    'ppr_voltage': _voltage}
