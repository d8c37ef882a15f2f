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
Two other ways to name a hidden effect, for benchmarks/hidden_effects.py.

Forward selection by BIC over the same library: free runs of the whole chain, white noise,
no held-out part, no test of materiality. Sparse regression of residuals as in SINDy
(pysindy, if installed): derivatives of the recorded signals, one term per effect that can be
written as a term. Each method gets the bags of a case and returns the data of a ``gap.json``.

The first names no wrong number of the model. The second has no equation of on/off valves, so it
can name no effect of theirs.
"""

import importlib.util
import time

import numpy as np
from pam_actuation.bags.load import load_run
from pam_sim.errors import InputError
from pam_sim.gap.data.noise import sensor_floor
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.select.candidates import candidates
from pam_sim.gap.subsystems.simulation import free_run
from pam_sim.model_file import load_rig
from pam_sim.units import GRAVITY_M_PER_S2, P_ATM_PA
from scipy.optimize import least_squares
from scipy.signal import savgol_filter

RATE_HZ = 50.0                # of the samples that forward selection counts
LATENCY_S = 1e-3             # mean and deviation
LARGEST = 3                   # effects it may add
SECONDS = 90.0
REFUSED = 1e3
GRID_S = 0.002
WINDOW = 31                   # samples of the differentiating filter: 60 ms
THRESHOLD = 0.15              # of the residual's deviation: smaller terms are dropped
WRONG = 0.07                  # relative error of a number that is called wrong
LEAST_SHARE = 0.2             # of the residual's variance, for a term to be named


def forward_selection(folder):
    """Return what forward selection by BIC names."""
    begun = time.perf_counter()
    rig = load_rig(folder / 'model.yaml')
    run = load_run(folder / 'fit')
    recording = Recording(run, rig.valve)
    floor = {s: sensor_floor(recording.time_s[s], recording.measured[s], s)
             for s in recording.signals}
    every = {s: max(int(round(1.0 / (np.median(np.diff(recording.time_s[s])) * RATE_HZ))), 1)
             for s in recording.signals}
    known = [p for p in rig.parameter_list if rig.tolerance[p.name] > 0.0]
    deviation = [rig.tolerance[p.name] * rig.parameters[p.name] for p in known]

    def errors(chosen, theta, z):
        changed = rig.with_(
            parameters={k.name: rig.parameters[k.name] + sd * step
                        for k, sd, step in zip(known, deviation, z)},
            effects=[c.setting({f.name: f.value(t) for f, t in zip(c.free, part)})
                     for c, part in zip(chosen, _split(theta, chosen))])
        try:
            found = free_run(changed, recording, LATENCY_S * (1.0 + z[-1]))
        except InputError:
            return np.full(size, REFUSED)
        return np.concatenate([((found[s] - recording.measured[s]) / floor[s])[::every[s]]
                               for s in recording.signals])

    size = sum(len(recording.measured[s][::every[s]]) for s in recording.signals)
    zero = np.zeros(len(known) + 1)          # the last one is the latency of the sensors
    base = errors((), (), zero)
    slopes = np.column_stack([errors((), (), row) - base for row in np.eye(zero.size)])
    library = candidates(rig, recording.signals)

    def fit(chosen, start):
        def whole(x):
            theta, z = x[:len(start)], x[len(start):]
            return np.concatenate([errors(chosen, theta, zero) + slopes @ z, z])
        solution = least_squares(whole, np.concatenate([start, zero]), max_nfev=4,
                                 jac=lambda x: _jacobian(whole, x, len(start), slopes))
        squares = float(np.sum(whole(solution.x)[:size] ** 2))
        return size * np.log(squares / size) + len(start) * np.log(size), solution.x[:len(start)]

    chosen, theta = (), np.zeros(0)
    best, _ = fit(chosen, theta)
    while len(chosen) < LARGEST and time.perf_counter() - begun < SECONDS:
        trials = []
        for candidate in library:
            if candidate.name in [c.name for c in chosen]:
                continue
            start = np.array([0.0 if f.shape else 0.5 for f in candidate.free])
            trials.append((*fit((*chosen, candidate), np.concatenate([theta, start])), candidate))
        bic, better, candidate = min(trials, key=lambda t: t[0])
        if bic >= best - 10.0:
            break
        best, theta, chosen = bic, better, (*chosen, candidate)
    return _result([c.name for c in chosen], begun)


def _split(theta, chosen):
    ends = np.cumsum([len(c.free) for c in chosen])
    return np.split(np.asarray(theta), ends[:-1]) if len(chosen) else []


def _jacobian(function, x, count, slopes):
    """Return derivatives by differences for the effects, the known slopes for the numbers."""
    base = function(x)
    columns = np.zeros((base.size, x.size))
    columns[:, count:] = np.vstack([slopes, np.eye(x.size - count)])
    for k in range(count):
        moved = np.array(x)
        moved[k] += 0.02
        columns[:, k] = (function(moved) - base) / 0.02
    return columns


def _result(names, begun, parameters=()):
    verdict = 'effects' if names else 'parameter' if parameters else 'no_gap'
    return {'verdict': verdict, 'effects': [{'name': n} for n in names],
            'parameters': [{'name': n, 'value': 0.0} for n in parameters],
            'ambiguity_set': list(names), 'runtime_s': time.perf_counter() - begun,
            'unexplained_fraction': 0.0}


def sparse_regression(folder):
    """Return what sparse regression of the residuals of three equations names."""
    import pysindy
    begun = time.perf_counter()
    rig = load_rig(folder / 'model.yaml')
    signals = _derived(load_run(folder / 'fit'), rig)
    best, wrong = ('', 0.0), ''
    for residual, numbers, terms in _equations(rig, signals):
        # The numbers of the rig are no discovery: what they explain is taken out first.
        known = np.column_stack(list(numbers.values()))
        shares = np.linalg.lstsq(known, residual, rcond=None)[0]
        for name, share in zip(numbers, shares):
            if abs(share) > WRONG:
                wrong = name
        left = residual - known @ shares
        table = np.column_stack(list(terms.values()))
        table = table - known @ np.linalg.lstsq(known, table, rcond=None)[0]
        table /= np.sqrt(np.mean(table ** 2, axis=0)) + 1e-12
        left /= np.sqrt(np.mean(left ** 2))
        model = pysindy.SINDy(optimizer=pysindy.STLSQ(threshold=THRESHOLD, alpha=1e-6),
                              feature_library=pysindy.IdentityLibrary())
        # The terms are the states, the residual is what a linear law of them explains.
        model.fit(table, t=GRID_S, x_dot=np.column_stack([left] * table.shape[1]))
        for name, weight, column in zip(terms, model.coefficients()[0], table.T):
            share = 1.0 - float(np.mean((left - weight * column) ** 2))
            if weight != 0.0 and share > max(best[1], LEAST_SHARE):
                best = (name, share)
    name = best[0]
    return _result([name] if name else [], begun, [wrong] if wrong and not name else [])


def _derived(run, rig):
    """Return the signals of a run with their derivatives, on one grid."""
    recording = Recording(run, rig.valve)
    t = np.arange(0.5, recording.grid_s[-1] - 0.5, GRID_S)
    found = {'t': t}
    for name, values in recording.measured.items():
        on_grid = np.interp(t, recording.time_s[name], values)
        for order in range(3):
            found[f'{name}_{order}'] = savgol_filter(on_grid, WINDOW, 3, order, GRID_S)
    signal = np.atleast_2d(recording.valve_signal().T).T
    inside = np.clip((t / 1e-3).astype(int), 0, len(signal) - 1)
    for k in range(signal.shape[1]):
        found[f'signal_{k}'] = savgol_filter(signal[inside, k], WINDOW, 3)
        found[f'signal_{k}_rate'] = savgol_filter(signal[inside, k], WINDOW, 3, 1, GRID_S)
    return found


def _equations(rig, s):
    """Yield (residual, {number: term}, {effect: term}) of regulator, muscle and load."""
    n = rig.parameters
    x, v, a = (s[f'contraction_{k}'] for k in range(3))
    p, rate = s['pressure_0'] - P_ATM_PA, s['pressure_1']
    moving = x > 5e-4
    if rig.valve == 'ppr':
        target = n['K_m'] * s['signal_0']
        distance = target - p
        yield n['T_m'] * rate - distance, {'T_m': n['T_m'] * rate, 'K_m': target}, {
            'tube_lag': s['pressure_2'],
            'valve_dead_time': n['K_m'] * s['signal_0_rate'], 'pressure_bias': np.ones(p.size),
            'leakage': p + P_ATM_PA, 'valve_dead_zone': np.tanh(distance / 1e3),
            'vent_asymmetry': np.minimum(distance, 0.0),
            'valve_hysteresis': np.tanh(s['signal_0_rate'] / 0.05)}
    strain = np.clip(x / rig.muscle.length_m, 0.0, 0.3)

    def law(gauge, strained):
        return n['force_map_gain'] * np.array(
            rig.muscle.law.law.force_n(np.maximum(gauge, 0.0), strained, 'allow'))

    pull = law(p, strain)
    direction = np.tanh(v / 1e-3)
    if 'force_0' in s:
        force = s['force_0']
        residual = force - pull + n['damping_n_s_per_m'] * v
        yield residual[moving], {'force_map_gain': pull[moving]}, {
            k: c[moving] for k, c in {
                'force_bias': np.ones(x.size), 'bladder_stiffness': x, 'viscous_damping': v,
                'coulomb_friction': direction, 'pressure_friction': p * direction,
                'threshold_pressure': law(p + 1e3, strain) - law(p, strain),
                'end_taper': law(p, 1.02 * strain) - law(p, strain),
                'creep': _slow(x, 1.0)}.items()}
        residual = force - n['mass_kg'] * (a + GRAVITY_M_PER_S2)
        weight = n['mass_kg'] * (a + GRAVITY_M_PER_S2)
        yield residual[moving], {'mass_kg': weight[moving]}, {
            k: c[moving] for k, c in {
                'force_bias': np.ones(x.size), 'parallel_spring': x,
                'guide_friction': direction}.items()}


def _slow(x, time_s):
    """Return x less what a first order lag makes of it."""
    from scipy.signal import lfilter
    keep = np.exp(-GRID_S / time_s)
    return x - lfilter([1.0 - keep], [1.0, -keep], x, zi=[keep * x[0]])[0]


METHODS = {'forward selection by BIC': forward_selection}
if importlib.util.find_spec('pysindy'):
    METHODS['sparse regression (pysindy)'] = sparse_regression
