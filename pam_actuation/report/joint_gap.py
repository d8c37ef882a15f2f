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
A joint in front of the gap workflow: each of its muscles is a question of its own.

The contraction of a muscle in a joint is an input: what the other muscle, the limb and a person do
to it is in there. Its tension is what the load cell on its tendon reads.
"""

from collections.abc import Mapping
from dataclasses import dataclass
import os
from typing import TYPE_CHECKING

from pam_actuation.bags.load import load_run, RecordedRun
from pam_actuation.bags.load_joint import joints_of, load_recording, MEASURED
from pam_actuation.bags.source import read_bag
from pam_actuation.topics.table import short_name
from pam_sim.errors import InputError
from pam_sim.joint import joint_preset_names, JointRig, load_rig_or_joint
from pam_sim.joint.parameters import SIDES
from pam_sim.run import Series
from pam_sim.units import unit_of

if TYPE_CHECKING:
    from pam_sim.rig import Rig


@dataclass(frozen=True)
class Question:
    """
    One muscle that is held against its model.

    Parameters
    ----------
    side : str
        ``flexor`` or ``extensor`` where both muscles of a joint are asked, else ''.
    model : str or Rig
        Its model.
    namespace : str or None
        Its namespace in the bags.
    joint : JointRig or None
        The joint it belongs to, by which a contraction follows from the angle.
    topics : dict of str to str or None
        Topics of this muscle with other names in the bags, as of ``load_run``.

    """

    side: str
    model: 'str | Rig'
    namespace: str | None
    joint: JointRig | None = None
    topics: Mapping[str, str] | None = None

    def load(self, path: str) -> RecordedRun:
        """
        Return the run of this muscle in a bag.

        A contraction that was not recorded is that of the joint angle.
        """
        run = load_run(path, self.namespace, topics=self.topics)
        if self.joint is None or 'contraction' in run:
            return run
        whole = load_recording(path, run.namespace.rpartition('/')[0])
        if MEASURED in whole:
            run.topics['contraction'] = contraction_of(
                whole.topics[MEASURED], self.joint, run.namespace.rpartition('/')[2])
        return run


def contraction_of(angle: Series, joint: JointRig, side: str) -> Series:
    """Return the contraction of a muscle [m] by the recorded angle of its joint."""
    contraction_m = joint.contractions_m(angle.values['angle_rad'])[SIDES.index(side)]
    return Series(angle.stamp_ns, {'contraction_m': contraction_m},
                  {'contraction_m': unit_of('contraction_m')})


def questions(model: str, bag: str, namespace: str | None = None,
              topics: Mapping[str, str] | None = None) -> list[Question]:
    """
    Return the questions that a model and a bag make: one, or one for each muscle of a joint.

    Parameters
    ----------
    model : str
        Preset, path or YAML text of a rig, or of a joint.
    bag : path
        The first recording; it tells the namespace of a joint.
    namespace : str, optional
        Of the muscle or of the joint.
    topics : dict of str to str, optional
        Topics of one muscle with other names in the bags.

    Raises
    ------
    InputError
        The model is a joint, and the bag has none or several; ``topics`` without a choice of its
        muscle.

    """
    if not _may_be_joint(model):
        return [Question('', model, namespace, topics=topics)]
    joint = load_rig_or_joint(model)
    if not isinstance(joint, JointRig):
        return [Question('', model, namespace, topics=topics)]
    models: dict[str, str | Rig] = {
        side: f'{model}/{side}' if model in joint_preset_names() else joint.muscles[f'{side}/']
        for side in SIDES}
    side = (namespace or '').rpartition('/')[2]
    if side in SIDES:
        return [Question('', models[side], namespace, joint, topics)]
    if topics:
        raise InputError('names the topics of one muscle, and the model is a joint; choose a '
                         'muscle with --namespace, such as /knee/flexor', '--topic')
    whole = _namespace_of(bag, namespace)
    return [Question(side, models[side], f'{whole}/{side}', joint) for side in SIDES]


def _may_be_joint(model: str) -> bool:
    return model in joint_preset_names() or '\n' in model or os.path.isfile(model)


def _namespace_of(bag: str, wanted: str | None) -> str:
    """Return the namespace of the joint in a bag."""
    present = joints_of(read_bag(bag, wanted=lambda name, *_: short_name(name) == MEASURED))
    if wanted is not None:
        present = [one for one in present if one.strip('/') == wanted.strip('/')]
    if len(present) != 1:
        found = ', '.join(sorted(present)) or 'none'
        raise InputError(f'the model is a joint, and the bag has these joints: {found}; '
                         'choose one, or one muscle, with --namespace', str(bag))
    return present[0]
