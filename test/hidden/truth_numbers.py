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

"""The numbers of the rig with hidden effects; a neutral value switches an effect off."""

import numpy as np

# Name -> neutral or nominal value.
NUMBERS = {
    'mass': 5.0, 'damping': 25.0, 'gain_map': 1.0, 'k_m': 100e3, 't_m': 0.060,
    'c': 2.0e-10, 'v_dead': 3.0e-6, 'supply': 801325.0,
    # Command, regulator, on/off valves.
    'delay': 0.0, 'lag_1': 0.0, 'lag_2': 0.0, 'play': 0.0, 'dead_band': 0.0,
    'open_dead': 0.0, 'open_ramp': 0.0, 'close_dead': 0.0, 'close_ramp': 0.0,
    'cap_fill': 0.0, 'cap_vent': 0.0, 'vent_ratio': 1.0,
    # Air.
    'leak_nozzle': 0.0, 'leak_slit': 0.0, 'reservoir': 0.0, 'band': 1e5, 'refill': 2e-4,
    'second_volume': 0.0, 'heat_time': 0.0,
    # Muscle.
    'dry': 0.0, 'dry_400': 0.0, 'stribeck': 1.0, 'loop': 0.0, 'loop_400': 0.0, 'dahl_travel': 0.0,
    'viscous': 0.0, 'viscous_power': 0.85,
    'creep_1': 0.0, 'creep_2': 0.0, 'creep_3': 0.0, 'creep_4': 0.0,
    'creep_t1': 1.0, 'creep_t2': 1.0, 'creep_t3': 1.0, 'creep_t4': 1.0,
    'soften': 0.0, 'soften_t1': 60.0, 'soften_t2': 5.0,
    'threshold': 0.0, 'taper': 0.0, 'taper_growth': 0.0, 'tube': 0.0, 'tube_hardening': 0.0,
    # Load.
    'guide': 0.0, 'spring': 0.0, 'spring_cubic': 0.0,
    # What no library has.
    'ripple': 0.0, 'ripple_period': 4e-3, 'contact': 0.0, 'pulsation': 0.0, 'pulsation_hz': 7.0,
    'gain_drift': 0.0, 'drag_x2': 0.0, 'drag_v2': 0.0, 'dry_growing': 0.0, 'dry_pull': 0.0,
    'stop_stiffness': 0.0, 'stop_at': 0.0, 'resonance_hz': 0.0, 'resonance_damping': 0.3,
    'wander': 0.0, 'wander_hz': 1.3,
    # What somebody does to the load: a force against contraction.
    'pull': 0.0,
    # More that no library has.
    'fill_curve': 0.0, 'drag_p': 0.0, 'bump': 0.0, 'bump_at': 0.01, 'full_slow': 0.0,
    'ageing': 0.0,
}


def numbers(**changed):
    """Return the vector of all numbers with some changed from their neutral value."""
    unknown = set(changed) - set(NUMBERS)
    if unknown:
        raise KeyError(f'no such number: {sorted(unknown)}')
    return np.array([changed.get(name, value) for name, value in NUMBERS.items()], dtype=float)
