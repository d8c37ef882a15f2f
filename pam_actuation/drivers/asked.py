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
What the file of a controller asks of the driver that follows it: its section ``driver``.

A controller may be tuned behind a driver that does more than the usual one::

    driver: {hsv.correct_by_contraction: 0.8, hsv.pulse_noise_pa: 600}

Only numbers of the law behind a valve can be asked for, never safety limits.
"""

from collections.abc import Mapping
import os

from pam_actuation.drivers.config import DRIVER_PARAMETERS
from pam_sim.located_yaml import load_yaml, Located
from pam_sim.parameters import check_given

_KEY = 'driver'
_ALLOWED = tuple(number for number in DRIVER_PARAMETERS if '.' in number.name)


def asked_in(tree: Located) -> dict[str, float]:
    """
    Return the numbers that a controller file asks for, by name; {} where it asks for none.

    Raises
    ------
    InputError
        An unknown name or a safety limit, or a value out of its range.

    """
    section = tree.get(_KEY, dict)
    return {} if section is None else check_given(
        _ALLOWED, section, 'number of a driver law', tree.where(_KEY))


def asked_by(controller: str | os.PathLike[str]) -> dict[str, float]:
    """
    Return the numbers that a controller asks for, by preset, path of its file, or its text.

    Raises
    ------
    InputError
        As of ``asked_in``, or there is no such controller.

    """
    text = os.fspath(controller)
    if '\n' in text:
        # Read only where the word is there: a file of rules takes 0.1 s.
        return asked_in(load_yaml(text, name='controller text')) if _KEY in text else {}
    from pam_actuation.resources import find_config
    return asked_in(load_yaml(find_config('controllers', text)))


def asked_in_recording(metadata: Mapping[str, str]) -> dict[str, float]:
    """Return what the controller of a recording asked for; ``metadata``: ``pam_experiment``."""
    text = metadata.get('controller', '')
    return asked_by(text) if '\n' in text else {}
