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
`pam gap` on records of a DMSP-10-250 that others measured, and effects injected into them.

    python benchmarks/real_records.py FOLDER
    python benchmarks/real_records.py FOLDER --pressure --write    # the table of the valve alone
    python benchmarks/real_records.py FOLDER --contraction --write # contraction and black boxes
    python benchmarks/real_records.py FOLDER --alone --write       # steps: `pam gap`, black boxes
    python benchmarks/real_records.py FOLDER --csv OUT             # the cycles, for `pam import`

FOLDER holds ``steps_100hz.csv`` and ``quasi_static_loop.csv``, transcribed from
github.com/tbazina/pam_lqi_pid; they are no part of this project. Another muscle than the one of
the thesis, behind a pressure regulator, its load not stated and no load cell. So the model gets
its parameters from the records first. The zero of the pressure sensor is its reading without
command, and the gain of the regulator is the slope of the loop. The load is a mass and a spring.
They balance the force law half-way between the branches of the first cycle. Names are found on
that cycle and judged on the second one and on the steps, which neither fit nor choice saw.

The loop was read once per 0.6 s. Between readings it is taken as straight, and noise of the
resolution is added, so its fast part says nothing: only names of muscle and load are tried.
"""

import argparse
from dataclasses import replace
from pathlib import Path
import sys

import numpy as np
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.gap import find_gap
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.subsystems.simulation import run_from_pressure
from pam_sim.muscle.coefficients import leading
from pam_sim.run import Run, Series
from pam_sim.tolerance import UNKNOWN
from pam_sim.units import GRAVITY_M_PER_S2, P_ATM_PA
import real_alone
import real_contraction
import real_pressure
import results_page

MODEL = """
muscle: {{like: dmsp_10_250, law: {{name: sarosi, set: dmsp_10}}}}
load: hanging_mass
valve: ppr
parameters: {{mass_kg: {mass:.6g}, damping_n_s_per_m: 100.0}}
tolerance: {{mass_kg: 0.2, force_map_gain: 0.1, damping_n_s_per_m: 0.5, K_m: 0.02, T_m: 0.5}}
effects:
  - {{name: parallel_spring, parameters: {{stiffness_n_per_m: {spring:.6g}}}}}
"""
RATE_HZ = 100.0
RESOLUTION = {'pressure_pa': 900.0, 'contraction_m': 4.9e-5}       # of the loop's readings
MUSCLE_NAMES = ('coulomb_friction', 'pressure_friction', 'hysteresis', 'viscous_damping', 'creep',
                'end_taper', 'bladder_stiffness', 'threshold_pressure', 'thermal_softening')
MIDDLE_BAR = np.linspace(1.0, 5.4, 23)
INJECTED = (('coulomb_friction', 'force_n', 15.0), ('coulomb_friction', 'force_n', 6.0),
            ('end_taper', 'k_minus_1', 0.2), ('end_taper', 'k_minus_1', 0.07),
            ('threshold_pressure', 'pressure_pa', 15e3))
TABLED = 'pressure', 'contraction'
KNOWN_NOW = 0.02             # tolerance of what the first look has calibrated


def read_table(folder, name):
    """Return the columns of a file; raise InputError without it."""
    path = Path(folder) / name
    if not path.is_file():
        raise InputError('is missing; see the first lines of this program', str(path))
    return np.genfromtxt(path, delimiter=',', names=True, dtype=None, encoding='utf-8')


def calibrated(loop):
    """Return (zero of the pressure [bar], slope [bar/V]) of regulator and sensor."""
    zero = 0.9 * (float(loop['p_sensor_V'][loop['p_bar'] > 0.0][0])
                  - float(loop['p_sensor_V'][loop['u_V'] == 0.0][0]))
    zero -= float(loop['p_bar'][loop['p_bar'] > 0.0][0])
    used = loop['p_bar'] > 0.2
    return zero, float(np.polyfit(loop['u_V'][used], loop['p_bar'][used] + zero, 1)[0])


def model_of(loop, zero):
    """Return the rig whose load balances the law on the middle line of the first cycle."""
    branch = {b: loop[(loop['cycle'] == 1) & (loop['branch'] == b)] for b in ('up', 'down')}
    x = 0.5e-3 * sum(np.interp(MIDDLE_BAR, np.sort(b['p_bar']), np.sort(b['s_mm']))
                     for b in branch.values())
    rig = load_rig(MODEL.format(mass=1.0, spring=1000.0))
    force = [float(rig.muscle.law.law.formula_n((p + zero) * 1e5, s / rig.muscle.length_m))
             for p, s in zip(MIDDLE_BAR, x)]
    spring, weight = np.polyfit(x, force, 1)
    return load_rig(MODEL.format(mass=weight / GRAVITY_M_PER_S2, spring=spring)), float(
        np.std(np.polyval((spring, weight), x) - force))


def run_of(time_s, volts, pressure_bar, contraction_m):
    """Return a Run of arrays on one clock, the command in volts of the model."""
    stamps = 10 ** 12 + np.rint(time_s * 1e9).astype(np.int64)
    return Run({'valve_signal': Series(stamps, {'ppr_voltage': np.clip(volts, 0.0, 6.0)}),
                'pressure': Series(stamps, {'pressure_pa': P_ATM_PA + 1e5 * pressure_bar}),
                'contraction': Series(stamps, {'contraction_m': np.maximum(contraction_m, 0.0)})},
               {}, '/dmsp10', 'records of others')


def cycle(loop, number, zero, slope, seed):
    """Return the Run of one cycle of the loop, straight between its readings, with noise."""
    rows = loop[loop['cycle'] == number]
    rows = rows[rows['p_bar'] > 0.0]             # the sensor's own reading is cut off below
    at = rows['t_nominal_s'] - rows['t_nominal_s'][0]
    time_s, random = np.arange(0.0, at[-1], 1.0 / RATE_HZ), np.random.default_rng(seed)
    noise = {n: step / np.sqrt(12.0) * random.standard_normal(time_s.size)
             for n, step in RESOLUTION.items()}
    return run_of(time_s, slope * np.interp(time_s, at, rows['u_V']),
                  zero + np.interp(time_s, at, rows['p_bar']) + 1e-5 * noise['pressure_pa'],
                  1e-3 * np.interp(time_s, at, rows['s_mm']) + noise['contraction_m'])


def step_run(steps, zero, slope):
    """Return the Run of the steps."""
    return run_of(steps['t_s'], slope * steps['u_V'], zero + steps['p_bar'],
                  1e-3 * steps['s_mm'])


def mm_off(rig, run):
    """Return the rms error [mm] of contraction at the recorded pressure."""
    recording = Recording(run, 'ppr')
    error = run_from_pressure(rig, recording)['contraction'] - recording.measured['contraction']
    return 1e3 * float(np.sqrt(np.mean(error[recording.time_s['contraction'] > 0.3] ** 2)))


def told(result):
    """Return a result as cells of the table."""
    parts = [f'`{e["name"]}`: ' + ', '.join(
        f'{n} {q["value"]:.3g} {q["unit"]}'.removesuffix(' -')
        + f' (95 % {q["ci95"][0]:.3g} to {q["ci95"][1]:.3g})'
        for n, q in e['equivalent'].items()) for e in result.effects]
    parts += [f'`{p.name}` {p.value:.4g} {p.unit}' for p in result.parameters]
    sizes = [', '.join(f'{size:.3g}' for size in (s.rmse_before, s.rmse_refit, s.rmse_after))
             + f' {s.unit}' for s in (result.signals[name] for name in TABLED)]
    return ' | '.join((
        result.verdict, '; '.join(parts) or '–',
        ', '.join(f'`{name}`' for name in result.ambiguity_set) or '–', *sizes,
        f'{result.unexplained_fraction:.2f}'))


def injected(rig, run, name, parameter, size):
    """Return the run with what an effect adds to the contraction of a model added to it."""
    recording = Recording(run, 'ppr')
    more = rig.with_(effects=[*rig.effects, {'name': name, 'parameters': {parameter: size}}])
    change = (run_from_pressure(more, recording)['contraction']
              - run_from_pressure(rig, recording)['contraction'])
    x = np.array(run.topics['contraction'].values['contraction_m'])
    inside = np.isin(run.topics['contraction'].stamp_ns, recording.stamp_ns['contraction'])
    x[inside] = np.maximum(x[inside] + change, 0.0)
    topics = {**run.topics, 'contraction': Series(
        run.topics['contraction'].stamp_ns, {'contraction_m': x})}
    return Run(topics, run.metadata, run.namespace, run.path)


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('folder')
    parser.add_argument('--seconds', type=float, default=600.0, help='budget of each look')
    parser.add_argument('--pressure', action='store_true', help='the table of the valve alone')
    parser.add_argument('--contraction', action='store_true',
                        help='the tables of contraction and black boxes alone')
    parser.add_argument('--alone', action='store_true',
                        help='the table of what `pam gap` makes of the steps alone')
    parser.add_argument('--csv', metavar='DIR', default=None,
                        help='write the two cycles of the loop at 100 Hz, and nothing else')
    results_page.add_write(parser, 'real_records')
    return parser


def main():
    """Do what is asked for; exit code 2 without the records."""
    try:
        look(command_line().parse_args())
    except InputError as mistake:
        print(f'real_records: {mistake}', file=sys.stderr)
        return 2
    return 0


def look(args):
    """Look at the loop, at the steps, and for what was injected."""
    if args.csv:
        write_cycles(args)
        return
    is_all = not (args.pressure or args.contraction or args.alone)
    for part, is_asked, tables in (('pressure', args.pressure, show_pressure),
                                   ('contraction', args.contraction, show_contraction),
                                   ('alone', args.alone, show_alone),
                                   ('', False, show)):
        if is_all or is_asked:
            with results_page.printed(args, __file__, part):
                tables(args)


def write_cycles(args):
    """Write cycle_1.csv and cycle_2.csv: time [s], voltage, gauge pressure, contraction."""
    loop = read_table(args.folder, 'quasi_static_loop.csv')
    zero, slope = calibrated(loop)
    Path(args.csv).mkdir(parents=True, exist_ok=True)
    for number in (1, 2):
        topics = cycle(loop, number, zero, slope, seed=number).topics
        stamps = topics['pressure'].stamp_ns
        columns = (1e-9 * (stamps - stamps[0]),
                   topics['valve_signal'].values['ppr_voltage'] / slope,
                   1e-3 * (topics['pressure'].values['pressure_pa'] - P_ATM_PA),
                   1e3 * topics['contraction'].values['contraction_m'])
        np.savetxt(Path(args.csv) / f'cycle_{number}.csv', np.column_stack(columns), '%.6f', ',',
                   header='time_s,voltage_V,pressure_kPa_gauge,contraction_mm', comments='')


def show_pressure(args):
    """Print how well regulator and black box follow the pressure of the steps."""
    loop = read_table(args.folder, 'quasi_static_loop.csv')
    steps = read_table(args.folder, 'steps_100hz.csv')
    zero, slope = calibrated(loop)
    rig, _ = model_of(loop, zero)
    real_pressure.print_table(rig.with_(effects=[]), np.clip(slope * steps['u_V'], 0.0, 6.0),
                              1e5 * (zero + steps['p_bar']))


def show_contraction(args):
    """Print how well the model and black boxes follow the contraction of loop and steps."""
    loop = read_table(args.folder, 'quasi_static_loop.csv')
    steps = read_table(args.folder, 'steps_100hz.csv')
    zero, slope = calibrated(loop)
    rig, _ = model_of(loop, zero)
    cycles = [cycle(loop, k, zero, slope, seed=k) for k in (1, 2)]
    free_law = rig.with_(tolerance=dict.fromkeys(leading(rig.muscle.law), UNKNOWN))
    found = {name: [
        load_rig(find_gap(one, model, other, MUSCLE_NAMES, args.seconds).model_yaml)
        for one, other in (cycles, cycles[::-1])] for name, model in (
            ('`pam gap`, nothing chosen by hand', rig),
            ('`pam gap`, force law unknown, nothing chosen by hand', free_law))}
    real_contraction.loop_table(rig, *cycles, found)
    real_contraction.chain_table(rig, np.clip(slope * steps['u_V'], 0.0, 6.0),
                                 1e5 * (zero + steps['p_bar']), 1e-3 * steps['s_mm'])


def show_alone(args):
    """Print what `pam gap` makes of the steps, beside black boxes."""
    loop = read_table(args.folder, 'quasi_static_loop.csv')
    steps = read_table(args.folder, 'steps_100hz.csv')
    zero, slope = calibrated(loop)
    rig, _ = model_of(loop, zero)
    real_alone.print_table(step_run(steps, zero, slope), rig, args.seconds)


def show(args):
    """Print what was found, and of what was injected."""
    loop = read_table(args.folder, 'quasi_static_loop.csv')
    steps = read_table(args.folder, 'steps_100hz.csv')
    zero, slope = calibrated(loop)
    rig, off = model_of(loop, zero)
    print(f'Zero of the pressure {zero:.3f} bar, regulator {slope:.4f} bar/V; mass '
          f'{rig.parameters["mass_kg"]:.2f} kg, spring '
          f'{rig.effects[0].parameters["stiffness_n_per_m"]:.0f} N/m, balance off by '
          f'{off:.1f} N.\n')
    first, second = (cycle(loop, k, zero, slope, seed=k) for k in (1, 2))
    stepped = step_run(steps, zero, slope)
    found = find_gap(first, rig, second, MUSCLE_NAMES, args.seconds)
    print('| looked at | verdict | found | set | '
          + ' | '.join(f'{n}, rms before, calibrated, final' for n in TABLED)
          + ' | unexplained |\n|---|---|---|---|---|---|---|')
    print('| loop, first cycle, judged on the second |', told(found), '|', flush=True)
    better = load_rig(found.model_yaml)
    offs = [f'- {label}: {mm_off(rig, run):.2f} mm before, {mm_off(better, run):.2f} mm after'
            for label, run in (('second cycle', second), ('steps', stepped))]
    result = find_gap(stepped, rig, None, None, args.seconds)
    print('| steps, all names |', told(result), '|', flush=True)
    better = replace(better, tolerance=dict.fromkeys(better.tolerance, KNOWN_NOW))
    for name, parameter, size in INJECTED:
        looks = [injected(better, run, name, parameter, size) for run in (first, second)]
        result = find_gap(looks[0], better, looks[1], MUSCLE_NAMES, args.seconds)
        print(f'| loop, {name} {parameter} {size:g} injected, from the found model |',
              told(result), '|', flush=True)
    print('\nContraction at the recorded pressure is off by, rms:\n\n' + '\n'.join(offs))


if __name__ == '__main__':
    sys.exit(main())
