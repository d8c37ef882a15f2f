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
A signal in another unit than it is called: the model says how large it should be.

A table may call its cm mm, or its kgf N. Such values are possible, so no check of the values sees
it. A gap of just that factor throughout is told with the units that would explain it.
"""

from collections.abc import Mapping
import math

import numpy as np
from pam_sim.annotations import FloatArray
from pam_sim.gap.result import Trace
from pam_sim.units import INCH_M, KGF_N, LBF_N, P_ATM_PA, PSI_PA

KGF, LBF, INCH, PSI = 1.0 / KGF_N, 1.0 / LBF_N, 1e-3 / INCH_M, 1e5 / PSI_PA
# By signal: factor on the true value, and what would cause it.
FACTORS = {
    'pressure': {0.1: 'MPa called bar', 10.0: 'bar called MPa', PSI: 'psi called bar',
                 1.0 / PSI: 'bar called psi', 100.0 / PSI: 'kPa called psi',
                 PSI / 100.0: 'psi called kPa', -1.0: 'a sign turned round'},
    'contraction': {0.1: 'cm called mm', 10.0: 'mm called cm', INCH: 'inches called mm',
                    1.0 / INCH: 'mm called inches', 1e-3: 'm called mm', 1e3: 'mm called m',
                    -1.0: 'a sign turned round'},
    'force': {KGF: 'kgf or daN called N', 1.0 / KGF: 'N called kgf', LBF: 'lbf called N',
              1.0 / LBF: 'N called lbf', 1e-3: 'kN called N',
              1e3: 'N called kN', -1.0: 'a sign turned round'}}
NEAR = 0.04                  # of a factor, and no nearer to another one
LEFT = 0.2                   # of a signal (rms) that the factor may leave
OFF_PA = 5e3                 # from one atmosphere: weather, height and the zero of a sensor


def unit_remarks(traces: Mapping[str, Trace]) -> list[str]:
    """
    Return a sentence on each signal that the given model follows but for its unit.

    Parameters
    ----------
    traces : dict of str -> Trace
        Measured and simulated signals, SI, pressures absolute.

    """
    found = []
    for signal, trace in traces.items():
        zero = P_ATM_PA if signal == 'pressure' else 0.0
        measured, model = trace.measured - zero, trace.before - zero
        if signal == 'pressure' and _is_atmosphere(measured - model):
            found.append('The measured pressure is one atmosphere above that of the given model '
                         'throughout. Are absolute values called gauge?')
            continue
        square = float(model @ model)
        factor = float(measured @ model) / square if square > 0.0 else 1.0
        left = float(np.linalg.norm(measured - factor * model))
        if left > LEFT * float(np.linalg.norm(measured)):
            continue
        nearest = min(FACTORS[signal], key=lambda one: _apart(factor, one))
        if _apart(factor, nearest) < NEAR:
            found.append(f'The measured {signal} is {factor:.3g} times that of the given model '
                         f'throughout, as of {FACTORS[signal][nearest]}. Look at its unit.')
    return found


def _is_atmosphere(off_pa: FloatArray) -> bool:
    """Return whether a pressure is off by one atmosphere, and by nothing else."""
    middle = float(np.median(off_pa))
    return abs(middle - P_ATM_PA) < OFF_PA and float(np.median(np.abs(off_pa - middle))) < OFF_PA


def _apart(factor: float, other: float) -> float:
    """Return how far two factors are apart, by their logarithms; far where signs differ."""
    return abs(math.log(factor / other)) if factor * other > 0.0 else math.inf
