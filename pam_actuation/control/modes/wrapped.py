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

"""A control law, which works in metres of contraction, made to track something else."""

from collections.abc import Mapping
import copy
from typing import Any, Self

import numpy as np
from pam_actuation.control.compiled_controller import CompiledController, hand_on
from pam_actuation.control.controller_text import controller_to_yaml
from pam_actuation.control.modes.tracked import Tracked
from pam_actuation.control.sofc.rule_table import RuleBase
from pam_actuation.control.static_inverse import static_inverse
from pam_sim.annotations import FloatArray
from pam_sim.shared_memory import SharedMemory
from pam_sim.units import P_ATM_PA


def blank_inverse(nodes: int) -> FloatArray:
    """Return a static inverse of so many nodes that is to be filled: atmosphere everywhere."""
    return static_inverse(0.0, 1.0, np.full(nodes, P_ATM_PA))


def in_mode(rig_name: str, mode: str) -> str:
    """Return the identity of rules: rig and mode, the mode stated once."""
    return rig_name if rig_name.endswith(f'/{mode}') else f'{rig_name}/{mode}'


class WrappedLaw(SharedMemory):
    """
    What all modes share: the law is inside, rules and learning are its own.

    Parameters
    ----------
    law : SelfOrganizingFuzzyController or PidController
        In metres of an equivalent contraction.

    """

    tracked: Tracked
    made_for: dict[str, Any] | None = None      # facts of the rig, see ``control/made_for``
    driver: dict[str, float] | None = None      # numbers of the driver's law it asks for
    other_rig = ''          # how the rig it runs on differs, if that was accepted
    other_valve = ''        # that the preset is made for the other valve, and which is not

    def __init__(self, law: CompiledController) -> None:
        self.law = law

    def __repr__(self) -> str:
        """Return mode and law in one line."""
        return f'{type(self).__name__}({self.law!r})'

    @property
    def kind(self) -> str:
        """Which law it is, as in controller files."""
        return self.law.kind

    @property
    def learns(self) -> bool:
        """Whether the law becomes better while it runs."""
        return self.law.learns

    @property
    def rig_name(self) -> str:
        """Identity of the rig the rules belong to."""
        return self.law.rig_name

    @property
    def static_inverse(self) -> FloatArray:
        """Table of the law, over the equivalent contraction."""
        return self.law.static_inverse

    @property
    def settings(self) -> dict[str, float]:
        """Return the settings of the law, metres being those of the equivalent contraction."""
        return self.law.settings

    @property
    def rate_hz(self) -> float:
        """Rate [Hz] at which ``step`` is to be called."""
        return self.law.rate_hz

    @property
    def lead_s(self) -> float:
        """Preview [s]: how far ahead the lead reference is to be taken."""
        return self.law.lead_s

    @property
    def rules(self) -> RuleBase | None:
        """Rules of the law, None if it has none."""
        return self.law.rules

    @property
    def rules_replaced(self) -> int:
        """Return how often the rules were exchanged from outside."""
        return self.law.rules_replaced

    @property
    def freeze_learning(self) -> bool:
        """Whether the rules are kept as they are."""
        return self.law.freeze_learning

    @freeze_learning.setter
    def freeze_learning(self, value: bool) -> None:
        self.law.freeze_learning = value

    def with_law(self, law: CompiledController) -> Any:
        """Return a controller that tracks the same round another law."""
        raise NotImplementedError

    def with_settings(self, settings: Mapping[str, object],
                      rules: RuleBase | None = None) -> Self:
        """Return a fresh controller with other settings of its law; see ``CompiledController``."""
        # A copy, as a law may share its static inverse, which force mode writes.
        fresh: Self = self.with_law(copy.deepcopy(self.law.with_settings(settings, rules)))
        return hand_on(self, fresh)

    def take_rules(self, rules: RuleBase, where: str = 'rules') -> None:
        """Begin with the rules of a file; as of the law."""
        self.law.take_rules(rules, where)

    def replace_rules(self, rules: RuleBase, where: str = 'rules') -> None:
        """Exchange the rules without a step in the command; as of the law."""
        self.law.replace_rules(rules, where)

    def reset_rules(self) -> None:
        """Return to the initial rules without a step in the command."""
        self.law.reset_rules()

    def limit_pressure(self, highest_pa: float) -> None:
        """Keep the commands below a pressure [absolute Pa] as well; NaN: no such limit."""
        self.law.limit_pressure(highest_pa)

    def learning_reason(self) -> str:
        """Return in words whether the last tick learned, or why not."""
        return self.law.learning_reason()

    def pause(self) -> None:
        """Forget the motion, keep the rules: the next tick starts bumplessly."""
        self.law.pause()

    def reset(self) -> None:
        """Return to the initial rules and forget the motion."""
        self.law.reset()
        self.pause()

    def file_entries(self) -> dict[str, object]:
        """Return what the file of the controller has besides settings and rules."""
        raise NotImplementedError

    def to_yaml(self) -> str:
        """Return YAML text from which ``load_controller`` builds an identical controller."""
        return controller_to_yaml(self)
