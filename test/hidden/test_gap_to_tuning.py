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

"""A controller on the hidden rig, as benchmarks/gap_to_tuning.py runs it."""

import importlib
from pathlib import Path
import sys

from pam_actuation.bags.load import load_run
from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.report.metrics import run_metrics
from pam_sim import load_rig

FOLDER = Path(__file__).resolve().parents[2] / 'benchmarks'


def test_a_controller_tracks_on_the_hidden_rig_and_feels_what_it_hides(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, 'path', [str(FOLDER), *sys.path])
    benchmark = importlib.import_module('gap_to_tuning')
    nominal, off_mm = load_rig(benchmark.MODEL), {}
    for name in ('nothing', 'hysteresis'):
        numbers = benchmark.hidden_numbers(benchmark.CASES[name], 3)
        bag = simulate_experiment(
            load_experiment('short_sine'), benchmark.hidden_rig(numbers),
            load_controller('sofc_ppr', nominal), tmp_path / name, seed=1)['bag']
        off_mm[name] = 1e3 * run_metrics(load_run(bag)).cycle_rmse_m.mean()
    assert 0.0 < off_mm['nothing'] < 1.0
    assert off_mm['hysteresis'] > 1.5 * off_mm['nothing']
