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
Process replay: what controller, driver, plant and chain make of pinned bags, field by field.

Each case is a bag of one simulated second beside a file of reference outputs, written by
``refresh.py``. Outputs are named ``part/topic.field``.
"""

from pathlib import Path

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.replay.chain import replay_chain
from pam_actuation.replay.controller import replay_controller
from pam_actuation.replay.driver import replay_driver
from pam_actuation.replay.plant import replay_plant

PINNED = Path(__file__).resolve().parent / 'pinned'
OLDER = PINNED.parent / 'older'          # bags of versions before
EXPERIMENT = PINNED / 'experiment.yaml'
RIG = 'dmsp_5_300_realistic'
SEED = 4
# Name of a case -> valve and controller it was simulated with.
CASES = {'sofc_ppr': ('ppr', 'sofc_ppr'), 'sofc_hsv': ('hsv', 'sofc_hsv'),
         'pid_ppr': ('ppr', 'pid')}
# Largest difference of a part, as a share of the largest reference value of the field. Other
# processors and compilers may round the last bit of a power or a logarithm differently; a
# closed loop carries such a bit on.
TOLERANCE = {'controller': 1e-9, 'driver': 1e-9, 'plant': 1e-9, 'chain': 1e-7}


def bag_of(case):
    """Return the path of a case's bag."""
    return PINNED / f'{case}.mcap'


def reference_of(case):
    """Return the path of a case's reference outputs."""
    return PINNED / f'{case}.npz'


def outputs(case):
    """Return everything the parts make of a pinned bag: ``part/topic.field`` to array."""
    run = load_run(bag_of(case))
    control = replay_controller(run, keep_states=True)
    out = {'controller/pressure_command.stamp_ns': control.stamp_ns,
           'controller/pressure_command.pressure_pa': control.replayed_pa}
    out.update({f'controller/controller_state.{name}': values
                for name, values in control.states.items()})
    driver = replay_driver(run)
    out['driver/valve_signal.stamp_ns'] = driver.stamp_ns
    out.update({f'driver/valve_signal.{name}': values
                for name, values in driver.replayed.items()})
    plant = replay_plant(run)
    out.update({f'plant/{name}.value': values for name, values in plant.simulated.items()})
    out.update({f'chain/{name}': values for name, values in replay_chain(run).replayed.items()})
    return out


def compare(reference, now):
    """
    Return sentences on everything that differs between two outputs, empty if nothing does.

    Fields that came or went and other message counts are told first; values are compared
    only where the counts agree.
    """
    found = [f'{name}: is no longer there' for name in sorted(set(reference) - set(now))]
    found += [f'{name}: is new' for name in sorted(set(now) - set(reference))]
    common = [name for name in reference if name in now]
    counted = {name.partition('.')[0]: (len(now[name]), len(reference[name]))
               for name in common if len(now[name]) != len(reference[name])}
    found += [f'{topic}: {count} messages, {before} in the reference'
              for topic, (count, before) in counted.items()]
    if found:
        return found
    return [sentence for name in common
            if (sentence := _compare_values(name, reference[name], now[name]))]


def _compare_values(name, reference, now):
    if name.endswith('.stamp_ns'):
        differing = int(np.sum(reference != now))
        return f'{name}: {differing} stamps differ' if differing else ''
    both_missing = np.isnan(reference) & np.isnan(now)
    with np.errstate(invalid='ignore'):
        away = np.where(both_missing, 0.0, np.abs(now - reference))
    away = np.where(np.isnan(away), np.inf, away)
    known = reference[np.isfinite(reference)]
    scale = float(np.max(np.abs(known))) if known.size else 0.0
    allowed = TOLERANCE[name.split('/')[0]] * scale
    worst = int(np.argmax(away))
    if away[worst] <= allowed:
        return ''
    return (f'{name}: largest difference {away[worst]:.3g} at message {worst} (allowed '
            f'{allowed:.3g}), {int(np.sum(away > allowed))} of {len(now)} messages differ')


def load_reference(case):
    """Return the reference outputs of a case."""
    with np.load(reference_of(case)) as stored:
        return {name: stored[name] for name in stored.files}
