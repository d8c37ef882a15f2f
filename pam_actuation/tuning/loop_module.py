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

"""Closed loops compiled as modules of their own, made anew whenever a part of them changes."""

from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from pam_actuation.tuning import loop_parts
from pam_sim.compiled import Compiled, source_key
from pam_sim.generated import generated_module
from pam_sim.rollout import kernel


def load_loops(name: str, template: str, controllers: Sequence[Compiled[..., float] | ModuleType],
               also: str = '') -> ModuleType:
    """
    Return a template of this folder as a module, compiled for the present code.

    Parameters
    ----------
    name : str
        Of the module, without its hash.
    template : str
        File name.
    controllers : iterable
        Compiled functions of control laws it calls, or modules of such.
    also : str
        What else the machine code depends on.

    """
    source = (Path(__file__).parent / template).read_text(encoding='utf-8')
    key = source_key(loop_parts, kernel, *controllers)
    return generated_module(name, f'# Of sources {key:x} {also}.\n{source}')
