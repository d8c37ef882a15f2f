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
The places where an effect can act, each as a function that does nothing.

The kernel is ``step_template.py`` with these functions replaced by generated
ones that call every effect of the registry whose amplitude is not zero. An
effect implements any of them under the name after ``apply_``; it gets the same
arguments, with its own positions put in: ``..., state, i, par, k``, where
``state[i]`` is its first state and ``par[k]`` its first packed parameter.

Pressures are absolute Pa unless called gauge; ``dx_m`` is the travel since the
start of the physics step and ``elapsed_s`` the time since then, so that a
memory can be evaluated inside a step and advanced once, in ``commit``.
"""

from pam_sim.compiled import inlined

# Hook name -> how many leading arguments it returns, changed or not.
HOOKS = {
    'command': 2, 'clock_shift': 1, 'set_point': 2, 'pressure_rate': 1, 'opening': 2,
    'switch_times': 2, 'flow_opening': 2, 'supply': 1, 'valve_flow': 2, 'mass_flow': 1,
    'volume': 1, 'air_rt': 1, 'map_input': 2, 'map_output': 1, 'muscle_force': 1,
    'muscle_friction': 1, 'load_force': 1, 'load_friction': 1, 'commit': 0,
    'sensor_commit': 0, 'sensor': 3,
}


@inlined
def apply_command(signal_0, signal_1, dt_s, state, par):
    """Return the valve signal that arrives in this step; called once a step, may advance state."""
    return signal_0, signal_1


@inlined
def apply_clock_shift(shift_s, state, par):
    """Return by how much [s] the PWM clock of the switching valves is late."""
    return shift_s


@inlined
def apply_set_point(set_point_pa, time_constant_s, pressure_pa, contraction_m, state, par):
    """
    Return (set point [Pa], time constant [s]) of the PPR for this physics step.

    Called once a physics step, may advance state.
    """
    return set_point_pa, time_constant_s


@inlined
def apply_pressure_rate(rate_pa_per_s, pressure_pa, contraction_m, state, par):
    """Return the pressure rate [Pa/s] behind the PPR."""
    return rate_pa_per_s


@inlined
def pressure_rate_active(par):
    """Return whether any effect changes the PPR pressure rate (else the lag is exact)."""
    return False


@inlined
def apply_opening(fill, vent, period_s, state, par):
    """Return mean openings of the averaged HSV pair from its duties."""
    return fill, vent


@inlined
def apply_switch_times(open_s, close_s, state, par):
    """Return opening and closing delay [s] of the switching HSV pair."""
    return open_s, close_s


@inlined
def apply_flow_opening(fill, vent, step_s, state, par):
    """
    Return the mean openings of either HSV pair over the physics step of ``step_s``.

    Called once a physics step, may advance state.
    """
    return fill, vent


@inlined
def apply_supply(supply_pa, state, par):
    """Return the supply pressure [Pa absolute]."""
    return supply_pa


@inlined
def apply_valve_flow(fill_kg_per_s, vent_kg_per_s, pressure_pa, supply_pa, state, par):
    """Return the mass flows [kg/s] through the fill and the vent valve, HSV."""
    return fill_kg_per_s, vent_kg_per_s


@inlined
def valve_flow_active(par):
    """Return whether any effect changes the flows through the valves."""
    return False


@inlined
def apply_mass_flow(flow_kg_per_s, pressure_pa, contraction_m, supply_pa, state, par):
    """Return the net air flow into the muscle [kg/s], HSV."""
    return flow_kg_per_s


@inlined
def mass_flow_active(par):
    """Return whether any effect changes the net flow (else it is that of the valves)."""
    return False


@inlined
def apply_volume(volume_m3, pressure_pa, contraction_m, state, par):
    """Return the air volume [m^3]."""
    return volume_m3


@inlined
def apply_air_rt(rt_j_per_kg, mass_kg, inflow_kg_per_s, outflow_kg_per_s, pressure_pa,
                 volume_m3, elapsed_s, state, par):
    """
    Return R T [J/kg] of the air in the muscle ``elapsed_s`` into the physics step, HSV.

    Mass and pressure are those at the start of the step, the flows means over
    ``elapsed_s``, the volume that at its end. The last call of a step is the one
    that holds.
    """
    return rt_j_per_kg


@inlined
def air_rt_active(par):
    """Return whether any effect changes the air temperature (else it is constant)."""
    return False


@inlined
def apply_map_input(gauge_pa, strain, state, par):
    """Return gauge pressure [Pa] and strain [-] at which the force map is read."""
    return gauge_pa, strain


@inlined
def apply_map_output(tension_n, pressure_pa, contraction_m, state, par):
    """Return the static tension [N] of the force map, gain included."""
    return tension_n


@inlined
def apply_muscle_force(force_n, pressure_pa, contraction_m, velocity_m_per_s, dx_m, elapsed_s,
                       state, par):
    """Return the force the muscle transmits [N], dry friction excepted."""
    return force_n


@inlined
def apply_muscle_friction(level_n, pressure_pa, contraction_m, velocity_m_per_s, state, par):
    """Return the dry friction level inside the muscle [N], not negative."""
    return level_n


@inlined
def apply_load_force(force_n, contraction_m, velocity_m_per_s, dx_m, elapsed_s, state, par):
    """Return the force of the load side against contraction [N], weight and F_ext excepted."""
    return force_n


@inlined
def apply_load_friction(level_n, contraction_m, velocity_m_per_s, state, par):
    """Return the dry friction level of the guide [N], not negative."""
    return level_n


@inlined
def apply_commit(pressure_pa, contraction_m, velocity_m_per_s, dx_m, elapsed_s, state, par):
    """Advance the states of effects at the end of a physics step; arguments as of its end."""


@inlined
def apply_sensor_commit(pressure_pa, contraction_m, force_n, dt_s, state, par):
    """Advance the states of sensor effects at the end of a step."""


@inlined
def apply_sensor(pressure_pa, contraction_m, force_n, state, par):
    """Return what the sensors read: pressure [Pa absolute], contraction [m], force [N]."""
    return pressure_pa, contraction_m, force_n
