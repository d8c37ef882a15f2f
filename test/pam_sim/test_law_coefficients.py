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

"""Coefficients of a force law as numbers of a rig."""

from pam_sim import load_rig
from pam_sim.errors import InputError
from pam_sim.gap.subsystems.known import known_numbers
from pam_sim.muscle.coefficients import coefficients, leading, own_value
from pam_sim.muscle.muscle import LawChoice
from pam_sim.muscle.registry import laws
import pytest

RIG = """
muscle: {{like: dmsp_10_250, law: {{name: {law}, set: {set}}}}}
load: hanging_mass
tolerance: {tolerance}
"""
SETS = [(name, one) for name, law in laws().items() if name != 'lookup' for one in law.SETS]


@pytest.mark.parametrize('law, chosen', SETS)
def test_every_coefficient_has_a_range_about_its_value(law, chosen):
    choice = LawChoice(law, chosen)
    declared = {f'law.{p.name}': p for p in laws()[law].PARAMETERS}
    found = {p.name: p for p in coefficients(choice)}
    assert found.keys() == declared.keys()
    for name, p in found.items():
        assert p.lower < p.upper and p.lower <= p.default <= p.upper
        assert declared[name].lower <= p.lower and p.upper <= declared[name].upper
        assert p.default == own_value(choice, name)
    # A law without anything to find would make `law: unknown` an empty word.
    assert set(leading(choice)) <= found.keys() and len(leading(choice)) >= 2


def test_the_word_law_frees_all_and_a_name_beside_it_wins():
    rig = load_rig(RIG.format(law='sarosi', set='dmsp_10',
                              tolerance='{law: unknown, law.a3: {sd: 5.0}}'))
    assert rig.unknown == tuple(
        name for name in leading(rig.muscle.law) if name != 'law.a3')
    assert rig.prior_sd('law.a3') == 5.0
    moved = rig.with_(parameters={'law.a3': -30.0, 'mass_kg': 2.0})
    assert moved.number('law.a3') == -30.0 and moved.parameters['mass_kg'] == 2.0
    assert moved.unknown == rig.unknown and load_rig(moved.to_yaml()).to_yaml() == moved.to_yaml()
    known = {k.name: k for k in known_numbers(rig)}
    assert known['law.a2_n'].unknown and known['law.a3'].sd == 5.0
    # Of another law it says nothing.
    assert moved.with_(law='tondu_lopez').unknown == ()


def test_a_value_beyond_the_range_of_its_set_widens_it():
    rig = load_rig(RIG.format(law='sarosi', set='dmsp_10', tolerance='{law.a2_n: 0.1}'))
    rig = rig.with_(parameters={'law.a2_n': 900.0})
    p = next(p for p in rig.law_list if p.name == 'law.a2_n')
    assert p.lower < 200.0 and p.upper == 1800.0
    assert rig.prior_sd('law.a2_n') == pytest.approx(90.0)


@pytest.mark.parametrize('law, chosen, tolerance, said', [
    ('sarosi', 'dmsp_10', '{law.a9: unknown}', 'law.a'),
    ('sarosi', 'dmsp_10', '{law: sure}', '`law` is `sure`; allowed: '),
    ('sarosi', 'dmsp_10', '{law.a3: 2.0}', 'law.a3'),
    ('lookup', 'dmsp_5_300', '{law: unknown}', 'table without coefficients'),
    ('lookup', 'dmsp_5_300', '{law: unknown}', 'is `force_map_gain`; state that as unknown')])
def test_a_mistake_is_told(law, chosen, tolerance, said):
    with pytest.raises(InputError) as caught:
        load_rig(RIG.format(law=law, set=chosen, tolerance=tolerance))
    assert said in str(caught.value)
