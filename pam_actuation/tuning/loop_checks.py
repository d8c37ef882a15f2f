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

"""What a closed loop refuses: rigs, experiments and controllers that do not go together."""

from collections.abc import Sequence
from typing import Any, TYPE_CHECKING

from pam_actuation.control.compiled_controller import CompiledController
from pam_actuation.control.made_for import check_valve
from pam_actuation.control.modes.tracked import Tracked, tracked_by
from pam_actuation.control.modes.wrapped import WrappedLaw
from pam_actuation.drivers.config import DriverConfig
from pam_sim.declared import check_kind, shown
from pam_sim.errors import InputError

if TYPE_CHECKING:
    from pam_sim.rig import Rig

_CONTROLLER = 'controller', 'load_controller(NAME, rig)'
_CALLS = {'Rig': ('rig', 'load_rig(NAME)'), 'JointRig': ('joint', 'load_joint(NAME)')}


def check_parts(rig: Any, kind: type, experiment: Any, domain: str) -> None:
    """
    Refuse a rig or an experiment of another kind.

    Parameters
    ----------
    rig : Rig or JointRig
        What is simulated.
    kind : type
        Which of both it must be.
    experiment : Experiment
        What is tracked.
    domain : str
        The one that it must have.

    Raises
    ------
    InputError
        One of them is something else, such as a name.

    """
    from pam_actuation.experiments.experiment import Experiment
    check_kind(rig, kind, *_CALLS[kind.__name__])
    check_kind(experiment, Experiment, 'experiment', 'load_experiment(NAME)')
    if experiment.domain != domain:
        raise InputError(f'experiment {experiment.name} is in {experiment.domain}; this loop '
                         f'tracks {domain}')


def check_drivers(drivers: Any, count: int, name: str) -> None:
    """
    Refuse what is no driver's knowledge for each muscle.

    Parameters
    ----------
    drivers : sequence of DriverConfig
        One for each muscle.
    count : int
        Number of muscles.
    name : str
        Name of the argument, for the message.

    Raises
    ------
    InputError
        Another number of them, or something else.

    """
    if not isinstance(drivers, Sequence) or len(drivers) != count:
        raise InputError(f'is {shown(drivers)}; give {count}, as `driver_config(rig)` returns',
                         name)
    for one in drivers:
        check_kind(one, DriverConfig, name, 'driver_config(rig)')


def check_tracking(rigs: Sequence[Any], experiments: Sequence[Any], controller: Any) -> None:
    """
    Refuse rigs, experiments and a controller that cannot be searched together.

    Parameters
    ----------
    rigs : sequence of Rig or JointRig
        What is simulated.
    experiments : sequence of Experiment
        What is tracked on them.
    controller : Controller
        What is to be tuned on them.

    Raises
    ------
    InputError
        One of them is something else, such as a name, or a load does not move by itself.

    """
    from pam_actuation.experiments.experiment import Experiment
    from pam_sim.joint.rig import JointRig
    from pam_sim.rig import Rig
    for rig in rigs:
        check_kind(rig, (Rig, JointRig), *_CALLS['Rig'])
        if isinstance(rig, Rig):
            check_free(rig)
    for experiment in experiments:
        check_kind(experiment, Experiment, 'experiment', 'load_experiment(NAME)')
    check_kind(controller, (CompiledController, WrappedLaw), *_CONTROLLER)


def check_free(rig: 'Rig') -> None:
    """Raise InputError for a load that does not move by itself."""
    if rig.is_driven:
        raise InputError(
            f'load `{rig.load}` of {rig.name} does not move by itself; a contraction can be '
            'tracked on a load that moves freely', 'rig')


def check_controller(controller: Any, tracked: Tracked, valve: str, rate_hz: float) -> None:
    """
    Refuse a controller that tracks something else, is made for the other valve, or another rate.

    Parameters
    ----------
    controller : Controller
        As ``load_controller`` returns it.
    tracked : Tracked
        What the loop tracks.
    valve : str
        That of the loop: ``ppr`` or ``hsv``.
    rate_hz : float
        That of the loop.

    Raises
    ------
    InputError
        It does not fit, or is no controller.

    """
    check_kind(controller, (CompiledController, WrappedLaw), *_CONTROLLER)
    if tracked_by(controller) != tracked:
        raise InputError(
            f'the controller tracks {tracked_by(controller).mode}, this loop {tracked.mode}')
    check_valve(controller, valve)
    if controller.rate_hz != rate_hz:
        raise InputError(
            f'the controller runs at {controller.rate_hz:g} Hz, this loop at {rate_hz:g} Hz')


def check_wrapped(controller: Any, tracked: Tracked, valve: str, rate_hz: float) -> None:
    """Refuse what ``check_controller`` does, and a law that no loop of a mode has."""
    check_controller(controller, tracked, valve, rate_hz)
    if controller.kind != 'sofc':
        raise InputError(f'this loop runs sofc controllers, not {controller.kind}')
