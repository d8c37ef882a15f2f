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

"""
Make the kernel: one module from the step template and the effect registry.

The module is written to a cache folder under the hash of everything that goes
into it, and compiled there once per machine; a changed or added effect gives
another hash, hence another module. ``PAM_CACHE_DIR`` moves the folder.
"""

import hashlib
import importlib.util
import inspect
import os
from pathlib import Path
import sys
import tempfile

import numba
from pam_sim.effects import registry
from pam_sim.muscle.registry import law_files, laws
from pam_sim.rollout import hooks as hook_functions, layout
from pam_sim.rollout.hooks import HOOKS

_PACKAGE = Path(__file__).parent.parent
_MARK = '# --- kernel'
_FAST_LAW = 'sarosi'        # of the nominal rig: no call is left of it

_HEAD = '''"""Generated from the effect registry; do not edit."""

import math

from numba import njit
import numpy as np
from pam_sim.compiled import compiled, inlined
from pam_sim.effects.registry import effects
from pam_sim.load.hanging_mass import acceleration
from pam_sim.muscle.geometry import volume_m3
from pam_sim.muscle.registry import laws
from pam_sim.rollout.layout import *
from pam_sim.rollout.step_template import step_body as nominal_step_body
from pam_sim.valve.flow import mass_flow_kg_per_s
from pam_sim.valve.hsv import clip_duty, open_time_in, pulse_edges
from pam_sim.valve.ppr import set_point_pa

_EFFECTS = effects()
_LAWS = laws()
'''

_TAIL = '''

@njit(cache=True, error_model='numpy', nogil=True, _nrt=False)
def step(state, par, inp, out):
    """Advance ``state`` by one step and fill ``out`` (see pam_sim.rollout.layout)."""
    if par[PAR_BEYOND_NOMINAL] > 0.0:
        step_body(state, par, inp, 0, out, 0)
    else:
        nominal_step_body(state, par, inp, 0, out, 0)


@njit(cache=True, error_model='numpy', nogil=True, _nrt=False)
def look(state, par, inp, out):
    """Fill ``out`` from ``state`` without a step."""
    look_body(state, par, inp, 0, out, 0)


@njit(cache=True, error_model='numpy', nogil=True, _nrt=False)
def settle(state, par):
    """Make the dependent states agree with pressure and contraction before the first step."""
    p = state[S_PRESSURE]
    x = state[S_CONTRACTION]
    state[S_AIR_MASS] = p * air_volume(p, x, state, par) * par[PAR_INVERSE_RT]
    state[S_SUPPLY] = apply_supply(par[PAR_SUPPLY], state, par)
    state[S_MUSCLE_FORCE] = muscle_force(
        map_tension(p, x, state, par), p, x, state[S_VELOCITY], 0.0, 0.0, state, par)


@njit(cache=True, error_model='numpy', nogil=True, _nrt=False)
def rest_contraction(p, state, par):
    """Return the contraction [m] at which a free load rests at a pressure [Pa], by bisection."""
    low = 0.0
    high = par[PAR_MAX_CONTRACTION]
    if map_tension(p, low, state, par) <= load_force(low, 0.0, 0.0, 0.0, 0.0, state, par):
        return low
    if map_tension(p, high, state, par) >= load_force(high, 0.0, 0.0, 0.0, 0.0, state, par):
        return high
    for _ in range(52):
        x = 0.5 * (low + high)
        if map_tension(p, x, state, par) > load_force(x, 0.0, 0.0, 0.0, 0.0, state, par):
            low = x
        else:
            high = x
    return low


@njit(cache=True, error_model='numpy', nogil=True, _nrt=False)
def driven_tension(state, par):
    """Return the static tension [N] of the present state: the force map and what changes it."""
    return map_tension(state[S_PRESSURE], state[S_CONTRACTION], state, par)


@njit(cache=True, error_model='numpy', nogil=True, _nrt=False)
def driven_force(tension, velocity, state, par):
    """Return (force without dry friction, its level) [N] of the present state at a velocity."""
    p = state[S_PRESSURE]
    x = state[S_CONTRACTION]
    return (muscle_force(tension, p, x, velocity, 0.0, 0.0, state, par),
            apply_muscle_friction(0.0, p, x, velocity, state, par))


@njit(cache=True, error_model='numpy', nogil=True)
def rollout(state, par, inputs, outputs):
    """
    Step through ``inputs`` (N, INP_SIZE); ``outputs`` is (N + 1, OUT_SIZE), row 0 the start.

    Both contiguous.
    """
    # One working row of each: slices would be reference counted in every step.
    inp = np.empty(INP_SIZE)
    out = np.empty(OUT_SIZE)
    for j in range(INP_SIZE):
        inp[j] = inputs[0, j]
    look(state, par, inp, out)
    outputs[0, :] = out
    if par[PAR_BEYOND_NOMINAL] == 0.0:
        # In line and without the working rows: call and copies cost an eighth of the step.
        flat_in = inputs.reshape(inputs.size)
        flat_out = outputs.reshape(outputs.size)
        for i in range(inputs.shape[0]):
            nominal_step_body(
                state, par, flat_in, i * INP_SIZE, flat_out, (i + 1) * OUT_SIZE)
        return
    for i in range(inputs.shape[0]):
        for j in range(INP_SIZE):
            inp[j] = inputs[i, j]
        step(state, par, inp, out)
        for j in range(OUT_SIZE):
            outputs[i + 1, j] = out[j]
'''


def hook_flag(hook):
    """Return the place in ``par`` that is 1 when any active effect uses a hook."""
    return layout.PAR_BASE + list(HOOKS).index(hook)


def effect_layout():
    """Return ({name: (k, i)}, par size, state size): where each effect's numbers stand."""
    k, i = layout.PAR_BASE + len(HOOKS), layout.STATE_BASE
    places = {}
    for name, effect in registry.effects().items():
        places[name] = (k + 1, i)
        k += 1 + effect.slots
        i += effect.states
    return places, k, i


def law_codes():
    """Return {law name: number in ``par[PAR_LAW]``} of the laws a rig can use, 0 the fast one."""
    usable = [name for name, law in laws().items() if law.COMPILED is not None]
    return {name: float(code) for code, name in enumerate(
        sorted(usable, key=lambda name: (name != _FAST_LAW, name)))}


def _law_dispatchers():
    _, k, _ = effect_layout()
    lines, others, dampers = [], [], []
    for name, code in law_codes().items():
        lines.append(f'_law_{name} = _LAWS[{name!r}].COMPILED')
        if name != _FAST_LAW:
            others += [f'    if law == {code}:',
                       f'        return _law_{name}(gauge, strain, par, {k})']
        if laws()[name].COMPILED_DAMPER is not None:
            lines.append(f'_damper_{name} = _LAWS[{name!r}].COMPILED_DAMPER')
            dampers += [f'    if law == {code}:',
                        f'        return _damper_{name}(v, gauge, strain, par, {k})']
    for header, decorator, body in (
            ('_other_law(gauge, strain, par)', '@compiled',
             ['    law = par[PAR_LAW]', *others, '    return 0.0']),
            ('law_tension(gauge, strain, par)', '@inlined',
             ['    if par[PAR_LAW] == 0.0:',
              f'        return _law_{_FAST_LAW}(gauge, strain, par, {k})',
              '    return _other_law(gauge, strain, par)']),
            ('law_damper(v, gauge, strain, par)', '@compiled',
             ['    law = par[PAR_LAW]', *dampers, '    return 0.0'])):
        lines += ['', '', decorator, f'def {header}:', *body]
    return lines


def _dispatchers():
    places, _, _ = effect_layout()
    # Flags are 0 or 1; `> 0.0` is one branch, `!= 0.0` two, as it must tell NaN.
    lines = []
    for name, effect in registry.effects().items():
        for hook in effect.hooks:
            lines.append(f'_{name}_{hook} = _EFFECTS[{name!r}].hooks[{hook!r}]')
    for hook, returned in HOOKS.items():
        arguments = list(inspect.signature(
            getattr(hook_functions, f'apply_{hook}')).parameters)
        result = ', '.join(arguments[:returned])
        given = ', '.join(arguments)
        users = [(name, places[name]) for name, effect in registry.effects().items()
                 if hook in effect.hooks]
        if users:
            lines += ['', '', '@compiled', f'def _run_{hook}({given}):']
            for name, (k, i) in users:
                own = ', '.join(arguments[:-2] + ['state', str(i), 'par', str(k)])
                assign = f'{result} = ' if returned else ''
                lines += [f'    if par[{k - 1}] > 0.0:',
                          f'        {assign}_{name}_{hook}({own})']
            if returned:
                lines.append(f'    return {result}')
        # One flag for the whole hook: a rig without its effects pays one comparison.
        lines += ['', '', '@inlined', f'def apply_{hook}({given}):']
        if users:
            give_back = 'return ' if returned else ''
            lines += [f'    if par[{hook_flag(hook)}] > 0.0:',
                      f'        {give_back}_run_{hook}({given})']
        if returned or not users:
            lines.append(f'    return {result}' if returned else '    pass')
    for hook in ('pressure_rate', 'valve_flow', 'mass_flow', 'air_rt'):
        lines += ['', '', '@inlined', f'def {hook}_active(par):',
                  f'    return par[{hook_flag(hook)}] > 0.0']
    return '\n'.join(lines + _law_dispatchers()) + '\n'


def kernel_source():
    """Return the source text of the kernel module."""
    template = (Path(__file__).parent / 'step_template.py').read_text(encoding='utf-8')
    body = template[template.index(_MARK):].split('\n', 1)[1].rstrip('\n') + '\n'
    return _HEAD + _dispatchers() + body + _TAIL


def kernel_hash():
    """Return the hash of everything the compiled kernel depends on (12 hexadecimal digits)."""
    digest = hashlib.sha256()
    digest.update(f'{sys.version_info[:2]} {numba.__version__}'.encode())
    digest.update(kernel_source().encode())
    files = [_PACKAGE / 'compiled.py', _PACKAGE / 'units.py',
             _PACKAGE / 'rollout' / 'layout.py', _PACKAGE / 'rollout' / 'hooks.py']
    for folder in ('muscle', 'valve', 'load'):
        files += sorted((_PACKAGE / folder).glob('*.py'))
    for path in files + law_files() + registry.effect_files():
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def cache_folder():
    """Return the folder for generated modules, created; a temporary one if none can be had."""
    chosen = os.environ.get('PAM_CACHE_DIR')
    if not chosen:
        base = os.environ.get('XDG_CACHE_HOME') or os.path.join(os.path.expanduser('~'), '.cache')
        chosen = os.path.join(base, 'pam_actuation')
    for folder in (Path(chosen), Path(tempfile.gettempdir()) / f'pam_actuation_{os.getuid()}'):
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK):
                return folder
        except OSError:
            continue
    return Path(tempfile.mkdtemp(prefix='pam_actuation_'))


def load_cached_module(name, source, key):
    """
    Import ``source`` as a module from the cache folder, written once per ``key``.

    Code compiled with ``cache=True`` that calls the kernel belongs in such a
    module with ``kernel_hash()`` in its key: a compiled caller holds a copy of
    the kernel and would not notice a change of it.

    Parameters
    ----------
    name : str
        Module name without the key.
    source : str
        Python source.
    key : str
        Hash of all the module depends on.

    Returns
    -------
    module

    """
    full = f'{name}_{key}'
    if full in sys.modules:
        return sys.modules[full]
    path = cache_folder() / f'{full}.py'
    try:
        same = path.read_text(encoding='utf-8') == source
    except (OSError, UnicodeDecodeError):
        same = False
    if not same:
        # Several processes may be here at once: each writes its own file, the last rename wins.
        handle, temporary = tempfile.mkstemp(dir=path.parent, suffix='.tmp')
        with os.fdopen(handle, 'w', encoding='utf-8') as file:
            file.write(source)
        os.replace(temporary, path)
    spec = importlib.util.spec_from_file_location(full, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[full] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[full]
        raise
    return module


def load_kernel():
    """Return the kernel module with the functions of :mod:`pam_sim.rollout.kernel`."""
    return load_cached_module('pam_sim_kernel', kernel_source(), kernel_hash())
