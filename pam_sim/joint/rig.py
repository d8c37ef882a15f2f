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

"""The joint: flexor, extensor and limb as one object that can be simulated."""

from dataclasses import dataclass, field, replace
from typing import Any, TYPE_CHECKING

from numpy.typing import ArrayLike
from pam_sim.annotations import Number
from pam_sim.declared import check_mapping, shown
from pam_sim.effects.registry import get_effect
from pam_sim.errors import InputError
from pam_sim.joint.parameters import NAME, PARAMETERS, SIDES
from pam_sim.joint.text import joint_to_yaml
from pam_sim.parameters import check_parameters

if TYPE_CHECKING:
    from pam_sim.joint.plant import JointPlant
    from pam_sim.joint.response import JointResponse
    from pam_sim.rig import Rig


@dataclass(frozen=True)
class JointRig:
    """
    A joint; made by :func:`pam_sim.joint.load_joint`, changed by :meth:`with_`.

    Parameters
    ----------
    name : str
    flexor, extensor : pam_sim.rig.Rig
        Each with load ``driven``: valve, parameters, effects and sensors are its own.
        The flexor turns towards positive angles.
    parameters : dict
        Numbers of joint and limb, name -> value, SI; nominal where not given.

    Raises
    ------
    InputError
        Another load, an effect of a load, a number out of bounds, stops without a range.

    """

    name: str
    flexor: 'Rig'
    extensor: 'Rig'
    parameters: dict[str, float] = field(default_factory=dict)

    load = NAME

    def __post_init__(self) -> None:
        """Check the muscles and fill in nominal numbers."""
        if not isinstance(self.name, str):
            raise InputError(f'is {shown(self.name)}; a text is needed', 'name')
        for side in SIDES:
            self._check_side(side)
        object.__setattr__(self, 'parameters', check_parameters(PARAMETERS, self.parameters))
        value = self.parameters
        least = value['limb_mass_kg'] * value['centre_of_mass_m'] ** 2
        if value['inertia_kg_m2'] < least * (1.0 - 1e-9):
            raise InputError(
                f'`inertia_kg_m2` is {value["inertia_kg_m2"]:g}; limb_mass_kg times '
                f'centre_of_mass_m squared, {least:g} kg m^2, is the least possible', 'parameters')
        lower, upper = self.range_rad
        if not lower < upper:
            raise InputError(
                f'the joint cannot move: stops and stretched muscles leave {lower:g} to '
                f'{upper:g} rad', 'parameters')

    def _check_side(self, side: str) -> None:
        rig = getattr(self, side)
        _check_rig(rig, side)
        if rig.load != 'driven':
            raise InputError(f'has load `{rig.load}`; a muscle of a joint has load `driven`', side)
        for setting in rig.effects:
            if get_effect(setting.name).subsystem == 'load':
                raise InputError(
                    f'effect `{setting.name}` acts on the load of a single muscle; a joint has '
                    'its own `friction_n_m` and `damping_n_m_s`', side)

    @property
    def muscles(self) -> dict[str, 'Rig']:
        """Return its muscles by the place below its namespace: ``flexor/`` and ``extensor/``."""
        return {f'{side}/': getattr(self, side) for side in SIDES}

    @property
    def valve(self) -> str:
        """Return the valve of the flexor; that of the extensor is the same as a rule."""
        return self.flexor.valve

    @property
    def range_rad(self) -> tuple[float, float]:
        """Joint angles (lower, upper) between the stops: an end stop or a stretched braid."""
        value = self.parameters
        return (max(value['lower_stop_rad'],
                    -value['flexor_contraction_at_zero_m'] / value['flexor_radius_m']),
                min(value['upper_stop_rad'],
                    value['extensor_contraction_at_zero_m'] / value['extensor_radius_m']))

    def contractions_m(
            self, angle_rad: Number) -> tuple[Number, Number]:
        """Return (flexor, extensor) contraction [m] by the pulley; scalars or arrays."""
        value = self.parameters
        return (value['flexor_contraction_at_zero_m'] + value['flexor_radius_m'] * angle_rad,
                value['extensor_contraction_at_zero_m'] - value['extensor_radius_m'] * angle_rad)

    def with_(self, parameters: dict[str, float] | None = None, flexor: 'Rig | None' = None,
              extensor: 'Rig | None' = None, valve: str | None = None, fidelity: str | None = None,
              name: str | None = None) -> 'JointRig':
        """
        Return a changed copy.

        Parameters
        ----------
        parameters : dict, optional
            Numbers of the joint to change, the others stay.
        flexor, extensor : Rig, optional
            Instead of the present ones.
        valve, fidelity : str, optional
            Of both muscles.
        name : str, optional
            Instead of the present one.

        Raises
        ------
        InputError
            As of the class.

        """
        if parameters is not None:
            check_mapping(parameters, 'parameters')
        for side, given in zip(SIDES, (flexor, extensor)):
            if given is not None:
                _check_rig(given, side)
        sides = {side: (given or getattr(self, side)).with_(valve=valve, fidelity=fidelity)
                 for side, given in zip(SIDES, (flexor, extensor))}
        return replace(self, name=name or self.name, **sides,
                       parameters={**self.parameters, **(parameters or {})})

    # -- statics ---------------------------------------------------------------------------
    def static_torque_n_m(self, angle_rad: float, flexor_pressure_pa: float,
                          extensor_pressure_pa: float, external_torque_n_m: float = 0.0) -> float:
        """
        Return the net torque [N m] on the limb at rest at an angle, without dry friction.

        Parameters
        ----------
        angle_rad : float
            Joint angle.
        flexor_pressure_pa, extensor_pressure_pa : float
            Absolute, Pa.
        external_torque_n_m : float
            Flexion positive.

        """
        from pam_sim.joint.statics import static_torque
        return static_torque(self, angle_rad, (flexor_pressure_pa, extensor_pressure_pa),
                             external_torque_n_m)

    def static_angle_rad(self, flexor_pressure_pa: float, extensor_pressure_pa: float,
                         external_torque_n_m: float = 0.0, near_rad: float | None = None) -> float:
        """
        Return the angle [rad] at which the joint rests, without dry friction.

        Where several angles are stable, the one nearest to ``near_rad`` (the
        angle at which the limb hangs, as far as the stops allow).

        Parameters
        ----------
        flexor_pressure_pa, extensor_pressure_pa : float
            Absolute, Pa.
        external_torque_n_m : float
            Flexion positive.
        near_rad : float, optional
            Which of several angles to choose.

        """
        from pam_sim.joint.statics import static_angle
        return static_angle(self, (flexor_pressure_pa, extensor_pressure_pa),
                            external_torque_n_m, near_rad)

    def stiffness_n_m_per_rad(self, angle_rad: float, flexor_pressure_pa: float,
                              extensor_pressure_pa: float) -> float:
        """Return minus the slope of the static torque over the angle, gravity included."""
        step = 1e-5
        return -(self.static_torque_n_m(angle_rad + step, flexor_pressure_pa, extensor_pressure_pa)
                 - self.static_torque_n_m(angle_rad - step, flexor_pressure_pa,
                                          extensor_pressure_pa)) / (2.0 * step)

    # -- dynamics --------------------------------------------------------------------------
    def simulate(self, flexor_signal: ArrayLike, extensor_signal: ArrayLike,
                 external_torque_n_m: ArrayLike | None = None, dt_s: float = 0.001,
                 **initial: float) -> 'JointResponse':
        """
        Simulate with recorded or made-up inputs, each held from sample i to i + 1.

        Parameters
        ----------
        flexor_signal, extensor_signal : array_like, shape (N,) or (N, 2)
            PPR voltage [V], or HSV fill and vent duty [0..1], by the valve of each muscle.
        external_torque_n_m : float or array_like, shape (N,), optional
            On the limb, flexion positive, N m.
        dt_s : float
            Step, s; a light limb on a large pulley takes several coupling steps in it.
        **initial
            As for :func:`pam_sim.joint.packing.pack_joint`.

        Returns
        -------
        JointResponse

        Raises
        ------
        InputError
            Wrong shape, number not finite or out of range.

        """
        from pam_sim.joint.simulate import simulate_joint
        return simulate_joint(
            self, flexor_signal, extensor_signal, external_torque_n_m, dt_s, initial)

    def plant(self, seed: int = 0, dt_s: float = 0.001, **initial: float) -> 'JointPlant':
        """Return a live :class:`pam_sim.joint.plant.JointPlant` of this joint."""
        from pam_sim.joint.plant import JointPlant
        return JointPlant(self, seed, dt_s, **initial)

    # -- text ------------------------------------------------------------------------------
    def to_yaml(self) -> str:
        """Return a model file that :func:`pam_sim.joint.load_joint` turns into an equal joint."""
        return joint_to_yaml(self)


def _check_rig(given: Any, side: str) -> None:
    """Refuse what is no rig of a single muscle."""
    from pam_sim.rig import Rig
    if not isinstance(given, Rig):
        raise InputError(f'is {shown(given)}; give a Rig with load `driven`', side)
