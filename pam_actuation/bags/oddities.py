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
What is odd in the messages of a recording, as sentences, and who is told of it.

``Oddities`` gathers the sentences while a bag is loaded. ``recording_remarks`` returns those
that belong beside every answer that rests on recordings.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from pam_actuation.bags.ending import ending_of
from pam_sim.annotations import IntArray
from pam_sim.run import Run

# Messages of two senders, or of two threads, overtake each other by less.
USUAL_BACK_S = 0.1


@dataclass
class Oddities:
    """
    Sentences on anything odd.

    Parameters
    ----------
    remarks : list of str
        What the reader of an answer should know.
    left_out : list of str
        Those of the remarks that tell of lost messages.
    notes : list of str
        What is harmless.

    """

    remarks: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def leave_out(self, sentence: str) -> None:
        """Take a sentence on messages that are left out."""
        self.remarks.append(sentence)
        self.left_out.append(sentence)

    def tell_stamps(self, name: str, stamp_ns: IntArray) -> None:
        """Tell of the stamps of a topic, in the order of recording, that go back or repeat."""
        steps_ns = np.diff(stamp_ns)
        backward = int((steps_ns < 0).sum())
        if backward:
            most_s = -1e-9 * float(steps_ns.min())
            (self.remarks if most_s > USUAL_BACK_S else self.notes).append(
                f'{name}: the stamp goes back {backward} times, by up to {most_s:.3g} s; sorted '
                'by stamp.')
        same = int((np.diff(np.sort(stamp_ns) if backward else stamp_ns) == 0).sum())
        if same:
            self.notes.append(f'{name}: {same} messages repeat the stamp before, kept.')


def run_remarks(run: Run) -> list[str]:
    """Return what to know of a recording: remarks of loading, and how far it came if not far."""
    ending = ending_of(run.metadata)
    return [*getattr(run, 'remarks', ()), *[ending.sentence] * ending.early]


def recording_remarks(runs: Iterable[Run]) -> list[str]:
    """Return what to know of the recordings behind an answer, each sentence with its path."""
    return [f'{run.path}: {remark}' for run in runs for remark in run_remarks(run)]
