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

"""How well the numbers of a rig are known: relatively, absolutely, not at all."""

import json
import math

from pam_actuation.bags.metadata import experiment_metadata
from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.gap.subsystems.known import known_numbers
from pam_sim.tolerance import AbsoluteSd, UNKNOWN
import pytest

RIG = """\
muscle: dmsp_5_300
load: hanging_mass
valve: ppr
parameters: {mass_kg: 3.2}
tolerance: {mass_kg: unknown, T_m: {sd: 0.004}, K_m: 0.1}
"""


def made(tmp_path, text=RIG):
    path = tmp_path / 'rig.yaml'
    path.write_text(text)
    return load_rig(str(path))


def test_a_number_is_known_relatively_absolutely_or_not_at_all(tmp_path):
    rig = made(tmp_path)
    assert rig.unknown == ('mass_kg',) and rig.tolerance['mass_kg'] == UNKNOWN
    assert rig.prior_sd('T_m') == 0.004 and rig.prior_sd('K_m') == pytest.approx(10e3)
    # A scale from 0.1 to 500 kg: half of the range of its logarithm.
    assert rig.prior_sd('mass_kg') == pytest.approx(3.2 * math.log(5000.0) / 2)
    with pytest.raises(InputError, match='unknown parameter `mass`; allowed: .*mass_kg'):
        rig.prior_sd('mass')
    assert load_rig('dmsp_5_300_hanging_mass').unknown == ()


def test_the_notation_survives_text_copies_and_the_metadata_of_a_bag(tmp_path):
    rig = made(tmp_path)
    again = made(tmp_path, rig.to_yaml())
    assert again.tolerance == rig.tolerance and again.to_yaml() == rig.to_yaml()
    assert 'mass_kg: unknown' in rig.to_yaml()
    changed = rig.with_(tolerance={'mass_kg': AbsoluteSd(0.1)}, valve='hsv')
    assert changed.unknown == () and changed.prior_sd('mass_kg') == 0.1
    assert changed.prior_sd('T_m') == 0.004
    from pam_actuation.experiments import load_experiment
    metadata = experiment_metadata(load_experiment('rest'), rig, None, 'ppr', 0, origin='test')
    assert 'unknown' in json.dumps(metadata, allow_nan=False)


def test_the_gap_workflow_gives_an_unknown_number_a_wide_prior(tmp_path):
    rig = made(tmp_path)
    known = {k.name: k for k in known_numbers(rig)}
    assert known['mass_kg'].unknown and not known['T_m'].unknown
    assert known['mass_kg'].sd == rig.prior_sd('mass_kg') > 10.0
    assert known['mass_kg'].step * known['mass_kg'].sd == pytest.approx(0.032)
    # An absolute deviation says as much as the same one stated relatively.
    assert known['T_m'].sd == pytest.approx(0.004) and known['T_m'].step == 0.05


@pytest.mark.parametrize('stated, said', [
    ('mass_kg: unknwon', 'rig.yaml:5: `mass_kg` is `unknwon`; allowed: 0 to 1 (relative), '
                         '{sd: 0 to 499.9 kg} or `unknown`'),
    ('mass_kg: -0.1', 'mass_kg'), ('mass_kg: 1.5', 'mass_kg'), ('mass_kg: .nan', 'mass_kg'),
    ('mass_kg: {sd: -1.0}', 'sd'), ('mass_kg: {sd: 600.0}', 'sd'), ('mass_kg: {sd: .nan}', 'sd'),
    ('mass_kg: {}', 'sd'), ('mass_kg: {sdd: 1.0}', 'sdd'), ('mass_kg: [1]', 'mass_kg'),
    ('mas_kg: 0.1', 'did you mean `mass_kg`'), ('mass_kg: .inf', 'mass_kg')])
def test_a_mistake_is_told_with_file_line_and_key(tmp_path, stated, said):
    text = RIG.replace('mass_kg: unknown', stated)
    with pytest.raises(InputError) as caught:
        made(tmp_path, text)
    assert 'rig.yaml:5' in str(caught.value) and said in str(caught.value)


@pytest.mark.parametrize('stated, fix', [
    ('unknown', 'write `mass_kg: unknown` under `tolerance`, and here the number to begin with'),
    ('1.2±0.3', 'write 1.2 here, and `mass_kg: {sd: 0.3}` under `tolerance`'),
    ('1.2 +- 10%', 'write 1.2 here, and `mass_kg: 0.1` under `tolerance`'),
    ('1.2 kg', 'write the number alone, in kg'), ('heavy', 'allowed 0.1 to 500 kg'),
    ('1,2', 'allowed 0.1 to 500 kg')])
def test_a_text_in_place_of_a_number_is_told_with_the_way_out(tmp_path, stated, fix):
    with pytest.raises(InputError) as caught:
        made(tmp_path, RIG.replace('mass_kg: 3.2', f'mass_kg: "{stated}"'))
    assert str(caught.value).startswith(f'{tmp_path / "rig.yaml"}:4: `mass_kg` must be a number, ')
    assert f'; {fix}' in str(caught.value) and stated in str(caught.value)


@pytest.mark.parametrize('value', [-0.1, 1.1, math.nan, 'unknown', None, True, AbsoluteSd(-1.0),
                                   AbsoluteSd(math.nan), AbsoluteSd(math.inf)])
def test_a_mistake_in_code_is_told_as_well(value):
    rig = load_rig('dmsp_5_300_hanging_mass')
    with pytest.raises(InputError, match='mass_kg'):
        rig.with_(tolerance={'mass_kg': value})
