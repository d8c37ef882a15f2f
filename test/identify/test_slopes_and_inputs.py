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

"""Slopes of the fit, what noise of the measured pressure does to it, and effects below noise."""

from made_records import record, RIG
import numpy as np
from pam_sim import load_rig
from pam_sim.identify.fit import fit, STEP_OF_KNOWN, Weighted
from pam_sim.identify.inputs import memories_by_noise, scatter_by_inputs
from pam_sim.identify.numbers import known_numbers_of, unknown_numbers
from pam_sim.identify.possible import incomplete_subsystems, LASTING, possible_effects
from pam_sim.identify.records import offer_of, problems_of
from pam_sim.run import Run, Series
import pytest

STEPS_PA = 50e3, 450e3, 100e3


def weighted_of(run, names, effects=False):
    """Return the problem of a run, with the effects that may be missing."""
    problems = problems_of(RIG, [offer_of(run, RIG)])
    sought = unknown_numbers(RIG, names)
    numbers = [*sought, *known_numbers_of(problems, sought)]
    more = possible_effects(RIG, problems, numbers, {p.subsystem for p in problems}) if (
        effects) else []
    return Weighted(RIG, problems, [*numbers, *more],
                    incomplete=frozenset(p.subsystem for p in problems if effects))


@pytest.fixture(scope='module')
def steps():
    return record(RIG, STEPS_PA, 1.0, ('pressure', 'contraction'))


def test_slopes_of_effects_are_those_of_a_small_step_and_of_a_large_one_where_it_needs_it(steps):
    weighted = weighted_of(steps, ['mass_kg'], True)
    names = [n.name for n in weighted.numbers]
    x = np.zeros(len(names))
    place = names.index('viscous_damping.damping_n_s_per_m')
    slope, straight = weighted.slopes(x, [place])[:, 0], []
    for step in (10.0 * STEP_OF_KNOWN, 0.2):
        moved = np.array(x)
        moved[place] = step
        straight.append((weighted.residuals(moved) - weighted.residuals(x)) / step)
    near, far = (np.linalg.norm(slope - s) / np.linalg.norm(slope) for s in straight)
    assert near < 0.02 < 0.05 < far
    # A vent that closes early does nothing until the pressure comes so low.
    place = names.index('vent_bleed.closing_pressure_pa')
    assert np.any(weighted.slopes(x, [place])[:-x.size])


def test_noise_of_the_pressure_makes_numbers_scatter_beside_that_of_the_outputs(steps):
    topics = dict(steps.topics)
    noise = 2000.0 * np.random.default_rng(3).standard_normal(len(topics['pressure']))
    topics['pressure'] = Series(topics['pressure'].stamp_ns, {
        'pressure_pa': np.asarray(topics['pressure']['pressure_pa']) + noise}, {
            'pressure_pa': 'Pa'})
    found = []
    for run in (steps, Run(topics=topics, path='noisy')):
        weighted = weighted_of(run, ['mass_kg'])
        x = fit(weighted)
        slopes = weighted.slopes(x)
        before = weighted.residuals(x)
        found.append(float(scatter_by_inputs(weighted, x, 1, slopes)[0, 0]))
        assert np.array_equal(weighted.residuals(x), before)      # nothing stays disturbed
    assert 0.0 < 4.0 * found[0] < found[1]


def test_an_effect_below_the_noise_shows_by_its_memory(steps):
    weighted = weighted_of(steps, ['mass_kg'])
    random = np.random.default_rng(4)
    # Half of the variance is a slow wave; together they are as large as noise alone may be.
    for wave, expected in ((0.0, False), (0.9, True)):
        weighted.errors = lambda x, problem: 0.7 * random.standard_normal(
            problem.time_s.size) + wave * np.sin(4.0 * problem.time_s)
        x = np.zeros(len(weighted.numbers))
        assert all(square < 1.2 for _, _, square in weighted.mean_squares(x))
        assert incomplete_subsystems(weighted, x) == ({'muscle', 'valve'} if expected else set())


def test_a_load_that_swings_after_noise_of_the_pressure_misses_no_effect():
    """Its errors stay alike for more than ten samples, as noise of the pressure makes them."""
    rig = load_rig('dmsp_20_300_hanging_mass').with_(
        parameters={'mass_kg': 22.0, 'damping_n_s_per_m': 190.0})
    stairs_pa = (50e3, 200e3, 400e3, 300e3, 100e3, 0.0)
    rubs = rig.with_(effects=[{'name': 'coulomb_friction', 'parameters': {'force_n': 0.6}}])
    for true, expected in ((rig, False), (rubs, True)):
        run = record(true, stairs_pa, 1.0, ('pressure', 'contraction'), False, seed=8)
        problems = problems_of(rig, [offer_of(run, rig)])
        sought = unknown_numbers(rig, ['mass_kg'])
        weighted = Weighted(rig, problems, [*sought, *known_numbers_of(problems, sought)])
        x = fit(weighted)
        memory, by_noise = weighted.memories(x)[0], memories_by_noise(weighted, x)[0]
        assert LASTING < memory and (memory > by_noise) is expected
        assert incomplete_subsystems(weighted, x) == ({'muscle'} if expected else set())
