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

"""The verdict in sentences for a person."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from pam_sim.effects.registry import effects, get_effect
from pam_sim.gap.data.signals import READABLE
from pam_sim.gap.result import Calibrated, GapResult
from pam_sim.gap.select.search import Outcome
from pam_sim.gap.verify.harm import Harm
from pam_sim.gap.words import in_words
from pam_sim.units import behind_number

SEEN = 1.2                   # times the noise floor: a gap in a signal that is worth a word
BENT = 1.2                   # times the gap of the given model: calibration made it clearly worse
ENOUGH = 0.8                 # share of the gap that would be an explanation if it held
LEAST_SHARE = 0.005
ONE_SPEED = 'They all remember the past; only a second speed tells which it is.'
MOVED = 1.0                  # deviations of its tolerance by which a number is moved
WORTH_A_WORD = 0.2           # share of the squared gap that is left


def explain(result: GapResult, outcome: Outcome, harms: Iterable[Harm] = (),
            of_some: bool = False) -> str:
    """
    Return the reason of a verdict, two or three sentences, and what is not added for harm.

    ``of_some``: only names that were asked for were tried.
    """
    return _told(result, outcome, of_some) + ''.join(_harm(one) for one in harms)


def _told(result: GapResult, outcome: Outcome, of_some: bool) -> str:
    if result.verdict == 'no_gap' and result.is_slight:
        return f'{_missed(result)}. This is too small to matter by the materiality that was given.'
    if result.verdict == 'no_gap' and 'valve' in result.not_judged:
        return 'Muscle and load of the model, driven by the measured pressure, follow the ' \
            'recording within sensor noise and stamps, their numbers calibrated within their ' \
            f'tolerance.{_shifted(result)}'
    if result.verdict == 'no_gap' and tuple(result.signals) == ('pressure',):
        return 'The valve of the model follows the recorded pressure within sensor noise and ' \
            f'stamps, its numbers calibrated within their tolerance.{_shifted(result)} The ' \
            'muscle was not compared.'
    if result.verdict == 'no_gap':
        return 'The model follows the recording within sensor noise and stamps, its numbers ' \
            f'calibrated within their tolerance.{_shifted(result)}'
    if result.verdict == 'parameter' and result.unexplained_fraction < WORTH_A_WORD:
        return f'{_numbers(result.parameters)}. With this {_shrink(result)}.'
    if result.verdict == 'unknown':
        return (f'{_missed(result)}{_nearest(result, outcome, of_some)}.{_bent(result)}'
                f'{_noticed(result)}{_mistaken(outcome)}')
    # Of several that are named, some may be certain.
    open_sets = list({frozenset(w.names): w.names for w in outcome.named
                      if len(w.names) > 1}.values())
    doubtful = {name for names in open_sets for name in names}
    if result.verdict == 'ambiguous':
        apart = ', nor '.join(join(names) for names in open_sets)
        certain = _found(result, lambda name: name not in doubtful)
        parts = [f'These data cannot tell {apart} apart.', *([ONE_SPEED] if (
                     result.at_one_speed) else []), 'Likeliest:',
                 *_found(result, lambda name: name in doubtful),
                 *(['Certain:', *certain] if certain else [])]
    else:
        parts = _found(result, lambda name: True)
    text = ' '.join(parts) + f' With this {_shrink(result)}.'
    if result.unexplained_fraction >= WORTH_A_WORD:
        text += (f' {100 * result.unexplained_fraction:.0f} % of the squared gap remain '
                 'unexplained')
        text += ', so this is a part of the answer only.' if result.verdict == 'partial' else '.'
    return text


def _found(result: GapResult, chosen: Callable[[str], bool]) -> list[str]:
    """Return a sentence for each effect, and one for the numbers, whose names are chosen."""
    parts = [f'{_sentence(e["name"], e["parameters"])} ({e["name"]}: {_quantity(e["equivalent"])}'
             f'{_together(e["together"])}).' for e in result.effects if chosen(e['name'])]
    numbers = [c for c in result.parameters if chosen(c.name)]
    return [*parts, *([_numbers(numbers) + '.'] if numbers else [])]


def join(parts: Iterable[str]) -> str:
    """Return a list in words."""
    parts = list(parts)
    return parts[0] if len(parts) == 1 else ', '.join(parts[:-1]) + ' and ' + parts[-1]


def _sentence(name: str, parameters: Mapping[str, Mapping[str, Any]] | None = None) -> str:
    values = {key: one['value'] for key, one in (parameters or {}).items()}
    return effects()[name].sentence_for(values).rstrip('.')


def _quantity(equivalent: Mapping[str, Mapping[str, Any]]) -> str:
    return join([f'{in_words(n)} {q["value"]:.3g}{behind_number(q["unit"])}, 95 % '
                 f'{q["ci95"][0]:.3g} to {q["ci95"][1]:.3g}' for n, q in equivalent.items()])


def _together(formulas: Iterable[str]) -> str:
    """Return what of several quantities is known where each alone is not, to follow them."""
    return ''.join(f'; the data determine only {formula}' for formula in formulas)


def _numbers(parameters: Iterable[Calibrated]) -> str:
    return join([_number(one) for one in parameters])


def _number(one: Calibrated) -> str:
    """Return a wrong number, the given one, and its 95 % interval."""
    unit, (low, high) = behind_number(one.unit), one.ci95
    change = f' ({100 * (one.value / one.nominal - 1):+.1f} %)' if one.nominal else ''
    return (f'{one.name} = {one.value:.4g}{unit} instead of {one.nominal:.4g}{unit}{change}, '
            f'95 % {low:.4g} to {high:.4g}')


def _shifted(result: GapResult) -> str:
    """Return in a sentence which numbers calibration moved clearly, the farthest one first."""
    moved = sorted((c for c in result.calibration if abs(c.prior_deviation) >= MOVED),
                   key=lambda c: -abs(c.prior_deviation))
    return f' Calibration moved {join([_moved(c) for c in moved])}.' if moved else ''


def _moved(one: Calibrated) -> str:
    unit = behind_number(one.unit)
    return (f'{one.name} from {one.nominal:.4g} to {one.value:.4g}{unit} '
            f'({one.prior_deviation:+.1f} of its standard deviations)')


def _shrink(result: GapResult) -> str:
    """Return in words how the gap of every signal that had or has one changes."""
    parts = []
    for name, s in result.signals.items():
        factor, unit = READABLE[name]
        if max(s.rmse_refit, s.rmse_after) > SEEN * s.noise_floor:
            # Numbers that bend for what is missing may leave more on the proof than given.
            bent = s.rmse_refit > BENT * s.rmse_before
            first = s.rmse_before if bent else s.rmse_refit
            before, after = (f'{value * factor:.3g}' for value in (first, s.rmse_after))
            what = f'the gap in {name}' + (
                ' of the given model, which calibration alone raises to '
                f'{s.rmse_refit * factor:.3g} {unit},' if bent else '')
            if before == after:
                parts.append(f'{what} stays at {after} {unit}')
            else:
                verb = 'rises' if s.rmse_after > first else 'falls'
                parts.append(f'{what} {verb} from {before} to {after} {unit}')
    return join(parts) if parts else (
        'every signal stays within its noise floor, as it does without')


def _harm(harm: Harm) -> str:
    factor, unit = READABLE[harm.signal]
    before, after = (f'{value * factor:.3g}' for value in (harm.refit, harm.after))
    they = 'it is' if len(harm.names) == 1 else 'they are'
    return (f' {join(harm.names)} would raise the gap in {harm.signal} of the proof from {before} '
            f'to {after} {unit}, so {they} not added.')


def _missed(result: GapResult) -> str:
    """Return the beginning of a sentence that says what calibration leaves."""
    sizes = [f'{s.rmse_refit * READABLE[k][0]:.3g} {READABLE[k][1]} of {k}'
             for k, s in result.signals.items() if s.rmse_refit > 1.1 * s.noise_floor]
    if sizes:
        return f'The calibrated model misses {join(sizes)}'
    return 'The calibrated model leaves a gap that its free run hides'


def _bent(result: GapResult) -> str:
    """Return in a sentence which gap of the proof calibration made larger."""
    bent = [f'in {k} of the proof from {s.rmse_before * READABLE[k][0]:.3g} to '
            f'{s.rmse_refit * READABLE[k][0]:.3g} {READABLE[k][1]}'
            for k, s in result.signals.items()
            if s.rmse_refit > max(BENT * s.rmse_before, SEEN * s.noise_floor)]
    return (f' Calibration raises the gap {join(bent)}: numbers bend for what is missing, or the '
            'recordings are not of one rig.') if bent else ''


def _noticed(result: GapResult) -> str:
    """Return in sentences what shows a gap that is no noise."""
    parts = []
    for one in result.noticed:
        if one.signal == 'supply_pressure':
            parts.append(' The recorded supply pressure moves, that of the model does not.')
        elif one.witness:
            parts.append(f' What it misses of the {one.signal} shows in the {one.witness} as '
                         'well, so it is no noise.')
        elif one.deviations > 0.0:
            parts.append(' Over short spans the pressure errs as noise and stamps do not: its '
                         f'errors follow time or pressure by {one.deviations:.0f} deviations.')
        else:
            parts.append(f' Over {one.span_s:g} s the {one.signal} errs '
                         f'{one.rms / one.expected:.1f} times as much as noise does.')
    return ''.join(parts)


def _mistaken(outcome: Outcome) -> str:
    return ''.join(f' It looks like {name}, but {relative} fits better: '
                   f'{_sentence(relative)[:1].lower()}{_sentence(relative)[1:]}. '
                   f'Ask for that with `--effects {relative}`.'
                   for name, relative in outcome.mistaken.items())


def _nearest(result: GapResult, outcome: Outcome, of_some: bool) -> str:
    """Return in words what was fitted where the gap is, and why it is no explanation."""
    closed = {s for s, one in result.subsystems.items() if one.verdict == 'no_gap'}
    shares = {s: share for s, share in outcome.share.items()
              if share >= LEAST_SHARE and s not in closed}
    parts = [f'{100 * share:.0f} % in the {s}' for s, share in shares.items()]
    none = ' and none of the effects that were tried explains it' if not outcome.complete else (
        ' and none of the effects that were asked for explains it' if of_some else
        ' and no known effect explains it')
    if not parts:
        return none
    if max(shares.values()) < ENOUGH:
        return f'{none}: the best fit explains {join(parts)}'
    fitted = f'. A fit explains {join(parts)} of the data that were searched, but '
    # There a name holds, and another one holds better.
    likened = {'valve' if get_effect(name).subsystem == 'valve' else 'muscle'
               for name in outcome.mistaken}
    if likened and all(s in likened for s, share in shares.items() if share >= ENOUGH):
        return f'{fitted}its name would be wrong. So nothing is named'
    return (f'{fitted}it does not hold: it needs numbers far from their nominal values, or fails '
            'on the data of the proof. So nothing is named')
