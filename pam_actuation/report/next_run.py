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

"""How a proposed experiment is run on the rig that was recorded, a real or a simulated one."""

from collections.abc import Mapping, Sequence
import os
import shlex
from typing import Any, TYPE_CHECKING

from pam_sim.files import StrPath
from pam_sim.joint.parameters import SIDES

if TYPE_CHECKING:
    from pam_sim.run import Run

HARDWARE_FILE = 'my_hardware.yaml'       # stands for the user's own; its name is in no bag
# Preset experiments of a load that moves freely, and of another one: in pressure.
OF_FREE, OF_DRIVEN = 'sine_quarter_hz', 'pressure_identification'


def is_simulated(run: 'Run') -> bool:
    """Tell whether a recording says that it is of a simulated rig: such a bag has a seed."""
    return bool(run.metadata.get('seed'))


def is_of_joint(run: 'Run') -> bool:
    """Tell whether a recording is of a joint, or of a muscle in one."""
    return run.namespace.rpartition('/')[2] in SIDES


def is_driven(model: str) -> bool:
    """
    Return whether a model, as YAML text, has a load that does not move freely.

    No controller of contraction works on it. Text that gives no rig tells nothing: False.
    """
    from pam_sim import load_rig
    from pam_sim.errors import InputError
    try:
        return bool(model) and load_rig(model).is_driven
    except InputError:
        return False


def simulated(model: str) -> str:
    """Return the preset experiment by which a model, as YAML text, is simulated."""
    return OF_DRIVEN if is_driven(model) else OF_FREE


def tuned_on(model: str, file: StrPath, tuned: StrPath) -> str:
    """
    Return the command that tunes a controller on a model, '' where none can be tuned on it.

    That is a load that does not move freely: no controller of contraction works on it.

    Parameters
    ----------
    model : str
        The model as YAML text.
    file : path
        Where it is.
    tuned : path
        The controller that the command writes.

    """
    if is_driven(model):
        return ''
    return f'pam tune --model {shlex.quote(str(file))} --out {shlex.quote(str(tuned))}'


def command_on_rig(runs: 'Sequence[Run]', experiment: StrPath, model: StrPath,
                   name: str = 'next') -> str:
    """
    Return the command that runs an experiment on the rig of these recordings, and records it.

    Parameters
    ----------
    runs : list of pam_sim.run.Run
        The recordings. One that does not say that it was simulated is of a real rig.
    experiment : path
        File of the experiment.
    model : path
        Rig file with what is known of the rig; of a joint its file or preset. A preset gets the
        valve of the recordings.
    name : str
        Of the folder in ``runs`` for the new recording.

    """
    played, described = shlex.quote(str(experiment)), shlex.quote(str(model))
    valve = _valve_beside(runs, model)
    if not all(is_simulated(run) for run in runs):
        return on_hardware(played, described, name, is_of_joint(runs[0]), valve)
    return f'pam run {played} --rig {_recorded_preset(runs) or described + _option(valve)}'


def on_hardware(experiment: str, model: str, name: str, of_joint: bool = False,
                valve: str = '') -> str:
    """
    Return the command that runs an experiment on a real rig.

    Parameters
    ----------
    experiment, model : str
        Files as the shell takes them; the model may be a preset.
    name : str
        Of the folder in ``runs`` for the recording.
    of_joint : bool
        Whether the model is that of a joint.
    valve : str
        ``ppr`` or ``hsv``; '' for the one of the model.

    """
    what = 'knee' if of_joint else 'rig'
    return (f'pam up {what} --hardware {HARDWARE_FILE} --model {model}{_option(valve)} '
            f'--experiment {experiment} --record {shlex.quote(os.path.join("runs", name))}')


def before_it(runs: 'Sequence[Run]', advice: Mapping[str, Any], model: StrPath,
              added_kg: Sequence[float] = ()) -> str:
    """
    Return what must be done before the next experiment of an identification; '' for nothing.

    Parameters
    ----------
    runs : list of pam_sim.run.Run
        The recordings.
    advice : dict
        ``next_experiment`` of the result.
    model : path
        Rig file with the numbers found.
    added_kg : sequence of float
        Known masses [kg] that hung on the load in addition, one for each recording; empty for
        none.

    """
    found = []
    if advice['added_kg']:
        masses = ' '.join(f'{kg:g}' for kg in [
            *(added_kg or [0.0] * len(runs)), advice['added_kg']])
        more = f'{advice["added_kg"]:g} kg'
        found.append(
            f'put {more} more into `mass_kg` of a copy of {model} and run that'
            if all(is_simulated(run) for run in runs) else f'hang {more} more on the load'
            + ', in place of what was added before' * any(added_kg))
        found[-1] += (', since the experiment needs another load than the rig file has; '
                      f'pam identify is told of it by --added-kg {masses}')
    if advice['needs_force'] and not any('force' in run for run in runs):
        found.append('record the force with a load cell')
    return '; '.join(found)


def _option(valve: str) -> str:
    return f' --valve {valve}' if valve else ''


def _valve_beside(runs: 'Sequence[Run]', model: StrPath) -> str:
    """Return the recorded valve where the model is a preset; '' of a file, which states one."""
    from pam_sim import preset_names
    from pam_sim.gap.data.signals import recorded_valve
    from pam_sim.joint import joint_preset_names
    if str(model) not in (*preset_names(), *joint_preset_names()):
        return ''
    return next(filter(None, map(recorded_valve, runs)), '')


def _recorded_preset(runs: 'Sequence[Run]') -> str:
    """Return the options for the preset that all recordings are of; '' where there is none."""
    from pam_sim import preset_names
    from pam_sim.errors import InputError
    from pam_sim.joint import joint_preset_names, load_rig_or_joint
    try:
        rigs = [load_rig_or_joint(run.metadata['rig']) for run in runs]
    except (InputError, KeyError):
        return ''
    first = rigs[0]
    if first.name not in (*preset_names(), *joint_preset_names()) or any(
            rig.to_yaml() != load_rig_or_joint(first.name, first.valve).to_yaml()
            for rig in rigs):
        return ''
    return f'{first.name} --valve {first.valve}'
