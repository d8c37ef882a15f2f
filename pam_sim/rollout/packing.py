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

"""Turn a rig into the arrays of the kernel."""

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from pam_sim.annotations import FloatArray
from pam_sim.compiled import interpreted
from pam_sim.declared import number_of, shown
from pam_sim.effects.effect import Numbers
from pam_sim.effects.registry import all_effects, own_files
from pam_sim.errors import InputError
from pam_sim.load import LOADS
from pam_sim.load.registry import has_force, packed_of, steepest
from pam_sim.plugins import raise_with_file
from pam_sim.records import put, put_some, size_of
from pam_sim.rollout import kernel, layout
from pam_sim.rollout.places import (
    BEYOND, BEYOND_PLACE, FLAGS, law_codes, LAW_PLACE, load_codes, LOAD_PLACE, PLACES,
    STATE_SIZE)
from pam_sim.units import (
    GAS_CONSTANT_AIR, GRAVITY_M_PER_S2, HIGHEST_PA, LOWEST_PA, P_ATM_PA, RHO_REFERENCE,
    T_REFERENCE_K, TEMPERATURE_K)
from pam_sim.valve import hsv, ppr
from pam_sim.valve.flow import flow_function, RATIO_LINEAR
from pam_sim.volume import law as law_volume

if TYPE_CHECKING:
    from pam_sim.rig import Rig

_LAW_CODES, _LOAD_CODES = law_codes(), load_codes()
_RT_J_PER_KG = GAS_CONSTANT_AIR * TEMPERATURE_K
_DENSITY_FACTOR = math.sqrt(T_REFERENCE_K / TEMPERATURE_K)
_DAMPING = 'N s/m'          # unit of the numbers of effects that damp the motion


def pack_rig(rig: 'Rig', dt_s: float, initial_pressure_pa: float,
             initial_contraction_m: float | None,
             initial_signal: ArrayLike | None) -> tuple[FloatArray, FloatArray]:
    """Return (state, par); arguments and errors as of ``Rig.pack``."""
    numbers = _numbers(rig, dt_s, initial_pressure_pa, initial_contraction_m, initial_signal)
    law = rig.muscle.law.law
    state = np.zeros(STATE_SIZE)
    par = np.zeros(LAW_PLACE + size_of(law.PACKED))
    put(par, law.PACKED, law.pack(), LAW_PLACE)
    if has_force(LOADS[rig.load]):
        packed = packed_of(LOADS[rig.load])
        put(par, packed, {name: rig.parameters[name] for name in packed.names or ()}, LOAD_PLACE)
    _pack_base(rig, numbers, state, par)
    _pack_effects(rig, numbers, state, par)
    if initial_contraction_m is None and LOADS[rig.load].MOVES_FREELY:
        rest_m = kernel.entries_for(par).rest_contraction(numbers.pressure_pa, state, par)
        if rest_m != numbers.contraction_m:         # effects start from where the load rests
            numbers = numbers._replace(
                contraction_m=rest_m, force_n=rig.force_at_start_n(rest_m))
            put_some(state, layout.STATE, {'contraction_m': rest_m})
            _pack_effects(rig, numbers, state, par)
    kernel.entries_for(par).settle(state, par)
    return state, par


def _pack_effects(rig: 'Rig', numbers: Numbers, state: FloatArray, par: FloatArray) -> None:
    for setting in rig.effects:
        effect = all_effects()[setting.name]
        place, state_place = PLACES[setting.name]
        try:
            acts = effect.pack_into(setting.parameters, numbers, par, place, state, state_place)
        except Exception as error:      # whatever the functions of somebody else raise
            problem = f'`pack`, `initial` or `active` of effect `{setting.name}` fails'
            raise_with_file(own_files().get(setting.name), problem, error)
            raise
        if acts:
            for flag in FLAGS[setting.name]:
                par[flag] = 1.0
            par[BEYOND_PLACE] = max(par[BEYOND_PLACE], BEYOND[setting.name])


def _numbers(rig: 'Rig', dt_s: float, pressure: float, contraction: float | None,
             signal: ArrayLike | None) -> Numbers:
    value = rig.parameters
    dt_s, pressure = number_of(dt_s, 'dt_s'), number_of(pressure, 'initial_pressure_pa')
    for name, number, lower, upper, unit in (
            ('dt_s', dt_s, 1e-6, 0.02, 's'),
            ('initial_pressure_pa', pressure, LOWEST_PA, HIGHEST_PA, 'Pa absolute')):
        if not lower <= number <= upper:
            raise InputError(f'`{name}` is {number:g}; allowed {lower:g} to {upper:g} {unit}')
    if contraction is None:
        contraction = value.get('contraction_m', 0.0)
    contraction = number_of(contraction, 'initial_contraction_m')
    top = rig.muscle.stroke_m
    moves = LOADS[rig.load].MOVES_FREELY
    if not (0.0 <= contraction <= top if moves else math.isfinite(contraction)):
        raise InputError(f'`initial_contraction_m` is {contraction:g}; allowed 0 to {top:g} m')
    if signal is None:
        signal = ((ppr.voltage_v(pressure - P_ATM_PA, value),) if rig.valve == 'ppr'
                  else (0.0, 0.0))
    else:
        try:
            signal = np.atleast_1d(np.asarray(signal, dtype=float))
        except (TypeError, ValueError):
            raise InputError(f'`initial_signal` is no array of numbers: {shown(signal)}') from None
        lower, upper, unit = rig.signal_range
        if signal.shape != (len(rig.signal_names),):
            raise InputError(f'`initial_signal` has {signal.size} numbers; valve `{rig.valve}` '
                             f'takes {len(rig.signal_names)}')
        for number in signal:
            if not lower <= number <= upper:
                raise InputError(f'`initial_signal` is {number:g}; allowed {lower:g} to '
                                 f'{upper:g} {unit}')
    return Numbers(
        float(dt_s), _substep(rig, dt_s), rig.valve,
        rig.fidelity if rig.valve == 'hsv' else 'averaged',
        {**value, 'p_atm': P_ATM_PA}, tuple(map(float, signal)),
        float(pressure), float(contraction), rig.force_at_start_n(contraction), rig.muscle)


def damping_of_effects(rig: 'Rig') -> float:
    """Return the most damping [N s/m] that the effects of a rig add to the nominal one."""
    return sum(max(setting.parameters[number.name], 0.0) for setting in rig.effects
               for number in all_effects()[setting.name].parameters if number.unit == _DAMPING)


def _substep(rig: 'Rig', dt_s: float) -> float:
    """Return the physics step: 0.1 ms when switching, shorter where something is faster."""
    value = rig.parameters
    fastest = 0.0                # 1/s, of lag, damping and swing
    if LOADS[rig.load].MOVES_FREELY:
        load = LOADS[rig.load]
        of_load, damping = (steepest(load, value, rig.muscle.stroke_m) if has_force(load)
                            else (value['spring_n_per_m'], 0.0))
        stiffness = value['force_map_gain'] * rig.muscle.stiffness_n_per_m + of_load
        damping += value['damping_n_s_per_m'] + damping_of_effects(rig)
        fastest = max(damping / value['mass_kg'],
                      2.0 * math.sqrt(stiffness / value['mass_kg']))
    if rig.valve == 'ppr':
        return dt_s / max(1, math.ceil(dt_s * max(fastest, 1.0 / value['T_m'])))
    smallest = value['V_dead'] + rig.muscle.least_volume_m3
    # Slope of the linear part of the flow law at equal pressures, as a rate of the chamber.
    slope = interpreted(flow_function)(RATIO_LINEAR, value['b']) / (1.0 - RATIO_LINEAR)
    rate = _RT_J_PER_KG / smallest * value['C'] * RHO_REFERENCE * slope
    count = max(1, math.ceil(dt_s * max(rate / 0.5, fastest)))
    if rig.fidelity == 'switching':
        count = max(count, math.ceil(dt_s / hsv.SWITCHING_STEP_S - 1e-9))
    return dt_s / count


def _pack_base(rig: 'Rig', numbers: Numbers, state: FloatArray, par: FloatArray) -> None:
    value = rig.parameters
    muscle = rig.muscle
    length_m, thread_squared, inverse_4_pi_n2 = muscle.shape
    substeps = round(numbers.dt_s / numbers.substep_s)
    valve = layout.PPR
    if rig.valve == 'hsv':
        valve = (layout.HSV_SWITCHING if rig.fidelity == 'switching'
                 else layout.HSV_AVERAGED)
    conductance = value['C'] * RHO_REFERENCE * _DENSITY_FACTOR
    mass = value.get('mass_kg', 1.0)
    law, load = _LAW_CODES[muscle.law.name], _LOAD_CODES[rig.load]
    put(par, layout.PARAMETERS, {
        'dt_s': numbers.dt_s,
        'substeps': substeps,
        'substep_s': numbers.substep_s,
        'valve': valve,
        'free_load': LOADS[rig.load].MOVES_FREELY,
        'atmosphere_pa': P_ATM_PA,
        'length_m': length_m,
        'force_gain': value['force_map_gain'],
        'damping_n_s_per_m': value['damping_n_s_per_m'],
        'mass_kg': mass,
        'weight_n': mass * GRAVITY_M_PER_S2,
        'spring_n_per_m': value.get('spring_n_per_m', 0.0),
        'max_contraction_m': muscle.stroke_m,
        'thread_squared_m2': thread_squared,
        'inverse_4_pi_n2': inverse_4_pi_n2,
        'dead_volume_m3': value['V_dead'],
        'rt_j_per_kg': _RT_J_PER_KG,
        'conductance_kg_per_s_pa': conductance,
        'critical_ratio': value['b'],
        'intake_kg_per_s_pa': value['vent_intake'] * conductance,
        'supply_pa': value['supply_pa'],
        'gain_ppr_pa_per_v': value['K_m'],
        'lowest_ppr_v': value['ppr_lowest_v'],
        'highest_ppr_v': value['ppr_highest_v'],
        'at_lowest_ppr_pa': P_ATM_PA + value['ppr_zero_pa'],
        'time_constant_s': value['T_m'],
        'decay_half': math.exp(-0.5 * numbers.substep_s / value['T_m']),
        'pwm_period_s': value['pwm_period_s'],
        'pressure_zero_pa': value['pressure_zero_pa'],
        'contraction_zero_m': value['contraction_zero_m'],
        'force_zero_n': value['force_zero_n'],
        'inverse_length_per_m': 1.0 / length_m,
        'inverse_mass_per_kg': 1.0 / mass,
        'inverse_rt_kg_per_j': 1.0 / _RT_J_PER_KG,
        'law': law,
        'law_damper': type(muscle.law.law).COMPILED_DAMPER is not None,
        'own_volume': muscle.volume == law_volume.NAME,
        'load': load,
        'beyond_nominal': layout.EFFECTS if law != 0.0 or load != 0.0 else layout.NOMINAL,
        'used': 0.0,
    })
    put_some(state, layout.STATE, {
        'pressure_pa': numbers.pressure_pa,
        'contraction_m': numbers.contraction_m,
        'period': -1e9,         # no PWM period yet
    })
