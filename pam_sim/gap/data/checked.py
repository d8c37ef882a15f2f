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

"""Recordings as a question may use them: commands known, holes split off, health looked at."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pam_sim.errors import InputError
from pam_sim.gap.criteria import CRITERIA, Criteria
from pam_sim.gap.data.commanded import all_commanded
from pam_sim.gap.data.duties import once_a_period
from pam_sim.gap.data.health import check_for, held_m, without_dead
from pam_sim.gap.data.holes import split_at_holes
from pam_sim.gap.data.overlap import check_apart
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.resting import rest_of
from pam_sim.rig import Rig
from pam_sim.run import Run


@dataclass(frozen=True)
class CheckedRuns:
    """
    What of the recordings is used.

    Parameters
    ----------
    runs : list of Run
        To search, the parts between holes.
    certify : Run or None
        For the validation, None where it is a part of the first run.
    certify_runs : int
        How many of ``runs``, from the first on, hold the certify part.
    refusals : list of str
        Why they cannot be compared with the model; empty where they can.
    remarks : list of str
        Sentences on what was left out or is weak.

    """

    runs: list[Run]
    certify: Run | None
    certify_runs: int
    refusals: list[str]
    remarks: list[str]


def checked_runs(runs: Run | Sequence[Run], certify: Run | None, rig: Rig,
                 criteria: Criteria = CRITERIA) -> CheckedRuns:
    """
    Return what of the recordings is used, and what is said of them.

    Raises
    ------
    InputError
        No recording is given. Two of them, searched or for the validation, are the same one.

    """
    runs = [runs] if isinstance(runs, Run) else list(runs)
    if not runs:
        raise InputError('at least one recording is needed', 'runs')
    check_apart(runs, certify, criteria)
    runs, certify, told = all_commanded(runs, certify, rig)
    runs, first, certify, holes, refusals = split_at_holes(
        runs, certify, criteria.min_duration_s, rig.is_driven)
    health = [check_for(run, rig, criteria)
              for run in [*runs, *([certify] if certify else [])]]
    names = [Path(run.path).name for run in (*runs, *([certify] if certify else []))]
    refusals += by_recording(names, [h.problems for h in health])
    remarks = told + holes + by_recording(names, [h.remarks for h in health])
    return CheckedRuns(runs, certify, 0 if certify else first, refusals, remarks)


def by_recording(names: Sequence[str], told: Sequence[Sequence[str]]) -> list[str]:
    """
    Return every sentence once, with the recordings it is of where it is not of all.

    Parameters
    ----------
    names : list of str
        Of the recordings; stretches of one have the same name.
    told : list of list of str
        The sentences on each.

    """
    found = []
    for sentence in dict.fromkeys(one for own in told for one in own):
        of = dict.fromkeys(name for name, own in zip(names, told) if sentence in own)
        which = '' if set(of) == set(names) or '' in of else (
            f'recording{"s" if len(of) > 1 else ""} {" and ".join(of)}: ')
        found.append(f'{which}{sentence}')
    return found


def recording_of(run: Run, rig: Rig, criteria: Criteria = CRITERIA) -> Recording:
    """Return a recording without dead sensors, repeats, and the force of a load at rest."""
    run = once_a_period(without_dead(run), rig)
    return Recording(run, rig.valve, rig.is_driven, held_m(rig) or 0.0,
                     rest_of(run, rig, criteria))
