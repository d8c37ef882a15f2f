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
The contraction of a measured muscle: the model with effects chosen by hand, and black boxes.

Used by ``real_records.py``. Two looks. In the loop the measured pressure is the input; a model is
fitted on one cycle and judged on the other. In the steps the command is the input, so the valve
counts as well; blocks of 0.1 s are dealt out in turn to two parts. All models run freely.
"""

import black_boxes
import numpy as np
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.subsystems.simulation import run_from_pressure
from pam_sim.muscle.registry import laws
from pam_sim.rig import LawChoice
from pam_sim.units import P_ATM_PA
import real_pressure
from scipy.optimize import least_squares

SPRING = 'parallel_spring', 'stiffness_n_per_m'
LOAD = {'mass_kg': (1.5, 0.2, 30.0), 'force_map_gain': (1.0, 0.7, 1.3),
        SPRING: (2900.0, 100.0, 2e4)}
MAP = LOAD | {('end_taper', 'k_minus_1'): (0.02, -0.3, 1.0),
              ('threshold_pressure', 'pressure_pa'): (2e3, 0.0, 6e4)}
CREEP = {('creep', 'stiffness_1_n_per_m'): (300.0, 0.0, 5e3),
         ('creep', 'stiffness_2_n_per_m'): (300.0, 0.0, 5e3),
         ('creep', 'time_constant_1_s'): (0.6, 0.1, 4.0),
         ('creep', 'time_constant_2_s'): (8.0, 4.0, 100.0)}
FRICTION = {('coulomb_friction', 'force_n'): (4.0, 0.0, 50.0)}
HYSTERESIS = {('hysteresis', 'force_n'): (10.0, 0.0, 50.0),
              ('hysteresis', 'force_per_pa'): (3e-5, 0.0, 2e-4),
              ('hysteresis', 'width_scale'): (1.5, 0.35, 5.0)}
PLAY = {('hysteresis_prandtl_ishlinskii', 'half_width_pa'): (3e4, 0.0, 1e5),
        ('hysteresis_prandtl_ishlinskii', 'half_width_per_pa'): (3e-3, 0.0, 0.3)}
LAW, SET = 'sarosi', 'dmsp_10'
# The six numbers of the force law, each within half of its published value.
MAP_OF_RECORD = {('law', name): (value, *sorted((0.5 * value, 1.5 * value)))
                 for name, value in laws()[LAW].SETS[SET].values.items()}
DAMPING = {'damping_n_s_per_m': (100.0, 10.0, 2000.0)}
MODELS = {'calibrated': LOAD, 'friction and creep': LOAD | FRICTION | CREEP,
          'hysteresis': LOAD | HYSTERESIS,
          'hysteresis and creep': LOAD | HYSTERESIS | CREEP,
          'hysteresis, creep, ends, threshold': MAP | HYSTERESIS | CREEP}
LOOP_MODELS = MODELS | {
    'play in pressure, ends, threshold': MAP | PLAY,
    'play in pressure, force map fitted': {
        name: one for name, one in LOAD.items() if name != 'force_map_gain'
    } | PLAY | MAP_OF_RECORD}
READING = 60                 # samples of the loop between its readings
LOOP_DELAYS, STEP_DELAYS = range(2), range(4, 15)


def with_sizes(rig, values):
    """Return the rig with parameters by name, effects and the law by (name, parameter)."""
    law = {key[1]: float(value) for key, value in values.items() if key[0] == 'law'}
    if law:
        rig = rig.with_(law=LawChoice(LAW, SET, law))
    effects = {one.name: dict(one.parameters) for one in rig.effects}
    for key, value in values.items():
        if not isinstance(key, str) and key[0] != 'law':
            effects.setdefault(key[0], {})[key[1]] = float(value)
    return rig.with_(
        parameters={key: float(value) for key, value in values.items() if isinstance(key, str)},
        effects=[{'name': name, 'parameters': held} for name, held in effects.items()])


def fitted(run, ranges, target, part):
    """Return (free run, sizes): ``run`` maps sizes to a free run, fitted to a part of a target."""
    low, high = np.array([one[1:] for one in ranges.values()]).T
    scale = np.array([abs(one[0]) for one in ranges.values()])

    def off(x):
        return 1e3 * (run(dict(zip(ranges, x * scale))) - target)[part]
    found = least_squares(off, [one[0] / size for one, size in zip(ranges.values(), scale)],
                          bounds=(low / scale, high / scale), diff_step=1e-3, max_nfev=25)
    sizes = dict(zip(ranges, found.x * scale))
    return run(sizes), sizes


def loop_table(rig, first, second, found=None):
    """
    Print how models run from the measured pressure, fitted on one cycle and judged on the other.

    Parameters
    ----------
    rig : pam_sim.Rig
        The model before.
    first, second : pam_sim.run.Run
        The two cycles.
    found : dict of str -> sequence of pam_sim.Rig
        Per way to ask: what `pam gap` made of the first and of the second cycle.

    """
    recordings = [Recording(one, 'ppr') for one in (first, second)]
    targets = [one.measured['contraction'][::READING] for one in recordings]

    def both(values):
        changed = with_sizes(rig, values)
        return [run_from_pressure(changed, one)['contraction'][::READING] for one in recordings]

    rows = {'before': [both({})] * 2}
    for name, models in (found or {}).items():
        rows[name] = [[run_from_pressure(one, r)['contraction'][::READING] for r in recordings]
                      for one in models]
    for name, ranges in LOOP_MODELS.items():
        rows[name] = []
        for k in (0, 1):
            def run(values, k=k):
                return run_from_pressure(
                    with_sizes(rig, values), recordings[k])['contraction'][::READING]
            _, sizes = fitted(run, ranges, targets[k], slice(1, None))
            rows[name].append(both(sizes))
    labels = {}
    pressures = [one.measured['pressure'][::READING] for one in recordings]
    rows['the fitted cycle itself, read at the same pressure'] = [
        [read_from(pressures[k], targets[k], asked) for asked in pressures] for k in (0, 1)]
    # One series of both cycles: the part that is fitted is one of them.
    u, y = np.concatenate(pressures), np.concatenate(targets)
    ends = np.cumsum([0, *map(len, targets)])
    for kind in (black_boxes.arx, black_boxes.narx):
        rows[kind.__name__.upper()] = []
        for k in (0, 1):
            part = np.zeros(len(u), dtype=bool)
            part[ends[k] + 4:ends[k + 1]] = True
            free, _, label = kind(u, y, part, LOOP_DELAYS)
            rows[kind.__name__.upper()].append([free[ends[i]:ends[i + 1]] for i in (0, 1)])
            labels.setdefault(kind.__name__.upper(), []).append(label)
    print('| contraction from the measured pressure, rms [mm] | first cycle: fitted | second: '
          'judged | second: fitted | first: judged |\n|---|---|---|---|---|')
    for name, (one, other) in rows.items():
        cells = [1e3 * black_boxes.rms((runs[k] - targets[k])[4:]) for runs, k in (
            (one, 0), (one, 1), (other, 1), (other, 0))]
        print(f'| {name} | ' + ' | '.join(f'{cell:.3f}' for cell in cells) + ' |')
    print_labels(labels)


def read_from(pressure, contraction, asked):
    """Return the contraction of a cycle at other pressures, rising and falling ones apart."""
    found, top, asked_top = np.empty(asked.size), int(np.argmax(pressure)), int(np.argmax(asked))
    for here, there in ((slice(None, top), slice(None, asked_top)),
                        (slice(top, None), slice(asked_top, None))):
        order = np.argsort(pressure[here])
        found[there] = np.interp(asked[there], pressure[here][order], contraction[here][order])
    return found


def chain_table(rig, volts, gauge_pa, contraction_m):
    """
    Print how models run from the command alone: the valve is fitted first, then the muscle.

    Parameters
    ----------
    rig : pam_sim.Rig
        The model before, its command in volts of the model.
    volts, gauge_pa, contraction_m : numpy.ndarray
        The steps at ``1 / real_pressure.STEP_S`` samples a second.

    """
    even = (np.arange(volts.size) // real_pressure.BLOCK) % 2 == 0
    parts = even, ~even

    def simulated(model):
        response = model.simulate(
            np.repeat(volts, real_pressure.EVERY), initial_pressure_pa=P_ATM_PA,
            initial_signal=float(volts[0]), dt_s=real_pressure.STEP_S / real_pressure.EVERY)
        return response.contraction_m[:-1:real_pressure.EVERY]

    rows = {'before': [simulated(rig)] * 2}
    valve = real_pressure.MODELS['dead times, limits, vent that closes and bleeds']
    valves = [with_sizes(rig, real_pressure.fitted(
        rig, volts, gauge_pa, part, valve)[1]) for part in parts]
    for name, ranges in MODELS.items():
        rows[name] = []
        for part, base in zip(parts, valves):
            free, _ = fitted(lambda values, base=base: simulated(with_sizes(base, values)),
                             ranges | DAMPING, contraction_m, part)
            rows[name].append(free)
    labels, ahead = {}, {}
    for kind in (black_boxes.arx, black_boxes.narx):
        name = kind.__name__.upper()
        found = [kind(volts, contraction_m, part, STEP_DELAYS) for part in parts]
        rows[name], labels[name] = [one[0] for one in found], [one[2] for one in found]
        ahead[f'{name}, one step ahead, not comparable'] = [one[1] for one in found]
    print('\n| contraction from the command, rms [mm] | first part: fitted | second: judged | '
          'second: fitted | first: judged |\n|---|---|---|---|---|')
    for name, (one, other) in (rows | ahead).items():
        cells = [1e3 * black_boxes.rms((run - contraction_m)[part]) for run, part in (
            (one, even), (one, ~even), (other, ~even), (other, even))]
        print(f'| {name} | ' + ' | '.join(f'{cell:.3f}' for cell in cells) + ' |')
    print_labels(labels)


def print_labels(labels):
    """Print order and delay of the black boxes that were chosen on either part."""
    print()
    for name, (one, other) in labels.items():
        print(f'- {name}: {one}; {other}')
