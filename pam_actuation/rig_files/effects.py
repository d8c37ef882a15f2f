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


"""Effects in a rig file: what was said of them, and the data of a pair of valves."""

from collections.abc import Mapping
import textwrap

from pam_actuation.rig_files.numbers import Stated
from pam_sim.effects.effect import Effect
from pam_sim.effects.registry import get_effect
from pam_sim.effects.setting import forms_of
from pam_sim.rig import Rig
from pam_sim.tolerance import prior_sd

WIDTH = 96
SWITCHING = 'valve_dead_zone'
OF_A_PAIR = (SWITCHING, 'valve_dead_time', 'vent_asymmetry', 'supply_droop')
HEAD = """\
Data of the valves. Opening and closing times matter most, then the dead time: the driver of
the valves reads both from here. Times that are not stated are 0 for model and driver. Here
`ratio_minus_1` is the conductance of the fill valve over that of the vent valve, less 1. The
reservoir is the tank before the fill valve. To state an effect, remove the `# ` of its lines
and of `effects:`; the numbers there are the nominal ones of the effects."""


def effect_lines(said: Mapping[str, Stated], valve: str) -> list[str]:
    """
    Return the entry ``effects`` of a rig file.

    Parameters
    ----------
    said : mapping
        ``EFFECT.PARAMETER`` -> Stated, what is known of numbers of effects.
    valve : str
        A pair of valves (``hsv``) gets its usual data as comments where nobody stated them.

    Returns
    -------
    list of str
        None where nothing was said of any effect of a regulator.

    """
    names = list(dict.fromkeys(name.partition('.')[0] for name in said))
    lines = []
    if valve == 'hsv':
        forms = [get_effect(name).variant_of for name in names]
        names = list(dict.fromkeys([*(n for n in OF_A_PAIR if n not in forms), *names]))
        lines += [f'# {row}' for row in HEAD.splitlines()]
    if names:
        lines.append('effects:' if said else '# effects:')
    for name in names:
        effect = get_effect(name)
        stated = {p.name: said[f'{name}.{p.name}'] for p in effect.parameters
                  if f'{name}.{p.name}' in said}
        lines += _entry(effect, stated, valve, '# ' if not stated else '')
    return ['', *lines] if lines else []


def _entry(effect: Effect, stated: Mapping[str, Stated], valve: str, sign: str) -> list[str]:
    """Return the lines of one effect, behind a sign that makes comments of them or none."""
    lines = [f'  # {row}' for row in textwrap.wrap(
        effect.sentence_for({n: one.value or 0.0 for n, one in stated.items()}), WIDTH - 2)]
    lines += [f'  {sign}- name: {effect.name}', f'  {sign}  parameters:']
    of_others = {free.name for free in effect.fitting.free if valve not in free.valves}
    known = {}
    for p in effect.parameters:
        said = stated.get(p.name)
        if said is None and p.name in of_others:
            continue
        value = p.default if said is None or said.value is None else said.value
        mark = '# ' if said is None and not sign else ''
        start = f'  {sign}    {mark}{p.name}: {float(value)!r}'
        lines.append(f'{start:40}  # {p.allowed}. {p.description}')
        if said is not None and said.tolerance:
            known[p.name] = float(f'{prior_sd(p, value, said.tolerance):.6g}')
    if known:
        sds = ', '.join(f'{name}: {sd!r}' for name, sd in known.items())
        lines += ['    # One standard deviation, kept for readers; no fit uses it.',
                  f'    source: {{sd: {{{sds}}}}}']
    return lines


def unstated_valve_data(rig: Rig) -> list[str]:
    """Return a remark where a pair of valves has no opening and closing times, else nothing."""
    if rig.valve != 'hsv' or forms_of(rig.effects, SWITCHING):
        return []
    return ['opening and closing times of the valves are not stated, so model and driver take '
            f'them as 0: state them with --known {SWITCHING}.open_time_s=0.0035 '
            f'{SWITCHING}.close_time_s=0.0025, or in the file under `effects`']
