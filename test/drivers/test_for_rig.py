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


"""What a driver is told of a rig does not depend on the formulation of an effect."""

from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.drivers.hsv_pulses import duty_of_opening
from pam_sim import load_rig
from pam_sim.errors import InputError
import pytest

SWITCHING = {'open_time_s': 3.5e-3, 'close_time_s': 2.5e-3}
DEAD_TIME = {'name': 'valve_dead_time', 'parameters': {'delay_s': 0.018}}


@pytest.mark.parametrize('form, own', [
    ('valve_dead_zone_gradual', {'ramp_s': 1e-4}),
    ('valve_dead_zone_two_ramps', {'rise_s': 1e-4, 'fall_s': 1e-4})])
def test_switching_times_of_every_formulation_reach_the_driver(form, own):
    rig = load_rig('dmsp_20_300_hanging_mass', valve='hsv')
    plain, other = (driver_config(rig.with_(effects=[DEAD_TIME, dead_zone])) for dead_zone in (
        {'name': 'valve_dead_zone', 'parameters': SWITCHING},
        {'name': form, 'parameters': {**SWITCHING, **own}}))
    assert other == plain
    assert plain.hsv.open_time_s == 3.5e-3 and plain.hsv.close_time_s == 2.5e-3


def test_a_dead_time_by_direction_reaches_the_driver_of_a_regulator_as_its_mean():
    rig = load_rig('dmsp_5_300_hanging_mass')
    by_direction = {'name': 'valve_dead_time_by_direction',
                    'parameters': {'delay_s': 0.018, 'vent_later_s': 0.01}}
    plain, other = (driver_config(rig.with_(effects=[one])) for one in (DEAD_TIME, by_direction))
    assert other == plain and plain.ppr.dead_time_s == 0.018
    # It acts on no pair of valves, so their driver has nothing to wait for.
    pair = rig.with_(valve='hsv', effects=[by_direction])
    assert driver_config(pair).hsv == driver_config(pair.with_(effects=[])).hsv


@pytest.mark.parametrize('changes, words', [
    ({'hsv.period_s': 0.004}, (
        'parameter: `hsv.period_s` is 0.004 s, in which valves that open in 0.0035 s and shut in '
        '0.0025 s, with a margin of 0.0001 s, give no short pulse; allowed are above 0.0061 to '
        '0.01 s: state a longer period')),
    ({'hsv.open_time_s': 0.009}, (
        'rig dmsp_20_300_hanging_mass: `pwm_period_s` is 0.01 s, in which valves that open in '
        '0.009 s and shut in 0.0025 s, with a margin of 0.0001 s, give no short pulse; it would '
        'have to be above 0.0116 s, and the longest allowed is 0.01 s: take valves that switch '
        'faster'))])
def test_a_period_in_which_the_valves_cannot_open_and_shut_is_refused(changes, words):
    dead_zone = {'name': 'valve_dead_zone', 'parameters': SWITCHING}
    rig = load_rig('dmsp_20_300_hanging_mass', valve='hsv').with_(effects=[dead_zone])
    with pytest.raises(InputError) as refused:
        driver_config(rig, changes)
    assert str(refused.value) == words
    # Behind a regulator it does not matter.
    driver_config(rig.with_(valve='ppr'), changes)


def test_no_duty_is_below_0():
    """A period of 2 ms and a closing time of 2.3 ms gave -0.15."""
    for opening in (0.01, 0.3, 0.6, 1.0):
        assert 0.0 <= duty_of_opening(opening, 0.2, 1.15, 0.05) <= 1.0


@pytest.mark.parametrize('more', [
    'muscle: {like: dmsp_20_300, length_m: 1.5}\nload: hanging_mass\n',
    'rig: dmsp_5_300_hanging_mass\n'
    'effects: [{name: valve_dead_time, parameters: {delay_s: 0.26}}]\n',
    'rig: dmsp_5_300_hanging_mass\nparameters: {pwm_period_s: 0.002}\n'
    'effects: [{name: valve_dead_time, parameters: {delay_s: 0.06}}]\n'])
def test_a_regulator_is_not_refused_for_what_belongs_to_a_pair(more):
    rig = load_rig(f'valve: ppr\n{more}')
    delays = [one.parameters['delay_s'] for one in rig.effects]
    assert driver_config(rig).ppr.dead_time_s == (delays[0] if delays else 0.0)


def test_a_pair_drives_a_stroke_of_more_than_300_mm():
    rig = load_rig('valve: hsv\nload: hanging_mass\nmuscle: {like: dmsp_20_300, length_m: 1.5}\n')
    assert driver_config(rig).hsv.contraction_at_600kpa_m == pytest.approx(0.358, abs=1e-3)
