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
Records of the four arrays of the kernel.

``step(state, par, inp, out)`` reads ``par`` and ``inp``, advances ``state`` and fills ``out``.
All are float64, SI, absolute pressures. ``state`` begins with :data:`STATE`, ``par`` with
:data:`PARAMETERS`; the records of effects, load and force law follow behind, see
:mod:`pam_sim.rollout.places`.
"""

from pam_sim.records import record
from pam_sim.rollout.hooks import HOOKS

# Held constant during one step.
INPUT = record(
    'signal_0',                     # PPR: voltage [V]; HSV: fill duty [0..1]
    'signal_1',                     # HSV: vent duty [0..1]
    'external_force_n',             # against contraction positive
    'contraction_m',                # at the END of the step; isometric and driven loads only
)

# After the step.
OUTPUT = record(
    'time_s',                       # since the start
    'pressure_pa',                  # absolute, as the sensor (with its effects) reads it
    'contraction_m',                # as the sensor reads it
    'velocity_m_per_s',             # true
    'force_n',                      # load cell, as the sensor reads it
    'air_mass_kg',                  # in muscle and dead volume
    'supply_pa',                    # absolute
    'true_pressure_pa',             # absolute
    'true_contraction_m',
    'true_force_n',
    'filled_kg',                    # through the fill valve since the start (HSV)
    'vented_kg',                    # through the vent valve since the start (HSV)
    'acceleration_m_per_s2',
)

STATE = record(
    'steps',                        # done
    'time_s',
    'pressure_pa',                  # absolute
    'contraction_m',
    'velocity_m_per_s',
    'muscle_force_n',               # force of the muscle without its dry friction
    'air_mass_kg',                  # HSV: the integrated state
    'supply_pa',                    # absolute
    'filled_kg',
    'vented_kg',
    'direction',                    # -1, 0, 1: last direction of a prescribed motion
    'period',                       # index of the running PWM period
    'fill_on_s',                    # edges of the pulses, from the start of the period
    'fill_off_s',
    'vent_on_s',
    'vent_off_s',
)

PARAMETERS = record(
    'dt_s',                         # one step
    'substeps',                     # physics steps in it
    'substep_s',
    'valve',                        # PPR, HSV_AVERAGED or HSV_SWITCHING
    'free_load',                    # 1: the load moves freely, 0: contraction prescribed
    'atmosphere_pa',
    'length_m',
    'force_gain',
    'damping_n_s_per_m',
    'mass_kg',
    'weight_n',
    'spring_n_per_m',               # beside the mass
    'max_contraction_m',
    'thread_squared_m2',
    'inverse_4_pi_n2',
    'dead_volume_m3',
    'rt_j_per_kg',
    'conductance_kg_per_s_pa',
    'critical_ratio',
    'intake_kg_per_s_pa',           # conductance of the vent valve for air that flows in
    'supply_pa',                    # absolute
    'gain_ppr_pa_per_v',
    'lowest_ppr_v',
    'highest_ppr_v',
    'at_lowest_ppr_pa',             # absolute
    'time_constant_s',
    'decay_half',                   # exp(-substep / 2 T_m)
    'pwm_period_s',
    'pressure_zero_pa',             # of the readings
    'contraction_zero_m',
    'force_zero_n',
    'inverse_length_per_m',
    'inverse_mass_per_kg',
    'inverse_rt_kg_per_j',
    'law',                          # number of the force law, see places.law_codes
    'law_damper',                   # 1: the law has a damper of its own
    'own_volume',                   # 1: the volume is that of the law
    'load',                         # number of a load with its own force, see places.load_codes
    'beyond_nominal',               # how far the rig is beyond the nominal one, see below
    ('used', record(*HOOKS)),       # 1: an effect with this hook acts
)

# Values of ``beyond_nominal``: an effect acts or the law is another one; terms that have no name.
NOMINAL, EFFECTS, TERMS = 0, 1, 2

# Values of ``valve``.
PPR, HSV_AVERAGED, HSV_SWITCHING = 0, 1, 2
