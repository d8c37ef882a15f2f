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

"""
The cases of the examination: which rig, which recording, and what is true of it.

A case is drawn from (seed of the examination, place in the list) alone. ``plan`` gives the
mix; ``build`` records a case and returns its key.
"""

from dataclasses import dataclass, field

import numpy as np
import truth_commands as commands
import truth_effects as effects
import truth_gap as gap
import truth_run as runs
import truth_sensors as sensors

# Cases out of 330.
SHARES = {'null': 40, 'hard_null': 20, 'single': 150, 'parameter': 20, 'far': 20, 'near': 20,
          'two': 40, 'ambiguous': 20}
CERTIFY = {'minimum': 'multisine', 'gait': 'steps', 'multisine': 'triangle',
           'triangle': 'multisine', 'steps': 'triangle', 'slow_gait': 'gait', 'narrow': 'gait'}
OTHER_PROTOCOLS = ('gait', 'multisine', 'triangle', 'steps')
PAIRS = {
    'ppr': (('valve_dead_time', 'hysteresis'), ('creep', 'tube_lag'),
            ('valve_dead_zone', 'valve_dead_time'), ('viscous_damping', 'creep'),
            ('hysteresis', 'pressure_bias'), ('end_taper', 'coulomb_friction'),
            ('leakage', 'tube_lag'), ('bladder_stiffness', 'creep'),
            ('guide_friction', 'valve_dead_time'), ('parallel_spring', 'valve_hysteresis'),
            ('threshold_pressure', 'pressure_bias'), ('hysteresis', 'leakage'),
            ('vent_asymmetry', 'hysteresis'), ('contraction_bias', 'creep')),
    'hsv': (('leakage', 'hysteresis'), ('valve_dead_zone', 'creep'), ('thermal', 'hysteresis'),
            ('vent_asymmetry', 'dead_volume'), ('leakage', 'valve_dead_time'),
            ('coulomb_friction', 'supply_droop'))}
# Rivals that one recording cannot tell apart: sort, names, protocol, with load cell.
AMBIGUITIES = (
    ('slow_transport', ('valve_dead_time', 'tube_lag'), 'slow_gait', True),
    ('friction_side', ('coulomb_friction', 'guide_friction'), 'minimum', False),
    ('spring_side', ('bladder_stiffness', 'parallel_spring'), 'minimum', False),
    ('narrow_friction', ('coulomb_friction', 'pressure_friction'), 'narrow', True))


# By how much a wrong number is off, where 10 to 20 % would hardly move anything.
WRONG = {'damping_n_s_per_m': (0.35, 0.6), 'V_dead': (0.2, 0.4)}


@dataclass(frozen=True)
class Case:
    """One case before it is drawn."""

    name: str
    kind: str
    valve: str
    seed: tuple
    effects: tuple = ()
    protocol: str = 'minimum'
    rivals: tuple = ()
    with_force: bool = True


@dataclass
class Rig:
    """A drawn rig: numbers with and without its effects, changes of the sensors, the truth."""

    numbers: dict
    without: dict
    sensors: dict = field(default_factory=dict)
    equivalent: dict = field(default_factory=dict)
    wrong: dict = field(default_factory=dict)
    scales: dict = field(default_factory=dict)


def plan(count, seed):
    """
    Return ``count`` cases in the mix of ``SHARES``, so that any first part has it, too.

    Parameters
    ----------
    count : int
        Number of cases.
    seed : int
        Of the examination.

    """
    total = sum(SHARES.values())
    made = dict.fromkeys(SHARES, 0)
    rng = np.random.default_rng([seed, 1])
    singles = [(e, v) for e, hidden in effects.EFFECTS.items() for v in hidden.valves]
    rng.shuffle(singles)
    cases = []
    for i in range(count):
        kind = max(SHARES, key=lambda k: SHARES[k] * (i + 1) / total - made[k])
        j = made[kind]
        made[kind] += 1
        cases.append(_case(kind, j, (seed, 2, i), f'{i:04d}', singles))
    return cases


def _case(kind, j, seed, name, singles):
    rng = np.random.default_rng([*seed, 0])
    valve = ('ppr', 'ppr', 'hsv')[j % 3]
    # Two of three recordings follow the protocol that shows most; the rest one kind of motion.
    protocol = 'minimum' if rng.random() < 0.67 else str(rng.choice(OTHER_PROTOCOLS))
    if kind == 'single':
        effect, valve = singles[j % len(singles)]
        return Case(name, kind, str(valve), seed, (str(effect),), protocol)
    if kind == 'two':
        pairs = PAIRS[valve]
        pair = pairs[(j // 3 * (2 if valve == 'ppr' else 1) + (j % 3) % 2) % len(pairs)]
        return Case(name, kind, valve, seed, pair, 'minimum')
    if kind == 'parameter':
        names = effects.PARAMETERS_OF[valve]
        return Case(name, kind, valve, seed, (names[int(rng.integers(len(names)))],), protocol)
    if kind in ('far', 'near'):
        found = list(effects.FAR if kind == 'far' else effects.NEAR)
        effect = found[j % len(found)]
        return Case(name, kind, 'ppr' if effect in effects.ONLY_PPR else valve, seed, (effect,),
                    'minimum')
    if kind == 'ambiguous':
        sort, rivals, protocol, with_force = AMBIGUITIES[j % len(AMBIGUITIES)]
        effect = rivals[(j // len(AMBIGUITIES)) % 2]
        return Case(name, kind, 'ppr' if sort == 'slow_transport' else valve, seed, (effect,),
                    protocol, rivals, with_force)
    with_force = kind == 'hard_null' or j % 5 != 0
    return Case(name, kind, valve, seed, (), protocol, (), with_force)


def draw(case):
    """Return the Rig of a case."""
    rng = np.random.default_rng([*case.seed, 1])
    hard = case.kind == 'hard_null'
    off = {effects.PARAMETERS[p][0]: effects.PARAMETERS[p][1] * (
        1.0 + rng.choice((-1.0, 1.0)) * rng.uniform(0.025 if hard else 0.01, 0.03))
        for p in effects.PARAMETERS_OF[case.valve]}
    if case.valve == 'hsv':
        off['supply'] = effects.PARAMETERS['supply_pa'][1] * (1.0 + rng.uniform(-4e-3, 4e-3))
    found = Rig(dict(off), off)
    for effect in case.effects:
        _add(found, effect, case, rng)
    return found


def _add(found, effect, case, rng):
    if effect in effects.PARAMETERS:
        number, nominal = effects.PARAMETERS[effect]
        low, high = WRONG.get(effect, (0.10, 0.20))
        size = rng.uniform(low, high)
        value = nominal * (1.0 + rng.choice((-1.0, 1.0)) * size)
        found.numbers[number] = value
        found.wrong[effect] = value
        return
    if effect in effects.FAR or effect in effects.NEAR:
        table = effects.FAR if effect in effects.FAR else effects.NEAR
        scale = rng.uniform(0.7, 1.5)
        found.numbers |= table[effect](rng, scale)
    else:
        hidden = effects.EFFECTS[effect]
        low, high = hidden.scales
        if case.kind == 'two':
            low, high = max(low, 0.6), min(high, 1.5)
        elif case.kind == 'ambiguous':
            low, high = {'slow_gait': (0.45, 0.65), 'narrow': (0.3, 0.5)}.get(
                case.protocol, (0.4, 1.2))
        scale = float(np.exp(rng.uniform(np.log(low), np.log(high))))
        drawn = hidden.draw(rng, scale, case.valve)
        found.numbers |= drawn.numbers
        found.sensors |= drawn.sensors
        found.equivalent[effect] = drawn.equivalent
    found.scales[effect] = float(scale)


def build(case, folder, with_gap=True):
    """
    Record a case into a folder and return its key as plain data.

    Writes ``fit`` and ``certify`` (bags) and ``model.yaml``, the nominal model.
    """
    folder.mkdir(parents=True)
    drawn = draw(case)
    rng = np.random.default_rng([*case.seed, 2])
    hard = case.kind == 'hard_null'
    truths = {}
    chain = sensors.drawn_chain(rng, hard, case.with_force)
    chain.effects = drawn.sensors
    for part, name in (('fit', case.protocol), ('certify', CERTIFY[case.protocol])):
        truth = runs.run_rig(
            drawn.numbers, case.valve, commands.protocol(name, int(rng.integers(2**31))))
        runs.record(folder / part, truth, case.valve, chain, rng)
        truths[part] = truth
    (folder / 'model.yaml').write_text(
        f'rig: dmsp_5_300_hanging_mass\nvalve: {case.valve}\n', encoding='utf-8')
    key = key_of(case, drawn) | {'noise': chain.noise, 'filter_s': chain.filter_s}
    if with_gap:
        found = gap.gap_in_sigma(
            drawn.numbers, drawn.without, chain, truths['fit'], truths['certify'], case.valve)
        alone = {e: _alone(case, drawn, chain, e, truths) for e in key['effects']
                 } if len(key['effects']) > 1 else {}
        # Both, so that nobody has to take the choice of the refit on trust.
        for refit, ending in (('plain', ''), ('tempered', '_tempered')):
            key[f'gap_sigma{ending}'] = found[refit]
            if alone:
                key[f'gap_alone{ending}'] = {e: g[refit] for e, g in alone.items()}
    return key


def key_of(case, drawn):
    """Return what is true of a case as plain data."""
    names = [e for e in case.effects if e in effects.EFFECTS]
    return {
        'name': case.name, 'kind': case.kind, 'valve': case.valve, 'protocol': case.protocol,
        'certify': CERTIFY[case.protocol], 'with_force': case.with_force,
        'effects': names, 'outside': [e for e in case.effects if e not in effects.EFFECTS
                                      and e not in effects.PARAMETERS],
        'wrong': drawn.wrong, 'rivals': list(case.rivals),
        'family': {e: effects.EFFECTS[e].family for e in names},
        'subsystem': {e: effects.EFFECTS[e].subsystem for e in names},
        'equivalent': drawn.equivalent, 'scales': drawn.scales,
        'numbers': {p: drawn.numbers[effects.PARAMETERS[p][0]]
                    for p in effects.PARAMETERS_OF[case.valve]}}


def _alone(case, drawn, chain, effect, truths):
    """Return {refit: largest gap in sigma} of one of several effects, without the rest."""
    rng = np.random.default_rng([*case.seed, 3])
    one = Rig(dict(drawn.without), drawn.without)
    part = effects.EFFECTS[effect].draw(rng, drawn.scales[effect], case.valve)
    one.numbers |= part.numbers
    alone = sensors.Chain(noise=chain.noise, effects=part.sensors, with_force=chain.with_force)
    fit, certify = (
        runs.Truth(runs.replay(one.numbers, case.valve, truths[t]), truths[t].sent_s,
                   truths[t].sent, truths[t].wanted_s, truths[t].wanted)
        for t in ('fit', 'certify'))
    found = gap.gap_in_sigma(one.numbers, one.without, alone, fit, certify, case.valve)
    return {refit: max(gaps.values()) for refit, gaps in found.items()}


def run_suggested(case, folder, experiment):
    """
    Record a suggested experiment on the rig of a case, with a load cell if it asks for one.

    Raises NotRunnable where this rig cannot be driven with it.
    """
    drawn = draw(case)
    rng = np.random.default_rng([*case.seed, 4])
    asks = 'force' in (experiment.get('needs') or ())
    chain = sensors.drawn_chain(rng, False, case.with_force or asks)
    chain.effects = drawn.sensors
    truth = runs.run_rig(drawn.numbers, case.valve, experiment)
    runs.record(folder, truth, case.valve, chain, rng)
