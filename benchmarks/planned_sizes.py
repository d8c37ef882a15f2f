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
Do the sizes of `pam gap --plan` hold? Effects at and below them, simulated and looked for.

    python benchmarks/planned_sizes.py                       # every effect, Markdown table
    python benchmarks/planned_sizes.py --effects coulomb_friction,leakage --times 0.5,1.5

The plan says from which size on an effect can be named. Each effect is put into the rig at
multiples of that size, and the protocol is simulated with the noise of the sensors. The gap
workflow then compares the record with the nominal model; every fifth block is kept for the proof.
"""

import argparse
import sys

from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.protocols import sensitivities
from pam_actuation.experiments.separating import sensors_for, simulated
from pam_sim import load_rig
from pam_sim.gap import find_gap
from pam_sim.gap.plan.outlook import outlooks
from pam_sim.gap.plan.sensitivity import sized
import results_page

MODEL, PROTOCOL = 'dmsp_5_300_hanging_mass', 'pressure_identification'


def at_size(looks, outlook, times):
    """Return the effect as an entry of a model file, at a multiple of its nameable size."""
    return looks.probes[outlook.name].setting(
        sized(looks.probes[outlook.name], times * outlook.factors[1]))


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--effects', default=None)
    parser.add_argument('--times', default='0.5,1.5')
    parser.add_argument('--valve', default='ppr')
    parser.add_argument('--seconds', type=float, default=600.0, help='budget of each look')
    results_page.add_write(parser, 'planned_sizes')
    return parser


def show(args):
    """Print one line per effect."""
    rig = load_rig(MODEL, valve=args.valve)
    noisy = sensors_for(rig)[1]
    plain = load_experiment(PROTOCOL).to_dict()
    looks = sensitivities(plain, noisy)
    times = [float(t) for t in args.times.split(',')]
    print('| effect | ' + ' | '.join(f'{t:g} times the size' for t in times) + ' |')
    print('|---' * (len(times) + 1) + '|')
    for outlook in outlooks(looks):
        if outlook.named is None or args.effects and outlook.name not in args.effects.split(','):
            continue
        cells = []
        for t in times:
            truth = noisy.with_(effects=[at_size(looks, outlook, t)])
            result = find_gap(simulated(plain, truth), rig, seconds=args.seconds)
            said = result.ambiguity_set or [p.name for p in result.parameters]
            cells.append(' '.join([result.verdict, *said]))
        print(f'| {outlook.name} | ' + ' | '.join(cells) + ' |', flush=True)


if __name__ == '__main__':
    sys.exit(results_page.run(command_line(), __file__, show))
