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

"""The campaign itself: what is there is kept, what is missing is worked on, one case a task."""

from collections.abc import Callable, Sequence
import contextlib
from dataclasses import asdict, dataclass, replace
import os
from pathlib import Path
import platform
import shutil
import time
from typing import Any

from pam_actuation.campaign.cases import Case, RESULT
from pam_actuation.campaign.code import code_digest
from pam_actuation.campaign.store import CASES, digest_of, key_of, Store
from pam_actuation.campaign.work import NEED_A_MODEL, Settings, work_on
from pam_actuation.kept_folders import kept_folder
from pam_actuation.workers import ClusterLost, WorkerLost, Workers
from pam_sim.errors import InputError
from pam_sim.files import StrPath, UNFINISHED, write_json
from pam_sim.joint.parameters import SIDES

FAILED = 'failed'
WARM = {
    'gap': ('pam_actuation.report.gap',),
    'identify': ('pam_actuation.report.gap', 'pam_actuation.report.identify'),
    'replay': ('pam_actuation.replay.compare',), 'report': ('pam_actuation.report.pages',)}
_ATTEMPTS = 4           # to find a cluster again that was lost
# Kept in place of its path: recordings of equal bytes share what is kept.
THE_RECORDING = '{recording}'
# Failures that say nothing of the recording: its case is worked on again next time.
NOT_OF_THE_RECORDING = (WorkerLost, MemoryError, OSError)
_LOST = {'sizes': [], 'ambiguous': [], 'least': {}, 'bad': True}


@dataclass(frozen=True)
class Task:
    """What a worker needs to know of one case."""

    key: str
    case: Case


@dataclass
class Campaign:
    """
    What a campaign found.

    Attributes
    ----------
    settings : Settings
    rows : list of dict
        One for each case, by rig and time: ``case`` (a Case), ``key``, ``recording`` (its
        digest), and what ``work_on`` returned, or the verdict ``failed`` with the error as its
        reason.
    worked_on : int
        Cases that were not there before.
    seconds : float
        Wall-clock time.

    """

    settings: Settings
    rows: list[dict[str, Any]]
    worked_on: int = 0
    seconds: float = 0.0

    @property
    def failed(self) -> list[dict[str, Any]]:
        """Return the rows whose recording could not be worked on."""
        return [row for row in self.rows if row['verdict'] == FAILED]

    @property
    def rigs(self) -> list[str]:
        """Return the names of the rigs."""
        return sorted({row['case'].rig for row in self.rows})


def run_campaign(cases: Sequence[Case], settings: Settings, out: StrPath, jobs: int = -1,
                 cluster: str | None = None,
                 progress: Callable[[int], object] = lambda done: None,
                 case_done: Callable[[Case, str], object] = lambda case, verdict: None
                 ) -> Campaign:
    """
    Work on every case that is not there yet; return all.

    Parameters
    ----------
    cases : list of Case
        What ``find_cases`` returned.
    settings : Settings
        What is asked of each.
    out : path
        Folder of the campaign. Workers of a cluster must see it, and the recordings, under the
        same paths.
    jobs : int
        Processes; -1 for one a core.
    cluster : str, optional
        Address of a Dask or Ray cluster, see ``pam_actuation.workers``.
    progress : callable
        Told how many cases are there.
    case_done : callable
        Told of each case that is worked on, and its verdict.

    Returns
    -------
    Campaign

    Raises
    ------
    InputError
        The model cannot be read, or has no number that ``identify`` would find. The folder
        cannot be written, is in use or is inside a recording, or the cluster cannot be reached.
    ClusterLost
        The cluster was lost and did not come back. What is done is kept.

    """
    started = time.perf_counter()
    settings, texts = _with_models(cases, settings)
    for case in cases:
        if Path(os.path.abspath(out)).is_relative_to(case.path):
            raise InputError(f'is inside the recording {case.path}; give a folder outside', out)
    Workers(cluster=cluster)        # refuses what is no address, before anything is written
    store = Store(out)
    with store.locked():
        digests = {path: digest_of(path) for path in dict.fromkeys(case.path for case in cases)}
        keys = [key_of(case, settings, text, digests[case.path])
                for case, text in zip(cases, texts)]
        todo = {key: Task(key, replace(case, model=text))
                for key, case, text in zip(keys, cases, texts) if store.result(key) is None}
        for key in todo:        # the folder of a damaged result would stand in the way
            shutil.rmtree(store.cases / key, ignore_errors=True)
        lost: dict[str, str] = {}
        count, known = len(todo), len(set(keys)) - len(todo)
        progress(known)

        def done(key: str, result: Any) -> None:
            task = todo.pop(key)
            if isinstance(result, NOT_OF_THE_RECORDING):
                lost[key] = f'{task.case.name}: {_told(result)}'
            elif isinstance(result, Exception):
                raise result
            else:
                store.told_time(key, *result)
            progress(known + count - len(todo))
            case_done(task.case, (store.result(key) or {}).get('verdict', FAILED))

        if todo:
            _work(todo, settings, store, jobs, cluster, done)
        rows = [{'case': case, 'key': key, 'recording': digests[case.path],
                 **(store.result(key) or {'verdict': FAILED, **_LOST,
                                          'reason': lost.get(key, 'not there')})}
                for key, case in zip(keys, cases)]
        for row in rows:
            row['reason'] = row['reason'].replace(THE_RECORDING, row['case'].path)
    return Campaign(settings, rows, count - len(lost), time.perf_counter() - started)


def _work(todo: dict[str, Task], settings: Settings, store: Store, jobs: int,
          cluster: str | None, done: Callable[[str, Any], None]) -> None:
    """Hand out what is to be done; a cluster that comes back goes on with the rest."""
    for attempt in range(1, _ATTEMPTS + 1):
        with contextlib.ExitStack() as stack:
            try:
                workers = stack.enter_context(Workers(
                    min(jobs if jobs > 0 else os.cpu_count() or 1, len(todo)), cluster,
                    processes=True, modules=WARM[settings.work]))
                for task, result in workers.stream(
                        work_and_keep, (settings, str(store.cases), code_digest()),
                        list(todo.values())):
                    done(task.key, result)
                return
            except (ClusterLost, InputError) as error:
                if attempt == 1 and not isinstance(error, ClusterLost):
                    raise           # it was never there
                if attempt == _ATTEMPTS:
                    raise ClusterLost(f'{error}; {len(todo)} cases are left') from error
        for key in [key for key in todo if store.result(key) is not None]:
            todo.pop(key)       # done, but not told any more


def work_and_keep(given: tuple[Settings, str, str], task: Task) -> tuple[float, float]:
    """Work on one case and keep it; return wall-clock and processor time [s]. Run by workers."""
    settings, cases, code = given
    if code != code_digest():
        raise InputError(
            f'a worker on {platform.node()} has other code than this machine; both need the same '
            'pam_actuation, NumPy, SciPy, numba, Plotly, and the same effects and laws of your '
            'own', 'cluster')
    began, used = time.perf_counter(), time.process_time()
    with kept_folder(Path(cases), task.key) as folder:
        try:
            found = work_on(task.case, settings, folder)
        except NOT_OF_THE_RECORDING:
            raise               # another time the case may be worked on
        except Exception as error:      # noqa: B902, a failed case is a row and not an end
            if isinstance(error, InputError) and UNFINISHED in error.where:
                raise           # its files cannot be written
            found = {'verdict': FAILED, 'reason': _told(error), **_LOST}
        found['reason'] = found['reason'].replace(task.case.path, THE_RECORDING)
        write_json(folder / RESULT, found)
    return time.perf_counter() - began, time.process_time() - used


def _told(error: Exception) -> str:
    """Return an error as the reason of a row."""
    text = ' '.join(str(error).split())
    return text if isinstance(error, (InputError, WorkerLost)) else (
        f'{type(error).__name__}: {text}')


def _with_models(cases: Sequence[Case], settings: Settings) -> tuple[Settings, list[str]]:
    """
    Return the settings, and for each case what workers are given of its model.

    A preset stays a name, since it takes the valve of its recording; a file becomes its text.
    Of the model of a joint, a case is given its own muscle.
    """
    from pam_sim import preset_names
    from pam_sim.joint import (
        joint_preset_names, JointRig, load_rig_or_joint, load_rig_or_side)
    kept = replace(settings, model='')
    if settings.work not in NEED_A_MODEL:
        return kept, [''] * len(cases)
    named = [case.model or settings.model for case in cases]
    if '' in named:
        raise InputError('no model to hold the recordings against', '--model')
    rigs = {name: load_rig_or_joint(name) for name in dict.fromkeys(named)}
    texts = []
    for case, name in zip(cases, named):
        rig, side = rigs[name], (case.namespace or '').rpartition('/')[2]
        if not isinstance(rig, JointRig):
            texts.append(name if name in preset_names() else rig.to_yaml())
        elif f'{side}/' not in rig.muscles:
            raise InputError(
                f'is a joint, and {case.namespace or "the only muscle"} in {case.path} is none of '
                f'its muscles {" and ".join(SIDES)}; name the model of a muscle', name)
        else:
            texts.append(f'{name}/{side}' if name in joint_preset_names()
                         else rig.muscles[f'{side}/'].to_yaml())
    if settings.work == 'identify':
        from pam_sim.identify.numbers import with_unknown
        for text in dict.fromkeys(texts):
            with_unknown(load_rig_or_side(text), settings.unknown)
    return kept, texts


def plain(row: dict[str, Any]) -> dict[str, Any]:
    """Return a row as plain data; the path of its report as seen from the folder."""
    data = {**row, **asdict(row['case'])}
    del data['case'], data['model']
    return {**data, 'report': f'{CASES}/{row["key"]}'}
