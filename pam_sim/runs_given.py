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

"""The recordings, the rig and the numbers that ``identify`` and ``find_gap`` get, checked."""

from collections.abc import Iterable, Sequence
import math
from typing import Any

from pam_sim.declared import check_kind, check_whole, number_of, shown
from pam_sim.errors import InputError
from pam_sim.rig import Rig
from pam_sim.run import Run

_LOAD_RUN = 'load_run(PATH)'


def check_question(runs: Any, rig: Any, seed: Any, certify: Any = None) -> None:
    """
    Refuse what a question about recordings cannot be asked with.

    Parameters
    ----------
    runs : Run or iterable of Run
        The recordings.
    rig : Rig
        The model.
    seed : int
        Of random starts or draws.
    certify : Run, optional
        A recording that is kept for a proof.

    Raises
    ------
    InputError
        One of them is something else, such as a path or a name.

    """
    if isinstance(runs, (str, bytes)) or not isinstance(runs, (Run, Iterable)):
        raise InputError(f'is {shown(runs)}; give what `{_LOAD_RUN}` returns', 'runs')
    for run in runs if isinstance(runs, Sequence) else ():
        check_kind(run, Run, 'runs', _LOAD_RUN)
    if certify is not None:
        check_kind(certify, Run, 'certify', _LOAD_RUN)
    check_kind(rig, Rig, 'rig', 'load_rig(NAME)')
    check_whole(seed, 0, 'seed')


def check_number(value: Any, name: str, lowest: float, above: bool = False) -> None:
    """Refuse what is no number from ``lowest`` on, or none ``above`` it, by its name."""
    number = number_of(value, name)
    if math.isnan(number) or number < lowest or (above and number == lowest):
        raise InputError(f'is {value:g}; allowed is {"more than" if above else "from"} '
                         f'{lowest:g}{"" if above else " on"}', name)
