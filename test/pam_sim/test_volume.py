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

"""The volume of a muscle: the work of its air, filling through valves, tables, refusals."""

from dataclasses import replace
import os
import subprocess
import sys

import numpy as np
from pam_sim import load_rig
from pam_sim.compiled import interpreted
from pam_sim.errors import InputError
from pam_sim.joint import load_joint
from pam_sim.muscle.laws import lookup
from pam_sim.muscle.lookup_table import LookupTable, read_table
from pam_sim.muscle.muscle import get_muscle, LawChoice
from pam_sim.muscle.registry import laws
from pam_sim.units import GAS_CONSTANT_AIR, P_ATM_PA, TEMPERATURE_K
from pam_sim.valve.flow import mass_flow_kg_per_s
import pytest

RIG = 'dmsp_5_300_hanging_mass'
RT = GAS_CONSTANT_AIR * TEMPERATURE_K
SHIPPED = lookup.SHIPPED / 'dmsp_5_300.csv'       # of `pam characterise --simulate`
FILL = np.concatenate([np.tile([0.35, 0.0], (1000, 1)), np.zeros((500, 2)),
                       np.tile([0.0, 0.3], (1000, 1)), np.zeros((500, 2))])


def work_over_air(rig):
    """Return the work of a muscle driven at 600 kPa over that of the gauge pressure of its air."""
    rig, gauge_pa = rig.with_(load='driven'), 600e3
    x = np.linspace(0.0, 0.05, 2001)
    held = rig.with_(parameters={'damping_n_s_per_m': 0.0}).simulate(
        np.full(2000, 6.0), contraction_m=x, initial_pressure_pa=P_ATM_PA + gauge_pa)
    return np.trapezoid(held.true_force_n, x) / np.trapezoid(
        np.full_like(x, gauge_pa), rig.volume_m3(x, P_ATM_PA + gauge_pa))


@pytest.mark.parametrize('rig, law, in_bore', [
    (RIG, 'chou_hannaford', 2.07), ('dmsp_10_250_hanging_mass', 'chou_hannaford', 1.75),
    (RIG, 'tondu_lopez', 1.34)])
def test_the_air_does_the_work_of_the_force_in_the_volume_of_the_law(rig, law, in_bore):
    bore = load_rig(rig).with_(law=law)
    assert work_over_air(bore.with_(volume='law')) == pytest.approx(1.0, rel=0.01)
    assert work_over_air(bore) == pytest.approx(in_bore, rel=0.01)


@pytest.mark.parametrize('muscle, ratio', [
    ('dmsp_5_300', 1.29), ('dmsp_10_250', 1.05), ('dmsp_20_300', 1.17)])
def test_the_volume_of_the_bore_is_not_that_of_the_force_as_the_docs_say(muscle, ratio):
    assert work_over_air(load_rig(f'{muscle}_hanging_mass')) == pytest.approx(ratio, abs=0.006)


def test_the_least_volume_of_a_flat_braid_is_that_at_its_end():
    flat, steep = (replace(get_muscle('dmsp_5_300'), braid_angle_rad=rad) for rad in (0.9, 0.5))
    for muscle in (flat, steep):
        least = muscle.volume_m3(np.linspace(0.0, muscle.stroke_m, 101)).min()
        assert muscle.least_volume_m3 == pytest.approx(least, rel=1e-12)
    assert flat.least_volume_m3 < flat.volume_m3(0.0)


def test_a_table_fills_through_the_valves_as_the_rig_it_was_made_of():
    rig = load_rig(RIG, valve='hsv')
    of_table = rig.with_(law='lookup', volume='law')
    bore = rig.with_(law='lookup').simulate(FILL)       # the same force, the volume it was made of
    seen, told = rig.simulate(FILL), of_table.simulate(FILL)
    assert seen.contraction_m.max() > 0.018 and seen.pressure_pa.max() > P_ATM_PA + 480e3
    assert np.abs(told.pressure_pa - seen.pressure_pa).max() < 2e3
    assert np.abs(told.contraction_m - seen.contraction_m).max() < 3e-4
    assert np.abs(told.pressure_pa - bore.pressure_pa).max() < 30.0
    assert np.abs(told.contraction_m - bore.contraction_m).max() < 5e-6


def test_mass_and_load_give_the_pressure_as_in_the_chapter():
    rig = load_rig(RIG, valve='hsv').with_(law='lookup', volume='law')
    for fill in (0.2, 0.3, 0.4):
        seen = rig.simulate(np.repeat([[fill, 0.0], [0.0, 0.0]], (1000, 4000), axis=0))
        assert seen.contraction_m[-1] > 1e-3 and abs(seen.velocity_m_per_s[-1]) < 1e-5
        assert seen.pressure_pa[-1] - P_ATM_PA == pytest.approx(
            rig.muscle.law.law.pressure_gauge_pa(seen.air_mass_kg[-1], 5.0 * 9.80665), abs=300.0)


@pytest.mark.parametrize('law', ['chou_hannaford', 'tondu_lopez', 'lookup'])
@pytest.mark.parametrize('fidelity, effects', [
    ('averaged', ()), ('switching', ()), ('averaged', ('dead_volume',))])
def test_the_mass_of_the_air_is_what_the_valves_let_through(law, fidelity, effects):
    rig = load_rig(RIG, valve='hsv', fidelity=fidelity).with_(
        law=law, volume='law', effects=effects)
    seen = rig.simulate(FILL)
    through = seen.air_mass_kg[0] + seen.filled_kg - seen.vented_kg
    assert seen.air_mass_kg == pytest.approx(through, rel=1e-12)
    volume = rig.volume_m3(seen.true_contraction_m, seen.true_pressure_pa) + (
        2e-6 if rig.effects else 0.0)
    assert seen.air_mass_kg * RT == pytest.approx(seen.true_pressure_pa * volume, rel=1e-9)


def table_with(strain=None, air_mass_kg=None, source=None):
    """Return the shipped table with other values."""
    table = read_table(SHIPPED)
    return LookupTable(
        table.pressure_gauge_pa, table.load_n, table.strain if strain is None else strain,
        table.air_mass_kg if air_mass_kg is None else air_mass_kg,
        table.source if source is None else source)


def filled_at_s(rig, pressure_pa):
    """Return when a slowly filled rig reaches a pressure [s]."""
    seen = rig.simulate(np.tile([0.1, 0.0], (5000, 1)))
    return np.interp(pressure_pa, seen.pressure_pa, seen.time_s)


def test_twice_the_air_takes_twice_the_time():
    table = read_table(SHIPPED)
    rig = load_rig(RIG, valve='hsv')
    once = rig.with_(law=LawChoice('lookup', table=table), volume='law')
    twice = rig.with_(law=LawChoice('lookup', table=table_with(
        air_mass_kg=2.0 * table.air_mass_kg, source='own points; dead volume 6 mL')),
        volume='law', parameters={'V_dead': 6e-6})
    for gauge_pa in (150e3, 300e3):
        assert filled_at_s(twice, P_ATM_PA + gauge_pa) == pytest.approx(
            2.0 * filled_at_s(once, P_ATM_PA + gauge_pa), rel=0.005)
    # Without the volume of the law the air of the table counts for nothing.
    assert np.array_equal(once.with_(volume='bore').simulate(FILL).pressure_pa, twice.with_(
        volume='bore', parameters={'V_dead': 3e-6}).simulate(FILL).pressure_pa)


def test_the_dead_volume_of_the_rig_counts_beside_that_of_the_table():
    rig = load_rig(RIG).with_(law='lookup', volume='law')
    bore = load_rig(RIG)
    assert rig.volume_m3(0.01, P_ATM_PA + 400e3) == pytest.approx(
        bore.volume_m3(0.01), rel=1e-3)
    longer = rig.with_(parameters={'V_dead': 5e-6})
    assert longer.volume_m3(0.0) - rig.volume_m3(0.0) == pytest.approx(2e-6, rel=1e-9)


def reference_pa(rig, contraction_m, fill, start_pa, dt_s):
    """Return p of dp/dt (V + p dV/dp) = R T mdot - p dV/dx dx/dt by Runge-Kutta, per sample."""
    flow = interpreted(mass_flow_kg_per_s)
    conductance = rig.parameters['C'] * 1.185 * np.sqrt(293.15 / TEMPERATURE_K)

    def volume(p, x):
        return float(rig.volume_m3(x, p))

    def rate(p, x, v):
        by_p = (volume(p + 10.0, x) - volume(p - 10.0, x)) / 20.0
        by_x = (volume(p, x + 1e-7) - volume(p, x - 1e-7)) / 2e-7
        let_in = fill * flow(rig.parameters['supply_pa'], p, conductance, rig.parameters['b'])
        return (RT * let_in - p * by_x * v) / (volume(p, x) + p * by_p)

    found = [start_pa]
    for x, after in zip(contraction_m, contraction_m[1:]):
        p, v, middle = found[-1], (after - x) / dt_s, 0.5 * (x + after)
        k1 = rate(p, x, v)
        k2 = rate(p + 0.5 * dt_s * k1, middle, v)
        k3 = rate(p + 0.5 * dt_s * k2, middle, v)
        k4 = rate(p + dt_s * k3, after, v)
        found.append(p + dt_s / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4))
    return np.array(found)


@pytest.mark.parametrize('law, lowest_m', [('tondu_lopez', 0.002), ('lookup', 0.03)])
def test_the_pressure_follows_a_volume_that_depends_on_it(law, lowest_m):
    # Contracted by 30 mm the muscle of the table is slack: its volume follows the pressure.
    rig = load_rig('dmsp_5_300_driven', valve='hsv').with_(law=law, volume='law')
    x = lowest_m + 0.01 * np.sin(np.arange(301) * 1e-3 * 2.0 * np.pi) ** 2
    start_pa = P_ATM_PA + 60e3
    seen = rig.simulate(np.tile([0.2, 0.0], (300, 1)), contraction_m=x,
                        initial_pressure_pa=start_pa)
    wanted = reference_pa(rig, x, 0.2, start_pa, 1e-3)
    assert wanted[-1] - wanted[0] > 30e3
    assert seen.true_pressure_pa == pytest.approx(wanted, abs=20.0)
    by_pressure = rig.volume_m3(x, start_pa + 40e3) - rig.volume_m3(x, start_pa)
    assert np.abs(by_pressure).max() > 1e-7             # or it were no test


def test_an_effect_behind_a_regulator_acts_on_the_volume_of_the_law():
    rig = load_rig('dmsp_5_300_isometric').with_(law='chou_hannaford', effects=[
        {'name': 'leakage', 'parameters': {'conductance_m3_per_s_pa': 1e-11}}])
    droop = {}
    for volume in ('bore', 'law'):
        chosen = rig.with_(volume=volume)
        seen = chosen.simulate(np.full(1500, 5.0), initial_pressure_pa=P_ATM_PA + 500e3)
        droop[volume] = (P_ATM_PA + 500e3 - seen.pressure_pa[-1]) * chosen.volume_m3(0.0)
        assert 1e3 < P_ATM_PA + 500e3 - seen.pressure_pa[-1] < 20e3
    assert droop['law'] == pytest.approx(droop['bore'], rel=0.02)


def test_a_warm_muscle_ends_at_the_pressure_of_its_mass():
    rig = load_rig(RIG, valve='hsv').with_(law='lookup', volume='law')
    warm = rig.with_(effects=['thermal']).simulate(FILL)
    bore = rig.with_(effects=['thermal'], volume='bore').simulate(FILL)
    assert np.abs(warm.pressure_pa - bore.pressure_pa).max() < 50.0
    assert np.abs(warm.pressure_pa - rig.simulate(FILL).pressure_pa).max() > 1e4


def test_muscles_of_a_joint_have_volumes_of_their_own():
    joint = load_joint(
        'load: antagonistic_joint\n'
        'flexor: {rig: dmsp_5_300_driven, valve: hsv, law: lookup, volume: law}\n'
        'extensor: {rig: dmsp_5_300_driven, valve: hsv, law: chou_hannaford, volume: law}\n')
    assert load_joint(joint.to_yaml()) == joint
    seen = joint.simulate(FILL, FILL[::-1])
    assert np.ptp(seen.angle_rad) > 0.05
    for side in ('flexor', 'extensor'):
        air, rig = getattr(seen, side), getattr(joint, side)
        assert air.air_mass_kg == pytest.approx(
            air.air_mass_kg[0] + air.filled_kg - air.vented_kg, rel=1e-12)
        assert air.air_mass_kg * RT == pytest.approx(air.true_pressure_pa * rig.volume_m3(
            air.true_contraction_m, air.true_pressure_pa), rel=1e-9)


def test_the_choice_travels_with_the_rig_and_is_not_written_where_it_is_the_default():
    rig = load_rig(f'rig: {RIG}\nlaw: chou_hannaford\nvolume: law\n')
    assert rig.muscle.volume == 'law' and load_rig(rig.to_yaml()) == rig
    assert 'volume' not in rig.with_(volume='bore').to_yaml()
    assert rig.with_(parameters={'mass_kg': 4.0}).muscle.volume == 'law'
    own = load_rig('muscle: {like: dmsp_5_300, law: chou_hannaford, volume: law}\n'
                   'load: hanging_mass\n')
    assert own.muscle.volume == 'law' and load_rig(own.to_yaml()) == own


@pytest.mark.parametrize('text, line, words', [
    (f'rig: {RIG}\nvolume: law\n', 2, 'law `sarosi` has no volume of its own; these have: '
     + ', '.join(name for name, law in laws().items() if law.COMPILED_VOLUME)),
    (f'rig: {RIG}\nvolume: lav\n', 2, 'did you mean `law`.*allowed: bore, law'),
    ('load: driven\nmuscle:\n  like: dmsp_20_300\n  length_m: 0.2\n  law: chou_hannaford\n'
     '  volume: law\n', 6, 'has length_m = 0.3, and the muscle 0.2.*length_m: 0.2}')])
def test_mistakes_are_told_with_the_line(text, line, words):
    with pytest.raises(InputError, match=words) as caught:
        load_rig(text)
    assert f':{line}' in str(caught.value)


def test_a_law_without_a_volume_is_refused_in_place_of_one_with_it():
    rig = load_rig(RIG).with_(law='chou_hannaford', volume='law')
    with pytest.raises(InputError, match='law `sarosi` has no volume of its own'):
        rig.with_(law='sarosi')
    with pytest.raises(InputError, match='volume `air` is not known; allowed: bore, law'):
        rig.with_(volume='air')


@pytest.mark.parametrize('words, dead_ml', [
    ('3', 3.0), ('3.', 3.0), ('.5', 0.5), ('1e-05', 1e-5), ('3-4', None), ('1.2.3', None),
    ('-3', None)])
def test_the_dead_volume_of_a_table_is_one_number(words, dead_ml):
    table = table_with(source=f'measured; dead volume {words} mL')
    assert table.dead_volume_m3 == (None if dead_ml is None else 1e-6 * dead_ml)


def test_a_table_whose_air_cannot_be_simulated_is_refused():
    muscle = get_muscle('dmsp_5_300')
    table = read_table(SHIPPED)

    def refused(other):
        with pytest.raises(InputError) as caught:
            muscle.with_law(LawChoice('lookup', table=other)).with_volume('law', 'rig.yaml:3')
        assert caught.value.where == 'rig.yaml:3'
        return caught.value.problem
    assert 'write into a line of comment (#) or its `source`: dead volume 3 mL' in refused(
        table_with(source='own points'))
    assert 'is not above 0, at 0 Pa gauge and contraction 0;' in refused(
        table_with(source='dead volume 30 mL'))
    # At each load the air rises with pressure; at one contraction it does not.
    volume = 9e-6 + 4e-5 * (0.3 - table.strain)
    air = (table.pressure_gauge_pa[:, np.newaxis] + P_ATM_PA) / RT * volume
    falling = air * (1.0 - 0.9 * table.load_n / 150.0 * (table.load_n > 0.0))
    problem = refused(table_with(air_mass_kg=falling))
    assert 'holds no more air at higher pressure, at ' in problem
    assert 'allowed with this law is `volume: bore`' in problem


OWN_LAW = """
from pam_sim.compiled import compiled
from pam_sim.muscle.law import MuscleLaw, ParameterSet
from pam_sim.parameters import Parameter

@compiled
def tension_n(gauge_pa, strain, par):
    return par.a_m2 * gauge_pa * (1.0 - strain / 0.2)

@compiled
def volume_m3(gauge_pa, strain, par):
    return par.a_m2 * par.length_m * (0.1 + strain - strain * strain / 0.4)

class Linear(MuscleLaw):
    NAME = 'linear'
    PARAMETERS = (Parameter('a_m2', 'm^2', 2e-4, 1e-6, 1.0),
                  Parameter('length_m', 'm', 0.3, 0.1, 1.0))
    SETS = {'one': ParameterSet({}, 'nothing')}
    CLAIMS = (1, 2, 3, 4)

LAW = Linear
"""
USE_OF_LAW = """
import numpy as np
from pam_sim import load_rig
rig = load_rig('rig: dmsp_5_300_driven\\nvalve: hsv\\nlaw: linear\\nvolume: law\\n')
x = np.linspace(0.0, 0.03, 41)
seen = rig.simulate(np.zeros((40, 2)), contraction_m=x, initial_pressure_pa=5e5)
volume = 3e-6 + 2e-4 * 0.3 * (0.1 + x / 0.3 - (x / 0.3) ** 2 / 0.4)
print(abs(seen.pressure_pa * volume / (5e5 * volume[0]) - 1.0).max() < 1e-9)
"""


@pytest.mark.parametrize('old, new, said', [
    ('', '', 'True'), ('volume_m3(gauge_pa, strain, par)', 'volume_m3(strain, par)',
                       'write `def volume_m3(gauge_pa, strain, par)`'),
    ('(0.1 + strain -', '(0.1 - strain -', 'claims rule 1 ("Contraction goes with an increasing '
     'volume.") and breaks it: the volume does not grow with contraction at ')])
def test_a_law_of_the_user_has_a_volume(tmp_path, old, new, said):
    (tmp_path / 'linear.py').write_text(OWN_LAW.replace(old, new) if old else OWN_LAW)
    answer = subprocess.run(
        [sys.executable, '-c', USE_OF_LAW], capture_output=True, text=True,
        env={**os.environ, 'PAM_MUSCLE_LAWS_PATH': str(tmp_path), 'NUMBA_DISABLE_JIT': '1',
             'PYTHONPATH': os.pathsep.join(sys.path), 'PAM_CACHE_DIR': str(tmp_path / 'cache')})
    assert said in answer.stdout + answer.stderr


def test_a_muscle_of_another_volume_is_another_muscle():
    muscle = replace(get_muscle('dmsp_5_300'), law=LawChoice('chou_hannaford'))
    assert muscle.with_volume('law') != muscle and muscle.with_volume('bore') == muscle
