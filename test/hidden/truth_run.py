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

"""One run of the hidden rig: an experiment in, the truth and a bag out."""

from dataclasses import dataclass

import numpy as np
import truth_bags as bags
import truth_commands as commands
import truth_numbers
import truth_rig as rig
import truth_sensors as sensors

SETTLE_S = 2.0                # before the recording, so that the rig has forgotten its start
SIGNALS = {'ppr': ('ppr_voltage',), 'hsv': ('fill_duty', 'vent_duty')}


@dataclass
class Truth:
    """
    What happened: rows of the rig, the signal sent (instants and values), what was wanted.

    The time 0 of all is the start of the recording.
    """

    rows: np.ndarray
    sent_s: np.ndarray
    sent: np.ndarray
    wanted_s: np.ndarray
    wanted: np.ndarray


def run_rig(numbers, valve, experiment):
    """
    Return the Truth of an experiment on the rig with these numbers.

    The regulator gets the voltage of its data sheet; the on/off pair is driven by an inner
    loop on the true pressure, so that its duties depend on what is hidden.
    """
    times, wanted, held = commands.commands(experiment)
    vector = truth_numbers.numbers(**numbers)
    lead = np.array([-SETTLE_S])
    instants = np.concatenate([lead, times]) + SETTLE_S
    end_s = instants[-1] + 1.0 / commands.RATE_HZ
    start = held[0] - rig.ATM
    if valve == 'ppr':
        volts = np.clip((np.concatenate([held[:1], held]) - rig.ATM) / 1e5, 0.0, 6.0)
        rows, _ = rig.simulate(vector, rig.PPR, instants, volts, np.zeros(volts.size), start,
                               end_s, False)
        sent_s, sent = times, volts[1:, None]
    else:
        aim = np.concatenate([held[:1], wanted])
        rows, duties = rig.simulate(vector, rig.HSV, instants, aim, np.zeros(aim.size), start,
                                    end_s, True)
        late = duties[:, 0] >= SETTLE_S - 1e-9
        sent_s, sent = duties[late, 0] - SETTLE_S, duties[late, 1:]
    return Truth(rows[int(round(SETTLE_S / sensors.ROW_S)):], sent_s, sent, times, held)


def replay(numbers, valve, truth, start_pa=None):
    """
    Return the rows of a rig with these numbers, given the signal sent in another run.

    It starts at ``start_pa`` [Pa], by default where the other run did.
    """
    instants = truth.sent_s + SETTLE_S
    first = truth.sent[:, 0]
    second = truth.sent[:, 1] if valve == 'hsv' else np.zeros(first.size)
    idle = np.zeros(1)
    lead = truth.sent[:1, 0] if valve == 'ppr' else idle
    start = truth.rows[0, rig.O_P] if start_pa is None else start_pa
    rows, _ = rig.simulate(
        truth_numbers.numbers(**numbers), rig.PPR if valve == 'ppr' else rig.HSV,
        np.concatenate([idle, instants]), np.concatenate([lead, first]),
        np.concatenate([idle, second]), start - rig.ATM,
        SETTLE_S + (truth.rows.shape[0] - 1) * sensors.ROW_S, False)
    return rows[int(round(SETTLE_S / sensors.ROW_S)):]


def record(path, truth, valve, chain, rng):
    """Measure a Truth and write the bag."""
    bags.write_bag(path, signals_of(truth, valve, chain, rng), SIGNALS[valve])


def signals_of(truth, valve, chain, rng):
    """Return {topic: (stamps [s], values)} of what sensors and stamps make of a Truth."""
    signals = sensors.measured(truth.rows, chain, rng, reservoir=valve == 'hsv')
    skew = chain.skew_s.get('valve_signal', 0.0)
    stamps = truth.sent_s + 1e-3 + skew + sensors.stamp_errors(truth.sent_s.size, chain, rng)
    order = np.argsort(stamps, kind='stable')
    # A message is stamped when it is sent; the bag begins a moment before the first.
    signals = {topic: (t + 1e-3, v) for topic, (t, v) in signals.items()}
    signals['valve_signal'] = (stamps[order], truth.sent[order])
    every = 2
    signals['pressure_command'] = (truth.wanted_s[::every] + 1e-3, truth.wanted[::every])
    return signals
