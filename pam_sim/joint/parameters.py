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
Numbers of the joint and its limb; the nominal ones move with two 5 mm muscles.

The nominal limb is a uniform rod of 0.3 kg and 0.2 m that turns about its end.
"""

from pam_sim.parameters import Parameter
from pam_sim.units import GRAVITY_M_PER_S2

NAME = 'antagonistic_joint'
SIDES = ('flexor', 'extensor')
SENTENCE = 'Two muscles pull on a pulley each, against each other, and turn a limb with gravity.'
EQUATION = ('J d2theta/dt2 = r_f T_f - r_e T_e - m g l sin(theta - theta_h) - d dtheta/dt - T_dry '
            '+ T_ext, x_f = x_f0 + r_f theta, x_e = x_e0 - r_e theta')
SOURCE = 'Newton; tendons that only pull, rigid inelastic stops (design choice).'

PARAMETERS = (
    Parameter('flexor_radius_m', 'm', 0.012, 0.001, 0.5, 0.01,
              'Pulley radius under the flexor tendon.', 'design value'),
    Parameter('extensor_radius_m', 'm', 0.012, 0.001, 0.5, 0.01,
              'Pulley radius under the extensor tendon.', 'design value'),
    Parameter('flexor_contraction_at_zero_m', 'm', 0.015, 0.0, 1.0, 0.0,
              'Contraction of the flexor at joint angle 0.', 'design value'),
    Parameter('extensor_contraction_at_zero_m', 'm', 0.015, 0.0, 1.0, 0.0,
              'Contraction of the extensor at joint angle 0.', 'design value'),
    Parameter('limb_mass_kg', 'kg', 0.30, 0.0, 100.0, 0.02, 'Mass of the limb.', 'design value'),
    Parameter('centre_of_mass_m', 'm', 0.10, 0.0, 2.0, 0.02,
              'Distance of the centre of mass from the joint axis.', 'uniform rod of 0.2 m'),
    Parameter('inertia_kg_m2', 'kg m^2', 0.004, 1e-6, 100.0, 0.02,
              'Inertia of the limb about the joint axis.', 'uniform rod, m l^2 / 3'),
    Parameter('damping_n_m_s', 'N m s', 0.005, 0.0, 100.0, 0.05,
              'Viscous damping of the joint, per rad/s.', 'design value'),
    Parameter('friction_n_m', 'N m', 0.0, 0.0, 100.0, 0.05,
              'Dry friction of the joint.', 'design value'),
    Parameter('lower_stop_rad', 'rad', -1.0, -3.15, 3.15, 0.0,
              'Joint angle of the stop in extension.', 'design value'),
    Parameter('upper_stop_rad', 'rad', 1.0, -3.15, 3.15, 0.0,
              'Joint angle of the stop in flexion.', 'design value'),
    Parameter('hanging_angle_rad', 'rad', 0.0, -6.3, 6.3, 0.0,
              'Joint angle at which the limb would hang straight down.', 'design value'),
    Parameter('gravity_m_per_s2', 'm/s^2', GRAVITY_M_PER_S2, 0.0, 20.0, 0.0,
              'Gravity in the plane of motion; 0 for a limb that moves level.',
              'standard gravity'),
)
