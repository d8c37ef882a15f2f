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

"""The result of an examination as Markdown."""

from collections import Counter

from scoring_judge import is_right, truths, wrong_names
from scoring_table import GAP_EDGES, table, wilson


def report(cases, families, rivals=None):
    """
    Return the whole report.

    Parameters
    ----------
    cases : list of Scored
        All cases.
    families : dict of str -> str
        Family of every effect.
    rivals : dict of str -> list of Scored, optional
        The same cases answered by other methods.

    """
    rows = table(cases, families)
    parts = ['| measure | at least | measured | met |', '|---|---|---|---|']
    parts += [f'| {r.measure} | {r.bar} | {r.value} | {_met(r)} |' for r in rows]
    if rivals:
        parts += ['', *_rivals(cases, rivals)]
    parts += ['', *_by_other_refit(cases, rows, families), *_by_gap(cases), '',
              *_by_kind_of_motion(cases), '', *_confusion(cases), '', *_confidence(cases), '',
              *_wrong(cases), '', *_missed(rows)]
    return '\n'.join(parts)


def _met(row):
    return '–' if row.met is None else 'yes' if row.met else '**no**'


def _share(cases, passes):
    hits = sum(bool(passes(c)) for c in cases)
    low, high = wilson(hits, len(cases))
    return (f'{100 * hits / len(cases):.0f} % ({hits}/{len(cases)}; {100 * low:.0f}–'
            f'{100 * high:.0f})') if cases else '–'


def _right(case):
    return is_right(case.answer, case.key)


def _wrongly(case):
    return bool(wrong_names(case.answer, case.key))


def _rivals(cases, rivals):
    """Lay the pipeline beside other methods on the cases these answered."""
    parts = ['Other methods on the same records:', '',
             '| method | right single name (gap ≥ 1 σ) | null records with a name | wrong name, '
             'all cases |', '|---|---|---|---|']
    answered = {c.key['name'] for found in rivals.values() for c in found}
    ours = [c for c in cases if c.key['name'] in answered]
    for name, found in {'pam gap': ours, **rivals}.items():
        singles = [c for c in found if c.key['kind'] == 'single' and c.gap >= 1.0]
        nulls = [c for c in found if c.key['kind'] in ('null', 'hard_null')]
        parts.append(f'| {name} | {_share(singles, _right)} | '
                     f'{_share(nulls, lambda c: c.answer.claimed)} | {_share(found, _wrongly)} |')
    return parts


def _by_other_refit(cases, rows, families):
    """Lay the rows that rest on the size of a gap beside those after the tempered refit."""
    others = [c.tempered for c in cases]
    if None in others:
        return []
    parts = ['The same with gaps after a refit that is tempered (rows that differ):', '',
             '| measure | at least | measured | met |', '|---|---|---|---|']
    parts += [f'| {r.measure} | {r.bar} | {r.value} | {_met(r)} |'
              for r, plain in zip(table(others, families), rows) if r.value != plain.value]
    apart = [c.key['name'] for c, other in zip(cases, others)
             if c.key['kind'] == 'single' and (c.gap >= 1.0) != (other.gap >= 1.0)]
    return [*parts, '', 'Single effects on the other side of 1 σ with it: '
            + (', '.join(apart) or 'none') + '.', '']


def _by_gap(cases):
    singles = [c for c in cases if c.key['kind'] == 'single']
    parts = ['Single effects by the size of their gap:', '',
             '| gap in σ | right name | wrong name | set | nothing named |',
             '|---|---|---|---|---|']
    for low, high in zip(GAP_EDGES, GAP_EDGES[1:]):
        found = [c for c in singles if low <= c.gap < high]
        parts.append(f'| {low:g} to {high:g} | {_share(found, _right)} | '
                     f'{_share(found, _wrongly)} | '
                     f'{_share(found, lambda c: c.answer.verdict == "ambiguous")} | '
                     f'{_share(found, lambda c: not c.answer.reported)} |')
    return parts


def _by_kind_of_motion(cases):
    singles = [c for c in cases if c.key['kind'] == 'single' and c.gap >= 1.0]
    parts = ['Single effects of 1 σ and more by protocol and valve:', '',
             '| protocol | valve | right name | wrong name |', '|---|---|---|---|']
    for protocol, valve in sorted({(c.key['protocol'], c.key['valve']) for c in singles}):
        found = [c for c in singles
                 if (c.key['protocol'], c.key['valve']) == (protocol, valve)]
        parts.append(f'| {protocol} | {valve} | {_share(found, _right)} | '
                     f'{_share(found, _wrongly)} |')
    return parts


def _truth(key):
    return ' + '.join(sorted((*truths(key), *key['outside']))) or key['kind']


def _due(key):
    """Return the answer that is due: the truth, where one name can say it."""
    if key['outside']:
        return 'unknown'
    if key['kind'] == 'ambiguous':
        return 'set'
    return _truth(key) if truths(key) else 'no_gap'


def _confusion(cases):
    counts, due = {}, {}
    for case in cases:
        prefix = '(ambiguous) ' if case.key['kind'] == 'ambiguous' else ''
        truth = prefix + _truth(case.key)
        counts.setdefault(truth, Counter())[case.answer.label] += 1
        due[truth] = _due(case.key)
    other = {truth: answers for truth, answers in counts.items() if set(answers) != {due[truth]}}
    parts = [f'Answers by truth, all sizes. Of {len(counts)} truths, '
             f'{len(counts) - len(other)} had only the answer that is due; the others:', '',
             '| truth | answers |', '|---|---|']
    for truth, answers in sorted(other.items()):
        listed = ', '.join(f'{label} {n}' for label, n in answers.most_common())
        parts.append(f'| {truth} | {listed} |')
    return parts


def _confidence(cases):
    named = [(e.get('confidence'), c) for c in cases
             if c.answer.verdict in ('effects', 'partial')
             for e in c.answer.raw['effects'][:1] if e.get('confidence') is not None]
    parts = ['Stated confidence against how often the name was right:', '',
             '| confidence | right |', '|---|---|']
    for low, high in ((0.0, 0.5), (0.5, 0.8), (0.8, 0.95), (0.95, 1.01)):
        found = [c for confidence, c in named if low <= confidence < high]
        parts.append(f'| {low:g} to {min(high, 1):g} | '
                     f'{_share(found, lambda c: not _wrongly(c))} |')
    return parts


def _wrong(cases):
    parts = ['Every wrong name:', '']
    for case in cases:
        if _wrongly(case):
            key = case.key
            parts.append(
                f'- {key["name"]} ({key["kind"]}, {key["valve"]}, {key["protocol"]}): truth '
                f'{_truth(key)}, gap {case.gap:.1f} σ, named {" + ".join(case.answer.claimed)}'
                f', unexplained {case.answer.unexplained:.2f}')
    return parts if len(parts) > 2 else [*parts, '- none']


def _missed(rows):
    parts = ['Cases that a missed bar rests on:', '']
    parts += [f'- {r.measure}: {", ".join(r.failed)}' for r in rows if r.met is False and r.failed]
    return parts if len(parts) > 2 else [*parts, '- none']
