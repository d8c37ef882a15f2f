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
Joint mode: the law tracks the angle of a joint that two muscles turn against each other.

The angle counts as the contraction it gives the flexor, x = x0 + r theta, so that every
setting and rule of the law keeps its meaning. What the law commands is the difference of
two pressures about a co-contraction, written as one pressure with the limits of one muscle
(``joint_statics``): its limits, and with them the anti-windup, are those of the real pair.
"""

import math

from numba import njit
import numpy as np
from pam_actuation.control import inputs as place
from pam_actuation.control.modes.joint_statics import (
    as_one, NODES, pair_of, tabulate_joint_inverse)
from pam_actuation.control.modes.tracked import JOINT
from pam_actuation.control.modes.wrapped import blank_inverse, in_mode, WrappedLaw
from pam_sim.compiled import compiled, source_key
from pam_sim.errors import InputError
from pam_sim.units import P_ATM_PA

P_RADIUS = 0            # m, of the flexor's pulley
P_ZERO = 1              # m, contraction of the flexor at angle 0
P_CO_CONTRACTION = 2    # Pa absolute
P_LOWEST = 3            # Pa absolute
P_HIGHEST = 4           # Pa absolute
P_REACH = 5             # Pa, change of the co-contraction per tick
PARAMETER_COUNT = 6
S_KNOWN = 0             # 1 after the first tick
S_CO_CONTRACTION = 1    # Pa absolute, on its way to the wanted one
STATE_COUNT = 2
FLEXOR, EXTENSOR = 0, 1         # places in pairs

CO_CONTRACTION_GAUGE_PA = 3e5
_CO_CONTRACTION_SLEW_PA_PER_S = 5e5
KEYS = ('flexor_radius_m', 'flexor_contraction_at_zero_m', 'co_contraction_gauge_pa')


@compiled
def joint_inputs(par, raw, pressures_pa, forces_n, inp):
    """
    Turn the inputs of one tick in radians into those of the law.

    Parameters
    ----------
    par : float64[:]
        ``P_*``.
    raw : float64[:]
        ``inputs.IN_*`` with the angle in place of the contraction, references in rad and rad/s.
    pressures_pa, forces_n : float64[:]
        Measured at flexor and extensor, NaN where not known.
    inp : float64[:]
        Inputs of the law, written.

    """
    radius, zero = par[P_RADIUS], par[P_ZERO]
    for i in range(inp.shape[0]):
        inp[i] = raw[i]
    inp[place.IN_CONTRACTION] = zero + radius * raw[place.IN_CONTRACTION]
    inp[place.IN_REFERENCE] = zero + radius * raw[place.IN_REFERENCE]
    inp[place.IN_REFERENCE_RATE] = radius * raw[place.IN_REFERENCE_RATE]
    inp[place.IN_LEAD_REFERENCE] = zero + radius * raw[place.IN_LEAD_REFERENCE]
    inp[place.IN_LEAD_RATE] = radius * raw[place.IN_LEAD_RATE]
    inp[place.IN_PRESSURE] = as_one(
        pressures_pa[FLEXOR], pressures_pa[EXTENSOR], par[P_LOWEST], par[P_HIGHEST])
    # The weaker muscle tells whether a tendon is slack; a force that is not known tells nothing.
    inp[place.IN_FORCE] = forces_n[FLEXOR]
    if not forces_n[EXTENSOR] >= forces_n[FLEXOR]:
        inp[place.IN_FORCE] = forces_n[EXTENSOR]


@compiled
def joint_outputs(par, st, u_pa, pressures_pa, commands_pa):
    """
    Write the commands of both muscles [absolute Pa] for what the law commands.

    The co-contraction begins where the muscles are and moves to the wanted one.
    """
    if st[S_KNOWN] < 0.5:
        st[S_KNOWN] = 1.0
        mean = 0.5 * (pressures_pa[FLEXOR] + pressures_pa[EXTENSOR])
        if not math.isfinite(mean):
            mean = par[P_LOWEST]
        st[S_CO_CONTRACTION] = min(max(mean, par[P_LOWEST]), par[P_HIGHEST])
    step = par[P_CO_CONTRACTION] - st[S_CO_CONTRACTION]
    st[S_CO_CONTRACTION] += min(max(step, -par[P_REACH]), par[P_REACH])
    commands_pa[FLEXOR], commands_pa[EXTENSOR] = pair_of(
        u_pa, st[S_CO_CONTRACTION], par[P_LOWEST], par[P_HIGHEST])


def _entries(key):
    """Return both functions as units of compiled code, stored under ``key``."""
    @njit(cache=True, error_model='numpy', nogil=True)
    def inputs(par, raw, pressures_pa, forces_n, inp):
        """Do as ``joint_inputs``."""
        if key >= 0:      # always; makes the key part of what is stored
            joint_inputs(par, raw, pressures_pa, forces_n, inp)

    @njit(cache=True, error_model='numpy', nogil=True)
    def outputs(par, st, u_pa, pressures_pa, commands_pa):
        """Do as ``joint_outputs``."""
        if key >= 0:
            joint_outputs(par, st, u_pa, pressures_pa, commands_pa)

    return inputs, outputs


_joint_inputs, _joint_outputs = _entries(source_key(joint_inputs, joint_outputs))


class JointController(WrappedLaw):
    """
    A law that tracks the angle of an antagonistic joint.

    Parameters
    ----------
    law : SelfOrganizingFuzzyController or PidController
        With the static inverse of ``joint_statics``; its pressure limits are those of both
        muscles.
    flexor_radius_m, flexor_contraction_at_zero_m : float
        Turn an angle into the contraction the law works in.
    co_contraction_gauge_pa : float
        Wanted mean pressure of both muscles: the stiffness of the joint grows with it.

    Raises
    ------
    InputError
        The co-contraction is outside the pressure limits of the law.

    """

    tracked = JOINT

    def __init__(self, law, flexor_radius_m, flexor_contraction_at_zero_m,
                 co_contraction_gauge_pa, where='co_contraction_gauge_pa'):
        super().__init__(law)
        self.flexor_radius_m = float(flexor_radius_m)
        self.flexor_contraction_at_zero_m = float(flexor_contraction_at_zero_m)
        self.co_contraction_gauge_pa = float(co_contraction_gauge_pa)
        lowest, highest = limits_gauge_pa(law.settings)
        if not lowest <= co_contraction_gauge_pa <= highest:
            raise InputError(
                f'co_contraction_gauge_pa = {co_contraction_gauge_pa:g} Pa is outside the '
                f'pressure limits {lowest:g}...{highest:g} Pa', where)
        self.state_names = (
            *law.state_names, 'angle_error_rad', 'co_contraction_pa', 'flexor_command_pa',
            'extensor_command_pa')
        self._par = np.array([
            flexor_radius_m, flexor_contraction_at_zero_m, P_ATM_PA + co_contraction_gauge_pa,
            P_ATM_PA + lowest, P_ATM_PA + highest,
            _CO_CONTRACTION_SLEW_PA_PER_S / law.rate_hz])
        self._st = np.zeros(STATE_COUNT)
        self._raw = np.zeros(place.INPUT_COUNT)
        self._inp = np.zeros(place.INPUT_COUNT)
        self._pressures = np.full(2, math.nan)
        self._forces = np.full(2, math.nan)
        self._commands = np.full(2, P_ATM_PA)
        self._error_rad = math.nan
        # Compiled before time counts.
        _joint_inputs(self._par, self._raw, self._pressures, self._forces, self._inp)
        _joint_outputs(self._par, self._st, P_ATM_PA, self._pressures, self._commands)
        self.pause()

    def step(self, angle_rad, ref_rad, ref_rate_rad_per_s, ref_lead_rad,
             ref_lead_rate_rad_per_s, learn=True, elapsed_s=math.nan,
             pressures_pa=(math.nan, math.nan), forces_n=(math.nan, math.nan),
             held_back=0.0):
        """
        Run one tick.

        Parameters
        ----------
        angle_rad : float
            Measured joint angle, flexion positive.
        ref_rad, ref_rate_rad_per_s, ref_lead_rad, ref_lead_rate_rad_per_s : float
            Wanted angle at the time of the measurement, and ``lead_s`` ahead of now.
        learn : bool
            Whether the rules may change.
        elapsed_s : float
            Time between the measurements of this and the former tick; NaN: one period.
        pressures_pa, forces_n : pair of float
            Measured at flexor and extensor, absolute Pa and N; NaN where not known. Used for
            the bumpless start and for freezing the learning only.
        held_back : float
            0 while both drivers follow their commands, else a code of ``following``.

        Returns
        -------
        tuple of float
            Wanted pressures of flexor and extensor, absolute Pa.

        """
        self._raw[:] = (angle_rad, ref_rad, ref_rate_rad_per_s, ref_lead_rad,
                        ref_lead_rate_rad_per_s, 0.0, elapsed_s, math.nan, math.nan, held_back)
        self._pressures[:] = pressures_pa
        self._forces[:] = forces_n
        _joint_inputs(self._par, self._raw, self._pressures, self._forces, self._inp)
        inp = self._inp.tolist()
        u_pa = self.law.step(*inp[:place.IN_LEARN], learn, *inp[place.IN_LEARN + 1:])
        _joint_outputs(self._par, self._st, u_pa, self._pressures, self._commands)
        self._error_rad = ref_rad - angle_rad
        return tuple(self._commands.tolist())

    def want_co_contraction(self, gauge_pa):
        """
        Ask for another mean pressure [Pa gauge]; it is approached at a limited rate.

        Kept within the pressure limits. The static inverse stays the one of the co-contraction
        the controller was made for: what that misses is left to rules and integral.
        """
        par = self._par
        self._par[P_CO_CONTRACTION] = min(
            max(P_ATM_PA + gauge_pa, par[P_LOWEST]), par[P_HIGHEST])

    @property
    def wanted_co_contraction_pa(self):
        """Mean pressure of both muscles asked for [Pa absolute]."""
        return float(self._par[P_CO_CONTRACTION])

    @property
    def co_contraction_reach_pa(self):
        """How far the co-contraction may move in one tick [Pa]."""
        return float(self._par[P_REACH])

    def stand_aside(self, commands_pa):
        """
        Take note of what another law commands in place of this one.

        ``commands_pa``: pressures of flexor and extensor, absolute Pa. The next tick starts
        bumplessly, and with their mean as co-contraction.
        """
        self.pause()
        self._commands[:] = commands_pa
        self._st[S_KNOWN] = 1.0
        self._st[S_CO_CONTRACTION] = self._commands.mean()

    def compiled_arguments(self):
        """Return (par, state) of this module's functions and the arguments of the law."""
        return (self._par, self._st), self.law.compiled_arguments()

    def state_values(self):
        """Return the values of ``state_names`` of the last tick as a tuple of floats."""
        return (*self.law.state_values(), self._error_rad, float(self._st[S_CO_CONTRACTION]),
                *self._commands.tolist())

    def pause(self):
        """Forget the motion, keep the rules: the next tick starts bumplessly."""
        super().pause()
        self._st[:] = 0.0
        self._commands[:] = P_ATM_PA
        self._error_rad = math.nan


def limits_gauge_pa(settings):
    """Return the lowest and highest gauge pressure [Pa] of a law's settings."""
    return settings['min_pressure_gauge_pa'], settings['max_pressure_gauge_pa']


class JointMode:
    """What a controller file says of joint mode, and how a law is made to fit it."""

    tracked = JOINT

    def __init__(self, tree, rig):
        """
        Read the block ``joint`` of a controller file; what it lacks comes from the joint.

        Raises
        ------
        InputError
            Unknown key, number out of range, or neither a joint nor the numbers of one.

        """
        block = tree.get('joint', dict)
        numbers = {} if rig is None else getattr(rig, 'parameters', {})
        if rig is not None and not hasattr(rig, 'flexor'):
            raise InputError(
                f'`mode: joint` needs a joint; {rig.name} is a single muscle', tree.where('mode'))
        given = {}
        if block is not None:
            block.check_keys(KEYS)
            given = {
                'flexor_radius_m': block.get(
                    'flexor_radius_m', float, None, lower=1e-3, upper=0.5, unit='m'),
                'flexor_contraction_at_zero_m': block.get(
                    'flexor_contraction_at_zero_m', float, None, lower=0.0, upper=1.0, unit='m'),
                'co_contraction_gauge_pa': block.get(
                    'co_contraction_gauge_pa', float, None, lower=0.0, upper=1e6, unit='Pa')}
        self.values = {}
        for key in KEYS:
            value = given.get(key)
            if value is None and key == 'co_contraction_gauge_pa':
                value = CO_CONTRACTION_GAUGE_PA
            value = numbers.get(key) if value is None else value
            if value is None:
                raise tree.error(f'without a joint the text must bring `{key}`', 'joint')
            self.values[key] = value
        self._where = tree.where('joint') if block is not None else tree.where('mode')
        self._joint = rig
        self._own_inverse = 'static_inverse' in tree

    def identity(self, rig_name):
        """Return what rules learned in this mode are tied to."""
        return in_mode(
            rig_name, f'joint at {self.values["co_contraction_gauge_pa"] * 1e-3:.12g} kPa')

    def blank_inverse(self):
        """Return a table of the right size; ``wrap`` fills it."""
        if self._joint is None:
            raise InputError('without a joint the text must bring its `static_inverse`',
                             self._where)
        return blank_inverse(NODES)

    def rule_scaling(self):
        """Return what turns the metres of the rules into radians, as part of their scaling."""
        return {'tracked_unit': 'rad', 'tracked_per_m': 1.0 / self.values['flexor_radius_m'],
                'tracked_zero_m': self.values['flexor_contraction_at_zero_m']}

    def wrap(self, law):
        """Return the law in this mode, with the static inverse of the joint if it had none."""
        controller = JointController(law, *(self.values[key] for key in KEYS), self._where)
        if not self._own_inverse:
            lowest, highest = limits_gauge_pa(law.settings)
            law.static_inverse[:] = tabulate_joint_inverse(
                self._joint, P_ATM_PA + controller.co_contraction_gauge_pa, P_ATM_PA + lowest,
                P_ATM_PA + highest)
        return controller


def joint_to_mapping(controller):
    """Return what ``JointMode`` reads, as plain data."""
    return {'joint': {key: getattr(controller, key) for key in KEYS}}
