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
How many closed-loop rollouts of 20 s a minute `pam tune` gets through.

Run ``OPENBLAS_NUM_THREADS=1 python benchmarks/tuning_speed.py`` (``pam`` sets that by itself);
about a minute on a quiet machine. Every rollout
builds a controller with other settings, tracks 0.5 Hz at 200 Hz on the realistic rig at
1 ms (noise on) and yields a cost, as the search does. One thread and all cores are timed.

Beside it stands the same loop as one would write it with SciPy: a PID and the three differential
equations of the nominal rig. ``scipy.integrate.solve_ivp`` goes from one change of the valve
signal to the next. The force law it calls is the compiled one, everything else is Python. Both
comparisons are made of a joint as well, its peer with both muscles and the limb.
"""

import argparse
import os
import time

import numpy as np
from pam_actuation.control.config import load_controller
from pam_actuation.experiments import load_experiment
from pam_actuation.tuning.closed_loop import ClosedLoop
from pam_actuation.tuning.joint_loop import JointLoop
from pam_actuation.tuning.problem import cost_of, Problem
from pam_actuation.tuning.space import default_axes, from_unit
from pam_actuation.workers import Workers
from pam_sim import load_rig
from pam_sim.joint import load_joint
from pam_sim.muscle.laws.sarosi import tension_n
from pam_sim.records import fields, values_of
from pam_sim.units import GRAVITY_M_PER_S2, P_ATM_PA
import results_page
from scipy.integrate import solve_ivp

EXPERIMENT, JOINT_EXPERIMENT = 'tuning_half_hz', 'joint_tuning'
ROLLOUTS = 200
REPEATS = 3
LATENCY_S = 0.003
# Gentle gains: the nominal rig has no friction to damp it.
PEER_CONTROLLER = """
controller: pid
settings: {use_static_inverse: 1, lead_s: 0.1, proportional_pa_per_m: 8.0e5,
           integral_pa_per_m_s: 1.2e7, derivative_pa_s_per_m: 8.0e4}
"""


def per_minute(problem, jobs):
    """Return (rollouts a minute, ms of processor time each) of the best of several runs."""
    axes = default_axes(problem.controller)
    points = np.random.default_rng(1).uniform(0.3, 0.7, (ROLLOUTS, len(axes)))
    settings = [from_unit(axes, point) for point in points]
    rate, busy_ms = 0.0, np.inf
    with Workers(jobs) as workers:
        workers.map(cost_of, problem, settings[:4])
        for _ in range(REPEATS):
            began, used = time.perf_counter(), time.process_time()
            workers.map(cost_of, problem, settings)
            rate = max(rate, 60.0 * ROLLOUTS / (time.perf_counter() - began))
            busy_ms = min(busy_ms, 1e3 * (time.process_time() - used) / ROLLOUTS)
    return rate, busy_ms


def _law(rig):
    law = rig.muscle.law.law
    return fields(values_of(law.PACKED, law.pack()), law.PACKED)


def with_solve_ivp(rig, controller, experiment, rtol=1e-6):
    """Track with ``solve_ivp`` between changes of the signal; return (contraction [m], s)."""
    number = rig.parameters
    law = _law(rig)
    gain, lag, mass = number['K_m'], number['T_m'], number['mass_kg']
    damping, length_m = number['damping_n_s_per_m'], rig.muscle.length_m

    def slopes(_, state, volts):
        gauge, x, v = state
        net = tension_n(gauge, x / length_m, law) - damping * v - mass * GRAVITY_M_PER_S2
        held = x <= 0.0 and v <= 0.0 and net < 0.0
        return (gain * volts - gauge) / lag, v, 0.0 if held else net / mass

    period_s = 1.0 / controller.rate_hz
    ticks = int(round(experiment.duration_s * controller.rate_hz))
    state, volts, contraction = np.zeros(3), 0.0, np.empty(ticks)
    controller.pause()
    began = time.perf_counter()
    for k in range(ticks):
        contraction[k] = state[1]
        wanted = experiment.at(k * period_s)
        ahead = experiment.at(k * period_s + controller.lead_s)
        command = controller.step(state[1], *wanted, *ahead, pressure_pa=state[0] + P_ATM_PA)
        for span_s, signal in ((LATENCY_S, volts), (period_s - LATENCY_S, None)):
            if signal is None:
                signal = volts = min(max((command - P_ATM_PA) / gain, 0.0), 6.0)
            state = solve_ivp(slopes, (0.0, span_s), state, args=(signal,), rtol=rtol,
                              atol=(1e-1, 1e-9, 1e-7)).y[:, -1]
    return contraction, time.perf_counter() - began


def joint_with_solve_ivp(joint, controller, experiment, rtol=1e-6):
    """Track an angle as ``with_solve_ivp`` does; return (angle [rad], s of processor time)."""
    number, sides = joint.parameters, (joint.flexor, joint.extensor)
    laws = [_law(rig) for rig in sides]
    gain, lag, damping = ([rig.parameters[name] for rig in sides]
                          for name in ('K_m', 'T_m', 'damping_n_s_per_m'))
    arms = number['flexor_radius_m'], -number['extensor_radius_m']
    weight_n_m = (number['limb_mass_kg'] * number['centre_of_mass_m']
                  * number['gravity_m_per_s2'])

    def tensions(state):
        contractions_m = joint.contractions_m(state[2])
        return [max(tension_n(state[k], contractions_m[k] / rig.muscle.length_m, laws[k])
                    - damping[k] * arms[k] * state[3], 0.0) for k, rig in enumerate(sides)]

    def slopes(_, state, volts):
        flexor_n, extensor_n = tensions(state)
        torque = (arms[0] * flexor_n + arms[1] * extensor_n
                  - weight_n_m * np.sin(state[2] - number['hanging_angle_rad'])
                  - number['damping_n_m_s'] * state[3])
        return ((gain[0] * volts[0] - state[0]) / lag[0], (gain[1] * volts[1] - state[1]) / lag[1],
                state[3], torque / number['inertia_kg_m2'])

    period_s = 1.0 / controller.rate_hz
    ticks = int(round(experiment.duration_s * controller.rate_hz))
    state, volts, angle = np.zeros(4), (0.0, 0.0), np.empty(ticks)
    controller.pause()
    began = time.process_time()
    for k in range(ticks):
        angle[k] = state[2]
        commands = controller.step(
            state[2], *experiment.at(k * period_s),
            *experiment.at(k * period_s + controller.lead_s),
            pressures_pa=state[:2] + P_ATM_PA, forces_n=tensions(state))
        for span_s in (LATENCY_S, period_s - LATENCY_S):
            state = solve_ivp(slopes, (0.0, span_s), state, args=(volts,), rtol=rtol,
                              atol=(1e-1, 1e-1, 1e-8, 1e-6)).y[:, -1]
            volts = [min(max((command - P_ATM_PA) / one, 0.0), 6.0)
                     for command, one in zip(commands, gain)]
    return angle, time.process_time() - began


def of_a_joint(cores):
    """Print both tables of a joint."""
    experiment = load_experiment(JOINT_EXPERIMENT)
    print(f'\n## Rollouts of {experiment.duration_s:g} s a minute, realistic joint\n')
    print(f'| controller | valve | 1 thread | {cores} threads | ms of processor time each |')
    print('|---|---|---|---|---|')
    for valve in ('ppr', 'hsv'):
        joint = load_joint('joint_dmsp_5_300_realistic', valve=valve)
        problem = Problem([JointLoop(joint, experiment, seed=1)],
                          load_controller(f'sofc_joint_{valve}', joint))
        (one, busy_ms), (all_cores, _) = per_minute(problem, 1), per_minute(problem, cores)
        print(f'| sofc | {valve} | {one:,.0f} | {all_cores:,.0f} | {busy_ms:.2f} |', flush=True)
    silent = dict.fromkeys(('pressure_noise_pa', 'contraction_noise_m', 'force_noise_n'), 0.0)
    joint = load_joint('joint_dmsp_5_300')
    joint = joint.with_(flexor=joint.flexor.with_(sensors=silent),
                        extensor=joint.extensor.with_(sensors=silent))
    loop = JointLoop(joint, experiment, latency_s=LATENCY_S, angle_noise_rad=0.0,
                     angle_step_rad=0.0)
    _, busy_ms = per_minute(Problem([loop], load_controller('sofc_joint_ppr', joint)), 1)
    compiled = loop.run(load_controller('sofc_joint_ppr', joint)).value
    angle, seconds = joint_with_solve_ivp(
        joint, load_controller('sofc_joint_ppr', joint), experiment)
    away = float(np.max(np.abs(angle - compiled)))
    print('\n## The same joint, nominal and without noise, one thread\n')
    print('| who | ms of processor time each | largest difference of the angle |')
    print('|---|---|---|')
    print(f'| pam_actuation | {busy_ms:.2f} | – |')
    print(f'| scipy.integrate.solve_ivp in a Python loop | {1e3 * seconds:,.0f} '
          f'| {away:.2g} rad |')
    print(f'\nRatio {1e3 * seconds / busy_ms:,.0f}.')


def command_line():
    """Return the parser of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[1])
    results_page.add_write(parser, 'tuning_speed')
    return parser


def main():
    """Print the tables as Markdown."""
    with results_page.printed(command_line().parse_args(), __file__):
        of_a_rig(os.cpu_count())
        of_a_joint(os.cpu_count())


def of_a_rig(cores):
    """Print both tables of a single muscle."""
    experiment = load_experiment(EXPERIMENT)
    print(f'## Rollouts of {experiment.duration_s:g} s a minute, realistic rig\n')
    print(f'| controller | valve | 1 thread | {cores} threads '
          '| ms of processor time each |')
    print('|---|---|---|---|---|')
    for valve in ('ppr', 'hsv'):
        rig = load_rig('dmsp_5_300_realistic', valve=valve)
        loop = ClosedLoop(rig, experiment, seed=1)
        for name in (f'sofc_{valve}', 'pid', 'lqi'):
            problem = Problem([loop], load_controller(name, rig))
            (one, busy_ms), (all_cores, _) = per_minute(problem, 1), per_minute(problem, cores)
            print(f'| {problem.controller.kind} | {valve} | {one:,.0f} | {all_cores:,.0f} '
                  f'| {busy_ms:.2f} |', flush=True)

    rig = load_rig('dmsp_5_300_hanging_mass').with_(sensors=dict.fromkeys(
        ('pressure_noise_pa', 'contraction_noise_m', 'force_noise_n'), 0.0))
    controller = load_controller(PEER_CONTROLLER, rig)
    loop = ClosedLoop(rig, experiment, latency_s=LATENCY_S)
    problem = Problem([loop], controller)
    own, _ = per_minute(problem, 1)
    compiled = loop.run(controller).contraction_m
    contraction, seconds = with_solve_ivp(rig, controller, experiment)
    away = 1e6 * float(np.max(np.abs(contraction - compiled)))
    print('\n## The same PID loop on the nominal rig, without noise, one thread\n')
    print('| who | rollouts a minute | largest difference of the contraction |')
    print('|---|---|---|')
    print(f'| pam_actuation | {own:,.0f} | – |')
    print(f'| scipy.integrate.solve_ivp in a Python loop | {60.0 / seconds:,.1f} '
          f'| {away:.2f} um |')
    print(f'\nRatio {own * seconds / 60.0:,.0f}.')


if __name__ == '__main__':
    main()
