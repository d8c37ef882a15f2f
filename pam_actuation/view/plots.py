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

"""Which signals the page draws, in which plot and in which unit."""

from dataclasses import dataclass
import math

from pam_sim.units import P_ATM_PA


@dataclass(frozen=True)
class Plot:
    """One plot: its title and the unit of its axis."""

    key: str
    title: str
    unit: str


@dataclass(frozen=True)
class Signal:
    """
    One line of a plot.

    Parameters
    ----------
    plot : str
        Key of its plot.
    topic : str
        Short name of the topic, or ``DERIVED`` for what is calculated from two of them.
    value : str
        Name of the value in the messages of the topic.
    label : str
        What the page calls it.
    factor, offset : float
        Shown is ``factor * (value + offset)``: SI to the unit of the plot.

    """

    plot: str
    topic: str
    value: str
    label: str
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Difference:
    """An error: ``wanted`` minus ``measured``, both values of topics by short name, SI."""

    value: str
    wanted: tuple[str, str]
    measured: tuple[str, str]


DERIVED = 'error'
_MM, _KPA, _DEGREES = 1e3, 1e-3, 180.0 / math.pi

PLOTS = (
    Plot('angle', 'Angle', '°'),
    Plot('contraction', 'Contraction', 'mm'),
    Plot('angle_error', 'Angle error', '°'),
    Plot('error', 'Error', 'mm'),
    Plot('pressure', 'Pressure, gauge', 'kPa'),
    Plot('voltage', 'Valve signal', 'V'),
    Plot('duty', 'Valve signal', 'duty'),
    Plot('force', 'Force', 'N'),
    Plot('force_error', 'Force error', 'N'),
    Plot('torque', 'Torque', 'N m'),
    Plot('rules', 'Rules, part of the command', 'kPa'),
    Plot('supply', 'Supply pressure, gauge', 'kPa'),
)
# What is wanted stands first: it is drawn below what is measured.
SIGNALS = (
    Signal('angle', 'joint_reference', 'angle_rad', 'reference', _DEGREES),
    Signal('angle', 'joint_state', 'angle_rad', 'angle', _DEGREES),
    Signal('contraction', 'reference', 'contraction_m', 'reference', _MM),
    Signal('contraction', 'contraction', 'contraction_m', 'contraction', _MM),
    Signal('angle_error', DERIVED, 'angle_error_rad', 'error', _DEGREES),
    Signal('error', DERIVED, 'error_m', 'error', _MM),
    Signal('pressure', 'pressure_command', 'pressure_pa', 'command', _KPA, -P_ATM_PA),
    Signal('pressure', 'co_contraction', 'pressure_pa', 'co-contraction', _KPA, -P_ATM_PA),
    Signal('pressure', 'pressure', 'pressure_pa', 'pressure', _KPA, -P_ATM_PA),
    Signal('voltage', 'valve_signal', 'ppr_voltage', 'voltage'),
    Signal('duty', 'valve_signal', 'fill_duty', 'fill'),
    Signal('duty', 'valve_signal', 'vent_duty', 'vent'),
    Signal('force', 'reference', 'force_n', 'reference'),
    Signal('force', 'force', 'force_n', 'force'),
    Signal('force', 'external_force', 'force_n', 'disturbance'),
    Signal('force_error', DERIVED, 'force_error_n', 'error'),
    Signal('torque', 'joint_state', 'torque_n_m', 'torque'),
    Signal('torque', 'external_torque', 'torque_n_m', 'disturbance'),
    Signal('rules', 'controller_state', 'feedback_rules_pa', 'feedback', _KPA),
    Signal('rules', 'controller_state', 'feedforward_rules_pa', 'feed-forward', _KPA),
    Signal('rules', 'controller_state', 'motion_rules_pa', 'motion', _KPA),
    Signal('supply', 'supply_pressure', 'pressure_pa', 'supply', _KPA, -P_ATM_PA),
)
DIFFERENCES = (
    Difference('error_m', ('reference', 'contraction_m'), ('contraction', 'contraction_m')),
    Difference('force_error_n', ('reference', 'force_n'), ('force', 'force_n')),
    Difference('angle_error_rad', ('joint_reference', 'angle_rad'), ('joint_state', 'angle_rad')),
)
# Where the rules of a controller act, for their surfaces.
PLACES = {'controller_state': ('error_m', 'change_of_error_m_per_s', 'lead_reference_m',
                               'lead_reference_m_per_s')}
# Short name of a topic to the values kept of it.
KEPT = {topic: (*dict.fromkeys(one.value for one in SIGNALS if one.topic == topic),
                *PLACES.get(topic, ()))
        for topic in dict.fromkeys(one.topic for one in SIGNALS if one.topic != DERIVED)}
