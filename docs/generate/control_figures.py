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

"""The figures of docs/explanation/control.md: one for each step of the controller."""

from pathlib import Path
import tempfile

from generate.drawing import BLUE, drawn, GREEN, GREY, ORANGE, PALETTE, RED
import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.control.config import load_controller
from pam_actuation.control.sofc.credit import kernel_weight
from pam_actuation.control.sofc.membership import memberships
from pam_actuation.control.sofc.performance_index import index_linear
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.report.metrics import run_metrics
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_sim import load_rig
from pam_sim.compiled import interpreted

RIG, CONTROLLER, SEED = 'dmsp_5_300_realistic', 'sofc_ppr', 1
CYCLES, LOAD_AT = 40, 20
SINE = """
name: sine
segments:
  - rest: {{duration_s: 1.0}}
  - ramp: {{to_m: 0.006, duration_s: 2.0}}
  - hold: {{duration_s: 3.0}}
  - sine: {{center_m: 0.014, amplitude_m: 0.008, frequency_hz: 0.5, cycles: {cycles}}}
"""
# From the middle on, 10 N more hang on the muscle.
LOADED = SINE + """disturbance:
  - rest: {{duration_s: {start_s}}}
  - ramp: {{to_n: 10.0, duration_s: 0.1}}
  - hold: {{duration_s: {rest_s}}}
"""
BEGIN_S, PERIOD_S = 6.0, 2.0


def draw(folder: Path) -> dict[str, str]:
    """Draw all figures into a folder; return the numbers that the page states."""
    with tempfile.TemporaryDirectory() as place:
        run = _recorded(Path(place) / 'loaded', load_experiment(LOADED.format(
            cycles=CYCLES, start_s=BEGIN_S + PERIOD_S * LOAD_AT,
            rest_s=PERIOD_S * (CYCLES - LOAD_AT) - 0.1)))
        steps = _recorded(Path(place) / 'step', load_experiment('step_10mm'))
    rules = _learned()
    _reference(steps, folder)
    _sets(run, folder)
    _rules(rules[CYCLES // 2], folder)
    _command(run, folder)
    _index(folder)
    _credit(run, folder)
    _change(rules, folder)
    cycles_mm = 1e3 * np.asarray(run_metrics(run).cycle_rmse_m)
    _guard(run, cycles_mm, folder)
    knots = rules[CYCLES // 2].feedforward
    return {
        'error of the first cycle': f'{cycles_mm[0]:.2f} mm',
        'error of cycle 20': f'{cycles_mm[LOAD_AT - 1]:.3f} mm',
        'error when the load comes': f'{cycles_mm[LOAD_AT]:.2f} mm',
        'error two cycles later': f'{cycles_mm[LOAD_AT + 2]:.2f} mm',
        'error of cycle 40': f'{cycles_mm[CYCLES - 1]:.3f} mm',
        'rules apart at 14 mm': f'{_apart_kpa(rules[CYCLES // 2], knots):.0f} kPa'}


def _recorded(bag, experiment):
    rig = load_rig(RIG)
    simulate_experiment(experiment, rig, load_controller(CONTROLLER, rig), bag, seed=SEED)
    return load_run(bag)


def _learned():
    # The same run, broken off after more and more cycles.
    rig, kept = load_rig(RIG), {}
    for cycles in (1, 2, 3, 5, 8, 12, CYCLES // 2):
        controller = load_controller(CONTROLLER, rig)
        loop = ClosedLoop(rig, load_experiment(SINE.format(cycles=cycles)), seed=SEED)
        loop.run(controller)
        kept[cycles] = controller.rules
    return kept


def _apart_kpa(rules, knots):
    at = 1e3 * rules.knots_m()
    return 1e-3 * (np.interp(14.0, at, knots[0]) - np.interp(14.0, at, knots[1]))


def _state(run, *names):
    series = run.topics['controller_state']
    return series.time_s(run.start_ns), *(np.asarray(series.values[name]) for name in names)


def _reference(run, folder):
    asked = run.topics['reference']
    moved = run.topics['contraction']
    time_s, to_go = _state(run, 'jump_to_go_m')
    newest = np.searchsorted(asked.time_s(run.start_ns), time_s, side='right') - 1
    wanted = asked.values['contraction_m'][np.maximum(newest, 0)]
    with drawn(folder / 'control_1_reference.svg') as axis:
        axis.step(time_s, 1e3 * wanted, color=GREY, ls='--', where='post', label='asked')
        axis.plot(time_s, 1e3 * (wanted - to_go), color=BLUE, label='made of it')
        axis.plot(moved.time_s(run.start_ns), 1e3 * moved.values['contraction_m'], color=ORANGE,
                  lw=1.0, label='measured')
        axis.set(xlabel='time, s', ylabel='contraction, mm', xlim=(4.6, 6.6),
                 ylim=(7, 20))
        axis.legend()


def _sets(run, folder):
    universe_mm = 2.0
    grid = np.linspace(-2.0, 2.0, 401)
    degrees = np.array([interpreted(memberships)(value / universe_mm) for value in grid])
    time_s, error = _state(run, 'error_m')
    with drawn(folder / 'control_2_sets.svg', 2) as (left, right):
        for degree, colour in zip(degrees.T, (*PALETTE[1:4], RED, *PALETTE[3:0:-1])):
            left.plot(grid, degree, color=colour)
        left.axvline(0.4, color=GREY, ls='--', lw=1.0)
        left.set(xlabel='error, mm', ylabel='degree', title='seven sets of the error')
        right.plot(time_s, 1e3 * error, color=BLUE, lw=0.9)
        right.set(xlabel='time, s', ylabel='error, mm', ylim=(-2.6, 2.6),
                  xlim=(BEGIN_S, BEGIN_S + 6 * PERIOD_S),
                  title='error of the first six cycles')


def _rules(rules, folder):
    feedback, feedforward, motion = rules.tables()
    with drawn(folder / 'control_3_rules.svg', 3) as (left, middle, right):
        names = ('contracting', 'extending')
        for k, colour in ((0, BLUE), (1, ORANGE)):
            middle.plot(1e3 * rules.knots_m(), 1e-3 * feedforward.values[k], 'o-', ms=2.5,
                        color=colour)
        middle.set(xlabel='reference, mm', ylabel='kPa', title='feed-forward rules')
        middle.text(0.0, 6.3, names[0], color=BLUE)
        middle.text(9.0, -3.0, names[1], color=ORANGE)
        error, change = (1e3 * one.knots for one in feedback.antecedents[1:])
        _map(left, change, error, 1e-3 * feedback.scale * feedback.values[0])
        left.set(xlabel='change of error, mm/s', ylabel='error, mm',
                 title='feedback, contracting')
        place, rate = (1e3 * one.knots for one in motion.antecedents)
        _map(right, rate, place, 1e-3 * motion.scale * motion.values)
        right.set(xlabel='rate, mm/s', ylabel='reference, mm', title='motion rules',
                  xlim=(-35, 35))


def _map(axis, x, y, values_kpa):
    limit = np.abs(values_kpa).max()
    picture = axis.pcolormesh(x, y, values_kpa, cmap='RdBu_r', vmin=-limit, vmax=limit,
                              shading='gouraud', rasterized=True)
    axis.grid(False)
    axis.figure.colorbar(picture, ax=axis, label='kPa')


def _command(run, folder):
    names = ('inverse_pa', 'dynamic_feedforward_pa', 'feedback_rules_pa', 'feedforward_rules_pa',
             'motion_rules_pa', 'integral_pa', 'command_pa')
    time_s, *parts = _state(run, *names)
    parts = dict(zip(names, (1e-3 * part for part in parts)))
    last = BEGIN_S + PERIOD_S * (LOAD_AT - 1)
    rules = sum(part for name, part in parts.items() if name.endswith('rules_pa'))
    with drawn(folder / 'control_4_command.svg', 2) as axes:
        for axis, begin, title in zip(axes, (BEGIN_S, last), ('first cycle', 'cycle 20')):
            axis.plot(time_s - begin, rules, color=BLUE, label='rules')
            axis.plot(time_s - begin, parts['dynamic_feedforward_pa'], color=GREEN,
                      label='known dynamics')
            axis.plot(time_s - begin, parts['integral_pa'], color=ORANGE, label='integral')
            axis.set(xlabel='time in the cycle, s', xlim=(0, PERIOD_S), title=title)
        axes[0].set_ylabel('part of the command, kPa')
        low, high = min(a.get_ylim()[0] for a in axes), max(a.get_ylim()[1] for a in axes)
        for axis in axes:
            axis.set_ylim(low, high)
        axes[1].legend()


def _index(folder):
    error, rate = np.linspace(-2.0, 2.0, 81), np.linspace(-40.0, 40.0, 81)
    with drawn(folder / 'control_5_index.svg', 2, sharey=True) as axes:
        for axis, tau_s in zip(axes, (0.06, 0.001)):
            values = np.array([[1e3 * interpreted(index_linear)(1e-3 * e, 1e-3 * v, tau_s, 2e-3)
                                for v in rate] for e in error])
            picture = axis.pcolormesh(rate, error, values, cmap='RdBu_r', vmin=-2, vmax=2,
                                      shading='gouraud', rasterized=True)
            axis.plot(rate, -1e-3 * rate * tau_s * 1e3, color='black', lw=1.0)
            axis.set(xlabel='change of error, mm/s', ylim=(-2, 2),
                     title=f'tau = {1e3 * tau_s:g} ms')
            axis.grid(False)
        axes[0].set_ylabel('error, mm')
        axes[1].figure.colorbar(picture, ax=axes[1], label='index p, mm')


def _credit(run, folder):
    time_s, index = _state(run, 'performance_index_m')
    begin, delay_s, spread = BEGIN_S + 0.6, 0.13, 11
    with drawn(folder / 'control_6_credit.svg', 2) as (left, right):
        left.plot(time_s - begin, 1e3 * index, color=RED, label='index p, mm')
        left.axvline(0.4, color=GREY, lw=1.0)
        left.axvspan(0.4 - delay_s - 0.055, 0.4 - delay_s + 0.055, color='#dbeafe',
                     label='rules that answer for it')
        left.set(xlabel='time, s', xlim=(0, 0.8), ylabel='index, mm', title='now: the grey line')
        left.legend()
        offsets = np.arange(-spread, spread + 1)
        weights = [interpreted(kernel_weight)(o, spread) for o in offsets]
        right.bar(5.0 * offsets - 1e3 * delay_s, weights, width=4.0, color=BLUE)
        right.set(xlabel='time before now, ms', ylabel='weight', title='the kernel')


def _change(rules, folder):
    with drawn(folder / 'control_7_change.svg', 2, sharey=True) as axes:
        for axis, way, title in zip(axes, (0, 1), ('contracting', 'extending')):
            for (cycles, one), colour in zip(rules.items(), (*PALETTE, 'black')):
                axis.plot(1e3 * one.knots_m(), 1e-3 * one.feedforward[way], 'o-', ms=2.5,
                          color=colour, label=f'after {cycles}')
            axis.set(xlabel='reference, mm', title=title)
        axes[0].set_ylabel('feed-forward rule, kPa')
        axes[0].legend()


def _guard(run, cycles_mm, folder):
    time_s, factor, back = _state(run, 'learning_rate_factor', 'times_rolled_back')
    with drawn(folder / 'control_8_guard.svg', 2) as (left, right):
        left.semilogy(np.arange(1, len(cycles_mm) + 1), cycles_mm, 'o-', ms=3.0, color=BLUE)
        left.axvline(LOAD_AT + 0.5, color=RED, lw=1.0, ls='--')
        left.set(xlabel='cycle', ylabel='error of the cycle, mm rms')
        cycle = (time_s - BEGIN_S) / PERIOD_S + 0.5
        right.plot(cycle, factor, color=ORANGE, label='learning rate')
        right.plot(cycle, back, color=GREY, label='times rolled back')
        right.axvline(LOAD_AT + 0.5, color=RED, lw=1.0, ls='--', label='10 N more')
        right.set(xlabel='cycle', ylabel='factor, count', xlim=left.get_xlim())
        right.legend()
