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
The model of a preset, on a rig that moves otherwise than the one it was searched on.

The presets ``sofc_model_…`` of a muscle were searched on ``dmsp_5_300_realistic`` and rigs about
it. Their model finds the inertia within a factor (``inertia_range``) of the setting, and their
feedback was as strong as that rig bears. A light load on a thick muscle has a tenth of the
inertia per pascal, and moves twice as far per pascal. There a model of the other rig makes the
muscle swing by millimetres. What the rig's file states is therefore used, as it is for the
static inverse.
"""

import math
from typing import TYPE_CHECKING

from pam_actuation.control.compiled_controller import CompiledController
from pam_actuation.control.sofc.settings import INERTIA, predicted_gains
from pam_sim.rig import Rig

if TYPE_CHECKING:
    from pam_actuation.control.config import Controller
    from pam_sim.joint.rig import JointRig

# Of the rig of the presets at the strain below: pressure per acceleration, and per contraction.
HOME_INERTIA_PA_S2_PER_M, HOME_SLOPE_PA_PER_M = 2.3e4, 9.5e6
STRAIN = 14e-3 / 300e-3         # the middle of its motions
LEAST_SLOPE = 0.6               # of that at home: above, the feedback stays as it is
_PART_OF_LOAD, _PART_OF_LENGTH = 0.02, 0.002


def inertia_and_slope(rig: Rig) -> tuple[float, float] | None:
    """
    Return what a rig's file says of its motion near the middle of its stroke, or None.

    Pressure per acceleration [Pa s2/m]: the mass over the force that one pascal makes. Pressure
    per contraction at rest [Pa/m]. None where nothing moves freely, or cannot be held there.
    """
    mass_kg = rig.parameters.get('mass_kg')
    if mass_kg is None or rig.is_driven:
        return None
    there_m = STRAIN * rig.muscle.length_m
    load_n = float(rig.tension_n(there_m))
    more_n, more_m = _PART_OF_LOAD * load_n, _PART_OF_LENGTH * rig.muscle.length_m
    heavier_pa, lighter_pa = (
        float(rig.static_pressure_pa(there_m, load_n + one)) for one in (more_n, -more_n))
    beyond_pa, before_pa = (
        float(rig.static_pressure_pa(there_m + one)) for one in (more_m, -more_m))
    inertia = mass_kg * (heavier_pa - lighter_pa) / (2.0 * more_n) if more_n > 0.0 else math.nan
    slope = (beyond_pa - before_pa) / (2.0 * more_m)
    found = inertia, slope
    return found if all(math.isfinite(one) and one > 0.0 for one in found) else None


def suited(controller: 'Controller', rig: 'JointRig | Rig | None') -> 'Controller':
    """
    Return a preset with the inertia of a rig, where that is far from the one of its own rig.

    Within ``inertia_range`` of it the preset stays as it is, since its model finds the rest. A
    muscle that moves further per pascal gets so much less feedback on the predicted error.
    A controller without a model, of a joint or of a force is returned unchanged.
    """
    if not isinstance(controller, CompiledController) or not isinstance(rig, Rig):
        return controller
    settings = controller.settings
    gains = predicted_gains(settings) if controller.kind == 'sofc' else []
    found = inertia_and_slope(rig) if gains else None
    if found is None:
        return controller
    changed = {}
    times = found[0] / HOME_INERTIA_PA_S2_PER_M
    if not 1.0 / settings['inertia_range'] <= times <= settings['inertia_range']:
        changed[INERTIA] = settings[INERTIA] * times
    weaker = found[1] / HOME_SLOPE_PA_PER_M
    if weaker < LEAST_SLOPE:
        changed |= {name: settings[name] * weaker for name in gains}
    return controller.with_settings(changed) if changed else controller
