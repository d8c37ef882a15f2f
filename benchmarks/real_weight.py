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
`pam gap` on records of a muscle that lifts a weight, by others, beside black boxes.

    python benchmarks/real_weight.py FOLDER [--case steps sizes sines empty] [--write]

FOLDER is ``data`` of a clone of github.com/raymondturrisi/mit_2-151. It states no licence, so the
records are no part of this project. Each case goes the way of a stranger: ``pam import``,
``pam rig new``, then what ``pam gap`` finds with all names. Some records are fitted, another one
is judged, in free run from the command alone. Black boxes see the same records at 100 Hz.
"""

import argparse
import contextlib
import io
from pathlib import Path
import sys
import tempfile

import black_boxes
import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.cli.main import main as pam
from pam_actuation.report.gap import gap_of
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.gap.data.commanded import commanded
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.subsystems.simulation import free_run
import results_page
from scipy.optimize import least_squares

MAPS = ('pressure=Piezo_P_(mA):bar_gauge:zero=4:gain=0.75:missing=0',
        'pressure_command=Piezo_out_(mV):bar_gauge:zero=4000:gain=0.000375',
        'contraction=V_dist_(mA):mm:zero=18.9:gain=-6.25:missing=0')
RIG = ('--muscle', 'dmsp_10_250', '--length-mm', '300', '--unknown', 'law', '--regulator-kpa',
       '0:600')
_STEP = '2022-12-07/2022-12-07_{}_step_exp/*.dat'
_OLD_STEP = '2022-11-28/2022-11-28_{}_step_exp/*.dat'
_SINE = '2022-12-07/frq_test_batch_1/*_frq_test_rads-{}_exp/*.dat'
_FREE = '2022-11-28/frq_test_batch_1/*_frq_test_rads-{}_exp/*.dat'
# Name: what it is, mass [kg], records that are fitted, the one that is judged.
CASES = {
    'steps': ('sandbag, steps of 150 kPa up and down; the steps down once more', 7.6,
              [_STEP.format(182351), _STEP.format(182800)], _STEP.format(184021)),
    'sizes': ('sandbag, steps of 150 kPa; steps of 240 kPa from another day', 7.6,
              [_STEP.format(182351), _STEP.format(182800)], _OLD_STEP.format(190714)),
    'sines': ('sandbag, sines of 50 kPa at 1.6, 6.3 and 15.7 rad/s; at 9.4 rad/s', 7.6,
              [_SINE.format(w) for w in ('1,57', '6,28', '15,70')], _SINE.format('9,42')),
    'empty': ('carriage alone, sines of 300 kPa at 1.6, 6.3 and 14.1 rad/s; at 9.4 rad/s', 0.36,
              [_FREE.format(w) for w in ('1,57', '6,28', '14,13')], _FREE.format('9,42'))}
# Name of a number or an effect's: start, least, most. What the eye sees in the steps.
BY_HAND = {('', 'K_m'): (98e3, 90e3, 110e3), ('', 'T_m'): (0.02, 0.004, 0.3),
           ('', 'ppr_zero_pa'): (-4e3, -3e4, 3e4),
           ('valve_dead_time', 'delay_s'): (0.02, 0.0, 0.1),
           ('flow_limit', 'fill_rate_at_400kpa_pa_per_s'): (3e6, 2e5, 5e7),
           ('flow_limit', 'vent_rate_at_400kpa_pa_per_s'): (3e6, 2e5, 5e7)}
BEGIN_S = 0.5                # of a record, that no model is judged on: sensors that begin at 0
RATE_HZ, DELAYS = 100.0, range(0, 9)
SIGNALS = {'pressure': ('pressure_pa', 1e-3, 'kPa'), 'contraction': ('contraction_m', 1e3, 'mm')}
BAR = 1.2


def one_file(folder, pattern):
    """Return the file that a pattern names; raise InputError without it."""
    found = sorted(Path(folder).glob(pattern))
    if len(found) != 1:
        raise InputError(f'{len(found)} files match {pattern}, not 1', str(folder))
    return str(found[0])


def command(*words):
    """Run a command of `pam` without its text; exit code 1 is a remark on the data."""
    with contextlib.redirect_stdout(io.StringIO()):
        code = pam([str(word) for word in words])
    if code not in (0, 1):
        raise RuntimeError(f'pam {words[0]} ended with {code}')


def imported(file, out):
    """Return the Run of a file, as `pam import` reads it."""
    command('import', file, *(word for one in MAPS for word in ('--map', one)), '--from',
            BEGIN_S, '--out', out)
    return load_run(out)


def rig_of(mass_kg, out):
    """Return the rig that `pam rig new` writes."""
    command('rig', 'new', *RIG, '--known', f'mass_kg={mass_kg}', '--out', out)
    return load_rig(out)


def on_grid(run):
    """Return (stamps [ns], command [Pa], signals) of a run at the rate of the black boxes."""
    begin = max(one.stamp_ns[0] for one in run.topics.values())
    end = min(one.stamp_ns[-1] for one in run.topics.values())
    stamps = np.arange(begin, end, int(1e9 / RATE_HZ))
    asked = run.topics['pressure_command']
    held = asked.values['pressure_pa'][np.searchsorted(asked.stamp_ns, stamps, 'right') - 1]
    return stamps, held, {
        name: np.interp(stamps, run.topics[name].stamp_ns, run.topics[name].values[field])
        for name, (field, *_) in SIGNALS.items()}


def black_box_errors(kind, runs, judged, traces):
    """
    Return {signal: (rms on the fitted runs, on the judged one, label)} of a kind of black box.

    The judged errors are those at the stamps of the readings that `pam gap` is judged at, which
    ``traces`` hold.
    """
    grids = [on_grid(run) for run in (*runs, judged)]
    sizes = [len(stamps) for stamps, *_ in grids]
    begins = (0, *np.cumsum(sizes)[:-1])
    asked = np.concatenate([held for _, held, _ in grids])
    fitted = np.arange(len(asked)) < begins[-1]
    errors = {}
    for name in SIGNALS:
        measured = np.concatenate([values[name] for *_, values in grids])
        free, _, label = kind(asked, measured, fitted, DELAYS, begins)
        stamps, trace = grids[-1][0], traces[name]
        inside = (trace.stamp_ns >= stamps[0]) & (trace.stamp_ns <= stamps[-1])
        off = np.interp(trace.stamp_ns, stamps, free[begins[-1]:]) - trace.measured
        errors[name] = (black_boxes.rms((free - measured)[fitted]), black_boxes.rms(off[inside]),
                        label)
    return errors


def free_errors(found, given, judged):
    """Return the errors (rms) of a rig in free run by signal, in the unit of people."""
    recording = Recording(commanded([judged], given)[0][0], 'ppr')
    simulated = free_run(found, recording)
    return [SIGNALS[signal][1] * black_boxes.rms(simulated[signal] - recording.measured[signal])
            for signal in SIGNALS]


def by_hand(rig, given, runs):
    """Return the rig whose valve has a dead time and limits, fitted to runs."""
    recordings = [Recording(run, 'ppr') for run in commanded(runs, given)[0]]
    starts, low, high = np.array([*BY_HAND.values()]).T
    scale = np.abs(starts)

    def made(x):
        values = {}
        for (effect, name), value in zip(BY_HAND, x * scale):
            values.setdefault(effect, {})[name] = value
        return rig.with_(parameters=values.pop(''), effects=[
            {'name': name, 'parameters': own} for name, own in values.items()])

    fits = [least_squares(
        lambda x: np.concatenate([
            free_run(made(x), one)['pressure'] - one.measured['pressure'] for one in recordings]),
        np.r_[1.0, lag_s / scale[1], -1.0, delay_s / scale[3], 1.0, 1.0],
        bounds=(low / scale, high / scale), diff_step=1e-2)
        for lag_s, delay_s in ((0.02, 0.02), (0.006, 0.01), (0.006, 0.03), (0.05, 0.005))]
    return made(min(fits, key=lambda fit: fit.cost).x)


def show(name, folder, seconds, scratch):
    """Print the table of one case."""
    told, mass_kg, fitted, judged = CASES[name]
    runs = [imported(one_file(folder, pattern), scratch / f'{name}_{number}')
            for number, pattern in enumerate((*fitted, judged))]
    rig = rig_of(mass_kg, scratch / f'{name}.yaml')
    result = gap_of(runs[:-1], rig, runs[-1], seconds=seconds)
    print(f'**{name}**: {told}. Verdict {result.verdict}: '
          + (', '.join(f'`{one["name"]}`' for one in result.effects) or 'nothing named')
          + f'; {result.simulations} simulations.\n')
    print('| in free run from the command, rms, judged | pressure [kPa] | contraction [mm] |\n'
          '|---|---|---|')
    rows = {title: [SIGNALS[signal][1] * black_boxes.rms(
        getattr(result.traces[signal], field) - result.traces[signal].measured)
        for signal in SIGNALS] for title, field in (
            ('before', 'before'), ('calibrated', 'refit'), ('`pam gap`', 'after'))}
    best = '`pam gap`'
    if result.surrogate:
        best = f'its surrogate: {", ".join(f"`{one}`" for one in result.surrogate.names)}'
        rows[best] = free_errors(load_rig(result.surrogate.model_yaml), rig, runs[-1])
    hand = by_hand(load_rig(result.model_yaml).with_(effects=[]), rig, runs[:-1])
    rows['dead time, fill and vent limits, chosen by hand'] = free_errors(hand, rig, runs[-1])
    labels = []
    for kind in (black_boxes.arx, black_boxes.narx):
        title, errors = kind.__name__.upper(), black_box_errors(
            kind, runs[:-1], runs[-1], result.traces)
        rows[title] = [SIGNALS[signal][1] * errors[signal][1] for signal in SIGNALS]
        labels += [f'{title}, {signal}: {label}' for signal, (*_, label) in errors.items()]
    for title, cells in rows.items():
        print(f'| {title} | {cells[0]:.2f} | {cells[1]:.3f} |')
    times = [rows[best][k] / min(rows['ARX'][k], rows['NARX'][k]) for k in (0, 1)]
    print(f'\nTimes the best black box: pressure {times[0]:.2f}, contraction {times[1]:.2f}; '
          f'bar {BAR}. ' + '; '.join(labels) + '.\n', flush=True)


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('folder')
    parser.add_argument('--case', nargs='+', choices=CASES, default=list(CASES))
    parser.add_argument('--seconds', type=float, default=300.0, help='budget of each search')
    results_page.add_write(parser, 'real_records')
    return parser


def main():
    """Print the tables of the cases; exit code 2 without the records."""
    args = command_line().parse_args()
    try:
        with tempfile.TemporaryDirectory() as scratch:
            for name in args.case:
                with results_page.printed(args, __file__, name):
                    show(name, args.folder, args.seconds, Path(scratch))
    except InputError as mistake:
        print(f'real_weight: {mistake}', file=sys.stderr)
        return 2
    return 0


if __name__ == '__main__':
    sys.exit(main())
