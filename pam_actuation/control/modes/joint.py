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

The angle counts as the contraction it gives the flexor, x = x0 + r theta, so that every setting
and rule of the law keeps its meaning. The law commands the difference of two pressures about a
co-contraction, written as one pressure with the limits of one muscle (``joint_statics``). Its
limits, and thus the anti-windup, are those of the real pair.
"""

from collections.abc import Callable, Mapping, Sequence
import math

import numpy as np
from pam_actuation.control.compiled_controller import CompiledController
from pam_actuation.control.inputs import INPUT
from pam_actuation.control.modes.joint_statics import (
    as_one, NODES, pair_of, tabulate_joint_inverse)
from pam_actuation.control.modes.tracked import JOINT
from pam_actuation.control.modes.wrapped import blank_inverse, in_mode, WrappedLaw
from pam_actuation.control.settings import limits_within
from pam_actuation.control.static_inverse import inverse_to_mapping
from pam_sim.annotations import FloatArray
from pam_sim.compiled import allocating_entry_point, compiled, source_key
from pam_sim.errors import InputError
from pam_sim.joint.rig import JointRig
from pam_sim.keys import Key, names_of
from pam_sim.located_yaml import Located
from pam_sim.records import cells, part, record, size_of, values_of, zeros
from pam_sim.units import P_ATM_PA

# What a tick is given; NaN where a pressure or a force is not known.
JOINT_INPUT = record(
    'angle_rad',                      # measured, flexion positive
    'reference_rad',
    'reference_rate_rad_per_s',
    'lead_reference_rad',
    'lead_rate_rad_per_s',
    'learning',
    'elapsed_s',
    'held_back',
    'flexor_pressure_pa',
    'extensor_pressure_pa',
    'flexor_force_n',
    'extensor_force_n',
    'age_s',                          # of the angle: from its stamp to now
    'pressure_age_s',                 # of the pressures, their mean
)
PARAMETERS = record(
    'radius_m',                       # of the flexor's pulley
    'zero_m',                         # contraction of the flexor at angle 0
    'co_contraction_pa',              # wanted, absolute
    'lowest_pa',                      # absolute
    'highest_pa',                     # absolute
    'limit_pa',                       # absolute, at most that: of a driver
    'reach_pa',                       # change of the co-contraction per tick
)
STATE = record(
    'known',                          # 1 after the first tick
    'co_contraction_pa',              # absolute, on its way to the wanted one
)
COMMANDS = record('flexor_pa', 'extensor_pa')           # absolute
FLEXOR, EXTENSOR = 0, 1         # places in pairs

CO_CONTRACTION_GAUGE_PA = 3e5
_CO_CONTRACTION_SLEW_PA_PER_S = 5e5
KEYS = (
    Key('flexor_radius_m', float, "Pulley radius under the flexor's tendon.",
        otherwise='from the joint', unit='m', lower=1e-3, upper=0.5),
    Key('flexor_contraction_at_zero_m', float, 'Contraction of the flexor at angle 0.',
        otherwise='from the joint', unit='m', lower=0.0, upper=1.0),
    Key('co_contraction_gauge_pa', float, 'Mean pressure of both muscles; stiffness grows '
        'with it.', CO_CONTRACTION_GAUGE_PA, unit='Pa', lower=0.0, upper=1e6),
)
_NAMES = names_of(KEYS)


@compiled
def joint_inputs(par: FloatArray, raw: FloatArray, inp: FloatArray) -> None:
    """
    Turn the inputs of one tick in radians into those of the law.

    Parameters
    ----------
    par, raw : float64[:]
        Arrays of ``PARAMETERS`` and ``JOINT_INPUT``.
    inp : float64[:]
        Inputs of the law (``inputs.INPUT``), written.

    """
    _law_inputs(part(par, 0, PARAMETERS), part(raw, 0, JOINT_INPUT), part(inp, 0, INPUT))


@compiled
def _law_inputs(par: np.record, raw: np.record, inp: np.record) -> None:
    """Do as ``joint_inputs``, on records."""
    radius, zero = par.radius_m, par.zero_m
    inp.contraction_m = zero + radius * raw.angle_rad
    inp.reference_m = zero + radius * raw.reference_rad
    inp.reference_rate_m_per_s = radius * raw.reference_rate_rad_per_s
    inp.lead_reference_m = zero + radius * raw.lead_reference_rad
    inp.lead_rate_m_per_s = radius * raw.lead_rate_rad_per_s
    inp.learning = raw.learning
    inp.elapsed_s = raw.elapsed_s
    inp.held_back = raw.held_back
    inp.age_s = raw.age_s
    inp.pressure_age_s = raw.pressure_age_s
    inp.pressure_pa = as_one(
        raw.flexor_pressure_pa, raw.extensor_pressure_pa, par.lowest_pa, par.highest_pa)
    # The weaker muscle tells whether a tendon is slack; a force that is not known tells nothing.
    inp.force_n = raw.flexor_force_n
    if not raw.extensor_force_n >= raw.flexor_force_n:
        inp.force_n = raw.extensor_force_n


@compiled
def joint_outputs(par: FloatArray, st: FloatArray, u_pa: float, raw: FloatArray,
                  commands: FloatArray) -> None:
    """
    Write the commands of both muscles for what the law commands.

    The co-contraction begins where the muscles are and moves to the wanted one.

    Parameters
    ----------
    par, st, raw : float64[:]
        Arrays of ``PARAMETERS``, ``STATE``, written, and ``JOINT_INPUT``.
    u_pa : float
        Command of the law, absolute.
    commands : float64[:]
        Array of ``COMMANDS``, written.

    """
    _commands(part(par, 0, PARAMETERS), part(st, 0, STATE), u_pa, part(raw, 0, JOINT_INPUT),
              part(commands, 0, COMMANDS))


@compiled
def _commands(par: np.record, st: np.record, u_pa: float, raw: np.record,
              commands: np.record) -> None:
    """Do as ``joint_outputs``, on records."""
    if st.known < 0.5:
        st.known = 1.0
        mean = 0.5 * (raw.flexor_pressure_pa + raw.extensor_pressure_pa)
        if not math.isfinite(mean):
            mean = par.lowest_pa
        st.co_contraction_pa = min(max(mean, par.lowest_pa), par.highest_pa)
    step = par.co_contraction_pa - st.co_contraction_pa
    mean_pa: float = st.co_contraction_pa + min(max(step, -par.reach_pa), par.reach_pa)
    st.co_contraction_pa = mean_pa
    flexor_pa, extensor_pa = pair_of(
        u_pa, mean_pa, par.lowest_pa, par.highest_pa, par.limit_pa)
    commands.flexor_pa = flexor_pa
    commands.extensor_pa = extensor_pa


def _entries(key: int) -> tuple[Callable[..., None], Callable[..., None]]:
    """Return both functions as units of compiled code, stored under ``key``."""
    @allocating_entry_point
    def inputs(par: FloatArray, raw: FloatArray, inp: FloatArray) -> None:
        """Do as ``joint_inputs``."""
        if key >= 0:      # always; makes the key part of what is stored
            joint_inputs(par, raw, inp)

    @allocating_entry_point
    def outputs(par: FloatArray, st: FloatArray, u_pa: float, raw: FloatArray,
                commands: FloatArray) -> None:
        """Do as ``joint_outputs``."""
        if key >= 0:
            joint_outputs(par, st, u_pa, raw, commands)

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

    def __init__(self, law: CompiledController, flexor_radius_m: float,
                 flexor_contraction_at_zero_m: float, co_contraction_gauge_pa: float,
                 where: str = 'co_contraction_gauge_pa') -> None:
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
        self._par = values_of(PARAMETERS, {
            'radius_m': flexor_radius_m, 'zero_m': flexor_contraction_at_zero_m,
            'co_contraction_pa': P_ATM_PA + co_contraction_gauge_pa,
            'lowest_pa': P_ATM_PA + lowest, 'highest_pa': P_ATM_PA + highest,
            'limit_pa': P_ATM_PA + highest,
            'reach_pa': _CO_CONTRACTION_SLEW_PA_PER_S / law.rate_hz})
        self._st, self._raw = zeros(STATE), np.full(size_of(JOINT_INPUT), math.nan)
        self._commands = np.full(size_of(COMMANDS), P_ATM_PA)
        self._parameters, self._state = cells(self._par, PARAMETERS), cells(self._st, STATE)
        self._inputs = cells(self._raw, JOINT_INPUT)
        self._error_rad, self._begins = math.nan, True
        self._inputs.age_s[...] = self._inputs.pressure_age_s[...] = 0.0
        # Compiled before time counts.
        _joint_inputs(self._par, self._raw, np.zeros_like(law.input_array))
        _joint_outputs(self._par, self._st, P_ATM_PA, self._raw, self._commands)
        self.pause()

    def with_law(self, law: CompiledController) -> 'JointController':
        """Return a controller of the same joint and co-contraction round another law."""
        return JointController(law, self.flexor_radius_m, self.flexor_contraction_at_zero_m,
                               self.co_contraction_gauge_pa)

    def step(self, angle_rad: float, ref_rad: float, ref_rate_rad_per_s: float,
             ref_lead_rad: float, ref_lead_rate_rad_per_s: float, learn: bool = True,
             elapsed_s: float = math.nan, pressures_pa: Sequence[float] = (math.nan, math.nan),
             forces_n: Sequence[float] = (math.nan, math.nan),
             held_back: float = 0.0, ages_s: Sequence[float] = (0.0, 0.0)
             ) -> tuple[float, float]:
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
            the bumpless start, for freezing the learning, and by a model of the muscles. A start
            without them begins where the last commands were: after a pause, both muscles vented.
        held_back : float
            0 while both drivers follow their commands, else a code of ``following``.
        ages_s : pair of float
            Time since the angle was measured, and since the pressures were, their mean.

        Returns
        -------
        tuple of float
            Wanted pressures of flexor and extensor, absolute Pa.

        """
        raw = self._inputs
        raw.angle_rad[...] = angle_rad
        raw.reference_rad[...] = ref_rad
        raw.reference_rate_rad_per_s[...] = ref_rate_rad_per_s
        raw.lead_reference_rad[...] = ref_lead_rad
        raw.lead_rate_rad_per_s[...] = ref_lead_rate_rad_per_s
        raw.learning[...] = 1.0 if learn and not self.law.freeze_learning else 0.0
        raw.elapsed_s[...] = elapsed_s
        raw.held_back[...] = held_back
        raw.age_s[...], raw.pressure_age_s[...] = ages_s
        if self._begins and not all(map(math.isfinite, pressures_pa)):
            # At the atmosphere alone, a law would begin with one muscle full and one empty.
            pressures_pa = self._commands.tolist()
        self._begins = False
        raw.flexor_pressure_pa[...], raw.extensor_pressure_pa[...] = pressures_pa
        raw.flexor_force_n[...], raw.extensor_force_n[...] = forces_n
        _joint_inputs(self._par, self._raw, self.law.input_array)
        u_pa = self.law.step_on_inputs()
        _joint_outputs(self._par, self._st, u_pa, self._raw, self._commands)
        self._error_rad = ref_rad - angle_rad
        return tuple(self._commands.tolist())

    def want_co_contraction(self, gauge_pa: float) -> None:
        """
        Ask for another mean pressure [Pa gauge]; it is approached at a limited rate.

        Kept within the pressure limits. The static inverse stays the one of the co-contraction
        the controller was made for: what that misses is left to rules and integral.
        """
        par = self._parameters
        par.co_contraction_pa[...] = min(
            max(P_ATM_PA + gauge_pa, par.lowest_pa.item()), par.highest_pa.item())

    def limit_pressure(self, highest_pa: float) -> None:
        """
        Keep both commands below a pressure [absolute Pa] as well; NaN: no such limit.

        The co-contraction gives way to it; the law saturates at the difference that is left.
        """
        par, (lowest, highest) = self._parameters, limits_gauge_pa(self.settings)
        _, limit = limits_within(self.settings, lowest, highest_pa - P_ATM_PA)
        par.limit_pa[...] = P_ATM_PA + limit
        lost = 0.5 * (highest - limit)
        self.law.limit_commands(lowest + lost, highest - lost)

    @property
    def wanted_co_contraction_pa(self) -> float:
        """Mean pressure of both muscles asked for [Pa absolute]."""
        return float(self._parameters.co_contraction_pa)

    @property
    def co_contraction_reach_pa(self) -> float:
        """How far the co-contraction may move in one tick [Pa]."""
        return float(self._parameters.reach_pa)

    def stand_aside(self, commands_pa: Sequence[float]) -> None:
        """
        Take note of what another law commands in place of this one.

        ``commands_pa``: pressures of flexor and extensor, absolute Pa. The next tick starts
        bumplessly, and with their mean as co-contraction.
        """
        self.pause()
        self._commands[:] = commands_pa
        self._state.known[...] = 1.0
        self._state.co_contraction_pa[...] = self._commands.mean()

    def compiled_arguments(self) -> tuple[tuple[FloatArray, ...], tuple[object, ...]]:
        """Return (par, state) of this module's functions and the arguments of the law."""
        return (self._par, self._st), self.law.compiled_arguments()

    def state_values(self) -> tuple[float, ...]:
        """Return the values of ``state_names`` of the last tick as a tuple of floats."""
        return (*self.law.state_values(), self._error_rad, self._state.co_contraction_pa.item(),
                *self._commands.tolist())

    def pause(self) -> None:
        """Forget the motion, keep the rules: the next tick starts bumplessly."""
        super().pause()
        self._st[:] = 0.0
        self._commands[:] = P_ATM_PA
        self._begins = True
        self._error_rad = math.nan

    def file_entries(self) -> dict[str, object]:
        """Return what ``JointMode`` reads, and the static inverse."""
        return {'mode': JOINT.mode, 'joint': {key: getattr(self, key) for key in _NAMES},
                'static_inverse': inverse_to_mapping(self.static_inverse)}


def limits_gauge_pa(settings: Mapping[str, float]) -> tuple[float, float]:
    """Return the lowest and highest gauge pressure [Pa] of a law's settings."""
    return settings['min_pressure_gauge_pa'], settings['max_pressure_gauge_pa']


class JointMode:
    """What a controller file says of joint mode, and how a law is made to fit it."""

    tracked = JOINT

    def __init__(self, tree: Located, rig: JointRig | None) -> None:
        """
        Read the block ``joint`` of a controller file; what it lacks comes from the joint.

        Raises
        ------
        InputError
            Unknown key, number out of range, or neither a joint nor the numbers of one.

        """
        block = tree.get('joint', dict)
        numbers: Mapping[str, float] = {} if rig is None else getattr(rig, 'parameters', {})
        if rig is not None and not hasattr(rig, 'flexor'):
            raise InputError(
                f'`mode: joint` needs a joint; {rig.name} is a single muscle', tree.where('mode'))
        given = {}
        if block is not None:
            block.check_keys(_NAMES)
            given = {key.name: key.read(block) for key in KEYS if key.name in block}
        self.values = {}
        for name in _NAMES:
            value = given.get(name)
            if value is None and name == 'co_contraction_gauge_pa':
                value = CO_CONTRACTION_GAUGE_PA
            value = numbers.get(name) if value is None else value
            if value is None:
                raise tree.error(f'without a joint the text must bring `{name}`', 'joint')
            self.values[name] = value
        self._where = tree.where('joint') if block is not None else tree.where('mode')
        self._joint = rig
        self._own_inverse = 'static_inverse' in tree

    def identity(self, rig_name: str) -> str:
        """Return what rules learned in this mode are tied to."""
        return in_mode(
            rig_name, f'joint at {self.values["co_contraction_gauge_pa"] * 1e-3:.12g} kPa')

    def blank_inverse(self) -> FloatArray:
        """Return a table of the right size; ``wrap`` fills it."""
        if self._joint is None:
            raise InputError('without a joint the text must bring its `static_inverse`',
                             self._where)
        return blank_inverse(NODES)

    def rule_scaling(self) -> dict[str, str | float]:
        """Return what turns the metres of the rules into radians, as part of their scaling."""
        return {'tracked_unit': 'rad', 'tracked_per_m': 1.0 / self.values['flexor_radius_m'],
                'tracked_zero_m': self.values['flexor_contraction_at_zero_m']}

    def wrap(self, law: CompiledController) -> JointController:
        """Return the law in this mode, with the static inverse of the joint if it had none."""
        radius_m, contraction_m, gauge_pa = (self.values[key] for key in _NAMES)
        controller = JointController(law, radius_m, contraction_m, gauge_pa, self._where)
        if not self._own_inverse and self._joint is not None:
            lowest, highest = limits_gauge_pa(law.settings)
            law.static_inverse[:] = tabulate_joint_inverse(
                self._joint, P_ATM_PA + controller.co_contraction_gauge_pa, P_ATM_PA + lowest,
                P_ATM_PA + highest)
        return controller
