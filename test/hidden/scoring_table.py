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

"""The table of an examination: every measure with its bar, its count and a Wilson interval."""

from dataclasses import dataclass, replace
import math

import numpy as np
from scoring_judge import (
    abstains, is_false_alarm, is_in_set, is_of_family, is_right, quantities, read_answer,
    shrink_percent, suggests_rightly, wrong_names)

GAP_EDGES = (0.0, 0.3, 1.0, 3.0, 10.0, math.inf)


@dataclass
class Scored:
    """A case with its key, its answer, the answer after the suggested experiment, the time."""

    key: dict
    answer: object
    after: object = None
    wall_s: float = 0.0
    processor_s: float = 0.0

    @property
    def gap(self):
        """Return the largest gap in sigma; of the smaller of two effects."""
        if self.key.get('gap_alone'):
            return min(self.key['gap_alone'].values())
        return max(self.key.get('gap_sigma', {'': 0.0}).values())

    @property
    def tempered(self):
        """Return the same with the gap after the tempered refit, None if the key has none."""
        key = self.key
        if 'gap_sigma_tempered' not in key:
            return None
        alone = key.get('gap_alone_tempered')
        return replace(self, key=key | {'gap_sigma': key['gap_sigma_tempered']} | (
            {'gap_alone': alone} if alone else {}))


def scored(key, raw, raw_after=None, wall_s=0.0, processor_s=0.0):
    """Return the Scored of the plain data of a key and of results."""
    return Scored(key, read_answer(raw), read_answer(raw_after) if raw_after else None, wall_s,
                  processor_s)


def wilson(hits, count, z=1.96):
    """Return the 95 % interval of a share, Wilson (1927), J. Am. Stat. Assoc. 22."""
    if count == 0:
        return 0.0, 1.0
    share, scale = hits / count, 1.0 + z * z / count
    middle = (share + z * z / (2 * count)) / scale
    half = z / scale * math.sqrt(share * (1.0 - share) / count + z * z / (4 * count * count))
    return max(middle - half, 0.0), min(middle + half, 1.0)


@dataclass
class Row:
    """One measure: text, value as text, the bar as text, whether it is met (None: no data)."""

    measure: str
    value: str
    bar: str
    met: object
    failed: tuple = ()        # names of the cases that missed


def share_row(measure, cases, passes, least=None, most=None):
    """Return the Row of a share of cases, at least or at most a bar."""
    results = {c.key['name']: bool(passes(c)) for c in cases}
    hits, count = sum(results.values()), len(results)
    bar = f'≥ {100 * least:.4g} %' if least is not None else f'≤ {100 * most:.4g} %'
    if not count:
        return Row(measure, 'no cases', bar, None)
    share = hits / count
    low, high = wilson(hits, count)
    met = share >= least if least is not None else share <= most
    failed = tuple(n for n, r in results.items() if r == (least is None))
    return Row(measure, f'{100 * share:.1f} % ({hits}/{count}; {100 * low:.0f}–{100 * high:.0f})',
               bar, met, failed)


def table(cases, families):
    """
    Return the Rows of all measures.

    Parameters
    ----------
    cases : list of Scored
        All cases.
    families : dict of str -> str
        Family of every effect.

    """
    def kind(*names):
        return [c for c in cases if c.key['kind'] in names]

    singles, twos = kind('single'), kind('two')
    clear = [c for c in singles if c.gap >= 1.0]
    nulls, ambiguous, wrong = kind('null', 'hard_null'), kind('ambiguous'), kind('parameter')
    rich = [c for c in clear if c.key['protocol'] == 'minimum']

    def right(c):
        return is_right(c.answer, c.key)

    def family(c):
        return is_of_family(c.answer, families[c.key['effects'][0]], families)

    def one_wrong(c):
        return len(wrong_names(c.answer, c.key)) > 0

    def place(c):
        return right(c) or c.answer.subsystem == c.key['subsystem'][c.key['effects'][0]]

    def first_place(c):
        return c.answer.place == c.key['subsystem'][c.key['effects'][0]]

    seen = [c for c in kind('single', 'two', 'far', 'near')
            if max(c.key.get('gap_sigma', {'': 0.0}).values()) >= 1.5]
    clear_twos = [c for c in twos if c.gap >= 1.0]
    listed = [c for c in singles if c.gap >= 0.3]
    return [
        share_row('right single name', clear, right, 0.95),
        share_row('– of them with the 60 s protocol', rich, right, 0.95),
        share_row('right family', clear, family, 0.98),
        share_row('truth in the reported set (gap ≥ 0.3 σ)', listed,
                  lambda c: is_in_set(c.answer, c.key), 0.97),
        _mean_set(listed),
        share_row('wrong name, all cases', cases, one_wrong, most=0.015),
        share_row('false alarm per null record', nulls,
                  lambda c: is_false_alarm(c.answer), most=0.015),
        share_row('– of them hard', kind('hard_null'),
                  lambda c: is_false_alarm(c.answer), most=0.015),
        share_row('out of library, far: abstains or states a remainder',
                  [c for c in kind('far') if c.gap >= 1.0],
                  lambda c: abstains(c.answer, c.key), 0.95),
        share_row('out of library, near-family', [c for c in kind('near') if c.gap >= 1.0],
                  lambda c: abstains(c.answer, c.key), 0.80),
        share_row('parameter error reported as a parameter', wrong, right, 0.95),
        share_row('ambiguous: the set and a right next experiment', ambiguous,
                  lambda c: c.answer.verdict == 'ambiguous' and set(c.key['rivals']) <= set(
                      c.answer.reported) and suggests_rightly(c.answer, c.key), 0.95),
        share_row('– right single name after running it', ambiguous,
                  lambda c: c.after is not None and is_right(c.after, c.key), 0.95),
        share_row('right subsystem', clear, place, 0.99),
        share_row('first row of `where` names the right subsystem', clear, first_place, 0.98),
        share_row('gap of 1.5 σ or more answered `no_gap`', seen,
                  lambda c: c.answer.verdict == 'no_gap', most=0.0),
        share_row('two effects, both right', clear_twos, right, 0.85),
        share_row('– no third name', clear_twos, lambda c: len(c.answer.claimed) <= 2, 0.97),
        *_numbers([c for c in clear + wrong + clear_twos if right(c)]),
        *_shrinks([c for c in cases if c.answer.verdict in ('effects', 'partial')]),
        _time('time per record, one effect or none', [c for c in cases if c not in twos], 10.0),
        _time('time per record, two effects', twos, 45.0)]


def _mean_set(cases):
    sizes = [len(c.answer.reported) for c in cases if c.answer.reported]
    if not sizes:
        return Row('– mean size of the set', 'no cases', '≤ 1.5', None)
    return Row('– mean size of the set', f'{np.mean(sizes):.2f}', '≤ 1.5',
               bool(np.mean(sizes) <= 1.5))


def _numbers(cases):
    errors, covered = [], []
    for case in cases:
        for true, value, interval, name in quantities(case.answer, case.key):
            errors.append(abs(value - true) / abs(true))
            if interval and None not in interval:
                covered.append((interval[0] <= true <= interval[1], case.key['name'], name))
    rows = [Row('equivalent quantity, median error', 'no cases', '≤ 5 %', None),
            Row('95 % intervals that cover the truth', 'no cases', '88–98 %', None)]
    if errors:
        rows[0] = Row(rows[0].measure, f'{100 * np.median(errors):.1f} % (n = {len(errors)}, '
                      f'90th pct {100 * np.quantile(errors, 0.9):.0f} %)', '≤ 5 %',
                      bool(np.median(errors) <= 0.05))
    if covered:
        hits = sum(c[0] for c in covered)
        low, high = wilson(hits, len(covered))
        rows[1] = Row(rows[1].measure, f'{100 * hits / len(covered):.1f} % ({hits}/{len(covered)};'
                      f' {100 * low:.0f}–{100 * high:.0f})', '88–98 %',
                      0.88 <= hits / len(covered) <= 0.98,
                      tuple(f'{name} {what}' for hit, name, what in covered if not hit))
    return rows


def _shrinks(cases):
    found = {c.key['name']: shrink_percent(c.answer) for c in cases}
    shrinks = [s for s, _ in found.values() if s is not None]
    row = Row('certify gap shrinks (noise removed, other protocol)', 'no cases',
              'median ≥ 85 %', None)
    if shrinks:
        row = Row(row.measure, f'median {np.median(shrinks):.1f} % (n = {len(shrinks)})', row.bar,
                  bool(np.median(shrinks) >= 85.0))
    return [row, share_row('– worse than before', cases,
                           lambda c: found[c.key['name']][1], most=0.01)]


def _time(measure, cases, bar_s):
    times = [c.answer.raw.get('runtime_s') or c.wall_s for c in cases]
    if not times:
        return Row(measure, 'no cases', f'≤ {bar_s:g} s', None)
    work = np.median([c.processor_s for c in cases])
    return Row(measure, f'median {np.median(times):.1f} s, 95th pct {np.quantile(times, 0.95):.1f}'
               f' s, longest {max(times):.1f} s; processor {work:.1f} s', f'≤ {bar_s:g} s',
               bool(np.quantile(times, 0.95) <= bar_s))
