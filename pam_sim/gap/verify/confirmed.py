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

"""Which of the names of a search the certify data confirm."""

from collections.abc import Sequence

from pam_sim.gap.select.rival import NamedEffect
from pam_sim.gap.verify.at_end import at_end
from pam_sim.gap.verify.harm import Harm, without_harm
from pam_sim.gap.verify.own_runs import OwnRuns
from pam_sim.gap.verify.refutation import less, refute, refuted_alone, unconfirmed
from pam_sim.gap.verify.validation import Validation

UNCONFIRMED = ('What {} would explain of the recordings is not found again in the certify data, '
               'so it is not named.')


def confirmed(named: Sequence[NamedEffect], validation: Validation
              ) -> tuple[list[NamedEffect], Validation, list[Harm], list[str]]:
    """
    Leave out, one by one, what the certify data contradict, do not find again, or follow worse.

    Before that, what is certain only by a number at the end of its range.

    Parameters
    ----------
    named : list of NamedEffect
        What the search added.
    validation : Validation
        Of the final model, with the first name of every set.

    Returns
    -------
    named : list of NamedEffect
        What is left, sets without the names that are contradicted.
    validation : Validation
        Of the final model with these.
    harms : list of Harm
        What would make a signal worse.
    remarks : list of str
        A sentence for each name that is not found again, or is at the end of its range.

    """
    kept, final = refute(named, validation)
    if final is not validation.final:
        validation = validation.of(final)
    remarks = []
    for gone, why in at_end(kept, validation.estimator, validation.final):
        remarks.append(why)
        kept = [w for w in kept if w.name != gone]
        validation = validation.of(less([gone], validation))
    while kept:
        name, without = unconfirmed(kept, validation)
        if name is None and validation.recording.unseen_s > 0.0:
            name, without = refuted_alone(kept, OwnRuns(validation))
        if name is None:
            break
        remarks.append(UNCONFIRMED.format(name))
        kept = [w for w in kept if w.name != name]
        validation = validation.of(without)
    kept, validation, harms = without_harm(kept, validation)
    return kept, validation, harms, remarks
