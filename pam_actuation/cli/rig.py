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

"""``pam rig``: write a commented rig file; look at one."""

import argparse
import shlex
import sys
from typing import Any, TYPE_CHECKING

from pam_actuation.cli.common import (
    add_overwrite_option, check_outputs, emit, EXIT_DONE, read_line)
from pam_actuation.cli.completion import presets, REGULATOR
from pam_actuation.cli.options import number, out_path, Parser, source

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from pam_actuation.rig_files.description import Description
    from pam_sim.rig import Rig

HELP = """Write a commented rig file from options, or on a terminal from questions: pam rig new.

Every number is known, known to ± one standard deviation, or unknown. pam rig check loads a
file and says what it states."""
EXAMPLE = 'pam rig new --muscle dmsp_10_250 --unknown mass_kg --out my_rig.yaml'


def add_arguments(parser: Parser) -> None:
    """Declare the options of the verb."""
    parser.add_argument('action', choices=('new', 'check'),
                        help='new: write a file; check: load one and say what it states')
    parser.add_argument('file', type=source, nargs='?', default=None, metavar='NAME|FILE',
                        help='the rig or joint to check')
    parser.add_argument('--out', type=out_path, default='my_rig.yaml', metavar='FILE.yaml',
                        help='file to write (default: %(default)s)')
    parser.add_argument('--muscle', type=source, default=None, metavar='NAME',
                        help='a muscle by name; "pam models" lists them (default: dmsp_5_300, or '
                        'with --bore-mm the one of the nearest bore)')
    parser.add_argument('--length-mm', type=number(20.0, 9000.0, 'mm'), default=None,
                        metavar='MM', help='length of the muscle at rest')
    parser.add_argument('--bore-mm', type=number(1.0, 100.0, 'mm'), default=None, metavar='MM',
                        help='inner diameter at rest')
    parser.add_argument('--angle-deg', type=number(6.0, 51.0, 'degrees'), default=None,
                        metavar='DEG', help='angle between thread and axis at rest')
    parser.add_argument('--max-strain', type=number(0.05, 0.5), default=None, metavar='SHARE',
                        help='largest contraction, as a share of the length at rest (default: '
                        '0.25; with another --angle-deg what the braid allows; that of the force '
                        'map, if larger)')
    parser.add_argument('--force-map', type=source, default=None, metavar='FILE',
                        help='static table of the muscle, as "pam characterise" writes it, or '
                        'force over pressure and length as others measure it')
    parser.add_argument('--load', default='hanging_mass', metavar='NAME',
                        help='hanging_mass, isometric, driven or a load of your own '
                        '(default: %(default)s)')
    parser.add_argument('--volume', metavar='bore|law', default='bore',
                        help='inner volume of the muscle: a cylinder of its bore, or that of its '
                        'force law or table (default: %(default)s)')
    parser.add_argument('--valve', metavar='ppr|hsv', default='ppr',
                        help='regulator or pair of on/off valves (default: %(default)s)')
    parser.add_argument('--regulator', type=source, default=None, metavar='NAME',
                        help=f'a regulator by the name of its data sheet: '
                        f'{", ".join(presets(REGULATOR))}')
    parser.add_argument('--regulator-volts', type=source, default=None, metavar='LOW:HIGH',
                        help='range of its input, V; 4-20 mA through 500 ohm is 2:10')
    parser.add_argument('--regulator-kpa', type=source, default=None, metavar='LOW:HIGH',
                        help='gauge pressures at the ends of that range, kPa')
    parser.add_argument('--known', action='extend', nargs='+', default=[],
                        metavar='NAME=VALUE',
                        help='numbers, SI, that are exact; EFFECT.PARAMETER is one of an effect, '
                        'such as valve_dead_zone.open_time_s=0.0035; may be repeated')
    parser.add_argument('--about', action='extend', nargs='+', default=[],
                        metavar='NAME=VALUE±SD',
                        help='numbers with one standard deviation: mass_kg=1.2±0.3, 1.2±10%% or '
                        '1.2+-0.3; may be repeated')
    parser.add_argument('--unknown', action='extend', nargs='+', default=[],
                        metavar='NAME[=VALUE]',
                        help='numbers that may be anywhere in their range; with a value where the '
                        'search begins; law.NAME is a coefficient of the force law, law stands '
                        'for all on which its force depends; may be repeated')
    add_overwrite_option(parser, 'the file that is there')


def run(args: argparse.Namespace) -> int:
    """Write a rig file, or look at one."""
    from pam_sim.errors import InputError
    if args.action == 'check':
        if args.file is None:
            raise InputError('name the rig to look at: pam rig check my_rig.yaml')
        return _check(args)
    if args.file is not None:
        raise InputError(f'give the file to write with --out {args.file}', args.file)
    return _new(args)


def _new(args: argparse.Namespace) -> int:
    from pam_actuation.rig_files.force_map import describe_table
    from pam_actuation.rig_files.questions import ask_description
    from pam_actuation.rig_files.stated import numbers, numbers_text
    from pam_actuation.rig_files.text import rig_file
    from pam_sim.errors import InputError
    from pam_sim.files import write_text
    if not args.out.endswith(('.yaml', '.yml')):
        raise InputError('a rig file ends in .yaml', f'--out {args.out}')
    check_outputs(args, args.out)
    described = _described(args)
    if _nothing_said(args) and not args.json and sys.stdin.isatty() and sys.stdout.isatty():
        described = ask_description(read_line, print)
    with _force_map(args, described) as (table, remarks):
        if table is not None:
            describe_table(described, table)
        described.work_out()
        text, rig = rig_file(described, args.out)
        write_text(args.out, text)
    remarks = list(dict.fromkeys([
        *remarks, *_mass_not_stated(rig, described), *_remarks(rig, args.out)]))
    following = _following(rig, args.out)
    lines = [f'rig file: {args.out}', *numbers_text(rig), *_law_text(rig),
             *remarks, f'next: {following}']
    emit(args, {'file': args.out, **numbers(rig), 'remarks': remarks, 'next': following},
         '\n'.join(lines))
    return EXIT_DONE


def _force_map(args: argparse.Namespace, described: 'Description'
               ) -> 'AbstractContextManager[tuple[str | None, list[str]]]':
    """Return the context of (table of the force map or None, what a reader should know)."""
    from contextlib import nullcontext
    from pam_actuation.rig_files.force_map import force_map_of
    if args.force_map is None:
        return nullcontext((None, []))
    return force_map_of(args.force_map, described.dimensions, args.out, args.overwrite)


def _following(rig: 'Rig', out: str) -> str:
    """Return the command that comes next."""
    if rig.unknown:
        return f'pam identify RUN --rig {shlex.quote(out)}'
    return f'pam simulate pressure_identification --rig {shlex.quote(out)} --out runs/first'


def _nothing_said(args: argparse.Namespace) -> bool:
    said = (args.muscle, args.length_mm, args.bore_mm, args.angle_deg, args.max_strain,
            args.force_map, args.regulator, args.regulator_volts, args.regulator_kpa)
    return (all(one is None for one in said) and not (args.known or args.about or args.unknown)
            and args.load == 'hanging_mass' and args.valve == 'ppr' and args.volume == 'bore')


def _described(args: argparse.Namespace) -> 'Description':
    """Return what the options say."""
    import math
    from pam_actuation.rig_files.description import Description
    from pam_actuation.rig_files.numbers import read_range
    from pam_sim.load import LOADS
    from pam_sim.muscle.muscle import get_muscle
    from pam_sim.valve import VALVES
    from pam_sim.volume import VOLUMES
    found = Description(args.muscle, load=_one_of('--load', args.load, LOADS),
                        valve=_one_of('--valve', args.valve, VALVES), regulator=args.regulator,
                        volume=_one_of('--volume', args.volume, VOLUMES))
    if args.muscle is not None:
        get_muscle(args.muscle)
    for name, value, factor in (('length_m', args.length_mm, 1e-3), ('bore_m', args.bore_mm, 1e-3),
                                ('braid_angle_rad', args.angle_deg, math.pi / 180.0),
                                ('max_strain', args.max_strain, 1.0)):
        if value is not None:
            found.dimensions[name] = round(value * factor, 12)
    found.force_map = args.force_map
    if args.regulator_volts is not None:
        found.volts = read_range(args.regulator_volts, '--regulator-volts', 'V')
    if args.regulator_kpa is not None:
        low, high = read_range(args.regulator_kpa, '--regulator-kpa', 'kPa')
        found.gauge_pa = 1e3 * low, 1e3 * high
    _state_numbers(args, found)
    return found


def _state_numbers(args: argparse.Namespace, found: 'Description') -> None:
    from dataclasses import replace
    from pam_actuation.rig_files.numbers import FORMS, read_stated, split_statement, Stated
    from pam_sim.effects.registry import effect_parameter
    from pam_sim.errors import InputError
    from pam_sim.muscle.coefficients import ALL, PREFIX
    from pam_sim.sensors import SENSOR_PARAMETERS
    from pam_sim.tolerance import UNKNOWN
    known = {p.name: p for p in found.parameters}
    sensors = {p.name: p for p in SENSOR_PARAMETERS}
    for option, texts in (('--known', args.known), ('--about', args.about),
                          ('--unknown', args.unknown)):
        for text in texts:
            where = f'{option} {text}'
            if option == '--unknown' and (text == ALL or text.startswith(PREFIX)):
                found.unknown_law.append(text)
                continue
            names = {**known, **sensors} if option == '--known' else known
            named = text.partition('=')[0].strip()
            of_effect = '.' in named and not named.startswith(PREFIX)
            if of_effect:
                _, parameter = effect_parameter(named, where, where)
                names = {named: replace(parameter, name=named)}
                if option == '--unknown':
                    raise InputError(f'a file states no unknown number of an effect; pam identify '
                                     f'RUN --unknown {named} finds it', where)
            name, rest = split_statement(text, names, where)
            if name in found.numbers or name in found.sensors or name in found.effects:
                raise InputError(f'`{name}` is stated twice', where)
            if not rest and option != '--unknown':
                raise InputError(f'`{name}` has no value; allowed {names[name].allowed}', where)
            said = read_stated(rest, names[name], where) if rest else Stated()
            exact = said.tolerance == 0.0
            if (option == '--known') != exact and option != '--unknown' or (
                    option == '--unknown' and rest and not exact):
                wanted = {'--known': 'a number alone', '--about': 'a number with ±',
                          '--unknown': 'a number to begin with, or nothing'}[option]
                raise InputError(f'`{rest}` is not {wanted}; numbers are {FORMS}', where)
            if of_effect:
                found.effects[name] = said
                continue
            if name in sensors:
                assert said.value is not None
                found.sensors[name] = said.value
                continue
            found.numbers[name] = Stated(
                said.value, UNKNOWN if option == '--unknown' else said.tolerance)


def _one_of(option: str, value: str, allowed: Any) -> str:
    from pam_sim.errors import did_you_mean, InputError
    if value not in allowed:
        raise InputError(f'`{value}` is not known{did_you_mean(value, allowed)}; allowed: '
                         f'{", ".join(allowed)}', option)
    return value


def _remarks(rig: 'Rig', path: str = '') -> list[str]:
    """Return what a person should know of a rig; with what its file states for nothing."""
    from pam_actuation.drivers.for_rig import driver_remarks
    from pam_actuation.drivers.vented import left_remarks
    from pam_actuation.rig_files.effects import unstated_valve_data
    from pam_sim.idle import idle_remarks
    from pam_sim.muscle.muscle_remarks import muscle_remarks
    return [*muscle_remarks(rig.muscle, rig.parameters['force_map_gain']), *left_remarks(rig),
            *(idle_remarks(path, rig) if path else ()), *unstated_valve_data(rig),
            *driver_remarks(rig), *_zeros_known_relatively(rig)]


def _mass_not_stated(rig: 'Rig', described: 'Description') -> list[str]:
    """Return a sentence where the mass of the load is that of the nominal rig."""
    name = 'mass_kg'
    if name not in rig.parameters or name in described.numbers:
        return []
    value = rig.parameters[name]
    return [f'Nobody stated `{name}`, so the {value:g} kg of the nominal rig count as known to '
            f'{100.0 * rig.prior_sd(name) / value:.2g} %. State it with --known or --about, or '
            f'add --unknown {name}.']


def _zeros_known_relatively(rig: 'Rig') -> list[str]:
    """Return a sentence on each number that is 0 and known relatively, by the file."""
    from pam_sim.tolerance import relative_to_zero
    found = [relative_to_zero(p, rig.number(p.name), rig.tolerance[p.name])
             for p in rig.number_list
             if p.name in rig.tolerance and rig.tolerance[p.name] != p.tolerance]
    return [f'{text}.' for text in found if text]


def _check(args: argparse.Namespace) -> int:
    from pam_actuation.rig_files.by_size import nominal_beside_size
    from pam_actuation.rig_files.stated import stated, stated_text
    from pam_sim.idle import idle_remarks
    from pam_sim.joint import JointRig, load_rig_or_joint
    rig = load_rig_or_joint(args.file)
    if isinstance(rig, JointRig):
        remarks = [f'{place.rstrip("/")}: {text}' for place, muscle in rig.muscles.items()
                   for text in (*nominal_beside_size(muscle), *_remarks(muscle))]
        remarks += idle_remarks(args.file, rig)
    else:
        remarks = [*nominal_beside_size(rig), *_remarks(rig, args.file)]
    emit(args, {**stated(rig), 'remarks': remarks},
         '\n'.join([*stated_text(rig), *(f'remark: {text}' for text in remarks)]))
    return EXIT_DONE


def _law_text(rig: 'Rig') -> list[str]:
    """Return a line on a force law that is taken as exact beside unknown numbers."""
    if rig.unknown_of_law or not (rig.unknown and rig.law_list):
        return []
    return ['  force law: its shape is exact, that of another muscle; with --unknown law it is '
            'found as well']
