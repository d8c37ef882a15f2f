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

"""The self-organizing fuzzy controller as a class: owner of the arrays of ``sofc_step``."""

from collections.abc import Callable, Mapping
import math

import numpy as np
from pam_actuation.control.compiled_controller import CompiledController
from pam_actuation.control.inputs import MAX_AGE_S
from pam_actuation.control.settings import checked_settings, LIMITS
from pam_actuation.control.sofc import muscle_model
from pam_actuation.control.sofc.credit import ring_rows
from pam_actuation.control.sofc.learning import REASONS
from pam_actuation.control.sofc.persistence import check_fit
from pam_actuation.control.sofc.records import ENTRY, KNOWN, MODEL_OUTPUTS, OUTPUT, STATE
from pam_actuation.control.sofc.rule_table import linear_feedback_table, RuleBase
from pam_actuation.control.sofc.rule_text import NUMBERS
from pam_actuation.control.sofc.rules_output import keep_command, sofc_output
from pam_actuation.control.sofc.settings import (
    check_inertia, OF_MODEL, parameter_array, PARAMETERS, scaling_of, SETTINGS)
from pam_actuation.control.sofc.step import sofc_step
from pam_sim.annotations import FloatArray
from pam_sim.errors import InputError
from pam_sim.records import cells, fields, size_of

OF_THE_MODE = 'tracked_'    # what of the scaling of rules turns metres of the law into radians


class SelfOrganizingFuzzyController(CompiledController):
    """
    Fuzzy controller whose rules change while it runs (Procyk and Mamdani, 1979).

    Parameters
    ----------
    static_inverse : numpy.ndarray
        Table of ``static_inverse.tabulate_static_inverse``.
    settings : mapping, optional
        What differs from the defaults of ``sofc.settings.SETTINGS``.
    rules : RuleBase, optional
        Rules to start from; linear feedback rules and zero feed-forward by default.
    rig_name : str
        Identity of the rig the rules belong to.
    where : callable, optional
        Place of a setting for errors.

    Raises
    ------
    InputError
        A setting is unknown or out of range, or the rules do not fit.

    """

    kind = 'sofc'
    state_names = OUTPUT.names or ()
    rules: RuleBase

    def __init__(self, static_inverse: FloatArray, settings: Mapping[str, object] | None = None,
                 rules: RuleBase | None = None, rig_name: str = '',
                 where: Callable[[str], str] | None = None) -> None:
        given, settings = settings or {}, checked_settings(SETTINGS, settings, where)
        check_inertia(settings, given, where or str)
        super().__init__(settings, STATE, rig_name)
        if not any(self.settings[name] for name in OF_MODEL):
            self.state_names = self.state_names[:-len(MODEL_OUTPUTS)]
            self._told = self._outputs[:len(self.state_names)]
        for name in ('reference_knots', 'motion_position_knots', 'motion_rate_knots',
                     'path_sets', 'path_fading_sets', 'revision'):
            self.settings[name] = float(round(self.settings[name]))
        if self.settings['reference_upper_m'] <= self.settings['reference_lower_m']:
            raise InputError(
                'reference_upper_m must be larger than reference_lower_m',
                where('reference_upper_m') if where else 'reference_upper_m')
        self.static_inverse = np.ascontiguousarray(static_inverse, dtype=float)
        sets = int(self.settings['path_sets'])
        fading = int(self.settings['path_fading_sets'])
        if fading and fading > sets - 1:
            raise InputError(
                f'path_fading_sets is {fading} of {sets} path_sets; allowed are at most '
                f'{max(sets - 1, 0)}, as the first is that of any path',
                where('path_fading_sets') if where else 'path_fading_sets')
        self.rules = RuleBase(
            linear_feedback_table(), np.zeros((2, int(self.settings['reference_knots']))),
            {**scaling_of(self.settings), 'rig': rig_name},
            np.zeros((int(self.settings['motion_position_knots']),
                      int(self.settings['motion_rate_knots']))),
            np.zeros((sets, int(self.settings['reference_knots']) if sets else 0)))
        if self.settings['model_noise_pa'] > 0.0:
            # The same memory: what the model finds is in the rules at once, and the reverse.
            model = fields(self._state, STATE).model
            self.rules.numbers = model.number_pa
            self.rules.covariance = model.covariance_pa2.reshape(NUMBERS, NUMBERS)
        if rules is not None:
            check_fit(rules, self.rules, 'rules')
            self.rules.assign(rules)
        self.parameters = parameter_array(self.settings)
        self._limits = tuple(vars(cells(self.parameters, PARAMETERS))[name] for name in LIMITS)
        par = fields(self.parameters, PARAMETERS)
        rows = ring_rows(
            int(par.delay_ticks), int(par.spread_ticks),
            int(par.answer_ticks) + 1 + math.ceil(MAX_AGE_S * self.rate_hz))
        self._ring = np.zeros(rows * size_of(ENTRY))
        self._tables = self.rules.stacked()
        self._kept = tuple(table[3] for table in self._tables)
        self._step = sofc_step
        self._arguments = (
            self.parameters, self.static_inverse, self._tables, self._ring, self._state,
            self._inputs, self._outputs)

    def _fresh(self, settings: Mapping[str, object], rules: RuleBase | None
               ) -> 'SelfOrganizingFuzzyController':
        if rules is None and scaling_of(settings) == scaling_of(self.settings):
            rules = self.rules
        mode = {name: value for name, value in self.rules.scaling.items()
                if name.startswith(OF_THE_MODE)}
        if rules is not None and mode:
            rules = rules.copy()
            for name in mode:
                rules.scaling.pop(name, None)
        fresh = SelfOrganizingFuzzyController(
            self.static_inverse, settings, rules, self.rig_name)
        fresh.rules.scaling.update(mode)
        fresh.freeze_learning = self.freeze_learning
        return fresh

    def learning_reason(self) -> str:
        """Return in words whether the last tick learned, or why not."""
        return REASONS[int(fields(self._outputs, OUTPUT).learning_reason)]

    def pause(self) -> None:
        """Forget the motion, keep rules and model: the next tick starts bumplessly."""
        model = fields(self._state, STATE).model
        numbers, covariance = model.number_pa.copy(), model.covariance_pa2.copy()
        super().pause()
        model.number_pa[:], model.covariance_pa2[:] = numbers, covariance
        self._ring[:] = 0.0

    def reset(self) -> None:
        """Return to the initial rules, forget the model and the motion."""
        self.rules.reset()
        self._forget_numbers()
        self.pause()

    def _forget_numbers(self) -> None:
        model = fields(self._state, STATE).model
        model.number_pa[:] = 0.0
        model.covariance_pa2[:] = 0.0

    def take_rules(self, rules: RuleBase, where: str = 'rules') -> None:
        """
        Begin with the rules of a file, which were learned elsewhere.

        The numbers of its model are taken for less sure than they were there. A recording's
        own rules are given to the constructor or to ``rules.assign`` instead, and stay exact.

        Raises
        ------
        InputError
            The rules do not fit this controller; the old ones stay.

        """
        check_fit(rules, self.rules, where)
        self.rules.assign(rules)
        if np.any(rules.covariance) and self.rules.covariance.size:
            muscle_model.doubt_numbers(
                fields(self.parameters, PARAMETERS), self.rules.covariance)

    def replace_rules(self, rules: RuleBase, where: str = 'rules') -> None:
        """
        Exchange the rules without a step in the command.

        The difference the exchange makes at the present operating point goes into the
        integral, which then fades it out.

        Raises
        ------
        InputError
            The rules do not fit this controller; the old ones stay.

        """
        before = self._output_pa()
        self.take_rules(rules, where)
        self._keep_output(before)

    def reset_rules(self) -> None:
        """Return to the initial rules without a step in the command."""
        before = self._output_pa()
        self.rules.reset()
        self._forget_numbers()
        self._keep_output(before)

    def _keep_output(self, before_pa: tuple[float, float, float]) -> None:
        self.rules_replaced += 1
        ring = self._ring.view(ENTRY)
        known = {name: ring[name].copy() for name in KNOWN}
        self._ring[:] = 0.0        # no credit for rules that are gone
        for name, values in known.items():
            ring[name] = values
        state = fields(self._state, STATE)
        state.history_ticks = min(state.history_ticks, 1.0)
        state.rolled_back = 0.0
        state.best_rms_m = 0.0        # the new rules are judged anew
        for kept, values in zip(self._kept, self.rules.arrays()):
            kept[...] = values
        keep_command.py_func(
            fields(self.parameters, PARAMETERS), state, before_pa, self._output_pa())

    def _output_pa(self) -> tuple[float, float, float]:
        return sofc_output(self.parameters, self._tables, self._state, self._outputs)
