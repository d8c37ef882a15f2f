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
One experiment under a series of loads, simulated: what ``pam characterise`` starts from.

The chapter loads its muscle with 0 to 150 N in steps of 10 N. A mass is never zero, so the first
run hangs a hook of 0.1 kg on the muscle. The load cell measures its weight like every other load.
"""

from collections.abc import Callable, Iterable
import os
from pathlib import Path

import joblib
import numpy as np

from pam_actuation.bags.place import check_bag_target
from pam_actuation.experiments.experiment import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.parallel import in_processes
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.load.registry import HANGING_MASS
from pam_sim.rig import Rig
from pam_sim.units import GRAVITY_M_PER_S2

HOOK_KG = 0.1
LOADS_N = tuple(float(load) for load in range(0, 151, 10))
EXPERIMENT = 'pressure_increments'
SENSORS = ('pressure_noise_pa', 'contraction_noise_m', 'force_noise_n', 'stamp_jitter_s')
SENSORS_FROM = 'dmsp_5_300_realistic'     # whose noise a rig without any is given


def with_sensor_noise(rig: Rig) -> Rig:
    """Return the rig with the sensor noise of the realistic rig where it has none itself."""
    if any(rig.sensors[name] for name in SENSORS):
        return rig
    usual = load_rig(SENSORS_FROM).sensors
    return rig.with_(sensors={name: usual[name] for name in SENSORS})


def bag_name(load_n: float) -> str:
    """Return the folder name of the bag of one load."""
    return f'load_{load_n:05.1f}_n'.replace('.', '_')


def simulate_load(rig: Rig, load_n: float, out: str | os.PathLike[str], seed: int = 0,
                  experiment: str = EXPERIMENT, overwrite: bool = False) -> str:
    """
    Simulate one bag of the series.

    Parameters
    ----------
    rig : pam_sim.rig.Rig
        With a hanging mass; its mass is replaced.
    load_n : float
        Weight to hang on the muscle; below the hook's the hook alone.
    out : path
        Directory of the bag.
    seed : int
        Seed of the series; each load adds its weight in newtons.
    experiment : str
        Name or file of the experiment, in the pressure domain.
    overwrite : bool
        Whether a bag that is there may be replaced.

    Returns
    -------
    str
        The bag.

    """
    # Processes of their own have not passed the entry point of the command line.
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    mass = max(load_n / GRAVITY_M_PER_S2, HOOK_KG)
    simulate_experiment(load_experiment(experiment), rig.with_(parameters={'mass_kg': mass}),
                        None, os.fspath(out), seed=1000 * seed + int(round(load_n)),
                        overwrite=overwrite)
    return os.fspath(out)


def simulate_loads(rig: Rig, folder: str | os.PathLike[str], seed: int = 0,
                   loads_n: Iterable[float] = LOADS_N, jobs: int = 2,
                   experiment: str = EXPERIMENT, progress: Callable[[int], object] | None = None,
                   overwrite: bool = False) -> list[str]:
    """
    Simulate one bag per load, in parallel processes; return their paths in the order of loads.

    Parameters
    ----------
    rig : pam_sim.rig.Rig
        With a hanging mass.
    folder : path
        Where the bags go.
    seed, experiment
        See ``simulate_load``.
    loads_n : iterable of float
        Loads, N.
    jobs : int
        Processes.
    progress : callable, optional
        Called with the number of bags done.
    overwrite : bool
        Whether bags that are there may be replaced.

    Raises
    ------
    InputError
        A rig without a hanging mass, a wrong experiment, a bag that exists or cannot be
        written.

    """
    if rig.load != HANGING_MASS:
        raise InputError(f'the rig {rig.name} has no hanging mass: its load is `{rig.load}`')
    if load_experiment(experiment).domain != 'pressure':
        raise InputError(f'the experiment {experiment} is not in the pressure domain')
    loads = np.asarray(list(loads_n), dtype=float)
    if loads.size < 3 or np.any(np.diff(loads) < 1.0) or loads[0] < 0.0 or loads[-1] > 490.0:
        raise InputError('needs 3 or more loads, ascending by at least 1 N, from 0 to 490 N',
                         'loads')
    targets = [Path(folder) / bag_name(load) for load in loads]
    there = [path for path in targets if path.exists()]
    if there and not overwrite:
        raise InputError('exists already; give another folder', str(there[0]))
    for path in targets:
        check_bag_target(path, overwrite)
    rig.pack()     # compiled once here, or every process would compile for itself
    runs = in_processes(jobs, (
        joblib.delayed(simulate_load)(rig, float(load), path, seed, experiment, overwrite)
        for load, path in zip(loads, targets)))
    bags = []
    for bag in runs:
        bags.append(bag)
        if progress:
            progress(len(bags))
    return bags
