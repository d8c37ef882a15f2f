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

"""What an interactive session shows: short texts, one name for time, a package that lists."""

from dataclasses import dataclass
import subprocess
import sys

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_actuation.tuning.joint_loop import JointLoop
import pam_sim
from pam_sim import load_joint, load_rig
from pam_sim.characterise.points import Points
from pam_sim.errors import InputError
from pam_sim.gap.result import Trace
from pam_sim.run import Run, Series
from pam_sim.short_repr import brief, short_repr
import pytest

START_NS = 10**18


@pytest.fixture
def run():
    """Return a run whose force begins half a second after its pressure."""
    stamp_ns = START_NS + np.arange(100_000) * 1_000_000
    return Run({'pressure': Series(stamp_ns, {'pressure_pa': np.zeros(100_000)},
                                   {'pressure_pa': 'Pa'}),
                'force': Series(stamp_ns[500:], {'force_n': np.ones(99_500)})},
               {'rig': 'x' * 10_000, 'valve': 'ppr'}, '/muscle', 'runs/first')


def test_what_holds_arrays_is_told_in_a_line(run):
    shown = {name: repr(value) for name, value in {
        'run': run, 'series': run['pressure'], 'grid': run.on_grid(),
        'response': load_rig('dmsp_5_300_hanging_mass').simulate(np.full(3000, 4.0)),
        'trace': Trace(*(np.zeros(5000),) * 5)}.items()}
    assert all(len(text) < 500 for text in shown.values()), shown
    assert shown['run'] == (
        "Run('runs/first'; /muscle; 99.999 s; messages: pressure 100000, force 99500; "
        'metadata: rig, valve)')
    assert shown['series'] == 'Series(100000 messages, 0 to 99.999 s: pressure_pa [Pa])'
    assert 'float64[5000]' in shown['trace']
    assert shown['response'].startswith('Response(3001 samples, 0 to 3 s: time_s, pressure_pa')
    joint = load_joint('joint_dmsp_5_300').simulate(*(np.full(50, 1.0),) * 2)
    assert repr(joint).startswith('JointResponse(51 samples') and len(repr(joint)) < 500
    frame = joint.to_dataframe()
    assert len(frame) == 51 and list(frame.columns) == list(joint.as_dict())
    assert (frame['flexor/pressure_pa'] == joint.flexor.pressure_pa).all()


def test_what_runs_is_told_in_a_line():
    rig, joint = load_rig('dmsp_5_300_realistic'), load_joint('joint_dmsp_5_300')
    plant = rig.plant(initial_pressure_pa=3e5)
    plant.step(3.0, steps=10)
    assert repr(plant).startswith("Plant('dmsp_5_300_realistic', ppr, 0.01 s: 3")
    assert repr(joint.plant()).startswith("JointPlant('joint_dmsp_5_300', 0 s: ")
    sine, law = load_experiment('short_sine'), load_controller('pid', rig)
    assert repr(sine) == "Experiment('short_sine', contraction, 6 s)"
    assert repr(law).startswith('PidController(') and repr(law).endswith(', 200 Hz)')
    assert repr(load_controller('sofc_joint_ppr', joint)).startswith('JointController(Self')
    assert repr(ClosedLoop(rig, sine)) == f"ClosedLoop('{rig.name}', ppr, {sine!r}, 200 Hz)"
    assert repr(JointLoop(joint, load_experiment('joint_sine'))).startswith(
        "JointLoop('joint_dmsp_5_300', Experiment('joint_sine', joint_angle, ")


def test_a_short_text_names_what_is_there():
    @short_repr
    @dataclass
    class Found:
        table: dict
        many: list
        text: str
        number: float
        few: tuple = (1, 2)

    found = Found({f'k{i}': np.zeros((3, 2)) for i in range(20)}, list(range(1000)), 'y' * 900,
                  1.0 / 3.0)
    assert repr(found).startswith('Found(table={k0: float64[3, 2], k1: float64[3, 2]')
    assert 'and 12 more' in repr(found) and 'many=<list of 1000>' in repr(found)
    assert '(900 long)' in repr(found) and 'number=0.333333, few=(1, 2))' in repr(found)
    assert brief({}) == '{}' and brief(np.float64(2.0)) == '2' and brief('a') == "'a'"
    fields = Points.__dataclass_fields__
    made = Points(**{name: np.zeros((40, 40)) for name in fields})
    assert len(repr(made)) < 500 and 'float64[40, 40]' in repr(made)


def test_time_is_asked_for_in_one_way(run):
    response = load_rig('dmsp_5_300_hanging_mass').simulate(np.full(10, 1.0))
    for holder in (run['pressure'], run['force'], run.on_grid(), response):
        assert holder.time_s.shape == (len(holder),)
    # All topics of a run count from its earliest stamp.
    assert run['pressure'].time_s[0] == 0.0 and run['force'].time_s[0] == 0.5
    np.testing.assert_array_equal(run['force'].time_s, run['pressure'].time_s[500:])
    # The former way.
    np.testing.assert_array_equal(run['force'].time_s(run.start_ns), run['force'].time_s)
    assert run['force'].time_s()[0] == pytest.approx(1e9 + 0.5)
    with pytest.raises(InputError, match='a part or a copy of `time_s`, .* `series.stamp_ns`'):
        run['force'].time_s[10:20](run.start_ns)
    alone = Series(np.array([7, 9]), {})
    np.testing.assert_allclose(alone.time_s, [0.0, 2e-9])
    # A topic that is in two runs counts from the start of each.
    part = Run({'force': run['force']})
    assert part['force'].time_s[0] == 0.0 and run['force'].time_s[0] == 0.5


def test_a_wrong_name_is_told_with_those_there_are(run):
    with pytest.raises(KeyError, match='did you mean `pressure`'):
        run['presure']
    with pytest.raises(KeyError, match='there are: pressure_pa'):
        run['pressure']['force_n']


def test_the_package_lists_what_there_is_without_loading_it():
    code = 'import sys, pam_sim; print(*dir(pam_sim)); print("numba" in sys.modules)'
    names, loaded = subprocess.run(
        [sys.executable, '-c', code], capture_output=True, text=True).stdout.splitlines()
    assert set(pam_sim.__all__) <= set(names.split()) and loaded == 'False'
    assert {'load_rig', 'load_joint', 'Run', 'Response', 'simulate_batch'} <= set(pam_sim.__all__)
    for name in pam_sim.__all__:
        assert getattr(pam_sim, name).__name__ == name
    with pytest.raises(AttributeError, match='no attribute'):
        pam_sim.load_rigs
