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

"""The controller's rules before and after learning."""

import numpy as np

from pam_actuation.report import figures
from pam_actuation.report.page import paragraph, plot, Section, text

DIRECTIONS = ('contracting', 'extending')


def rules(before, after, key='rules', title='What the rules learned'):
    """
    Return the section of the rule base.

    Parameters
    ----------
    before, after : RuleBase
        Rules at the start and at the end of a run; ``before`` may be None, then the
        initial rules kept in ``after`` are shown.
    key, title : str
        Anchor and heading.

    """
    gain_kpa = after.scaling.get('feedback_gain_pa', 1e3) * 1e-3
    first = after.feedback_initial if before is None else before.feedback
    first_forward = after.feedforward_initial if before is None else before.feedforward
    error_mm = np.linspace(-1, 1, after.feedback.shape[1]) * 1e3 * after.scaling.get(
        'error_universe_m', 1e-3)
    change = np.linspace(-1, 1, after.feedback.shape[2]) * 1e3 * after.scaling.get(
        'change_universe_m_per_s', 1e-3)
    limit = gain_kpa * max(float(np.max(np.abs(first))), float(np.max(np.abs(after.feedback))),
                           1e-6)
    body = paragraph(
        'Feed-forward rules add a pressure near each reference position, one set for '
        'contracting and one for extending; their difference is the hysteresis the '
        'controller found. Feedback rules add a pressure for each pair of error and change '
        'of error. All maps share one colour scale.')
    body += plot(_forward(first_forward, after), 'Feed-forward rules: knots are the rules, '
                 'between them the controller interpolates.')
    maps = [(f'{name}, {when}', change, error_mm, table[d] * gain_kpa)
            for d, name in enumerate(DIRECTIONS)
            for when, table in (('before', first), ('after', after.feedback))]
    for pair in (maps[:2], maps[2:]):
        body += plot(figures.heat_maps(
            pair, 'change of error [mm/s]', 'error [mm]', 'kPa', limit))
    moved = float(np.max(np.abs(after.feedback - first))) * gain_kpa
    moved_forward = float(np.max(np.abs(after.feedforward - first_forward))) * 1e-3
    body += paragraph(
        f'Largest change of a feedback rule {moved:.2f} kPa, of a feed-forward rule '
        f'{moved_forward:.2f} kPa.', 'note')
    return Section(key, title, body + _sentences(after))


def _forward(first, after):
    if 'reference_lower_m' in after.scaling:
        x, label = after.knots_m() * 1e3, 'reference contraction [mm]'
    else:
        x, label = np.arange(after.feedforward.shape[1]), 'rule'
    traces = []
    for d, role in enumerate(('after', 'second')):
        for when, values, dash in (('before', first, 'dot'),
                                   ('after', after.feedforward, None)):
            trace = figures.line(x, values[d] * 1e-3, f'{DIRECTIONS[d]}, {when}', role,
                                 dash=dash)
            if dash is None:
                trace['mode'] = 'lines+markers'
                trace['marker'] = {'color': f'@{role}', 'size': 6}
            traces.append(trace)
    return figures.stack([('added pressure [kPa]', traces)], label, row_px=280)


def _sentences(after, most=12):
    spoken = after.sentences() if hasattr(after, 'sentences') else []
    if not spoken:
        return ''
    items = ''.join(f'<li>{text(s)}</li>' for s in spoken[:most])
    return (f'<details><summary>The {min(most, len(spoken))} most active rules in words'
            f'</summary><ol>{items}</ol></details>')
