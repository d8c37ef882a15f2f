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
Recordings as people have them: closed loops, slow logs, valves that switch, joints, whole days.

A case is drawn from (seed of the examination, kind, place in the list) alone. One effect of
everyday size is hidden in it, or nothing. ``build`` records it and returns its key.
"""

from dataclasses import dataclass, replace

import numpy as np
import truth_bags as bags
import truth_cases as cases
import truth_commands as commands
import truth_effects as effects
import truth_gap as gap
import truth_joint as joint
import truth_pulses as pulses
import truth_run as runs
import truth_sensors as sensors

KINDS = ('closed_loop', 'slow', 'switching', 'joint', 'one_day')
SCALES = 0.7, 1.5             # times an everyday size
SLOW_HZ = 50.0
HELD_ROWS = 4                 # of commands at 200 Hz that a loop at 50 Hz holds
LOGS = ('loop', 'thinned')
LAWS = ('sofc', 'pid')
JOINT = '/knee'
# What acts on the load, and errors of the angle, which is an input for each muscle of a joint.
NOT_OF_A_JOINT = {'guide_friction', 'parallel_spring', 'contraction_bias', 'contraction_lag'}
# The reservoir of a live rig is always full.
NOT_LIVE = {'supply_droop'}
DAY_RUNS, DAY_RUN_S = 3, 20.0
VALVES = {'closed_loop': ('ppr', 'hsv'), 'slow': ('ppr',), 'switching': ('hsv',),
          'joint': ('ppr', 'hsv'), 'one_day': ('ppr', 'hsv')}


@dataclass(frozen=True)
class Case:
    """One recording before it is drawn; ``way`` is its law or log, or the side of the effect."""

    name: str
    kind: str
    valve: str
    seed: tuple
    effect: str = ''
    way: str = ''


def plan(kind, number, nulls, seed):
    """
    Return the cases of a kind: with one effect each, and then those with nothing to find.

    A longer list of the same seed begins with the shorter one.

    Parameters
    ----------
    kind : str
        One of ``KINDS``.
    number, nulls : int
        How many with an effect and without.
    seed : int
        Of the examination.

    """
    place = KINDS.index(kind)
    rng = np.random.default_rng([seed, 1, place])
    left_out = {'joint': NOT_OF_A_JOINT, 'closed_loop': NOT_LIVE}.get(kind, set())
    pairs = [(e, v) for e, hidden in effects.EFFECTS.items() for v in hidden.valves
             if v in VALVES[kind] and e not in left_out]
    rng.shuffle(pairs)
    ways = {'closed_loop': LAWS, 'slow': LOGS, 'joint': joint.SIDES}.get(kind, ('',))
    hidden = [(f'{i:02d}', (seed, 2, place, i), *pairs[i % len(pairs)]) for i in range(number)]
    hidden += [(f'null_{i}', (seed, 3, place, i), '', VALVES[kind][i % len(VALVES[kind])])
               for i in range(nulls)]
    return [Case(f'{kind}_{name}', kind, str(valve), own, str(effect), ways[i % len(ways)])
            for i, (name, own, effect, valve) in enumerate(hidden)]


def draw(case):
    """Return the drawn ``truth_cases.Rig`` of a case."""
    rng = np.random.default_rng([*case.seed, 1])
    found = cases.Rig(_inexact(case.valve, rng), {})
    found.without = dict(found.numbers)
    if case.effect:
        hidden = effects.EFFECTS[case.effect]
        scale = float(np.exp(rng.uniform(*np.log(SCALES))))
        scale = min(max(scale, hidden.scales[0]), hidden.scales[1])
        drawn = hidden.draw(rng, scale, case.valve)
        found.numbers |= drawn.numbers
        found.sensors |= drawn.sensors
        found.equivalent[case.effect] = drawn.equivalent
        found.scales[case.effect] = scale
    return found


def _inexact(valve, rng):
    """Return the numbers of a rig, 1 to 2 % off the data sheet."""
    numbers = {}
    for name in effects.PARAMETERS_OF[valve]:
        number, nominal = effects.PARAMETERS[name]
        numbers[number] = nominal * (1.0 + rng.choice((-1.0, 1.0)) * rng.uniform(0.01, 0.02))
    if valve == 'hsv':
        number, nominal = effects.PARAMETERS['supply_pa']
        numbers[number] = nominal * (1.0 + 0.004 * rng.uniform(-1.0, 1.0))
    return numbers


def build(case, folder, closed_loop=None):
    """
    Record a case into a folder and return its key as plain data.

    Writes bags (``fit`` or ``fit_1``…, and ``certify`` but for the runs of a day).

    Parameters
    ----------
    case : Case
        What to record.
    folder : pathlib.Path
        Must not exist.
    closed_loop : callable, optional
        ``closed_loop(case, numbers, chain, part)`` returns the instants [s] and values of the
        valve signal that a controller sent, and the pressures [Pa] it wanted then.

    """
    folder.mkdir(parents=True)
    drawn, rng = draw(case), np.random.default_rng([*case.seed, 2])
    chain = sensors.drawn_chain(rng)
    chain.effects = drawn.sensors
    key = {'name': case.name, 'kind': case.kind, 'valve': case.valve, 'way': case.way,
           'effects': [case.effect] if case.effect else [], 'outside': [], 'wrong': {},
           'equivalent': drawn.equivalent, 'scales': drawn.scales}
    make = {'closed_loop': _closed, 'slow': _slow, 'switching': _switching, 'joint': _joint,
            'one_day': _day}[case.kind]
    truths, how = make(case, folder, drawn, chain, rng, closed_loop)
    found = {}
    if case.effect:
        found = gap.gap_in_sigma(drawn.numbers, drawn.without, chain, *truths, case.valve,
                                 **how)['plain']
    return key | {'gap_sigma': found}


def _closed(case, folder, drawn, chain, rng, closed_loop):
    truths = []
    for part in ('fit', 'certify'):
        sent_s, sent, wanted = closed_loop(case, drawn.numbers, chain, part)
        still = np.zeros((1, sent.shape[1]))
        start = runs.Truth(np.array([[effects.rig.ATM] * 6, ] * int(
            sent_s[-1] / sensors.ROW_S)), np.concatenate([[0.0], sent_s]),
            np.concatenate([still, sent]), sent_s, wanted)
        truth = runs.Truth(runs.replay(drawn.numbers, case.valve, start), sent_s, sent, sent_s,
                           wanted)
        runs.record(folder / part, truth, case.valve, chain, rng)
        # A refit starts as the rig did, before the first message of the controller.
        truths.append(replace(start, rows=truth.rows))
    return truths, {}


def _slow(case, folder, drawn, chain, rng, _):
    truths = []
    motion = _motion(rng)
    for part, name in (('fit', motion), ('certify', cases.CERTIFY[motion])):
        experiment = commands.protocol(name, int(rng.integers(2**31)))
        truth = (_held_run(drawn.numbers, experiment) if case.way == 'loop'
                 else runs.run_rig(drawn.numbers, case.valve, experiment))
        signals = runs.signals_of(truth, case.valve, chain, rng)
        bags.write_bag(folder / part, thinned(signals, SLOW_HZ, rng, case.way == 'loop'),
                       runs.SIGNALS[case.valve])
        truths.append(truth)
    late = {'thinned': 1.0 / SLOW_HZ / np.sqrt(12.0)}.get(case.way, gap.LATENCY_SD_S)
    return truths, {'latency_sd_s': late}


def _held_run(numbers, experiment):
    """Return the Truth of a regulator whose loop sends at 50 Hz."""
    times, _, held = commands.commands(experiment)
    held = np.repeat(held[::HELD_ROWS], HELD_ROWS)[:held.size]
    volts = np.clip((held[::HELD_ROWS] - effects.rig.ATM) / 1e5, 0.0, 6.0)[:, None]
    blank = runs.Truth(np.array([[held[0]] + [0.0] * 5] * int(
        (times[-1] + 1.0 / commands.RATE_HZ) / sensors.ROW_S)), times[::HELD_ROWS], volts, times,
        held)
    return runs.Truth(runs.replay(numbers, 'ppr', blank), blank.sent_s, volts, times, held)


def thinned(signals, rate_hz, rng, valve_whole=False):
    """
    Return {topic: (stamps, values)} of a log that keeps the newest message at its own instants.

    Messages keep their stamps. With ``valve_whole`` those of the valve are sent at that rate and
    are all there.
    """
    end_s = min(stamps[-1] for stamps, _ in signals.values())
    found = {}
    for topic, (stamps, values) in signals.items():
        if valve_whole and topic == 'valve_signal':
            found[topic] = stamps, values
            continue
        instants = np.arange(0.0, end_s, 1.0 / rate_hz)
        instants = instants + rng.uniform(0.0, 1.5e-3, instants.size)
        kept = np.unique(np.searchsorted(stamps, instants, side='right') - 1)
        kept = kept[kept >= 0]
        found[topic] = stamps[kept], values[kept]
    return found


def _switching(case, folder, drawn, chain, rng, _):
    truths = []
    motion = _motion(rng)
    for part, name in (('fit', motion), ('certify', cases.CERTIFY[motion])):
        wanted = commands.commands(commands.protocol(name, int(rng.integers(2**31))))
        truths.append(pulses.run_rig(drawn.numbers, *wanted))
        runs.record(folder / part, truths[-1], case.valve, chain, rng)
    return truths, {'replay': pulses.replay}


def _motion(rng):
    return 'minimum' if rng.random() < 0.67 else str(rng.choice(cases.OTHER_PROTOCOLS))


def _joint(case, folder, drawn, chain, rng, _):
    other = _inexact(case.valve, rng)
    place = joint.SIDES.index(case.way)
    numbers = (drawn.numbers, other) if place == 0 else (other, drawn.numbers)
    chains = [sensors.drawn_chain(rng), sensors.drawn_chain(rng)]
    chains[place] = chain
    truths = []
    for part in ('fit', 'certify'):
        both, angles = joint.run_joint(numbers, case.valve, *turns(part, rng))
        signals = {'joint_state': (np.arange(0.0, angles.size, 10) * sensors.ROW_S + 1e-3,
                                   angles[::10])}
        for side, truth, one in zip(joint.SIDES, both, chains):
            signals |= {f'{side}/{topic}': value for topic, value in runs.signals_of(
                truth, case.valve, one, rng).items() if topic != 'pressure_command'}
        bags.write_bag(folder / part, signals, runs.SIGNALS[case.valve], JOINT)
        truths.append(both[place])
    return truths, {'replay': joint.replay}


def turns(part, rng):
    """Return (wanted angle [rad], mean pressure of both muscles [Pa gauge]) at 200 Hz, 40 s."""
    t = np.arange(0.0, 40.0, 0.005)
    swing = rng.uniform(0.30, 0.40)
    stiff = rng.uniform(330e3, 370e3) + 40e3 * np.sin(2.0 * np.pi * t / rng.uniform(15.0, 25.0))
    if part == 'certify':
        wave = sum(np.sin(2.0 * np.pi * (f * t + rng.random())) for f in np.geomspace(
            0.1, 1.5, 8))
        return swing * wave / np.abs(wave).max(), stiff
    phase = np.mod(t / np.where(t < 18.0, 6.0, 1.5), 1.0)
    angle = swing * (1.0 - 2.0 * np.abs(2.0 * phase - 1.0))
    angle[t < 3.0] = 0.0
    steps = np.flatnonzero(t >= 27.0)
    levels = rng.uniform(-swing, swing, 40)
    angle[steps] = levels[((t[steps] - 27.0) / 0.9).astype(int)]
    return angle, stiff


def _day(case, folder, drawn, chain, rng, _):
    truths = []
    motions = rng.permutation(['steps', 'multisine', 'triangle', 'gait'])[:DAY_RUNS]
    for place, motion in enumerate(motions, 1):
        experiment = commands.protocol(str(motion), int(rng.integers(2**31)))
        truth = runs.run_rig(drawn.numbers, case.valve, experiment)
        rows = int(DAY_RUN_S / sensors.ROW_S)
        short = truth.sent_s < DAY_RUN_S
        asked = truth.wanted_s < DAY_RUN_S
        truth = runs.Truth(truth.rows[:rows], truth.sent_s[short], truth.sent[short],
                           truth.wanted_s[asked], truth.wanted[asked])
        chain.gaps = int(rng.integers(0, 3))
        runs.record(folder / f'fit_{place}', truth, case.valve, chain, rng)
        truths.append(truth)
    return truths[:2], {}
