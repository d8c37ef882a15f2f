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

"""The unknown numbers of a model before the look for what it misses."""

from collections.abc import Callable, Sequence

from pam_sim.errors import InputError
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.health import check_for, without_dead
from pam_sim.gap.data.holes import split_at_holes
from pam_sim.identify.result import Identification
from pam_sim.identify.settled import ZERO
from pam_sim.identify.workflow import identify_beside
from pam_sim.rig import Rig
from pam_sim.run import Run
from pam_sim.tolerance import UNKNOWN

FITTED_LATER = 'the look for what is missing fits the force law along with the effects'


def numbers_first(runs: Sequence[Run], rig: Rig, holds_certify: bool, seed: int = 0,
                  progress: Callable[[float], object] = lambda done: None
                  ) -> tuple[Rig, Identification | None, list[str]]:
    """
    Return (model, what was identified, remarks): the model with its unknown numbers found.

    What the recordings determine gets its value and how well it is known. What they leave open
    stays unknown. A wrong load is thus no error of a sensor. Coefficients of the force law are
    left to the look itself: it fits them along with the effects.

    Parameters
    ----------
    runs : list of pam_sim.run.Run
        Recordings that are searched.
    rig : pam_sim.Rig
        The given model.
    holds_certify : bool
        Whether the first recording holds the certify part too; it stays untouched.
    seed : int
        Of the starts.
    progress : callable
        Told the share that is done, 0 to 1.

    """
    law = rig.unknown_of_law
    others = [name for name in rig.unknown if name not in law]
    parts, *_, refusals = split_at_holes(runs, None, CRITERIA.min_duration_s, rig.is_driven)
    if not others or refusals or not all(check_for(run, rig).usable for run in parts):
        return rig, None, []
    try:
        found = identify_beside(law, FITTED_LATER, [without_dead(run) for run in runs], rig,
                                seed=seed, progress=progress, spare_certify=holds_certify)
    except InputError as error:
        return rig, None, [f'The unknown numbers ({", ".join(others)}) were not identified '
                           f'first: {error}.']
    return left_open(rig, found), found, []


def left_open(given: Rig, found: Identification) -> Rig:
    """
    Return the identified rig for the look: bent numbers are starting values and stay unknown.

    What is missing has bent them, and an interval about a bent value would forbid the true one.
    The zero of the pressure sensor acts in valve and muscle alike, so none of them moves it.
    """
    names = [name for name in found.bent if name in given.unknown and name != ZERO]
    rig = found.rig.with_(tolerance=dict.fromkeys(names, UNKNOWN))
    if ZERO in given.unknown and ZERO in found.bent:
        rig = rig.with_(parameters={ZERO: found[ZERO].value}, tolerance={ZERO: 0.0})
    return rig


def numbers_block(found: Identification) -> dict[str, object]:
    """Return the entry ``numbers_first`` of gap.json."""
    advice = found.next_experiment
    return {
        'numbers': [{k: v for k, v in one.to_dict().items() if k in (
            'name', 'unit', 'status', 'value', 'ci95')} for one in found.found],
        'together': [c.text() for c in found.combinations],
        'next_experiment': None if advice is None else advice['why'],
        'remarks': list(found.remarks)}


def numbers_text(found: Identification) -> list[str]:
    """Return the numbers in lines for a person."""
    lines = ['unknown numbers first:', *(f'  {one.text()}' for one in found.found)]
    lines += [f'  known together: {c.text()}' for c in found.combinations]
    if found.next_experiment is not None:
        lines.append(f'  pam identify would measure next: {found.next_experiment["why"]}')
    return lines + [f'  {one}' for one in found.remarks]
