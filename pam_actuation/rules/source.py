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

"""Rules from what a user names: a rule file, a controller, a preset, or a recording."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
import os
from pathlib import Path
from typing import TYPE_CHECKING

from pam_actuation.bags.facts import mistakes_of
from pam_actuation.control.config import load_controller
from pam_actuation.control.sofc.persistence import load_rules
from pam_actuation.control.sofc.rule_table import RuleBase
from pam_sim.errors import InputError

if TYPE_CHECKING:
    from pam_actuation.bags.load import RecordedRun
    from pam_sim.joint.rig import JointRig
    from pam_sim.rig import Rig

SAVED_NAME = 'rules.json'
_BAG_ENDINGS = ('.mcap', '.db3', '.mcap.zstd', '.db3.zstd')


@dataclass(frozen=True)
class FoundRules:
    """
    Rules and where they come from.

    ``rules`` are shown; ``before`` those they started from, None for the initial ones kept
    in ``rules``; ``since`` names these in words. ``kind`` is 'rule file', 'controller' or
    'recording'; ``remarks`` are sentences on anything odd, ``implausible`` those of them on
    lost messages and on values of the recording that cannot be right.
    """

    title: str
    kind: str
    rules: RuleBase
    before: RuleBase | None = None
    since: str = 'the initial rules'
    remarks: tuple[str, ...] = ()
    implausible: tuple[str, ...] = ()


def find_rules(name: Path | str, rig: 'Callable[[], Rig | JointRig] | None' = None,
               namespace: str | None = None,
               recover: bool = False,
               progress: Callable[[float], object] | None = None,
               topics: Mapping[str, object] | None = None) -> FoundRules:
    """
    Return the rules a user names.

    Parameters
    ----------
    name : str
        A file ending in .json, a bag (directory, .mcap, .db3), or what ``load_controller``
        takes.
    rig : callable, optional
        Returns the rig of a controller that does not bring its own; called only then.
    namespace : str, optional
        Which muscle of a bag.
    recover : bool
        Also read a recording that broke off.
    progress : callable, optional
        Called with the share done, 0 to 1, while a recording is stepped through.
    topics : dict of str to str, optional
        Topics of a bag with other names than ours, as of ``load_run``.

    Raises
    ------
    InputError
        Nothing of that name, damaged, or without rules.

    """
    path = Path(name).expanduser()
    if path.suffix == '.json':
        return FoundRules(path.name, 'rule file', load_rules(path))
    if path.is_dir() or path.name.endswith(_BAG_ENDINGS) or path.name == 'metadata.yaml':
        return _of_recording(path, namespace, recover, progress, topics)
    controller = load_controller(
        name, None if rig is None else rig(), accept_other_rig=True)     # it is read, not run
    if controller.rules is None:
        raise InputError(f'a {controller.kind} controller has no rules', str(name))
    return FoundRules(path.stem, 'controller', controller.rules)


def saved_beside(path: Path) -> Path:
    """Return where rules learned in a recording are kept: in its folder, or beside its file."""
    path = Path(path)
    if path.name == 'metadata.yaml':
        path = path.parent
    return path / SAVED_NAME if path.is_dir() else path.with_suffix(f'.{SAVED_NAME}')


def _of_recording(path: Path, namespace: str | None, recover: bool,
                  progress: Callable[[float], object] | None,
                  topics: Mapping[str, object] | None) -> FoundRules:
    """Return the rules of a recording, with what cannot be right in its values."""
    from pam_actuation.bags.load import load_run
    from pam_actuation.bags.oddities import recording_remarks
    run = load_run(path, namespace=namespace, recover=recover, topics=topics)
    found = _of_run(run, path, progress)
    return replace(found, remarks=(
        *run.implausible, *recording_remarks([run]), *found.remarks),
                   implausible=(*run.left_out, *run.implausible))


def _of_run(run: 'RecordedRun', path: Path,
            progress: Callable[[float], object] | None) -> FoundRules:
    """Return the rules at the end of a recording, and those at its start."""
    from pam_actuation.replay.controller import replay_controller
    text = run.metadata.get('controller')
    if not text:
        raise InputError('the recording does not say which controller ran', os.fspath(path))
    with mistakes_of(path):
        controller = load_controller(text)
    if controller.rules is None:
        raise InputError(
            f'the recording was made with a {controller.kind} controller, which has no rules',
            os.fspath(path))
    before = controller.rules
    since, title = 'the rules at its start', path.resolve().name
    remarks: list[str] = []
    saved = saved_beside(path)
    if saved.is_file():
        return FoundRules(title, 'recording', load_rules(saved, before), before, since,
                          (f'The rules at the end were read from {saved}.',))
    try:
        result = replay_controller(run, progress=progress)
    except InputError as error:
        return FoundRules(
            title, 'recording', before.copy(), before, since,
            (f'These are the rules at its start: what was learned is not known, for '
             f'{error.problem}.',))
    if not result.identical:
        remarks.append('The controller was not reproduced to the bit, the rules at the end are '
                       'near those that were learned.')
    return FoundRules(
        title, 'recording', result.controller.rules, before, since, tuple(remarks))
