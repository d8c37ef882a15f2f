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
How far a run came and why it ended: what a bag says of it, and the sentence for people.

Texts of the ``pam_experiment`` record: ``planned_length_s`` from the start on;
``reached_length_s``, ``ended`` and, where there is more to say, ``ended_because`` and
``vented_meanwhile`` once the run is over. Recordings without them are told apart from those that
came to their end.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
import json
from pathlib import Path
from typing import Any

from pam_actuation.messages import LEVEL_ERROR, Status
from pam_sim.files import StrPath, write_text
from pam_sim.joint.parameters import SIDES
from pam_sim.units import often

PLANNED, REACHED, ENDED, BECAUSE, VENTS = (
    'planned_length_s', 'reached_length_s', 'ended', 'ended_because', 'vented_meanwhile')
COMPLETE, INTERRUPTED, ERROR, VENTED = 'complete', 'interrupted', 'error', 'vented'
EARLY = {INTERRUPTED: 'interrupted', ERROR: 'an error ended it', VENTED: 'the driver had vented'}
# How the reference generator begins its word on /diagnostics.
PLAYING, FINISHED = 'playing', 'finished'
ENDED_FILE, RECORDED_FILE = 'ended.json', 'recorded.json'     # between session and recorder
REFERENCE, DRIVER = 'reference_generator', 'valve_driver'


@dataclass(frozen=True)
class Ending:
    """
    How a run ended.

    Parameters
    ----------
    planned_s, reached_s : float or None
        Length of the experiment and how much of it was run [s]; None: not recorded.
    ended : str
        'complete', 'interrupted', 'error', 'vented', or '' where that is not recorded.
    because : str
        What else is known of the reason.
    vents : str
        How often and why drivers vented in the run and followed again, '' where none did.

    """

    planned_s: float | None = None
    reached_s: float | None = None
    ended: str = ''
    because: str = ''
    vents: str = ''

    @property
    def early(self) -> bool:
        """Return whether the run is known not to have come to its planned end."""
        return self.ended in EARLY

    @property
    def sentence(self) -> str:
        """Return one sentence for people."""
        if self.planned_s is None and not self.ended:
            return 'Length planned: not recorded.'
        planned = 'an unknown length' if self.planned_s is None else f'{self.planned_s:.1f} s'
        if self.early:
            reached = '' if self.reached_s is None else f' after {self.reached_s:.1f} s'
            because = f' ({self.because.rstrip(".")})' if self.because else ''
            return f'Stopped early{reached} of {planned} planned: {EARLY[self.ended]}{because}.'
        if self.ended == COMPLETE:
            return f'Ran to its end: {planned} planned and reached.'
        return f'Planned: {planned}; how it ended is not recorded.'

    def texts(self) -> dict[str, str]:
        """Return the entries of the ``pam_experiment`` record that are known."""
        found = {PLANNED: _number(self.planned_s), REACHED: _number(self.reached_s),
                 ENDED: self.ended, BECAUSE: ' '.join(self.because.split()),
                 VENTS: ' '.join(self.vents.split())}
        return {key: text for key, text in found.items() if text}


def tell_recorder(folder: StrPath, ended: str, because: str) -> None:
    """Write down for the recorder, in its ``notes_folder``, why a run ended early."""
    write_text(Path(folder) / ENDED_FILE, json.dumps({'ended': ended, 'because': because}))


def ending_of(metadata: Mapping[str, str] | None) -> Ending:
    """Return the Ending that a ``pam_experiment`` record tells; entries of others are not used."""
    metadata = metadata or {}
    ended = metadata.get(ENDED, '')
    return Ending(
        _seconds(metadata.get(PLANNED)), _seconds(metadata.get(REACHED)),
        ended if ended in EARLY or ended == COMPLETE else '', metadata.get(BECAUSE, ''),
        metadata.get(VENTS, ''))


class EndWatch:
    """
    Follows a run by what reference generator and valve driver say on /diagnostics.

    The live recorder hears them, and so does a simulation.

    Parameters
    ----------
    namespace : str
        Namespace of the muscle or joint.

    """

    def __init__(self, namespace: str) -> None:
        self._reference = f'{namespace}/{REFERENCE}'
        self._drivers = {f'{namespace}/{place}{DRIVER}'
                         for place in ('', *(f'{side}/' for side in SIDES))}
        # The newest word of the reference while it plays.
        self._heard_ns: int | None = None
        self._elapsed_s: float | None = None
        self._vented: dict[str, tuple[float, str]] = {}      # driver: when [s], and why
        # Driver: begin and length [s] of each vent that is over, and why.
        self._vents: dict[str, list[tuple[float, float, str]]] = {}
        self._failed = ''
        self._over = self._finished = False

    def hear(self, statuses: Iterable[Status]) -> None:
        """Take the statuses of one diagnostic message."""
        for status in statuses:
            if self._over:
                return
            if status.name == self._reference:
                self._hear_reference(status)
            elif status.name in self._drivers:
                self._hear_driver(status)

    def _hear_reference(self, status: Status) -> None:
        elapsed_s = _seconds(dict(status.values).get('elapsed_s'))
        if status.message.startswith((PLAYING, FINISHED)):
            self._heard_ns, self._elapsed_s = status.stamp_ns, elapsed_s
            self._over = self._finished = status.message.startswith(FINISHED)
            self._failed = ''
        elif self._heard_ns is not None:
            self._over = True
            self._elapsed_s = elapsed_s or self._elapsed_s
            self._failed = status.message if status.level >= LEVEL_ERROR else ''
        elif status.level >= LEVEL_ERROR:
            self._failed = status.message       # it did not begin

    def _hear_driver(self, status: Status) -> None:
        if self._heard_ns is None:
            return
        at_s = max((self._elapsed_s or 0.0) + (status.stamp_ns - self._heard_ns) * 1e-9, 0.0)
        if status.level >= LEVEL_ERROR:
            self._vented.setdefault(status.name, (at_s, status.message))
        elif status.name in self._vented:
            since_s, why = self._vented.pop(status.name)
            self._vents.setdefault(status.name, []).append((since_s, at_s - since_s, why))

    @property
    def faults(self) -> list[str]:
        """Return a sentence ``NODE: REASON`` on each vent of a driver, equal ones once."""
        told = [(since_s, f'{name}: {why}') for name, vents in self._vents.items()
                for since_s, _, why in vents]
        told += [(since_s, f'{name}: {why}') for name, (since_s, why) in self._vented.items()]
        return list(dict.fromkeys(text for _, text in sorted(told)))

    def _vents_in_words(self) -> str:
        found = []
        for name, vents in sorted(self._vents.items()):
            first_s, _, why = vents[0]
            found.append(f'{name} vented {often(len(vents))}, '
                         f'{sum(one[1] for one in vents):.1f} s in all, '
                         f'first at {first_s:.1f} s: {why}')
        return '; '.join(found)

    def ending(self, planned_s: float | None, told: Ending | None = None) -> Ending:
        """
        Return the Ending of the run.

        Parameters
        ----------
        planned_s : float or None
            Length of the experiment [s].
        told : Ending, optional
            What whoever ended the run knows; it goes before what was heard.

        """
        return replace(self._ending(planned_s, told), vents=self._vents_in_words())

    def _ending(self, planned_s: float | None, told: Ending | None) -> Ending:
        reached_s = self._elapsed_s
        if reached_s is not None and planned_s is not None:
            reached_s = planned_s if self._finished else min(reached_s, planned_s)
        if told is not None and told.early:
            because = self._failed if told.ended == ERROR else ''
            return Ending(planned_s, reached_s or 0.0, told.ended, because or told.because)
        if self._heard_ns is None and told is None and not self._failed:
            return Ending(planned_s)                # nobody played an experiment
        if self._vented:
            vented_s, why = min(self._vented.values())
            return Ending(planned_s, min(vented_s, reached_s or vented_s), VENTED, why)
        if self._failed:
            return Ending(planned_s, reached_s or 0.0, ERROR, self._failed)
        return Ending(planned_s, reached_s, COMPLETE if self._finished else INTERRUPTED)


def _number(value: float | None) -> str:
    return '' if value is None else f'{value:.3f}'


def _seconds(text: Any) -> float | None:
    """Return a text as a length of time, None where it is none."""
    try:
        value = float(text)
    except (TypeError, ValueError):
        return None
    return value if 0.0 <= value < float('inf') else None
