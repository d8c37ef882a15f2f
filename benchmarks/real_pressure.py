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
The pressure behind a measured regulator: model, habits of the regulator, and black boxes.

Used by ``real_records.py``. The record holds one step up and one down at 100 Hz. So blocks of
0.1 s are dealt out in turn to two parts. Each model is fitted on one part and judged on the
other, then the other way round. All models run freely from the start, on the command alone.
"""

import black_boxes
import numpy as np
from pam_sim.units import P_ATM_PA
from scipy.optimize import least_squares

STEP_S = 0.01
BLOCK = 10                   # samples
EVERY = 10                   # steps of the simulation in a sample
REGULATOR = {'K_m': (100e3, 90e3, 110e3), 'T_m': (0.06, 0.01, 0.3)}
DEAD_TIMES = {('valve_dead_time_by_direction', 'delay_s'): (0.06, 0.0, 0.3),
              ('valve_dead_time_by_direction', 'vent_later_s'): (-0.01, -0.3, 0.3)}
LIMITS = {('flow_limit', 'fill_rate_at_400kpa_pa_per_s'): (8e5, 1e5, 1e7),
          ('flow_limit', 'vent_rate_at_400kpa_pa_per_s'): (8e5, 1e5, 1e7)}
VENT = {('vent_bleed', 'closing_pressure_pa'): (12e3, 0.0, 1e5),
        ('vent_bleed', 'bleed_rate_pa_per_s'): (12e3, 1e3, 1e5)}
BOTH_VALVES = {('vent_bleed_fill_creep', name): start for name, start in (
    ('closing_pressure_pa', (12e3, 0.0, 1e5)), ('bleed_rate_pa_per_s', (12e3, 1e3, 1e5)),
    ('fill_closing_pressure_pa', (6e3, 0.0, 1e5)), ('creep_rate_pa_per_s', (2e3, 3e2, 1e5)))}
MODELS = {'calibrated': {}, 'dead times': DEAD_TIMES, 'dead times, limits': DEAD_TIMES | LIMITS,
          'dead times, limits, vent that closes and bleeds': DEAD_TIMES | LIMITS | VENT,
          'dead times, limits, both valves close': DEAD_TIMES | LIMITS | BOTH_VALVES}
DELAYS = range(4, 15)        # samples, of the black boxes


def free_run(rig, volts):
    """Return the gauge pressure [Pa] at the samples of a command [V], from rest."""
    response = rig.simulate(np.repeat(volts, EVERY), initial_pressure_pa=P_ATM_PA,
                            initial_signal=float(volts[0]), dt_s=STEP_S / EVERY)
    return response.pressure_pa[:-1:EVERY] - P_ATM_PA


def rms(values):
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def fitted(rig, volts, gauge_pa, part, sizes):
    """Return (gauge pressure in free run, sizes) of a regulator with effects, fitted on a part."""
    ranges = REGULATOR | sizes
    low, high = np.array([r[1:] for r in ranges.values()]).T
    scale = np.array([abs(r[0]) for r in ranges.values()])

    def run(x):
        values = dict(zip(ranges, x * scale))
        effects = {}
        for key in sizes:
            effects.setdefault(key[0], {})[key[1]] = values[key]
        return free_run(rig.with_(
            parameters={name: values[name] for name in REGULATOR},
            effects=[{'name': n, 'parameters': v} for n, v in effects.items()]), volts)
    found = least_squares(
        lambda x: (run(x) - gauge_pa)[part], [r[0] / s for r, s in zip(ranges.values(), scale)],
        bounds=(low / scale, high / scale), diff_step=1e-3, x_scale=1.0)
    return run(found.x), dict(zip(ranges, found.x * scale))


def print_table(rig, volts, gauge_pa):
    """
    Print the rms errors of the pressure, before, calibrated, with effects, and of black boxes.

    Parameters
    ----------
    rig : pam_sim.Rig
        The model, its command in volts of the model.
    volts, gauge_pa : numpy.ndarray
        The record at ``1 / STEP_S`` samples a second.

    """
    even = (np.arange(volts.size) // BLOCK) % 2 == 0
    before = free_run(rig, volts)
    rows, sizes = {'before': [before, before]}, {}
    for name, extra in MODELS.items():
        both = [fitted(rig, volts, gauge_pa, part, extra) for part in (even, ~even)]
        rows[name], sizes[name] = [found for found, _ in both], [s for _, s in both]
    ahead, labels = {}, []
    for kind in (black_boxes.arx, black_boxes.narx):
        name = kind.__name__.upper()
        both = [kind(volts, gauge_pa, part, DELAYS) for part in (even, ~even)]
        rows[name] = [one[0] for one in both]
        ahead[f'{name}, one step ahead, not comparable'] = [one[1] for one in both]
        labels.append(f'- {name}: {both[0][2]}; {both[1][2]}')
    print('| pressure in free run, rms [kPa] | first part: fitted | second: judged | '
          'second: fitted | first: judged |\n|---|---|---|---|---|')
    for name, (one, other) in (rows | ahead).items():
        cells = [rms((run - gauge_pa)[part]) for run, part in (
            (one, even), (one, ~even), (other, ~even), (other, even))]
        print(f'| {name} | ' + ' | '.join(f'{1e-3 * c:.2f}' for c in cells) + ' |')
    print('\n' + '\n'.join(labels))
    print('\n| with both valves | first part | second part |\n|---|---|---|')
    one, other = sizes['dead times, limits, both valves close']
    for key in one:
        print(f'| {key if isinstance(key, str) else key[1]} | {one[key]:.4g} | {other[key]:.4g} |')
