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

"""On/off valves that are too small for the motion they were asked for."""

from collections.abc import Iterable

from pam_actuation.bags.facts import recorded_muscle
from pam_actuation.bags.load_joint import MEASURED
from pam_actuation.report.metrics import saturation_share
from pam_actuation.report.page import Section, told_of_runs
from pam_actuation.rig_files.by_size import by_size
from pam_sim.joint.parameters import SIDES
from pam_sim.run import Run

MOST = 0.1                   # of the messages fully open; presets need none for smooth motions
SMALL = 0.8                  # of the conductance by size: worth a word


def full_valves(run: Run) -> str:
    """
    Return a sentence where the valves of a run that tracks stood fully open for long, or ''.

    Of a joint, those of each muscle count by themselves.
    """
    if MEASURED not in run:
        return _of_muscle(run, 'a valve') if 'reference' in run else ''
    if 'joint_reference' not in run:
        return ''
    return '; '.join(filter(None, (_of_muscle(Run(
        {name.removeprefix(f'{side}/'): one for name, one in run.topics.items()
         if name.startswith(f'{side}/')}, run.metadata, f'{run.namespace}/{side}', run.path),
        f'a valve of the {side}') for side in SIDES)))


def _of_muscle(run: Run, which: str) -> str:
    """Return the sentence on the valves of one muscle, '' where they were large enough."""
    share = saturation_share(run)
    if share is None or share[0] is not None or share[1] <= MOST:
        return ''
    rig = recorded_muscle(run.metadata, run.namespace)
    number = '' if rig is None else f' (C is {rig.parameters["C"]:.3g} m3/(s Pa)'
    if rig is not None:
        usual = by_size(rig.muscle.bore_m, rig.muscle.length_m)['C']
        number += f'; {usual.value:.3g} by the size of the muscle)' \
            if rig.parameters['C'] < SMALL * usual.value else ')'
    return (f'{which} stood fully open for {100 * share[1]:.0f} % of the time, so the valves '
            'limit this motion, and the error says little of the controller; take larger valves'
            f'{number}, a higher supply pressure or a slower motion')


def full_valves_section(runs: Iterable[tuple[str, Run]]) -> Section | None:
    """Return the section on such runs by their titles, None where there is none."""
    return told_of_runs('full_valves', 'Valves too small', full_valves, runs)
