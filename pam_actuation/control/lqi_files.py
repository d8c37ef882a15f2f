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
The LQI controller in YAML.

::

    controller: lqi
    settings: {integral_weight: 20.0}
    model:                        # optional: by default identified on the rig, in simulation
      rate_hz: 200.0
      delay_ticks: 7
      denominator: [-2.7, 2.5, -0.8]
      numerator: [1.1e-10, 4.0e-10, 0.9e-10]
      contraction_m: 0.014
      pressure_pa: 555000.0

A recording also keeps ``gains`` and ``observer_gains``, what the Riccati equations gave, so that
a replay on another machine has the same bits.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from pam_actuation.control.lqi import LqiController, SETTINGS
from pam_actuation.control.lqi_gains import (
    gains_of_every_tick, MAX_DELAY_TICKS, MAX_ORDER, MODEL, used_numbers)
from pam_actuation.control.lqi_model import identify_on_rig, LinearModel
from pam_sim.annotations import BoolArray, FloatArray
from pam_sim.errors import InputError
from pam_sim.keys import Key, names_of
from pam_sim.located_yaml import Located
from pam_sim.parameters import check_parameters
from pam_sim.records import fields
from pam_sim.rig import Rig

_NUMBERS = (
    Key('rate_hz', float, 'Rate of the model.', required=True, unit='Hz', lower=20.0,
        upper=1000.0),
    Key('contraction_m', float, 'Contraction about which it is linear.', required=True,
        unit='m', lower=-0.1, upper=0.3),
    Key('pressure_pa', float, 'Absolute pressure that holds this contraction.', required=True,
        unit='Pa', lower=0.0, upper=1e7))
_DELAY = Key('delay_ticks', int, 'Dead time in periods of the rate.', required=True, lower=0,
             upper=MAX_DELAY_TICKS)
_LISTS = (
    Key('denominator', list, f'Coefficients of the past contractions, 1 to {MAX_ORDER}.',
        required=True, unit='-', lower=-1e3, upper=1e3),
    Key('numerator', list, 'Coefficients of the past pressures, as many.', required=True,
        unit='m/Pa', lower=-1.0, upper=1.0))
_GAINS = Key('gains', list, 'Gains of a recording, exact to the bit.',
             otherwise='from the Riccati equations', lower=-1e12, upper=1e12)
_OBSERVER = Key('observer_gains', list, 'Gains of the observer of a recording, for each number of '
                'ticks between readings.', otherwise='from the Riccati equations; next to `gains` '
                'without it, those of `gains` at any interval, as before', lower=-1e12, upper=1e12)
KEYS = (Key('model', dict, 'Linear model of the muscle that the gains rest on.',
            otherwise='identified on the rig'), _GAINS, _OBSERVER)
MODEL_KEYS = (_DELAY, *_NUMBERS, *_LISTS)


def lqi_from_tree(tree: Located, rig: Rig | None, settings: Mapping[str, object], rig_name: str,
                  where: Callable[[str], str]) -> LqiController:
    """
    Return the LqiController of a ``Located`` mapping.

    Raises
    ------
    InputError
        A number is missing or out of range, neither model nor rig is given, or the rig
        cannot be identified.

    """
    model = model_of(tree, rig, lambda known: identify_on_rig(
        known, check_parameters(SETTINGS, settings, 'setting', where)['rate_hz']))
    controller = LqiController(model, settings, rig_name, where)
    take_gains(tree, controller, used_numbers(controller.gains), MODEL, gains_of_every_tick)
    return controller


def model_of(tree: Located, rig: Rig | None, identified: Callable[[Rig], LinearModel]
             ) -> LinearModel:
    """Return the linear model of a controller file, else the one identified on the rig."""
    if 'model' in tree:
        return _read_model(tree.require('model', dict))
    if rig is None:
        raise InputError('without a rig the controller text must bring its `model`', tree.where())
    return identified(rig)


def take_gains(
        tree: Located, controller: Any, used: BoolArray, record: 'np.dtype[Any]',
        of_every_tick: Callable[[FloatArray], FloatArray]) -> None:
    """
    Replace the used numbers of the gains of a controller by those of a file, where it has any.

    A file of a version before has one gain of the observer, for readings of every tick. It then
    holds for any interval between readings, as in that version.
    """
    gains, observer = controller.gains, controller.observer
    if 'gains' not in tree:
        return
    before = fields(gains.copy(), record)
    gains[used] = _read_floats(tree, _GAINS, int(used.sum()))
    now = fields(gains, record)
    if (before.order, before.delay_ticks) != (now.order, now.delay_ticks):
        raise tree.error('`gains` are of a model of another order or delay', 'gains')
    observer[:] = (
        _read_floats(tree, _OBSERVER, observer.size) if _OBSERVER.name in tree
        else np.resize(of_every_tick(gains), observer.size))


def _read_model(table: Located) -> LinearModel:
    """Return the model of a file."""
    table.check_keys(names_of(MODEL_KEYS))
    values = {key.name: key.read(table) for key in (*_NUMBERS, _DELAY)}
    order = len(table.require('denominator', list))
    if not 1 <= order <= MAX_ORDER:
        raise table.error(f'`denominator` has {order} numbers; allowed 1 to {MAX_ORDER}',
                          'denominator')
    for key in _LISTS:
        values[key.name] = tuple(_read_floats(table, key, order))
    model = LinearModel(**values)
    if np.max(np.abs(np.roots(np.r_[1.0, model.denominator]))) >= 1.0:
        raise table.error('`denominator` is of an unstable model', 'denominator')
    if not model.gain_m_per_pa > 0.0:
        raise table.error('`numerator` gives no contraction for more pressure', 'numerator')
    return model


def _read_floats(tree: Located, key: Key, count: int) -> list[float]:
    """Return a list of exactly ``count`` numbers within bounds."""
    table = tree.require(key.name, list)
    if len(table) != count:
        raise tree.error(f'`{key.name}` has {len(table)} numbers; expected {count}', key.name)
    return [table.require(i, float, lower=key.lower, upper=key.upper, unit=key.unit)
            for i in range(count)]
