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

"""``pam identify`` as a command."""

import json
import re
import shlex

from jsonschema import Draft202012Validator
from made_records import RIG, spring
from pam_actuation.bags.load import load_run
from pam_actuation.cli.main import main
from pam_actuation.report.identify import page
from pam_sim import load_rig
from pam_sim.identify.result import Identification
from pam_sim.identify.schema import identify_schema
from pam_sim.run import Run
import pytest

EXPERIMENT = """\
name: stairs
description: Steps of the pressure
domain: pressure
needs: [pressure, contraction]
segments:
  - step: {to_pa: 151325.0, duration_s: 0.6}
  - step: {to_pa: 501325.0, duration_s: 0.6}
  - step: {to_pa: 301325.0, duration_s: 0.6}
"""


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    folder = tmp_path_factory.mktemp('identify')
    (folder / 'stairs.yaml').write_text(EXPERIMENT)
    (folder / 'rig.yaml').write_text(RIG.with_(
        parameters={'mass_kg': 3.3}, effects=[spring(700.0)],
        sensors={'pressure_noise_pa': 500.0, 'contraction_noise_m': 2e-5, 'force_noise_n': 0.2}
    ).to_yaml())
    assert main(['simulate', str(folder / 'stairs.yaml'), '--rig', str(folder / 'rig.yaml'),
                 '--out', str(folder / 'bag')]) == 0
    return folder / 'bag'


def test_what_is_found_is_written_and_loads(bag, tmp_path, capsys):
    given = tmp_path / 'what is given.yaml'
    given.write_text('rig: dmsp_5_300_hanging_mass\ntolerance: {mass_kg: unknown}\n')
    out = tmp_path / 'what is found'
    assert main(['identify', str(bag), '--rig', str(given), '--unknown', 'spring_n_per_m',
                 '--out', str(out)]) == 0
    said = capsys.readouterr().out
    assert 'mass_kg' in said and 'determined' in said
    assert shlex.split(said.rpartition('next: ')[2]) == [
        'pam', 'gap', str(bag), '--model', str(out / 'rig.yaml'), '--out', 'gap']
    data = json.loads((out / 'identify.json').read_text())
    assert {n['name']: n['status'] for n in data['numbers']} == {
        'mass_kg': 'determined', 'spring_n_per_m': 'determined'}
    Draft202012Validator(identify_schema()).validate(data)
    page = (out / 'report.html').read_text()
    assert '2 of 2 unknown numbers are determined' in page and page.count('class="plot"') == 2
    rig = load_rig(str(out / 'rig.yaml'))
    assert rig.parameters['mass_kg'] == pytest.approx(3.3, rel=0.01)
    assert not (out / 'next_experiment.yaml').exists()
    assert main(['identify', str(bag), '--rig', str(given), '--out', str(out)]) == 2
    assert 'exists already' in capsys.readouterr().err
    assert load_run(str(bag)).topics


@pytest.mark.parametrize('options, said', [
    (['--rig', 'dmsp_5_300_hanging_mass'], 'no number is unknown'),
    (['--rig', 'dmsp_5_300_hanging_mass', '--unknown', 'mas_kg'], 'did you mean `mass_kg`'),
    (['--rig', 'dmsp_5_300_hanging_mass', '--unknown', 'mass_kg', '--added-kg', '-1'], '0 to 500'),
    (['--rig', 'dmsp_5_300_isometric', '--unknown', 'K_m', '--added-kg', '1'],
     'added mass: 1 kg hung on load `isometric`, which has no mass'),
    (['--rig', 'dmsp_99', '--unknown', 'mass_kg'], 'dmsp_99')])
def test_a_mistake_is_one_line_and_exit_code_2(bag, options, said, capsys, tmp_path):
    assert main(['identify', str(bag), *options, '--out', str(tmp_path / 'found')]) == 2
    err = capsys.readouterr().err
    assert said in err and len(err.strip().splitlines()) == 1
    assert not (tmp_path / 'found').exists()


def test_the_next_experiment_is_run_on_the_rig_that_was_recorded(bag, tmp_path, capsys,
                                                                 monkeypatch):
    """The rig of the bag is a file of its own, so what was found of it is simulated."""
    def identify(runs, rig, *_, **__):
        return Identification(rig, [], [], [], {}, False, [], next_experiment={
            'name': 'stairs_with_more_mass', 'why': 'the same steps', 'determines': [],
            'experiment': {'name': 'stairs'}, 'added_kg': 1.2, 'needs_force': True})
    monkeypatch.setattr('pam_sim.identify.identify', identify)
    out = tmp_path / 'found'
    assert main(['identify', str(bag), '--rig', 'dmsp_5_300_hanging_mass', '--out', str(out)]) == 0
    *_, before, following = capsys.readouterr().out.splitlines()
    assert before.startswith('before it: put 1.2 kg more into `mass_kg` of a copy of ')
    assert following == (f'next: pam run {out / "next_experiment.yaml"} '
                         f'--rig {out / "rig.yaml"}')


@pytest.mark.parametrize('added_kg, taken, told', [
    ([], ['BAG', 'BAG'], ''),
    (['0', '2'], ['BAG'], 'no added mass: it takes the recordings without one'),
    (['2', '2'], ['RUN'], 'no added mass: RUN is one without it')])
def test_a_gap_is_looked_for_without_added_masses_and_read_as_here(
        added_kg, taken, told, bag, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr('pam_sim.identify.identify', lambda runs, rig, *_, **__: Identification(
        rig, [], [], [], {}, False, []))
    out, reading = tmp_path / 'found', ['--namespace', '/muscle', '--topic', 'force=/muscle/force']
    assert main(['identify', str(bag), str(bag), '--rig', 'dmsp_5_300_hanging_mass', *reading,
                 *(['--added-kg', *added_kg] if added_kg else []), '--out', str(out)]) == 0
    said, _, following = capsys.readouterr().out.rpartition('next: ')
    assert shlex.split(following) == [
        'pam', 'gap', *(str(bag) if one == 'BAG' else one for one in taken), *reading,
        '--model', str(out / 'rig.yaml'), '--out', 'gap']
    assert told in said and ('added mass' in said) == bool(told)


def test_a_recording_on_the_page_has_the_kind_of_all_its_stretches():
    records = [{'path': path, 'kind': kind, 'added_kg': 0.0} for path, kind in (
        ('a', 'valve'), ('a', 'valve'), ('b', 'valve'), ('b', 'muscle and load'))]
    result = Identification(RIG, [], [], records, {}, False, [])
    html = page(result, [Run({}, path=p) for p in 'ab'])
    assert re.findall('<th[^>]*>(recording [^<]*)', html) == [
        'recording 1: valve', 'recording 2: valve, muscle and load']


def test_a_preset_gets_the_valve_of_the_recording_and_a_file_must_state_it(
        bag, tmp_path, capsys, monkeypatch):
    valves = []

    def identify(runs, rig, *_, **__):
        valves.append(rig.valve)
        return Identification(rig, [], [], [], {}, False, [])
    rig = tmp_path / 'rig.yaml'
    rig.write_text('rig: dmsp_5_300_hanging_mass\nvalve: ppr\ntolerance: {mass_kg: unknown}\n')
    of_pair = str(tmp_path / 'of_pair')
    assert main(['simulate', str(bag.parent / 'stairs.yaml'), '--rig',
                 'dmsp_5_300_hanging_mass', '--valve', 'hsv', '--out', of_pair]) == 0
    with monkeypatch.context() as patched:
        patched.setattr('pam_sim.identify.identify', identify)
        for path in (of_pair, str(bag)):
            assert main(['identify', path, '--rig', 'dmsp_5_300_hanging_mass']) == 0
    assert valves == ['hsv', 'ppr']
    capsys.readouterr()
    assert main(['identify', of_pair, '--rig', str(rig)]) == 2
    assert 'of a rig with valve hsv, the model has ppr' in capsys.readouterr().err
