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

"""What a person says of a rig, and the numbers that follow from it."""

from dataclasses import dataclass, field
import math
from typing import Any

from pam_actuation.rig_files.by_size import by_size, BySize, DAMPING, nearest_muscle
from pam_actuation.rig_files.numbers import Stated
from pam_sim.errors import InputError
from pam_sim.muscle.geometry import (
    BORE_M as NOMINAL_BORE_M, BRAID_ANGLE_RAD, MAX_STRAIN, most_strain)
from pam_sim.muscle.muscle import DIMENSIONS, get_muscle
from pam_sim.parameters import Parameter
from pam_sim.rig_parameters import rig_parameters
from pam_sim.tolerance import AbsoluteSd, Tolerance, UNKNOWN
from pam_sim.valve.regulator_presets import get_regulator

TYPE_TOLERANCE = 0.15        # of a force map of the type: muscles of a type differ by 10 to 20 %
BY_BORE_TOLERANCE = 0.2      # of a force map taken from a muscle of another bore
LAG_TOLERANCE = 0.5          # of the lag of a regulator that nobody stated
BY_SIZE_TOLERANCE = 0.5      # of damping and valve by the size of the muscle
ZERO_SHARE = 0.02            # of the range; by data sheets 1 % each of regulator and sensor
GAIN, ZERO = 'K_m', 'ppr_zero_pa'
NOT_STATED = 'not stated: that of the nominal regulator, yours may differ'
NO_PRESSURES = ('pressures not stated: those of the nominal regulator, yours may differ; see '
                '--regulator-kpa')
REGULATOR_NUMBERS = (GAIN, 'ppr_lowest_v', 'ppr_highest_v', ZERO)


@dataclass
class Description:
    """
    What was said of a rig.

    Parameters
    ----------
    muscle : str or None
        Name of a muscle; None: the one whose bore is nearest, else that of the nominal rig.
    dimensions : dict
        Those of ``DIMENSIONS`` that differ, SI.
    force_map : str or None
        Path of a table that ``pam characterise`` wrote.
    force_map_off : float
        How far it is off the points it was made from, as a fraction of the largest force.
    force_map_strain : float
        Its largest contraction, as a fraction of the length.
    force_map_unknown : list of str
        Sentences on what the table does not know.
    load, valve, volume : str
        As in a rig and its muscle.
    regulator : str or None
        Name of a regulator.
    volts, gauge_pa : tuple of float or None
        Range of the input [V] and of the pressure [Pa gauge] of the regulator.
    numbers : dict
        Parameter name -> Stated.
    effects : dict
        ``EFFECT.PARAMETER`` -> Stated.
    sensors : dict
        Sensor setting -> value.
    unknown_law : list of str
        Unknown coefficients of the force law, ``law.NAME``; ``law`` for all.
    notes : dict
        Parameter name -> where its number comes from; filled by ``work_out``.

    """

    muscle: str | None = None
    dimensions: dict[str, float] = field(default_factory=dict)
    force_map: str | None = None
    force_map_off: float = 0.0
    force_map_strain: float = 0.0
    force_map_unknown: list[str] = field(default_factory=list)
    load: str = 'hanging_mass'
    valve: str = 'ppr'
    volume: str = 'bore'
    regulator: str | None = None
    volts: tuple[float, float] | None = None
    gauge_pa: tuple[float, float] | None = None
    numbers: dict[str, Stated] = field(default_factory=dict)
    effects: dict[str, Stated] = field(default_factory=dict)
    sensors: dict[str, float] = field(default_factory=dict)
    unknown_law: list[str] = field(default_factory=list)
    notes: dict[str, str] = field(default_factory=dict)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters that a rig with this load has."""
        return rig_parameters(self.load)

    def work_out(self) -> None:
        """
        Fill in muscle and numbers that follow from what was said.

        Raises
        ------
        InputError
            A dimension or number out of range, or one that was said twice.

        """
        self._end_of_contraction()
        for dimension in DIMENSIONS:
            if dimension.name in self.dimensions:
                dimension.check(self.dimensions[dimension.name], 'muscle')
        if self.muscle is None:
            self.muscle = self._nearest()
        self._scale_force_map()
        self._doubt_force_map()
        self._fill_by_size()
        if self.valve == 'ppr':
            self._regulator()
        elif self.regulator or self.volts or self.gauge_pa:
            raise InputError('a rig with valve hsv has no regulator', '--regulator')

    def muscle_data(self) -> Any:
        """Return the entry ``muscle`` of the file, without the law."""
        if not self.dimensions:
            return self.muscle
        return {'like': self.muscle, **self.dimensions}

    def _end_of_contraction(self) -> None:
        """Fill in what the braid allows, or what the force map shows if that is more."""
        if 'max_strain' in self.dimensions:
            return
        angle_rad = self.dimensions.get('braid_angle_rad', BRAID_ANGLE_RAD)
        is_nominal = math.isclose(angle_rad, BRAID_ANGLE_RAD)       # it is stated in degrees
        end = MAX_STRAIN if is_nominal else round(most_strain(angle_rad), 3)
        if self.force_map_strain > end:
            end = self.force_map_strain
            self.notes['max_strain'] = 'not stated: the largest contraction of the force map'
        if end != MAX_STRAIN:
            self.dimensions['max_strain'] = end

    def _nearest(self) -> str:
        bore = self.dimensions.get('bore_m')
        if bore is None:
            return 'dmsp_5_300'
        return nearest_muscle(bore)

    def _scale_force_map(self) -> None:
        assert self.muscle is not None
        like, bore = get_muscle(self.muscle), self.dimensions.get('bore_m')
        if bore is None or bore == like.bore_m or self.force_map:
            return
        gain = (bore / like.bore_m) ** 2
        parameter = next(p for p in self.parameters if p.name == 'force_map_gain')
        if not parameter.lower <= gain <= parameter.upper:
            low, high = (1e3 * like.bore_m * math.sqrt(b)
                         for b in (parameter.lower, parameter.upper))
            raise InputError(f'the bore is {1e3 * bore:g} mm; allowed {low:.3g} to {high:.3g} mm '
                             f'with the force map of {self.muscle}', '--bore-mm')
        self._add('force_map_gain', round(gain, 6), BY_BORE_TOLERANCE,
                  f'(bore / bore of {self.muscle})^2: a first guess, measure it')

    def _doubt_force_map(self) -> None:
        """State how well a force map is known, unless coefficients of its law are unknown."""
        name = 'force_map_gain'
        usual = next(p for p in self.parameters if p.name == name).tolerance
        if self.force_map and name not in self.numbers and self.force_map_off > usual:
            self._add(name, 1.0, round(self.force_map_off, 4),
                      'what the table is off at the points it was made from, rms')
        if not (self.force_map or self.unknown_law or name in self.numbers):
            self._add(name, 1.0, TYPE_TOLERANCE, 'of the type, not measured on this muscle: '
                      'muscles of a type differ by 10 to 20 %')

    def by_size(self) -> dict[str, BySize]:
        """Return damping and numbers of on/off valves by the size of the muscle."""
        like = get_muscle(self.muscle or self._nearest())
        return by_size(self.dimensions.get('bore_m', like.bore_m),
                       self.dimensions.get('length_m', like.length_m), self.muscle or '')

    def _fill_by_size(self) -> None:
        """Take damping and on/off valves by the size of the muscle, where nobody stated them."""
        assert self.muscle is not None
        bore_m = self.dimensions.get('bore_m', get_muscle(self.muscle).bore_m)
        wanted = {DAMPING} if self.load != 'isometric' and bore_m != NOMINAL_BORE_M else set()
        if self.valve == 'hsv':
            wanted |= {'C', 'V_dead'}
        for name, (value, source) in self.by_size().items():
            said = self.numbers.get(name)
            if name in wanted and (said is None or said.value is None):
                self._add(name, value, BY_SIZE_TOLERANCE,
                          f'not stated: that of {source}, yours may differ by half')

    def _regulator(self) -> None:
        volts, gauge_pa, source = self.volts, self.gauge_pa, 'as stated'
        if self.regulator is not None:
            preset = get_regulator(self.regulator)
            source = f'{preset.sold_as}: {preset.rests_on}'
            gauge_pa = gauge_pa or (preset.lowest_gauge_pa, preset.highest_gauge_pa)
            if volts is None and preset.lowest_v is not None and preset.highest_v is not None:
                volts = preset.lowest_v, preset.highest_v
            if volts is None:
                raise InputError(f'the data sheet of {preset.sold_as} at hand does not state the '
                                 'input; give --regulator-volts LOW:HIGH, such as 0:10',
                                 f'--regulator {self.regulator}')
            if preset.lag_s is not None and 'T_m' not in self.numbers:
                self._add('T_m', preset.lag_s, None, source)
        nominal = {p.name: p.default for p in self.parameters}
        is_stated = volts is not None or gauge_pa is not None
        low_v, high_v = volts or (nominal['ppr_lowest_v'], nominal['ppr_highest_v'])
        low_pa, high_pa = gauge_pa or (0.0, nominal['K_m'] * (nominal['ppr_highest_v']
                                                              - nominal['ppr_lowest_v']))
        own = {n: one.value for n, one in self.numbers.items() if one.value is not None}
        if gauge_pa is None and volts is not None:      # volts alone tell no pressure
            low_pa = own.get(ZERO, low_pa)
            high_pa = low_pa + own[GAIN] * (high_v - low_v) if GAIN in own else high_pa
        gain = float(f'{(high_pa - low_pa) / (high_v - low_v):.9g}')
        values = dict(zip(REGULATOR_NUMBERS, (gain, low_v, high_v, low_pa)))
        if not is_stated:       # gain and range stay those of the nominal rig
            values = {ZERO: low_pa} if ZERO not in self.numbers else {}
            source = NOT_STATED
        elif gauge_pa is None:
            values = {n: v for n, v in values.items() if n not in (GAIN, ZERO) or n not in own}
        for name, value in values.items():
            unsure = self._zero_tolerance(low_pa, high_pa) if name == ZERO else None
            if name == GAIN and gauge_pa is None:
                self._add(name, value, LAG_TOLERANCE, NO_PRESSURES)
            else:
                self._add(name, value, unsure, source)
        if 'T_m' not in self.numbers:
            self._add('T_m', nominal['T_m'], LAG_TOLERANCE, NOT_STATED)

    def _zero_tolerance(self, low_pa: float, high_pa: float) -> Tolerance | None:
        """
        Return how well the zero of the regulator is known, None where it is exact.

        A zero of the pressure sensor acts on what is read as it does. Where that one is unknown,
        the regulator is the only reference there is.
        """
        # A data sheet begins its range where control begins, not quite at the lowest input.
        begin_pa = abs(low_pa) if self.regulator else 0.0
        sensor = self.numbers.get('pressure_zero_pa')
        if sensor is None or sensor.tolerance != UNKNOWN:
            begin_pa = max(begin_pa, ZERO_SHARE * (high_pa - low_pa))
        return AbsoluteSd(begin_pa) if begin_pa > 0.0 else None

    def _add(self, name: str, value: float, tolerance: Tolerance | None, note: str) -> None:
        """Add a number that follows from others; how well it is known may be said beside it."""
        said = self.numbers.get(name)
        if said is not None and said.value is not None:
            raise InputError(f'`{name}` is stated, and follows from the other options too; leave '
                             'one of them out', f'{name}={said.value:g}')
        parameter = next(p for p in self.parameters if p.name == name)
        known = tolerance if said is None else said.tolerance
        where = 'regulator' if name in (*REGULATOR_NUMBERS, 'T_m') else 'muscle'
        self.numbers[name] = Stated(parameter.check(value, where), known)
        self.notes[name] = note
