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
Force mode: the law tracks a force, with the contraction held or driven by something else.

One newton counts as 1/K metres, K a nominal stiffness of the muscle at constant
pressure, so that every setting and rule of the law keeps its meaning. The static inverse is
the pressure that gives the wanted force at the contraction the muscle will have when the
command arrives: measured, and carried on with its rate over the preview. A small wanted
force is no fault; a tendon that hangs loose where a force is wanted is, and freezes learning.
"""

import math

from numba import njit
import numpy as np
from pam_actuation.control import inputs as place
from pam_actuation.control.modes.force_surface import (
    fill_inverse, nominal_stiffness_n_per_m, surface_from_tree, surface_to_mapping,
    tabulate_force_surface)
from pam_actuation.control.modes.tracked import FORCE
from pam_actuation.control.modes.wrapped import blank_inverse, in_mode, WrappedLaw
from pam_sim.compiled import compiled, source_key
from pam_sim.errors import InputError

P_STIFFNESS = 0         # N/m
P_LEAD = 1              # s
P_PERIOD = 2            # s
P_FADING = 3            # what a measurement of one tick ago still counts in the filter
P_SLACK_FORCE = 4       # N
PARAMETER_COUNT = 5
S_KNOWN = 0             # 1 once a contraction was measured
S_CONTRACTION = 1       # m, filtered
S_RATE = 2              # m/s
S_AHEAD = 3             # m, for which the inverse is taken
STATE_COUNT = 4

_FILTER_S = 0.05        # memory of the filter of the contraction
_STALE_S = 0.1          # a longer gap between measurements restarts the rate
KEYS = ('stiffness_n_per_m', 'contraction_m', 'surface')


@compiled
def look_ahead(par, st, contraction_m, elapsed_s):
    """
    Take a contraction (NaN = none) into the state; return that of one preview ahead [m].

    Critically damped g-h filter: no lag at constant speed, little noise in the rate.
    """
    if not math.isfinite(elapsed_s):
        elapsed_s = par[P_PERIOD]
    if not math.isfinite(contraction_m):
        st[S_RATE] = 0.0
    elif st[S_KNOWN] < 0.5 or elapsed_s > _STALE_S:
        st[S_CONTRACTION] = contraction_m
        st[S_RATE] = 0.0
        st[S_KNOWN] = 1.0
    elif elapsed_s > 0.0:
        fading = par[P_FADING]
        st[S_CONTRACTION] += st[S_RATE] * elapsed_s
        residual = contraction_m - st[S_CONTRACTION]
        st[S_CONTRACTION] += (1.0 - fading * fading) * residual
        st[S_RATE] += (1.0 - fading) * (1.0 - fading) * residual / elapsed_s
    st[S_AHEAD] = st[S_CONTRACTION] + par[P_LEAD] * st[S_RATE]
    return st[S_AHEAD]


@compiled
def force_inputs(par, surface, st, raw, table, inp):
    """
    Turn the inputs of one tick in newtons into those of the law.

    Parameters
    ----------
    par, surface, st : float64[:]
        ``P_*``, the force surface, ``S_*``.
    raw : float64[:]
        ``inputs.IN_*`` with references in N and N/s and the measured contraction.
    table : float64[:]
        Static inverse of the law, written.
    inp : float64[:]
        Inputs of the law, written.

    """
    stiffness = par[P_STIFFNESS]
    ahead = look_ahead(par, st, raw[place.IN_CONTRACTION], raw[place.IN_ELAPSED])
    fill_inverse(surface, stiffness, ahead, table)
    for i in range(inp.shape[0]):
        inp[i] = raw[i]
    inp[place.IN_CONTRACTION] = raw[place.IN_FORCE] / stiffness
    inp[place.IN_REFERENCE] = raw[place.IN_REFERENCE] / stiffness
    inp[place.IN_REFERENCE_RATE] = raw[place.IN_REFERENCE_RATE] / stiffness
    inp[place.IN_LEAD_REFERENCE] = raw[place.IN_LEAD_REFERENCE] / stiffness
    inp[place.IN_LEAD_RATE] = raw[place.IN_LEAD_RATE] / stiffness
    if raw[place.IN_REFERENCE] < 2.0 * par[P_SLACK_FORCE]:
        inp[place.IN_FORCE] = math.nan


def _entry(key):
    """Return ``force_inputs`` as one unit of compiled code, stored under ``key``."""
    @njit(cache=True, error_model='numpy', nogil=True)
    def entry(par, surface, st, raw, table, inp):
        """Do as ``force_inputs``."""
        if key >= 0:      # always; makes the key part of what is stored
            force_inputs(par, surface, st, raw, table, inp)

    return entry


_force_inputs = _entry(source_key(force_inputs))


class ForceController(WrappedLaw):
    """
    A law that tracks a force.

    Parameters
    ----------
    law : SelfOrganizingFuzzyController or PidController
        Its static inverse has two entries and one per force of the surface; it is written
        anew in every tick.
    surface : numpy.ndarray
        Table of ``force_surface``.
    stiffness_n_per_m : float
        K: how many newtons count as one metre.
    contraction_m : float
        Assumed until one is measured.

    """

    tracked = FORCE

    def __init__(self, law, surface, stiffness_n_per_m, contraction_m=0.0):
        super().__init__(law)
        self.surface = np.ascontiguousarray(surface, dtype=float)
        self.stiffness_n_per_m = float(stiffness_n_per_m)
        self.contraction_m = float(contraction_m)
        self.state_names = (*law.state_names, 'force_error_n', 'contraction_ahead_m')
        self._par = np.zeros(PARAMETER_COUNT)
        self._par[P_STIFFNESS] = stiffness_n_per_m
        self._par[P_LEAD] = law.lead_s
        self._par[P_PERIOD] = 1.0 / law.rate_hz
        self._par[P_FADING] = math.exp(-1.0 / (law.rate_hz * _FILTER_S))
        self._par[P_SLACK_FORCE] = law.settings.get('slack_force_n', 0.0)
        self._st = np.zeros(STATE_COUNT)
        self._raw = np.zeros(place.INPUT_COUNT)
        self._inp = np.zeros(place.INPUT_COUNT)
        self._error_n = math.nan
        self._convert(np.zeros(place.INPUT_COUNT))      # compiled before time counts
        self.pause()

    @property
    def upper_force_n(self):
        """Largest force [N] of the surface."""
        return float(self.surface[0] * (self.surface[1] - 1.0))

    def _convert(self, raw):
        _force_inputs(
            self._par, self.surface, self._st, raw, self.law.static_inverse, self._inp)

    def step(self, x_m, ref_n, ref_rate_n_per_s, ref_lead_n, ref_lead_rate_n_per_s, learn=True,
             elapsed_s=math.nan, pressure_pa=math.nan, force_n=math.nan, held_back=0.0):
        """
        Run one tick; arguments as of the law, references in N and N/s.

        Parameters
        ----------
        x_m : float
            Measured contraction [m], NaN where not known: the last one counts.
        ref_n, ref_rate_n_per_s, ref_lead_n, ref_lead_rate_n_per_s : float
            Wanted force at the time of the measurement, and ``lead_s`` ahead of now.
        learn : bool
            Whether the rules may change.
        elapsed_s : float
            Time between the measurements of this and the former tick; NaN: one period.
        pressure_pa : float
            Measured absolute pressure [Pa]; NaN where not known.
        force_n : float
            Measured force [N].
        held_back : float
            0 while the driver follows the command, else a code of ``following``.

        Returns
        -------
        float
            Wanted muscle pressure, absolute Pa.

        """
        self._raw[:] = (x_m, ref_n, ref_rate_n_per_s, ref_lead_n, ref_lead_rate_n_per_s, 0.0,
                        elapsed_s, pressure_pa, force_n, held_back)
        self._convert(self._raw)
        inp = self._inp.tolist()
        self._error_n = ref_n - force_n
        return self.law.step(*inp[:place.IN_LEARN], learn, *inp[place.IN_LEARN + 1:])

    def compiled_arguments(self):
        """Return (par, surface, state) of ``force_inputs`` and the arguments of the law."""
        return (self._par, self.surface, self._st), self.law.compiled_arguments()

    def state_values(self):
        """Return the values of ``state_names`` of the last tick as a tuple of floats."""
        return (*self.law.state_values(), self._error_n, float(self._st[S_AHEAD]))

    def pause(self):
        """Forget the motion, keep the rules: the next tick starts bumplessly."""
        super().pause()
        self._st[:] = 0.0
        self._st[S_CONTRACTION] = self._st[S_AHEAD] = self.contraction_m
        self._error_n = math.nan


class ForceMode:
    """What a controller file says of force mode, and how a law is made to fit it."""

    tracked = FORCE

    def __init__(self, tree, rig):
        """
        Read the block ``force`` of a controller file; what it lacks comes from the rig.

        Raises
        ------
        InputError
            Unknown key, number out of range, or no rig and no surface.

        """
        if 'static_inverse' in tree:
            raise tree.error('force mode has no `static_inverse`, it has `force: surface`',
                             'static_inverse')
        if hasattr(rig, 'flexor'):
            raise InputError(
                f'`mode: force` needs a single muscle; {rig.name} is a joint', tree.where('mode'))
        block = tree.get('force', dict)
        own = None
        if block is not None:
            block.check_keys(KEYS)
            own = block.get('surface', dict)
        if rig is None and (own is None or 'stiffness_n_per_m' not in block):
            raise tree.error(
                'without a rig `force` must bring `stiffness_n_per_m` and `surface`', 'mode')
        self.surface = tabulate_force_surface(rig) if own is None else surface_from_tree(own)
        stiffness = contraction = None
        if block is not None:
            stiffness = block.get(
                'stiffness_n_per_m', float, None, lower=1.0, upper=1e7, unit='N/m')
            contraction = block.get('contraction_m', float, None, lower=0.0, upper=1.0, unit='m')
        self.stiffness_n_per_m = nominal_stiffness_n_per_m(rig) if stiffness is None else stiffness
        if contraction is None:
            contraction = 0.0 if rig is None else rig.parameters.get('contraction_m', 0.0)
        self.contraction_m = contraction

    def identity(self, rig_name):
        """Return what rules learned in this mode are tied to."""
        return in_mode(rig_name, f'force at {self.stiffness_n_per_m:.12g} N/m')

    def blank_inverse(self):
        """Return a table of the right size; every tick fills it."""
        return blank_inverse(int(self.surface[1]))

    def rule_scaling(self):
        """Return what turns the metres of the rules into newtons, as part of their scaling."""
        return {'tracked_unit': 'N', 'tracked_per_m': self.stiffness_n_per_m,
                'tracked_zero_m': 0.0}

    def wrap(self, law):
        """Return the law in this mode."""
        return ForceController(law, self.surface, self.stiffness_n_per_m, self.contraction_m)


def force_to_mapping(controller):
    """Return what ``ForceMode`` reads, as plain data."""
    return {'force': {
        'stiffness_n_per_m': controller.stiffness_n_per_m,
        'contraction_m': controller.contraction_m,
        'surface': surface_to_mapping(controller.surface)}}
