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
The places where an effect can act: the hooks of a step.

An effect file implements a hook as a compiled function of the hook's name. Of the arguments
declared here it takes those it names, in any order, and returns all that the hook ``returns``,
changed or not. Further arguments it may name:

* ``par``, the record of its packed parameters, ``par.stiffness_n_per_m``;
* ``state``, the record of its states, which it may change;
* ``plant``, the state of the rig itself, ``layout.STATE``.

Pressures are absolute Pa unless called gauge; ``dx_m`` is the travel since the start of the
physics step and ``elapsed_s`` the time since then. A memory can thus be evaluated inside a step
and advanced once, in ``commit``. A hook that advances something, and is called once a step,
returns its mean over that step. Half the step then gives the same motion within 1e-3 of its range.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pam_sim.compiled import is_compiled, named_arguments
from pam_sim.errors import InputError
from pam_sim.plugins import check_function
from pam_sim.valve import VALVES


@dataclass(frozen=True)
class Hook:
    """
    One place where effects can act.

    Parameters
    ----------
    sentence : str
        What the hook returns, or what it is for.
    returns : tuple of str
        Arguments it returns, changed or not.
    sees : tuple of str
        Further arguments.

    """

    sentence: str
    returns: tuple[str, ...] = ()
    sees: tuple[str, ...] = ()

    @property
    def arguments(self) -> tuple[str, ...]:
        """Return all arguments, those it returns first."""
        return self.returns + self.sees


OWN = 'state', 'par', 'plant'       # arguments any hook may name
_MOTION = 'contraction_m', 'velocity_m_per_s'
_STEP = 'dx_m', 'elapsed_s'
_READINGS = 'pressure_pa', 'contraction_m', 'force_n'
HOOKS = {
    'command': Hook(
        'The valve signal that arrives in this step; called once a step, may advance state.',
        ('signal_0', 'signal_1'), ('dt_s',)),
    'clock_shift': Hook(
        'By how much [s] the PWM clock of the switching valves is late.', ('shift_s',)),
    'set_point': Hook(
        'Set point [Pa] and time constant [s] of the PPR; called once a physics step, may '
        'advance state.', ('set_point_pa', 'time_constant_s'), ('pressure_pa', 'contraction_m')),
    'pressure_rate': Hook(
        'The pressure rate [Pa/s] behind the PPR; the volume is d(p V)/dp of the air.',
        ('rate_pa_per_s',), ('pressure_pa', 'contraction_m', 'volume_m3')),
    'opening': Hook(
        'Mean openings of the averaged HSV pair from its duties.',
        ('fill', 'vent'), ('period_s',)),
    'switch_times': Hook(
        'Opening and closing delay [s] of the switching HSV pair.', ('open_s', 'close_s')),
    'flow_opening': Hook(
        'Mean openings of either HSV pair over the physics step of ``step_s``; called once a '
        'physics step, may advance state.', ('fill', 'vent'), ('step_s',)),
    'supply': Hook('The supply pressure [Pa absolute].', ('supply_pa',)),
    'valve_flow': Hook(
        'Mass flows [kg/s] through the fill and the vent valve, HSV.',
        ('fill_kg_per_s', 'vent_kg_per_s'), ('pressure_pa', 'supply_pa')),
    'mass_flow': Hook(
        'The net air flow into the muscle [kg/s], HSV.',
        ('flow_kg_per_s',), ('pressure_pa', 'contraction_m', 'supply_pa')),
    'volume': Hook('The air volume [m^3].', ('volume_m3',), ('pressure_pa', 'contraction_m')),
    'air_rt': Hook(
        'R T [J/kg] of the air in the muscle ``elapsed_s`` into the physics step, HSV. Mass and '
        'pressure are those at the start of the step, the flows means over ``elapsed_s``, the '
        'volume that at its end. The last call of a step is the one that holds.',
        ('rt_j_per_kg',), ('mass_kg', 'inflow_kg_per_s', 'outflow_kg_per_s', 'pressure_pa',
                           'volume_m3', 'elapsed_s')),
    'map_input': Hook(
        'Gauge pressure [Pa] and strain [-] at which the force map is read.',
        ('gauge_pa', 'strain')),
    'map_output': Hook(
        'The static tension [N] of the force map, gain included.',
        ('tension_n',), ('pressure_pa', 'contraction_m')),
    'muscle_force': Hook(
        'The force the muscle transmits [N], dry friction excepted.',
        ('force_n',), ('pressure_pa', *_MOTION, *_STEP)),
    'muscle_friction': Hook(
        'The dry friction level inside the muscle [N], not negative.',
        ('level_n',), ('pressure_pa', *_MOTION)),
    'load_force': Hook(
        'The force of the load side against contraction [N]: weight, springs and F_ext.',
        ('force_n',), (*_MOTION, *_STEP)),
    'load_friction': Hook(
        'The dry friction level of the guide [N], not negative.', ('level_n',), _MOTION),
    'commit': Hook(
        'Advances the states of effects at the end of a physics step; arguments as of its end.',
        (), ('pressure_pa', *_MOTION, *_STEP)),
    'sensor_commit': Hook(
        'Advances the states of sensor effects at the end of a step.',
        (), (*_READINGS, 'dt_s')),
    'sensor': Hook(
        'What the sensors read: pressure [Pa absolute], contraction [m], force [N].', _READINGS),
}

# What the hooks of an effect change; ``commit`` serves the others.
SUBSYSTEM_OF = {
    **dict.fromkeys((
        'command', 'clock_shift', 'set_point', 'pressure_rate', 'opening', 'switch_times',
        'flow_opening', 'supply', 'valve_flow', 'mass_flow', 'volume', 'air_rt'), 'valve'),
    **dict.fromkeys(('map_input', 'map_output', 'muscle_force', 'muscle_friction'), 'muscle'),
    **dict.fromkeys(('load_force', 'load_friction'), 'load'),
    **dict.fromkeys(('sensor', 'sensor_commit'), 'sensor')}
# Those that are called behind one type of valve alone.
_VALVE_OF = {
    **dict.fromkeys(('set_point', 'pressure_rate'), 'ppr'),
    **dict.fromkeys((
        'clock_shift', 'opening', 'switch_times', 'flow_opening', 'valve_flow', 'mass_flow',
        'air_rt'), 'hsv')}


def valves_of(hooks: Iterable[str]) -> tuple[str, ...]:
    """Return the types of valve behind which a hook of an effect is called."""
    acting = [hook for hook in hooks if hook in SUBSYSTEM_OF]
    return tuple(valve for valve in VALVES if not acting or any(
        _VALVE_OF.get(hook, valve) == valve for hook in acting))


def check_subsystem(name: str, subsystem: str, hooks: Iterable[str], path: str | Path) -> None:
    """
    Refuse an effect none of whose hooks acts in its subsystem: a search would try it elsewhere.

    Parameters
    ----------
    name, subsystem : str
        Of the effect.
    hooks : iterable of str
        Names of its hooks.
    path : Path
        Its file.

    Raises
    ------
    InputError
        The sentence names the subsystem in which they act.

    """
    acting = [hook for hook in hooks if hook in SUBSYSTEM_OF]
    if acting and all(SUBSYSTEM_OF[hook] != subsystem for hook in acting):
        right = SUBSYSTEM_OF[acting[0]]
        raise InputError(
            f'effect `{name}` has the subsystem `{subsystem}`, but its hook `{acting[0]}` acts on '
            f"the {right}; write subsystem='{right}'", str(path))


def check_hook(name: str, function: Callable[..., Any], packed: np.dtype[Any],
               states: np.dtype[Any] | None, path: str | Path) -> None:
    """
    Refuse a function that is not compiled, names arguments its hook has not, or has a mistake.

    Raises
    ------
    InputError
        The sentence says what the hook could name.

    """
    if not is_compiled(function):
        raise InputError(f'hook `{name}` is not compiled; write `@compiled` above `def {name}`, '
                         'from pam_sim.compiled', str(path))
    allowed = (*HOOKS[name].arguments, *(
        own for own in OWN if own != 'state' or states is not None))
    unknown = [one for one in named_arguments(function) if one not in allowed]
    if unknown and unknown[0] == 'state':
        raise InputError(f'hook `{name}` names `state`, which this effect has not; write '
                         "states=record('travel_m'), from pam_sim.records, into Effect(...), with "
                         'the names of what it remembers', str(path))
    if unknown:
        raise InputError(
            f'hook `{name}` names `{unknown[0]}`; write `def {name}({", ".join(allowed)})` with '
            'those of them it needs, and read the numbers by name, `par.'
            'stiffness_n_per_m`', str(path))
    check_function(f'hook `{name}`', function, HOOKS[name].returns, {
        'par': packed, **({} if states is None else {'state': states})}, path)
