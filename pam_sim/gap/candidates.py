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
What may be missing: formulations of effects with the parameters that are fitted.

Each effect of the registry is a candidate; formulations with ``variant_of`` carry the
name of that effect. The table below gives scale and range of what is fitted where an
amplitude times a number will not do. Ranges are narrower than those of a model file:
at its extremes one effect turns into another (a loop without width is Coulomb
friction), and a name would mean nothing.
"""

from dataclasses import dataclass
import itertools
import math

from pam_sim.effects.registry import effects, get_effect


@dataclass(frozen=True)
class Free:
    """
    A parameter of an effect that is fitted.

    Parameters
    ----------
    name : str
    scale : float
        Typical size; start of the screening.
    lower, upper : float
        Range that keeps the meaning of the effect.
    shape : bool
        Fitted on a logarithmic scale, from several starts.
    starts : tuple of float
        Values the screening tries; ``scale`` by default.
    ends : tuple of str
        Of ``lower`` and ``upper`` those at which a shape turns the effect into another one.

    """

    name: str
    scale: float
    lower: float
    upper: float
    shape: bool = False
    starts: tuple = ()
    ends: tuple = ('lower', 'upper')

    def value(self, coordinate):
        """Return the value of a normalised coordinate, kept within the range."""
        value = self.scale * (math.exp(min(coordinate, 50.0)) if self.shape else coordinate)
        return min(max(value, self.lower), self.upper)

    def coordinate(self, value):
        """Return the normalised coordinate of a value."""
        return math.log(value / self.scale) if self.shape else value / self.scale


@dataclass(frozen=True)
class Candidate:
    """
    One formulation with what is fitted of it.

    Parameters
    ----------
    effect : str
        Name in the registry.
    free : tuple of Free
    held : tuple of (str, float)
        Parameters set to a value that is not their nominal one.

    """

    effect: str
    free: tuple
    held: tuple = ()

    @property
    def name(self):
        """Name under which a result states this formulation."""
        return get_effect(self.effect).variant_of or self.effect

    @property
    def amplitudes(self):
        """Return the free parameters whose response is about proportional to their value."""
        return [f for f in self.free if not f.shape]

    def starts(self):
        """Return the parameter dicts that the screening tries."""
        grids = [f.starts or (f.scale,) for f in self.free]
        return [dict(zip((f.name for f in self.free), values))
                for values in itertools.product(*grids)]

    def typical_start(self):
        """Return the normalised coordinates of everything that is fitted at its typical size."""
        return tuple(f.coordinate(f.scale) for f in self.free)

    def setting(self, values):
        """Return the effect as an entry of a model file."""
        return {'name': self.effect, 'parameters': {**dict(self.held), **values}}


def _level_and(shape):
    return (Free('force_n', 1.0, 0.0, 50.0, starts=(1.0,)),
            Free('force_per_pa', 4e-6, 0.0, 2e-4, starts=(2e-6,)), shape)


# Bent by more, it is a loop.
_BENDING = (Free('presliding_m', 1e-5, 2e-6, 1e-4, True, ends=('upper',)),
            Free('static_excess', 0.05, 0.0, 0.6))
_HARDENING = Free('hardening_m', 0.1, 0.01, 1.0, True, ends=())
_RATES = (4e5, 1e6, 2.5e6)
# What comes this late in quick motion is not a multiple of what comes a little late.
_LATE_S = (0.01, 0.002)
_TABLE = {
    'valve_dead_time': (Free('delay_s', 0.01, 0.0, 0.3, starts=_LATE_S),),
    'tube_lag': (Free('time_constant_s', 0.01, 0.0, 0.5, starts=_LATE_S),),
    'tube_lag_two_stage': (Free('time_constant_s', 0.01, 0.0, 0.5),
                           Free('second_stage_share', 0.2, 0.02, 0.5, True, ends=())),
    'valve_hysteresis': (Free('half_width_pa', 2e3, 0.0, 5e4),),
    'flow_limit': (Free('fill_rate_at_400kpa_pa_per_s', 1e6, 5e4, 5e7, True, _RATES),
                   Free('vent_rate_at_400kpa_pa_per_s', 1e6, 5e4, 5e7, True, _RATES)),
    'vent_asymmetry': (Free('ratio_minus_1', 0.2, -0.4, 4.0),),
    'leakage': (Free('conductance_m3_per_s_pa', 2e-13, 0.0, 1e-10),),
    'leakage_slit': (Free('conductance_m3_per_s_pa', 2e-13, 0.0, 1e-10),
                     Free('slit_flow_at_400kpa_kg_per_s', 1e-7, 0.0, 1e-4)),
    # A compressor that starts once more or less makes other valleys of the misfit.
    'supply_droop': (Free('reservoir_volume_m3', 1e-3, 2e-5, 0.1, True,
                          (2e-4, 4e-4, 7e-4, 1.2e-3, 2.5e-3, 5e-3)),),
    'dead_volume': (Free('extra_volume_m3', 2e-6, 0.0, 1e-4),),
    'thermal': (Free('heat_exchange_time_s', 0.2, 0.01, 20.0, True, (0.05, 0.2, 1.0)),),
    'coulomb_friction': (Free('force_n', 1.0, 0.0, 50.0),),
    'coulomb_friction_presliding': (Free('force_n', 1.0, 0.0, 50.0), *_BENDING),
    'pressure_friction': (Free('force_at_400kpa_n', 1.0, 0.0, 100.0),),
    'pressure_friction_presliding': (Free('force_at_400kpa_n', 1.0, 0.0, 100.0), *_BENDING),
    'hysteresis': _level_and(Free('width_scale', 1.0, 0.35, 5.0, True, (0.5, 1.5))),
    'hysteresis_bouc_wen': _level_and(Free('width_m', 8e-4, 2e-4, 8e-3, True)),
    'hysteresis_lugre': _level_and(Free('stiffness_n_per_m', 2e3, 200.0, 1e4, True)),
    'hysteresis_prandtl_ishlinskii': (
        Free('half_width_pa', 2e3, 0.0, 5e4), Free('half_width_per_pa', 0.02, 0.0, 0.3)),
    'history_friction': _level_and(Free('width_m', 8e-4, 2e-4, 8e-3, True)),
    'braid_contact_friction': (Free('friction_coefficient', 0.3, 0.0, 2.0),),
    'viscous_damping': (Free('damping_n_s_per_m', 20.0, -200.0, 1000.0),),
    'viscous_damping_thinning': (Free('damping_n_s_per_m', 20.0, -200.0, 1000.0),
                                 Free('speed_m_per_s', 0.2, 0.02, 5.0, True, ends=())),
    # What is missing takes force; one that gives some would be an error of the force map.
    'threshold_pressure': (Free('pressure_pa', 10e3, 0.0, 2e5),),
    'bladder_stiffness': (Free('stiffness_n_per_m', 200.0, 0.0, 1e4),),
    'end_taper_growing': (
        Free('k_minus_1', 0.05, -0.3, 1.0), Free('k_per_strain', 0.2, -3.0, 3.0)),
    'bladder_stiffness_progressive': (
        Free('stiffness_n_per_m', 200.0, 0.0, 1e4), _HARDENING),
    'creep': (Free('stiffness_1_n_per_m', 50.0, 0.0, 5e3),
              Free('stiffness_2_n_per_m', 50.0, 0.0, 5e3),
              Free('time_constant_1_s', 1.0, 0.15, 4.0, True, ends=('lower',)),
              Free('time_constant_2_s', 10.0, 4.0, 100.0, True, ends=('upper',))),
    'thermal_softening': (Free('gain_loss_at_20mm_per_s', 0.02, -0.2, 0.5),
                          Free('time_constant_s', 60.0, 10.0, 600.0, True)),
    'guide_friction': (Free('force_n', 1.0, 0.0, 50.0),),
    'guide_friction_presliding': (Free('force_n', 1.0, 0.0, 50.0), *_BENDING),
    'parallel_spring_progressive': (Free('stiffness_n_per_m', 300.0, 0.0, 1e4), _HARDENING),
    'smooth_friction': _level_and(Free('speed_m_per_s', 1e-3, 2e-4, 0.02, True, ends=())),
    'pressure_lag': (Free('time_constant_s', 0.01, 0.0, 0.2, starts=_LATE_S),),
    'contraction_lag': (Free('time_constant_s', 0.01, 0.0, 0.2, starts=_LATE_S),),
}
# Their difference is added up by the valve, pulse by pulse; their sum is hardly seen.
_TRIED = (1e-3, 1e-4, 0.0)
_SWITCHING = (Free('open_time_s', 1e-3, 0.0, 9e-3, starts=_TRIED),
              Free('close_time_s', 1e-3, 0.0, 9e-3, starts=_TRIED))
_HSV = {'valve_dead_zone': _SWITCHING,
        'valve_dead_zone_gradual': (*_SWITCHING, Free('ramp_s', 5e-4, 0.0, 9e-3)),
        'valve_dead_zone_two_ramps': (
            *_SWITCHING, Free('rise_s', 1e-3, 0.0, 9e-3), Free('fall_s', 1e-3, 0.0, 9e-3))}
_OVERLAP = (Free('half_width_pa', 2e3, 0.0, 5e4),)
_PPR = {'valve_dead_zone': _OVERLAP, 'valve_dead_zone_gradual': _OVERLAP}
# Each contains another formulation of its name, adds a few per cent of its gap, and takes long.
REFINEMENTS = {'coulomb_friction_presliding', 'pressure_friction_presliding',
               'guide_friction_presliding', 'tube_lag_two_stage',
               'valve_dead_zone_two_ramps', 'end_taper_growing'}
# Left is a limit of right: where both explain the data, the simpler one is named.
LIMITS = {('coulomb_friction', 'hysteresis'), ('pressure_friction', 'hysteresis'),
          ('viscous_damping', 'creep'), ('bladder_stiffness', 'creep')}

NARROW_M = 1e-4              # bending of bristles; a loop below it is dry friction
AT_PA = 4e5                  # at this pressure


def is_narrow(candidate, values):
    """
    Return whether bristles slip after so short a way that they are dry friction.

    Their stiffness alone does not tell: a small force bends stiff ones as little as a large
    one bends stiffer ones.
    """
    if candidate.effect != 'hysteresis_lugre':
        return False
    force_n = values['force_n'] + AT_PA * values['force_per_pa']
    return force_n < NARROW_M * values['stiffness_n_per_m']


def candidates(rig, outputs, only=None):
    """
    Return the candidates that can show on a rig.

    Parameters
    ----------
    rig : pam_sim.Rig
        The model; an effect it already has is refitted, not added.
    outputs : tuple of str
        Signals that are compared.
    only : sequence of str, optional
        Names to try, canonical or of a formulation.

    Returns
    -------
    list of Candidate

    """
    table = {**_TABLE, **(_HSV if rig.valve == 'hsv' else _PPR)}
    found = []
    for name, effect in effects().items():
        free = table.get(name) or _plain(effect)
        candidate = Candidate(name, free)
        if effect.relative_of and name not in (only or ()):
            continue
        if rig.valve not in effect.valves or rig.effect(name) is not None:
            continue
        if only is not None and name not in only and candidate.name not in only:
            continue
        if effect.subsystem == 'load' and rig.load != 'hanging_mass':
            continue
        if effect.subsystem == 'sensor' and name.split('_')[0] not in outputs:
            continue
        found.append(candidate)
    return found


def relatives(rig, outputs, name):
    """Return what may be taken for a name on a rig, and is named only by who asks for it."""
    return candidates(rig, outputs, [
        effect.name for effect in effects().values() if name in effect.relative_of])


def split_refinements(pool):
    """
    Return (candidates to begin with, refinements of some of them).

    A refinement differs little from another formulation of its name and is tried after that;
    where the other is not in the pool, it is one to begin with.
    """
    names = {c.name for c in pool if c.effect not in REFINEMENTS}
    refined = [c for c in pool if c.effect in REFINEMENTS and c.name in names]
    return [c for c in pool if c not in refined], refined


def _plain(effect):
    """Return the amplitudes of an effect, each from its nominal size."""
    found = []
    for p in effect.parameters:
        if p.name in effect.amplitude:
            scale = abs(p.nominal) or 1e-3 * max(abs(p.lower), abs(p.upper))
            found.append(Free(p.name, scale, p.lower, p.upper))
    return tuple(found)
