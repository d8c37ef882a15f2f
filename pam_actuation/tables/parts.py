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
Which signal the parts of a name mean, where the name as a whole is none that is known.

A name says what is measured, such as `force`, and more on it, such as `pull`. It means a signal
only where every word of it is known: a `spring force` is no force of the muscle.
"""

from pam_actuation.tables.languages import plain
from pam_actuation.tables.units import (
    ANGLE, bare, DUTY, FACTORS, FORCE, is_output, LENGTH, PRESSURE, unit_of_text, VOLTAGE)

# What is measured.
_HEADS = {
    'pressure': PRESSURE, 'press': PRESSURE, 'p': PRESSURE,
    'force': FORCE, 'f': FORCE, 'loadcell': FORCE,
    'contraction': LENGTH, 'displacement': LENGTH, 'position': LENGTH, 'stroke': LENGTH,
    'shortening': LENGTH, 'disp': LENGTH, 'pos': LENGTH, 'x': LENGTH,
    'voltage': VOLTAGE, 'u': VOLTAGE, 'angle': ANGLE}
# Words of several meanings, of which the unit chooses: `tension` is a voltage in French.
_HEADS_BY_UNIT = {
    'tension': {FORCE, VOLTAGE}, 'effort': {FORCE}, 'last': {FORCE}, 'load': {FORCE},
    'course': {LENGTH}, 'travel': {LENGTH}, 'v': {VOLTAGE}}
_SHARES = {'duty': DUTY, 'pwm': DUTY}
_LENGTHS = {'length', 'l', 'len'}
_FILLERS = set('the of a an de del der des die das du di da do la le el il lo les los en et am im '
               'in vom von an auf al am for to from pour para per fur at on'.split())
_WANTED = {'soll', 'reference', 'ref', 'setpoint', 'set', 'target', 'desired', 'wanted',
           'command', 'cmd', 'commanded', 'control', 'ctrl'}
_RAW, _FILTERED = {'raw'}, {'filtered', 'filt', 'filter', 'smoothed', 'smooth', 'lowpass'}
_ACTUAL = {'measured', 'meas', 'actual', 'act', 'is', 'ist', 'sensor', 'cell', 'transducer',
           *_RAW, *_FILTERED}
_SUPPLY, _EXTERNAL = {'supply', 'line', 'inlet'}, {'external', 'ext', 'disturbance'}
_REGULATOR = {'regulator', 'valve', 'ppr', 'proportional', 'prop'}
_OF_MUSCLE = {'muscle', 'pam', 'value', 'signal', '1'}
# What more may be said of a quantity without it being another.
_KNOWN = {
    PRESSURE: {'inner', 'internal', 'inside', 'chamber', 'gauge', 'relative', 'absolute', 'abs',
               'fluid', 'point'},
    FORCE: {'pull', 'pulling', 'tensile', 'tension', 'axial', 'cable', 'rope', 'load', 'point'},
    LENGTH: {'linear', 'encoder', 'point'}, VOLTAGE: {'analog', 'point'},
    ANGLE: {'joint', 'knee', 'elbow', 'ankle', 'hip'}}
_WANTED_NAMES = {PRESSURE: 'pressure_command', FORCE: 'reference_force', LENGTH: 'reference',
                 VOLTAGE: 'ppr_voltage', ANGLE: 'reference_angle'}
_NAMES = {PRESSURE: 'pressure', FORCE: 'force', LENGTH: 'contraction', VOLTAGE: 'ppr_voltage',
          ANGLE: 'angle'}
# What says too little to be read: a `Seilzug` is the pull of a cable, or a draw wire.
_VAGUE = {'pull': (FORCE, LENGTH), 'cable': (FORCE, LENGTH), 'wire': (FORCE, LENGTH),
          'length': (LENGTH,), 'encoder': (LENGTH,), 'pot': (LENGTH,), 'potentiometer': (LENGTH,),
          'stringpot': (LENGTH,), 'lvdt': (LENGTH,), 'laser': (LENGTH,)}
# Of other things than the muscle, however much they are called alike.
_OF_OTHERS = {'luft', 'umgebung', 'umgebungs', 'air', 'ambient', 'atmospheric', 'barometric',
              'baro', 'atm', 'room', 'raum'}


def quantities_of(unit: str) -> set[str]:
    """Return the quantities that the text of a unit can be of; none where it is not known."""
    return {one for one in FACTORS if unit and unit_of_text(unit, one) is not None}


def measured_by(words: str) -> set[str]:
    """Return the quantities that words such as `pressure` name, whatever else they say."""
    return {one for word in _said(words) if (one := _HEADS.get(word) or _SHARES.get(word))}


def name_of_parts(words: str, unit: str = '') -> str:
    """
    Return the name of the signal that all the words of a name mean together, '' for none.

    Parameters
    ----------
    words : str
        Of the column's name, in English and lower case.
    unit : str
        Unit that is stated, '' where none is.

    """
    said = _said(words)
    heads = _heads(said, unit)
    rest = said - heads.keys()
    wanted = bool(rest & _WANTED)
    quantities = set(heads.values())
    of_unit = quantities_of(unit)
    if not heads and wanted and len(of_unit & _WANTED_NAMES.keys()) == 1:
        quantities = of_unit & _WANTED_NAMES.keys()     # such as `setpoint regulator [V]`
    elif quantities == {PRESSURE} and wanted and VOLTAGE in of_unit:
        quantities = {VOLTAGE}                          # what a regulator is told
    elif len(heads) != 1 or of_unit and not quantities & of_unit:
        return ''
    quantity, = quantities
    known = _WANTED | _ACTUAL | _OF_MUSCLE | _KNOWN[quantity]
    if quantity in (PRESSURE, VOLTAGE) or not heads:
        known |= _REGULATOR
    if quantity == PRESSURE:
        known |= _SUPPLY
    if quantity == FORCE:
        known |= _EXTERNAL
    if rest - known:
        return ''
    return _chosen(quantity, rest, wanted)


def _chosen(quantity: str, rest: set[str], wanted: bool) -> str:
    """Return the signal of a quantity, '' where the words contradict one another."""
    actual, other = bool(rest & _ACTUAL), bool(rest & (_SUPPLY | _EXTERNAL))
    if wanted and (actual or other):
        return ''
    if quantity != VOLTAGE and rest & {'control', 'ctrl'}:
        return ''                   # of a pilot, wanted, or what is controlled
    if quantity == VOLTAGE:         # that of a sensor, an electrode or a converter is none
        is_told = bool(rest & (_WANTED | _REGULATOR) - {'reference', 'ref'})
        return 'ppr_voltage' if not rest or is_told and not actual else ''
    if wanted:
        return _WANTED_NAMES[quantity]
    if quantity == PRESSURE and rest & _REGULATOR:
        return ''                   # wanted, or what the regulator measures
    if other:
        return 'supply_pressure' if quantity == PRESSURE else 'external_force'
    return _NAMES[quantity]


def likely_signals(words: str, unit: str) -> list[str]:
    """
    Return the signals that a column may be although not all of its words are known.

    Its unit must be one of the quantity. That is for hints only, and nothing is read by it.
    """
    said = _said(words)
    if said & _OF_OTHERS:
        return []
    wanted = bool(said & _WANTED)
    names = _WANTED_NAMES if wanted else _NAMES
    of_unit = quantities_of(unit)
    vague = {one for word in said for one in _VAGUE.get(word, ())}
    quantities = set(_heads(said, unit).values()) & of_unit or {
        one for one in vague if one in of_unit or is_output(unit, one)}
    if said & (_WANTED | _REGULATOR):
        if VOLTAGE in of_unit:
            quantities = {VOLTAGE}
        elif not quantities and (bare(unit) == '%' or is_output(unit, PRESSURE)):
            return ['pressure_command']
    return sorted(names[one] for one in quantities)


def worked_on(words: str) -> int:
    """Return 0 for a signal as such, 1 for one that is called raw, 2 for a filtered one."""
    said = _said(words)
    return 2 if said & _FILTERED else int(bool(said & _RAW))


def is_length_of_muscle(words: str) -> bool:
    """Return whether a name means the length of the muscle: what its contraction is taken from."""
    said = _said(words)
    return len(said & _LENGTHS) == 1 and not said - _LENGTHS - _ACTUAL - _OF_MUSCLE


def kind_of_pressure(words: str) -> str:
    """Return 'gauge' or 'abs' where the words of a name say so, else ''."""
    said = _said(words)
    is_gauge, is_absolute = bool(said & {'gauge', 'relative'}), bool(said & {'absolute', 'abs'})
    return '' if is_gauge == is_absolute else 'gauge' if is_gauge else 'abs'


def _said(words: str) -> set[str]:
    own = {plain(word) for word in words.split()}
    return own if own <= _LENGTHS else own - _FILLERS


def _heads(said: set[str], unit: str) -> dict[str, str]:
    """Return the words that say what is measured, and what they mean with this unit."""
    heads = {word: _HEADS[word] for word in said if word in _HEADS}
    if heads:
        return heads
    of_unit = quantities_of(unit)
    return {word: fitting.pop() for word in said
            if len(fitting := _HEADS_BY_UNIT.get(word, set()) & of_unit) == 1}
