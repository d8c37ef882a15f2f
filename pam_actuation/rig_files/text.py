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

"""A described rig as a commented YAML file, and that file read back before it is written."""

import os
import textwrap
from typing import TYPE_CHECKING
import warnings

import numpy as np
from pam_actuation.rig_files.description import Description
from pam_actuation.rig_files.effects import effect_lines
from pam_sim.load import LOADS
from pam_sim.located_yaml import load_yaml
from pam_sim.model_file import load_rig
from pam_sim.muscle.law import ExtrapolationWarning
from pam_sim.muscle.muscle import DIMENSIONS, get_muscle, MUSCLE_PARAMETERS
from pam_sim.parameters import Parameter
from pam_sim.sensors import SENSOR_PARAMETERS, ZEROS
from pam_sim.tolerance import AbsoluteSd, Tolerance, UNKNOWN, WORD
from pam_sim.valve import hsv, ppr
from pam_sim.volume import VOLUMES

if TYPE_CHECKING:
    from pam_sim.rig import Rig

WIDTH = 96
END = next(one for one in DIMENSIONS if one.name == 'max_strain')
HEAD = """\
A rig: SI units, pressures absolute unless the name says gauge. A line that begins with `#`
before a name holds the nominal number; remove the `#` to state another.
`tolerance` says how well a number is known: 0 exactly, 0.1 to 10 %, {sd: 0.3} to 0.3 in its
unit, `unknown` anywhere in its range. `pam identify` finds those from recordings."""


def rig_file(described: Description, out: str) -> tuple[str, 'Rig']:
    """
    Return (text of the file, the rig it gives).

    Parameters
    ----------
    described : Description
        What was said; ``work_out`` was called.
    out : str
        Where the file will be, for paths in it and for messages.

    Raises
    ------
    InputError
        The file would not give a rig, or the rig cannot be simulated.

    """
    folder = os.path.dirname(os.path.abspath(out))
    text = _text(described, '' if described.force_map is None else os.path.relpath(
        described.force_map, folder))
    # The folder of the file may not exist yet: read the force map from where it is.
    read = _text(described, os.path.abspath(described.force_map)) if described.force_map else text
    rig = load_rig(load_yaml(read, name=out))
    signal = np.zeros((10, len(rig.signal_names)))
    moved = None if not LOADS[rig.load].NEEDS_CONTRACTION else np.zeros(11)
    with warnings.catch_warnings():
        # A measured force map may begin above the pressure of a vented muscle.
        warnings.simplefilter('ignore', ExtrapolationWarning)
        rig.simulate(signal[:, 0] if rig.valve == 'ppr' else signal, contraction_m=moved)
    return text, rig


def _text(described: Description, force_map: str) -> str:
    lines = _comment(HEAD, keep=True)
    lines += ['', *_muscle(described, force_map), '',
              f'# {VOLUMES[described.volume].SENTENCE}', f'volume: {described.volume}', '',
              f'# {LOADS[described.load].SENTENCE}',
              f'load: {described.load}', '',
              f'# {ppr.SENTENCE if described.valve == "ppr" else hsv.SENTENCE}',
              f'valve: {described.valve}', '', 'parameters:']
    tolerated = [f'  {name}: {WORD}' for name in described.unknown_law]
    valve = ppr.PARAMETERS if described.valve == 'ppr' else hsv.PARAMETERS
    for title, group in (('muscle', MUSCLE_PARAMETERS),
                         ('load', LOADS[described.load].PARAMETERS),
                         ('valve', valve), ('zeros of the sensors', ZEROS)):
        if group:
            lines.append(f'  # -- {title}')
        told = ''
        for parameter in group:
            note = described.notes.get(parameter.name, '')
            lines += _number(described, parameter, '' if note == told else note)
            told = note or told
            tolerated += _tolerance(described, parameter)
    lines += ['', 'tolerance:', *(tolerated or ['  # mass_kg: 0.02']), '', 'sensors:']
    for parameter in SENSOR_PARAMETERS:
        value = described.sensors.get(parameter.name)
        lines.append(_line(parameter, parameter.default if value is None else value,
                           value is None))
    lines += effect_lines(described.effects, described.valve)
    return '\n'.join(lines) + '\n'


def _muscle(described: Description, force_map: str) -> list[str]:
    assert described.muscle is not None
    lines = _comment(get_muscle(described.muscle).rests_on)
    data = described.muscle_data()
    if isinstance(data, str):
        lines.append(f'muscle: {data}')
    else:
        lines.append('muscle:')
        for key, value in data.items():
            lines += _comment(described.notes.get(key, ''), '  ')
            lines.append(f'  {key}: {repr(value) if isinstance(value, float) else value}')
        if END.name not in data:
            lines.append(_line(END, END.default, True))
    if force_map:
        lines += ['# Force map measured by `pam characterise`; the path counts from this file.',
                  *(row for text in described.force_map_unknown for row in _comment(text)),
                  'law:', '  name: lookup', f'  table: {_quoted(force_map)}']
    return lines


def _quoted(text: str) -> str:
    doubled = text.replace("'", "''")
    return f"'{doubled}'"


def _number(described: Description, parameter: Parameter, note: str) -> list[str]:
    said = described.numbers.get(parameter.name)
    value = parameter.default if said is None or said.value is None else said.value
    comment = _comment(note, '  ') if note else []
    return [*comment, _line(parameter, value, said is None)]


def _line(parameter: Parameter, value: float, nominal: bool) -> str:
    start = f'  {"# " if nominal else ""}{parameter.name}: {float(value)!r}'
    return f'{start:36}  # {parameter.allowed}. {parameter.description}'


def _tolerance(described: Description, parameter: Parameter) -> list[str]:
    said = described.numbers.get(parameter.name)
    if said is None or said.tolerance is None:
        return []
    return [f'  {parameter.name}: {_known(said.tolerance)}']


def _known(tolerance: Tolerance) -> str:
    if isinstance(tolerance, AbsoluteSd):
        return f'{{sd: {tolerance.sd!r}}}'
    return WORD if tolerance == UNKNOWN else repr(tolerance)


def _comment(text: str, indent: str = '', keep: bool = False) -> list[str]:
    rows = text.splitlines() if keep else textwrap.wrap(
        text, WIDTH - len(indent), break_long_words=False, break_on_hyphens=False)
    return [f'{indent}# {row}' for row in rows]
