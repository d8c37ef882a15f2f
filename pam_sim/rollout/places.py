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
What stands behind the rig's own records in ``state`` and ``par``: effects, load, force law.

``state`` holds ``layout.STATE``, then ``STATES``. ``par`` holds ``layout.PARAMETERS``, then
``ACTING``, ``PACKED``, the record of a load with a force of its own, and last that of the law.
"""

from pam_sim.effects.registry import all_effects, effects
from pam_sim.load import LOADS
from pam_sim.load.registry import has_force, packed_of
from pam_sim.muscle.registry import laws
from pam_sim.records import place_of, record, size_of
from pam_sim.rollout.layout import EFFECTS, PARAMETERS, STATE, TERMS

_EFFECTS = all_effects()
ACTING = record(*_EFFECTS)                  # 1: the effect acts
PACKED = record(*((name, effect.packed) for name, effect in _EFFECTS.items()))
STATES = record(*((name, effect.states) for name, effect in _EFFECTS.items()
                  if effect.states is not None))

STATES_PLACE = size_of(STATE)
ACTING_PLACE = size_of(PARAMETERS)
PACKED_PLACE = ACTING_PLACE + size_of(ACTING)
LOAD_PLACE = PACKED_PLACE + size_of(PACKED)
LAW_PLACE = LOAD_PLACE + max(
    (size_of(packed_of(load)) for load in LOADS.values() if has_force(load)), default=0)
STATE_SIZE = STATES_PLACE + size_of(STATES)

# Where each effect has its packed parameters in ``par`` and its states in ``state``.
PLACES = {
    name: (PACKED_PLACE + place_of(PACKED, name),
           STATES_PLACE + place_of(STATES, name) if effect.states is not None else STATE_SIZE)
    for name, effect in _EFFECTS.items()}

# The numbers of ``par`` that are 1 when an effect acts.
FLAGS = {name: (ACTING_PLACE + place_of(ACTING, name),
                *(place_of(PARAMETERS, 'used') + place_of(PARAMETERS['used'], hook)
                  for hook in effect.hooks))
         for name, effect in _EFFECTS.items()}

BEYOND_PLACE = place_of(PARAMETERS, 'beyond_nominal')
# What stands there at least when an effect acts.
BEYOND = {name: EFFECTS if name in effects() else TERMS for name in _EFFECTS}

_FAST_LAW = 'sarosi'                        # of the nominal rig: no call is left of it


def law_codes() -> dict[str, float]:
    """Return {law name: its number in ``par.law``}, 0 the fast one."""
    return {name: float(code) for code, name in enumerate(
        sorted(laws(), key=lambda name: (name != _FAST_LAW, name)))}


def load_codes() -> dict[str, float]:
    """Return {load name: its number in ``par.load``}, 0 for those whose force the step has."""
    own = [name for name, load in LOADS.items() if has_force(load)]
    return {name: float(own.index(name) + 1 if name in own else 0) for name in LOADS}
