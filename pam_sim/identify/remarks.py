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

"""What is said beside the numbers that were identified, a sentence each."""

from collections.abc import Collection, Sequence
import math

from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.health import LENGTH
from pam_sim.gap.subsystems.effects import subsystem_of_number
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.identify.numbers import Number
from pam_sim.identify.possible import counted_in
from pam_sim.identify.result import Found
from pam_sim.rig import Rig
from pam_sim.valve import hsv, ppr

ANOTHER_LAW = ('muscle and load leave a clear gap with the stated force law. If it was measured '
               'on another muscle, the numbers that act in the muscle are off by more than their '
               'intervals say. State it as unknown: pam rig new --unknown law')
OF_A_TABLE = ('muscle and load leave a clear gap with the stated table of forces. A table has no '
              'coefficients to find: {}let pam gap look for the effect that is missing, or '
              'measure the table of this muscle')
STRENGTH = 'state its strength as unknown (pam rig new --unknown force_map_gain), '
_OF_OTHER_VALVE = {'ppr': {p.name for p in hsv.PARAMETERS},
                   'hsv': {p.name for p in ppr.PARAMETERS}}
# (problem, signal, mean square in noise floors) of every signal.
Squares = list[tuple[SubsystemProblem, str, float]]


def remarks_on(rig: Rig, problems: Sequence[SubsystemProblem], wanted: Sequence[Number],
               found: Sequence[Found], left: Squares, at_rest: Collection[str]) -> list[str]:
    """
    Return what weakens the numbers, and what none of the recordings shows.

    Parameters
    ----------
    rig : pam_sim.Rig
        Whose numbers were looked for.
    problems : list of SubsystemProblem
        Of the recordings.
    wanted : list of Number
        What was looked for.
    found : list of Found
        What of it acts in the recordings.
    left : list of (SubsystemProblem, str, float)
        The signals that are not explained.
    at_rest : iterable of str
        Numbers that come from the holds alone.

    """
    acting = [one.number for one in found]
    unexplained = [one for one in found if one.number.name not in at_rest
                   and any(one.number.acts_in(p) for p, _, _ in left)]
    told = _starting_values(left, [one.number.name for one in unexplained if one.is_bent])
    told += _wider(left, [one.number.name for one in unexplained if not one.is_bent])
    told += [one.edge() for one in found if one.at_edge]
    told += of_another_law(rig, left)
    told += [f'{name}: from the holds, where the regulator has settled; no effect of '
             'the library explains its edges' for name in at_rest]
    told += [f'{name}: {effect.name} would look the same and counts in; {tells} tells them '
             'apart' for effect, name, tells in counted_in(problems, acting)]
    known = {n.name for n in acting}
    return told + [f'{n.name}: nothing in these recordings depends on it; {_what_shows(n, rig)}'
                   for n in wanted if n.name not in known]


def of_one_scale(acting: Sequence[Number]) -> list[str]:
    """Return a sentence where force law and load may grow together without a trace."""
    unknown = [n for n in acting if n.unknown]
    if not (any(n.of_law for n in unknown) and any(n.name == 'mass_kg' for n in unknown)):
        return []
    return ['force law and mass are unknown: a stronger muscle with a heavier load moves alike. '
            'State the mass, or record a force']


def _starting_values(left: Squares, names: Sequence[str]) -> list[str]:
    """Return a sentence on the numbers that what is missing has bent."""
    return [f'{", ".join(names)}: a starting value, which stays unknown in the rig file. No '
            f'effect of the library explains what is left of {_rests(left)}. pam gap fits it '
            'beside what is missing'] if names else []


def _wider(left: Squares, names: Sequence[str]) -> list[str]:
    """Return a sentence on the numbers whose signals are not quite explained."""
    return [f'{", ".join(names)}: no effect of the library explains what is left of '
            f'{_rests(left)}, and it may act alike; the interval allows for that'] if names else []


def _rests(left: Squares) -> str:
    """Return what is left of each signal, in noise floors."""
    return ' and '.join(f'{name} {math.sqrt(square):.1f} noise floors (rms)'
                        for _, name, square in left)


def of_another_law(rig: Rig, left: Squares) -> list[str]:
    """Return a sentence where the muscle leaves a clear gap and its force law is stated."""
    clear = any(p.subsystem == 'muscle' and square > CRITERIA.clear_rest for p, _, square in left)
    if not clear or rig.unknown_of_law:
        return []
    if rig.law_list:
        return [ANOTHER_LAW]
    return [OF_A_TABLE.format('' if 'force_map_gain' in rig.unknown else STRENGTH)]


def _what_shows(number: Number, rig: Rig) -> str:
    """Return what would show a number on which nothing depends, or why nothing can."""
    if number.name in _OF_OTHER_VALVE[rig.valve]:
        return ('it is a number of on/off valves, and this rig has a regulator'
                if rig.valve == 'ppr' else
                'it is a number of a regulator, and this rig has on/off valves')
    if number.name == 'force_zero_n':
        return 'record a force'
    if number.name == LENGTH:
        return ('the recorded contraction counts in its place, so state it as known, or leave the '
                'contraction out of the recording')
    if subsystem_of_number(number.name) == 'valve':
        return 'record a `valve_signal` or `pressure_command`'
    return 'record a contraction that moves'
