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

"""The worked example of docs/explanation/gap.md: a run of the gap workflow, and its figures."""

from pathlib import Path
import tempfile

from generate.drawing import BLUE, drawn, GREY, RED
import numpy as np
from pam_actuation.bags.load import load_run
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.offline import simulate_experiment
from pam_actuation.report.gap import free_run_overlay, write_gap
from pam_sim import load_rig
from pam_sim.gap.result import GapResult
from pam_sim.run import Run

MODEL = 'dmsp_5_300_hanging_mass'
TRUTH = """rig: dmsp_5_300_hanging_mass
valve: ppr
effects:
  - name: hysteresis
    parameters: {force_n: 0.9, force_per_pa: 3.0e-6}
sensors:
  pressure_noise_pa: 300.0
  contraction_noise_m: 1.0e-5
  force_noise_n: 0.1
  stamp_jitter_s: 5.0e-5
"""
RECORDINGS = (('first', 'pressure_identification', 1), ('second', 'multisine', 2))
BUDGET_S = 900.0
# Parameters of the model and how far each is moved for its signature.
MOVED = {'mass_kg': 0.02, 'force_map_gain': 0.02, 'damping_n_s_per_m': 0.2, 'K_m': 0.01,
         'T_m': 0.05}
EFFECTS = ('hysteresis', 'coulomb_friction', 'guide_friction', 'creep', 'viscous_damping',
           'end_taper', 'parallel_spring', 'bladder_stiffness')


def example(folder: Path) -> tuple[list[Run], GapResult]:
    """
    Make the two recordings of the example in a folder, and the answer with its report in ``gap``.

    Parameters
    ----------
    folder : Path
        An empty folder.

    Returns
    -------
    list of Run
        The recording that is fitted and the one kept aside.
    GapResult

    """
    (folder / 'truth.yaml').write_text(TRUTH, encoding='utf-8')
    rig = load_rig(folder / 'truth.yaml')
    runs = []
    for name, experiment, seed in RECORDINGS:
        simulate_experiment(load_experiment(experiment), rig, None, folder / name, seed=seed)
        runs.append(load_run(folder / name))
    return runs, write_gap(runs[:1], MODEL, folder / 'gap', runs[1], seconds=BUDGET_S)


def draw(folder: Path) -> dict[str, str]:
    """Run the example, draw its figures into a folder; return what the page states."""
    with tempfile.TemporaryDirectory() as place:
        place = Path(place)
        runs, result = example(place)
        corrected = load_rig(place / 'gap' / 'model.yaml')
    _errors(runs[1], corrected, folder)
    shares = _screened(runs[0], folder)
    plain = result.to_dict()
    low, high = plain['effects'][0]['equivalent']['loop_half_width_at_400kpa_n']['ci95']
    return {
        **{f'line {k}': ' '.join(line.split())
           for k, line in enumerate(result.text().split('\n'), 1)},
        'interval': f'{low:.2f} to {high:.2f} N',
        'share of the muscle': f'{100.0 * plain["where"][0]["share_of_gap"]:.0f} %',
        **{f'{name} explains': f'{100.0 * share:.0f} %' for name, share in shares.items()
           if name in (*EFFECTS[:4], 'numbers')}}


def _contraction(run, rig):
    curve, = (one for one in free_run_overlay(run, rig) if one.signal == 'contraction')
    return np.asarray(curve.time_s), 1e3 * np.asarray(curve.recorded), (
        1e3 * np.asarray(curve.simulated))


def _errors(run, corrected, folder):
    with drawn(folder / 'gap_errors.svg', 2) as (left, right):
        for label, rig, colour in (('given model', load_rig(MODEL), RED),
                                   ('with hysteresis', corrected, BLUE)):
            time_s, recorded, simulated = _contraction(run, rig)
            left.plot(time_s, recorded - simulated, color=colour, lw=0.9, label=label,
                      rasterized=True)
            part = (time_s > 12.0) & (time_s < 15.0)
            right.plot(time_s[part], simulated[part], color=colour, lw=1.0)
        right.plot(time_s[part], recorded[part], color='black', lw=1.0, ls=':', label='recorded')
        left.set(xlabel='time, s', ylabel='recorded - simulated, mm', ylim=(-5.0, 4.0),
                 title='the recording kept aside')
        left.legend(ncols=2, loc='lower left')
        right.set(xlabel='time, s', ylabel='contraction, mm', title='three seconds of it')
        right.legend()


def _screened(run, folder):
    """Draw how much of the gap each signature explains once the numbers have had their part."""
    model = load_rig(MODEL)
    _, recorded, simulated = _contraction(run, model)

    def change(rig):
        return _contraction(run, rig)[2] - simulated

    numbers = np.column_stack([
        change(model.with_(parameters={name: (1.0 + part) * model.parameters[name]}))
        for name, part in MOVED.items()])
    basis, _ = np.linalg.qr(numbers)
    gap = recorded - simulated
    left_over = gap - basis @ (basis.T @ gap)
    shares = {}
    for name in EFFECTS:
        signature = change(model.with_(effects=[{'name': name}]))
        signature -= basis @ (basis.T @ signature)
        shares[name] = float((signature @ left_over) ** 2 / (signature @ signature)
                             / (left_over @ left_over))
    ranked = sorted(shares.items(), key=lambda one: one[1])
    by_numbers = float(1.0 - (left_over @ left_over) / (gap @ gap))
    with drawn(folder / 'gap_screen.svg', height_in=2.6) as axis:
        axis.barh([name for name, _ in ranked], [100.0 * share for _, share in ranked],
                  color=[BLUE if name == 'hysteresis' else GREY for name, _ in ranked])
        axis.set(xlabel='share of the rest that one signature explains, %', xlim=(0, 100))
    return {**shares, 'numbers': by_numbers}
