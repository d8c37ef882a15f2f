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

"""What a look at the gap found, and its form in gap.json."""

from dataclasses import dataclass, field
import math
from typing import Any

from pam_sim.annotations import FloatArray, IntArray
from pam_sim.gap.data.signals import READABLE
from pam_sim.gap.share import Share
from pam_sim.gap.words import place_in_words
from pam_sim.plain_json import finite
from pam_sim.short_repr import short_repr

SCHEMA = 1
OWN_INPUTS = 'each subsystem on its own measured inputs:'
WHOLE_CHAIN = 'the whole chain, run freely on the data of the proof:'


@dataclass(frozen=True)
class SignalGap:
    """
    Gap of one signal in SI units, on the certify part of the record.

    ``before`` is the given model, ``refit`` the same with its numbers calibrated,
    ``after`` the final model; equal to ``refit`` as long as no effect is added.
    """

    unit: str
    noise_floor: float
    rmse_before: float
    rmse_refit: float
    rmse_after: float

    @property
    def shrink_percent(self) -> float | None:
        """Return how much of the gap left by refitting the final model closes, or None."""
        if self.rmse_refit <= self.noise_floor:
            return None
        left = max(self.rmse_after ** 2 - self.noise_floor ** 2, 0.0)
        return 100.0 * (1.0 - math.sqrt(left / (self.rmse_refit ** 2 - self.noise_floor ** 2)))

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of gap.json."""
        return {'unit': self.unit, 'noise_floor': self.noise_floor,
                'rmse_before': self.rmse_before, 'rmse_refit': self.rmse_refit,
                'rmse_after': self.rmse_after, 'shrink_percent': self.shrink_percent}


@dataclass(frozen=True)
class Calibrated:
    """
    One parameter of the model after calibration.

    ``pull`` is (value - nominal) in standard deviations of how well the nominal
    number is known; ``ci95`` the 95 % interval of the value.
    """

    name: str
    unit: str
    nominal: float
    value: float
    ci95: tuple[float, float]
    prior_deviation: float

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of gap.json."""
        return {'name': self.name, 'nominal': self.nominal, 'value': self.value,
                'unit': self.unit, 'ci95': list(self.ci95)}


@dataclass(frozen=True)
class SubsystemVerdict:
    """
    What is said of one subsystem, on the certify data and on its own measured inputs.

    Parameters
    ----------
    verdict : str
        ``no_gap``, ``parameter``, ``effects``, ``partial``, ``ambiguous`` or ``unknown``.
    names : tuple of str
        What is named in it; of ``ambiguous``, all that cannot be told apart.
    signal : str
        The signal with the largest gap after calibration.
    gap : SignalGap
        Of that signal.
    unexplained_fraction : float
        Share of the squared gap after calibration that is left, over all its signals.
    is_slight : bool
        Whether ``no_gap`` leaves what would matter with a materiality of 1.

    """

    verdict: str
    names: tuple[str, ...]
    signal: str
    gap: SignalGap
    unexplained_fraction: float
    is_slight: bool = False

    @property
    def unexplained(self) -> float:
        """Return what the final model leaves of the signal beyond its noise floor (rms)."""
        return math.sqrt(max(self.gap.rmse_after ** 2 - self.gap.noise_floor ** 2, 0.0))

    def text(self) -> str:
        """Return it in a few words, such as ``creep and hysteresis, 0.4 mm unexplained``."""
        factor, unit = READABLE[self.signal]
        left = f'{self.unexplained * factor:.3g} {unit} unexplained'
        if self.verdict == 'no_gap':
            return f'{left}, too small to matter' if self.is_slight else 'no gap beyond noise'
        between = ' or ' if self.verdict == 'ambiguous' else ' and '
        return f'{between.join(self.names)}, {left}' if self.names else left

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of gap.json."""
        return {'verdict': self.verdict, 'names': list(self.names),
                'unexplained': self.unexplained, 'unit': self.gap.unit,
                'unexplained_fraction': self.unexplained_fraction, 'signal': self.signal,
                'noise_floor': self.gap.noise_floor, 'rmse_before': self.gap.rmse_before,
                'rmse_refit': self.gap.rmse_refit, 'rmse_after': self.gap.rmse_after}


@short_repr
@dataclass(frozen=True)
class Trace:
    """A signal measured and simulated at the measured stamps, SI units."""

    stamp_ns: IntArray
    measured: FloatArray
    before: FloatArray
    refit: FloatArray
    after: FloatArray


@short_repr
@dataclass
class GapResult:
    """
    Outcome of the gap workflow.

    Attributes
    ----------
    verdict : str
        ``effects``, ``parameter``, ``partial``, ``no_gap``, ``unknown``, ``ambiguous`` or
        ``refused``.
    reason : str
        One or two sentences for a person.
    signals : dict of str -> SignalGap
        By signal name; signals that were not recorded are absent.
    where : list of Share
        The first row is the place in which the disagreement lives after calibration. Then
        the shares of the squared gap of the whole chain by subsystem and by condition.
    parameters : list of Calibrated
        Numbers found wrong.
    calibration : list of Calibrated
        All numbers that were calibrated, for the report.
    traces, inputs : dict of str -> Trace, dict of str -> (numpy.ndarray, numpy.ndarray)
        For compare.mcap and plots; not part of gap.json. Inputs are stamps [ns] and values of
        the measured signals that drive the model.
    model_yaml : str
        The final model.
    moved : dict of str -> float
        By signal, how far the final model moves it, in standard deviations of its sensor.
    rivals : list of (str, pam_sim.Rig, Hypothesis, numpy.ndarray)
        What the first set of names holds, the likeliest first: name, fitted model, hypothesis
        and its normalised parameters.
    evidence : list of dict
        Of every name that was fitted: ``subsystem``, ``name``, ``share`` of the gap it
        explains, ``t`` by which the best is better.
    noise : dict of str -> float
        Standard deviation of the sensors, by signal.
    at_one_speed : bool
        Whether creep and hysteresis are a set for want of a second speed.
    subsystems : dict of str -> SubsystemVerdict
        By ``valve``, ``muscle``, ``load`` or ``sensor``; the last two where they are named.
    not_judged : dict of str -> str
        By ``valve`` or ``muscle``, why the recordings tell nothing of it.
    noticed : list of Notice
        What is no noise, where it makes an answer ``unknown``.
    is_slight : bool
        Whether ``no_gap`` leaves what would matter with a materiality of 1.
    model : dict, optional
        Which model was held against the recordings, and which rig they name: the entry of
        gap.json.
    recorded : dict
        ``bag`` and ``date`` of what was searched, for the source of an effect in the model.
    numbers_first : dict, optional
        What was found of unknown numbers before the look: the entry of gap.json.
    first_lines : list of str
        The same for a person.
    proposal : pam_sim.gap.propose.proposal.Proposal, optional
        A term without a name that the certify data confirm.
    surrogate : pam_sim.gap.propose.surrogate.Surrogate, optional
        A model without named effects that follows the certify data better.

    """

    verdict: str
    reason: str
    signals: dict[str, SignalGap] = field(default_factory=dict)
    where: list[Share] = field(default_factory=list)
    parameters: list[Calibrated] = field(default_factory=list)
    calibration: list[Calibrated] = field(default_factory=list)
    effects: list[dict[str, Any]] = field(default_factory=list)
    ambiguity_set: list[str] = field(default_factory=list)
    next_experiment: dict[str, Any] | None = None
    unexplained_fraction: float = 0.0
    fingerprint: dict[str, dict[str, Any]] = field(default_factory=dict)
    minimum_detectable: dict[str, dict[str, Any]] = field(default_factory=dict)
    runtime_s: float = 0.0
    simulations: int = 0
    remarks: list[str] = field(default_factory=list)
    traces: dict[str, Trace] = field(default_factory=dict)
    inputs: dict[str, tuple[IntArray, FloatArray]] = field(default_factory=dict)
    model_yaml: str = ''
    moved: dict[str, float] = field(default_factory=dict)
    rivals: list[Any] = field(default_factory=list)
    noise: dict[str, float] = field(default_factory=dict)
    evidence: list[dict[str, Any]] = field(default_factory=list)
    at_one_speed: bool = False
    subsystems: dict[str, SubsystemVerdict] = field(default_factory=dict)
    not_judged: dict[str, str] = field(default_factory=dict)
    noticed: list[Any] = field(default_factory=list)
    is_slight: bool = False
    model: dict[str, Any] | None = None
    recorded: dict[str, Any] = field(default_factory=dict)
    numbers_first: dict[str, Any] | None = None
    first_lines: list[str] = field(default_factory=list)
    proposal: Any = None
    surrogate: Any = None

    @property
    def place(self) -> str:
        """Return in one sentence where the disagreement lives; empty where there is none."""
        if not self.where:
            return ''
        others = [place_in_words(s) for s, one in self.subsystems.items()
                  if one.names and s != self.where[0].subsystem]
        return self.where[0].text() + (
            f' Something is named in {" and ".join(others)} as well.' if others else '')

    @property
    def model_lines(self) -> list[str]:
        """Return sentences on the model that was held against the recordings, if that is told."""
        told = self.model
        if told is None:
            return []
        beside = ', the rig that the recording holds' if told['is_recorded'] else (
            f'; the recording names {told["recorded"]}' if told['recorded'] else '')
        return [f'Model: {told["name"]}, valve {told["valve"]}{beside}.',
                *([told['remark']] if told['remark'] else [])]

    def text(self) -> str:
        """Return the result in lines for a person."""
        rows = [*self.model_lines, *self.first_lines, *([self.place] if self.place else []),
                f'{self.verdict}: {self.reason}', *([OWN_INPUTS] if self.subsystems else [])]
        told: list[SubsystemVerdict] = []
        for name, found in self.subsystems.items():
            # Where a gap lives is told beside the subsystem that leaves it.
            same = ', the same as above' if any(found is one for one in told) else ''
            rows.append(f'  {name}: {found.text()}{same}')
            told.append(found)
        rows += [f'  {s}: not judged: {why}' for s, why in self.not_judged.items()]
        rows += [WHOLE_CHAIN] if self.signals else []
        for name, s in self.signals.items():
            factor, unit = READABLE[name]
            rows.append(
                f'  {name}: noise floor {s.noise_floor * factor:.3g}, model off by '
                f'{s.rmse_before * factor:.3g}, calibrated {s.rmse_refit * factor:.3g}, '
                f'final {s.rmse_after * factor:.3g} {unit} rms')
        return '\n'.join(rows + [f'  {r}' for r in self.remarks])

    def to_dict(self) -> dict[str, Any]:
        """Return what gap.json holds, plain data without NaN."""
        return finite({
            'schema': SCHEMA, 'verdict': self.verdict, 'model': self.model,
            'subsystems': {name: one.to_dict() for name, one in self.subsystems.items()},
            'not_judged': self.not_judged,
            'proposal': self.proposal.to_dict() if self.proposal else None,
            'surrogate': self.surrogate.to_dict() if self.surrogate else None,
            'effects': self.effects,
            'parameters': [p.to_dict() for p in self.parameters],
            'ambiguity_set': self.ambiguity_set, 'next_experiment': self.next_experiment,
            'where': [w.to_dict() for w in self.where],
            'signals': {name: s.to_dict() for name, s in self.signals.items()},
            'unexplained_fraction': self.unexplained_fraction,
            'fingerprint': self.fingerprint, 'minimum_detectable': self.minimum_detectable,
            'runtime_s': self.runtime_s, 'simulations': self.simulations,
            'reason': self.reason, 'numbers_first': self.numbers_first,
            'remarks': self.remarks})
