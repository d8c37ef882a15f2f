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
How well the controllers of a joint follow angles that never repeat and steps nobody announced.

Run ``python benchmarks/unrepeated_joint.py``, with ``--joint knee`` or ``--valve ppr`` for a part
of it, ``--quick`` for one motion and two joints. In closed loop with sensor noise; the errors are
those of the joint. Rules and models are untaught. No seed of motion, noise or joints was used for
a search. ``pid`` is a PID with the static inverse of the joint. Its gains were searched for this
kind of motion, on the joint and three random ones about it. It is told nothing ahead. With
``--hidden`` random motion and steps are those of small joints of the independent simulator under
test/hidden, with other equations. Friction, valves and limb are off by up to 30 %.

- ``random``: a sum of 40 sines of random phase from 0.02 to 1 Hz, at most 17 degrees to either
  side. It is told as it comes, or 0.3 s ahead. Root mean square error of the first 30 s and from
  60 s on.
- ``joints``: the same, not announced, on random joints. Each muscle is drawn by itself, and so are
  mass and inertia of the limb. The drivers know the nominal joint.
- ``step``: 17 degrees to and fro on these joints, after 60 s of the random motion. Nobody
  announces the steps.
- ``gait``: knee flexion over 23 degrees, from the third stride on. The cadence changes every five
  strides. The muscles of the knee do not move a shank through more at 1.1 strides a second.
- ``sine``: 20 degrees to either side at 0.5 Hz, which repeats, told ahead: the first and the last
  of 20 cycles.
"""

import argparse
from dataclasses import dataclass
import math

from hidden_joint import HiddenJointLoop
import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.control.loop import ControllerLoop
from pam_actuation.drivers.for_rig import driver_config
from pam_actuation.experiments import load_experiment
from pam_actuation.experiments.joint_offline import JointLoops
from pam_actuation.messages import AngleReference
from pam_actuation.tuning.joint_loop import JointLoop
from pam_actuation.tuning.mode_result import ModeResult
from pam_actuation.tuning.random_rigs import random_rigs
from pam_sim.joint import load_joint
import results_page
import unrepeated
from unrepeated import CADENCES_HZ, DURATION_S, SEEDS, STEP_HOLD_S, STEPS

JOINTS, JOINT_SEED = 12, 700
HIDDEN_JOINTS, HIDDEN_SEED = 5, 911
BEGIN_S = 5.0
STEPS_FROM_S, STEP_RAD = 66.0, 0.3
SETTLED_RAD = math.radians(0.5)
PID = 'pid'
PIDS = {
    ('knee', 'ppr'): {
        'lead_s': 0.2, 'proportional_pa_per_m': 5.24e+6, 'integral_pa_per_m_s': 3.02e+7,
        'derivative_pa_s_per_m': 3.0e+6, 'change_filter_s': 0.002},
    ('joint', 'ppr'): {
        'lead_s': 0.2, 'proportional_pa_per_m': 9.97e+6, 'integral_pa_per_m_s': 2.2e+7,
        'derivative_pa_s_per_m': 3.55e+3, 'change_filter_s': 0.00672},
    ('knee', 'hsv'): {
        'lead_s': 0.2, 'proportional_pa_per_m': 1.63e+7, 'integral_pa_per_m_s': 3.17e+7,
        'derivative_pa_s_per_m': 3.0e+6, 'change_filter_s': 0.00347},
    ('joint', 'hsv'): {
        'lead_s': 0.155, 'proportional_pa_per_m': 9.76e+6, 'integral_pa_per_m_s': 8.46e+7,
        'derivative_pa_s_per_m': 4.73e+4, 'change_filter_s': 0.002}}


@dataclass(frozen=True)
class Case:
    """A joint and where it moves [rad]."""

    preset: str
    rest_rad: float
    middle_rad: float
    amplitude_rad: float
    gait_rad: tuple[float, float] | None = None

    def experiment(self, segments):
        """Return the experiment: from rest to the middle within 5 s, then the segments."""
        return load_experiment(f"""
name: moves
domain: joint_angle
segments:
  - step: {{to_rad: {self.rest_rad}, duration_s: 2.0}}
  - ramp: {{to_rad: {self.middle_rad}, duration_s: 3.0}}
{segments}""")

    def random_motion(self, seed, duration_s=DURATION_S, then=''):
        """Return the experiment of a random motion and further segments."""
        return self.experiment(
            f'  - multisine: {{center_rad: {self.middle_rad}, min_hz: 0.02, max_hz: 1.0, '
            f'lines: 40, amplitude_rad: {self.amplitude_rad}, duration_s: {duration_s}, '
            f'seed: {seed}}}\n{then}')

    def steps_after_motion(self, seed):
        """Return the experiment: a random motion, then steps up and down about the middle."""
        low, high = (self.middle_rad + side * 0.5 * STEP_RAD for side in (-1.0, 1.0))
        return self.random_motion(
            seed, STEPS_FROM_S - BEGIN_S - 1.0,
            f'  - ramp: {{to_rad: {low}, duration_s: 1.0}}\n' + STEPS // 2 * ''.join(
                f'  - step: {{to_rad: {to_rad}, duration_s: {STEP_HOLD_S}}}\n'
                for to_rad in (high, low)))

    def gait(self):
        """Return the experiment: a gait whose cadence changes every five strides."""
        low_rad, high_rad = self.gait_rad
        return self.experiment(
            f'  - ramp: {{to_rad: {low_rad}, duration_s: 2.0}}\n' + ''.join(
                f'  - knee_gait: {{low_rad: {low_rad}, high_rad: {high_rad}, '
                f'frequency_hz: {cadence_hz}, cycles: 5}}\n' for cadence_hz in CADENCES_HZ))


CASES = {
    'knee': Case('knee_dmsp_20_300_realistic', math.pi / 2.0, 1.0, 0.3, (0.9, 1.3)),
    'joint': Case('joint_dmsp_5_300_realistic', 0.0, 0.0, 0.3)}


def run(name, joint, nominal, experiment, seed, preview_s=0.0):
    """Return the run of a preset, or of ``pid``, with the drivers of the nominal joint."""
    if name == PID:
        return _pid_run(joint, nominal, experiment, seed)
    drivers = [driver_config(rig) for rig in (nominal.flexor, nominal.extensor)]
    return JointLoop(joint, experiment, seed=seed, preview_s=preview_s, drivers=drivers).run(
        loaded(name, nominal))


def loaded(name, nominal):
    """Return the controller of a preset, or ``pid``, for a joint."""
    if name != PID:
        return load_controller(name, nominal)
    size = 'knee' if nominal.name.startswith('knee') else 'joint'
    settings = ', '.join(f'{key}: {value}' for key, value in PIDS[size, nominal.valve].items())
    return load_controller(
        f'controller: pid\nmode: joint\njoint: {{co_contraction_gauge_pa: 300000}}\n'
        f'settings: {{use_static_inverse: 1, {settings}}}\n', nominal)


def _pid_run(joint, nominal, experiment, seed):
    """Return the run of the PID, tick by tick, as the compiled closed loop holds no PID."""
    loops = JointLoops(joint, ControllerLoop(loaded(PID, nominal), joint), seed)
    ticks = round(experiment.duration_s * loops.control.rate_hz)
    wanted_rad, angle_rad = np.empty(ticks), np.empty(ticks)
    for k in range(ticks):
        wanted_rad[k], rate = experiment.at(k / loops.control.rate_hz)
        angle_rad[k] = loops.plant.plant.angle_rad
        loops.control.take(
            'joint_reference', AngleReference(loops.now_ns, wanted_rad[k].item(), rate))
        loops.tick()
    return ModeResult('rad', np.arange(ticks) / loops.control.rate_hz, wanted_rad, angle_rad)


def previews_s(name):
    """Return how far ahead a controller is told the motion."""
    return (0.0,) if name == PID else (0.0, 0.3)


def filled(numbers, count):
    """Return the cells of a row, a dash where a number is missing."""
    return [f'{number:.2f}' for number in numbers] + ['–'] * (count - len(numbers))


def errors_deg(result):
    """Return the errors [degrees] of the first 30 s and from 60 s on."""
    return np.degrees([result.rmse(BEGIN_S, BEGIN_S + 30.0),
                       result.rmse(BEGIN_S + 60.0, BEGIN_S + DURATION_S)]).tolist()


def step_figures(result):
    """Return (settling time [s], overshoot [%]) of every step of a run."""
    return unrepeated.step_figures(result, STEPS_FROM_S, SETTLED_RAD, STEP_RAD)


def controllers_of(name, valve):
    """Return the presets that are compared."""
    return [f'sofc_model_{name}_{valve}', f'sofc_{name}_{valve}', PID]


def show_random(case, nominal, controllers, seeds):
    """Print the errors of the random motion on the nominal joint."""
    print('| controller | not announced: first 30 s | from 60 s | 0.3 s ahead: first 30 s '
          '| from 60 s |')
    print('|---|' + '---|' * 4)
    for name in controllers:
        cells = np.ravel([np.mean([errors_deg(run(
            name, nominal, nominal, case.random_motion(seed), seed, preview_s))
            for seed in seeds], axis=0) for preview_s in previews_s(name)])
        print(f'| {name} | ' + ' | '.join(filled(cells, 4)) + ' |', flush=True)


def show_joints(case, nominal, controllers, count):
    """Print errors and steps on random joints, nothing announced."""
    joints = random_rigs(nominal, count, seed=JOINT_SEED)
    print('| controller | first 30 s: median | worst | from 60 s: median | worst '
          '| step settles: median [s] | 9 of 10 within [s] | largest overshoot [%] |')
    print('|---|' + '---|' * 7)
    for name in controllers:
        first, late = np.transpose([errors_deg(run(
            name, joint, nominal, case.random_motion(JOINT_SEED + k), k))
            for k, joint in enumerate(joints)])
        settled_s, overshoot = np.transpose([
            figure for k, joint in enumerate(joints) for figure in step_figures(run(
                name, joint, nominal, case.steps_after_motion(JOINT_SEED + k), k))])
        print(f'| {name} | {np.median(first):.2f} | {first.max():.2f} | {np.median(late):.2f} '
              f'| {late.max():.2f} | {np.median(settled_s):.2f} '
              f'| {np.quantile(settled_s, 0.9):.2f} | {overshoot.max():.1f} |', flush=True)


def show_hidden(valve, controllers, count):
    """Print errors and steps on small joints of the independent simulator."""
    case = CASES['joint']
    nominal = load_joint(case.preset, valve=valve)
    print('| controller | not announced: first 30 s | worst | from 60 s | worst '
          '| 0.3 s ahead: first 30 s | from 60 s | step settles: median [s] '
          '| largest overshoot [%] |')
    print('|---|' + '---|' * 8)
    for name in controllers:
        def tracked(experiment, k, preview_s=0.0):
            loop = HiddenJointLoop(
                valve, HIDDEN_SEED + k, experiment, seed=k, preview_s=preview_s)
            return loop.run(loaded(name, nominal))
        told, ahead = (np.transpose([errors_deg(tracked(
            case.random_motion(HIDDEN_SEED + k), k, preview_s)) for k in range(count)])
            for preview_s in (0.0, 0.3))
        settled_s, overshoot = np.transpose([
            figure for k in range(count)
            for figure in step_figures(tracked(case.steps_after_motion(HIDDEN_SEED + k), k))])
        print(f'| {name} | {told[0].mean():.2f} | {told[0].max():.2f} | {told[1].mean():.2f} '
              f'| {told[1].max():.2f} | {ahead[0].mean():.2f} | {ahead[1].mean():.2f} '
              f'| {np.median(settled_s):.2f} | {overshoot.max():.1f} |', flush=True)


def show_gait(case, nominal, controllers):
    """Print the error of a gait whose cadence changes."""
    experiment, (low_rad, high_rad) = case.gait(), case.gait_rad
    start_s = BEGIN_S + 2.0 + 2.0 / CADENCES_HZ[0]
    print('| controller | not announced [deg] | of the stroke [%] | 0.3 s ahead [deg] '
          '| of the stroke [%] |')
    print('|---|' + '---|' * 4)
    for name in controllers:
        cells = []
        for preview_s in previews_s(name):
            error_deg = math.degrees(run(
                name, nominal, nominal, experiment, SEEDS[0], preview_s).rmse(start_s))
            cells += [error_deg, 1e2 * error_deg / math.degrees(high_rad - low_rad)]
        print(f'| {name} | ' + ' | '.join(filled(cells, 4)) + ' |', flush=True)


def show_sine(nominal, experiment, controllers):
    """Print the error of a sine, whole preview."""
    print('| controller | first cycle | last | worst of the last five |')
    print('|---|---|---|---|')
    for name in controllers:
        if name == PID:
            continue
        cycles = np.degrees(run(
            name, nominal, nominal, experiment, SEEDS[0], math.inf).cycle_rmse())
        print(f'| {name} | {cycles[0]:.2f} | {cycles[-1]:.3f} | {cycles[-5:].max():.3f} |',
              flush=True)


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    parser.add_argument('--joint', default='knee,joint', help='knee, joint, by commas')
    parser.add_argument('--valve', default='ppr,hsv', help='valves, by commas')
    parser.add_argument('--controller', default='', help='presets, by commas')
    parser.add_argument('--hidden', action='store_true',
                        help='on small joints of the independent simulator')
    parser.add_argument('--quick', action='store_true', help='one motion, two joints')
    results_page.add_write(parser, 'unrepeated_joint')
    return parser


def main():
    """Print the tables."""
    args = command_line().parse_args()
    seeds, count = (SEEDS[:1], 2) if args.quick else (SEEDS, JOINTS)
    with results_page.printed(args, __file__, 'hidden' * args.hidden):
        if args.hidden:
            for valve in args.valve.split(','):
                names = args.controller.split(',') if args.controller else controllers_of(
                    'joint', valve)
                print(f'\n## {HIDDEN_JOINTS} hidden joints, {valve}: random motion [deg], mean, '
                      'and steps, not announced\n')
                show_hidden(valve, names, 2 if args.quick else HIDDEN_JOINTS)
            return
        for kind in args.joint.split(','):
            case = CASES[kind]
            for valve in args.valve.split(','):
                nominal = load_joint(case.preset).with_(valve=valve)
                names = args.controller.split(',') if args.controller else controllers_of(
                    kind, valve)
                print(f'\n## Random motion, {kind}, {valve}: RMSE [deg], mean\n')
                show_random(case, nominal, names, seeds)
                print(f'\n## {count} random joints, {kind}, {valve}: random motion [deg] and '
                      'steps, not announced\n')
                show_joints(case, nominal, names, count)
                if case.gait_rad:
                    print('\n## Gait of changing cadence from the third stride on, '
                          f'{kind}, {valve}\n')
                    show_gait(case, nominal, names)
                print(f'\n## Sine of 0.5 Hz, {kind}, {valve}: RMSE [deg]\n')
                show_sine(nominal, load_experiment(f'{kind}_sine'), names)


if __name__ == '__main__':
    main()
