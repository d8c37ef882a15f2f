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
On/off valves that switch: the averaged model on openings that follow every pulse.

The averaged valves take a mean opening. Given the mean of every millisecond in place of that of a
period, they follow single pulses. Pulses then move smoothly in time, as a fit needs it, whatever
their phase in the recording.
"""

from typing import TYPE_CHECKING

from pam_sim.effects.registry import get_effect
from pam_sim.gap.data.pulses import Pulses

if TYPE_CHECKING:
    from pam_sim.rig import Rig


def pulses_of(rig: 'Rig') -> Pulses | None:
    """Return how the valves of a rig follow their pulses, None where they do not switch."""
    if rig.valve != 'hsv' or rig.fidelity != 'switching':
        return None
    period_s = rig.parameters['pwm_period_s']
    for setting in rig.effects:
        effect = get_effect(setting.name)
        if effect.fitting.edges:
            value = {p.name: p.default for p in effect.parameters} | dict(setting.parameters)
            opens_s, closes_s = (value[name] for name in effect.fitting.edges)
            ramp_s = min(value.get('ramp_s', 0.0), 2.0 * opens_s, 2.0 * closes_s)
            return Pulses(period_s, opens_s, closes_s,
                          min(value.get('rise_s', ramp_s), 2.0 * opens_s),
                          min(value.get('fall_s', ramp_s), 2.0 * closes_s))
    return Pulses(period_s)


def on_openings(rig: 'Rig') -> 'Rig':
    """Return the rig that takes openings of single pulses; what shapes these is left out."""
    if pulses_of(rig) is None:
        return rig
    return rig.with_(fidelity='averaged', effects=[
        e for e in rig.effects if not get_effect(e.name).fitting.edges])
