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

from pam_sim.effects.registry import effects
from pam_sim.gap.result import READABLE


def explain(result, outcome):
    """Return the reason of a verdict, two or three sentences."""
    if result.verdict == 'no_gap':
        return 'The model follows the recording within sensor noise and stamps, its numbers ' \
            'calibrated within their tolerance.'
    if result.verdict == 'parameter':
        return f'{_numbers(result.parameters)} {_shrink(result)}.'
    if result.verdict == 'unknown':
        missed = _sizes(result.signals, 'rmse_refit')
        return (f'The calibrated model misses {missed} and no known effect explains it'
                f'{_nearest(outcome)}.{_mistaken(outcome)}')
    parts = [f'{_sentence(e["name"])} ({e["name"]}: {_quantity(e["equivalent"])}).'
             for e in result.effects]
    if result.parameters:
        parts.append(_numbers(result.parameters) + '.')
    if result.verdict == 'ambiguous':
        parts = ['These data cannot tell ' + join(result.ambiguity_set) + ' apart. Likeliest: '
                 + (' '.join(parts))]
    text = ' '.join(parts) + f' With this {_shrink(result)}.'
    if result.unexplained_fraction >= 0.2:
        text += (f' {100 * result.unexplained_fraction:.0f} % of the squared gap remain '
                 'unexplained.')
    return text


def join(parts):
    """Return a list in words."""
    parts = list(parts)
    return parts[0] if len(parts) == 1 else ', '.join(parts[:-1]) + ' and ' + parts[-1]


def _sentence(name):
    return effects()[name].sentence.rstrip('.')


def _quantity(equivalent):
    return join([f'{n} {q["value"]:.3g} {q["unit"]}, 95 % {q["ci95"][0]:.3g} to '
                 f'{q["ci95"][1]:.3g}' for n, q in equivalent.items()])


def _numbers(parameters):
    return join([f'{c.name} = {c.value:.4g} {c.unit} instead of {c.nominal:.4g} {c.unit} '
                 f'({100 * (c.value / c.nominal - 1):+.1f} %)' for c in parameters])


def _shrink(result):
    parts = []
    for name, s in result.signals.items():
        factor, unit = READABLE[name]
        if s.shrink_percent is not None and s.rmse_refit > 1.2 * s.noise_floor:
            parts.append(f'the gap in {name} falls from {s.rmse_refit * factor:.3g} to '
                         f'{s.rmse_after * factor:.3g} {unit}')
    return join(parts) if parts else 'the gap falls to the noise floor'


def _sizes(signals, name):
    return join([f'{getattr(s, name) * READABLE[k][0]:.3g} {READABLE[k][1]} of {k}'
                 for k, s in signals.items() if getattr(s, name) > 1.1 * s.noise_floor]
                or ['little'])


def _mistaken(outcome):
    return ''.join(f' It looks like {name}, but {relative} fits better: '
                   f'{_sentence(relative)[:1].lower()}{_sentence(relative)[1:]}.'
                   for name, relative in outcome.mistaken.items())


def _nearest(outcome):
    parts = [f'{100 * share:.0f} % in the {s}' for s, share in outcome.share.items()]
    return f' (explained: {join(parts)})' if parts else ''
