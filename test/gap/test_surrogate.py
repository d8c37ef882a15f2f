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

"""A model with known effects where nothing is named: better, a file, and without a name."""

from dataclasses import replace
import json

from gap_runs import assert_form, nominal, recorded, voltages
import numpy as np
from pam_actuation.report.gap import save_gap
from pam_sim import load_rig
from pam_sim.effects.unnamed import terms
from pam_sim.gap import find_gap
from pam_sim.gap.propose.surrogate import FILE, in_words
import pytest

# A regulator that swings over, as none of the library does.
SWINGING = {'name': 'set_point_term', 'parameters': {
    'channel_of_1': 2.0, 'first_of_1': 0.5, 'kind_1_of_1': terms.SWING, 'input_1_of_1': 1.0,
    'shape_1_of_1': 0.6}}
NAMES = ['flow_limit', 'tube_lag', 'valve_dead_time']


@pytest.fixture(scope='module')
def swinging():
    """Return recordings of a rig with a regulator that swings over, and of another motion."""
    rig = nominal().with_(effects=[SWINGING])
    return [recorded(rig, voltages(16.0, seed), seed=seed) for seed in (3, 4)]


@pytest.fixture(scope='module')
def found(swinging):
    """Return what is found of it with names that are no cause of it."""
    first, second = swinging
    return find_gap(first, nominal(), second, NAMES, unnamed=['surrogate'])


def rms_kpa(rig, run):
    """Return how far the pressure of a free run is off."""
    signal = run.topics['valve_signal'].values['ppr_voltage']
    pressure = run.topics['pressure'].values['pressure_pa']
    simulated = rig.simulate(np.repeat(signal, 5), initial_pressure_pa=pressure[0]).pressure_pa
    return 1e-3 * float(np.sqrt(np.mean((simulated[:-1:5] - pressure) ** 2)))


def test_a_better_model_without_a_name_is_written(found, swinging, tmp_path):
    first, second = swinging
    surrogate = found.surrogate
    assert found.verdict == 'unknown' and not found.effects
    assert surrogate.names and set(surrogate.names) <= {*NAMES, 'T_m', 'K_m'}
    assert in_words(surrogate.to_dict()) in found.remarks
    assert_form(found)
    save_gap(found, [first], tmp_path, certify=second)
    calibrated, better = (load_rig(tmp_path / name) for name in ('model.yaml', FILE))
    assert not calibrated.effects and better.effects
    assert rms_kpa(better, second) < 0.85 * rms_kpa(calibrated, second)
    told = json.loads((tmp_path / 'gap.json').read_text())['surrogate']
    assert told['file'] == FILE and told['names'] == list(surrogate.names)
    # A later answer that has none takes the file away.
    save_gap(replace(found, surrogate=None), [first], tmp_path, certify=second)
    assert not (tmp_path / FILE).exists()


def test_what_is_named_needs_no_surrogate():
    rig = nominal().with_(effects=[{'name': 'valve_dead_time', 'parameters': {'delay_s': 0.02}}])
    first, second = (recorded(rig, voltages(14.0, seed), seed=seed) for seed in (3, 4))
    found = find_gap(first, nominal(), second, NAMES)
    assert found.verdict == 'effects' and found.surrogate is None


def test_effects_that_do_not_help_make_no_surrogate(swinging):
    first, second = swinging
    found = find_gap(first, nominal(), second, ['creep', 'pressure_lag', 'contraction_bias'],
                     unnamed=['surrogate'])
    assert found.verdict == 'unknown' and found.surrogate is None
