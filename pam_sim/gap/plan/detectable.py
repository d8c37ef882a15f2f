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

"""The smallest size of each effect that shows in a recording."""

from collections.abc import Iterable, Sequence
from typing import Any

from pam_sim.effects.registry import effects, get_effect
from pam_sim.gap.select.candidates import why_not
from pam_sim.gap.select.screening import Screened
from pam_sim.rig import Rig

NOT_PROPORTIONAL = 'what it does is not about proportional to any of its parameters'
NOT_SEEN = 'it was not tried, or changes no signal here'
BEYOND_RANGE = 'it would show only beyond the range in which it is fitted'


def least_sizes(screened: Iterable[Screened], rig: Rig, floors: float = 1.0
                ) -> dict[str, dict[str, Any]]:
    """
    Return the smallest size of each effect that shows, as ``minimum_detectable`` of gap.json.

    A size shows when its signature, freed of what the known numbers can do, has an rms of
    ``floors`` noise floors. Effects whose response is not about proportional to their
    size are left out, and those that show only beyond the range of a parameter.
    """
    found = {}
    for s in screened:
        effect = get_effect(s.candidate.effect)
        if effect.variant_of or not s.candidate.amplitudes or s.seen <= 0.0:
            continue
        factor = floors / s.seen
        values = {f.name: s.size[f.name] * (1.0 if f.shape else factor)
                  for f in s.candidate.free}
        if any(not f.lower <= values[f.name] <= f.upper for f in s.candidate.free):
            continue
        report = effect.report(effect.values(s.candidate.setting(values)['parameters']), rig)
        quantity, (value, unit) = next(iter(report.items()))
        found[effect.name] = {'value': float(value), 'unit': unit, 'quantity': quantity}
    return found


def why_none(name: str, screened: Iterable[Screened], rig: Rig) -> str:
    """Return why ``least_sizes`` has none of an effect that can be tried."""
    if all(f.shape for f in get_effect(name).free_parameters(rig.valve)):
        return NOT_PROPORTIONAL
    seen = any(s.seen > 0.0 for s in screened if s.candidate.effect == name)
    return BEYOND_RANGE if seen else NOT_SEEN


def sizes_or_reasons(screened: Sequence[Screened], rig: Rig, outputs: Sequence[str],
                     floors: float = 1.0) -> dict[str, dict[str, Any]]:
    """
    Return ``least_sizes``, and for every other effect of the valve why it has none (``why``).

    ``outputs`` are the signals that are compared.
    """
    sizes = least_sizes(screened, rig, floors)
    found = {name: {**one, 'why': None} for name, one in sizes.items()}
    for name, effect in effects().items():
        if (name in found or effect.variant_of or effect.relative_of
                or rig.valve not in effect.valves):
            continue
        quantity, (_, unit) = next(iter(effect.report(effect.values({}), rig).items()))
        found[name] = {
            'value': None, 'unit': unit, 'quantity': quantity,
            'why': why_not(name, rig, outputs) or why_none(name, screened, rig)}
    return found
