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
YAML text of a controller, from which ``config.load_controller`` builds it again.

It knows no class of a controller, so that each of them can write itself.
"""

from collections.abc import Mapping
import os
from typing import Any, Protocol

from pam_actuation.control.sofc.rule_text import RuleNumbers, rules_to_mapping
from pam_sim.located_yaml import dump_yaml

INDEX_FORMS = ('linear', 'table')       # of the performance index, in the order of its numbers


class Written(Protocol):
    """What the text of a controller is made from."""

    @property
    def kind(self) -> str:
        """Return the name of the law in controller files."""

    @property
    def rig_name(self) -> str:
        """Return the identity of the rig."""

    @property
    def made_for(self) -> Mapping[str, object] | None:
        """Return facts of the rig, see ``made_for``."""

    @property
    def driver(self) -> Mapping[str, float] | None:
        """Return the numbers of the driver's law it asks for, by name."""

    @property
    def settings(self) -> Mapping[str, float]:
        """Return the settings by name."""

    @property
    def rules(self) -> RuleNumbers | None:
        """Return the rules, None of a law without rules."""

    def file_entries(self) -> dict[str, object]:
        """Return what the file of this kind of controller has besides settings and rules."""


def controller_to_yaml(controller: Written,
                       rules_file: str | os.PathLike[str] | None = None) -> str:
    """
    Return YAML text that rebuilds a controller bit for bit, its present rules included.

    A recording keeps this text, so that it can be replayed without rig, preset or rule file.
    With ``rules_file`` the text names that file, to lie in the same folder, instead.
    """
    settings: dict[str, Any] = dict(controller.settings)
    if 'index_form' in settings:
        settings['index_form'] = INDEX_FORMS[int(round(settings['index_form']))]
    data = {
        'controller': controller.kind, 'rig': controller.rig_name,
        **({'made_for': dict(controller.made_for)} if controller.made_for else {}),
        **({'driver': dict(controller.driver)} if controller.driver else {}),
        'settings': settings, **controller.file_entries()}
    if controller.rules is not None and rules_file is not None:
        data['rules'] = os.path.basename(rules_file)
    elif controller.rules is not None:
        data['initial_rules'] = rules_to_mapping(controller.rules)
    return dump_yaml(data)
