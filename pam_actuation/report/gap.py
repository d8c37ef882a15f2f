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
Run the gap workflow on loaded bags and write its folder.

``gap.json``, ``model.yaml``, ``compare.mcap`` and ``report.html``, each written whole or
not at all.
"""

from collections.abc import Collection, Sequence
import os
from pathlib import Path
import shlex
import tempfile
import time
from typing import Any, TYPE_CHECKING

import numpy as np

from pam_actuation.bags.oddities import recording_remarks
from pam_actuation.bags.writer import BagWriter
from pam_actuation.experiments.separating import cell_would_tell, next_experiment, not_played
from pam_actuation.experiments.separating_joint import in_joint
from pam_actuation.report.model_held import model_held
from pam_actuation.report.next_run import command_on_rig, OF_FREE
from pam_actuation.report.page import render
from pam_actuation.report.pages import FOOTER
from pam_actuation.report.sections.gap import gap_section, VERDICT_TEXT
from pam_actuation.report.sections.numbers_first import numbers_section
from pam_actuation.report.sections.provenance import provenance
from pam_actuation.report.sections.replay import Overlay
from pam_actuation.report.signals import start_ns
from pam_actuation.topics.codec import encode_series
from pam_actuation.topics.table import topic_of
from pam_sim import load_rig, preset_names
from pam_sim.annotations import FloatArray, IntArray
from pam_sim.errors import InputError
from pam_sim.files import check_folder, StrPath, whole_files, write_json, write_text
from pam_sim.gap import find_gap
from pam_sim.gap.data.commanded import all_commanded, commanded
from pam_sim.gap.data.duties import once_a_period
from pam_sim.gap.data.health import check_for, dead_signals, held_m
from pam_sim.gap.data.pressed import recorded_gauge_pa
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.signals import FIELD, recorded_valve
from pam_sim.gap.propose.proposal import EFFECT_FILE, MODEL_FILE
from pam_sim.gap.propose.surrogate import FILE as SURROGATE_FILE
from pam_sim.gap.select.memory import memories
from pam_sim.gap.subsystems.simulation import free_run
from pam_sim.identify.before_gap import numbers_block, numbers_first, numbers_text
from pam_sim.joint import joint_preset_names, JointRig, load_rig_or_side
from pam_sim.joint.parameters import SIDES
from pam_sim.located_yaml import dump_yaml
from pam_sim.rig import Rig

if TYPE_CHECKING:
    from pam_sim.gap import GapResult
    from pam_sim.run import Run

FILES = ('gap.json', 'model.yaml', 'next_experiment.yaml', 'compare.mcap', 'report.html',
         EFFECT_FILE, MODEL_FILE, SURROGATE_FILE)
NUMBERS_SHARE = 0.3          # of the progress, where numbers are unknown
INSEPARABLE = 'No experiment of the menu tells them apart with the sensors of this rig'
A_CELL_WOULD = '; a load cell would.'
FOLDERS = ('measured', 'simulated_before', 'simulated_refit', 'simulated_after',
           'residual_before', 'residual_after')


def write_gap(runs: 'Sequence[Run]', model: 'StrPath | Rig', out_dir: StrPath,
              certify: 'Run | None' = None, of: str = '', joint_model: StrPath = '',
              **options: Any) -> 'GapResult':
    """
    Find the gap between recordings and a model and write the result folder.

    Numbers of the model that are ``unknown`` are identified first.

    Parameters
    ----------
    runs : list of pam_sim.run.Run
        Recordings that are searched.
    model : str, path or pam_sim.Rig
        The model. A preset named without its valve gets that of the recording.
    out_dir : path
        Folder for the results; made if needed.
    certify : pam_sim.run.Run, optional
        Recording for the proof; by default blocks of the first one.
    of : str
        Words in the head of the page that tell of what it is.
    joint_model : str or path
        Preset or file of the joint of which it is a muscle, for the command of what comes next.
    options
        As of ``gap_of``.

    Returns
    -------
    pam_sim.gap.GapResult

    Raises
    ------
    InputError
        No recording, a mistake in the model, or a folder that cannot be written.

    """
    check_folder(out_dir)
    result = gap_of(runs, model, certify, **options)
    save_gap(result, runs, out_dir, of, joint_model, certify)
    return result


def gap_of(runs: 'Sequence[Run]', model: 'StrPath | Rig', certify: 'Run | None' = None,
           played: Collection[str] = (), joint: JointRig | None = None,
           **options: Any) -> 'GapResult':
    """
    Find the gap between recordings and a model, and the experiment that would tell rivals apart.

    Arguments and errors as of ``write_gap``; nothing is written. ``played`` names experiments
    that were suggested and recorded before: their pieces are not suggested again. ``joint`` is
    the model of the joint of which the recordings are a muscle, by default the one they hold.
    """
    if not runs:
        raise InputError('a gap look needs at least one recording')
    rig = model_for(runs[0], model)
    held = model_held(rig, runs)
    recorded = recording_remarks([*runs, *([certify] if certify else [])])
    # Now, for a gain that is unknown is another one after its identification.
    runs, certify, remarks = all_commanded(runs, certify, rig)
    began, told = time.perf_counter(), options.pop('progress', lambda done: None)
    share = NUMBERS_SHARE if rig.unknown else 0.0
    rig, found, sayings = numbers_first(runs, rig, certify is None, options.get('seed', 0),
                                        lambda done: told(share * done))
    result = find_gap(runs, rig, certify, spent_s=time.perf_counter() - began,
                      progress=lambda done: told(share + (1.0 - share) * done), **options)
    result.model = held
    result.remarks += remarks + sayings
    if found is not None:
        found.remarks = [one for one in found.remarks if one not in result.remarks]
        result.numbers_first, result.first_lines = numbers_block(found), numbers_text(found)
    pieces = not_played(rig.valve, played)
    if len(result.rivals) > 1 and pieces:
        if result.at_one_speed and 'speeds' in pieces and set(memories()) <= {
                rival[0] for rival in result.rivals}:
            pieces = ('speeds',)
        recorded_pa = recorded_gauge_pa(
            run['pressure'][FIELD['pressure']]
            for run in (*runs, *([certify] if certify else [])))
        place = in_joint(runs, joint)
        result.next_experiment = next_experiment(
            rig, result.rivals, tuple(result.signals), result.noise, pieces=pieces,
            may_add_cell=not any(dead_signals(run) for run in runs) and may_have_cell(rig),
            recorded_pa=recorded_pa, place=place)
        if result.next_experiment is None:
            has_cell = 'force' in result.signals
            result.remarks.append(INSEPARABLE + (A_CELL_WOULD if not has_cell and cell_would_tell(
                rig, result.rivals, result.noise, recorded_pa, place) else '.'))
    result.remarks += recorded
    return result


def may_have_cell(rig: Rig) -> bool:
    """
    Return whether a rig may have a load cell.

    One that states noise or quantisation of other sensors and none of the force has none.
    """
    stated = {name.split('_')[0] for name, value in rig.sensors.items() if value > 0.0}
    return 'force' in stated or not stated & {'pressure', 'contraction'}


def model_for(run: 'Run', model: 'StrPath | Rig') -> Rig:
    """
    Return the rig of a model, with the recorded valve if the model is a preset.

    ``JOINT/flexor`` is the one muscle of the preset of a joint.
    """
    if isinstance(model, Rig):
        return model
    joint, _, side = str(model).rpartition('/')
    of_joint = side in SIDES and joint in joint_preset_names()
    named = of_joint or str(model) in preset_names()
    return (load_rig_or_side if of_joint else load_rig)(
        model, valve=(recorded_valve(run) or None) if named else None)


def save_gap(result: 'GapResult', runs: 'Sequence[Run]', out_dir: StrPath, of: str = '',
             joint_model: StrPath = '', certify: 'Run | None' = None) -> None:
    """
    Write gap.json, model.yaml, compare.mcap and report.html of a result.

    Where rivals are left, next_experiment.yaml too, which ``pam run`` executes. Where a term is
    proposed, its effect file and the model with it. Where there is a surrogate, its model. Such
    files of an earlier result are removed.

    Parameters
    ----------
    result : GapResult
        What was found.
    runs : list of pam_sim.run.Run
        The recordings that were searched.
    out_dir : path
        Folder for the results; made if needed.
    of, joint_model, certify
        As of ``write_gap``.

    Raises
    ------
    InputError
        A folder that cannot be written.

    """
    # A model that has the proposed effect needs its file.
    kept = (EFFECT_FILE, MODEL_FILE) if Path(EFFECT_FILE).stem in result.model_yaml else ()
    with whole_files(out_dir, set(FILES).difference(kept)) as folder:
        _save_into(folder, result, runs, of, _seen_from(out_dir, joint_model), certify)


def _seen_from(folder: StrPath, model: StrPath) -> StrPath:
    """Return the relative path of a model file as seen from a folder; others as they are."""
    if os.path.isabs(model) or str(model) in joint_preset_names() or not os.path.isfile(model):
        return model
    return os.path.relpath(model, folder)


def _save_into(out_dir: Path, result: 'GapResult', runs: 'Sequence[Run]', of: str,
               joint_model: StrPath, certify: 'Run | None') -> None:
    write_json(out_dir / 'gap.json', result.to_dict())
    write_text(out_dir / 'model.yaml', result.model_yaml)
    if result.next_experiment:
        write_text(out_dir / 'next_experiment.yaml',
                   dump_yaml(result.next_experiment['experiment']))
    if result.proposal:
        write_text(out_dir / result.proposal.file, result.proposal.text)
        write_text(out_dir / MODEL_FILE, result.proposal.model_yaml)
    if result.surrogate:
        write_text(out_dir / SURROGATE_FILE, result.surrogate.model_yaml)
    if result.traces:
        write_compare(result, (certify or runs[0]).namespace, out_dir / 'compare.mcap')
    recordings = [(f'recording {k}' if len(runs) > 1 else 'recording', run)
                  for k, run in enumerate(runs, 1)]
    if certify is not None:
        recordings.append(('proof', certify))
    write_text(out_dir / 'report.html', render(
        'Recording against model', VERDICT_TEXT.get(result.verdict, result.verdict) + '.',
        [*numbers_section(result),
         gap_section(result, command=next_command(
             'next_experiment.yaml', runs, joint_model=joint_model)),
         provenance(recordings)], footer=FOOTER, of=of))


def next_command(path: StrPath, runs: 'Sequence[Run]', model: StrPath = 'model.yaml',
                 joint_model: StrPath = '') -> str:
    """
    Return the command that runs the next experiment on the rig that was recorded.

    ``model`` is the file with the model found, ``joint_model`` that of the joint of which it is a
    muscle.
    """
    return command_on_rig(runs, path, joint_model or model)


def with_term(folder: StrPath, experiment: str = OF_FREE) -> str:
    """Return the command that simulates the model with the term of this folder of a result."""
    searched = os.pathsep.join(filter(None, (os.environ.get('PAM_EFFECTS_PATH'), str(folder))))
    model = shlex.quote(str(Path(folder) / MODEL_FILE))
    return (f'PAM_EFFECTS_PATH={shlex.quote(searched)} pam simulate {experiment} --rig {model} '
            '--out runs/with_term')


def write_compare(result: 'GapResult', namespace: str, path: StrPath) -> None:
    """Write measured and simulated signals and their residuals as one MCAP file."""
    path = Path(path)
    prefix = '/' + namespace.strip('/') if namespace.strip('/') else ''
    curves: dict[str, tuple[str, IntArray, FloatArray]] = {}
    for signal, trace in result.traces.items():
        for folder, values in zip(FOLDERS, (
                trace.measured, trace.before, trace.refit, trace.after,
                trace.measured - trace.before, trace.measured - trace.after)):
            curves[f'{prefix}/{folder}/{signal}'] = signal, trace.stamp_ns, values
    for signal, (stamp_ns, values) in result.inputs.items():
        curves[f'{prefix}/{FOLDERS[0]}/{signal}'] = signal, stamp_ns, values
    with tempfile.TemporaryDirectory(dir=path.parent, prefix='.compare') as folder:
        with BagWriter(Path(folder) / 'compare', {'verdict': result.verdict}) as bag:
            for topic in sorted(curves):
                bag.add_topic(topic, topic_of(topic).type_name)
            bag.write_series({topic: (stamp_ns, encode_series(signal, stamp_ns, values))
                              for topic, (signal, stamp_ns, values) in sorted(curves.items())})
        os.replace(bag.file, path)


def free_run_overlay(run: 'Run', rig: Rig) -> list[Overlay]:
    """
    Return the Overlays of a model's free run on a recording; [] if it cannot be compared.

    For the section "Simulated against recorded" of a report.
    """
    (run,), _ = commanded([run], rig)
    if not check_for(run, rig).usable:
        return []
    recording = Recording(once_a_period(run, rig), rig.valve, rig.is_driven, held_m(rig) or 0.0)
    simulated = free_run(rig, recording)
    offset = (recording.start_ns - start_ns(run)) * 1e-9
    return [Overlay(s, recording.time_s[s] + offset, np.asarray(recording.measured[s]),
                    simulated[s]) for s in recording.signals]
