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
Feed-forward from known dynamics, and jumps of the reference made smooth moves.

The pressure that holds the reference where it will be one preview from now comes
from the static inverse; moving the load takes more: damping times rate and mass
times acceleration, over the force one pascal makes, and then what the lag of the
valve swallows::

    p = p_static(r) + k_v dr/dt + k_a d2r/dt2,   command = p + T_valve dp/dt

A jump of the reference has no acceleration to feed forward. It is turned into a
move of fixed duration along ``s = 10 q^3 - 15 q^4 + 6 q^5``, which starts and ends
at rest with no acceleration (minimum jerk, Flash and Hogan 1985), or along
``s = 35 q^4 - 84 q^5 + 70 q^6 - 20 q^7``, whose jerk is nothing there as well: the
lag of a valve asks for the change of pressure, and that has the jerk in it.
"""

from pam_actuation.control import inputs as place
from pam_actuation.control.sofc import layout as at
from pam_actuation.control.static_inverse import inverse_pressure_pa
from pam_sim.compiled import compiled

_SLOPE_BASE_M = 5e-4      # the slope of the static inverse is taken over twice this
_LEAST_SLOPE = 0.2        # of the mean slope of the table
_ACCELERATION_FLOOR_M_PER_S2 = 1e-9       # then it is gone, before it becomes denormal
_LEAST_SHAPE = 0.5        # of the integral, its inverse the largest


@compiled
def jumps(par, st, inp):
    """Return by how much reference and lead reference jumped against their rates [m]."""
    period = par[at.P_PERIOD]
    now = (inp[place.IN_REFERENCE] - st[at.S_REFERENCE]
           - inp[place.IN_REFERENCE_RATE] * period)
    lead = (inp[place.IN_LEAD_REFERENCE] - st[at.S_LEAD_REFERENCE]
            - inp[place.IN_LEAD_RATE] * period)
    st[at.S_REFERENCE] = inp[place.IN_REFERENCE]
    st[at.S_LEAD_REFERENCE] = inp[place.IN_LEAD_REFERENCE]
    return (now if abs(now) > par[at.P_JUMP] else 0.0,
            lead if abs(lead) > par[at.P_JUMP] else 0.0)


@compiled
def to_go(size_m, left_s, duration_s, form):
    """Return how much of a move is still to come [m] and the rate it has now [m/s]."""
    if not left_s > 0.0:
        return 0.0, 0.0
    q = max(1.0 - left_s / duration_s, 0.0)
    if form > 0.5:
        done = q * q * q * q * (35.0 + q * (q * (70.0 - 20.0 * q) - 84.0))
        rate = 140.0 * q * q * q * (1.0 - q) * (1.0 - q) * (1.0 - q) / duration_s
    else:
        done = q * q * q * (10.0 + q * (6.0 * q - 15.0))
        rate = 30.0 * q * q * (1.0 - q) * (1.0 - q) / duration_s
    return size_m * (1.0 - done), size_m * rate


@compiled
def smooth_jump(par, st, jump_m, wait_s, s_size, s_left):
    """
    Take up a jump in one of the two references; return what is to go [m] and its rate.

    ``wait_s``: the move begins so much later.
    """
    duration = par[at.P_JUMP_TIME]
    if not duration > 0.0:
        return 0.0, 0.0
    if jump_m != 0.0:
        rest, _ = to_go(st[s_size], st[s_left], duration, par[at.P_JUMP_FORM])
        st[s_size] = rest + jump_m
        st[s_left] = duration + wait_s
    rest, rate = to_go(st[s_size], st[s_left], duration, par[at.P_JUMP_FORM])
    st[s_left] = max(0.0, st[s_left] - par[at.P_PERIOD])
    return rest, rate


@compiled
def note_jump(st, rate_m_per_s):
    """Remember a jump until the reference moves by itself."""
    if st[at.S_JUMP_LEFT] > 0.0 or st[at.S_LEAD_JUMP_LEFT] > 0.0:
        st[at.S_JUMPED] = 1.0
    elif rate_m_per_s != 0.0:
        st[at.S_JUMPED] = 0.0


@compiled
def slope_pa_per_m(table, contraction_m):
    """Return the slope of the static inverse, never below a part of its mean."""
    nodes = table.shape[0] - 2
    mean = (table[table.shape[0] - 1] - table[2]) / ((nodes - 1) * table[1])
    rise = (inverse_pressure_pa(table, contraction_m + _SLOPE_BASE_M)
            - inverse_pressure_pa(table, contraction_m - _SLOPE_BASE_M))
    return max(0.5 * rise / _SLOPE_BASE_M, _LEAST_SLOPE * mean)


@compiled
def load_shape(par, contraction_m):
    """
    Return which part of the integral counts at a contraction, 1 in the middle of the range.

    The more a muscle has contracted the less force a pascal makes: what a load beyond the
    nominal one takes is no constant pressure but grows with contraction.
    """
    middle = 0.5 * (par[at.P_REFERENCE_LOWER] + par[at.P_REFERENCE_UPPER])
    shape = 1.0 + par[at.P_INTEGRAL_GROWTH] * (contraction_m - middle)
    return min(max(shape, _LEAST_SHAPE), 1.0 / _LEAST_SHAPE)


@compiled
def dynamic_pressure_pa(par, st, static_pa, rate_m_per_s, rate_jumped):
    """
    Return what moving takes beyond the static pressure [Pa]; advances the filters.

    ``rate_jumped``: the rate of before means nothing.
    """
    period = par[at.P_PERIOD]
    if rate_jumped:
        st[at.S_LEAD_RATE] = rate_m_per_s
        st[at.S_ACCELERATION] = 0.0
    raw = (rate_m_per_s - st[at.S_LEAD_RATE]) / period
    st[at.S_LEAD_RATE] = rate_m_per_s
    part = period / (par[at.P_ACCELERATION_FILTER] + period)
    st[at.S_ACCELERATION] += part * (raw - st[at.S_ACCELERATION])
    if abs(st[at.S_ACCELERATION]) < _ACCELERATION_FLOOR_M_PER_S2:
        st[at.S_ACCELERATION] = 0.0
    moving = (par[at.P_RATE_FEEDFORWARD] * rate_m_per_s
              + par[at.P_ACCELERATION_FEEDFORWARD] * st[at.S_ACCELERATION])
    quasi_static = static_pa + moving
    if rate_jumped:
        st[at.S_QUASI_STATIC] = quasi_static
    lag = par[at.P_VALVE_LAG] * (quasi_static - st[at.S_QUASI_STATIC]) / period
    st[at.S_QUASI_STATIC] = quasi_static
    return moving + lag
