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
On/off valves: the averaged model on openings, which follow every pulse where these are seen.

The averaged valves take a mean opening. Given the mean of every millisecond in place of that of a
period, they follow single pulses. Pulses then move smoothly in time, as a fit needs it, whatever
their phase in the recording.

Where the mean of a period acts, opening and closing times give every duty its opening before the
mean of a millisecond is taken. The opening of a mean duty is another one.
"""

from typing import TYPE_CHECKING

from pam_sim.effects.registry import get_effect
from pam_sim.gap.data.pulses import Pulses

if TYPE_CHECKING:
    from pam_sim.rig import Rig


def pulses_of(rig: 'Rig') -> Pulses | None:
    """Return how the valves of a rig follow their pulses, None where a duty is the opening."""
    if rig.valve != 'hsv':
        return None
    period_s, averaged = rig.parameters['pwm_period_s'], rig.fidelity != 'switching'
    shaping = [e for e in rig.effects if get_effect(e.name).fitting.edges]
    if not shaping or (averaged and len(shaping) > 1):
        return None if averaged else Pulses(period_s)
    effect = get_effect(shaping[0].name)
    value = {p.name: p.default for p in effect.parameters} | dict(shaping[0].parameters)
    opens_s, closes_s = (value[name] for name in effect.fitting.edges)
    ramp_s = min(value.get('ramp_s', 0.0), 2.0 * opens_s, 2.0 * closes_s)
    return Pulses(period_s, opens_s, closes_s,
                  min(value.get('rise_s', ramp_s), 2.0 * opens_s),
                  min(value.get('fall_s', ramp_s), 2.0 * closes_s), averaged)


def on_openings(rig: 'Rig') -> 'Rig':
    """Return the rig that takes openings; what makes these of duties or pulses is left out."""
    if pulses_of(rig) is None:
        return rig
    return rig.with_(fidelity='averaged', effects=[
        e for e in rig.effects if not get_effect(e.name).fitting.edges])
