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
"""A term without a name: found, proved, written as an effect file that simulates the same."""

import os
import subprocess
import sys

from gap_runs import assert_form, nominal, recorded, voltages
import numpy as np
from pam_sim import load_rig
from pam_sim.effects.unnamed import terms
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.fit.estimator import Estimator
from pam_sim.gap.propose.proposal import NONE, propose
from pam_sim.gap.result import GapResult
from pam_sim.gap.subsystems.problems import subsystem_problems
from pam_sim.located_yaml import dump_yaml
import pytest
import yaml

DRAG_N = -3.0                # at 50 mm/s
DRAG = {'name': 'muscle_term', 'parameters': {
    'first_of_1': DRAG_N, 'kind_1_of_1': terms.SIGNED_SQUARE, 'input_1_of_1': 2.0}}
SCRIPT = """
import sys
import numpy as np
from pam_sim import load_rig
rig = load_rig(sys.argv[1])
np.save(sys.argv[2], rig.simulate(np.linspace(4.0, 5.0, 60), initial_pressure_pa=501325.0).outputs)
"""


def asked(rig):
    """Return the result of a look for a term in a recording of a rig, held to be `unknown`."""
    recording = Recording(recorded(rig, voltages(12.0)), 'ppr')
    estimator = Estimator(nominal(), subsystem_problems(nominal(), [recording], True, 0, CRITERIA))
    result = GapResult('unknown', '', model_yaml=nominal().to_yaml())
    propose(result, estimator, estimator.base, recording, False)
    return result


@pytest.fixture(scope='module')
def drag():
    """Return the result for a rig with drag that no effect of the library has."""
    return asked(nominal().with_(effects=[DRAG]))


def test_the_missing_term_is_found_and_says_what_it_is(drag):
    found = drag.proposal
    assert (found.subsystem, found.file) == ('muscle', 'proposed_effect.py')
    assert found.explained > 0.9 and set(found.ranges) == {'v'}
    assert 'Unnamed, its form found from data; it holds for v' in drag.remarks[-1]
    assert_form(drag)


def test_its_file_loads_and_simulates_as_the_term_does(drag, tmp_path):
    (tmp_path / 'proposed_effect.py').write_text(drag.proposal.text)
    (tmp_path / 'model.yaml').write_text(drag.proposal.model_yaml)
    flat = tmp_path / 'out.npy'
    answer = subprocess.run(
        [sys.executable, '-c', SCRIPT, str(tmp_path / 'model.yaml'), str(flat)],
        capture_output=True, text=True, timeout=200,
        env={**os.environ, 'PAM_EFFECTS_PATH': str(tmp_path), 'NUMBA_DISABLE_JIT': '1',
             'PYTHONPATH': os.pathsep.join(sys.path), 'PAM_CACHE_DIR': str(tmp_path / 'cache')})
    assert answer.returncode == 0, answer.stderr
    tried = {**yaml.safe_load(drag.proposal.model_yaml), 'effects': [drag.proposal.trial]}
    same = load_rig(dump_yaml(tried)).simulate(
        np.linspace(4.0, 5.0, 60), initial_pressure_pa=501325.0).outputs
    assert np.allclose(np.load(flat), same, rtol=1e-6, atol=1e-9)


def test_noise_alone_has_no_term():
    result = asked(nominal())
    assert result.proposal is None and result.remarks == [NONE]
