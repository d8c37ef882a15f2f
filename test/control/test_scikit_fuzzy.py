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

"""The inference beside scikit-fuzzy, where that is installed, and its benchmark."""

import importlib
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.filterwarnings(        # raised inside scikit-fuzzy
    'ignore:Passing more than 2 positional arguments:DeprecationWarning')
FOLDER = Path(__file__).resolve().parents[2] / 'benchmarks'


@pytest.fixture
def benchmark(monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    return importlib.import_module('fuzzy_inference')


@pytest.mark.parametrize('rules', ('rules', 'linear_rules'))
def test_degrees_strengths_and_outputs_are_those_of_scikit_fuzzy(benchmark, rules):
    pytest.importorskip('skfuzzy')
    pytest.importorskip('networkx')       # which scikit-fuzzy needs and does not bring
    found = benchmark.differences(getattr(benchmark, rules)(), count=12)
    assert found['degree'] < 1e-12 and found['strength'] < 1e-12
    assert 0.0 <= found['output'] < 1e-6


def test_functions_alone_give_the_same(benchmark):
    pytest.importorskip('skfuzzy')
    pytest.importorskip('networkx')
    table = benchmark.linear_rules()
    output = benchmark.with_functions(table)
    for error, change in benchmark.inputs(20).T:
        assert output(error, change) == pytest.approx(
            benchmark.infer(np.stack([table, table]), error, change), abs=1e-6)


def test_the_measured_steps_learn(benchmark):
    controller = benchmark.load_controller(
        'sofc_untuned', benchmark.load_rig('dmsp_5_300_hanging_mass'))
    before = controller.rules.digest()
    given = benchmark.motion(3000, controller.lead_s)
    learned = benchmark.steps(controller, *given)
    assert learned > 1500 and controller.rules.digest() != before
