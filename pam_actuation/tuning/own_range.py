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

"""The ranges of a controller that is to be tuned: those of the rig and of what it is to follow."""

from collections.abc import Sequence
import math
from typing import TYPE_CHECKING

from pam_actuation.control.sofc.controller import SelfOrganizingFuzzyController
from pam_actuation.experiments.limits import highest_gauge_pa
from pam_actuation.tuning.problem import rebuild
from pam_sim.joint.rig import JointRig

if TYPE_CHECKING:
    from pam_actuation.experiments.experiment import Experiment
    from pam_actuation.tuning.problem import Law
    from pam_sim.rig import Rig

_GRID_M, _GRID_PA = 1e-3, 1e3       # ranges are rounded to what people read


def with_own_range(controller: 'Law', rig: 'Rig | JointRig', experiments: 'Sequence[Experiment]'
                   ) -> 'tuple[Law, list[str]]':
    """
    Return a controller whose ranges are those of its rig, and a sentence on each that changed.

    The presets are for the 5 mm muscle and a regulator of 600 kPa. Feed-forward rules end at
    ``reference_upper_m``: where the experiments go beyond, it becomes what they ask for. The
    highest command becomes what regulator, supply and driver allow, where that is less. Rules
    that have learned keep their range.

    Parameters
    ----------
    controller : SelfOrganizingFuzzyController, PidController or another law
        As loaded; it stays as it is.
    rig : Rig or JointRig
        Ranges of a joint are left as they are.
    experiments : sequence of Experiment
        What the controller is to follow.

    """
    if isinstance(rig, JointRig):
        return controller, []
    settings, said = {}, []
    allowed_pa = _GRID_PA * math.floor(highest_gauge_pa(rig) / _GRID_PA + 1e-9)
    highest_pa = controller.settings.get('max_pressure_gauge_pa', 0.0)
    if highest_pa > allowed_pa > controller.settings.get('min_pressure_gauge_pa', 0.0):
        settings['max_pressure_gauge_pa'] = allowed_pa
        said.append(f'max_pressure_gauge_pa is {1e-3 * allowed_pa:.0f} kPa instead of '
                    f'{1e-3 * highest_pa:.0f}: more is not to be had on {rig.name}')
    asked_m = max((one.chain.extremes()[1] for one in experiments
                   if one.domain == 'contraction'), default=0.0)
    if isinstance(controller, SelfOrganizingFuzzyController) \
            and asked_m > controller.settings['reference_upper_m'] \
            and not controller.rules.has_learned():
        upper_m = round(_GRID_M * math.ceil(asked_m / _GRID_M - 1e-9), 6)
        settings['reference_upper_m'] = upper_m
        said.append(f'reference_upper_m is {1e3 * upper_m:g} mm instead of '
                    f'{1e3 * controller.settings["reference_upper_m"]:g}: the experiments ask '
                    'for that')
    return (rebuild(controller, settings) if settings else controller), said
