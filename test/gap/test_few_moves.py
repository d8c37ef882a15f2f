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

"""Records with few moves: how they are dealt out, and what `pam gap` makes of them."""

import numpy as np
from pam_sim import load_rig
from pam_sim.gap import find_gap
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.split import (
    BLOCK_S, CERTIFY, FIT, OWN_PROOF, SELECT, SETTLE_S, settling_s, split_of, TEST_BLOCK_S)
from pam_sim.run import Run, Series
from pam_sim.units import P_ATM_PA
import pytest

RATE_HZ = 200.0
MODEL = 'rig: dmsp_5_300_hanging_mass\nvalve: ppr\n'
STICKING = 'rig: dmsp_5_300_realistic\nvalve: ppr\n'


def recorded(volts, delay_s=0.0, seed=1, model=MODEL):
    """Return the Run of a rig with a dead time that is given a command [V] at 200 Hz."""
    rig = load_rig(model)
    if delay_s:
        rig = rig.with_(effects=[{'name': 'valve_dead_time', 'parameters': {'delay_s': delay_s}}])
    response = rig.simulate(np.repeat(volts, 5), initial_pressure_pa=P_ATM_PA + 1e5 * volts[0],
                            initial_signal=float(volts[0]), dt_s=1e-3)
    random, stamps = np.random.default_rng(seed), 10**12 + np.arange(volts.size) * 5 * 10**6
    signals = {'pressure': ('pressure_pa', 300.0), 'contraction': ('contraction_m', 1e-5),
               'force': ('force_n', 0.1)}
    topics = {topic: Series(stamps, {name: getattr(response, name)[:-1:5]
                                     + sd * random.standard_normal(volts.size)})
              for topic, (name, sd) in signals.items()}
    topics['valve_signal'] = Series(stamps, {'ppr_voltage': volts})
    return Run(topics, {}, '/m', 'few moves')


def held(levels, seconds):
    """Return a command [V] that holds levels for some time each."""
    return np.repeat(levels, [int(span * RATE_HZ) for span in seconds])


@pytest.fixture(scope='module')
def step_each_way():
    """Return the Run of one step up and one down, with a dead time of 60 ms."""
    return recorded(held((0.6, 4.5, 0.6), (0.3, 3.0, 3.2)), 0.06)


def test_edges_are_dealt_out_where_they_are_few(step_each_way):
    recording = Recording(step_each_way, 'ppr')
    split = split_of(recording)
    assert split.is_short and split.settle_s == 0.0 and split.test_block_s == split.block_s
    part = split.part_of(recording.time_s['pressure'])
    for at_s in (0.3, 3.3):          # every part sees something of either edge
        edge = (recording.time_s['pressure'] > at_s) & (
            recording.time_s['pressure'] < at_s + len(OWN_PROOF) * split.block_s)
        assert {FIT, SELECT, CERTIFY} <= set(part[edge].tolist())


def test_a_record_with_moves_in_all_blocks_keeps_blocks_of_seconds():
    random = np.random.default_rng(3)
    levels = random.uniform(2.0, 5.0, 60)
    split = split_of(Recording(recorded(held(levels, [0.5] * 60)), 'ppr'))
    assert (split.block_s, split.test_block_s, split.settle_s, split.is_short) == (
        BLOCK_S, TEST_BLOCK_S, SETTLE_S, False)


def test_the_inner_state_of_a_rig_in_motion_is_not_known(step_each_way):
    late = Run({name: Series(one.stamp_ns[80:], {key: v[80:] for key, v in one.values.items()})
                for name, one in step_each_way.topics.items()}, {}, '/m', 'in motion')
    split = split_of(Recording(late, 'ppr'))
    assert split.is_short and split.settle_s == SETTLE_S


def test_a_muscle_that_is_filled_from_empty_is_compared_from_the_start():
    levels = np.random.default_rng(3).uniform(2.0, 5.0, 60)
    run = recorded(held((0.0, *levels), [0.01, *[0.5] * 60]))
    recording = Recording(run, 'ppr')
    assert recording.moves_at_start('pressure')
    split = split_of(recording)
    assert (split.unused_s('pressure'), split.unused_s('force')) == (0.0, SETTLE_S)
    assert recording.start('pressure') < P_ATM_PA + 1e3
    moving = Run({name: Series(one.stamp_ns[10:], {key: v[10:] for key, v in one.values.items()})
                  for name, one in run.topics.items()}, {}, '/m', 'in motion')
    assert settling_s(Recording(moving, 'ppr'), 'pressure') == SETTLE_S


def test_a_dead_time_is_named_on_one_step_each_way(step_each_way):
    rig = load_rig(MODEL)
    result = find_gap(step_each_way, rig, effects=['valve_dead_time', 'tube_lag', 'creep'])
    assert result.verdict == 'effects'
    assert result.ambiguity_set == ['valve_dead_time']
    delay = result.effects[0]['equivalent']['delay_s']
    assert delay['ci95'][0] < 0.06 < delay['ci95'][1]
    assert any('same edges at other moments' in remark for remark in result.remarks)


def test_nothing_is_named_on_one_step_each_way_of_the_model_itself():
    run = recorded(held((0.6, 4.5, 0.6), (0.3, 3.0, 3.2)), seed=2)
    result = find_gap(run, load_rig(MODEL), effects=['valve_dead_time', 'tube_lag', 'creep'])
    assert result.verdict == 'no_gap' and not result.effects


def test_a_model_that_explains_a_long_hold_is_not_spoiled_by_calibration():
    """A muscle that sticks stays where small errors of time leave it, for the whole hold."""
    ramp = np.linspace(0.0, 4.0, int(2 * RATE_HZ))
    run = recorded(np.concatenate([held((0.0,), (1.0,)), ramp, held((4.0,), (20.0,)), ramp[::-1]]),
                   model=STICKING)
    result = find_gap(run, load_rig(STICKING), effects=['valve_dead_time', 'tube_lag', 'creep'])
    assert result.verdict == 'no_gap' and not result.effects and not result.ambiguity_set
    assert any('the given ones, so these stay' in remark for remark in result.remarks)
    assert all(s.rmse_refit < 1.1 * s.noise_floor for s in result.signals.values())
