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
Does the model that `pam gap` improved make a better controller? Tuned on both, run on the rig.

    python benchmarks/gap_to_tuning.py                       # all cases, Markdown table
    python benchmarks/gap_to_tuning.py --cases hysteresis --rollouts 600

Per case an effect is hidden in a rig of the independent simulator under test/hidden, whose
numbers are off by a per cent or two. It is recorded twice; `pam gap` gets both bags and the
nominal model and writes its model.yaml. The same controller is then tuned twice, on the nominal
and on that model, with the same budget and seeds. Each result tracks on the hidden rig, which
neither tuning has seen. The experiments are the one held out from the search and one more. Rules
are frozen as tuned, and learn on where the law learns. RMSE over all cycles.
"""

import argparse
from pathlib import Path
import sys
import tempfile

import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.report.gap import write_gap
from pam_actuation.report.metrics import run_metrics
from pam_actuation.tuning.tune import tune
from pam_sim import load_rig

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / 'test' / 'hidden'))

from hidden_rig import hiding  # noqa: E402, I100
import results_page  # noqa: E402
import truth_commands  # noqa: E402
import truth_effects  # noqa: E402
import truth_run  # noqa: E402
import truth_sensors  # noqa: E402

MODEL = 'dmsp_5_300_hanging_mass'
# Everyday sizes: the effect, times its usual size.
CASES = {'nothing': (), 'hysteresis': (('hysteresis', 2.0),), 'creep': (('creep', 2.0),),
         'end_taper': (('end_taper', 2.0),), 'parallel_spring': (('parallel_spring', 2.0),),
         'dead_time': (('valve_dead_time', 2.0),),
         'taper_and_friction': (('end_taper', 1.5), ('coulomb_friction', 1.0))}
CONTROLLERS = {'sofc_untuned': (False, True), 'pid': (False,)}       # learning: off, on
SEARCHED = ('tuning_quarter_hz', 'tuning_half_hz', 'tuning_one_hz')
CHECKS = ('tuning_check', 'sine_half_hz')
NOISE = {'pressure_noise_pa': 300.0, 'contraction_noise_m': 1e-5, 'force_noise_n': 0.1}
SEEDS = (11,)                  # of the sensor noise on the hidden rig
TUNING_SEED, CASE_SEED = 1, 2026


def hidden_rig(numbers):
    """Return the hidden rig with the sensor noise of a real one."""
    return hiding(load_rig(MODEL).with_(sensors=NOISE), numbers)


def hidden_numbers(effects, seed):
    """Return the numbers of a hidden rig, those of the data sheet off by 1 to 2 %."""
    rng = np.random.default_rng(seed)
    numbers = {}
    for name in truth_effects.PARAMETERS_OF['ppr']:
        number, nominal = truth_effects.PARAMETERS[name]
        numbers[number] = nominal * (1.0 + rng.choice((-1.0, 1.0)) * rng.uniform(0.01, 0.02))
    for effect, scale in effects:
        numbers |= truth_effects.EFFECTS[effect].draw(rng, scale, 'ppr').numbers
    return numbers


def improved_model(numbers, folder, seed):
    """Record the rig, look for the gap; return (verdict in words, rig of model.yaml)."""
    rng = np.random.default_rng([seed, 1])
    chain = truth_sensors.drawn_chain(rng)
    for part, protocol in (('fit', 'minimum'), ('certify', 'multisine')):
        truth = truth_run.run_rig(
            numbers, 'ppr', truth_commands.protocol(protocol, int(rng.integers(2**31))))
        truth_run.record(folder / part, truth, 'ppr', chain, rng)
    result = write_gap([load_run(folder / 'fit')], MODEL, folder / 'gap',
                       load_run(folder / 'certify'))
    names = [e['name'] for e in result.effects] + [p.name for p in result.parameters]
    return (f'{result.verdict}: {", ".join(names) or "-"}',
            load_rig(str(folder / 'gap' / 'model.yaml')))


def tuned(preset, model, rollouts, folder):
    """Return the path of the controller tuned on a model."""
    model = model.with_(sensors=NOISE)
    result = tune(model, load_controller(preset, model), [load_experiment(n) for n in SEARCHED],
                  budget=rollouts, seed=TUNING_SEED, jobs=1,
                  held_out=load_experiment(CHECKS[0]))
    folder.mkdir()
    rules = None if result.controller.rules is None else folder / 'rules.json'
    result.save(folder / 'tuned.yaml', rules)
    return folder / 'tuned.yaml'


def error_mm(path, model, rig, learning, folder):
    """Return the RMSE [mm] of a controller on a rig; it knows the model alone."""
    squares = []
    for name in CHECKS:
        for seed in SEEDS:
            bag = simulate_experiment(
                load_experiment(name), rig, load_controller(str(path), model), folder / 'bag',
                seed=seed, learning=learning, overwrite=True)['bag']
            squares.append(np.mean((run_metrics(load_run(bag)).cycle_rmse_m * 1e3) ** 2))
    return float(np.sqrt(np.mean(squares)))


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--cases', default=','.join(CASES))
    parser.add_argument('--rollouts', type=int, default=1000)
    results_page.add_write(parser, 'gap_to_tuning')
    return parser


def show(args):
    """Print one line per case and controller."""
    nominal = load_rig(MODEL)
    print('| hidden | pam gap says | controller | rules | tuned on nominal [mm] '
          '| tuned on model.yaml [mm] | change |\n|---|---|---|---|---|---|---|')
    for place, name in enumerate(CASES):
        if name not in args.cases.split(','):
            continue
        numbers = hidden_numbers(CASES[name], [CASE_SEED, place])
        with tempfile.TemporaryDirectory(prefix='gap_to_tuning_') as folder:
            folder = Path(folder)
            said, model = improved_model(numbers, folder, CASE_SEED + place)
            for preset, ways in CONTROLLERS.items():
                paths = {which: tuned(preset, rig, args.rollouts, folder / f'{preset}_{which}')
                         for which, rig in (('nominal', nominal), ('model', model))}
                for learning in ways:
                    before, after = (
                        error_mm(paths[which], rig, hidden_rig(numbers), learning, folder)
                        for which, rig in (('nominal', nominal), ('model', model)))
                    rules = 'learning' if learning else 'frozen'
                    print(f'| {name} | {said} | {preset} '
                          f'| {rules if len(ways) > 1 else "-"} | {before:.3f} | {after:.3f} '
                          f'| {100.0 * (after / before - 1.0):+.0f} % |', flush=True)


if __name__ == '__main__':
    sys.exit(results_page.run(command_line(), __file__, show))
