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
Compare the loops of the hysteresis and friction formulations at their nominal numbers.

Run ``python benchmarks/friction_loops.py``; it prints the tables of docs/reference/friction.md.
"""

import numpy as np
from pam_sim import load_rig
from pam_sim.effects.registry import effects
from pam_sim.units import P_ATM_PA
from scipy.integrate import trapezoid

NAMES = ('coulomb_friction', 'coulomb_friction_presliding', 'pressure_friction',
         'pressure_friction_presliding', 'braid_contact_friction', 'history_friction',
         'hysteresis', 'hysteresis_bouc_wen', 'hysteresis_lugre',
         'hysteresis_prandtl_ishlinskii')
GAUGE_PA = 400e3


def moved(name, per_cycle, middle_m=0.012, amplitude_m=0.010):
    """
    Return (contraction [m], force change [N]) of the last of three cycles at 400 kPa.

    The contraction is prescribed, a sine of ``per_cycle`` milliseconds.
    """
    phase = 2.0 * np.pi * np.arange(3 * per_cycle + 1) / per_cycle
    path = middle_m - amplitude_m * np.cos(phase)
    rig = load_rig('dmsp_5_300_driven').with_(parameters={'damping_n_s_per_m': 0.0})
    nominal, changed = (
        one.simulate(np.full(len(path) - 1, GAUGE_PA / 100e3), contraction_m=path,
                     initial_pressure_pa=P_ATM_PA + GAUGE_PA).force_n
        for one in (rig, rig.with_(effects=[name])))
    last = slice(2 * per_cycle, None)
    return path[last], (changed - nominal)[last]


def half_width_n(contraction_m, change_n):
    """Return half the force between the branches at the middle of the stroke."""
    quarter = len(contraction_m) // 4
    return 0.5 * (change_n[3 * quarter] - change_n[quarter])


def lost_mj(contraction_m, change_n):
    """Return the energy a cycle loses [mJ]."""
    return -1e3 * trapezoid(change_n, contraction_m)


def hanging(name, seconds=20):
    """Return (half width [kPa] at 12 mm, pneumatic energy lost [mJ]) of 5 kg, 250 to 550 kPa."""
    rig = load_rig('dmsp_5_300_hanging_mass').with_(effects=[name] if name else [])
    count = 1000 * seconds
    phase = 2.0 * np.pi * np.arange(2 * count) / count
    response = rig.simulate(4.0 - 1.5 * np.cos(phase), initial_pressure_pa=P_ATM_PA + 250e3)
    p = response.pressure_pa[count:] - P_ATM_PA
    x = response.contraction_m[count:]
    top = int(np.argmax(x))
    width = np.interp(12e-3, x[:top], p[:top]) - np.interp(12e-3, x[:top:-1], p[:top:-1])
    return 0.5e-3 * width, 1e3 * trapezoid(p, rig.volume_m3(x))


def stated_n(name):
    """Return what the effect reports [N] at its nominal numbers."""
    effect = effects()[name]
    stated = effect.report(effect.values(), load_rig('dmsp_5_300_hanging_mass'))
    return next(iter(stated.values()))[0]


def main():
    """Print the two tables."""
    print('| effect | states, N | 20 mm: half width, N | 0.1 Hz: lost, mJ | 1 Hz: lost, mJ | '
          '1 mm: half width, N | 1 Hz: lost, mJ |\n|---|---|---|---|---|---|---|')
    for name in NAMES:
        slow, fast, small = moved(name, 10_000), moved(name, 1000), moved(name, 1000, 0.012, 5e-4)
        print(f'| `{name}` | {stated_n(name):.2f} | {half_width_n(*slow):.2f} | '
              f'{lost_mj(*slow):z.1f} | {lost_mj(*fast):z.1f} | {half_width_n(*small):.2f} | '
              f'{lost_mj(*small):z.2f} |')
    print('\n| effect | half width, kPa | lost, mJ |\n|---|---|---|')
    for name in (None, *NAMES):
        width_kpa, energy_mj = hanging(name)
        label = f'`{name}`' if name else 'nominal rig (damping alone)'
        print(f'| {label} | {width_kpa:.1f} | {energy_mj:.1f} |')


if __name__ == '__main__':
    main()
