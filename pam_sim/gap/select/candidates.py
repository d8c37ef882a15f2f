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
What may be missing: formulations of effects with the parameters that are fitted.

Each effect of the registry is a candidate; formulations with ``variant_of`` carry the
name of that effect. What is fitted of each, from where and how far, is declared in its file.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
import math

from pam_sim.effects.registry import effects, get_effect
from pam_sim.gap.criteria import Criteria
from pam_sim.gap.data.means import means_of
from pam_sim.gap.data.noise import noise_of
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.fit.candidate import Candidate
from pam_sim.rig import Rig
from pam_sim.units import P_ATM_PA

LOWEST_S = 0.1               # of the means of which the lowest counts


def is_limit(simple: str, name: str) -> bool:
    """Return whether an effect is a limit of another: where both explain the data, it is named."""
    other = effects().get(name)
    return other is not None and simple in other.fitting.limits


def same_as(name: str) -> str | None:
    """Return the number of the model that does the same as an effect, None where there is none."""
    effect = effects().get(name)
    return effect.fitting.same_as or None if effect else None


def is_limit_at(candidate: Candidate, values: Mapping[str, float]) -> bool:
    """Return whether values turn a formulation into a limit of its effect."""
    turned = get_effect(candidate.effect).fitting.is_limit
    return turned is not None and turned(values)


def candidates(rig: Rig, outputs: Sequence[str], only: Collection[str] | None = None,
               supply_stands: bool = False) -> list[Candidate]:
    """
    Return the candidates that can show on a rig.

    Parameters
    ----------
    rig : pam_sim.Rig
        The model; an effect it already has is refitted, not added.
    outputs : tuple of str
        Signals that are compared.
    only : sequence of str, optional
        Names to try, canonical or of a formulation.
    supply_stands : bool
        Whether the recordings show that the supply pressure does not move.

    Returns
    -------
    list of Candidate

    """
    found = []
    for name, effect in effects().items():
        candidate = Candidate(name, effect.free_parameters(rig.valve))
        if effect.relative_of and name not in (only or ()):
            continue
        if only is not None and name not in only and candidate.name not in only:
            continue
        if not why_not(name, rig, outputs, supply_stands):
            found.append(candidate)
    return found


def why_not(name: str, rig: Rig, outputs: Sequence[str], supply_stands: bool = False) -> str:
    """
    Return why an effect cannot be tried on a rig, nothing where it can.

    Parameters
    ----------
    name : str
        Of a formulation.
    rig, outputs, supply_stands
        As of :func:`candidates`.

    """
    effect = get_effect(name)
    if rig.valve not in effect.valves:
        return f'it acts with valve {" or ".join(effect.valves)}, the model has {rig.valve}'
    if rig.effect(name) is not None:
        return 'the model has it'
    if effect.subsystem == 'load' and rig.is_driven:
        return f'it acts on a load that moves freely, the model has `{rig.load}`'
    if effect.subsystem == 'valve' and 'pressure' not in outputs:
        return 'the pressure that the valve gives is not compared'
    signal = effect.fitting.sensor_signal
    # The pressure is compared, or it drives muscle and load.
    if effect.subsystem == 'sensor' and signal not in ('pressure', *outputs):
        return f'it acts on the sensor of the {signal}, whose readings are not compared'
    if supply_stands and 'supply' in effect.hooks:
        return 'the recorded supply pressure stands still'
    return ''


def left_out(only: Collection[str] | None, pool: Collection[Candidate], rig: Rig,
             outputs: Sequence[str], supply_stands: bool = False) -> list[str]:
    """
    Return a sentence for every name asked for that is not tried, with the reason.

    Parameters
    ----------
    only : sequence of str, optional
        Names asked for.
    pool : list of Candidate
        What is tried.
    rig, outputs, supply_stands
        As of :func:`candidates`.

    """
    tried = {name for c in pool for name in (c.effect, c.name)}
    return [f'`{name}` was asked for and is not tried: '
            f'{why_not(name, rig, outputs, supply_stands)}.'
            for name in dict.fromkeys(only or ()) if name not in tried]


def within_reading(pool: Iterable[Candidate], recordings: Sequence[Recording], criteria: Criteria
                   ) -> list[Candidate]:
    """
    Return candidates of which none puts a given pressure below that of the atmosphere.

    A zero of the sensor looks like a threshold pressure in muscle and load. A reading of an empty
    muscle tells them apart: the sensor reads no more there than its zero.

    Parameters
    ----------
    pool : list of Candidate
        What may be added.
    recordings : list of Recording
        That are searched.
    criteria : Criteria
        Decision thresholds.

    """
    highest_pa = min((_lowest_pa(r, criteria) for r in recordings if r.pressure_given),
                     default=math.inf)
    found = []
    for c in pool:
        effect = get_effect(c.effect)
        if (effect.fitting.sensor_signal, effect.fitting.sensor_change) == ('pressure', 'bias'):
            c = replace(c, free=tuple(
                replace(f, upper=max(min(f.upper, highest_pa), f.lower))
                if f.name == effect.sensor_parameter else f for f in c.free))
        found.append(c)
    return found


def _lowest_pa(recording: Recording, criteria: Criteria) -> float:
    """Return the lowest reading of the pressure, above the atmosphere and with its noise."""
    time_s, values = recording.time_s['pressure'], recording.measured['pressure']
    noise = noise_of(time_s, values)
    return (float(means_of(values, time_s, LOWEST_S).min()) - P_ATM_PA
            + criteria.hint_sd * noise.sd)


def relatives(rig: Rig, outputs: Sequence[str], name: str) -> list[Candidate]:
    """Return what may be taken for a name on a rig, and is named only by who asks for it."""
    return candidates(rig, outputs, [
        effect.name for effect in effects().values() if name in effect.relative_of])


def split_refinements(pool: Collection[Candidate]) -> tuple[list[Candidate], list[Candidate]]:
    """
    Return (candidates to begin with, refinements of some of them).

    A refinement differs little from another formulation of its name and is tried after that;
    where the other is not in the pool, it is one to begin with.
    """
    names = {c.name for c in pool if not c.is_refinement}
    refined = [c for c in pool if c.is_refinement and c.name in names]
    return [c for c in pool if c not in refined], refined
