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

"""Size of a muscle, and the air in it when it is taken for a cylinder."""

from dataclasses import dataclass

from pam_sim.annotations import FloatArray, Number
from pam_sim.errors import InputError
from pam_sim.muscle import geometry
from pam_sim.muscle.muscle import Muscle
from pam_sim.rig import Rig
from pam_sim.units import absolute_pa, GAS_CONSTANT_AIR, TEMPERATURE_K


@dataclass(frozen=True)
class Dimensions:
    """
    What the cylinder approximation needs to know of a muscle.

    Parameters
    ----------
    length_m : float
        Length at zero contraction.
    bore_m : float or None
        Inner diameter at zero contraction; without it no volume of air can be said.
    dead_volume_m3 : float
        Air beside the muscle: fittings and tube.
    braid_angle_rad : float
        Of the threads, from the axis, at zero contraction.

    Raises
    ------
    InputError
        A size that no muscle has.

    """

    length_m: float
    bore_m: float | None = None
    dead_volume_m3: float = 0.0
    braid_angle_rad: float = geometry.BRAID_ANGLE_RAD

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name, value, low, high, unit in (
                ('length', self.length_m, 0.01, 20.0, 'm'),
                ('bore', self.bore_m, 1e-4, 0.2, 'm'),
                ('dead volume', self.dead_volume_m3, 0.0, 1.0, 'm^3'),
                ('braid angle', self.braid_angle_rad, 0.1, 0.95, 'rad')):
            if value is not None and not low <= value <= high:
                raise InputError(f'is {value:g} {unit}; allowed is {low:g} to {high:g} {unit}',
                                 f'muscle, {name}')

    @classmethod
    def of_rig(cls, rig: Rig) -> 'Dimensions':
        """Return the dimensions of the muscle of a :class:`pam_sim.rig.Rig`."""
        muscle = rig.muscle
        return cls(muscle.length_m, muscle.bore_m, rig.parameters['V_dead'],
                   muscle.braid_angle_rad)

    def volume_m3(self, strain: Number) -> Number:
        """Return the volume [m^3] of muscle and dead volume at a contraction; broadcasts."""
        if self.bore_m is None:
            raise InputError('is not known, so the volume of air is not either', 'muscle, bore')
        muscle = Muscle('measured', self.length_m, self.bore_m, self.braid_angle_rad)
        return self.dead_volume_m3 + muscle.volume_m3(self.length_m * strain)

    def volume_slope_m3(self, strain: FloatArray) -> FloatArray:
        """Return dV/d(contraction as a fraction) [m^3]; broadcasts."""
        half = 1e-5
        return (self.volume_m3(strain + half) - self.volume_m3(strain - half)) / (2.0 * half)

    def air_mass_kg(self, pressure_gauge_pa: Number, strain: Number) -> Number:
        """Return the mass of air [kg] at 293.15 K, ideal gas; broadcasts."""
        return absolute_pa(pressure_gauge_pa) * self.volume_m3(strain) / (
            GAS_CONSTANT_AIR * TEMPERATURE_K)
