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

"""Whether effects move a signal by enough to be worth a name."""

from collections.abc import Callable, Mapping

import numpy as np
from pam_sim.annotations import BoolArray, FloatArray
from pam_sim.gap.criteria import CRITERIA, Criteria
from pam_sim.gap.data.noise import noise_of
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.split import SETTLE_S, settling_s, split_of
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit
from pam_sim.gap.verify.model import free_run_of, held_without


def is_material(own: Mapping[str, float], refitted: Mapping[str, float], materiality: float,
                found_again: bool = False, criteria: Criteria = CRITERIA) -> bool:
    """
    Return whether effects are worth a name.

    They are material if they move a signal by more than ``materiality`` after the parameters of
    the model are refitted to replace them. They are also material if they do so with the
    parameters held, and still by ``visible_sd`` after the refit. ``found_again_sd`` suffices there
    if the certify data confirm it. Numbers that were bent by one motion are wrong in another,
    though the effect itself may do nothing there.

    Parameters
    ----------
    own, refitted : dict of str -> float
        How far each signal moves, in standard deviations of its sensor.
    materiality : float
        Of a sensor, in its standard deviations.
    found_again : bool
        Whether the errors of the certify data fall as those of a true effect do.
    criteria : Criteria
        Decision thresholds.

    """
    left = max(refitted.values(), default=0.0)
    return left > materiality or (
        max(own.values(), default=0.0) > materiality
        and left > min(materiality,
                       criteria.found_again_sd if found_again else criteria.visible_sd))


def materiality_on(recording: Recording, whole: bool, estimator: Estimator, materiality: float
                   ) -> Callable[[Fit, Fit], bool]:
    """
    Return whether one fit differs from another by enough for a name, as a function of the two.

    Parameters
    ----------
    recording : Recording
        Of the proof; its input alone is used.
    whole : bool
        All of it is the certify part; otherwise its certify blocks.
    estimator : Estimator
        That the fits are made by.
    materiality : float
        As of ``is_material``.

    """
    unused_s = split_of(recording, criteria=estimator.criteria).unused_s
    settled = {s: recording.time_s[s] > (settling_s(recording, s) if whole else unused_s(s))
               for s in recording.signals}

    def matters(found: Fit, without: Fit) -> bool:
        bare = held_without(found, without.hypothesis.names)
        run, *others = (free_run_of(estimator, f, recording) for f in (found, bare, without))
        own, refitted = (moved(recording, run, o, settled) for o in others)
        is_number = len(bare.theta) == len(found.theta)
        return is_material(refitted if is_number else own, refitted, materiality,
                           criteria=estimator.criteria)

    return matters


def moved(recording: Recording, first: Mapping[str, FloatArray], second: Mapping[str, FloatArray],
          chosen: Mapping[str, BoolArray] | None = None) -> dict[str, float]:
    """Return by signal how far two runs are apart (rms), in standard deviations of its sensor."""
    found = {}
    for s in recording.signals:
        noise = noise_of(recording.time_s[s], recording.measured[s]).sd
        apart = first[s] - second[s]
        apart = apart[recording.time_s[s] > SETTLE_S] if chosen is None else apart[chosen[s]]
        found[s] = float(np.sqrt(np.mean(apart ** 2)) / max(noise, 1e-12))
    return found
