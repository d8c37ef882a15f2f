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
A typed library of terms: which factors fit which inputs, with shapes from the range of the data.

Every term is an amplitude in the unit of what it changes, times one factor or two of measured
inputs. Polynomials, hinges, periods, play and relaxation go with places and pressures; direction
and drag go with speeds; trends and periods go with time.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
import itertools

from pam_sim.effects.fitting import FreeParameter
from pam_sim.effects.unnamed import (
    contraction_reading_term, flow_term, force_reading_term, load_term, muscle_term,
    set_point_term, terms)
from pam_sim.effects.unnamed.terms import Input
from pam_sim.valve import VALVES

LARGEST = 200.0              # of an amplitude, in trial sizes
SHAPE_ROOM = 3.0             # how far a shape may move from where it was found
PLACES, SPEEDS, TIMES = 'place', 'speed', 'time'
KIND_OF = {'p': PLACES, 'x': PLACES, 's': PLACES, 'F': PLACES, 'a': PLACES, 'b': PLACES,
           'v': SPEEDS, 'e': SPEEDS, 't': TIMES}
HINGES = (0.15, 0.3, 0.5, 0.7, 0.85)         # of the range
WAVES = tuple(0.5 * k for k in range(2, 31))     # periods within the range
STOPS = (0.01, 0.03, 0.1, 0.3)               # of the range
MEMORIES_S = (0.05, 0.2, 1.0, 5.0, 20.0)
LONG_S = 2.0                 # of a reading: what lasts longer is a trend
FADES_S = (2.0, 8.0, 25.0)
SWINGS_S = (0.12, 0.2, 0.3, 0.45)
DISTANCE_PLACE = 1           # of the inputs of a set point
SOFT = {'v': 3e-3, 'e': 1.5e3}               # width of a change of direction


@dataclass(frozen=True)
class Channel:
    """What a term changes: its symbol and unit, the size of a trial, what stands in the file."""

    number: int
    symbol: str
    unit: str
    trial: float
    least: float = -1.0         # of an amplitude, in LARGEST trials
    factor: float = 1.0         # from the amplitude to the unit


@dataclass(frozen=True)
class StandIn:
    """An effect that stands in for a term: its name, inputs and channels."""

    effect: str
    subsystem: str
    inputs: tuple[Input, ...]
    channels: tuple[Channel, ...]
    valves: tuple[str, ...] = VALVES
    signal: str = ''            # of a sensor: the reading it changes


STAND_INS = (
    StandIn('muscle_term', 'muscle', muscle_term.INPUTS, (
        Channel(muscle_term.FORCE, 'F', 'N', 0.5),
        Channel(muscle_term.DRY, 'F_dry', 'N', 0.5, 0.0))),
    StandIn('load_term', 'load', load_term.INPUTS, (
        Channel(load_term.FORCE, 'F_load', 'N', 0.5),
        Channel(load_term.DRY, 'F_guide', 'N', 0.5, 0.0))),
    StandIn('set_point_term', 'valve', set_point_term.INPUTS, (
        Channel(set_point_term.AIM, 's', 'Pa', 1e3),
        Channel(set_point_term.QUICKNESS, '1/T', '-', 0.05),
        Channel(set_point_term.SWING, 'zeta', '-', 0.5, 0.0005)), ('ppr',)),
    StandIn('flow_term', 'valve', flow_term.INPUTS, (
        Channel(flow_term.NET, 'mdot', 'kg/s', 0.05, -1.0, flow_term.FLOW_SCALE),
        Channel(flow_term.FILL, 'mdot_fill', '-', 0.03),
        Channel(flow_term.VENT, 'mdot_vent', '-', 0.03)), ('hsv',)),
    StandIn('contraction_reading_term', 'sensor', contraction_reading_term.INPUTS, (
        Channel(0, 'x_read', 'm', 5e-5),), signal='contraction'),
    StandIn('force_reading_term', 'sensor', force_reading_term.INPUTS, (
        Channel(0, 'F_read', 'N', 0.3),), signal='force'),
)


@dataclass(frozen=True)
class Factor:
    """A function of one input; ``shape`` in the unit of the input, or seconds of a memory."""

    kind: int
    of: int = 0
    shape: float = 1.0

    @property
    def is_shaped(self) -> bool:
        """Return whether its shape is fitted."""
        return self.kind in (terms.ABOVE, terms.BELOW, terms.SINE, terms.FADE, terms.STOP,
                             terms.PASSING, terms.SWING)


NOTHING = Factor(terms.ONE)


@dataclass(frozen=True)
class Term:
    """A term of a stand-in: channel and factors."""

    channel: Channel
    one: Factor
    two: Factor = NOTHING

    @property
    def size(self) -> int:
        """Return how many numbers it takes to write: amplitudes, shapes, further factors."""
        return (1 + (self.one.kind in terms.PAIRED) + self.one.is_shaped
                + (self.two.kind != terms.ONE))

    @property
    def factors(self) -> tuple[int, ...]:
        """Return what it has in common with terms that differ in their shapes alone."""
        return self.channel.number, self.one.kind, self.one.of, self.two.kind, self.two.of

    def held(self, place: int) -> dict[str, float]:
        """Return the numbers of slot ``place`` that make the form."""
        return {f'{name}_of_{place}': float(value) for name, value in (
            ('channel', self.channel.number), ('input_1', self.one.of),
            ('kind_1', self.one.kind), ('shape_1', self.one.shape),
            ('input_2', self.two.of), ('kind_2', self.two.kind),
            ('shape_2', self.two.shape))}

    def free(self, place: int) -> tuple[FreeParameter, ...]:
        """Return what is fitted of slot ``place``."""
        trial, least = self.channel.trial, self.channel.least
        names = ('first', 'second') if self.one.kind in terms.PAIRED else ('first',)
        found = [FreeParameter(f'{name}_of_{place}', trial, least * LARGEST * trial,
                               LARGEST * trial) for name in names]
        if self.one.is_shaped:
            shape = self.one.shape
            found.append(FreeParameter(f'shape_1_of_{place}', shape, shape / SHAPE_ROOM,
                                       shape * SHAPE_ROOM, True))
        return tuple(found)


def library(stand_in: StandIn, ranges: Mapping[str, tuple[float, float]],
            waves_s: tuple[float, ...] = (), further: bool = False) -> list[Term]:
    """
    Return the terms of a stand-in, the simple ones first.

    Parameters
    ----------
    stand_in : StandIn
        Where they act.
    ranges : dict of str -> (float, float)
        Lowest and highest value of every input in the data, by its symbol.
    waves_s : tuple of float
        Periods over time that the errors show.
    further : bool
        Whether the terms go beside others; those that stand alone are left out then.

    """
    found: list[Term] = []
    for channel in stand_in.channels:
        if channel.symbol == 'zeta':        # its amplitude is a damping, it stands alone
            if not further:
                found += [Term(channel, Factor(terms.SWING, DISTANCE_PLACE, s))
                          for s in SWINGS_S]
            continue
        alone = [f for i, one in enumerate(stand_in.inputs) if one.symbol in ranges
                 for f in _factors(i, one, ranges[one.symbol], waves_s)]
        if stand_in.signal:             # gain and bias of a sensor have names
            alone = [f for f in alone if _of_reading(stand_in, f)]
        if channel.least == 0.0:        # a level: never negative, has its own direction
            alone = [f for f in alone if f.kind in (
                terms.LINEAR, terms.SQUARE, terms.SIZE, terms.ABOVE, terms.BELOW, terms.FADE)
                and _is_level(stand_in.inputs[f.of], f)]
        found += [Term(channel, f) for f in (NOTHING, *alone)]
        if not stand_in.signal:
            found += [Term(channel, *pair) for pair in _pairs(stand_in, ranges, channel)]
    return found


def _of_reading(stand_in: StandIn, f: Factor) -> bool:
    """Return whether a factor is worth a try for a reading: its own signal, trends, others."""
    symbol = stand_in.inputs[f.of].symbol
    if symbol == stand_in.signal[0].replace('c', 'x').replace('f', 'F'):
        return f.kind != terms.PASSING or f.shape < LONG_S
    return KIND_OF[symbol] == TIMES or f.kind == terms.LINEAR


def _is_level(one: Input, f: Factor) -> bool:
    """Return whether a factor can be a level of friction: not negative, and known where it is."""
    if one.symbol == 'F':
        return False
    return KIND_OF[one.symbol] != SPEEDS or f.kind in (terms.SIZE, terms.SQUARE, terms.FADE)


def _factors(i: int, one: Input, ends: tuple[float, float], waves_s: tuple[float, ...]
             ) -> Iterator[Factor]:
    """Write the factors that go with an input."""
    low, high = ends
    span, sort = high - low, KIND_OF[one.symbol]
    yield Factor(terms.LINEAR, i)
    yield Factor(terms.SQUARE, i)
    if sort == PLACES:
        yield Factor(terms.CUBE, i)
        if one.unit == '-':
            return
        for share in HINGES:
            yield Factor(terms.ABOVE, i, low + share * span)
        yield from (Factor(terms.SINE, i, span / count) for count in WAVES)
        yield from (Factor(terms.STOP, i, share * span) for share in STOPS)
        yield from (Factor(terms.PASSING, i, time_s) for time_s in MEMORIES_S)
    elif sort == SPEEDS:
        yield Factor(terms.SIZE, i)
        yield Factor(terms.SIGNED_SQUARE, i)
        yield Factor(terms.SIGN, i, SOFT[one.symbol])
        for share in (0.1, 0.3):
            yield Factor(terms.FADE, i, share * max(high, -low))
    else:
        yield from (Factor(terms.FADE, i, time_s) for time_s in FADES_S)
        yield from (Factor(terms.SINE, i, period_s) for period_s in waves_s)


def _pairs(stand_in: StandIn, ranges: Mapping[str, tuple[float, float]], channel: Channel
           ) -> Iterator[tuple[Factor, Factor]]:
    """Write products of two factors."""
    seen = [(i, one) for i, one in enumerate(stand_in.inputs) if one.symbol in ranges]
    for (i, one), (j, two) in itertools.combinations(seen, 2):
        sorts = KIND_OF[one.symbol], KIND_OF[two.symbol]
        if SPEEDS not in sorts:
            yield Factor(terms.LINEAR, i), Factor(terms.LINEAR, j)
            continue
        if sorts[1] != SPEEDS:
            (i, one), (j, two) = (j, two), (i, one)
        if channel.least == 0.0 or KIND_OF[one.symbol] == SPEEDS:
            continue
        for kind in (terms.LINEAR, terms.SQUARE):
            yield Factor(kind, i), Factor(terms.LINEAR, j)
        yield Factor(terms.LINEAR, i), Factor(terms.SIGN, j, SOFT[two.symbol])
        yield Factor(terms.LINEAR, i), Factor(terms.SIGNED_SQUARE, j)
        yield Factor(terms.LINEAR, i), Factor(terms.SIZE, j)


def moved_to(term: Term, shape: float) -> Term:
    """Return a term with another shape of its first factor."""
    return replace(term, one=replace(term.one, shape=shape))
