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

"""What a rig cannot follow is said before an experiment runs, and in the bag."""

import math
from types import SimpleNamespace

from pam_actuation.bags.info import bag_info
from pam_actuation.cli.common import load_setup, tell_remarks
from pam_actuation.cli.main import build_parser, main
from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.limits import unknown_remarks
from pam_actuation.resources import list_config
from pam_sim import load_rig
from pam_sim.joint import load_joint
import pytest

RIG = 'dmsp_5_300_realistic'
FAR = """
name: far
domain: contraction
segments:
  - ramp: {to_m: 0.01, duration_s: 1.0}
  - ramp: {to_m: 0.06, duration_s: 1.0}
  - hold: {duration_s: 2.0}
"""
JUMPING = """
name: jumping
domain: contraction
segments:
  - ramp: {to_m: 0.012, duration_s: 1.0}
  - sine: {center_m: 0.012, amplitude_m: 0.006, frequency_hz: 1.0, cycles: 1}
  - step: {to_m: 0.014, duration_s: 0.5}
  - rest: {duration_s: 0.5}
"""


@pytest.fixture(scope='module')
def rig():
    return load_rig(RIG)


def test_a_reference_out_of_reach_is_said_with_what_is_reached(rig):
    said, = load_experiment(FAR).remarks('ppr', rig)
    reach_mm = 1e3 * rig.static_contraction_m(101_325.0 + 600e3)
    assert 25.0 < reach_mm < 35.0
    for words in ('up to 60.0 mm', '600 kPa gauge', f'{reach_mm:.1f} mm at most', '% of the time'):
        assert words in said, said
    # A controller may keep the pressure lower.
    controller = SimpleNamespace(settings={'max_pressure_gauge_pa': 400e3})
    said, = load_experiment(FAR).remarks('ppr', rig, controller)
    assert '400 kPa gauge' in said
    # And so does the supply of on/off valves.
    weak = rig.with_(valve='hsv', parameters={'supply_pa': 401_325.0})
    assert '300 kPa gauge' in load_experiment(FAR).remarks('hsv', weak)[0]
    assert '300 kPa gauge' not in load_experiment(FAR).remarks('ppr', rig)[0]


def test_jumps_between_parts_are_said_with_place_and_size(rig):
    first, last = load_experiment(JUMPING).remarks('ppr', rig)
    assert 'from 12 to 6 mm at 1 s, where `sine` begins' in first and 'ramp to its start' in first
    assert 'from 14 to 0 mm at 2.5 s, where `rest` begins' in last      # the step is meant


def test_shipped_experiments_have_nothing_to_remark():
    names = list_config('experiments')
    assert len(names) > 20
    joint = load_joint('joint_dmsp_5_300_realistic')
    for name in names:
        experiment = load_experiment(name)
        for valve in ('ppr', 'hsv'):
            rig = joint if experiment.domain == 'joint_angle' else load_rig(RIG, valve=valve)
            said = [text for text in experiment.remarks(valve, rig) if 'leak' not in text]
            assert not said, (name, said)


def test_it_is_said_before_and_kept_in_the_bag(tmp_path, rig, capsys):
    path = tmp_path / 'both.yaml'
    path.write_text(JUMPING.replace('0.014', '0.05'))
    wanted = load_experiment(path).remarks('ppr', rig, load_controller('sofc_ppr', rig))
    assert len(wanted) == 3
    tell_remarks(SimpleNamespace(json=False), load_experiment(path), 'ppr', rig)
    assert [line.removeprefix('remark: ') for line in capsys.readouterr().err.splitlines()] == [
        *wanted]
    assert main(['simulate', str(path), '--out', str(tmp_path / 'bag')]) == 0
    said = capsys.readouterr()
    assert all(f'remark: {text}' in said.err for text in wanted)
    assert set(bag_info(tmp_path / 'bag').notes) >= {f'{text}.' for text in wanted}


@pytest.mark.parametrize('experiment, options, said', [
    ('rest', ['--controller', 'pid'], 'rest" runs without a controller, so --controller changes'),
    ('rest', ['--controller', 'sofc_ppr', '--freeze'], '--controller and --freeze change nothing'),
    ('short_sine', ['--controller', 'pid', '--freeze'], 'a pid controller does not learn'),
    ('short_sine', ['--controller', 'ilc_ppr', '--freeze'], ''),
    ('short_sine', ['--freeze'], ''), ('rest', [], '')])
def test_options_of_a_controller_that_change_nothing_are_told(experiment, options, said, capsys):
    args = build_parser('simulate').parse_args(['simulate', experiment, *options])
    args.json = False
    asked, rig, controller = load_setup(args)
    tell_remarks(args, asked, 'ppr', rig, controller)
    printed = capsys.readouterr().err
    assert said in printed and ('nothing' in printed) == bool(said)


def test_a_refusal_stands_alone_and_says_what_to_take(capsys):
    for options, ways in ((['duty_pulses'], '(--valve hsv)'),
                          (['force_sine'], 'as of dmsp_5_300_isometric_realistic')):
        assert main(['simulate', *options]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith('pam simulate: experiment ') and ways in line


def test_nominal_values_of_unknown_numbers_are_said_until_they_are_found(rig):
    unknown = {'spring_n_per_m': math.inf, 'law.a1_n_per_pa': math.inf}
    said, = unknown_remarks(rig.with_(tolerance=unknown))
    assert '(spring_n_per_m, the force law)' in said and 'pam identify' in said
    found = rig.with_(tolerance=unknown, parameters={'spring_n_per_m': 210.0})
    said, = unknown_remarks(found)
    assert '(the force law)' in said
    assert unknown_remarks(rig) == unknown_remarks(None) == ()


def test_tuning_says_it_and_gets_the_range_of_the_rig(tmp_path, capsys):
    (tmp_path / 'lab.yaml').write_text(
        'muscle: {like: dmsp_5_300}\nload: hanging_mass\nvalve: ppr\n'
        'parameters: {K_m: 50000.0, ppr_highest_v: 10.0}\ntolerance: {mass_kg: unknown}\n')
    (tmp_path / 'short.yaml').write_text(
        'name: short\nsegments:\n  - ramp: {to_m: 0.01, duration_s: 1.0}\n'
        '  - sine: {center_m: 0.01, amplitude_m: 0.002, frequency_hz: 1.0, cycles: 2}\n')
    main(['tune', '--model', str(tmp_path / 'lab.yaml'), '--rollouts', '10', '--experiment',
          str(tmp_path / 'short.yaml'), '--check', str(tmp_path / 'short.yaml'), '--jobs', '1',
          '--out', str(tmp_path / 'tuned.yaml')])
    told = capsys.readouterr().err
    assert 'remark: the model has nominal values' in told and '(mass_kg)' in told
    assert 'remark: max_pressure_gauge_pa is 500 kPa instead of 600' in told
    tuned = load_controller(str(tmp_path / 'tuned.yaml'), accept_other_rig=True)
    assert tuned.settings['max_pressure_gauge_pa'] == 5e5
