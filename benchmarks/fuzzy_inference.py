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
Measure inference over 7 x 7 rules beside scikit-fuzzy, and a whole step with learning.

Run ``python benchmarks/fuzzy_inference.py`` after ``pip install -e ".[bench]"``; a
minute on one core. Exit code 1 if a bar is missed: scikit-fuzzy 1,000 times slower,
outputs equal to 1e-6, inference and learning within 10 microseconds a step.

What is compared. Both get the same triangular sets over error and change of error
and the same 49 rules, each with an output of its own. Ours multiplies the degrees
and takes the weighted mean of the outputs. scikit-fuzzy has no rules with a
number as their output. Three settings make it define the same surface. It multiplies
(``and_func``) and adds where rules share an output (``accumulation_method``). Each
output is a narrow rectangle: its centroid is the number, and its clipped area is
proportional to the degree. Degrees, firing strengths and outputs
are then compared one by one. Its own defaults (minimum, maximum, seven triangular
output sets) define another surface; they are timed too, and the faster of the two
is what ours is measured against. Most of its time goes into the graph of rules it
makes anew in every call. A third row leaves its control system out. It calls the
functions alone on arrays that were made before, for the same surface.
"""

import argparse
import sys
import time

from numba import njit
import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.inputs import INPUT
from pam_actuation.control.sofc import learning
from pam_actuation.control.sofc.membership import locate, memberships, SET_COUNT, SET_NAMES
from pam_actuation.control.sofc.records import OUTPUT
from pam_actuation.control.sofc.rule_table import infer_feedback
from pam_actuation.control.sofc.step import sofc_step
from pam_sim import load_rig
import results_page

PEAKS = np.linspace(-1.0, 1.0, SET_COUNT)
FASTER_BAR, EQUAL_BAR, STEP_BAR_S = 1000.0, 1e-6, 10e-6
_HALF_WIDTH, _EDGE = 1e-3, 1e-9           # of the rectangles that stand for numbers
STEPS, TICK_S = 200_000, 0.005


def rules(seed=0):
    """Return 49 outputs in [-1, 1] in random order, no two equal, shape (7, 7)."""
    values = np.linspace(-1.0, 1.0, SET_COUNT * SET_COUNT)
    return np.random.default_rng(seed).permutation(values).reshape(SET_COUNT, SET_COUNT)


def linear_rules():
    """Return the 49 outputs a controller starts with, 13 different ones, shape (7, 7)."""
    return 0.5 * (PEAKS[:, None] + PEAKS[None, :])


def inputs(count, seed=1):
    """Return errors and changes of error beyond the universe on both sides, shape (count,)."""
    return np.random.default_rng(seed).uniform(-1.2, 1.2, (2, count))


@njit(error_model='numpy')
def infer(table, error, change):
    """Return the output of a (2, 7, 7) table while contracting, sets located anew."""
    i, wi = locate(error, -1.0, 1.0, SET_COUNT)
    j, wj = locate(change, -1.0, 1.0, SET_COUNT)
    return infer_feedback(table, 1.0, i, wi, j, wj)


@njit(error_model='numpy')
def infer_all(table, errors, changes, out):
    """Fill ``out`` with the output at every pair of inputs."""
    for n in range(len(errors)):
        out[n] = infer(table, errors[n], changes[n])


def scikit_fuzzy(table, as_ours=True):
    """
    Return (simulation, rules) of scikit-fuzzy with the outputs of a (7, 7) table.

    Parameters
    ----------
    table : ndarray, shape (7, 7)
        Output of each rule, rows by error, columns by change of error.
    as_ours : bool
        Define what ours defines; False takes the defaults of scikit-fuzzy and the
        nearest one of seven triangular output sets.

    """
    from skfuzzy import trapmf, trimf
    from skfuzzy import control
    universe = np.linspace(-1.0, 1.0, 241)
    step = PEAKS[1] - PEAKS[0]
    antecedents = []
    for name in ('error', 'change'):
        variable = control.Antecedent(universe, name)
        for label, peak in zip(SET_NAMES, PEAKS):
            variable[label] = trimf(universe, [
                max(peak - step, -1.0), peak, min(peak + step, 1.0)])
        antecedents.append(variable)
    if as_ours:
        outputs = {f'{value:.6f}': value for value in np.unique(np.round(table, 6))}
        corners = np.array([-_HALF_WIDTH - _EDGE, -_HALF_WIDTH, _HALF_WIDTH, _HALF_WIDTH + _EDGE])
        exact = {name: table[np.isclose(table, value, rtol=0.0, atol=1e-6)][0]
                 for name, value in outputs.items()}
        consequent = control.Consequent(np.sort(np.concatenate(
            [value + corners for value in exact.values()])), 'output')
        for name, value in exact.items():
            consequent[name] = trapmf(consequent.universe, value + corners)
        consequent.accumulation_method = np.add
    else:
        consequent = control.Consequent(universe, 'output')
        for label, peak in zip(SET_NAMES, PEAKS):
            consequent[label] = trimf(universe, [
                max(peak - step, -1.0), peak, min(peak + step, 1.0)])
    made = []
    for (i, j), value in np.ndenumerate(table):
        label = f'{np.round(value, 6) + 0.0:.6f}' if as_ours else \
            SET_NAMES[int(np.argmin(np.abs(PEAKS - value)))]
        if as_ours and label not in consequent.terms:
            label = f'-{label}'               # the zero that rounding made negative
        made.append(control.Rule(
            antecedents[0][SET_NAMES[i]] & antecedents[1][SET_NAMES[j]], consequent[label],
            label=f'{i} {j}', and_func=np.multiply if as_ours else np.fmin))
    return control.ControlSystemSimulation(control.ControlSystem(made)), made


def theirs(simulation, error, change):
    """Return the output of a simulation of scikit-fuzzy."""
    simulation.input['error'] = min(max(error, -1.0), 1.0)
    simulation.input['change'] = min(max(change, -1.0), 1.0)
    simulation.compute()
    return simulation.output['output']


def with_functions(table):
    """Return a call (error, change) to output, of the functions of scikit-fuzzy alone."""
    from skfuzzy import defuzz, interp_membership
    simulation, _ = scikit_fuzzy(table)
    sets = [(variable.universe, [variable[label].mf for label in SET_NAMES])
            for variable in simulation.ctrl.antecedents]
    consequent = next(iter(simulation.ctrl.consequents))
    names = list(consequent.terms)
    outputs = np.array([consequent[name].mf for name in names])
    place_of = np.array([int(np.argmin(np.abs(np.array(names, dtype=float) - value)))
                         for value in table.ravel()])

    def output(error, change):
        degrees = [[interp_membership(universe, one, min(max(value, -1.0), 1.0))
                    for one in members]
                   for (universe, members), value in zip(sets, (error, change))]
        strengths = np.bincount(
            place_of, np.multiply.outer(*degrees).ravel(), minlength=len(names))
        return defuzz(consequent.universe, np.minimum(strengths[:, None], outputs).max(axis=0),
                      'centroid')

    return output


def differences(table, count=100):
    """
    Return the largest differences of both, as a dict of float.

    ``degree`` of a set, ``strength`` of a rule, ``output`` of all rules, over ``count``
    random inputs.
    """
    simulation, made = scikit_fuzzy(table)
    both = np.stack([table, table])
    largest = dict.fromkeys(('degree', 'strength', 'output'), 0.0)
    for error, change in inputs(count).T:
        output = theirs(simulation, error, change)
        degrees = [memberships(value) for value in (error, change)]
        for name, ours in zip(('error', 'change'), degrees):
            variable = next(v for v in simulation.ctrl.antecedents if v.label == name)
            found = [variable[label].membership_value[simulation] for label in SET_NAMES]
            _keep(largest, 'degree', np.abs(np.array(found) - ours))
        strengths = [rule.aggregate_firing[simulation] for rule in made]
        _keep(largest, 'strength', np.abs(strengths - np.outer(*degrees).ravel()))
        _keep(largest, 'output', abs(output - infer(both, error, change)))
    return largest


def _keep(largest, name, values):
    largest[name] = max(largest[name], float(np.max(values)))


def seconds_each(call, rounds):
    """Return the time of one call [s], the best of several rounds of arguments."""
    best = np.inf
    for arguments in rounds:
        start = time.perf_counter()
        for pair in arguments:
            call(*pair)
        best = min(best, (time.perf_counter() - start) / len(arguments))
    return best


def rounds_of(count, repeats):
    """Return rounds of inputs, every pair another: scikit-fuzzy remembers those it has had."""
    return inputs(count * repeats).T.reshape(repeats, count, 2).tolist()


def compare_speed(table, count):
    """Print the table of inference times; return how many times faster a call from Python is."""
    both = np.stack([table, table])
    rows = []
    for label, as_ours in (('scikit-fuzzy, same surface', True),
                           ('scikit-fuzzy, its defaults', False)):
        simulation, _ = scikit_fuzzy(table, as_ours)
        rows.append((label, seconds_each(
            lambda *pair: theirs(simulation, *pair), rounds_of(count, 3))))
    rows.append(('scikit-fuzzy, its functions alone', seconds_each(
        with_functions(table), rounds_of(count, 3))))
    many = inputs(1_000_000)
    out = np.empty(many.shape[1])
    infer_all(both, *many, out)
    rows.append(('ours, called from Python', seconds_each(
        lambda *pair: infer(both, *pair), rounds_of(20_000, 5))))
    rows.append(('ours, in a compiled loop', seconds_each(
        infer_all, 5 * [[(both, *many, out)]]) / many.shape[1]))
    yardstick = min(seconds for _, seconds in rows[:2])
    print('| inference over 49 rules | time | times faster |\n|---|---|---|')
    for label, seconds in rows:
        print(f'| {label} | {_time(seconds)} | {yardstick / seconds:,.0f} |')
    return yardstick / rows[3][1]


def _time(seconds):
    for factor, unit in ((1e3, 'ms'), (1e6, 'µs')):
        if seconds * factor >= 0.1:
            return f'{seconds * factor:.2f} {unit}'
    return f'{seconds * 1e9:.1f} ns'


@njit(error_model='numpy')
def _steps(arguments, inputs, outputs, reference, rate, lead, lead_rate, error):
    """Run the compiled step over given references and errors; see ``steps``."""
    inp, out = inputs.view(INPUT)[0], outputs.view(OUTPUT)[0]
    learned = 0
    for n in range(len(reference)):
        inp.contraction_m = reference[n] - error[n]
        inp.reference_m = reference[n]
        inp.reference_rate_m_per_s = rate[n]
        inp.lead_reference_m = lead[n]
        inp.lead_rate_m_per_s = lead_rate[n]
        inp.learning = 1.0
        inp.elapsed_s = np.nan
        inp.pressure_pa = np.nan
        inp.force_n = np.nan
        sofc_step(*arguments)
        learned += out.learning_reason == learning.LEARNING
    return learned


def steps(controller, reference, rate, lead, lead_rate, error):
    """Run a controller over given references and errors; return the ticks that learned."""
    arguments = controller.compiled_arguments()
    *_, inputs, outputs = arguments
    return _steps(arguments, inputs, outputs, reference, rate, lead, lead_rate, error)


def motion(count, lead_s):
    """Return references, rates, the same ahead, and errors of a sine of 0.5 Hz, 5 ticks each."""
    seconds = np.arange(count) * TICK_S

    def sine(t):
        return 0.014 + 0.008 * np.sin(np.pi * t), 0.008 * np.pi * np.cos(np.pi * t)

    error = 3e-4 * np.sin(2 * np.pi * 1.3 * seconds) + 5e-5
    return (*sine(seconds), *sine(seconds + lead_s), error)


def step_times(preset):
    """Print the times of whole steps of a preset; return the time of the slower kind [s]."""
    rig = load_rig('dmsp_5_300_realistic', valve=preset.rsplit('_', 1)[-1])
    controller = load_controller(preset, rig)
    given = motion(STEPS, controller.lead_s)
    steps(controller, *(column[:2000] for column in given))
    controller.reset()
    best = np.inf
    for _ in range(5):
        start = time.perf_counter()
        learned = steps(controller, *given)
        best = min(best, (time.perf_counter() - start) / STEPS)
    controller.reset()
    spent = np.empty(STEPS // 4)
    columns = list(zip(*(column[:len(spent)].tolist() for column in given)))
    for n, (reference, rate, lead, lead_rate, error) in enumerate(columns):
        start = time.perf_counter()
        controller.step(reference - error, reference, rate, lead, lead_rate)
        spent[n] = time.perf_counter() - start
    print(f'| {preset}, compiled loop | {_time(best)} | – | – | '
          f'{100.0 * learned / STEPS:.0f} % |')
    print(f'| {preset}, called from Python | {_time(np.median(spent))} | '
          f'{_time(np.percentile(spent, 99.9))} | {_time(np.max(spent))} | – |')
    return max(best, float(np.median(spent)))


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument(
        '--count', type=int, default=100, help='inferences of scikit-fuzzy in a round')
    results_page.add_write(parser, 'rule_inference')
    return parser


def main():
    """Print what is compared; return the exit code."""
    args = command_line().parse_args()
    print(f'{results_page.machine()}\n')
    with results_page.printed(args, __file__):
        return compare(args.count)


def compare(count):
    """Print the tables; return the exit code."""
    print('| whole step: inference, limits, learning | median | 99.9 % | longest | learned in |\n'
          '|---|---|---|---|---|')
    slowest = max(step_times(preset) for preset in ('sofc_ppr', 'sofc_hsv'))
    missed = [f'a step takes {_time(slowest)}'] if slowest > STEP_BAR_S else []
    try:
        import skfuzzy.control as _       # noqa: F401
    except ImportError:
        print('\nscikit-fuzzy is not installed, nothing to compare with: '
              'pip install scikit-fuzzy networkx')
        return _end(missed)
    print()
    faster = compare_speed(rules(), count)
    if faster < FASTER_BAR:
        missed.append(f'only {faster:.0f} times faster')
    print('\n| largest difference | degree of a set | strength of a rule | output |\n'
          '|---|---|---|---|')
    for label, table in (('49 different outputs', rules()), ('linear rules', linear_rules())):
        found = differences(table)
        print(f'| {label} | {found["degree"]:.1e} | {found["strength"]:.1e} | '
              f'{found["output"]:.1e} |')
        if max(found.values()) > EQUAL_BAR:
            missed.append(f'{label} differ by {max(found.values()):.1e}')
    return _end(missed)


def _end(missed):
    print('\nevery bar is met' if not missed else f'\nmissed: {"; ".join(missed)}')
    return 1 if missed else 0


if __name__ == '__main__':
    sys.exit(main())
