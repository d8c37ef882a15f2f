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

One newton counts as 1/K metres, K a nominal stiffness of the muscle at constant pressure, so that
every setting and rule of the law keeps its meaning. The static inverse is the pressure for the
wanted force at the contraction that the muscle will have when the command arrives. That is the
measured contraction, extrapolated with its rate over the preview. A small wanted force is no
fault; a tendon that hangs loose where a force is wanted is, and freezes learning.
"""

from collections.abc import Callable
import math

import numpy as np
from pam_actuation.control.compiled_controller import CompiledController
from pam_actuation.control.inputs import INPUT, MAX_AGE_S
from pam_actuation.control.modes.force_surface import (
    fill_inverse, nominal_stiffness_n_per_m, surface_from_tree, surface_head, surface_to_mapping,
    tabulate_force_surface)
from pam_actuation.control.modes.tracked import FORCE
from pam_actuation.control.modes.wrapped import blank_inverse, in_mode, WrappedLaw
from pam_sim.annotations import FloatArray
from pam_sim.compiled import allocating_entry_point, compiled, source_key
from pam_sim.errors import InputError
from pam_sim.joint.rig import JointRig
from pam_sim.keys import Key, names_of
from pam_sim.located_yaml import Located
from pam_sim.records import cells, part, record, values_of, zeros
from pam_sim.rig import Rig

# What a tick is given: as ``inputs.INPUT``, but references in newtons.
FORCE_INPUT = record(
    'contraction_m',                  # measured; NaN = not known
    'reference_n',
    'reference_rate_n_per_s',
    'lead_reference_n',
    'lead_rate_n_per_s',
    'learning',
    'elapsed_s',
    'pressure_pa',
    'force_n',                        # measured
    'held_back',
    'age_s',
    'pressure_age_s',
)
PARAMETERS = record(
    'stiffness_n_per_m',              # so many newtons count as one metre
    'lead_s',
    'period_s',
    'fading',                         # what a measurement of one tick ago still counts
    'slack_force_n',
)
STATE = record(
    'known',                          # 1 once a contraction was measured
    'contraction_m',                  # filtered
    'rate_m_per_s',
    'ahead_m',                        # for which the inverse is taken
)

_FILTER_S = 0.05        # memory of the filter of the contraction
STIFFNESS = Key(
    'stiffness_n_per_m', float, 'So many newtons count as one metre in settings and rules.',
    otherwise='slope of the nominal force', unit='N/m', lower=1.0, upper=1e7)
_CONTRACTION = Key(
    'contraction_m', float, 'Contraction until the first one is measured.',
    otherwise='that of an isometric rig, else 0', unit='m', lower=0.0, upper=1.0)
KEYS = (STIFFNESS, _CONTRACTION,
        Key('surface', dict, 'Pressure over force and contraction, as a recording keeps it.',
            otherwise='from the rig'))


@compiled
def look_ahead(par: np.record, st: np.record, contraction_m: float, elapsed_s: float) -> float:
    """
    Take a contraction (NaN = none) into the state; return that of one preview ahead [m].

    Critically damped g-h filter: no lag at constant speed, little noise in the rate.
    """
    if not math.isfinite(elapsed_s):
        elapsed_s = par.period_s
    if not math.isfinite(contraction_m):
        st.rate_m_per_s = 0.0
    elif st.known < 0.5 or elapsed_s > MAX_AGE_S:
        st.contraction_m = contraction_m
        st.rate_m_per_s = 0.0
        st.known = 1.0
    elif elapsed_s > 0.0:
        fading = par.fading
        expected_m = st.contraction_m + st.rate_m_per_s * elapsed_s
        residual = contraction_m - expected_m
        st.contraction_m = expected_m + (1.0 - fading * fading) * residual
        st.rate_m_per_s += (1.0 - fading) * (1.0 - fading) * residual / elapsed_s
    ahead_m: float = st.contraction_m + par.lead_s * st.rate_m_per_s
    st.ahead_m = ahead_m
    return ahead_m


@compiled
def force_inputs(par: FloatArray, surface: FloatArray, st: FloatArray, raw: FloatArray,
                 table: FloatArray, inp: FloatArray) -> None:
    """
    Turn the inputs of one tick in newtons into those of the law.

    Parameters
    ----------
    par, surface, st : float64[:]
        Arrays of ``PARAMETERS``, the force surface, ``STATE``.
    raw : float64[:]
        Array of ``FORCE_INPUT``.
    table : float64[:]
        Static inverse of the law, written.
    inp : float64[:]
        Inputs of the law (``inputs.INPUT``), written.

    """
    _law_inputs(part(par, 0, PARAMETERS), surface, part(st, 0, STATE), part(raw, 0, FORCE_INPUT),
                table, part(inp, 0, INPUT))


@compiled
def _law_inputs(par: np.record, surface: FloatArray, st: np.record, raw: np.record,
                table: FloatArray, inp: np.record) -> None:
    """Do as ``force_inputs``, on records."""
    stiffness = par.stiffness_n_per_m
    ahead = look_ahead(par, st, raw.contraction_m, raw.elapsed_s)
    fill_inverse(surface, stiffness, ahead, table)
    inp.contraction_m = raw.force_n / stiffness
    inp.reference_m = raw.reference_n / stiffness
    inp.reference_rate_m_per_s = raw.reference_rate_n_per_s / stiffness
    inp.lead_reference_m = raw.lead_reference_n / stiffness
    inp.lead_rate_m_per_s = raw.lead_rate_n_per_s / stiffness
    inp.learning = raw.learning
    inp.elapsed_s = raw.elapsed_s
    inp.pressure_pa = raw.pressure_pa
    inp.held_back = raw.held_back
    inp.age_s = raw.age_s
    inp.pressure_age_s = raw.pressure_age_s
    inp.force_n = raw.force_n
    if raw.reference_n < 2.0 * par.slack_force_n:
        inp.force_n = math.nan


def _entry(key: int) -> Callable[..., None]:
    """Return ``force_inputs`` as one unit of compiled code, stored under ``key``."""
    @allocating_entry_point
    def entry(par: FloatArray, surface: FloatArray, st: FloatArray, raw: FloatArray,
              table: FloatArray, inp: FloatArray) -> None:
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

    def __init__(self, law: CompiledController, surface: FloatArray, stiffness_n_per_m: float,
                 contraction_m: float = 0.0) -> None:
        super().__init__(law)
        self.surface = np.ascontiguousarray(surface, dtype=float)
        self.stiffness_n_per_m = float(stiffness_n_per_m)
        self.contraction_m = float(contraction_m)
        self.state_names = (*law.state_names, 'force_error_n', 'contraction_ahead_m')
        self._par = values_of(PARAMETERS, {
            'stiffness_n_per_m': stiffness_n_per_m, 'lead_s': law.lead_s,
            'period_s': 1.0 / law.rate_hz,
            'fading': math.exp(-1.0 / (law.rate_hz * _FILTER_S)),
            'slack_force_n': law.settings.get('slack_force_n', 0.0)})
        self._st, self._raw = zeros(STATE), zeros(FORCE_INPUT)
        self._state, self._inputs = cells(self._st, STATE), cells(self._raw, FORCE_INPUT)
        self._error_n = math.nan
        self._convert(np.zeros_like(law.input_array))      # compiled before time counts
        self.pause()

    def with_law(self, law: CompiledController) -> 'ForceController':
        """Return a controller of the same force surface round another law."""
        return ForceController(law, self.surface, self.stiffness_n_per_m, self.contraction_m)

    @property
    def upper_force_n(self) -> float:
        """Largest force [N] of the surface."""
        head = surface_head(self.surface)
        return float(head.force_step_n * (head.forces - 1.0))

    def _convert(self, inputs: FloatArray) -> None:
        """Write the inputs of the law for those at hand."""
        _force_inputs(
            self._par, self.surface, self._st, self._raw, self.law.static_inverse, inputs)

    def step(self, x_m: float, ref_n: float, ref_rate_n_per_s: float, ref_lead_n: float,
             ref_lead_rate_n_per_s: float, learn: bool = True, elapsed_s: float = math.nan,
             pressure_pa: float = math.nan, force_n: float = math.nan,
             held_back: float = 0.0, age_s: float = 0.0, pressure_age_s: float = 0.0) -> float:
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
        age_s, pressure_age_s : float
            Time from the measurement of force and of pressure to now, 0 or more.

        Returns
        -------
        float
            Wanted muscle pressure, absolute Pa.

        """
        raw = self._inputs
        raw.contraction_m[...] = x_m
        raw.reference_n[...] = ref_n
        raw.reference_rate_n_per_s[...] = ref_rate_n_per_s
        raw.lead_reference_n[...] = ref_lead_n
        raw.lead_rate_n_per_s[...] = ref_lead_rate_n_per_s
        raw.learning[...] = 1.0 if learn and not self.law.freeze_learning else 0.0
        raw.elapsed_s[...] = elapsed_s
        raw.pressure_pa[...] = pressure_pa
        raw.force_n[...] = force_n
        raw.held_back[...] = held_back
        raw.age_s[...] = age_s
        raw.pressure_age_s[...] = pressure_age_s
        self._convert(self.law.input_array)
        self._error_n = ref_n - force_n
        return self.law.step_on_inputs()

    def compiled_arguments(self) -> tuple[tuple[FloatArray, ...], tuple[object, ...]]:
        """Return (par, surface, state) of ``force_inputs`` and the arguments of the law."""
        return (self._par, self.surface, self._st), self.law.compiled_arguments()

    def state_values(self) -> tuple[float, ...]:
        """Return the values of ``state_names`` of the last tick as a tuple of floats."""
        return (*self.law.state_values(), self._error_n, self._state.ahead_m.item())

    def pause(self) -> None:
        """Forget the motion, keep the rules: the next tick starts bumplessly."""
        super().pause()
        self._st[:] = 0.0
        self._state.contraction_m[...] = self._state.ahead_m[...] = self.contraction_m
        self._error_n = math.nan

    def file_entries(self) -> dict[str, object]:
        """Return what ``ForceMode`` reads; the surface says the static inverse."""
        return {'mode': FORCE.mode, 'force': {
            'stiffness_n_per_m': self.stiffness_n_per_m, 'contraction_m': self.contraction_m,
            'surface': surface_to_mapping(self.surface)}}


class ForceMode:
    """What a controller file says of force mode, and how a law is made to fit it."""

    tracked = FORCE

    def __init__(self, tree: Located, rig: Rig | JointRig | None) -> None:
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
        if isinstance(rig, JointRig):
            raise InputError(
                f'`mode: force` needs a single muscle; {rig.name} is a joint', tree.where('mode'))
        block = tree.get('force', dict)
        own = None
        if block is not None:
            block.check_keys(names_of(KEYS))
            own = block.get('surface', dict)
        stiffness = contraction = None
        if block is not None:
            stiffness, contraction = STIFFNESS.read(block), _CONTRACTION.read(block)
        if rig is None:
            if own is None or stiffness is None:
                raise tree.error(
                    'without a rig `force` must bring `stiffness_n_per_m` and `surface`', 'mode')
            self.surface, self.stiffness_n_per_m = surface_from_tree(own), stiffness
        else:
            self.surface = tabulate_force_surface(rig) if own is None else surface_from_tree(own)
            self.stiffness_n_per_m = (
                nominal_stiffness_n_per_m(rig) if stiffness is None else stiffness)
        if contraction is None:
            contraction = 0.0 if rig is None else rig.parameters.get('contraction_m', 0.0)
        self.contraction_m = contraction

    def identity(self, rig_name: str) -> str:
        """Return what rules learned in this mode are tied to."""
        return in_mode(rig_name, f'force at {self.stiffness_n_per_m:.12g} N/m')

    def blank_inverse(self) -> FloatArray:
        """Return a table of the right size; every tick fills it."""
        return blank_inverse(int(surface_head(self.surface).forces))

    def rule_scaling(self) -> dict[str, str | float]:
        """Return what turns the metres of the rules into newtons, as part of their scaling."""
        return {'tracked_unit': 'N', 'tracked_per_m': self.stiffness_n_per_m,
                'tracked_zero_m': 0.0}

    def wrap(self, law: CompiledController) -> ForceController:
        """Return the law in this mode."""
        return ForceController(law, self.surface, self.stiffness_n_per_m, self.contraction_m)
