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
"""A proposal: found beside what is named, proved by free run on the certify data, or none."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pam_sim.gap.data.split import FIT, SELECT
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.fit.hypothesis import Fit, Hypothesis
from pam_sim.gap.propose.library import STAND_INS, StandIn
from pam_sim.gap.propose.ranges import ranges_of, waves_in
from pam_sim.gap.propose.search import find_terms, Sum
from pam_sim.gap.propose.words import range_texts
from pam_sim.gap.propose.writing import EffectText, NAME
from pam_sim.gap.report.reason import join
from pam_sim.gap.result import GapResult
from pam_sim.gap.select.comparison import gap
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.gap.verify.model import model_of
from pam_sim.gap.verify.validation import Validation
from pam_sim.gap.words import place_in_words
from pam_sim.located_yaml import dump_yaml
import yaml

EFFECT_FILE, MODEL_FILE = f'{NAME}.py', 'proposed_model.yaml'
NONE = 'No simple term explains the rest on the data of the proof, so none is proposed.'
OTHER_PLACE = ('The term acts in {}, the place above is another one. The place is judged without '
               'the term; the term is proved on data to which it was not fitted.')
VANISH = ('With this term, {} {} to less than a tenth of the size above: the term may be what is '
          'missing, in {} place.')
NO_TIME = 'The time ran out before a simple term was found that explains the rest.'


@dataclass(frozen=True)
class Proposal:
    """
    A term without a name that the certify data confirm.

    Parameters
    ----------
    equation : str
        One line.
    name : str
        Of the effect and, with ``.py``, of its file.
    subsystem : str
        Where it acts.
    explained : float
        Share of the squared gap on the certify data that it removes.
    ranges : dict of str -> (float, float)
        By symbol, the range of each input in the data.
    text : str
        The effect file.
    model_yaml : str
        The model with the term in it.
    where : str
        The ranges in words.
    trial : dict
        The entry of a model file by which it was tried, a stand-in of the file.
    proof : dict of str -> (float, float)
        By signal, the error (rms) on the certify data without the term and with it.

    """

    equation: str
    name: str
    subsystem: str
    explained: float
    ranges: dict[str, tuple[float, float]]
    text: str
    model_yaml: str
    where: str
    trial: dict[str, Any]
    proof: dict[str, tuple[float, float]]

    @property
    def file(self) -> str:
        """Return the name of its file."""
        return f'{self.name}.py'

    @property
    def sentence(self) -> str:
        """Return it in one sentence."""
        where = f'; it holds for {self.where}' if self.where else ''
        return (f'Proposed: {self.equation} ({self.subsystem}). Unnamed, its form found from '
                f'data{where}. It removes {100 * self.explained:.0f} % of the squared gap of the '
                'proof.')

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of gap.json."""
        return {'equation': self.equation, 'file': self.file, 'subsystem': self.subsystem,
                'explained': self.explained,
                'range': {name: list(ends) for name, ends in self.ranges.items()}}


def propose(result: GapResult, validation: Validation,
            out_of_time: Callable[[], bool] = lambda: False) -> None:
    """
    Set the proposal of a result, if one is wanted and the certify data confirm it.

    Wanted is one where the verdict is ``unknown``, or what is named leaves more than a tenth.

    Parameters
    ----------
    result : GapResult
        With its verdict.
    validation : Validation
        Of the final model.
    out_of_time : callable
        Whether to come to an end.

    """
    estimator, final = validation.estimator, validation.final
    criteria = estimator.criteria
    if result.verdict in ('no_gap', 'refused') or (
            result.verdict != 'unknown'
            and result.unexplained_fraction <= 1.0 - criteria.named_share):
        return
    learning, both = estimator.using(FIT), estimator.using(FIT, SELECT)
    start = _refitted(learning, final)
    for problem in sorted(estimator.problems, key=lambda p: -gap(p, start.errors[p.subsystem])):
        if gap(problem, start.errors[problem.subsystem]) < criteria.near_floor or out_of_time():
            break
        found = _found(learning, problem, start, out_of_time)
        if found is None:
            continue
        proved = both.polish(found.fit)
        proof = validation.of(proved, _without_term(validation, both, found, proved), both)
        fell, _ = proof.fall(proof.refit, proof.after)
        explained = 1.0 - proof.unexplained()
        if (explained > criteria.greater_part and fell > criteria.greater_part
                and not proof.worse()):
            result.proposal = _written(found, proof)
            result.remarks.append(result.proposal.sentence)
            gone = _vanished(final, proved, 1.0 - criteria.named_share)
            if gone:
                result.remarks.append(VANISH.format(
                    join(gone), *(('shrink', 'their') if len(gone) > 1 else ('shrinks', 'its'))))
            own = result.proposal.subsystem
            if result.where and result.where[0].subsystem != own:
                result.remarks.append(OTHER_PLACE.format(place_in_words(own)))
            return
    result.remarks.append(NO_TIME if out_of_time() else NONE)


def _vanished(named: Fit, with_term: Fit, share: float) -> list[str]:
    """Return the names of effects that keep less than a share of their size beside a term."""
    found = []
    after = dict(zip(with_term.hypothesis.effects, with_term.values()))
    for candidate, values in zip(named.hypothesis.effects, named.values()):
        sizes = [(abs(values[p.name]), abs(after.get(candidate, values)[p.name]))
                 for p in candidate.free if not p.shape]
        if sizes and all(now < share * was for was, now in sizes):
            found.append(candidate.name)
    return found


def _refitted(learning: Estimator, final: Fit) -> Fit:
    """Return the final model fitted to the fit part alone."""
    if not final.hypothesis.names:
        return learning.fit_base()
    learning.take_slopes(final.settings(), final.known_z)
    return learning.fit(final.hypothesis, final.theta, final)


def _found(learning: Estimator, problem: SubsystemProblem, start: Fit,
           out_of_time: Callable[[], bool]) -> Sum | None:
    """Return the terms for a subsystem, None where the select part wants none."""
    ranges = ranges_of(problem.recordings, learning, start)
    return find_terms(
        learning, problem, start, [s for s in STAND_INS if _fits(s, learning, problem)],
        ranges, lambda fit: waves_in(problem, fit), out_of_time)


def _fits(stand_in: StandIn, learning: Estimator, problem: SubsystemProblem) -> bool:
    """Return whether a stand-in can act in a subsystem of a rig."""
    rig = learning.rig
    return (rig.valve in stand_in.valves
            and (stand_in.subsystem == 'valve') == (problem.subsystem == 'valve')
            and (stand_in.subsystem != 'load' or not rig.is_driven)
            and (not stand_in.signal or stand_in.signal in problem.signals))


def _without_term(validation: Validation, both: Estimator, found: Sum, proved: Fit) -> Fit:
    """
    Return what a term is compared with: the final model, or the numbers of the fit alone.

    The fit with the term may have found better numbers; that is no merit of the term.
    """
    bare = _bare(found, proved)
    gained = 1.0 - validation.of(bare, validation.final, both).unexplained()
    return bare if gained > both.criteria.close_share else validation.final


def _bare(found: Sum, proved: Fit) -> Fit:
    """Return a fit less its term."""
    h = proved.hypothesis
    kept = [p for p in range(len(h.effects)) if p != found.place]
    return Fit(
        Hypothesis(tuple(h.effects[p] for p in kept), h.numbers),
        np.concatenate([np.zeros(0), *(proved.theta_of(p) for p in kept)]), proved.known_z,
        proved.errors, proved.temper)


def _written(found: Sum, proof: Validation) -> Proposal:
    """Return the proposal of proved terms, with its file and its model."""
    proved, explained = proof.final, 1.0 - proof.unexplained()
    values = proved.values()[found.place]
    ranges = {one.symbol: (found.ends[f'low_of_{i}'], found.ends[f'high_of_{i}'])
              for i, one in enumerate(found.stand_in.inputs) if f'low_of_{i}' in found.ends}
    effect = EffectText(found.stand_in, found.terms, values, ranges, explained)
    data = yaml.safe_load(model_of(proof.estimator, _bare(found, proved)).to_yaml())
    data['effects'] = [*data.get('effects', ()), {
        'name': effect.name, 'parameters': effect.values()}]
    return Proposal(effect.equation, effect.name, found.stand_in.subsystem, float(explained),
                    effect.ranges, effect.text(), dump_yaml(data),
                    ', '.join(range_texts(effect.ranges, effect.inputs)),
                    proved.settings()[found.place],
                    {s: (g.rmse_refit, g.rmse_after) for s, g in proof.signals().items()})
