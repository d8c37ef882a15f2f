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

"""What all control laws have in common: the arrays of a compiled step function."""

from collections.abc import Callable, Mapping
import math
from typing import Any, Self, TYPE_CHECKING, TypeVar

import numpy as np
from pam_actuation.control.controller_text import controller_to_yaml
from pam_actuation.control.inputs import INPUT, write_inputs
from pam_actuation.control.settings import limits_within
from pam_actuation.control.static_inverse import inverse_to_mapping
from pam_sim.annotations import FloatArray
from pam_sim.declared import check_mapping
from pam_sim.errors import InputError
from pam_sim.records import zeros
from pam_sim.shared_memory import SharedMemory
from pam_sim.units import P_ATM_PA

if TYPE_CHECKING:
    from pam_actuation.control.sofc.rule_table import RuleBase

_Law = TypeVar('_Law')


def hand_on(one: Any, fresh: _Law) -> _Law:
    """Return a fresh controller with what another one is made for and asks of the driver."""
    for name in ('made_for', 'driver', 'other_rig', 'other_valve'):
        setattr(fresh, name, getattr(one, name))
    return fresh


class CompiledController(SharedMemory):
    """
    A control law as a class: owner of the arrays its compiled step works on.

    Subclasses have ``kind`` and ``state_names``, and know what ``learning_reason`` is. They set
    ``_step`` and ``_arguments``, what it takes, with ``_inputs`` and ``_outputs`` among them. They
    set ``_limits`` as well, the cells of ``settings.LIMITS`` in its parameters.

    Parameters
    ----------
    settings : dict
        Checked settings; has ``rate_hz`` and ``lead_s``.
    state : numpy.dtype
        Record of the state.
    rig_name : str
        Identity of the rig.

    """

    kind: str                               # name of the law in controller files
    state_names: tuple[str, ...]            # of ``state_values``
    static_inverse: FloatArray
    learns = True                           # whether it becomes better while it runs
    rules: 'RuleBase | None' = None
    made_for: dict[str, Any] | None = None  # facts of the rig, see ``made_for``
    driver: dict[str, float] | None = None  # numbers of the driver's law it asks for, by name
    other_rig = ''          # how the rig it runs on differs, if that was accepted
    other_valve = ''        # that the preset is made for the other valve, and which is not

    _step: Callable[..., float]
    _arguments: tuple[Any, ...]
    _limits: tuple[FloatArray, FloatArray]

    def __init__(self, settings: dict[str, float], state: 'np.dtype[np.record]',
                 rig_name: str = '') -> None:
        self.settings = settings
        self.rig_name = rig_name
        self.freeze_learning = False
        self.rules_replaced = 0       # times the rules were exchanged from outside
        self._state = zeros(state)
        self._inputs = zeros(INPUT)
        self._outputs = np.zeros(len(self.state_names))
        self._told = self._outputs      # those of ``state_names``

    def __repr__(self) -> str:
        """Return law, rig and rate in one line."""
        return f'{type(self).__name__}({self.rig_name!r}, {self.rate_hz:g} Hz)'

    @property
    def rate_hz(self) -> float:
        """Rate [Hz] at which ``step`` is to be called."""
        return self.settings['rate_hz']

    @property
    def lead_s(self) -> float:
        """Preview [s]: how far ahead the lead reference is to be taken."""
        return self.settings['lead_s']

    def step(self, x_m: float, ref_m: float, ref_vel_m_per_s: float, ref_lead_m: float,
             ref_lead_vel_m_per_s: float, learn: bool = True, elapsed_s: float = math.nan,
             pressure_pa: float = math.nan, force_n: float = math.nan,
             held_back: float = 0.0, age_s: float = 0.0, pressure_age_s: float = 0.0) -> float:
        """
        Run one tick.

        Contraction and reference are finite. What is not stays in the state, so that commands
        are NaN until ``pause``: do not call it without a measurement, and vent.

        Parameters
        ----------
        x_m : float
            Measured contraction [m].
        ref_m, ref_vel_m_per_s : float
            Wanted contraction [m] and rate [m/s] at the time of that measurement.
        ref_lead_m, ref_lead_vel_m_per_s : float
            The same ``lead_s`` ahead of now.
        learn : bool
            Whether the rules may change.
        elapsed_s : float
            Time between the measurements of this and the former tick; NaN: one period.
        pressure_pa, force_n : float
            Measured absolute pressure [Pa] and force [N]; NaN where not known. Used for the
            bumpless start, for freezing the learning, for the lag and dead time of the valve,
            and for the model of the muscle.
        held_back : float
            0 while the driver follows the command. While it vents or limits it, one of the
            codes of ``following``: integral and rules stay as they are then, since the error
            is not theirs.
        age_s, pressure_age_s : float
            Time from the measurement of contraction and pressure to now, 0 or more.

        Returns
        -------
        float
            Wanted muscle pressure, absolute Pa, never below atmosphere.

        """
        write_inputs(
            self._inputs, contraction_m=x_m, reference_m=ref_m,
            reference_rate_m_per_s=ref_vel_m_per_s, lead_reference_m=ref_lead_m,
            lead_rate_m_per_s=ref_lead_vel_m_per_s,
            learning=1.0 if learn and not self.freeze_learning else 0.0, elapsed_s=elapsed_s,
            pressure_pa=pressure_pa, force_n=force_n, held_back=held_back,
            age_s=age_s, pressure_age_s=pressure_age_s)
        return self._step(*self._arguments)

    def step_on_inputs(self) -> float:
        """Run one tick on what ``input_array`` holds; return the command, absolute Pa."""
        return self._step(*self._arguments)

    def limit_pressure(self, highest_pa: float) -> None:
        """Keep the commands below a pressure [absolute Pa] as well; NaN: no such limit."""
        self.limit_commands(-math.inf, highest_pa - P_ATM_PA)

    def limit_commands(self, lowest_gauge_pa: float, highest_gauge_pa: float) -> None:
        """Keep the commands within a range as well as that of the settings; NaN: no limit."""
        lowest, highest = self._limits
        lowest[...], highest[...] = limits_within(
            self.settings, lowest_gauge_pa, highest_gauge_pa)

    def compiled_arguments(self) -> tuple[Any, ...]:
        """Return the arrays the compiled step takes, for compiled closed loops."""
        return self._arguments

    @property
    def input_array(self) -> FloatArray:
        """Return the array of ``compiled_arguments`` that holds the inputs (``inputs.INPUT``)."""
        return self._inputs

    def state_values(self) -> tuple[float, ...]:
        """Return the values of ``state_names`` of the last tick as a tuple of floats."""
        return tuple(self._told.tolist())

    def with_settings(self, settings: Mapping[str, object], rules: 'RuleBase | None' = None
                      ) -> Self:
        """
        Return a fresh controller of the same law and rig with other settings.

        It asks the same of the driver, see ``driver``.

        Parameters
        ----------
        settings : mapping of str
            Those to change, the others stay.
        rules : RuleBase, optional
            Rules to start from; by default its own, where the settings leave them their meaning.

        Raises
        ------
        InputError
            Settings that make no controller, or a law without this method.

        """
        check_mapping(settings, 'settings')
        return hand_on(self, self._fresh({**self.settings, **settings}, rules))

    def _fresh(self, settings: Mapping[str, object], rules: 'RuleBase | None') -> Self:
        """Return a controller of the same law with all these settings; a law writes this."""
        raise InputError(f'a {self.kind} controller takes no other settings; `with_settings` of '
                         f'{type(self).__name__} is to be written', 'controller')

    def learning_reason(self) -> str:
        """Return in words whether the last tick learned, or why not."""
        raise NotImplementedError

    def take_rules(self, rules: 'RuleBase', where: str = 'rules') -> None:
        """
        Begin with the rules of a file.

        Raises
        ------
        InputError
            This law has none, or these do not fit.

        """
        raise InputError(f'a {self.kind} controller has no rules', where)

    def replace_rules(self, rules: 'RuleBase', where: str = 'rules') -> None:
        """
        Exchange the rules without a step in the command.

        Raises
        ------
        InputError
            This law has none, or these do not fit.

        """
        raise InputError(f'a {self.kind} controller has no rules', where)

    def reset_rules(self) -> None:
        """Return to the initial rules, if there are any, without a step in the command."""

    def reset(self) -> None:
        """Return to the initial rules and forget the motion."""
        self.pause()

    def pause(self) -> None:
        """Forget the motion, keep the rules: the next tick starts bumplessly."""
        self._state[:] = 0.0
        self._inputs[:] = 0.0
        self._outputs[:] = 0.0

    def to_yaml(self) -> str:
        """Return YAML text from which ``load_controller`` builds an identical controller."""
        return controller_to_yaml(self)

    def file_entries(self) -> dict[str, object]:
        """Return what the file of the controller has besides settings and rules."""
        return {'static_inverse': inverse_to_mapping(self.static_inverse)}
