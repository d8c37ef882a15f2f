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
Effects that may be in the recordings although nobody named them.

An effect that the model misses bends the numbers: a dead time looks like a longer time constant.
Where the calibrated model leaves more than noise, the effects of the library are therefore
fitted along with the numbers: those of the valve, those of muscle and load, or both. Each has a
prior about zero as wide as its typical size. What they could explain widens the intervals. Their
sizes are no result: ``pam gap`` names effects, and proves them.

The hidden effect has a formulation of its own. Those that matter are therefore fitted in all
formulations of the library, with their shapes free. The best one stays, with free shapes where
it explains as much; how far the numbers move between those that explain about as much widens the
intervals.
"""

from collections.abc import Callable, Collection, Sequence

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.effects.effect import Effect
from pam_sim.effects.registry import effects
from pam_sim.gap.subsystems.problem import RATE_HZ, SubsystemProblem
from pam_sim.identify.fit import Weighted
from pam_sim.identify.inputs import memories_by_noise
from pam_sim.identify.numbers import Number
from pam_sim.identify.quiet import SHORT_S
from pam_sim.identify.secant import solve_from
from pam_sim.rig import Rig

# Their least size, not zero, is the strongest effect.
NOT_GRADUAL = ('flow_limit', 'supply_droop')
SEEN_FLOORS2 = 1.5           # mean squared error from which on something is missing
LASTING = SHORT_S * RATE_HZ  # samples that errors stay alike, from which on the same
MATTERS_FLOORS2 = 0.1        # the same of what lasts, and of what an effect moves to be tried
TRIED = 3                    # effects of which they are
SHAPE_SD = 1.0               # of the logarithm of a shape
SMALL = 0.3                  # start of a size that the other formulation does not have
BETTER = 0.02                # of the sum of logarithms of misfits
AS_GOOD = 0.3                # the same, within which formulations explain about as much


def incomplete_subsystems(weighted: Weighted, x: FloatArray) -> frozenset[str]:
    """
    Return the subsystems in which a fitted model leaves more than noise in some signal.

    An effect smaller than the noise shows by its memory. What is left then stays alike for many
    samples, more than noise does by chance. What a recording without noise leaves stays alike too;
    far below the noise it says nothing.
    """
    squares = list(weighted.mean_squares(x))
    found = {p.subsystem for p, _, square in squares if square > SEEN_FLOORS2}
    lasting = [(place, memory) for place, ((p, _, square), memory) in enumerate(zip(
        squares, weighted.memories(x))) if (
            p.subsystem not in found and square > MATTERS_FLOORS2 and memory > LASTING)]
    by_noise = memories_by_noise(weighted, x) if lasting else []
    return frozenset(found | {
        squares[place][0].subsystem for place, memory in lasting if memory > by_noise[place]})


def possible_effects(rig: Rig, problems: Sequence[SubsystemProblem], numbers: Sequence[Number],
                     incomplete: Collection[str]) -> list[Number]:
    """
    Return the effects that may be missing in subsystems, as numbers with a prior about zero.

    An unknown number that acts in two subsystems, such as the zero of the pressure, carries what
    one of them misses into the other one. There the effects of both are returned.

    Formulations of the same name, and what stands in the rig or among ``numbers``, are left out.
    So are sensors: they count as calibrated, unless their zero is asked for. An effect that acts
    as an unknown number does is left to that number, and a static map to an unknown force law.
    """
    acts_as_unknown = {e.name for e, *_ in counted_in(problems, numbers)}
    there = {e.name for e in rig.effects} | {n.effect for n in numbers if n.effect}
    unknown = {n.name for n in numbers if n.unknown}
    if 'spring_n_per_m' in unknown:
        there.add('parallel_spring')
    free_law = any(n.of_law and n.unknown for n in numbers)
    own = [p for p in problems if p.subsystem in incomplete]
    missing = [p for p in problems if p.subsystem in incomplete or any(
        n.unknown and n.acts_in(p) and any(map(n.acts_in, own)) for n in numbers)]
    found = []
    for effect in effects().values():
        if (effect.variant_of or effect.subsystem == 'sensor' or effect.name in there
                or effect.name in NOT_GRADUAL or rig.valve not in effect.valves
                or effect.name in acts_as_unknown
                or free_law and effect.family == 'static_map'
                or effect.fitting.same_as in unknown):
            continue
        sizes = [p for p in effect.parameters if p.name in effect.amplitude]
        if any(p.lower > 0.0 or p.default <= 0.0 for p in sizes):
            continue
        for p in sizes:
            number = Number(f'{effect.name}.{p.name}', effect.name, p.name, p.unit, 0.0, p.lower,
                            p.upper, p.default, description=effect.sentence)
            if any(map(number.acts_in, missing)):
                found.append(number)
    return found


def counted_in(problems: Sequence[SubsystemProblem], numbers: Sequence[Number]
               ) -> list[tuple[Effect, str, str]]:
    """
    Return (effect, unknown number, what tells) where recordings cannot tell one from the other.

    A tube that resists contraction is one with the spring of the load, unless the force between
    them is measured. A pressure that gives no force is one with the zero of the pressure sensor,
    unless the valve tells the pressure.
    """
    unknown = {n.name for n in numbers if n.unknown}
    with_force = any('force' in p.signals for p in problems)
    with_command = any(p.subsystem == 'valve' for p in problems)
    found = []
    for effect in effects().values():
        for is_told, name, tells in (
                (with_force, effect.fitting.same_without_force, 'a recorded force'),
                (with_command, effect.fitting.same_without_command,
                 'a recorded command of the valve')):
            if not is_told and name in unknown:
                found.append((effect, name, tells))
    return found


def in_other_forms(weighted: Weighted, x: FloatArray, count: int,
                   progress: Callable[[float], object] = lambda done: None
                   ) -> tuple[Weighted, FloatArray, FloatArray]:
    """
    Return (problem, solution, spread of the first numbers) with the effects that matter reformed.

    Parameters
    ----------
    weighted : Weighted
        With possible effects, each in its first formulation and of fixed shape.
    x : numpy.ndarray
        Its solution.
    count : int
        How many numbers are sought; the spread is in their coordinates.
    progress : callable
        Told the share that is done, 0 to 1.

    """
    met: list[tuple[float, FloatArray]] = []
    there = {e.name for e in weighted.rig.effects}
    slopes = weighted.slopes(x)
    for done, name in enumerate(_that_matter(weighted, x, slopes)):
        progress(done / TRIED)
        base, start, base_slopes = weighted, x, slopes
        least = base.misfit(x)
        met.append((least, x[:count]))
        kept = [k for k, n in enumerate(base.numbers) if n.effect != name]
        old = {n.parameter: float(c) for n, c in zip(base.numbers, start) if n.effect == name}
        for form in effects().values():
            if name not in (form.name, form.variant_of) or (
                    form.name == name and not any(f.shape for f in form.fitting.free)):
                continue
            fresh = _numbers_of(form)
            if not fresh or base.rig.valve not in form.valves or form.name in there:
                continue
            other = Weighted(base.rig, base.problems, [base.numbers[k] for k in kept] + fresh,
                             base.temper, base.incomplete)
            at = np.concatenate([start[kept], [
                old.get(n.parameter, 0.0 if n.shape else SMALL) for n in fresh]])
            at = np.clip(at, other.low, other.high)
            rows = base_slopes.shape[0] - len(base.numbers)
            guess = np.zeros((rows + at.size, at.size))
            guess[:rows, :len(kept)] = base_slopes[:rows, kept]
            guess[:rows, len(kept):] = other.slopes(at, range(len(kept), at.size))[:rows]
            guess[rows:] = np.diag(other.prior)
            found, _, at_slopes = solve_from(other, at, guess)
            misfit = other.misfit(found)
            met.append((misfit, found[:count]))
            # Free shapes hold the first formulation too: what they leave open counts.
            margin = BETTER if form.name == name else -BETTER
            if misfit < least + margin:
                least, weighted, x, slopes = misfit, other, found, at_slopes
    best = min((m for m, _ in met), default=0.0)
    spread = np.zeros(count)
    for misfit, values in met:
        if misfit < best + AS_GOOD:
            spread = np.maximum(spread, np.abs(values - x[:count]))
    return weighted, x, spread


def _that_matter(weighted: Weighted, x: FloatArray, slopes: FloatArray) -> list[str]:
    """Return the names of the effects that move a signal most, the strongest first."""
    moved: dict[str, float] = {}
    for k, n in enumerate(weighted.numbers):
        if n.effect and not n.unknown:
            row = 0
            for place, p in enumerate(weighted.problems):
                own = slopes[row:row + p.signal.size, k]
                row += p.signal.size
                for s in range(len(p.signals)):
                    square = weighted.temper[place][s] * float(
                        np.mean(own[p.signal == s] ** 2)) * float(x[k]) ** 2
                    moved[n.effect] = max(moved.get(n.effect, 0.0), square)
    strong = [name for name, square in moved.items() if square > MATTERS_FLOORS2]
    return sorted(strong, key=lambda name: -moved[name])[:TRIED]


def _numbers_of(form: Effect) -> list[Number]:
    """Return what is fitted of a formulation: sizes about zero, shapes about their typical one."""
    by_name = {p.name: p for p in form.parameters}
    found = []
    for f in form.fitting.free:
        p = by_name[f.name]
        typical = p.default if p.default > 0.0 and not f.shape else f.typical
        found.append(Number(
            f'{form.name}.{f.name}', form.name, f.name, p.unit,
            typical if f.shape else max(0.0, f.lower), f.lower, f.upper,
            SHAPE_SD if f.shape else typical, description=form.sentence, shape=f.shape))
    return found
