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

"""Runs on one page whose errors do not compare their controllers alone."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from pam_actuation.bags.facts import NOT_RECORDED, recorded, recorded_rig_title
from pam_actuation.report.page import paragraph, Section
from pam_actuation.report.sections.over_seeds import controller_kind
from pam_actuation.report.sections.provenance import told_ahead

if TYPE_CHECKING:
    from pam_sim.run import Run

    Named = Sequence[tuple[str, Run]]


def unlike(named: 'Named') -> str:
    """
    Return a sentence where runs that track differ in more than their controllers, or ''.

    How far ahead the reference was told is always named. Experiment and rig are where the
    controllers are of different kinds: the same one on two rigs compares the rigs.
    """
    tracked = [(title, run) for title, run in named
               if 'reference' in run or 'joint_reference' in run]
    looks: dict[str, Callable[[Run], str]] = {}
    if len({controller_kind(run) for _, run in tracked}) > 1:
        looks = {'experiment': lambda run: recorded(run.metadata, 'experiment_name'),
                 'rig': lambda run: recorded_rig_title(run.metadata)}
    looks['reference told ahead'] = told_ahead
    found = []
    for what, look in looks.items():
        seen: dict[str, list[str]] = {}
        for title, run in tracked:
            seen.setdefault(look(run), []).append(title)
        if len(seen) > 1 and NOT_RECORDED not in seen:
            found.append(f'{what} ' + ', '.join(
                f'{value} ({", ".join(titles)})' for value, titles in seen.items()))
    return ('these runs differ in more than the controller, so their errors do not compare '
            f'controllers alone: {"; ".join(found)}') if found else ''


def unlike_section(named: 'Named') -> Section | None:
    """Return the section with that sentence, None where there is none."""
    said = unlike(named)
    return Section('unlike', 'No comparison of controllers alone',
                   paragraph(f'{said[0].upper()}{said[1:]}.')) if said else None
