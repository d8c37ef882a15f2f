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

"""Units in which other programs write pressures, lengths, forces, signals and times."""

from dataclasses import dataclass
import math
import re

from pam_sim.annotations import FloatArray
from pam_sim.errors import did_you_mean, InputError
from pam_sim.units import INCH_M, KGF_N, LBF_N, P_ATM_PA, PSI_PA

PRESSURE, LENGTH, FORCE, VOLTAGE, DUTY, ANGLE, TIME, SPEED, RATE = (
    'pressure', 'length', 'force', 'voltage', 'duty', 'angle', 'time', 'speed', 'angular rate')
# Size of one unit in SI, by quantity. mmHg as NIST SP 811 has it.
FACTORS: dict[str, dict[str, float]] = {
    PRESSURE: {'Pa': 1.0, 'hPa': 1e2, 'mbar': 1e2, 'kPa': 1e3, 'bar': 1e5, 'MPa': 1e6,
               'psi': PSI_PA, 'atm': P_ATM_PA, 'mmHg': 133.322387415,
               'kgf/cm2': 98066.5},
    LENGTH: {'m': 1.0, 'cm': 1e-2, 'mm': 1e-3, 'um': 1e-6, 'in': INCH_M},
    FORCE: {'N': 1.0, 'mN': 1e-3, 'kN': 1e3, 'lbf': LBF_N, 'kgf': KGF_N,
            'gf': KGF_N / 1e3, 'daN': 10.0},
    VOLTAGE: {'V': 1.0, 'mV': 1e-3},
    DUTY: {'1': 1.0, '%': 1e-2},
    ANGLE: {'rad': 1.0, 'mrad': 1e-3, 'deg': math.pi / 180.0},
    SPEED: {'m/s': 1.0, 'cm/s': 1e-2, 'mm/s': 1e-3},
    RATE: {'rad/s': 1.0, 'deg/s': math.pi / 180.0},
    TIME: {'s': 1.0, 'ms': 1e-3, 'us': 1e-6, 'ns': 1e-9, 'min': 60.0, 'h': 3600.0}}
GAUGE, ABSOLUTE = 'gauge', 'abs'
DATE = 'date'                       # of a time: text such as 2026-11-25T09:30:00.125
_KINDS = {'gauge': GAUGE, 'g': GAUGE, 'gage': GAUGE, 'rel': GAUGE, 'relative': GAUGE,
          'ü': GAUGE, 'ue': GAUGE, 'eff': GAUGE,
          'abs': ABSOLUTE, 'a': ABSOLUTE, 'absolute': ABSOLUTE}
_OTHER_NAMES = {'µm': 'um', 'μm': 'um', 'µs': 'us', 'μs': 'us', 'sec': 's', 'secs': 's',
                'seconds': 's', 'second': 's', 'msec': 'ms', 'usec': 'us', 'nsec': 'ns',
                'inch': 'in', 'volt': 'V', 'volts': 'V', 'newton': 'N', 'percent': '%',
                'lb': 'lbf', 'lbs': 'lbf', 'pound': 'lbf', 'pounds': 'lbf', 'kg': 'kgf',
                'g': 'gf', '-': '1', 'kgf/cm²': 'kgf/cm2',
                'kp': 'kgf', 'kilopond': 'kgf', 'newtons': 'N', 'kp/cm2': 'kgf/cm2',
                'kp/cm²': 'kgf/cm2', 'kg/cm2': 'kgf/cm2', 'kg/cm²': 'kgf/cm2', 'n/mm2': 'MPa',
                'n/mm²': 'MPa', 'inches': 'in', 'millimeter': 'mm', 'millimetre': 'mm',
                'at': 'kgf/cm2', 'torr': 'mmHg', '°': 'deg', 'degree': 'deg', 'degrees': 'deg',
                'grad': 'deg', 'radian': 'rad', 'radians': 'rad', 'prozent': '%', 'zoll': 'in',
                'pascal': 'Pa', 'kilopascal': 'kPa', 'sekunde': 's', 'sekunden': 's',
                'secondes': 's', 'segundos': 's', 'millisekunden': 'ms', 'milliseconds': 'ms',
                'millimeters': 'mm', 'milímetros': 'mm', 'millimètres': 'mm', 'pct': '%',
                'millis': 'ms', 'micros': 'us', 'microseconds': 'us', 'mm/mm': '1', 'm/m': '1'}


# What sensors put out: where that begins, and how far it goes.
_OUTPUTS = {'mA': (4.0, 16.0), 'V': (0.0, 10.0), 'mV': (0.0, 20.0)}
_SPANS = {PRESSURE: (10.0, 'bar_gauge'), LENGTH: (100.0, 'mm'), FORCE: (1000.0, 'N'),
          ANGLE: (180.0, 'deg')}
# Steps of encoders and converters, in several languages. A name may end in the first of them.
_STEPS = set('counts cts ticks pulses increments inkremente impulse digits lsb'.split())
_OTHER_STEPS = set("""
    count cnt cnts ct tick pulse pls puls pulser inc incs incr increment ink inkr inkrement
    impulsen imp imps impulsions impulsion impulsi impulsos impulsy импульсы incrementen
    incrementi incrementos incremente inkrementy inkrement digit dig lsbs raw roh rohwert rohwerte
    brut grezzo crudo adc adu bit bits step steps stap stappen schritt schritte pas pasos passi
    strich striche code codes dn au a.u. cuentas conteos conteggi punkte points edges
    a ua hz khz uv mv/v v/v uv/v ohm kohm pf""".split())
_RANGE = re.compile(r'[\s.]+(dc|fs|fso|f\.s\.?|rms|of (range|full scale|span))$', re.IGNORECASE)
# What is left to be filled in, in the answer to a question.
ZERO, GAIN = 'ZERO', 'GAIN'
_FILLED = {PRESSURE: 'bar_gauge', LENGTH: 'mm', FORCE: 'N', ANGLE: 'deg', VOLTAGE: 'V', DUTY: '%',
           SPEED: 'mm/s', RATE: 'deg/s'}


@dataclass(frozen=True)
class Unit:
    """
    A unit as the user wrote it: SI value = ``factor`` × value + ``offset``.

    Parameters
    ----------
    name : str
        Its usual spelling, such as ``bar_gauge``.
    factor, offset : float
        The offset is the atmospheric pressure for a gauge pressure.
    is_complete : bool
        False for a pressure that does not say whether it is gauge or absolute.

    """

    name: str
    factor: float
    offset: float = 0.0
    is_complete: bool = True

    def to_si(self, values: FloatArray) -> FloatArray:
        """Return values of this unit in SI, pressures absolute."""
        return values * self.factor + self.offset


def unit_of_text(text: str, quantity: str) -> Unit | None:
    """
    Return the unit that a text names, None where it names none of the quantity.

    ``bar_gauge``, ``barg``, ``bar(g)``, ``bar abs`` and ``psia`` say gauge or absolute;
    ``bar`` alone gives a unit that is not complete.
    """
    wanted = text.strip().strip('[]()').strip()
    if quantity != PRESSURE:
        name = _spelled(_RANGE.sub('', wanted) if quantity == VOLTAGE else wanted, quantity)
        return None if name is None else Unit(name, FACTORS[quantity][name])
    flat = wanted.replace('(', '_').replace(')', '').replace(' ', '_').replace('-', '_')
    base, _, ending = flat.partition('_')
    kind = _KINDS.get(ending.lower().strip('_')) if ending else None
    if ending and kind is None:
        return None
    name = _spelled(base, quantity)
    if name is None and not ending and base[-1:].lower() in ('g', 'a', 'ü'):     # barg, psia
        name, kind = _spelled(base[:-1], quantity), _KINDS[base[-1].lower()]
    if name is None:
        return None
    factor = FACTORS[quantity][name]
    if kind is None:
        return Unit(name, factor, is_complete=False)
    return Unit(f'{name}_{kind}', factor, P_ATM_PA if kind == GAUGE else 0.0)


def checked_unit(text: str, quantity: str, where: str) -> Unit:
    """
    Return the unit that a text names.

    Raises
    ------
    InputError
        It is no unit of the quantity, or a pressure that says neither gauge nor absolute.

    """
    unit = unit_of_text(text, quantity)
    if unit is None:
        names = names_of(quantity)
        article = 'an' if quantity[0] == 'a' else 'a'
        raise InputError(
            f'{text!r} is no unit of {article} {quantity}'
            + (f'; {said}' if (said := of_output(text, quantity) or _of_share(text, quantity))
               else did_you_mean(text, names))
            + '; allowed: ' + ', '.join(names), where)
    if not unit.is_complete:
        raise InputError(
            f'{text!r} does not say whether the pressure is gauge or absolute; write '
            f'{unit.name}_gauge (0 for a vented muscle) or {unit.name}_abs', where)
    return unit


def of_output(text: str, quantity: str) -> str:
    """Return how the output of a sensor, such as V, is mapped; '' where the unit is another."""
    if not is_output(text, quantity) or quantity not in _SPANS:
        return ''
    return (f'{text} is what a sensor puts out: state the unit of what it measures, with zero '
            f'and gain, such as COLUMN:{example_of(text, quantity) or form_of(quantity)}')


def _of_share(text: str, quantity: str) -> str:
    """Return how a share of the length at rest is mapped; '' where the unit is another."""
    name = _spelled(text.strip().strip('[]()'), DUTY) if quantity == LENGTH else None
    if name is None:
        return ''
    share = f'{text} of the length at rest' if name == '%' else 'a share of the length at rest'
    gain = 300.0 * FACTORS[DUTY][name]
    return f'for {share} state mm with a gain, such as COLUMN:mm:gain={gain:g} for 300 mm'


def example_of(text: str, quantity: str) -> str:
    """Return how an output of a usual range is mapped, such as 4 to 20 mA; '' for others."""
    text = bare(text)
    if text not in _OUTPUTS or quantity not in _SPANS:
        return ''
    (zero, wide), (span, unit) = _OUTPUTS[text], _SPANS[quantity]
    begin = f':zero={zero:g}' if zero else ''
    return (f'{unit}{begin}:gain={span / wide:g} for {span:g} '
            f'{unit.partition("_")[0]} over {zero:g} to {zero + wide:g} {text}')


def is_output(text: str, quantity: str) -> bool:
    """Return whether a text names what sensors put out, such as mA, and no unit of a quantity."""
    return unit_of_text(text, quantity) is None and (
        bare(text) in _OUTPUTS or _flat(bare(text)) in _STEPS | _OTHER_STEPS)


def bare(text: str) -> str:
    """Return what a sensor puts out in usual words: ``V`` for ``Volt DC``, ``%`` for ``pct``."""
    own = _RANGE.sub('', text.strip().strip('[]()').strip())
    return _spelled(own, VOLTAGE) or ('%' if _spelled(own, DUTY) == '%' else own)


def ends_a_name(text: str) -> bool:
    """Return whether a text without brackets is the output of a sensor, as in ``p_mA``."""
    return text == 'mA' or _flat(text) in _STEPS        # `x_ma` may be an average


def form_of(quantity: str, kind: str = GAUGE) -> str:
    """Return unit, zero and gain of an output of a sensor, to be filled in."""
    unit = filled_unit(quantity).replace(GAUGE, kind)
    return f'{unit}:zero={ZERO}:gain={GAIN}'


def filled_unit(quantity: str) -> str:
    """Return the unit that stands in ``form_of``."""
    return _FILLED[quantity]


def _flat(text: str) -> str:
    """Return a text in lower case, without accents and brackets; µ and Ω spelled out."""
    flat = text.strip().strip('[]()').strip().lower()
    for one, spelled in (('µ', 'u'), ('μ', 'u'), ('ω', 'ohm'), ('é', 'e'), ('ä', 'ae')):
        flat = flat.replace(one, spelled)
    return flat


def si_unit(quantity: str) -> Unit:
    """Return the SI unit of a quantity; a pressure in it is absolute."""
    return Unit(names_of(quantity)[quantity == PRESSURE], 1.0)


def names_of(quantity: str) -> list[str]:
    """Return the units of a quantity as they are to be written."""
    names = list(FACTORS[quantity])
    if quantity == PRESSURE:
        return [f'{name}_{kind}' for name in names for kind in (GAUGE, ABSOLUTE)]
    return names


def _spelled(text: str, quantity: str) -> str | None:
    """Return the usual spelling of a unit; capitals matter only where they mean a prefix."""
    if text == 'G':                                     # a name, such as that of a muscle
        return None
    text = _OTHER_NAMES.get(text, _OTHER_NAMES.get(text.lower(), text))
    known = FACTORS[quantity]
    if text in known:
        return text
    return next((name for name in known if name.lower() == text.lower()
                 and not (text[:1] in 'mM' and text[:1] != name[:1])), None)
