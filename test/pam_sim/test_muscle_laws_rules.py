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

"""The chapter's four rules of muscle behaviour over random parameters, per claiming law."""

from hypothesis import assume, given, HealthCheck, settings, strategies as st
import numpy as np
from pam_sim.errors import InputError

from pam_sim.muscle.laws.chou_hannaford import shape
from pam_sim.muscle.lookup_table import table_from_law
from pam_sim.muscle.registry import get_law, laws, make_law
from pam_sim.muscle.rules import RULES
from pam_sim.units import absolute_pa, GAS_CONSTANT_AIR, TEMPERATURE_K
import pytest

FORMULA_SETS = [(name, muscle) for name, law in laws().items() if name != 'lookup'
                for muscle in law.SETS]
CALM = settings(max_examples=12, deadline=None, derandomize=True,
                suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow])
FRACTION = st.floats(0.0, 1.0)


def random_law(name, muscle, data):
    """Return a law with every parameter moved by up to 20 %; skip what the law refuses."""
    kind = get_law(name)
    values = {}
    for parameter in kind.PARAMETERS:
        middle = kind.SETS[muscle].values.get(parameter.name, parameter.default)
        moved = middle * data.draw(st.floats(0.8, 1.2), label=parameter.name)
        values[parameter.name] = min(max(moved, parameter.lower), parameter.upper)
    try:
        return kind(values, muscle)
    except InputError:
        assume(False)


def pressures(law, data):
    """Return two pressures [Pa] of the law's range, the first lower by 2 % at least."""
    low, high = law.validity.pressure_gauge_pa
    low = max(low, 0.05 * high)
    first, second = sorted((data.draw(FRACTION), data.draw(FRACTION)))
    assume(second - first > 0.02)
    return low + first * (high - low), low + second * (high - low)


def test_the_claims_name_rules_of_the_chapter():
    for name, law in laws().items():
        assert set(law.CLAIMS) <= set(RULES) and law.CLAIMS, name
        assert 1 not in law.CLAIMS or law.COMPILED_VOLUME


@pytest.mark.parametrize('name, muscle', [
    pair for pair in FORMULA_SETS if 1 in get_law(pair[0]).CLAIMS])
@given(data=st.data())
@CALM
def test_rule_1_contraction_goes_with_an_increasing_volume(name, muscle, data):
    law = random_law(name, muscle, data)
    _, pressure = pressures(law, data)
    limit = law.max_strain(pressure)
    volume = law.volume_m3(pressure, np.linspace(0.0, limit, 25))
    assert np.all(np.diff(volume) > 0.0) and volume[0] > 0.0
    beyond = law.volume_m3(pressure, np.array([limit, min(0.9, limit + 0.01)]))
    assert beyond[1] < beyond[0]            # and the largest volume is where the force ends


@pytest.mark.parametrize('name, muscle', [
    pair for pair in FORMULA_SETS if 2 in get_law(pair[0]).CLAIMS])
@given(data=st.data())
@CALM
def test_rule_2_pressure_contracts_against_a_constant_load(name, muscle, data):
    law = random_law(name, muscle, data)
    low, high = pressures(law, data)
    load = data.draw(st.floats(0.01, 0.9)) * law.force_n(high, 0.0)
    assume(load > 0.0)
    less, more = law.max_strain(low, load), law.max_strain(high, load)
    assert more > less or (more == 0.0 and less == 0.0)


@pytest.mark.parametrize('name, muscle', [
    pair for pair in FORMULA_SETS if 3 in get_law(pair[0]).CLAIMS])
@given(data=st.data())
@CALM
def test_rule_3_less_load_contracts_at_constant_pressure(name, muscle, data):
    law = random_law(name, muscle, data)
    _, pressure = pressures(law, data)
    light, heavy = sorted((data.draw(FRACTION), data.draw(FRACTION)))
    assume(heavy - light > 0.01)
    top = law.force_n(pressure, 0.0)
    assume(top > 0.0)
    assert law.max_strain(pressure, light * top) > law.max_strain(pressure, heavy * top)


@pytest.mark.parametrize('name, muscle', [
    pair for pair in FORMULA_SETS if 4 in get_law(pair[0]).CLAIMS])
@given(data=st.data())
@CALM
def test_rule_4_contraction_ends_where_the_force_is_zero(name, muscle, data):
    law = random_law(name, muscle, data)
    for pressure in pressures(law, data):
        limit = law.max_strain(pressure)
        assert limit < 0.9
        beyond = law.force_n(pressure, np.linspace(limit + 1e-9, 0.9, 50), 'allow')
        assert np.all(beyond <= 1e-6)


def test_the_lossless_limit_does_not_depend_on_pressure():
    law = make_law('chou_hannaford')
    _, a, b = shape(law.values)
    limit = 1.0 - np.sqrt(b / a)        # also the contraction of the largest volume
    assert law.max_strain([50e3, 300e3, 600e3]) == pytest.approx(limit, abs=1e-12)


@given(data=st.data())
@settings(CALM, max_examples=3)
def test_the_lookup_surfaces_keep_all_four_rules(data):
    base = random_law('tondu_lopez', 'dmsp_5', data)
    top = float(base.force_n(600e3, 0.0))
    cylinder = make_law('chou_hannaford')
    table = table_from_law(base, lambda strain: cylinder.volume_m3(0.0, strain),
                           np.linspace(0.0, 600e3, 13), np.linspace(0.0, 0.9 * top, 8))
    law = make_law('lookup', table)
    pressure = np.linspace(0.0, 600e3, 19)
    load = np.linspace(0.0, 0.9 * top, 15)
    strain = law.strain_at(pressure[:, None], load)
    assert np.all(np.diff(strain, axis=0) >= -1e-9)                      # rule 2
    assert np.all(np.diff(strain, axis=1) <= 1e-9)                       # rule 3
    mass = law.air_mass_kg(table.pressure_gauge_pa[:, None], table.load_n)
    volume = mass * GAS_CONSTANT_AIR * TEMPERATURE_K / absolute_pa(
        table.pressure_gauge_pa)[:, None]
    assert np.all(np.diff(volume, axis=1) <= 1e-15)                      # rule 1
    force = law.force_n(pressure[::3, None], np.linspace(0.0, law.validity.strain[1], 21))
    assert np.all(np.diff(force, axis=1) <= 1e-9) and np.all(force >= 0.0)
    assert force[-1, -1] <= 1e-6                                         # rule 4
