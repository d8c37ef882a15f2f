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
Building blocks of an experiment: signals with a duration, a value and a rate.

A primitive is made from the value the previous one ended with, so a chain of
them is continuous unless a ``step`` is asked for. Values carry the unit of the
experiment's domain (m, or Pa absolute); rates are per second. Writing a new
primitive is writing one class here: its name in a file is the class name in
snake case, its keys are the fields, ``QUANTITIES`` are the ones that carry the
unit of the domain as a suffix (``center_m`` or ``center_pa``).
"""

from dataclasses import dataclass, field
import math
import re

import numpy as np

from pam_sim.errors import InputError

PRIMITIVES = {}


class Primitive:
    """A signal on 0 <= t <= duration_s; ``start`` is where the previous one ended."""

    QUANTITIES = ()

    def __init_subclass__(cls):
        """Register the class under its name in snake case."""
        PRIMITIVES[re.sub(r'(?<!^)(?=[A-Z])', '_', cls.__name__).lower()] = cls

    def at(self, t_s):
        """Return (value, rate) at the time t_s since the start of this primitive."""
        raise NotImplementedError

    @property
    def end(self):
        """Value at the end; the next primitive starts here."""
        return self.at(self.duration_s)[0]


@dataclass
class Rest(Primitive):
    """Stay at the rest value: contraction 0, or atmospheric pressure."""

    start: float
    rest_value: float
    duration_s: float

    def at(self, t_s):
        """Return the rest value and rate 0."""
        return self.rest_value, 0.0


@dataclass
class Hold(Primitive):
    """Stay where the previous primitive ended."""

    start: float
    duration_s: float

    def at(self, t_s):
        """Return the held value and rate 0."""
        return self.start, 0.0


@dataclass
class Step(Primitive):
    """Jump to a value and stay there."""

    QUANTITIES = ('to',)
    start: float
    to: float
    duration_s: float

    def at(self, t_s):
        """Return the new value and rate 0."""
        return self.to, 0.0


@dataclass
class Ramp(Primitive):
    """Move smoothly to a value: the fifth-order path of least jerk, at rest at both ends."""

    QUANTITIES = ('to',)
    start: float
    to: float
    duration_s: float

    def at(self, t_s):
        """Return value and rate on the minimum-jerk path."""
        s = min(max(t_s / self.duration_s, 0.0), 1.0)
        span = self.to - self.start
        value = self.start + span * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
        return value, span * 30.0 * s * s * (1.0 - s) ** 2 / self.duration_s


@dataclass
class Sine(Primitive):
    """Sine about a centre, starting at its lowest point with rate 0."""

    QUANTITIES = ('center', 'amplitude')
    start: float
    center: float
    amplitude: float
    frequency_hz: float
    cycles: float

    @property
    def duration_s(self):
        """Length of all cycles together."""
        return self.cycles / self.frequency_hz

    def at(self, t_s):
        """Return centre - amplitude cos(2 pi f t) and its rate."""
        w = 2.0 * math.pi * self.frequency_hz
        return (self.center - self.amplitude * math.cos(w * t_s),
                self.amplitude * w * math.sin(w * t_s))


@dataclass
class Chirp(Primitive):
    """Sine about a centre whose frequency grows linearly with time."""

    QUANTITIES = ('center', 'amplitude')
    start: float
    center: float
    amplitude: float
    from_hz: float
    to_hz: float
    duration_s: float

    def at(self, t_s):
        """Return value and rate of the chirp, starting at the lowest point."""
        slope = (self.to_hz - self.from_hz) / self.duration_s
        phase = 2.0 * math.pi * (self.from_hz * t_s + 0.5 * slope * t_s * t_s)
        w = 2.0 * math.pi * (self.from_hz + slope * t_s)
        return (self.center - self.amplitude * math.cos(phase),
                self.amplitude * w * math.sin(phase))


@dataclass
class Triangle(Primitive):
    """Slow triangle between two values at constant rate, starting from ``low``."""

    QUANTITIES = ('low', 'high')
    start: float
    low: float
    high: float
    period_s: float
    cycles: float

    @property
    def duration_s(self):
        """Length of all cycles together."""
        return self.period_s * self.cycles

    def at(self, t_s):
        """Return value and rate of the triangle."""
        phase = (t_s / self.period_s) % 1.0
        if t_s >= self.duration_s:
            phase = self.cycles % 1.0
        slope = 2.0 * (self.high - self.low) / self.period_s
        if phase < 0.5:
            return self.low + (self.high - self.low) * 2.0 * phase, slope
        return self.high - (self.high - self.low) * (2.0 * phase - 1.0), -slope


@dataclass
class Staircase(Primitive):
    """Equal steps from one value to another, each held for ``hold_s``."""

    QUANTITIES = ('low', 'high')
    start: float
    low: float
    high: float
    steps: int
    hold_s: float

    @property
    def duration_s(self):
        """Length of all holds together."""
        return self.hold_s * (self.steps + 1)

    def at(self, t_s):
        """Return the value of the present stair and rate 0."""
        k = min(int(t_s / self.hold_s), int(self.steps))
        return self.low + (self.high - self.low) * k / self.steps, 0.0


@dataclass
class Increments(Primitive):
    """Equal smooth moves to a value, each of ``move_s`` and followed by a hold of ``hold_s``."""

    QUANTITIES = ('to',)
    start: float
    to: float
    steps: int
    move_s: float
    hold_s: float

    @property
    def duration_s(self):
        """Length of all moves and holds together."""
        return int(self.steps) * (self.move_s + self.hold_s)

    def at(self, t_s):
        """Return value and rate: the path of least jerk in a move, rate 0 in a hold."""
        each = self.move_s + self.hold_s
        size = (self.to - self.start) / int(self.steps)
        done = min(int(t_s / each), int(self.steps) - 1)
        value, rate = Ramp(0.0, size, self.move_s).at(t_s - done * each)
        return self.start + done * size + value, rate


@dataclass
class RandomSteps(Primitive):
    """Steps to uniformly random values, held for uniformly random times."""

    QUANTITIES = ('low', 'high')
    start: float
    low: float
    high: float
    min_hold_s: float
    max_hold_s: float
    duration_s: float
    seed: int = 1
    _times: list = field(default_factory=list, repr=False)
    _values: list = field(default_factory=list, repr=False)

    def __post_init__(self):
        """Draw all steps once, from the seed."""
        rng = np.random.default_rng(int(self.seed))
        t = 0.0
        while t < self.duration_s:
            self._times.append(t)
            self._values.append(float(rng.uniform(self.low, self.high)))
            t += float(rng.uniform(self.min_hold_s, self.max_hold_s))

    def at(self, t_s):
        """Return the value of the present step and rate 0."""
        k = int(np.searchsorted(self._times, t_s, side='right')) - 1
        return self._values[max(k, 0)], 0.0


@dataclass
class Multisine(Primitive):
    """Sum of sines with equal amplitudes and random phases; ``amplitude`` is the peak bound."""

    QUANTITIES = ('center', 'amplitude')
    start: float
    center: float
    amplitude: float
    min_hz: float
    max_hz: float
    lines: int
    duration_s: float
    seed: int = 1

    def __post_init__(self):
        """Choose log-spaced frequencies and phases from the seed, scaled to the peak bound."""
        rng = np.random.default_rng(int(self.seed))
        self._w = 2.0 * np.pi * np.geomspace(self.min_hz, self.max_hz, int(self.lines))
        self._phase = rng.uniform(0.0, 2.0 * np.pi, int(self.lines))
        t = np.arange(0.0, self.duration_s, 0.1 / self.max_hz)
        wave = np.sin(np.outer(t, self._w) + self._phase).sum(axis=1)
        self._scale = self.amplitude / max(float(np.max(np.abs(wave))), 1e-9)

    def at(self, t_s):
        """Return value and rate, faded in and out over a second so that it starts at rest."""
        wave = self._scale * float(np.sin(self._w * t_s + self._phase).sum())
        rate = self._scale * float((self._w * np.cos(self._w * t_s + self._phase)).sum())
        edge = min(t_s, self.duration_s - t_s, 1.0)
        fade = max(edge, 0.0)
        slope = 0.0 if fade in (0.0, 1.0) else (1.0 if t_s < self.duration_s / 2 else -1.0)
        return self.center + fade * wave, fade * rate + slope * wave


def make_primitive(name, arguments, start, rest_value, suffix, where=''):
    """
    Build a primitive from the keys of an experiment file.

    Parameters
    ----------
    name : str
        Name of the primitive, as in ``PRIMITIVES``.
    arguments : dict
        Keys of the file; quantities carry the suffix ``_m`` or ``_pa``.
    start, rest_value : float
        Value the previous primitive ended with; rest value of the domain.
    suffix : str
        Unit suffix of the domain, ``m`` or ``pa``.
    where : str
        ``file:line`` for the error message.

    Raises
    ------
    InputError
        Unknown primitive, unknown or missing key, value that is not a positive number.

    """
    if name not in PRIMITIVES:
        raise InputError(
            f'unknown primitive "{name}"; choose from {", ".join(sorted(PRIMITIVES))}', where)
    cls = PRIMITIVES[name]
    fields = {f: spec for f, spec in cls.__dataclass_fields__.items()
              if not f.startswith('_') and f not in ('start', 'rest_value')}
    keys = {f'{f}_{suffix}' if f in cls.QUANTITIES else f: f for f in fields}
    values = {}
    for key, value in dict(arguments or {}).items():
        if key not in keys:
            raise InputError(f'unknown key "{key}" of {name}; allowed: {", ".join(keys)}', where)
        if isinstance(value, bool) or not isinstance(value, (int, float)) \
                or not math.isfinite(value):
            raise InputError(f'{name}.{key} is {value!r}; a finite number is needed', where)
        positive = keys[key] not in cls.QUANTITIES and key != 'seed'
        if positive and not 0 < value <= 1e6:
            raise InputError(f'{name}.{key} is {value!r}; allowed is above 0, to 1e6', where)
        values[keys[key]] = value
    missing = [k for k, f in keys.items() if f not in values and f != 'seed']
    if missing:
        raise InputError(f'{name} lacks {", ".join(missing)}', where)
    if 'rest_value' in cls.__dataclass_fields__:
        values['rest_value'] = rest_value
    return cls(start=start, **values)
