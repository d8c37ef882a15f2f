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

"""One verdict per subsystem: what is named in it, and what it leaves unexplained."""

from collections.abc import Mapping
from dataclasses import replace
import math

from pam_sim.effects.registry import effects, get_effect
from pam_sim.gap.criteria import Criteria
from pam_sim.gap.fit.profile import NORMAL_95
from pam_sim.gap.result import GapResult, SignalGap, SubsystemVerdict
from pam_sim.gap.select.rival import NamedEffect
from pam_sim.gap.subsystems.effects import subsystem_of_number
from pam_sim.gap.verify.own_runs import largest, OwnRuns
from pam_sim.gap.verify.validation import share_left

SUBSYSTEMS = ('valve', 'muscle', 'load', 'sensor')


def subsystem_verdicts(result: GapResult, named: list[NamedEffect], runs: OwnRuns,
                       criteria: Criteria, materiality: float) -> dict[str, SubsystemVerdict]:
    """
    Return what is said of every subsystem, the valve first.

    Parameters
    ----------
    result : GapResult
        With verdict, effects, parameters and the noise of the sensors.
    named : list of NamedEffect
        What was added to the model.
    runs : OwnRuns
        On the certify data.
    criteria : Criteria
        Decision thresholds.
    materiality : float
        From how many deviations of a sensor on a gap matters.

    """
    names = _names(result, named)
    found = {}
    for s in SUBSYSTEMS:
        own = _own(s, names.get(s, ()), runs.gaps)
        if not own or (s not in runs.gaps and s not in names):
            continue
        signal = largest(own)
        found[s] = SubsystemVerdict(
            _verdict(s, names.get(s, ()), result, named), names.get(s, ()), signal, own[signal],
            share_left(own.values(), criteria.floor_error))
        if found[s].verdict in ('effects', 'parameter') and (
                found[s].unexplained_fraction >= criteria.partial_share):
            found[s] = replace(found[s], verdict='partial')
    if result.verdict == 'no_gap':
        return {s: replace(one, is_slight=result.is_slight and _left(
            runs.gaps[s], result, criteria) > criteria.likely_sd) for s, one in found.items()}
    open_ones = [s for s, one in found.items() if one.verdict == 'no_gap']
    least = criteria.likely_sd * max(materiality, 1.0)
    left = {s: _left(runs.gaps[s], result, criteria) for s in open_ones}
    plain = left
    if any(value > least for value in left.values()):
        doubt = runs.spread()
        left = {s: _left(runs.gaps[s], result, criteria, {
            signal: (doubt[s, signal], runs.searched(s, signal)) for signal in runs.gaps[s]})
            for s in open_ones}
    unknown = {s for s, value in left.items() if value > least}
    if result.verdict == 'unknown':
        unknown |= {one.subsystem for one in result.noticed}
    if result.verdict == 'unknown' and not unknown:
        unknown = {max(plain, key=lambda s: plain[s])}     # or the doubt hides it here
    return {s: replace(one, verdict='unknown') if s in unknown else one
            for s, one in found.items()}


def add_place(result: GapResult) -> None:
    """
    Add the subsystem of the first row of ``where`` where it is unknown and not yet told of.

    What it leaves is what the subsystem leaves in which its signal is simulated.
    """
    place = result.where[0].subsystem if result.where else ''
    if result.verdict == 'unknown' and place and place not in result.subsystems:
        signal = result.where[0].signal
        unknown = {s: one for s, one in result.subsystems.items() if one.verdict == 'unknown'}
        own = unknown.get('valve' if signal == 'pressure' else 'muscle')
        found = {**result.subsystems, place: next(
            (one for one in unknown.values() if one.signal == signal),
            own or next(iter(unknown.values())))}
        result.subsystems = {s: found[s] for s in SUBSYSTEMS if s in found}


def subsystem_of(name: str) -> str:
    """Return the subsystem of an effect or of a parameter of a rig."""
    if name in effects():
        return get_effect(name).subsystem
    return subsystem_of_number(name)


def _names(result: GapResult, named: list[NamedEffect]) -> dict[str, tuple[str, ...]]:
    """Return what is named by subsystem, with all names of a set under that of its first."""
    sets = {w.name: w.names for w in named}
    found: dict[str, list[str]] = {}
    for name in (*(e['name'] for e in result.effects), *(p.name for p in result.parameters)):
        found.setdefault(subsystem_of(name), []).extend(sets.get(name, (name,)))
    return {s: tuple(dict.fromkeys(names)) for s, names in found.items()}


def _own(s: str, names: tuple[str, ...], gaps: Mapping[str, Mapping[str, SignalGap]]
         ) -> dict[str, SignalGap]:
    """Return the gaps that tell of a subsystem; of sensors, those of the signals they read."""
    of_valve = dict(gaps.get('valve', {}))
    if s == 'valve':
        return of_valve
    of_muscle = dict(gaps.get('muscle', {}))
    if s != 'sensor':
        return of_muscle
    # A zero of a sensor is a number of the rig that begins with the signal.
    read = {get_effect(n).fitting.sensor_signal if n in effects() else n.split('_')[0]
            for n in names}
    return {signal: gap for signal, gap in {**of_muscle, **of_valve}.items()
            if signal in read} or of_muscle


def _verdict(s: str, names: tuple[str, ...], result: GapResult, named: list[NamedEffect]) -> str:
    """Return the verdict of what is named; ``no_gap`` where nothing is."""
    if not names or result.verdict in ('no_gap', 'unknown'):
        return 'no_gap'
    if any(len(w.names) > 1 and w.name in names for w in named):
        return 'ambiguous'
    return 'effects' if any(e['subsystem'] == s for e in result.effects) else 'parameter'


def _left(gaps: Mapping[str, SignalGap], result: GapResult, criteria: Criteria,
          numbers: Mapping[str, tuple[float, float]] | None = None) -> float:
    """
    Return what is left beyond the floor and the doubt about numbers, in sensor deviations.

    ``numbers``: by signal, how far the model may be off by its numbers, and what it leaves in the
    data they were fitted to. There the numbers were free, so it is not theirs.
    """
    found = 0.0
    for signal, gap in gaps.items():
        floor = criteria.floor_error * gap.noise_floor
        doubt, searched = (numbers or {}).get(signal, (0.0, 0.0))
        beyond = max(gap.rmse_after ** 2 - floor ** 2 - (NORMAL_95 * doubt) ** 2,
                     min(gap.rmse_after, searched) ** 2 - floor ** 2, 0.0)
        found = max(found, math.sqrt(beyond) / max(result.noise.get(signal, 0.0), 1e-12))
    return found
