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

"""What a recording can tell: of the valve, of muscle and load, or of the muscle alone."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import math

import numpy as np
from pam_sim.errors import InputError
from pam_sim.gap.criteria import CRITERIA
from pam_sim.gap.data.duties import once_a_period
from pam_sim.gap.data.health import missed_pulses
from pam_sim.gap.data.holes import stretches
from pam_sim.gap.data.noise import noise_of
from pam_sim.gap.data.recording import Recording
from pam_sim.gap.data.resting import at_rest_m, Rest, rest_of
from pam_sim.gap.data.signals import FIELD, ordered, recorded_valve, SIGNALS, tells_of
from pam_sim.gap.subsystems.mechanics import MechanicsProblem
from pam_sim.gap.subsystems.problem import SubsystemProblem
from pam_sim.gap.subsystems.valve import ValveProblem
from pam_sim.identify.quiet import drawn_pa, with_quiet_pressure
from pam_sim.response import Response
from pam_sim.rig import Rig
from pam_sim.run import Run

LEAST_SAMPLES = 20
LEAST_DURATION_S = 1.0
STILL_SHARE = 0.003          # of the stroke; a contraction that moves less is held by something
ONE_LENGTH = ('the rig states one length, so the recordings without a contraction count as held '
              'at the same one; pam characterise --held-mm takes several lengths')
MOVING_PA = 20e3             # a pressure that moves more would move a free muscle
# Of pressure by bore. At full length a muscle pulls with about six times that.
FOLLOWS_SHARE = 0.2
NEVER_LIFTED = ('neither contraction nor force follows the pressure, so the load was never '
                'lifted; raise the pressure')


@dataclass(frozen=True)
class Offer:
    """
    What one recording offers.

    Parameters
    ----------
    path : str
        Of the recording.
    recording : Recording
    valve, mechanics : bool
        Whether command and pressure, or pressure and what the muscle does, are there.
    kind : str
        For people.
    added_kg : float
        Known mass that hung on the load in addition.
    rest : Rest or None
        When the load rested on a stop; the force of then is left out.
    holds_certify : bool
        Whether every fifth block stays untouched, for a validation.

    """

    path: str
    recording: Recording
    valve: bool
    mechanics: bool
    kind: str
    added_kg: float = 0.0
    rest: Rest | None = None
    holds_certify: bool = False


class LoadedMechanics(MechanicsProblem):
    """Muscle and load, with known masses hung on the load in some of the recordings."""

    def __init__(self, rig: Rig, offers: Sequence[Offer]) -> None:
        self._added_kg = [one.added_kg for one in offers]
        self._raw = [one.recording for one in offers]
        self._raw_noise = [noise_of(raw.time_s['pressure'], raw.measured['pressure'])
                           for raw in self._raw]
        super().__init__(rig, [with_quiet_pressure(*one) for one in zip(
            self._raw, self._raw_noise)], sum(one.holds_certify for one in offers))

    def _disturb(self, random: np.random.Generator | None) -> None:
        super()._disturb(None)
        if random is not None:
            self._noise_pa = [drawn_pa(*one, random) for one in zip(
                self._raw, self._raw_noise, self.recordings)]

    def _simulate(self, rig: Rig, index: int, numbers: Mapping[str, float]) -> Response:
        recording = self.recordings[index]
        if recording.driven and 'contraction' not in recording.stamp_ns:
            # Nobody recorded the length: it is a number of the rig, perhaps an unknown one.
            recording.hold(rig.parameters.get('contraction_m', 0.0))
        added = self._added_kg[index]
        if added:
            rig = rig.with_(parameters={'mass_kg': rig.parameters['mass_kg'] + added})
        return super()._simulate(rig, index, numbers)


def offers_of(runs: Sequence[Run], rig: Rig, added_kg: Sequence[float],
              spare_certify: bool = False) -> tuple[list[Offer], list[str]]:
    """
    Return (offers, remarks) of recordings; each stretch between holes is an offer of its own.

    Parameters
    ----------
    runs : sequence of Run
        Recordings.
    rig : pam_sim.Rig
        Its valve and load say which topics matter.
    added_kg : sequence of float
        Known mass on the load in addition, for each recording.
    spare_certify : bool
        Whether every fifth block of the first recording stays untouched.

    Raises
    ------
    InputError
        As of ``offer_of``, and where holes leave no stretch.

    """
    offers, remarks = [], []
    for index, (run, mass) in enumerate(zip(runs, added_kg)):
        parts, text = stretches(_usable(run), LEAST_DURATION_S, rig.is_driven)
        if not parts:
            raise InputError(text, run.path or 'recording')
        offers += [replace(offer_of(one, rig, mass), holds_certify=spare_certify and index == 0)
                   for one in parts]
        remarks += [text] if text else []
    lengths_unseen = [run for run in runs if 'contraction' not in run]
    if rig.load == 'isometric' and len(lengths_unseen) > 1:
        remarks.append(ONE_LENGTH)
    return offers, remarks


def offer_of(run: Run, rig: Rig, added_kg: float = 0.0) -> Offer:
    """
    Return what a recording offers.

    Parameters
    ----------
    run : Run
        With a pressure.
    rig : pam_sim.Rig
        Its valve and load say which topics matter.
    added_kg : float
        Known mass on the load in addition to that of the rig.

    Raises
    ------
    InputError
        There is no pressure, or neither a command nor a contraction or force. There is no
        command, and the load was never lifted. The command is that of another valve.

    """
    where, run = run.path or 'recording', _usable(run)
    if 'pressure' not in run:
        raise InputError(
            f'has no `pressure` of at least {LEAST_SAMPLES} finite values, each at another time; '
            'every number is found from the pressure', where)
    recorded = recorded_valve(run)
    if recorded and recorded != rig.valve:
        raise InputError(f'the recording is of a rig with valve {recorded}, the model has '
                         f'{rig.valve}', where)
    command = tells_of(run, rig.valve)
    contraction, force = (name in run for name in ('contraction', 'force'))
    is_still = _is_held(run, rig)
    held = rig.is_driven or (force and is_still)
    isometric_m = rig.parameters.get('contraction_m') if rig.load == 'isometric' else None
    rests = held and not rig.is_driven and _never_lifted(run, rig)
    mechanics = not rests and (
        (force and (contraction or isometric_m is not None)) if held else contraction)
    missed = missed_pulses(run['valve_signal'].stamp_ns) if command and rig.valve == 'hsv' else ''
    valve = command and not missed and (
        rig.valve == 'ppr' or contraction or isometric_m is not None)
    if missed and not mechanics:
        raise InputError(missed, where)
    if not (valve or mechanics):
        if rests:
            raise InputError(NEVER_LIFTED, where)
        needs = 'a `force`' if held else 'a `contraction`'
        raise InputError(f'has a pressure alone: {needs} tells of muscle and load, a '
                         f'`valve_signal` of the valve (a `pressure_command` too, behind a '
                         'regulator)', where)
    rest = None if held else rest_of(run, rig, added_kg=added_kg)
    recording = Recording(once_a_period(run, rig), rig.valve, held,
                          0.0 if isometric_m is None else isometric_m, rest)
    if recording.grid_s[-1] < LEAST_DURATION_S:
        raise InputError(f'has {recording.grid_s[-1]:.2f} s in which all its signals are there; '
                         f'at least {LEAST_DURATION_S:g} s are needed', where)
    muscle = ('muscle and load' if not held else
              'muscle at a measured length' if contraction and not is_still else
              'muscle at a held length')
    kinds = [word for word, there in (('valve', valve), (muscle, mechanics)) if there]
    kind = ' and '.join(kinds) + (f'; the valve is left out: {missed}' if missed else '') + (
        f'; muscle and load are left out: {NEVER_LIFTED}' if rests else '')
    return Offer(where, recording, valve, mechanics, kind, added_kg, rest)


def _usable(run: Run) -> Run:
    """Return a run without readings that are not finite, and without topics of too few others."""
    topics = dict(run.topics)
    for name in SIGNALS:
        series = topics.pop(name, None)
        if series is None or FIELD[name] not in series.values:
            continue
        good = np.isfinite(series.values[FIELD[name]])
        if np.unique(series.stamp_ns[good]).size >= LEAST_SAMPLES:
            topics[name] = series if good.all() else replace(
                series, stamp_ns=series.stamp_ns[good],
                values={key: value[good] for key, value in series.values.items()})
    return replace(run, topics=topics)


def _is_held(run: Run, rig: Rig) -> bool:
    """Tell whether the length stays while the pressure moves."""
    if 'contraction' not in run:
        return False
    moved = float(np.ptp(np.percentile(run['contraction']['contraction_m'], (1, 99))))
    pressed = float(np.ptp(run['pressure']['pressure_pa']))
    return moved < STILL_SHARE * rig.muscle.stroke_m and pressed > MOVING_PA


def _never_lifted(run: Run, rig: Rig) -> bool:
    """
    Tell whether a still load rests on its stop and the force does not follow the pressure.

    In a simulation the load cell reads the weight there. On a real rig it reads the muscle.
    """
    reach_m = CRITERIA.rest_stroke_share * rig.muscle.stroke_m
    contraction = ordered(run['contraction'], FIELD['contraction'])[1]
    if np.median(np.abs(contraction - at_rest_m(contraction, rig, reach_m, CRITERIA))) > reach_m:
        return False
    at, pressure = ordered(run['pressure'], FIELD['pressure'])
    stamp, force = ordered(run['force'], FIELD['force'])
    if force.size < LEAST_SAMPLES:
        return False
    covariance = np.cov(np.interp(stamp, at, pressure), force)
    bore_m2 = math.pi / 4.0 * rig.muscle.bore_m ** 2
    return bool(abs(covariance[0, 1]) < FOLLOWS_SHARE * bore_m2 * covariance[0, 0])


def problems_of(rig: Rig, offers: Sequence[Offer]) -> list[SubsystemProblem]:
    """Return the subsystems of several recordings."""
    found: list[SubsystemProblem] = []
    valve = [one for one in offers if one.valve]
    if valve:
        found.append(ValveProblem(rig, [one.recording for one in valve],
                                  sum(one.holds_certify for one in valve)))
    mechanics = [one for one in offers if one.mechanics]
    if mechanics:
        found.append(LoadedMechanics(rig, mechanics))
    return found
