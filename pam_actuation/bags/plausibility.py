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

import numpy as np

from pam_actuation.bags import codecs
from pam_sim.units import gauge_kpa, P_ATM_PA

MIN_RATE_HZ = 100.0
RATE_TOLERANCE = 0.98
GAP_LIMIT_S = 0.05                     # half of what makes a measurement invalid
RATE_TOPICS = ('pressure', 'contraction', 'force', 'valve_signal', 'pressure_command')
NEEDED_TOPICS = ('pressure', 'contraction', 'valve_signal')
OPTIONAL_TOPICS = ('force', 'supply_pressure', 'reference', 'pressure_command')
FUTURE_LIMIT_NS = 20_000_000           # a measurement stamped further ahead is invalid
LATE_LIMIT_NS = 100_000_000            # and one older than this
ATMOSPHERE_MARGIN_PA = 5e3             # sensor offset and weather
MUSCLE_LENGTH_M = 0.300                # DMSP-5-300
MAX_CONTRACTION = 0.25                 # of the length, data sheet limit
CONTRACTION_MARGIN_M = 1e-3
MAX_GAUGE_PA = 800e3
MAX_VOLTAGE = 10.0


def topic_remarks(topic, info, stamp_ns, values):
    """
    Return sentences on one topic.

    Parameters
    ----------
    topic : TopicData
        Its messages and times.
    info : TopicInfo
        Its rate, gaps and stamp counts.
    stamp_ns : ndarray of int64
        Header stamps in file order.
    values : dict of str to ndarray
        SI values; empty for topics that are not a rig's.

    """
    if not values and info.type_name != codecs.TOPIC_TYPES['reference_trajectory']:
        return []
    remarks = _time_remarks(topic, info, stamp_ns)
    if topic.name.endswith('/controller_state'):
        # Internals may be undefined, such as the time since the tick before the first.
        return remarks
    # A reference that asks for a force says nothing of a contraction.
    asks_force = topic.name.endswith('/reference') and 'force_n' in values
    for name, column in values.items():
        if len(column) and (not asks_force or np.isfinite(column).any()):
            remarks += _value_remarks(topic.name, name, column)
    return remarks


def missing_topics(namespaces):
    """
    Return (remarks, notes): sentences on topics that are not there.

    Notes are harmless: topics that a rig need not have. ``namespaces`` maps
    each namespace to the set of its short names.
    """
    if not namespaces:
        return ['The bag has no messages on any topic of a muscle.'], []
    remarks, notes = [], []
    for namespace, present in sorted(namespaces.items()):
        needed = [name for name in NEEDED_TOPICS if name not in present]
        optional = [name for name in OPTIONAL_TOPICS if name not in present]
        if needed:
            remarks.append(
                f'{namespace or "/"} has no messages on {", ".join(needed)}: most analyses '
                'need them.')
        if optional:
            notes.append(f'{namespace or "/"} has no messages on {", ".join(optional)}.')
    return remarks, notes


def _time_remarks(topic, info, stamp_ns):
    remarks = []
    name, short = topic.name, topic.name.rsplit('/', 1)[-1]
    if info.stamps_backward:
        remarks.append(f'{name}: the header stamp goes back {info.stamps_backward} times.')
    if info.stamps_repeated:
        remarks.append(f'{name}: {info.stamps_repeated} messages repeat a header stamp.')
    if short in RATE_TOPICS and info.rate_hz is not None and info.rate_hz < (
            RATE_TOLERANCE * MIN_RATE_HZ):
        remarks.append(
            f'{name}: {info.rate_hz:.1f} Hz is below {MIN_RATE_HZ:.0f} Hz.')
    if info.gaps and short in RATE_TOPICS and info.max_gap_s > GAP_LIMIT_S:
        remarks.append(
            f'{name}: {info.gaps} gaps, the longest {1e3 * info.max_gap_s:.0f} ms at '
            f'{info.rate_hz:.0f} Hz.')
    if len(stamp_ns) == len(topic.log_time_ns) and len(stamp_ns):
        remarks += _clock_remarks(name, topic.log_time_ns - stamp_ns)
    return remarks


def _clock_remarks(name, delay_ns):
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


def _value_remarks(topic, name, column):
    finite = column[np.isfinite(column)]
    remarks = []
    bad = len(column) - len(finite)
    if bad and not (name == 'velocity_m_per_s' and not len(finite)):
        remarks.append(f'{topic}: {bad} values of {name} are not finite.')
    if not len(finite):
        return remarks
    low, high = float(finite.min()), float(finite.max())
    if name == 'pressure_pa':
        remarks += _pressure_remarks(topic, finite, low, high)
    elif name == 'contraction_m' and (
            low < -CONTRACTION_MARGIN_M
            or high > MAX_CONTRACTION * MUSCLE_LENGTH_M + CONTRACTION_MARGIN_M):
        remarks.append(
            f'{topic}: contraction from {1e3 * low:.1f} to {1e3 * high:.1f} mm leaves 0 to '
            f'{1e3 * MAX_CONTRACTION * MUSCLE_LENGTH_M:.0f} mm (25 % of a 300 mm muscle).')
    elif name in ('fill_duty', 'vent_duty') and (low < 0.0 or high > 1.0):
        remarks.append(f'{topic}: {name} from {low:.3g} to {high:.3g} leaves 0 to 1.')
    elif name == 'ppr_voltage' and (low < 0.0 or high > MAX_VOLTAGE):
        remarks.append(f'{topic}: {name} from {low:.3g} to {high:.3g} V leaves 0 to 10 V.')
    return remarks


def _pressure_remarks(topic, finite, low, high):
    below = int((finite < P_ATM_PA - ATMOSPHERE_MARGIN_PA).sum())
    if below and float(np.median(finite)) < P_ATM_PA:
        return [
            f'{topic}: mostly below atmospheric pressure (median '
            f'{1e-3 * float(np.median(finite)):.1f} kPa): is it gauge pressure? The topic is '
            'absolute, in Pa.']
    if below:
        return [
            f'{topic}: {below} values below atmospheric pressure, down to '
            f'{gauge_kpa(low):.1f} kPa gauge.']
    if high > P_ATM_PA + MAX_GAUGE_PA:
        return [f'{topic}: up to {gauge_kpa(high):.0f} kPa gauge, more than the muscle stands.']
    return []
