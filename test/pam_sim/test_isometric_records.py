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

"""The laws against isometric records of a 10 mm muscle, where those records are at hand."""

import importlib.util
from pathlib import Path
import subprocess
import sys

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / 'benchmarks' / 'isometric_records.py'
RECORDS = ROOT.parent / 'shared' / 'data' / 'isometric_10mm_25cm'


sys.path.insert(0, str(PROGRAM.parent))


def program():
    """Return the benchmark as a module."""
    spec = importlib.util.spec_from_file_location('isometric_records', PROGRAM)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_fitted_laws_follow_the_records():
    if not RECORDS.is_dir():
        pytest.skip('the isometric records are not part of this project; see the first lines of '
                    'benchmarks/isometric_records.py for where they come from')
    module = program()
    points, phase = module.read_records(RECORDS)
    assert len(phase) > 100 and 390.0 < points.force_n.max() < 410.0
    fits, _ = module.table(points)
    assert next(iter(fits)) == 'sarosi' and fits['sarosi'].rmse_percent < 2.0
    # The laws proportional to pressure have no threshold: they pull where the muscle was slack.
    for label in ('chou_hannaford', 'situm_herceg', 'tondu_lopez, constant k'):
        assert fits[label].rmse_percent > 5.0 and fits[label].false_force_n > 50.0
    # At a length between those that were fitted, every plateau is within 5 % of the largest force.
    _, quarter, half, _ = module.left_out(points)['sarosi']
    assert quarter[1] < 5.0 and half[1] < 5.0


def test_without_records_there_is_one_sentence(tmp_path):
    done = subprocess.run([sys.executable, PROGRAM, tmp_path], capture_output=True, text=True)
    assert done.returncode == 2 and done.stderr.count('\n') == 1
    assert 'contraction_00.csv: is missing' in done.stderr
