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

"""A signal in another unit than it is called is told with the units that would explain it."""

from gap_runs import assert_form, nominal, recorded, voltages
import numpy as np
from pam_sim.gap import find_gap
from pam_sim.gap.report.units_seen import FACTORS, unit_remarks
from pam_sim.gap.result import Trace
from pam_sim.run import Run, Series
from pam_sim.units import P_ATM_PA
import pytest

WAVE = 1.0 + 0.5 * np.sin(np.linspace(0.0, 40.0, 2000))
SIZE = {'pressure': 3e5, 'contraction': 0.02, 'force': 90.0}


def trace(signal, factor=1.0, added=0.0, error=0.0):
    """Return the trace of a signal whose measured values are scaled, and otherwise off."""
    zero, model = (P_ATM_PA if signal == 'pressure' else 0.0), SIZE[signal] * WAVE
    wrong = error * SIZE[signal] * np.cos(np.linspace(0.0, 90.0, WAVE.size))
    read = factor * (model + wrong) + added
    return {signal: Trace(np.arange(WAVE.size), zero + read, *[zero + model] * 3)}


@pytest.mark.parametrize('signal, factor, why', [
    (signal, *one) for signal, all_of in FACTORS.items() for one in all_of.items()])
def test_every_unit_is_told_by_its_factor(signal, factor, why):
    # The numbers of a model are known to some percent, and an effect may be missing.
    said, = unit_remarks(trace(signal, 1.012 * factor, error=0.1))
    assert f'The measured {signal} is ' in said and f'as of {why}. Look at its unit.' in said


@pytest.mark.parametrize('options', [
    {}, {'factor': 1.3}, {'factor': 0.12}, {'factor': 0.1, 'error': 0.5}, {'error': 0.3}])
def test_what_is_no_unit_is_no_remark(options):
    assert unit_remarks(trace('contraction', **options)) == []


def test_absolute_values_that_are_called_gauge_are_told():
    said, = unit_remarks(trace('pressure', added=P_ATM_PA + 2e3))
    assert 'one atmosphere above' in said
    assert unit_remarks(trace('pressure', added=20e3)) == []


def test_a_force_in_kgf_is_told_beside_the_verdict():
    run = recorded(nominal(), voltages(11.0))
    force = run.topics['force']
    wrong = Series(force.stamp_ns, {'force_n': force.values['force_n'] / 9.81})
    for one, told in ((Run({**run.topics, 'force': wrong}, {}, '/muscle', 'lab'), 1), (run, 0)):
        result = find_gap(one, nominal(), effects=['creep'], unnamed=())
        assert_form(result)
        assert sum('as of kgf or daN called N' in remark for remark in result.remarks) == told
