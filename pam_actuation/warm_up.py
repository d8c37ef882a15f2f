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
Compile the numerical code before it is needed: ``python -m pam_actuation.warm_up``.

The first use of the physics and of the control laws compiles them, rig and joint, each control law
and its rollouts. On a small machine that takes about two minutes. numba keeps the result beside
the installed files. Nodes that start at the same time would each compile the same, and wait for
one another meanwhile.
"""

from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
import sys
import tempfile
from typing import Any

import joblib
import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.delay_estimate import DelayEstimator
from pam_actuation.control.valve_delay import ValveDelayEstimator
from pam_actuation.experiments import Experiment, load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.parallel import in_processes
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_actuation.tuning.force_loop import ForceLoop
from pam_actuation.tuning.joint_loop import JointLoop
from pam_sim import load_rig
from pam_sim.effects.unnamed.reading import with_terms
from pam_sim.effects.valve_dead_zone_gradual import mean_openings_with_lift
from pam_sim.gap.propose.response import follow
from pam_sim.joint import load_joint
from pam_sim.muscle.registry import make_law
from pam_sim.valve import VALVES

RIG = 'dmsp_5_300_realistic'
NOMINAL_RIG = 'dmsp_5_300_hanging_mass'
FORCE_RIG = 'dmsp_5_300_isometric_realistic'
JOINT = 'joint_dmsp_5_300'
FIRST = 'pid'
LAWS = (FIRST, 'sofc_ppr', 'lqi', 'ilc_ppr', 'mpc_ppr')
RATE_HZ = 200.0
ROWS = 10       # of a rollout: it is compiled before the first one


def short(domain: str, values: str) -> Experiment:
    """Return a short experiment: a ramp to ``values``, a YAML entry, in a domain."""
    return load_experiment(
        f'name: short\ndomain: {domain}\nsegments:\n  - rest: {{duration_s: 0.1}}\n'
        f'  - ramp: {{{values}, duration_s: 0.2}}\n')


def muscle() -> None:
    """Run a short experiment with each rig, valve and law, as live nodes step through it."""
    experiment = short('contraction', 'to_m: 0.002')
    for name in (NOMINAL_RIG, RIG):
        for valve in VALVES:
            rig = load_rig(name, valve=valve)
            for law in ('sofc', 'pid', 'lqi') if name == NOMINAL_RIG else ('sofc',):
                suffix = '_hsv' if valve == 'hsv' else '_ppr' if law == 'sofc' else ''
                controller = load_controller(f'{law}{suffix}', rig)
                with tempfile.TemporaryDirectory() as folder:
                    simulate_experiment(experiment, rig, controller, str(Path(folder) / 'bag'))
                controller.reset_rules()


def recording() -> None:
    """Simulate the rig over a whole array, and read its force with a term that has no name."""
    rig = load_rig(NOMINAL_RIG)
    found = rig.simulate(np.zeros(ROWS))
    reading, = rig.with_(effects=[
        {'name': 'force_reading_term', 'parameters': {'first_of_1': 1.0}}]).effects
    with_terms(found.outputs, 'force', reading.parameters, rig)


def search() -> None:
    """Use what finds a term without a name, and the dead times of a recorded valve."""
    rig = load_rig(NOMINAL_RIG)
    term = {'name': 'load_term', 'parameters': {'first_of_1': 1.0}}
    rig.with_(effects=[term]).simulate(np.zeros(ROWS))
    follow(*np.zeros((3, ROWS)))
    make_law('lookup').formula_n(3e5, 0.1)
    mean_openings_with_lift(np.zeros(ROWS), 0.01, 0.0, 0.0, 0.0, 0.0, np.empty(ROWS))
    DelayEstimator(RATE_HZ).steps(*np.zeros((2, ROWS)))
    ValveDelayEstimator(RATE_HZ).steps(*np.zeros((4, ROWS)))


def limb() -> None:
    """Simulate, tune and run a joint, with each valve as live nodes step through it."""
    load_joint(JOINT).simulate(np.zeros(ROWS), np.zeros(ROWS), np.zeros(ROWS))
    tracked_angle()
    experiment = short('joint_angle', 'to_rad: 0.05')
    for valve in VALVES:
        joint = load_joint(JOINT, valve=valve)
        with tempfile.TemporaryDirectory() as folder:
            simulate_experiment(experiment, joint, load_controller(f'sofc_joint_{valve}', joint),
                                str(Path(folder) / 'bag'))


def _law(name: str, rig: Any) -> Any:
    return load_controller(name, rig)


def tracked(law: str) -> None:
    """Track a contraction with a law as ``pam tune`` does."""
    rig = load_rig(NOMINAL_RIG)
    ClosedLoop(rig, short('contraction', 'to_m: 0.002')).run(_law(law, rig))


def tracked_force() -> None:
    """Track a force in a compiled loop."""
    rig = load_rig(FORCE_RIG)
    ForceLoop(rig, short('force', 'to_n: 5.0')).run(_law('sofc_force_ppr', rig))


def tracked_angle() -> None:
    """Track the angle of a joint as ``pam tune`` does."""
    joint = load_joint(JOINT)
    JointLoop(joint, short('joint_angle', 'to_rad: 0.05')).run(_law('sofc_joint_ppr', joint))


def warm_up(jobs: int = -1) -> None:
    """
    Use everything shortly, so that all that a rig, a joint or a verb needs is compiled.

    Parameters
    ----------
    jobs : int
        Processes; -1 for as many as there are cores.

    """
    # All share the physics, which two processes at once would both compile. So one compiles it,
    # and meanwhile the other one what is its own. It is compiled for a rollout: with physics
    # compiled for a live plant, all later rollouts would be a tenth slower. Both parts of the
    # second round take about as long.
    first, *laws, last = (partial(tracked, law) for law in LAWS)
    for uses in ([(first,), (search,)],
                 [(limb, last), (muscle, recording, tracked_force, *laws)]):
        _all(in_processes(jobs, (joblib.delayed(_in_turn)(*part) for part in uses)))


def _in_turn(*uses: Callable[[], None]) -> None:
    for use in uses:
        use()


def _all(results: Iterable[None]) -> None:
    for _ in results:
        pass


def main() -> int:
    """Compile and say so; return exit code 0."""
    print('compiling the numerical code, once per installation ...', flush=True)
    warm_up()
    return 0


if __name__ == '__main__':
    sys.exit(main())
