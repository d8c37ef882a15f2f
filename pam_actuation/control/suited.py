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

The presets ``sofc_model_…`` were searched on one rig or joint and on others about it. Their model
finds the inertia within a factor (``inertia_range``) of the setting, and their feedback was as
strong as that rig bears. A light load on a thick muscle has a tenth of the inertia per pascal,
and moves twice as far per pascal. There a model of the other rig makes the muscle swing by
millimetres, and a limb by 20 degrees. What the file of the rig states is therefore used, as it is
for the static inverse.
"""

import math
from typing import TYPE_CHECKING

from pam_actuation.control.compiled_controller import CompiledController
from pam_actuation.control.modes.force import STIFFNESS
from pam_actuation.control.modes.joint import CO_CONTRACTION_GAUGE_PA, JointController
from pam_actuation.control.sofc.settings import INERTIA, predicted_gains
from pam_sim.joint.rig import JointRig
from pam_sim.located_yaml import Located
from pam_sim.rig import Rig
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_actuation.control.config import Controller

# Of the rig of the presets of a muscle, at the strain below: pressure per acceleration, and per
# contraction.
HOME_INERTIA_PA_S2_PER_M, HOME_SLOPE_PA_PER_M = 2.3e4, 9.5e6
STRAIN = 14e-3 / 300e-3         # the middle of its motions
# Of the muscle of a preset of a force, and how far another may be off and count as the same.
HOME_FORCE_PER_PA, SAME_FORCE = 2.18e-4, 0.3
LEAST_SLOPE = 0.6               # of that at home: above, the feedback stays as it is
# Of the joints of the other presets, by a part of their names: pressure per acceleration.
HOME_OF_JOINTS_PA_S2_PER_M = {'joint': 6.45e4, 'knee': 1.737e5}
_PART_OF_LOAD, _PART_OF_LENGTH, _STEP_PA = 0.02, 0.002, 2e3


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


def joint_inertia(joint: JointRig) -> float | None:
    """
    Return the pressure per acceleration [Pa s2/m] of a joint in the middle of its range, or None.

    The pressure is half of the difference of both muscles, about the usual co-contraction. The
    acceleration is that of the contraction of the flexor. None where a pressure makes no torque.
    """
    middle_rad = 0.5 * sum(joint.range_rad)
    mean_pa = P_ATM_PA + CO_CONTRACTION_GAUGE_PA
    flexing, extending = (joint.static_torque_n_m(middle_rad, mean_pa + one, mean_pa - one)
                          for one in (_STEP_PA, -_STEP_PA))
    torque_per_pa = (flexing - extending) / (2.0 * _STEP_PA)
    if not torque_per_pa > 0.0:
        return None
    return float(joint.parameters['inertia_kg_m2']
                 / (joint.parameters['flexor_radius_m'] * torque_per_pa))


def force_per_pa(rig: Rig) -> float:
    """Return the force that a pascal makes [N/Pa], about 300 kPa and the middle of the stroke."""
    law = rig.muscle.law.law
    high_n, low_n = (float(law.formula_n(CO_CONTRACTION_GAUGE_PA + one, STRAIN))
                     for one in (_STEP_PA, -_STEP_PA))
    return rig.parameters['force_map_gain'] * (high_n - low_n) / (2.0 * _STEP_PA)


def for_muscle(tree: Located, rig: JointRig | Rig | None) -> Located:
    """
    Return the file of a preset of a force, as it suits a muscle of another size.

    So many newtons count as one metre there as suit the muscle it was searched on. A muscle that
    makes ten times the force of a pascal would get ten times the feedback, and swing. So ten
    times as many newtons count as one metre.
    """
    block = tree.get('force', dict)
    stated = None if block is None else STIFFNESS.read(block)
    if block is None or stated is None or not isinstance(rig, Rig):
        return tree
    times = force_per_pa(rig) / HOME_FORCE_PER_PA
    if not times > 0.0 or abs(times - 1.0) <= SAME_FORCE:
        return tree
    return tree.with_(force=block.with_(**{STIFFNESS.name: stated * times}))


def suited(controller: 'Controller', preset: str, rig: JointRig | Rig | None) -> 'Controller':
    """
    Return a preset with the inertia of a rig, where that is far from the one of its own rig.

    Within ``inertia_range`` of it the preset stays as it is, since its model finds the rest. A
    muscle that moves further per pascal gets so much less feedback on the predicted error, and a
    joint as much less as it has less inertia. A controller without a model, or of a force, is
    returned unchanged.

    Parameters
    ----------
    controller : Controller
        As its file has it.
    preset : str
        Its name.
    rig : Rig, JointRig or None
        What it shall run on.

    """
    settings, changed = controller.settings, {}
    gains = predicted_gains(settings) if controller.kind == 'sofc' else []
    if not gains:
        return controller
    times, weaker = 1.0, 1.0
    if isinstance(rig, Rig) and isinstance(controller, CompiledController):
        found = inertia_and_slope(rig)
        if found is not None:
            times = found[0] / HOME_INERTIA_PA_S2_PER_M
            slope = found[1] / HOME_SLOPE_PA_PER_M
            weaker = slope if slope < LEAST_SLOPE else 1.0
    elif isinstance(rig, JointRig) and isinstance(controller, JointController):
        inertia = joint_inertia(rig)
        home = next((number for name, number in HOME_OF_JOINTS_PA_S2_PER_M.items()
                     if f'_{name}_' in preset), None)
        if inertia is not None and home is not None:
            times = inertia / home
            weaker = times if times < 1.0 / settings['inertia_range'] else 1.0
    if not 1.0 / settings['inertia_range'] <= times <= settings['inertia_range']:
        changed[INERTIA] = settings[INERTIA] * times
    if weaker < 1.0:
        changed |= {name: settings[name] * weaker for name in gains}
    return controller.with_settings(changed) if changed else controller
