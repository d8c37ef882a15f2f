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
Human limbs as numbers of a joint, from body mass and height.

D. A. Winter, Biomechanics and Motor Control of Human Movement, Table 4.1 (segment "foot and leg",
femoral condyles to medial malleolus). The segment lengths are those of Drillis and Contini (1966)
given there: knee 0.285 H and ankle 0.039 H above ground. Averages over people; one person may
differ by ten percent and more.
"""

from pam_sim.errors import InputError

_SHANK_LENGTH = 0.246           # of the height, knee to ankle
_MASS = 0.061                   # of the body mass, shank with foot
_CENTRE_OF_MASS = 0.606         # of the shank length, from the knee
_GYRATION = 0.735               # of the shank length, about the knee


def shank_and_foot(body_mass_kg: float = 70.0, height_m: float = 1.75) -> dict[str, float]:
    """
    Return the joint parameters of shank and foot that turn about the knee.

    Parameters
    ----------
    body_mass_kg, height_m : float
        Of the person.

    Returns
    -------
    dict
        ``limb_mass_kg``, ``centre_of_mass_m``, ``inertia_kg_m2``.

    Raises
    ------
    InputError
        A body outside 20 to 200 kg or 1.0 to 2.3 m.

    """
    for name, value, lower, upper, unit in (('body_mass_kg', body_mass_kg, 20.0, 200.0, 'kg'),
                                            ('height_m', height_m, 1.0, 2.3, 'm')):
        if not lower <= value <= upper:
            raise InputError(f'`{name}` is {value:g}; allowed {lower:g} to {upper:g} {unit}')
    length_m = _SHANK_LENGTH * height_m
    mass_kg = _MASS * body_mass_kg
    return {'limb_mass_kg': mass_kg, 'centre_of_mass_m': _CENTRE_OF_MASS * length_m,
            'inertia_kg_m2': mass_kg * (_GYRATION * length_m) ** 2}
