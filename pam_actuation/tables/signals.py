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
What a column of a table can be: a signal of the rig, with its topic and quantity.

A joint has an angle, and the signals of a muscle twice: ``flexor/pressure`` and
``extensor/pressure``.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
import re

from pam_actuation.tables.parts import name_of_parts, quantities_of
from pam_actuation.tables.units import (
    ANGLE, DUTY, FORCE, LENGTH, PRESSURE, RATE, SPEED, VOLTAGE)
from pam_sim.errors import did_you_mean, InputError
from pam_sim.joint.parameters import SIDES


@dataclass(frozen=True)
class Signal:
    """
    One signal that a recording can hold.

    Parameters
    ----------
    name : str
        As it is written in ``--map`` and in a mapping file.
    topic, field : str
        Where its values go: name of the topic below the muscle or the joint, and of the value.
    quantity : str
        What it measures (``tables/units.py``).
    words : str
        Regular expression of the names that other programs give such a column.
    meaning : str
        In a few words.

    """

    name: str
    topic: str
    field: str
    quantity: str
    words: str
    meaning: str

    @property
    def is_rate(self) -> bool:
        """Return whether it stands beside a position in one message, which may lack it."""
        return self.quantity in (SPEED, RATE)

    def is_named(self, words: str) -> bool:
        """Return whether the words of a column's name, in lower case, are those of the signal."""
        return re.fullmatch(self.words, words) is not None


_NO_WORDS = r'(?!)'                 # known by the name of an export, or stated
# Of two that fit a name the first counts.
SIGNALS = (
    Signal('supply_pressure', 'supply_pressure', 'pressure_pa', PRESSURE,
           r'(p |pressure )?supply( pressure)?|p ?s(upply)?|p(ressure)? (in|line)',
           'pressure of the supply'),
    Signal('pressure_command', 'pressure_command', 'pressure_pa', PRESSURE,
           r'(p|pressure) ?(ref|reference|set|setpoint|set point|cmd|command|des|desired|soll|'
           r'target)|(set|target|desired|ref|reference|command(ed)?) ?(p|pressure)',
           'wanted pressure of the muscle'),
    Signal('pressure', 'pressure', 'pressure_pa', PRESSURE,
           r'p|p(ressure)? ?(1|m|is|ist|act|actual|meas|measured|muscle|pam|sensor)?|press|'
           r'(muscle|measured|actual|pam) pressure|fluid pressure', 'pressure in the muscle'),
    Signal('reference', 'reference', 'contraction_m', LENGTH,
           r'(x|s|y|pos|position|contraction|stroke|displacement) ?(ref|reference|set|setpoint|'
           r'des|desired|soll|target|d)|reference|setpoint|ref|'
           r'(desired|target|reference) (position|contraction|displacement)',
           'wanted contraction'),
    Signal('contraction', 'contraction', 'contraction_m', LENGTH,
           r'(x|s|y|pos|position|contraction|stroke|displacement|disp|shortening|encoder)'
           r' ?(1|is|ist|act|actual|meas|measured|muscle|pam|sensor)?|'
           r'(measured|actual) (position|contraction|displacement)|strain|epsilon|'
           r'contraction (ratio|strain)', 'shortening of the muscle'),
    Signal('external_force', 'external_force', 'force_n', FORCE,
           r'(f ?ext|external force|disturbance( force)?)', 'disturbance on the load'),
    Signal('reference_force', 'reference', 'force_n', FORCE,
           r'(f|force) ?(ref|reference|set|setpoint|des|desired|target)', 'wanted force'),
    Signal('force', 'force', 'force_n', FORCE,
           r'f|f ?(1|x|z|m|meas|measured|is|ist)|'
           r'force ?(1|x|z|is|act|actual|meas|measured|sensor|cell)?|load ?cell|load|tension|'
           r'(measured|muscle|pam|actual) force', 'force along the muscle'),
    Signal('fill_duty', 'valve_signal', 'fill_duty', DUTY,
           r'(duty |d |pwm )?(fill|in|inlet|charge|supply)( valve)?( duty| pwm)?|'
           r'valve (fill|inlet|charge)( duty| pwm)?',
           'duty of the fill valve'),
    Signal('vent_duty', 'valve_signal', 'vent_duty', DUTY,
           r'(duty |d |pwm )?(vent|out|outlet|exhaust|discharge)( valve)?( duty| pwm)?|'
           r'valve (vent|outlet|exhaust|discharge)( duty| pwm)?',
           'duty of the vent valve'),
    Signal('ppr_voltage', 'valve_signal', 'ppr_voltage', VOLTAGE,
           r'u|u ?(ppr|valve|cmd|command|ctrl|control|soll)|v|v ?(ppr|valve|cmd|command|out)|'
           r'(ppr|(prop(ortional)? )?(valve|regulator)|command|control|analog out|dac|'
           r'ao) ?(voltage|volt|v|signal|u|cmd|command|set ?point|input)|'
           r'voltage ?(ppr|valve|cmd|command|out)?', 'voltage to the regulator'),
    Signal('contraction_velocity', 'contraction', 'velocity_m_per_s', SPEED, _NO_WORDS,
           'rate of the contraction'),
    Signal('reference_velocity', 'reference', 'velocity_m_per_s', SPEED, _NO_WORDS,
           'rate of the wanted contraction'),
)
ANGLES = (
    Signal('reference_angle', 'joint_reference', 'angle_rad', ANGLE,
           r'(joint |knee |elbow |ankle |hip )?(angle|theta|phi|q) ?(ref|reference|set|setpoint|'
           r'des|desired|soll|target|d)|(desired|target|reference) (joint |knee )?angle',
           'wanted angle'),
    Signal('angle', 'joint_state', 'angle_rad', ANGLE,
           r'(joint |knee |elbow |ankle |hip |measured |actual )?(angle|theta|phi|q)'
           r' ?(1|is|ist|act|actual|meas|measured|joint|knee)?', 'angle of the joint'),
    Signal('reference_angle_rate', 'joint_reference', 'rate_rad_per_s', RATE, _NO_WORDS,
           'rate of the wanted angle'))
JOINT_SIGNALS = (*ANGLES, *(
    replace(one, name=f'{side}/{one.name}', topic=f'{side}/{one.topic}',
            meaning=f'{one.meaning}, {side}')
    for side in SIDES for one in SIGNALS if one.topic != 'reference'))
BY_NAME = {signal.name: signal for signal in (*SIGNALS, *JOINT_SIGNALS)}
ALLOWED = (f'{", ".join(one.name for one in SIGNALS)}; of a joint '
           f'{" and ".join(one.name for one in ANGLES)}, and those of a muscle after '
           f'{" or ".join(f"{side}/" for side in SIDES)}')
# Words that other programs have for the sides.
_SIDE_WORDS = {'flexor': 'flexor', 'flex': 'flexor', 'agonist': 'flexor', 'ago': 'flexor',
               'extensor': 'extensor', 'antagonist': 'extensor', 'antago': 'extensor'}
_TIME = re.compile(
    r't|(measured )?time( of day)?|t ?(nominal|rel|s)|time ?stamp|stamp( time)?|'
    r'elapsed( time)?|time elapsed|timer|clock|seconds|sec|milli(s|seconds)|micro(s|seconds)|'
    r'date ?time|time date|date')
_BETWEEN = {'and', 'und', 'en', 'et', 'y', 'e', 'i', 'a', 'og', 'och', 'ja', 'és', 'și', 've', 'и',
            'de', 'du', 'der', 'del', 'di', 'do', '&', '+'}


def is_time(words: str) -> bool:
    """Return whether the words of a name, in English and lower case, mean a time or a date."""
    own = [word for word in words.split() if word not in _BETWEEN]
    return _TIME.fullmatch(words) is not None or (
        len(own) > 1 and 'time' in own and _TIME.fullmatch(' '.join(own)) is not None)


def signal_of(name: str, where: str) -> Signal:
    """Return a signal by its name; InputError names those there are."""
    if name not in BY_NAME:
        of_topic = [one.name for one in SIGNALS if one.topic == name]
        hint = (f' but a topic: {" or ".join(of_topic)}' if of_topic
                else did_you_mean(name, BY_NAME))
        raise InputError(f'{name!r} is no signal of a rig{hint}; allowed: {ALLOWED}', where)
    return BY_NAME[name]


def of_words(words: str, path: str = '', unit: str = '') -> Signal | None:
    """
    Return the signal that a name means, None where it means none.

    Parameters
    ----------
    words : str
        Of the name, in lower case.
    path : str
        What stands before it, such as ``/knee/flexor``.
    unit : str
        Unit that is stated, which tells a setpoint in V from one in mm; '' where none is.

    """
    sides = {_SIDE_WORDS[word] for word in re.split(r'[\W_]+', f'{path.lower()} {words}')
             if word in _SIDE_WORDS}
    if not sides:
        return _single(words, unit)
    own = ' '.join(word for word in words.split() if word not in _SIDE_WORDS)
    single = _single(own, unit)
    if single is None or len(sides) > 1:
        return None
    return BY_NAME.get(f'{sides.pop()}/{single.name}')


def _single(words: str, unit: str) -> Signal | None:
    """Return the signal that the words mean, by the name as a whole, else by its parts."""
    whole = next((one for one in (*SIGNALS, *ANGLES) if one.is_named(words)), None)
    quantities = quantities_of(unit)
    if whole is not None and (not quantities or whole.quantity in quantities):
        return whole
    name = name_of_parts(words, unit)
    return BY_NAME[name] if name else whole


def of_muscles(names: Iterable[str]) -> dict[str, set[str]]:
    """Return the signals of each muscle by its place, '' for a muscle alone, else ``flexor/``."""
    found: dict[str, set[str]] = {}
    for name in names:
        if BY_NAME[name] not in ANGLES:
            side, slash, own = name.rpartition('/')
            found.setdefault(side + slash, set()).add(own)
    return found


def are_of_joint(names: Iterable[str]) -> bool:
    """Return whether these are signals of a joint: an angle, or those of one of its muscles."""
    return any(BY_NAME[name] in JOINT_SIGNALS for name in names)
