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
:data:`PARAMETERS`; the records of the effects and of the force law follow behind, see
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
    'free_load',                    # 1: hanging mass, 0: contraction prescribed
    'atmosphere_pa',
    'length_m',
    'force_gain',
    'damping_n_s_per_m',
    'mass_kg',
    'weight_n',
    'max_contraction_m',
    'thread_squared_m2',
    'inverse_4_pi_n2',
    'dead_volume_m3',
    'rt_j_per_kg',
    'conductance_kg_per_s_pa',
    'critical_ratio',
    'supply_pa',                    # absolute
    'gain_ppr_pa_per_v',
    'time_constant_s',
    'decay_half',                   # exp(-substep / 2 T_m)
    'pwm_period_s',
    'inverse_length_per_m',
    'inverse_mass_per_kg',
    'inverse_rt_kg_per_j',
    'law',                          # number of the force law, see places.law_codes
    'law_damper',                   # 1: the law has a damper of its own
    'law_place',                    # where in par the numbers of the law begin
    'beyond_nominal',               # 1: an effect acts or the law is not that of the nominal rig
    ('used', record(*HOOKS)),       # 1: an effect with this hook acts
)

# Values of ``valve``.
PPR, HSV_AVERAGED, HSV_SWITCHING = 0, 1, 2

# Places of the fields, for code that reads the arrays by index.
INP_SIGNAL_0 = 0            # PPR: voltage [V]; HSV: fill duty [0..1]
INP_SIGNAL_1 = 1            # HSV: vent duty [0..1]
INP_EXTERNAL_FORCE = 2      # N, against contraction positive
INP_CONTRACTION = 3         # m, at the END of the step; isometric and driven loads only
INP_SIZE = 4
OUT_TIME = 0                # s since the start
OUT_PRESSURE = 1            # Pa absolute, as the sensor (with its effects) reads it
OUT_CONTRACTION = 2         # m, as the sensor reads it
OUT_VELOCITY = 3            # m/s, true
OUT_FORCE = 4               # N, load cell, as the sensor reads it
OUT_AIR_MASS = 5            # kg in muscle and dead volume
OUT_SUPPLY = 6              # Pa absolute
OUT_TRUE_PRESSURE = 7       # Pa absolute
OUT_TRUE_CONTRACTION = 8    # m
OUT_TRUE_FORCE = 9          # N
OUT_FILLED = 10             # kg through the fill valve since the start (HSV)
OUT_VENTED = 11             # kg through the vent valve since the start (HSV)
OUT_ACCELERATION = 12       # m/s^2
OUT_SIZE = 13
S_STEPS = 0                 # steps done
S_TIME = 1                  # s
S_PRESSURE = 2              # Pa absolute
S_CONTRACTION = 3           # m
S_VELOCITY = 4              # m/s
S_MUSCLE_FORCE = 5          # N, force of the muscle without its dry friction
S_AIR_MASS = 6              # kg (HSV: the integrated state)
S_SUPPLY = 7                # Pa absolute
S_FILLED = 8                # kg
S_VENTED = 9                # kg
S_DIRECTION = 10            # -1, 0, 1: last direction of a prescribed motion
S_PERIOD = 11               # index of the running PWM period
S_FILL_ON = 12              # s from the period start
S_FILL_OFF = 13
S_VENT_ON = 14
S_VENT_OFF = 15
STATE_BASE = 16
PAR_DT = 0                  # s, one step
PAR_SUBSTEPS = 1            # physics steps in it
PAR_SUBSTEP = 2             # s
PAR_VALVE = 3               # VALVE_*
PAR_FREE_LOAD = 4           # 1: hanging mass, 0: contraction prescribed
PAR_ATMOSPHERE = 5          # Pa
PAR_LENGTH = 6              # m
PAR_FORCE_GAIN = 7          # -
PAR_DAMPING = 8             # N s/m
PAR_MASS = 9                # kg
PAR_WEIGHT = 10             # N
PAR_MAX_CONTRACTION = 11    # m
PAR_THREAD_SQUARED = 12     # m^2
PAR_INVERSE_4_PI_N2 = 13    # -
PAR_DEAD_VOLUME = 14        # m^3
PAR_RT = 15                 # J/kg
PAR_CONDUCTANCE = 16        # kg/(s Pa)
PAR_CRITICAL_RATIO = 17     # -
PAR_SUPPLY = 18             # Pa absolute
PAR_GAIN_PPR = 19           # Pa/V
PAR_TIME_CONSTANT = 20      # s
PAR_DECAY_HALF = 21         # exp(-substep / 2 T_m)
PAR_PWM_PERIOD = 22         # s
PAR_INVERSE_LENGTH = 23     # 1/m
PAR_INVERSE_MASS = 24       # 1/kg
PAR_INVERSE_RT = 25         # kg/J
PAR_LAW = 26                # which force law, see generate.law_codes
PAR_LAW_DAMPER = 27         # 1: the law has a damper of its own
PAR_LAW_PLACE = 28          # where in par the numbers of the law begin
PAR_BEYOND_NOMINAL = 29     # 1: an effect acts or the law is another than the nominal one
PAR_BASE = 30
VALVE_PPR, VALVE_HSV_AVERAGED, VALVE_HSV_SWITCHING = PPR, HSV_AVERAGED, HSV_SWITCHING
