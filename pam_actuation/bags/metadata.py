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

"""What a bag says about its experiment: the ``pam_experiment`` record."""

from collections.abc import Mapping
import importlib.metadata
import json
from typing import Any

from pam_actuation.bags.ending import Ending
from pam_sim.errors import InputError
from pam_sim.valve import VALVES

# Units of the values on the wire, per topic; the text goes into every bag.
UNITS = (
    'pressure, pressure_command, followed_pressure, supply_pressure: Pa absolute; '
    'contraction, reference, reference_trajectory: m, m/s; '
    'force, external_force: N; external_torque: N m; '
    'valve_signal, valve_command: ppr_voltage V, fill_duty and vent_duty 1; '
    'time: header.stamp, ns'
)

# Text that says which topics of the rig the file has under other names; see ``names_text``.
TOPIC_NAMES = 'topic_names'
# Text that gives the name of a joint in messages, where that is not the end of its namespace.
OWN_NAME = 'name_in_messages'
_ANY_MUSCLE = 'muscle'


def names_text(names: Mapping[str, str]) -> str:
    """Return the text ``topic_names`` of {full name: name in the file}, '' for none."""
    return json.dumps(names) if names else ''


def names_of(metadata: Mapping[str, str]) -> dict[str, str]:
    """Return what a text of ``names_text`` says; {} where there is none, or one of others."""
    try:
        names = json.loads(metadata.get(TOPIC_NAMES, '{}'))
    except ValueError:
        return {}
    if not isinstance(names, dict) or not all(
            isinstance(name, str) and name.startswith('/') for name in names.values()):
        return {}
    return names


def own_name(name: str, namespace: str) -> dict[str, str]:
    """Return the text that tells the name of a joint in messages, {} for the usual one."""
    return {} if name in (namespace.rpartition('/')[2], _ANY_MUSCLE) else {OWN_NAME: name}


def name_of(metadata: Mapping[str, str], namespace: str) -> str:
    """Return the name of a joint in messages: what its recorder told, else of its namespace."""
    return metadata.get(OWN_NAME, '') or namespace.rpartition('/')[2]


def software_version() -> str:
    """Return the version of the installed package, 'unknown' in a bare source tree."""
    try:
        return importlib.metadata.version('pam_actuation')
    except importlib.metadata.PackageNotFoundError:
        return 'unknown'


def experiment_metadata(experiment: Any = None, rig: Any = None, controller: Any = None,
                        valve: str = '', seed: int | None = None, experiment_name: str = '',
                        **more: object) -> dict[str, str]:
    """
    Return the texts of the ``pam_experiment`` record.

    Parameters
    ----------
    experiment, rig, controller : object or str, optional
        YAML text, or anything with ``to_yaml()``; left out where there is none. An
        experiment with ``duration_s`` says the planned length.
    valve : str
        'ppr' or 'hsv'; by default that of the rig.
    seed : int, optional
        Seed of the simulated sensors.
    experiment_name : str
        By default the name of the experiment.
    more : str
        Further texts, kept under their own keys (``origin='live'``).

    Raises
    ------
    InputError
        Unknown valve type.

    """
    valve = valve or getattr(rig, 'valve', '')
    if valve and valve not in VALVES:
        raise InputError(f'valve type {valve!r} is unknown, give ppr or hsv', 'valve')
    texts = {
        'experiment_name': experiment_name or str(getattr(experiment, 'name', '')),
        'valve': valve,
        'software_version': software_version(),
        'seed': '' if seed is None else str(int(seed)),
        'units': UNITS,
        'experiment': _yaml(experiment),
        'rig': _yaml(rig),
        'controller': _yaml(controller),
        'controller_other_rig': getattr(controller, 'other_rig', ''),
        **Ending(getattr(experiment, 'duration_s', None)).texts(),
    }
    texts.update({key: str(value) for key, value in more.items()})
    return {key: text for key, text in texts.items() if text}


def _yaml(thing: Any) -> str:
    if thing is None:
        return ''
    return thing if isinstance(thing, str) else thing.to_yaml()
