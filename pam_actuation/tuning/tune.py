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
Offline tuning: settings of a controller optimised over closed-loop rollouts.

Differential evolution (Storn and Price 1997, scipy) in the unit cube of
``space``; the same seed gives the same result with any number of jobs.
Rollouts go through joblib: threads by default (compiled code holds no lock),
or whatever backend ``joblib.parallel_config`` names, a cluster for instance.
"""

from dataclasses import dataclass, field
import time

import joblib
import numpy as np
from pam_actuation.control.config import controller_to_yaml
from pam_actuation.control.files import write_atomically
from pam_actuation.control.pid import PidController
from pam_actuation.control.sofc.controller import SelfOrganizingFuzzyController
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_actuation.tuning.cost import tracking_cost_mm
from pam_actuation.tuning.space import check_axes, default_axes, from_unit, to_unit
from pam_sim.errors import InputError
from scipy.optimize import differential_evolution

HELD_OUT_SEED = 7919      # added to the seed for the noise the optimiser never sees


@dataclass
class TuneResult:
    """
    Outcome of a tuning.

    Attributes
    ----------
    controller : SelfOrganizingFuzzyController or PidController
        With the tuned settings and the rules it was given, ready to run.
    changed : dict of str -> (float, float)
        Settings before and after.
    history : list of (int, float)
        Rollouts done and best training cost [mm] so far.
    cost_before, cost_after : float
        Training cost [mm].
    held_out_before, held_out_after : float
        Cost [mm] on runs the optimiser did not see.
    improved : bool
        The held-out cost fell; otherwise ``controller`` has the settings from before.
    rollouts : int
        Closed-loop runs simulated, the held-out ones included.
    seconds : float
        Wall-clock time.

    """

    controller: object
    changed: dict
    history: list
    cost_before: float
    cost_after: float
    held_out_before: float
    held_out_after: float
    improved: bool
    rollouts: int
    seconds: float
    axes: tuple = field(default=(), repr=False)

    def to_yaml(self):
        """Return the tuned controller as YAML text for ``load_controller``."""
        return controller_to_yaml(self.controller)

    def save(self, path):
        """
        Write the tuned controller to a file, whole or not at all.

        Raises
        ------
        InputError
            The file cannot be written.

        """
        write_atomically(path, self.to_yaml())

    def to_dict(self):
        """Return the outcome as plain data."""
        return {
            'improved': self.improved,
            'cost_before_mm': self.cost_before, 'cost_after_mm': self.cost_after,
            'held_out_before_mm': self.held_out_before, 'held_out_after_mm': self.held_out_after,
            'rollouts': self.rollouts, 'seconds': self.seconds,
            'changed': {name: {'before': before, 'after': after}
                        for name, (before, after) in self.changed.items()}}

    def text(self):
        """Return the outcome for people."""
        verdict = 'better' if self.improved else 'not better: settings left as they were'
        lines = [
            f'{self.rollouts} rollouts in {self.seconds:.1f} s; cost on held-out runs '
            f'{self.held_out_before:.3f} -> {self.held_out_after:.3f} mm, {verdict}']
        lines += [f'  {name}: {before:g} -> {after:g}'
                  for name, (before, after) in self.changed.items()]
        return '\n'.join(lines)


def rebuild(controller, settings):
    """Return a fresh controller of the same kind, rig and rules with other settings."""
    merged = {**controller.settings, **settings}
    if controller.kind == 'pid':
        return PidController(controller.static_inverse, merged, controller.rig_name)
    fresh = SelfOrganizingFuzzyController(
        controller.static_inverse, merged, rig_name=controller.rig_name)
    if fresh.rules.scaling == controller.rules.scaling:
        fresh.rules.assign(controller.rules)
    fresh.freeze_learning = controller.freeze_learning
    return fresh


def evaluate(loops, controller, settings):
    """Return the mean cost [mm] of settings over closed loops, each from the same rules."""
    costs = []
    for loop in loops:
        log = loop.run_raw(rebuild(controller, settings))
        costs.append(tracking_cost_mm(loop.reference_m - log[:, 0], loop.start_tick))
    return float(np.mean(costs))


def _as_list(thing):
    return list(thing) if isinstance(thing, (list, tuple)) else [thing]


def tune(rig, controller, experiment, budget=400, seed=0, jobs=1, progress=None, axes=None,
         held_out=None, population=None, patience=0):
    """
    Tune the settings of a controller on a model.

    Parameters
    ----------
    rig : Rig or list of Rig
        Cost is the mean over all (nominal and randomised ones, for instance). The valve driver
        knows the data sheet of the first one only.
    controller : SelfOrganizingFuzzyController or PidController
        Start of the search; not changed. Its rules are where every rollout starts.
    experiment : Experiment or list of Experiment
        Domain ``contraction``; cost is the mean over all.
    budget : int
        Largest number of training rollouts.
    seed : int
        Of the optimiser and, apart from the held-out runs, of the sensor noise.
    jobs : int
        Parallel rollouts.
    progress : callable, optional
        Called with the number of rollouts done after every generation.
    axes : tuple of space.Axis, optional
        What to tune; ``space.default_axes`` by default.
    held_out : Experiment or list, optional
        Judges the result, with other noise; the training experiments by default.
    population : int, optional
        Members of the population; chosen from the budget by default.
    patience : int
        Stop after so many generations without improvement; 0 = never.

    Returns
    -------
    TuneResult

    Raises
    ------
    InputError
        Budget too small, unknown axis, experiment not in contraction.

    """
    began = time.perf_counter()
    axes = tuple(axes) if axes is not None else default_axes(controller)
    check_axes(axes, controller.settings)
    rigs, experiments = _as_list(rig), _as_list(experiment)
    rate_hz = controller.rate_hz
    driver = driver_config(rigs[0])
    train = [ClosedLoop(r, e, seed, rate_hz, driver=driver) for r in rigs for e in experiments]
    test = [ClosedLoop(r, e, seed + HELD_OUT_SEED, rate_hz, driver=driver)
            for r in rigs for e in _as_list(held_out or experiments)]
    members = population or int(min(max(budget // (10 * len(train)), 5), 3 * len(axes)))
    generations = budget // (members * len(train)) - 1
    if members < 5 or generations < 1:
        raise InputError(
            f'a budget of {budget} rollouts is too small: {2 * len(train) * max(members, 5)} at '
            'least', 'budget')
    before = {axis.name: controller.settings[axis.name] for axis in axes}
    start = to_unit(axes, before)
    cost_before = evaluate(train, controller, {})
    seen = {'rollouts': 0, 'best': cost_before, 'since': 0}
    history = [(0, cost_before)]

    def mapped(_, points):
        """Evaluate a whole generation; ``differential_evolution`` calls it as ``map``."""
        points = [np.array(point) for point in points]
        with joblib.Parallel(n_jobs=jobs, prefer='threads') as parallel:
            costs = parallel(
                joblib.delayed(evaluate)(train, controller, from_unit(axes, point))
                for point in points)
        seen['rollouts'] += len(points) * len(train)
        best = min(costs)
        seen['since'] = 0 if best < seen['best'] else seen['since'] + 1
        seen['best'] = min(seen['best'], best)
        history.append((seen['rollouts'], seen['best']))
        if progress is not None:
            progress(min(seen['rollouts'], budget))
        return costs

    found = differential_evolution(
        lambda point: 0.0, [(0.0, 1.0)] * len(axes), workers=mapped, updating='deferred',
        init=_first_generation(start, members, seed), maxiter=generations, rng=seed, tol=0.0,
        polish=False, mutation=(0.4, 0.9), recombination=0.8,
        callback=lambda *_: bool(patience) and seen['since'] >= patience)
    after = from_unit(axes, found.x)
    cost_after = float(found.fun)
    if cost_after >= cost_before:       # the start may lie outside the box of the axes
        after, cost_after = {}, cost_before
    held_before = evaluate(test, controller, {})
    held_after = evaluate(test, controller, after) if after else held_before
    improved = held_after < held_before
    tuned = rebuild(controller, after if improved else {})
    changed = {name: (before[name], tuned.settings[name]) for name in before
               if tuned.settings[name] != before[name]}
    return TuneResult(
        tuned, changed, history, cost_before, cost_after, held_before, held_after, improved,
        seen['rollouts'] + len(train) + 2 * len(test), time.perf_counter() - began, axes)


def _first_generation(start, members, seed):
    """Return the start, a cloud around it, and as many points anywhere in the unit cube."""
    random = np.random.default_rng(seed)
    near = start + random.normal(0.0, 0.12, (members, len(start)))
    near[1::2] = random.uniform(0.0, 1.0, near[1::2].shape)
    near[0] = start
    return np.clip(near, 0.0, 1.0)
