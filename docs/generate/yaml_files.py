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

"""A page for each kind of YAML file, with every key, made from the declarations in the code."""

from collections.abc import Iterable
from pathlib import Path

from generate.command_line import BAR, plain
from pam_actuation.control import config, made_for
from pam_actuation.control.inverse_files import INVERSE_KEYS
from pam_actuation.control.laws import LAWS
from pam_actuation.control.lqi_files import MODEL_KEYS
from pam_actuation.control.modes import force, force_surface, joint as joint_mode
from pam_actuation.control.sofc.persistence import FILE_KEYS
from pam_actuation.drivers.config import DRIVER_PARAMETERS
from pam_actuation.experiments import experiment
from pam_actuation.experiments.chain import DOMAINS, FORCE
from pam_actuation.experiments.primitives.make import is_list, keys_of, PRIMITIVES, range_of
from pam_actuation.hardware.back_ends import SENSOR_INPUTS, VALVE_OUTPUTS
from pam_actuation.tables import mapping, units
from pam_actuation.tables.signals import ANGLES, SIGNALS
from pam_sim import model_file
from pam_sim.effects.registry import effects
from pam_sim.joint import model_file as joint_file, parameters as joint
from pam_sim.load import LOADS
from pam_sim.muscle import muscle
from pam_sim.muscle.coefficients import ALL, PREFIX
from pam_sim.muscle.registry import laws
from pam_sim.sensors import SENSOR_PARAMETERS, ZEROS
from pam_sim.tolerance import SD_KEYS
from pam_sim.units import allowed_range
from pam_sim.valve import hsv, ppr
from pam_sim.valve.regulator_presets import (
    get_regulator, KEYS as REGULATOR_KEYS, regulator_names)

_HEAD = ('key', 'holds', 'default', 'allowed', 'meaning')
_KINDS = {float: 'number', int: 'whole number', str: 'text', bool: 'true or false',
          dict: 'mapping', list: 'list'}
# A page that is kept in the repository as well, for readers without a build of the pages.
KEPT = 'reference/files/mapping.md'
_MADE = 'This page is made from the declarations in the code.'
INDEX = f"""# YAML files

{_MADE} All numbers are SI units; pressures are absolute where the key
does not say `gauge`. A mistake in a file is told in one sentence with file and line.

| file | says | read by |
|---|---|---|
| [rig](rig.md) | muscle, load, valve, effects, sensors | `--rig`, `--model`, `load_rig` |
| [joint](joint.md) | two muscles that turn a limb | `--rig`, `pam up knee`, `load_joint` |
| [controller](controller.md) | control law, settings, rules | `--controller`, `load_controller` |
| [experiment](experiment.md) | what is asked of the rig over time | `pam run`, `pam simulate` |
| [hardware](hardware.md) | parameters of driver and sensors | `--hardware`, launch files |
| [mapping](mapping.md) | columns of a foreign table, with their units | `pam import --mapping` |

```{{toctree}}
:hidden:

rig
joint
controller
experiment
hardware
mapping
```
"""


def pages():
    """Return the path below docs/ and the text of each page."""
    made = {'index': INDEX, 'rig': rig_page(), 'joint': joint_page(),
            'controller': controller_page(), 'experiment': experiment_page(),
            'hardware': hardware_page(), 'mapping': mapping_page()}
    return {f'reference/files/{name}.md': text for name, text in made.items()}


def rig_page():
    """Return the page on the file of a rig."""
    parts = [
        '# File of a rig', _MADE,
        'A rig file starts from a preset, or states muscle and load. `pam models` lists presets, '
        'muscles, laws, loads and effects.',
        _yaml('name: my_rig', 'rig: dmsp_5_300_hanging_mass', 'parameters: {mass_kg: 4.2}',
              'effects:', '  - {name: coulomb_friction, parameters: {force_n: 2.0}}'),
        '## Keys', keys(model_file.KEYS),
        '## `parameters`', 'Numbers of the muscle:', parameters(muscle.MUSCLE_PARAMETERS)]
    for name, load in LOADS.items():
        parts += [f'Numbers of the load `{name}`:', parameters(load.PARAMETERS)]
    for module in (ppr, hsv):
        parts += [f'Numbers of the valve `{module.NAME}`:', parameters(module.PARAMETERS)]
    parts += [
        'Zeros of the sensors:', parameters(ZEROS),
        '## `tolerance`', 'Where the tolerance of a number is a mapping:', keys(SD_KEYS),
        f'Coefficients of the force law are exact, unless their tolerance is stated: `{ALL}` for '
        'all on which the static force depends, or one of those of the law of the muscle:',
        _table(('key', 'law', 'meaning'), [
            (f'`{PREFIX}{p.name}`', f'`{law.NAME}`', plain(p.description))
            for law in laws().values() for p in law.PARAMETERS]),
        '## `muscle`', 'Where `muscle` is a mapping:', keys(muscle.KEYS),
        parameters(muscle.DIMENSIONS),
        '## `law`', 'Where `law` is a mapping:', keys(muscle.LAW_KEYS),
        'Where `table` is a mapping:', keys(muscle.TABLE_KEYS)]
    for law in laws().values():
        if law.PARAMETERS:
            parts += [f'`parameters` of the law `{law.NAME}`:', parameters(law.PARAMETERS)]
    parts += ['## `sensors`', parameters(SENSOR_PARAMETERS), '## `effects`',
              'Each entry of the list:', keys(model_file.EFFECT_KEYS)]
    for effect in effects().values():
        parts += [f'### `{effect.name}`', plain(effect.sentence), parameters(effect.parameters)]
    parts += [
        '## Regulators by name', '`pam rig new --regulator NAME` takes these numbers of data '
        'sheets. Each is a file in `pam_sim/valve/regulators`:', keys(REGULATOR_KEYS),
        _table(('name', 'sold as', 'Pa gauge', 'rests on'), [
            (f'`{one.name}`', plain(one.sold_as),
             f'{one.lowest_gauge_pa:g} to {one.highest_gauge_pa:g}', plain(one.rests_on))
            for one in map(get_regulator, regulator_names())])]
    return _joined(parts)


def joint_page():
    """Return the page on the file of a joint."""
    return _joined([
        '# File of a joint', _MADE,
        'A joint file starts from a preset, or states `load` and both sides. What the joint is: '
        '[The joint](../joint.md).',
        _yaml('name: my_knee', 'joint: knee_dmsp_20_300', 'parameters: {limb_mass_kg: 4.0}'),
        '## Keys', keys(joint_file.KEYS), '## `parameters`', parameters(joint.PARAMETERS)])


def controller_page():
    """Return the page on the file of a controller."""
    parts = [
        '# File of a controller', _MADE,
        'Modes and reactions: [Controllers](../controllers.md). `pam tune` writes such a file.',
        _yaml('controller: sofc', 'settings: {lead_s: 0.12}', 'rules: learned.json'),
        '## Keys', keys(config.KEYS)]
    for kind, law in LAWS.items():
        parts += [f'Only of `controller: {kind}`:', keys(law.keys)]
    for kind, law in LAWS.items():
        parts += [f'## `settings` of {kind}', parameters(law.settings)]
    for name, block in (
            ('force', force.KEYS), ('joint', joint_mode.KEYS), ('made_for', made_for.KEYS),
            ('static_inverse', INVERSE_KEYS), ('surface', force_surface.KEYS),
            ('model', MODEL_KEYS)):
        parts += [f'## `{name}`', keys(block)]
    parts += [
        '## Rule files', 'JSON text, named by `rules`. [Rules](../../guides/rules.md) shows what '
        'is in one.', keys(FILE_KEYS)]
    return _joined(parts)


def experiment_page():
    """Return the page on the file of an experiment."""
    parts = [
        '# File of an experiment', _MADE,
        'How to write and run one: [Experiments](../../guides/experiments.md).',
        _yaml('name: my_sine', 'segments:', '  - rest: {duration_s: 1.0}',
              '  - sine: {center_m: 0.01, amplitude_m: 0.005, frequency_hz: 0.25, cycles: 4}'),
        '## Keys', keys(experiment.KEYS), '## Domains',
        'A key marked * in the tables of primitives ends with the unit of the domain, such as '
        '`to_m`. Its value must lie in the range of the domain.',
        _table(('domain', 'ending', 'rest', 'allowed', 'fastest change per second'), [
            (f'`{one.name}`', f'`_{one.unit}`', f'{one.rest:g}',
             allowed_range(one.lower, one.upper), f'{one.fastest:g}')
            for one in (*DOMAINS.values(), FORCE)]),
        '## Primitives']
    for name, cls in PRIMITIVES.items():
        rows = []
        for key, field in keys_of(cls, 'm').items():
            quantity = field.name in cls.QUANTITIES
            lower, upper, unit = range_of(field)
            rows.append((
                f'`{field.name if quantity else key}`' + (r'\*' if quantity else ''),
                'a list of numbers' if is_list(field)
                else _KINDS[int if field.type is int else float],
                f'`{field.default}`' if isinstance(field.default, (int, float)) else 'required',
                'range of the domain' if quantity else f'{lower:g} to {upper:g} {unit}'.strip(),
                plain(field.metadata.get('meaning', ''))))
        remark = f'Only in the domains {", ".join(cls.DOMAINS)}.' if cls.DOMAINS else ''
        parts += [f'### `{name}`', _words(cls.__doc__), plain(remark), _table(_HEAD, rows)]
    return _joined(parts)


def mapping_page():
    """Return the page on a mapping file of ``pam import``."""
    return _joined([
        '# File of a mapping', _MADE,
        'What it is for: [Import and export tables](../../guides/tables.md). '
        '`pam import --save-mapping` writes one.',
        _yaml('time: {column: t_ms, unit: ms}', 'signals:',
              '  pressure: {column: p_bar, unit: bar_gauge}',
              '  contraction: {column: length, unit: mm, zero: 300.0, gain: -1.0}'),
        '## Keys', keys(mapping.KEYS), '## `time`', keys(mapping.TIME_KEYS),
        '## `signals`', 'The key of each entry is one of these:',
        _table(('signal', 'topic', 'units', 'meaning'), [
            (f'`{one.name}`', f'`{one.topic}`',
             ', '.join(f'`{unit}`' for unit in units.names_of(one.quantity)), one.meaning)
            for one in (*SIGNALS, *ANGLES)]),
        'A joint has the angles, and the signals of its muscles after `flexor/` and `extensor/`, '
        'such as `flexor/pressure`.',
        'Each entry holds:', keys(mapping.COLUMN_KEYS)])


def hardware_page():
    """Return the page on the file of hardware parameters."""
    parts = [
        '# File of hardware', _MADE,
        'Parameters of the nodes `valve_driver` and `hardware_sensors`, in the form of ROS 2. '
        'Any other parameter of these two nodes may stand here too: '
        '[`valve_driver`](../nodes/valve_driver.md), '
        '[`hardware_sensors`](../nodes/hardware_sensors.md). Bring-up: '
        '[Hardware](../../guides/hardware.md).',
        _yaml('/**/valve_driver:', '  ros__parameters:', '    backend: iio_dac',
              '    dac.device: mcp4725', '/**/hardware_sensors:', '  ros__parameters:',
              '    backend: iio_adc', '    adc.device: ads1115', '    pressure.channel: 0'),
        '## `valve_driver`', _table(_HEAD, [(
            '`backend`', 'text', '`sim`', ', '.join(VALVE_OUTPUTS),
            'What the valve hangs on.')])]
    for name, back_end in VALVE_OUTPUTS.items():
        if back_end.PARAMETERS:
            parts += [f'With `backend: {name}`:', parameters(back_end.PARAMETERS)]
    parts += ['Of the driver, with any back end:', parameters(DRIVER_PARAMETERS),
              '## `hardware_sensors`', _table(_HEAD, [(
                  '`backend`', 'text', '`iio_adc`', ', '.join(SENSOR_INPUTS),
                  'What the sensors hang on.')])]
    for name, back_end in SENSOR_INPUTS.items():
        if back_end.PARAMETERS:
            parts += [f'With `backend: {name}`:', parameters(back_end.PARAMETERS)]
    return _joined(parts)


def keys(declared):
    """Return the table of declared keys."""
    return _table(_HEAD, [
        (f'`{key.name}`', _KINDS[key.kind], _default(key), _allowed(key), _words(key.meaning))
        for key in declared])


def parameters(declared):
    """Return the table of declared Parameters."""
    rows = [(f'`{one.name}`', _unit(one.unit) if one.bounded else _KINDS[type(one.default)],
             _value(one.default), f'{one.lower:g} to {one.upper:g}' if one.bounded else '',
             plain(one.description)) for one in declared]
    return _table(('key', 'unit', 'default', 'allowed', 'meaning'), rows) if rows else (
        'It has none.')


def _value(default):
    """Return the default of a parameter as a file has it."""
    if default == '':
        return 'required'
    return f'`{default:g}`' if type(default) is float else f'`{default}`'.replace(
        'False', 'false')


def _default(key):
    if key.required:
        return 'required'
    if key.kind is bool:
        return f'`{str(key.default).lower()}`'
    return _words(key.otherwise) or (f'`{key.default}`' if key.default not in (None, '') else '')


def _allowed(key):
    if key.choices is not None:
        return ', '.join(f'`{choice}`' for choice in key.choices)
    if key.lower is None or key.upper is None:
        return ''
    return plain(allowed_range(key.lower, key.upper, key.unit, key.name))


def _words(text):
    """Return a text as Markdown: what stands between backquotes is code."""
    parts = ' '.join((text or '').replace('``', '`').split()).split('`')
    return '`'.join(part.replace(part.strip(), plain(part), 1) if part.strip() and k % 2 == 0
                    else part for k, part in enumerate(parts))


def _unit(unit):
    return plain(unit.strip('-')) or '–'


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]):
    lines = [head, *rows]
    cells = [' | '.join(cell.replace('|', BAR) if '`' in cell else cell for cell in line)
             for line in lines]
    return '\n'.join([f'| {cells[0]} |', '|---' * len(head) + '|',
                      *(f'| {line} |' for line in cells[1:])])


def _yaml(*lines):
    return '\n'.join(['```yaml', *lines, '```'])


def _joined(parts):
    return '\n\n'.join(part for part in parts if part) + '\n'


if __name__ == '__main__':      # in docs/: python -m generate.yaml_files
    Path(KEPT).parent.mkdir(exist_ok=True)
    Path(KEPT).write_text(pages()[KEPT], encoding='utf-8')
