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

"""The figures of docs/explanation/muscle.md, drawn from simulations of the DMSP-5-300 rig."""

from pathlib import Path

from generate.drawing import BLUE, drawn, GREEN, GREY, ORANGE, PALETTE, RED
import numpy as np
import pam_sim
from pam_sim.muscle.registry import make_law
from pam_sim.units import P_ATM_PA

NOMINAL, REALISTIC = 'dmsp_5_300_hanging_mass', 'dmsp_5_300_realistic'
GRAVITY = 9.80665
PRESSURES_KPA = (100, 200, 300, 400, 500, 600)


def draw(folder: Path) -> dict[str, str]:
    """Draw all figures into a folder; return the numbers that the page states."""
    nominal, realistic = pam_sim.load_rig(NOMINAL), pam_sim.load_rig(REALISTIC)
    return {
        **_static_map(nominal, folder), **_laws(nominal, folder), **_dynamics(nominal, folder),
        **_loops(realistic, folder), **_creep(realistic, folder), **_valves(folder)}


def _static_map(rig, folder):
    law, weight_n = rig.muscle.law.law, rig.parameters['mass_kg'] * GRAVITY
    strain = np.linspace(0.0, 0.21, 421)
    with drawn(folder / 'muscle_static.svg', 2) as (left, right):
        for kpa, colour in zip(PRESSURES_KPA, PALETTE):
            force = law.force_n(1e3 * kpa, strain, 'allow')
            pulls = force > 0.0
            left.plot(100.0 * strain[pulls], force[pulls], color=colour, label=f'{kpa} kPa')
        left.axhline(weight_n, color=RED, lw=1.0, ls='--')
        left.text(20.9, weight_n + 3.0, '5 kg', color=RED, ha='right')
        left.set(xlabel='contraction, %', ylabel='force, N', ylim=(0, 145), xlim=(0, 21),
                 title='pressure held')
        left.legend(title='gauge pressure')
        kpa = np.linspace(0.0, 600.0, 601)
        for mass_kg, colour in ((1.0, PALETTE[0]), (3.0, PALETTE[2]), (5.0, RED), (8.0, GREY)):
            at_rest = rig.static_contraction_m(P_ATM_PA + 1e3 * kpa, mass_kg * GRAVITY)
            right.plot(kpa, 1e3 * np.maximum(at_rest, 0.0), color=colour, label=f'{mass_kg:g} kg')
        right.set(xlabel='gauge pressure, kPa', ylabel='contraction, mm', title='load held')
        right.legend()
    at = {k: 1e3 * rig.static_contraction_m(P_ATM_PA + 1e3 * k) for k in (300, 301, 600, 601)}
    lift_off_kpa = 1e-3 * (rig.static_pressure_pa(0.0) - P_ATM_PA)
    ends = float(strain[np.flatnonzero(law.force_n(600e3, strain, 'allow') > 0.0)[-1]])
    return {
        'force at rest and 600 kPa': f'{float(law.force_n(600e3, 0.0)):.0f} N',
        'contraction without load at 600 kPa': f'{100.0 * ends:.0f} %',
        'lift-off of 5 kg': f'{lift_off_kpa:.0f} kPa',
        'contraction with 5 kg at 600 kPa': f'{at[600]:.0f} mm',
        'gain at 300 kPa': f'{at[301] - at[300]:.3f} mm/kPa',
        'gain at 600 kPa': f'{at[601] - at[600]:.3f} mm/kPa'}


def _laws(rig, folder):
    strain = np.linspace(0.0, 0.25, 251)
    laws = (('fitted map (ours)', rig.muscle.law.law, BLUE, '-'),
            ('Chou and Hannaford, eq. 4.6', make_law('chou_hannaford', muscle='dmsp_5'),
             ORANGE, '-'),
            ('Tondu and Lopez, eq. 4.7', make_law('tondu_lopez', muscle='dmsp_5_constant_k'),
             GREEN, '-'))
    ends = {}
    with drawn(folder / 'muscle_laws.svg', 2, sharey=True) as axes:
        for axis, kpa in zip(axes, (300, 600)):
            for label, law, colour, line in laws:
                force = law.force_n(1e3 * kpa, strain, 'allow')
                pulls = force > 0.0
                axis.plot(100.0 * strain[pulls], force[pulls], line, color=colour, label=label)
                ends[label, kpa] = 100.0 * strain[pulls][-1]
            axis.set(xlabel='contraction, %', title=f'{kpa} kPa', ylim=(0, 150))
        axes[0].set_ylabel('force, N')
        axes[1].legend()
    return {
        'map ends at 300 kPa': f'{ends[laws[0][0], 300]:.0f} %',
        'eq. 4.6 at 300 kPa': f'{ends[laws[1][0], 300]:.0f} %'}


def _dynamics(rig, folder):
    kpa = np.linspace(260.0, 600.0, 341)
    contraction_m = rig.static_contraction_m(P_ATM_PA + 1e3 * kpa)
    law, length_m, step = rig.muscle.law.law, rig.muscle.length_m, 1e-5
    stiffness = np.array([
        np.subtract(*law.force_n(1e3 * p, [(x - step) / length_m, (x + step) / length_m], 'allow'))
        for p, x in zip(kpa, contraction_m)]) / (2.0 * step)
    own_hz = np.sqrt(stiffness / rig.parameters['mass_kg']) / (2.0 * np.pi)
    response = rig.simulate(np.full(2500, 4.5), initial_pressure_pa=P_ATM_PA + 400e3)
    with drawn(folder / 'muscle_dynamics.svg', 2) as (left, right):
        left.plot(kpa, 1e-3 * stiffness, color=BLUE)
        left.set(xlabel='gauge pressure, kPa', ylabel='stiffness, kN/m', ylim=(0, None),
                 title='stiffness with 5 kg, and its frequency')
        twin = left.twinx()
        twin.plot(kpa, own_hz, color=ORANGE, ls='--')
        twin.set_ylabel('frequency, Hz', color=ORANGE)
        twin.set_ylim(0.0, None)
        twin.grid(False)
        right.plot(response.time_s, 1e3 * response.contraction_m, color=BLUE)
        right.set(xlabel='time, s', ylabel='contraction, mm', title='4 V to 4.5 V, nominal rig')
    return {
        'stiffness at 300 kPa': f'{1e-3 * np.interp(300.0, kpa, stiffness):.1f} kN/m',
        'stiffness at 600 kPa': f'{1e-3 * np.interp(600.0, kpa, stiffness):.1f} kN/m',
        'frequency at 300 kPa': f'{np.interp(300.0, kpa, own_hz):.1f} Hz',
        'frequency at 600 kPa': f'{np.interp(600.0, kpa, own_hz):.1f} Hz'}


def _loops(rig, folder):
    # Slow: 20 s for one way. Creep is left out, so that friction is seen alone.
    only_friction = rig.with_(effects=[one for one in rig.effects if one.name == 'hysteresis'])
    turns = np.interp(np.arange(0.0, 170e3),
                      1e3 * np.array([0, 10, 30, 50, 70, 85, 100, 115, 130, 150, 170]),
                      [2.0, 2.0, 5.5, 2.5, 5.5, 3.5, 5.0, 3.5, 5.5, 2.5, 2.5])
    run = only_friction.simulate(turns, initial_pressure_pa=P_ATM_PA + 200e3)
    kpa, mm = 1e-3 * (run.pressure_pa - P_ATM_PA), 1e3 * run.contraction_m
    up, down = slice(50_500, 69_800), slice(30_500, 49_800)
    rising = np.interp(12.0, mm[up], kpa[up])
    falling = np.interp(12.0, mm[down][::-1], kpa[down][::-1])
    upper = np.interp(420.0, kpa[down][::-1], mm[down][::-1])
    apart_mm = upper - np.interp(420.0, kpa[up], mm[up])
    with drawn(folder / 'muscle_hysteresis.svg', 2) as (left, right):
        left.plot(run.time_s[::200], kpa[::200], color=GREY)
        left.set(xlabel='time, s', ylabel='gauge pressure, kPa', title='what is asked')
        still = rig.with_(effects=[])
        right.plot(kpa[10_000::50], mm[10_000::50], color=BLUE, label='with friction')
        grid = np.linspace(240.0, 550.0, 200)
        right.plot(grid, 1e3 * still.static_contraction_m(P_ATM_PA + 1e3 * grid), color=RED,
                   ls='--', lw=1.0, label='without')
        right.set(xlabel='gauge pressure, kPa', ylabel='contraction, mm', title='5 kg')
        right.legend()
    return {'loop in pressure': f'{rising - falling:.0f} kPa',
            'loop in contraction': f'{apart_mm:.1f} mm'}


def _creep(rig, folder):
    seconds = 60
    curves = {}
    for name in ('creep', None):
        one = rig.with_(effects=[e for e in rig.effects if e.name == name])
        volt = np.full(1000 * seconds, 4.5)
        volt[:2000] = 3.5
        curves[name] = one.simulate(volt, initial_pressure_pa=P_ATM_PA + 350e3)
    time_s = curves['creep'].time_s - 2.0
    mm = 1e3 * curves['creep'].contraction_m
    with drawn(folder / 'muscle_creep.svg', 2) as (left, right):
        for axis in (left, right):
            axis.plot(time_s[::20], mm[::20], color=BLUE, label='with creep')
            axis.plot(time_s[::20], 1e3 * curves[None].contraction_m[::20], color=RED, ls='--',
                      lw=1.0, label='without')
            axis.set(xlabel='time after the step, s', ylabel='contraction, mm')
        left.legend(loc='lower right')
        left.set(title='3.5 V to 4.5 V', xlim=(-2, 58))
        right.set(title='the same, close', xlim=(1, 58), ylim=(13.1, 13.6))
    further_mm = np.subtract(*np.interp([57.0, 2.0], time_s, mm))
    return {'creep from 2 s to 57 s': f'{further_mm:.2f} mm'}


def _valves(folder):
    volt = np.concatenate([np.full(200, 1.0), np.full(1300, 5.0), np.full(1500, 1.0)])
    duty = np.zeros((3000, 2))
    duty[200:500, 0], duty[1500:, 1] = 1.0, 1.0
    regulator = pam_sim.load_rig(REALISTIC, valve='ppr').simulate(
        volt, initial_pressure_pa=P_ATM_PA + 100e3)
    held = 'isometric'
    pair_rig = pam_sim.load_rig(REALISTIC, valve='hsv').with_(load=held)
    fill = pair_rig.simulate(duty, contraction_m=0.01, initial_pressure_pa=P_ATM_PA + 100e3)
    kpa = {'regulator': 1e-3 * (regulator.pressure_pa - P_ATM_PA),
           'pair': 1e-3 * (fill.pressure_pa - P_ATM_PA)}
    with drawn(folder / 'muscle_valves.svg', 2) as (left, right):
        left.plot(regulator.time_s, kpa['regulator'], color=BLUE, label='pressure')
        left.step(np.append(regulator.time_s[:-1], 3.0), 100.0 * np.append(volt, 1.0), color=GREY,
                  ls='--', lw=1.0, label='command')
        left.set(xlabel='time, s', ylabel='gauge pressure, kPa', title='regulator, 1 V to 5 V')
        right.plot(fill.time_s, kpa['pair'], color=ORANGE, label='pressure')
        right.axvspan(0.2, 0.5, color='#dcfce7', label='fill open')
        right.axvspan(1.5, 3.0, color='#fee2e2', label='vent open')
        right.set(xlabel='time, s', title='on/off pair: fill, shut, vent')
        left.legend()
        right.legend(loc='upper right')
    time_s = regulator.time_s
    lag_s = time_s[np.argmax(kpa['regulator'] > 100.0 + 0.632 * 400.0)] - 0.2
    filling_s = (np.argmax(kpa['pair'] > 400.0) - np.argmax(kpa['pair'] > 200.0)) / 1e3
    from_500 = kpa['pair'][1500:]
    venting_s = (np.argmax(from_500 < 200.0) - np.argmax(from_500 < 400.0)) / 1e3
    return {'regulator to 63 %': f'{lag_s:.2f} s', 'pair 200 to 400 kPa': f'{filling_s:.2f} s',
            'pair 400 to 200 kPa': f'{venting_s:.2f} s'}
