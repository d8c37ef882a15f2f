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
"""A proposed term as an effect file: the equation written out, and the model with it."""

from collections.abc import Mapping, Sequence
import re

from pam_sim.effects.fitting import OTHER_CHANGE
from pam_sim.effects.registry import effects
from pam_sim.effects.unnamed import terms
from pam_sim.gap.propose.hooks import (
    BOTH, COMMIT, function_text, hook_text, HOOKS, READS, RETURNS)
from pam_sim.gap.propose.library import Factor, StandIn, Term
from pam_sim.gap.propose.words import equation_of, range_texts
from pam_sim.valve import VALVES

NAME = 'proposed_effect'
_LICENCE = '"""\nA term without a name, proposed by `pam gap`; its form was found from data.\n'
_UNIT_ENDS = {'N': '_n', 'Pa': '_pa', 'm': '_m', 'm/s': '_m_per_s', 's': '_s', '-': '',
              'kg/s': '_kg_per_s'}


class EffectText:
    """
    The text of an effect file for some terms of one stand-in.

    Parameters
    ----------
    stand_in : StandIn
    found : list of Term
    values : dict
        Amplitudes and shapes, by the names of the stand-in.
    ranges : dict of str -> (float, float)
        Of every input, by symbol.
    explained : float
        Share of the squared gap of the proof that it removes.
    name : str, optional
        Of the effect; by default one that is free.

    """

    def __init__(self, stand_in: StandIn, found: Sequence[Term], values: Mapping[str, float],
                 ranges: Mapping[str, tuple[float, float]], explained: float,
                 name: str = '') -> None:
        self._stand_in, self._terms, self._values = stand_in, tuple(found), values
        self.name = name or free_name()
        used = {i for term in found for i, f in ((term.one.of, term.one),
                                                 (term.two.of, term.two))
                if f.kind != terms.ONE}
        self.inputs = [one for i, one in enumerate(stand_in.inputs) if i in used]
        self.ranges = {one.symbol: ranges[one.symbol] for one in self.inputs}
        self.equation = equation_of(stand_in, found, values)
        self._explained = explained
        self._remember = [k for k, term in enumerate(found, 1) if term.one.kind in terms.REMEMBER]
        self.parameters = self._parameters()

    def text(self) -> str:
        """Return the Python source."""
        body = ''.join(f'\n\n{one}' for one in self._functions())
        used = {name for name in ('followed', 'held', 'relaxed', 'stop', 'swung')
                if re.search(rf'\b{name}\(', body)}
        imports = ['from pam_sim.compiled import compiled',
                   'from pam_sim.effects.effect import Effect'
                   + (', Numbers' if self._remember else ''),
                   'from pam_sim.effects.fitting import Fitting, FreeParameter']
        if used:
            imports.append(f'from pam_sim.effects.unnamed.terms import {", ".join(sorted(used))}')
        imports.append('from pam_sim.parameters import Parameter')
        if self._has_state:
            imports.append('from pam_sim.records import record')
        if 'P_ATM_PA' in body or (self._remember and 'P_ATM_PA' in self._initial()):
            imports.append('from pam_sim.units import P_ATM_PA')
        standard = ['import math'] if 'math.' in body else []
        if self._remember:
            standard = ['from collections.abc import Mapping', *standard, 'from typing import Any']
        head = '\n'.join([*standard, *([''] if standard else []), 'import numpy as np', *imports])
        return f'{self._docstring()}\n{head}\n{self._initial()}\n\n{self._declared()}{body}'

    @property
    def _has_state(self) -> bool:
        return bool(self._remember) or self._stand_in.effect == 'flow_term'

    @property
    def _steps(self) -> bool:
        """Return whether a memory needs the physics step, which its hook is not told."""
        return self._stand_in.effect == 'set_point_term' and any(
            self._terms[k - 1].one.kind in (terms.PASSING, terms.SWING) for k in self._remember)

    def _docstring(self) -> str:
        rows = [
            f'    {self.equation}', '',
            f'It removed {100 * self._explained:.0f} % of the squared gap of the data of the '
            'proof. It holds for',
            *(f'    {part}' for part in range_texts(self.ranges, self.inputs) or ['every state']),
            'Outside of this range its inputs are held at the edge, so it is bounded.', '',
            'Give it a name and a source of its own, and it is an effect like the others.']
        return _LICENCE + '\n' + '\n'.join(rows) + '\n"""\n'

    def _parameters(self) -> dict[str, tuple[str, float, str]]:
        """Return name -> (unit, value, name of the stand-in's own parameter)."""
        found = {}
        for k, term in enumerate(self._terms, 1):
            end = _UNIT_ENDS[term.channel.unit]
            for own, label in (('first', 'size'), ('second', 'cosine')):
                if own == 'first' or term.one.kind in terms.PAIRED:
                    size = self._values[f'{own}_of_{k}'] or 1e-6 * term.channel.trial
                    found[f'{label}_{k}{end}'] = (
                        term.channel.unit, size * term.channel.factor, f'{own}_of_{k}')
            if term.one.is_shaped:
                unit = 's' if term.one.kind in (terms.PASSING, terms.SWING) else (
                    self._stand_in.inputs[term.one.of].unit)
                found[f'shape_{k}{_UNIT_ENDS[unit]}'] = (
                    unit, self._values[f'shape_1_of_{k}'], f'shape_1_of_{k}')
        return found

    def values(self) -> dict[str, float]:
        """Return the parameters of the effect, by name."""
        return {name: value for name, (_, value, _) in self.parameters.items()}

    def _declared(self) -> str:
        rows = ['EFFECT = Effect(', f'    name={self.name!r},', "    family='unnamed',",
                f'    subsystem={self._stand_in.subsystem!r},',
                "    sentence='A term without a name, its form found from data.',",
                "    source='Found from data by `pam gap`.',",
                f'    equation={self.equation!r},  # noqa: E501', '    parameters=(']
        free = []
        for name, (unit, value, own) in self.parameters.items():
            least, most = (0.2 * value, 5.0 * value) if name.startswith('shape') else (
                -20.0 * abs(value), 20.0 * abs(value))
            if self._terms[int(own.rpartition('_')[2]) - 1].channel.least >= 0.0:
                least = max(least, 0.0)         # a level of friction, a damping
            rows.append(f'        Parameter({name!r}, {unit!r}, {value:.6g}, {least:.3g}, '
                        f"{most:.3g}, description='Found from data.'),")
            free.append(f'        FreeParameter({name!r}, {abs(value):.6g}, {least:.3g}, '
                        f'{most:.3g}' + (', True),' if name.startswith('shape') else '),'))
        sizes = ', '.join(repr(n) for n in self.parameters if not n.startswith('shape'))
        rows += ['    ),', f'    amplitude=({sizes},),']
        if self._has_state:
            states = [f'memory_{k}' for k in self._remember]
            if self._stand_in.effect == 'flow_term':
                states = ['filling', 'venting', *states]
            rows.append(f'    states=record({", ".join(map(repr, states))}),')
        if self._remember:
            rows.append('    initial=_initial,')
        if self._steps:
            names = ', '.join(map(repr, self.parameters))
            rows += [f"    packed=record({names}, 'step_s'),", '    pack=_pack,']
        if self._stand_in.valves != VALVES:
            rows.append(f'    valves={self._stand_in.valves!r},')
        signal = (f", sensor_signal='{self._stand_in.signal}', sensor_change={OTHER_CHANGE!r}"
                  if self._stand_in.signal else '')
        rows += ['    order=90,', '    fitting=Fitting(free=(', *free, f'    ){signal}),', ')', '']
        return '\n'.join(rows)

    def _initial(self) -> str:
        if not self._remember:
            return ''
        start = {'p': 'numbers.pressure_pa - P_ATM_PA', 's': 'numbers.pressure_pa - P_ATM_PA',
                 'x': 'numbers.contraction_m', 'F': 'numbers.force_n'}
        rows = ['', '', 'def _initial(values: Mapping[str, float], numbers: Numbers) -> '
                'dict[str, Any]:']
        entries = []
        for k in self._remember:
            symbol = self._stand_in.inputs[self._terms[k - 1].one.of].symbol
            low, high = self.ranges[symbol]
            at = start.get(symbol, '0.0')
            entries.append(f"        'memory_{k}': min(max({at}, {low:.6g}), {high:.6g}),")
        if self._steps:
            rows = ['', '', 'def _pack(values: Mapping[str, float], numbers: Numbers) -> '
                    'dict[str, Any]:', "    return {**values, 'step_s': numbers.substep_s}", *rows]
        return '\n'.join([*rows, '    return {', *entries, '    }'])

    def _swing(self) -> list[str]:
        """Return the hook of a regulator that swings."""
        size, shape = self.parameters
        rows = [f'state.memory_1 = swung(state.memory_1, set_point_pa - pressure_pa, par.step_s,'
                f'\n                           par.{shape}, par.{size})',
                'return pressure_pa + time_constant_s * state.memory_1, time_constant_s']
        return [hook_text('set_point', rows, RETURNS['set_point'], 'Return it with the term.')]

    def _functions(self) -> list[str]:
        if self._terms[0].one.kind == terms.SWING:
            return self._swing()
        effect, found = self._stand_in.effect, []
        by_hook: dict[str, list[int]] = {}
        for channel in dict.fromkeys(t.channel.number for t in self._terms):
            by_hook.setdefault(HOOKS[effect, channel][0], []).append(channel)
        commits = COMMIT.get(effect, 'commit') if self._remember else ''
        if effect == 'flow_term':
            found.append(function_text('flow_opening', [
                'state.filling = fill', 'state.venting = vent', 'return fill, vent'],
                ['fill', 'vent', 'state'], 'tuple[float, float]', 'Keep the openings.'))
        for hook, channels in by_hook.items():
            sums = [self._sum(channel, hook) for channel in sorted(channels)]
            pattern = BOTH[hook] if len(channels) > 1 else HOOKS[effect, channels[0]][1]
            rows = self._lines(hook, [f'return {pattern.format(*sums)}'], commits == hook)
            found.append(hook_text(
                hook, rows, RETURNS.get(hook, 'float'), 'Return it with the term.'))
        if commits == 'set_point' and 'set_point' not in by_hook or commits in (
                'commit', 'sensor_commit'):
            rows = self._lines(commits, [], True)
            found.append(hook_text(commits, rows, 'None', 'Advance what the term remembers.'))
        return found

    def _lines(self, hook: str, last: list[str], remembers: bool) -> list[str]:
        """Return the lines of a hook: inputs within their range, memories, what is returned."""
        rows = [*last]
        if remembers:
            step = {'sensor_commit': 'dt_s', 'set_point': 'par.step_s'}.get(hook, 'elapsed_s')
            ahead = []
            for k in self._remember:
                f = self._terms[k - 1].one
                symbol, memory = self._stand_in.inputs[f.of].symbol, f'state.memory_{k}'
                shape = f'par.{self._shape(k)}'
                ahead.append(
                    f'{memory} = followed({symbol.lower()}_, {memory}, {shape})'
                    if f.kind == terms.STOP else
                    f'{memory} = relaxed({memory}, {symbol.lower()}_, {step}, {shape})')
            rows = ahead + rows
        reads = []
        for one, source in zip(self._stand_in.inputs, READS[self._stand_in.effect]):
            if re.search(rf'\b{one.symbol.lower()}_(?![a-z0-9])', ' '.join(rows)):
                low, high = self.ranges[one.symbol]
                if hook == 'commit' and source == 'force_n':
                    source = 'plant.muscle_force_n'
                reads.append(f'{one.symbol.lower()}_ = held({source}, {low:.6g}, {high:.6g})')
        return reads + rows

    def _sum(self, channel: int, hook: str) -> str:
        parts = []
        for k, term in enumerate(self._terms, 1):
            if term.channel.number != channel:
                continue
            names = [n for n, (_, _, own) in self.parameters.items()
                     if own in (f'first_of_{k}', f'second_of_{k}')]
            second = '' if term.two.kind == terms.ONE else ' * ' + self._factor(term.two, k, hook)
            if term.one.kind == terms.SINE:
                symbol = self._stand_in.inputs[term.one.of].symbol.lower() + '_'
                angle = f'2.0 * math.pi * {symbol} / par.{self._shape(k)}'
                one = (f'(par.{names[0]} * math.sin({angle})\n        + par.{names[1]} * '
                       f'math.cos({angle}))')
            else:
                one = f'par.{names[0]}'
                if term.one.kind != terms.ONE:
                    one += ' * ' + self._factor(term.one, k, hook)
            parts.append(one + second)
        return '(' + '\n        + '.join(parts) + ')'

    def _shape(self, k: int) -> str:
        return next(n for n, (_, _, own) in self.parameters.items() if own == f'shape_1_of_{k}')

    def _factor(self, f: Factor, k: int, hook: str) -> str:
        one = self._stand_in.inputs[f.of]
        value, scale = f'{one.symbol.lower()}_', f'{one.scale:g}'
        q = f'({value} / {scale})' if one.scale != 1.0 else value
        shape = f'par.{self._shape(k)}' if f.is_shaped else f'{f.shape:g}'
        within = 'elapsed_s' if hook in ('muscle_force', 'load_force') else '0.0'
        return {
            terms.LINEAR: q, terms.SQUARE: f'{q} ** 2',
            terms.CUBE: f'{q} ** 3', terms.SIZE: f'abs{q}' if (
                one.scale != 1.0) else f'abs({q})',
            terms.SIGNED_SQUARE: f'{q} * abs({q})',
            terms.SIGN: f'math.tanh({value} / {shape})',
            terms.ABOVE: f'max({value} - {shape}, 0.0) / {scale}',
            terms.BELOW: f'max({shape} - {value}, 0.0) / {scale}',
            terms.FADE: f'math.exp(-abs({value}) / {shape})',
            terms.STOP: f'stop({value}, state.memory_{k}, {shape})',
            terms.PASSING: f'({value} - relaxed(state.memory_{k}, {value}, {within}, '
            f'{shape})) / {scale}'}[f.kind]


def free_name() -> str:
    """Return a name that no effect has, the plain one if it is free."""
    names, k = effects(), 1
    while (NAME if k == 1 else f'{NAME}_{k}') in names:
        k += 1
    return NAME if k == 1 else f'{NAME}_{k}'
