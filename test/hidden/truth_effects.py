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
The effects a case may hide: what they change in the rig or its sensors, and what is true of them.

Each entry draws its shape from a random generator and its size from ``scale``, where 1 is an
everyday size. ``equivalent`` holds what a result should report, in the units of the table of
canonical names.
"""

from dataclasses import dataclass, field

import truth_rig as rig


@dataclass
class Drawn:
    """Numbers of the rig and settings of its sensors that an effect changes, and its truth."""

    numbers: dict = field(default_factory=dict)
    sensors: dict = field(default_factory=dict)
    equivalent: dict = field(default_factory=dict)


@dataclass(frozen=True)
class Hidden:
    """An effect by its canonical name; ``draw(rng, scale, valve)`` gives a Drawn."""

    family: str
    subsystem: str
    draw: object
    valves: tuple = ('ppr', 'hsv')
    scales: tuple = (0.03, 2.0)


def _dead_time(rng, scale, valve):
    delay = 0.020 * scale
    return Drawn({'delay': delay}, {}, {'delay_s': delay})


def _tube_lag(rng, scale, valve):
    whole, share = 0.020 * scale, rng.uniform(0.5, 0.9)
    return Drawn({'lag_1': share * whole, 'lag_2': (1.0 - share) * whole}, {},
                 {'time_constant_s': whole})


def _dead_zone(rng, scale, valve):
    if valve == 'ppr':
        half = 4e3 * scale
        return Drawn({'dead_band': half}, {}, {'half_width_pa': half})
    opens, closes = 1.7e-3 * scale, rng.uniform(0.4, 1.3) * 1.7e-3 * scale
    return Drawn({'open_dead': 0.7 * opens, 'open_ramp': 0.6 * opens,
                  'close_dead': 0.7 * closes, 'close_ramp': 0.6 * closes}, {},
                 {'open_time_s': opens, 'close_time_s': closes})


def _valve_hysteresis(rng, scale, valve):
    half = 3e3 * scale
    return Drawn({'play': half}, {}, {'half_width_pa': half})


def _flow_limit(rng, scale, valve):
    fill, vent = 1.2e6 / scale, 1.2e6 / scale * rng.uniform(0.5, 0.9)
    return Drawn({'cap_fill': fill, 'cap_vent': vent}, {}, {
        'fill_rate_at_400kpa_pa_per_s': fill, 'vent_rate_at_400kpa_pa_per_s': vent})


def _vent_asymmetry(rng, scale, valve):
    ratio = 1.0 + 0.4 * scale
    return Drawn({'vent_ratio': ratio}, {}, {'vent_to_fill_time_ratio': ratio})


def _leakage(rng, scale, valve):
    conductance = (1e-11 if valve == 'ppr' else 5e-13) * scale
    slit = rng.uniform(0.0, 0.4)
    flow = conductance * rig.RHO * (rig.ATM + 4e5)        # choked at 400 kPa
    return Drawn({'leak_nozzle': (1.0 - slit) * conductance,
                  'leak_slit': slit * flow / ((rig.ATM + 4e5) ** 2 - rig.ATM ** 2)}, {},
                 {'mass_flow_at_400kpa_kg_per_s': flow})


def _supply_droop(rng, scale, valve):
    reservoir = 1e-3 / scale
    return Drawn({'reservoir': reservoir, 'band': rng.uniform(0.8e5, 1.5e5),
                  'refill': rng.uniform(1e-4, 3e-4)}, {}, {'reservoir_volume_m3': reservoir})


def _dead_volume(rng, scale, valve):
    return Drawn({'second_volume': 2e-6 * scale}, {}, {'extra_volume_m3': 2e-6 * scale})


def _thermal(rng, scale, valve):
    return Drawn({'heat_time': 0.2 * scale}, {}, {'heat_exchange_time_s': 0.2 * scale})


def _coulomb(rng, scale, valve):
    level = 2.0 * scale
    return Drawn({'dry': level, 'stribeck': rng.uniform(1.0, 1.15)}, {}, {'force_n': level})


def _pressure_friction(rng, scale, valve):
    level = 2.0 * scale
    return Drawn({'dry_400': level, 'stribeck': rng.uniform(1.0, 1.15)}, {},
                 {'force_at_400kpa_n': level})


def _hysteresis(rng, scale, valve):
    level, share = 2.3 * scale, rng.uniform(0.15, 0.35)
    drawn = {'loop': share * level, 'loop_400': (1.0 - share) * level}
    if rng.random() < 0.4:
        drawn['dahl_travel'] = rng.uniform(0.5e-3, 1.0e-3)
    return Drawn(drawn, {}, {'loop_half_width_at_400kpa_n': level})


def _viscous(rng, scale, valve):
    force = 1.5 * scale
    return Drawn({'viscous': force}, {}, {'force_at_50mm_per_s_n': force})


def _static_stiffness():
    """Return -dF/dx [N/m] of the nominal map at 400 kPa and 8.86 mm."""
    near, far = (rig.map_force(4e5, (8.86e-3 + s) / rig.LENGTH, 1.0) for s in (-1e-5, 1e-5))
    return (near - far) / 2e-5


def _creep(rng, scale, valve):
    whole = 110.0 * scale
    shares = rng.dirichlet((4.0, 4.0, 4.0, 2.0)) if rng.random() < 0.4 else (
        rng.dirichlet((4.0, 4.0)))
    times = sorted(rng.uniform(0.5, 1.5, len(shares)) * {
        2: (1.0, 12.0), 4: (0.3, 1.2, 5.0, 20.0)}[len(shares)])
    drawn = {}
    for k, (share, time_s) in enumerate(zip(shares, times), 1):
        drawn |= {f'creep_{k}': share * whole, f'creep_t{k}': time_s}
    return Drawn(drawn, {}, {'relaxing_stiffness_n_per_m': whole,
                             'creep_fraction_at_400kpa': whole / _static_stiffness()})


def _softening(rng, scale, valve):
    loss = 0.02 * scale
    return Drawn({'soften': loss, 'soften_t1': rng.uniform(30.0, 60.0),
                  'soften_t2': rng.uniform(2.0, 8.0)}, {}, {'gain_loss_at_20mm_per_s': loss})


def _threshold(rng, scale, valve):
    pressure = 8e3 * scale
    return Drawn({'threshold': pressure}, {}, {'pressure_pa': pressure})


def _end_taper(rng, scale, valve):
    k, growth = 0.05 * scale, rng.uniform(0.0, 2.0)
    strain = 10e-3 / rig.LENGTH
    here = k * (1.0 + growth * strain)
    change = (rig.map_force(5e5, (1.0 + here) * strain, 1.0) - rig.map_force(5e5, strain, 1.0))
    return Drawn({'taper': k, 'taper_growth': growth}, {}, {
        'k_minus_1': here, 'force_change_at_500kpa_10mm_n': change})


def _bladder(rng, scale, valve):
    stiffness, hardening = 150.0 * scale, rng.uniform(0.0, 0.15)
    return Drawn({'tube': stiffness, 'tube_hardening': hardening}, {}, {
        'stiffness_n_per_m': stiffness * (1.0 + 0.5 * hardening)})     # secant at 14 mm


def _guide(rng, scale, valve):
    return Drawn({'guide': 2.0 * scale, 'stribeck': rng.uniform(1.0, 1.15)}, {},
                 {'force_n': 2.0 * scale})


def _spring(rng, scale, valve):
    return Drawn({'spring': 150.0 * scale, 'spring_cubic': rng.uniform(0.0, 0.03)}, {},
                 {'stiffness_n_per_m': 150.0 * scale})


def _sensor(key, base, reported, signed=True):
    def draw(rng, scale, valve):
        value = base * scale * (rng.choice((-1.0, 1.0)) if signed else 1.0)
        return Drawn({}, {key: value}, {reported: value})
    return draw


EFFECTS = {
    'valve_dead_time': Hidden('transport', 'valve', _dead_time),
    'tube_lag': Hidden('transport', 'valve', _tube_lag),
    'valve_dead_zone': Hidden('valve_nonlinearity', 'valve', _dead_zone),
    'valve_hysteresis': Hidden('valve_nonlinearity', 'valve', _valve_hysteresis, ('ppr',)),
    'flow_limit': Hidden('valve_nonlinearity', 'valve', _flow_limit, ('ppr',), (0.5, 1.5)),
    'vent_asymmetry': Hidden('valve_nonlinearity', 'valve', _vent_asymmetry),
    'leakage': Hidden('loss', 'valve', _leakage),
    'supply_droop': Hidden('loss', 'valve', _supply_droop, ('hsv',), (0.25, 2.0)),
    'dead_volume': Hidden('volume', 'valve', _dead_volume, ('hsv',), (0.3, 2.0)),
    'thermal': Hidden('volume', 'valve', _thermal, ('hsv',), (0.25, 2.0)),
    'coulomb_friction': Hidden('friction', 'muscle', _coulomb),
    'pressure_friction': Hidden('friction', 'muscle', _pressure_friction),
    'hysteresis': Hidden('friction', 'muscle', _hysteresis),
    'viscous_damping': Hidden('damping', 'muscle', _viscous),
    'creep': Hidden('slow', 'muscle', _creep),
    'thermal_softening': Hidden('slow', 'muscle', _softening),
    'threshold_pressure': Hidden('static_map', 'muscle', _threshold),
    'end_taper': Hidden('static_map', 'muscle', _end_taper),
    'bladder_stiffness': Hidden('static_map', 'muscle', _bladder),
    'guide_friction': Hidden('friction', 'load', _guide),
    'parallel_spring': Hidden('load', 'load', _spring),
    'pressure_bias': Hidden('sensor', 'sensor', _sensor('pressure_bias', 2e3, 'bias_pa')),
    'contraction_bias': Hidden(
        'sensor', 'sensor', _sensor('contraction_bias', 0.3e-3, 'bias_m')),
    'force_bias': Hidden('sensor', 'sensor', _sensor('force_bias', 1.0, 'bias_n')),
    'pressure_gain': Hidden('sensor', 'sensor', _sensor('pressure_gain', 0.03, 'gain_error')),
    'force_gain': Hidden('sensor', 'sensor', _sensor('force_gain', 0.03, 'gain_error')),
    'pressure_lag': Hidden(
        'sensor', 'sensor', _sensor('pressure_lag', 0.010, 'time_constant_s', False),
        ('ppr', 'hsv'), (0.4, 2.0)),
    'contraction_lag': Hidden(
        'sensor', 'sensor', _sensor('contraction_lag', 0.010, 'time_constant_s', False),
        ('ppr', 'hsv'), (0.4, 2.0)),
}

# Numbers of the model file by the rig's own names, and by which factor a wrong one is off.
PARAMETERS = {
    'mass_kg': ('mass', 5.0), 'K_m': ('k_m', 100e3), 'T_m': ('t_m', 0.060), 'C': ('c', 2.0e-10),
    'force_map_gain': ('gain_map', 1.0), 'V_dead': ('v_dead', 3.0e-6),
    'damping_n_s_per_m': ('damping', 25.0), 'supply_pa': ('supply', 801325.0)}
PARAMETERS_OF = {
    'ppr': ('mass_kg', 'K_m', 'T_m', 'force_map_gain', 'damping_n_s_per_m'),
    'hsv': ('mass_kg', 'C', 'force_map_gain', 'V_dead', 'damping_n_s_per_m')}
# The same thing by two names: either answer is right.
SAME = {'dead_volume': 'V_dead', 'viscous_damping': 'damping_n_s_per_m'}

# What no library has: far from every effect in it, or a near relative of one.
FAR = {
    'ripple': lambda rng, s: {'ripple': 2.0 * s, 'ripple_period': rng.uniform(3e-3, 5e-3)},
    'contact': lambda rng, s: {'contact': 4.0 * s},
    'pulsation': lambda rng, s: {'pulsation': 4e3 * s, 'pulsation_hz': rng.uniform(4.0, 9.0)},
    'wander': lambda rng, s: {'wander': 4e3 * s, 'wander_hz': rng.uniform(0.3, 0.8)},
    'gain_drift': lambda rng, s: {'gain_drift': 0.04 * s},
}
NEAR = {
    'drag_x2': lambda rng, s: {'drag_x2': 6e5 * s},
    'drag_v2': lambda rng, s: {'drag_v2': 800.0 * s},
    'dry_growing': lambda rng, s: {'dry_growing': 3.0 * s},
    'dry_pull': lambda rng, s: {'dry_pull': 4.0 * s},
    'one_sided_spring': lambda rng, s: {
        'stop_stiffness': 1500.0 * s, 'stop_at': rng.uniform(8e-3, 14e-3)},
    'swinging_regulator': lambda rng, s: {
        'resonance_hz': rng.uniform(3.0, 5.0), 'resonance_damping': rng.uniform(0.35, 0.6)},
}
ONLY_PPR = {'pulsation', 'wander', 'gain_drift', 'swinging_regulator'}
