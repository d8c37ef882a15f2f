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
"""A proposed term in words: its equation and the range for which it holds."""

from collections.abc import Mapping, Sequence
import math

from pam_sim.effects.unnamed import terms
from pam_sim.effects.unnamed.terms import Input
from pam_sim.gap.propose.library import Factor, StandIn, Term

READABLE = {'Pa': (1e-3, 'kPa'), 'm': (1e3, 'mm'), 'm/s': (1e3, 'mm/s'), 'N': (1.0, 'N'),
            's': (1.0, 's'), '-': (1.0, ''), 'kg/s': (1e6, 'mg/s')}


def equation_of(stand_in: StandIn, found: Sequence[Term], values: Mapping[str, float]) -> str:
    """
    Return the equation of some terms in one line.

    Parameters
    ----------
    stand_in : StandIn
        Where they act.
    found : list of Term
        What is added.
    values : dict
        Amplitudes and shapes, by the names of the stand-in.

    """
    if found[0].one.kind == terms.SWING:
        return (f"p'' = w^2 (s - p) - 2 zeta w p', w = 2 pi / {values['shape_1_of_1']:.3g} s, "
                f"zeta = {values['first_of_1']:.3g}")
    parts = []
    for channel in dict.fromkeys(term.channel for term in found):
        rest = [_term(stand_in, term, place, values) for place, term in enumerate(found, 1)
                if term.channel == channel]
        right = f'{channel.symbol} (1 {" ".join(rest)})' if channel.unit == '-' else (
            f'{channel.symbol} {" ".join(rest)}')
        parts.append(f'{channel.symbol} -> {right}')
    return '; '.join(parts)


def amount(value: float, unit: str) -> str:
    """Return a number with its unit as people read it."""
    factor, readable = READABLE[unit]
    return f'{value * factor:.3g} {readable}'.strip()


def range_texts(ranges: Mapping[str, tuple[float, float]], inputs: Sequence[Input]
                ) -> list[str]:
    """Return the range of every input in words."""
    parts = []
    for one in inputs:
        if one.symbol in ranges:
            low, high = ranges[one.symbol]
            parts.append(f'{one.symbol} ({one.meaning}) {amount(low, one.unit)} to '
                         f'{amount(high, one.unit)}')
    return parts


def _term(stand_in: StandIn, term: Term, place: int, values: Mapping[str, float]) -> str:
    """Return a term with its sign in front."""
    size = values[f'first_of_{place}'] * term.channel.factor
    one = stand_in.inputs[term.one.of]
    shape = values.get(f'shape_1_of_{place}', term.one.shape)
    if term.one.kind == terms.SINE:
        other = values[f'second_of_{place}'] * term.channel.factor
        phase = _signed(math.atan2(other, size))
        wave = f'sin(2 pi {one.symbol} / {amount(shape, one.unit)} {phase})'
        return f'+ {amount(math.hypot(size, other), term.channel.unit)} {wave}' + _second(
            stand_in, term)
    sign = '-' if size < 0.0 else '+'
    return ' '.join(filter(None, [
        sign, amount(abs(size), term.channel.unit), in_words(term.one, one, shape)])) + _second(
            stand_in, term)


def _second(stand_in: StandIn, term: Term) -> str:
    if term.two.kind == terms.ONE:
        return ''
    two = stand_in.inputs[term.two.of]
    return ' ' + in_words(term.two, two, term.two.shape)


def _signed(value: float) -> str:
    return f'{"-" if value < 0.0 else "+"} {abs(value):.2f}'


def in_words(f: Factor, one: Input, shape: float) -> str:
    """Return a factor of an input as it stands in an equation."""
    q = f'{one.symbol} / {amount(one.scale, one.unit)}' if one.scale != 1.0 else one.symbol
    edge = amount(shape, one.unit)
    return {
        terms.ONE: '', terms.LINEAR: f'({q})', terms.SQUARE: f'({q})^2',
        terms.CUBE: f'({q})^3', terms.SIZE: f'|{q}|',
        terms.SIGNED_SQUARE: f'({q}) |{q}|',
        terms.SIGN: f'tanh({one.symbol} / {edge})',
        terms.ABOVE: f'max({one.symbol} - {edge}, 0) / {amount(one.scale, one.unit)}',
        terms.BELOW: f'max({edge} - {one.symbol}, 0) / {amount(one.scale, one.unit)}',
        terms.FADE: f'exp(-|{one.symbol}| / {edge})',
        terms.STOP: f'stop({one.symbol}, {edge})',
        terms.PASSING: f'({one.symbol} - lag({one.symbol}, {shape:.3g} s)) / '
        f'{amount(one.scale, one.unit)}'}[f.kind]
