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

"""Check the inputs of a simulation and run the rollout."""

import numpy as np
from pam_sim.errors import InputError
from pam_sim.load import LOADS
from pam_sim.response import Response
from pam_sim.rollout import kernel, layout


def simulate_rig(rig, valve_signal, external_force_n, contraction_m, dt_s, initial):
    """Return the Response; arguments and errors as of ``Rig.simulate``."""
    inputs, start = input_array(rig, valve_signal, external_force_n, contraction_m)
    if start is not None and initial.get('initial_contraction_m') is None:
        initial = {**initial, 'initial_contraction_m': start}
    state, par = rig.pack(dt_s=dt_s, **initial)
    if start is None:
        inputs[:, layout.INP_CONTRACTION] = state[layout.S_CONTRACTION]
    outputs = np.empty((len(inputs) + 1, layout.OUT_SIZE))
    kernel.rollout(state, par, inputs, outputs)
    return Response(outputs)


def input_array(rig, valve_signal, external_force_n=None, contraction_m=None):
    """
    Return (inputs (N, INP_SIZE), contraction at the start or None).

    Raises
    ------
    InputError
        Wrong shape, number not finite, or the contraction of a driven load missing.

    """
    signal = np.asarray(valve_signal, dtype=float)
    wanted = len(rig.signal_names)
    if signal.ndim == 1 and wanted == 1:
        signal = signal[:, np.newaxis]
    if signal.ndim != 2 or signal.shape[1] != wanted or len(signal) == 0:
        shape = '(N,)' if wanted == 1 else '(N, 2)'
        raise InputError(f'has shape {np.shape(valve_signal)}; valve `{rig.valve}` takes {shape}, '
                         'N at least 1', 'valve_signal')
    count = len(signal)
    inputs = np.zeros((count, layout.INP_SIZE))
    inputs[:, :wanted] = signal
    if external_force_n is not None:
        inputs[:, layout.INP_EXTERNAL_FORCE] = _sized(external_force_n, (count,),
                                                      'external_force_n')
    start = None
    if contraction_m is not None:
        if LOADS[rig.load].MOVES_FREELY:
            raise InputError(f'load `{rig.load}` moves freely; use a driven rig', 'contraction_m')
        path = _sized(contraction_m, (count, count + 1), 'contraction_m')
        if path.ndim == 0:
            path = np.full(count + 1, float(path))
        start = float(path[0])
        inputs[:len(path) - 1, layout.INP_CONTRACTION] = path[1:]
        inputs[len(path) - 1:, layout.INP_CONTRACTION] = path[-1]
    elif LOADS[rig.load].NEEDS_CONTRACTION:
        raise InputError('is missing; a driven load needs it', 'contraction_m')
    if not np.isfinite(inputs).all() or (start is not None and not np.isfinite(start)):
        raise InputError('a number is not finite', 'simulation inputs')
    return inputs, start


def _sized(values, lengths, name):
    array = np.asarray(values, dtype=float)
    if array.ndim == 0 or (array.ndim == 1 and len(array) in lengths):
        return array
    raise InputError(f'has shape {array.shape}; one number or {lengths[-1]} expected', name)
