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

"""All measurements for the regulator and the on/off pair, averaged and switching."""

from collections.abc import Callable
from typing import Any, TYPE_CHECKING

import numpy as np
from pam_actuation.valves import measure
from pam_actuation.valves.chain import Bench
from pam_actuation.valves.energy import power_values
from pam_sim.effects.setting import forms_of
from pam_sim.errors import InputError
from pam_sim.load import LOADS

if TYPE_CHECKING:
    from pam_sim.rig import Rig

CHAINS = {'ppr': ('ppr', 'averaged'), 'hsv averaged': ('hsv', 'averaged'),
          'hsv switching': ('hsv', 'switching')}
TITLES = {'ppr': 'PPR', 'hsv averaged': 'HSV averaged', 'hsv switching': 'HSV switching'}
HOLD_S, LEAST_HOLD_S, MOST_HOLD_S = 60.0, 2.0, 3600.0
STAGES = 7 * len(CHAINS)


def compare(rig: 'Rig', seed: int = 0, power: dict[str, float] | None = None,
            hold_s: float = HOLD_S,
            progress: Callable[..., Any] | None = None) -> dict[str, Any]:
    """
    Measure every chain on one rig.

    Parameters
    ----------
    rig : pam_sim.rig.Rig
        Muscle, load, effects; its valve is replaced.
    seed : int
        Of the sensor noise; same seed, same numbers.
    power : dict, optional
        Power numbers as of ``energy.power_values``; design values by default.
    hold_s : float
        Length of the holds.
    progress : callable, optional
        Called after each of :data:`STAGES` stages.

    Returns
    -------
    dict
        ``rig``, ``seed``, ``power``, ``hold_s`` and ``valves``: chain name to its
        numbers, SI.

    Raises
    ------
    InputError
        The hold is too short or too long, the load's motion must be prescribed, the PWM period
        is no whole number of ms, or the driver cannot follow on this rig.

    """
    if not LEAST_HOLD_S <= hold_s <= MOST_HOLD_S:
        raise InputError(f'a hold of {hold_s:g} s; allowed {LEAST_HOLD_S:g} to {MOST_HOLD_S:g} s',
                         'hold')
    if LOADS[rig.load].NEEDS_CONTRACTION:
        raise InputError(f'load `{rig.load}` needs a recorded contraction; choose a rig with '
                         'another load', rig.name)
    power = power_values() if power is None else power
    benches = {name: Bench(rig.with_(valve=valve, fidelity=fidelity), seed)
               for name, (valve, fidelity) in CHAINS.items()}
    valves = {name: _measure(bench, power, hold_s, progress or (lambda: None))
              for name, bench in benches.items()}
    return {'schema': 1, 'rig': rig.name, 'load': rig.load,
            'effects': [item.name for item in rig.effects], 'seed': seed, 'hold_s': hold_s,
            'hold_gauge_pa': measure.HOLD_PA, 'cycle_gauge_pa': list(measure.CYCLE_PA),
            'power': power, 'valves': valves}


def _measure(bench: Bench, power: dict[str, float], hold_s: float,
             done: Callable[..., Any]) -> dict[str, Any]:
    rig = bench.rig
    steps = measure.measure_steps(bench)
    done()
    accuracy, signal = measure.measure_accuracy(bench)
    done()
    moving = measure.signal_use(rig, signal, power)
    sines = measure.measure_bandwidth(bench)
    done()
    cycle = measure.measure_cycle(bench)
    done()
    hold = measure.measure_hold(bench, hold_s, power)
    done()
    leaks = forms_of(rig.effects, 'leakage')
    leaking = rig.with_(effects=[
        *(item for item in rig.effects if item not in leaks), measure.LEAK])
    leak = measure.measure_hold(Bench(leaking, bench.seed), hold_s, power)
    done()
    loss = measure.measure_power_loss(bench)
    flow = measure.measure_flow(rig)
    done()
    return {'accuracy': accuracy, 'steps': steps, 'response': _response(steps), 'moving': moving,
            'small_sines': sines, 'cycle': cycle, 'hold': hold, 'hold_leaking': leak,
            'power_loss': loss, 'flow': flow}


def _response(steps: list[dict[str, Any]]) -> dict[str, float | None]:
    """Return means over the steps that fill and that vent, and the worst of all."""
    result: dict[str, float | None] = {}
    for kind in ('fill', 'vent'):
        chosen = [s for s in steps if (s['to_pa'] > s['from_pa']) == (kind == 'fill')]
        for name in ('dead_time_s', 'rise_s', 'settling_s'):
            values = [s[name] for s in chosen]
            result[f'{kind}_{name}'] = None if None in values else float(np.mean(values))
    settling = [s['settling_s'] for s in steps]
    result['settling_worst_s'] = None if None in settling else max(settling)
    result['not_settled'] = settling.count(None)
    result['overshoot_worst'] = max(s['overshoot'] for s in steps)
    result['error_worst_pa'] = max(abs(s['error_pa']) for s in steps)
    return result
